//! `trajectory.csv`: the motion as a table, for spreadsheets and other programs.

use ipc_types::artefact::{Mode, TrajectoryFile};
use std::fmt::Write;

/// Points on a Bézier piece of order above 1, its ends included.
const POINTS_PER_CURVE: usize = 17;

/// Header `t,<coordinates>,mode`, then a row at each control point of order-1 pieces and 17 rows along pieces of higher
/// order. `t` is the length travelled. A segment begins with a row that repeats the last configuration with the new
/// mode, so every straight line between two rows of one mode is motion in that mode.
pub(crate) fn table(trajectory: &TrajectoryFile) -> String {
    let mut text = format!("t,{},mode\n", trajectory.coordinates.join(","));
    let mut travelled = 0.0;
    let mut last: Option<(Vec<f64>, Mode)> = None;
    for segment in &trajectory.segments {
        for point in segment.pieces.iter().flat_map(|piece| points(piece)) {
            if let Some((previous, mode)) = &last {
                let step = previous.iter().zip(&point).map(|(a, b)| (b - a) * (b - a)).sum::<f64>().sqrt();
                travelled += step;
                if step == 0.0 && *mode == segment.mode {
                    continue;
                }
            }
            row(&mut text, travelled, &point, segment.mode);
            last = Some((point, segment.mode));
        }
    }
    text
}

fn row(text: &mut String, t: f64, point: &[f64], mode: Mode) {
    let mode = match mode {
        Mode::Transit => "transit",
        Mode::Transfer => "transfer",
    };
    // Writing to a String cannot fail.
    let _ = write!(text, "{t}");
    for value in point {
        let _ = write!(text, ",{value}");
    }
    let _ = writeln!(text, ",{mode}");
}

/// Points on the piece, its ends included.
fn points(control_points: &[Vec<f64>]) -> Vec<Vec<f64>> {
    if control_points.len() <= 2 {
        return control_points.to_vec();
    }
    (0..POINTS_PER_CURVE).map(|i| at(control_points, i as f64 / (POINTS_PER_CURVE - 1) as f64)).collect()
}

/// The Bézier curve at `s` in [0, 1], by de Casteljau's scheme.
fn at(control_points: &[Vec<f64>], s: f64) -> Vec<f64> {
    let mut points = control_points.to_vec();
    while points.len() > 1 {
        points = points
            .windows(2)
            .map(|pair| pair[0].iter().zip(&pair[1]).map(|(a, b)| (1.0 - s) * a + s * b).collect())
            .collect();
    }
    points.pop().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ipc_types::artefact::Segment;

    fn segment(mode: Mode, pieces: Vec<Vec<Vec<f64>>>) -> Segment {
        let regions = vec![1; pieces.len()];
        Segment { mode, pieces, regions, length: 0.0, lower_bound: 0.0, certified: true }
    }

    #[test]
    fn a_row_at_each_control_point_and_at_each_change_of_mode() {
        let segments = vec![
            segment(Mode::Transit, vec![vec![vec![0.0], vec![1.0]], vec![vec![1.0], vec![3.0]]]),
            segment(Mode::Transfer, vec![vec![vec![3.0], vec![2.5]]]),
        ];
        let file = TrajectoryFile { coordinates: vec!["x".into()], segments, length: 3.5, duration: 3.5 };
        assert_eq!(
            table(&file),
            "t,x,mode\n0,0,transit\n1,1,transit\n3,3,transit\n3,3,transfer\n3.5,2.5,transfer\n"
        );
    }

    #[test]
    fn a_curve_is_sampled_from_end_to_end() {
        let curve = vec![vec![0.0, 0.0], vec![1.0, 2.0], vec![2.0, 0.0]];
        let samples = points(&curve);
        assert_eq!(samples.len(), POINTS_PER_CURVE);
        assert_eq!(
            (&samples[0], &samples[8], &samples[16]),
            (&vec![0.0, 0.0], &vec![1.0, 1.0], &vec![2.0, 0.0])
        );
    }
}
