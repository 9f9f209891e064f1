//! `trajectory.csv`: the joined trajectory as a table for people and for programs that read nothing else.
//!
//! Header `t,<coordinates>,mode`. The segments follow each other (thesis 2, eq. 5.9); `t` is the length travelled,
//! until limits of velocity are used. A piece of order 1 gives a row for each control point, a piece of higher order
//! a row for each of [`SAMPLES`] steps. Where the mode changes, the configuration stands twice, once for each mode.

use crate::artefact::{Mode, TrajectoryFile};
use std::fmt::Write;

/// Steps in which a piece of order above 1 is sampled.
pub const SAMPLES: usize = 16;

impl Mode {
    /// The word in files.
    pub fn word(self) -> &'static str {
        match self {
            Mode::Transit => "transit",
            Mode::Transfer => "transfer",
        }
    }
}

/// A row of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct TrajectoryRow {
    /// Length travelled.
    pub t: f64,
    /// Configuration.
    pub q: Vec<f64>,
    /// Mode.
    pub mode: Mode,
}

impl TrajectoryFile {
    /// The rows of the table, in order.
    pub fn rows(&self) -> Vec<TrajectoryRow> {
        let mut rows: Vec<TrajectoryRow> = Vec::new();
        for segment in &self.segments {
            for (piece_idx, piece) in segment.pieces.iter().enumerate() {
                for (point_idx, q) in sampled(piece).into_iter().enumerate() {
                    let last = rows.last();
                    let t = last.map_or(0.0, |row| row.t + distance(&row.q, &q));
                    // A piece begins where the one before it ended; the first of a segment is kept for its mode.
                    let repeated = point_idx == 0 && piece_idx > 0 && last.is_some_and(|row| row.q == q);
                    if !repeated {
                        rows.push(TrajectoryRow { t, q, mode: segment.mode });
                    }
                }
            }
        }
        rows
    }

    /// The whole of `trajectory.csv`. Numbers are the shortest that read back to the same value.
    pub fn csv(&self) -> String {
        let mut text = String::from("t");
        for name in &self.coordinates {
            text.push(',');
            text.push_str(name);
        }
        text.push_str(",mode\n");
        for row in self.rows() {
            // Writing to a string does not fail.
            let _ = write!(text, "{}", row.t);
            for value in &row.q {
                let _ = write!(text, ",{value}");
            }
            let _ = writeln!(text, ",{}", row.mode.word());
        }
        text
    }
}

/// Control points of a piece of order 0 or 1, samples of a piece of higher order.
fn sampled(piece: &[Vec<f64>]) -> Vec<Vec<f64>> {
    if piece.len() <= 2 {
        return piece.to_vec();
    }
    (0..=SAMPLES).map(|step| at(piece, step as f64 / SAMPLES as f64)).collect()
}

/// Point of a Bézier curve by de Casteljau's rule; the ends are the control points themselves.
fn at(piece: &[Vec<f64>], s: f64) -> Vec<f64> {
    let mut points = piece.to_vec();
    while points.len() > 1 {
        points = points
            .windows(2)
            .map(|pair| {
                let ends = pair[0].iter().zip(&pair[1]);
                ends.map(|(a, b)| if s == 1.0 { *b } else { a + s * (b - a) }).collect()
            })
            .collect();
    }
    points.swap_remove(0)
}

/// Euclidean distance in C-space units.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::artefact::Segment;

    fn segment(mode: Mode, pieces: Vec<Vec<Vec<f64>>>) -> Segment {
        let regions = vec![0; pieces.len()];
        Segment { mode, pieces, regions, length: 0.0, lower_bound: 0.0, certified: true }
    }

    fn trajectory(segments: Vec<Segment>) -> TrajectoryFile {
        let coordinates = vec!["x".into(), "y".into()];
        TrajectoryFile { coordinates, segments, length: 0.0, duration: 0.0 }
    }

    #[test]
    fn eq_5_9_segments_follow_each_other() {
        let transit = segment(
            Mode::Transit,
            vec![vec![vec![0.0, 0.0], vec![3.0, 4.0]], vec![vec![3.0, 4.0], vec![3.0, 5.0]]],
        );
        let transfer = segment(Mode::Transfer, vec![vec![vec![3.0, 5.0], vec![1.0, 5.0]]]);
        let csv = trajectory(vec![transit, transfer]).csv();
        assert_eq!(
            csv,
            "t,x,y,mode\n0,0,0,transit\n5,3,4,transit\n6,3,5,transit\n6,3,5,transfer\n8,1,5,transfer\n"
        );
    }

    #[test]
    fn curves_are_sampled_and_keep_their_ends() {
        let points = vec![vec![0.1, 0.0], vec![0.5, 1.0], vec![0.3, 0.0]];
        let rows = trajectory(vec![segment(Mode::Transit, vec![points.clone()])]).rows();
        assert_eq!(rows.len(), SAMPLES + 1);
        assert_eq!(rows[0].q, points[0]);
        assert_eq!(rows[SAMPLES].q, points[2]);
        assert!((rows[SAMPLES / 2].q[1] - 0.5).abs() < 1e-15);
        assert!(rows.windows(2).all(|pair| pair[0].t < pair[1].t));
    }

    #[test]
    fn nothing_to_do_is_a_header_alone() {
        assert_eq!(trajectory(Vec::new()).csv(), "t,x,y,mode\n");
    }
}
