//! The plan over the length travelled: one strip a coordinate, transfers shaded, grasps and releases marked.

use crate::report::svg::{Scale, escaped, place, points, tick_label};
use ipc_types::artefact::{Mode, TrajectoryFile, TrajectoryRow};
use std::fmt::Write;

const WIDTH: f64 = 1000.0;
const LEFT: f64 = 118.0;
const RIGHT: f64 = 12.0;
const STRIP: f64 = 88.0;
const GAP: f64 = 16.0;
const FOOT: f64 = 40.0;
const HEAD: f64 = 24.0;

/// Inline SVG of the timeline. `ranges` are the joint limits that the axes show, one a coordinate.
pub fn timeline(trajectory: &TrajectoryFile, ranges: &[(f64, f64)]) -> String {
    let rows = trajectory.rows();
    let Some(last) = rows.last() else {
        return "<p class=\"note\">Nothing moves: the start is the goal.</p>".into();
    };
    let n = trajectory.coordinates.len();
    let height = HEAD + n as f64 * (STRIP + GAP) + FOOT;
    let time = Scale::new((0.0, last.t), (LEFT, WIDTH - RIGHT));
    let mut svg = format!(
        "<svg class=\"timeline\" viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"Each coordinate over the length travelled\">"
    );
    let bottom = HEAD + n as f64 * (STRIP + GAP) - GAP;
    let spans = mode_spans(&rows);
    transfers(&mut svg, &spans, &time, bottom);
    for (idx, name) in trajectory.coordinates.iter().enumerate() {
        let top = HEAD + idx as f64 * (STRIP + GAP);
        strip(&mut svg, name, idx, &rows, ranges.get(idx).copied(), &time, top);
    }
    for tick in time.ticks(8) {
        let x = place(time.at(tick));
        // Writing to a string does not fail, here and below.
        let _ = write!(
            svg,
            "<line class=\"tick\" x1=\"{x}\" x2=\"{x}\" y1=\"{}\" y2=\"{}\"/><text class=\"label\" text-anchor=\"middle\" x=\"{x}\" y=\"{}\">{}</text>",
            place(bottom),
            place(bottom + 5.0),
            place(bottom + 18.0),
            tick_label(tick)
        );
    }
    let _ = write!(
        svg,
        "<text class=\"label\" text-anchor=\"end\" x=\"{}\" y=\"{}\">length travelled</text></svg>",
        place(WIDTH - RIGHT),
        place(bottom + 34.0)
    );
    svg
}

/// A stretch of the rows in one mode: mode, first and last row.
struct Span<'a> {
    mode: Mode,
    first: &'a TrajectoryRow,
    last: &'a TrajectoryRow,
}

fn mode_spans(rows: &[TrajectoryRow]) -> Vec<Span<'_>> {
    let mut spans: Vec<Span<'_>> = Vec::new();
    for row in rows {
        match spans.last_mut() {
            Some(span) if span.mode == row.mode => span.last = row,
            _ => spans.push(Span { mode: row.mode, first: row, last: row }),
        }
    }
    spans
}

fn transfers(svg: &mut String, spans: &[Span<'_>], time: &Scale, bottom: f64) {
    for (idx, span) in spans.iter().filter(|span| span.mode == Mode::Transfer).enumerate() {
        let (from, to) = (time.at(span.first.t), time.at(span.last.t));
        let _ = write!(
            svg,
            "<rect class=\"held\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"><title>grasp {}</title></rect><text class=\"grasp\" text-anchor=\"middle\" x=\"{}\" y=\"{}\">{}</text>",
            place(from),
            place(HEAD - 6.0),
            place((to - from).max(1.0)),
            place(bottom - HEAD + 6.0),
            idx + 1,
            place((from + to) / 2.0),
            place(HEAD - 11.0),
            idx + 1
        );
    }
}

fn strip(
    svg: &mut String,
    name: &str,
    coordinate_idx: usize,
    rows: &[TrajectoryRow],
    range: Option<(f64, f64)>,
    time: &Scale,
    top: f64,
) {
    let value = |row: &TrajectoryRow| row.q.get(coordinate_idx).copied().unwrap_or(0.0);
    let seen =
        rows.iter().map(value).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, u), v| (l.min(v), u.max(v)));
    let range = range.unwrap_or(seen);
    let scale = Scale::new((range.0.min(seen.0), range.1.max(seen.1)), (top + STRIP - 4.0, top + 4.0));
    let _ = write!(
        svg,
        "<rect class=\"frame\" x=\"{LEFT}\" y=\"{}\" width=\"{}\" height=\"{STRIP}\"/><text class=\"name\" x=\"0\" y=\"{}\">{}</text>",
        place(top),
        place(WIDTH - RIGHT - LEFT),
        place(top + STRIP / 2.0 + 4.0),
        escaped(name)
    );
    for tick in scale.ticks(3) {
        let y = place(scale.at(tick));
        let _ = write!(
            svg,
            "<line class=\"grid\" x1=\"{LEFT}\" x2=\"{}\" y1=\"{y}\" y2=\"{y}\"/><text class=\"label\" text-anchor=\"end\" x=\"{}\" y=\"{y}\" dy=\"3.5\">{}</text>",
            place(WIDTH - RIGHT),
            place(LEFT - 7.0),
            tick_label(tick)
        );
    }
    let line = points(rows.iter().map(|row| (time.at(row.t), scale.at(value(row)))));
    let _ = write!(svg, "<polyline class=\"path\" points=\"{line}\"/>");
    for span in mode_spans(rows).iter().filter(|span| span.mode == Mode::Transfer) {
        let mut mark = |class: &str, row: &TrajectoryRow, what: &str| {
            let _ = write!(
                svg,
                "<circle class=\"{class}\" cx=\"{}\" cy=\"{}\" r=\"3\"><title>{what}: {} = {:.5}</title></circle>",
                place(time.at(row.t)),
                place(scale.at(value(row))),
                escaped(name),
                value(row)
            );
        };
        mark("on", span.first, "grasp");
        mark("off", span.last, "release");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ipc_types::artefact::Segment;

    fn straight(mode: Mode, from: [f64; 2], to: [f64; 2]) -> Segment {
        Segment {
            mode,
            pieces: vec![vec![from.to_vec(), to.to_vec()]],
            regions: vec![1],
            length: 0.0,
            lower_bound: 0.0,
            certified: true,
        }
    }

    #[test]
    fn every_transfer_is_shaded_and_marked_in_every_strip() {
        let segments = vec![
            straight(Mode::Transit, [0.0, 0.0], [1.0, 0.0]),
            straight(Mode::Transfer, [1.0, 0.0], [1.0, 2.0]),
            straight(Mode::Transit, [1.0, 2.0], [0.0, 2.0]),
        ];
        let file = TrajectoryFile {
            coordinates: vec!["a<b".into(), "c".into()],
            segments,
            length: 4.0,
            duration: 4.0,
        };
        let svg = timeline(&file, &[(0.0, 1.0), (0.0, 2.0)]);
        assert_eq!(svg.matches("class=\"held\"").count(), 1);
        assert_eq!(svg.matches("class=\"on\"").count(), 2);
        assert_eq!(svg.matches("class=\"off\"").count(), 2);
        assert!(svg.contains("a&lt;b") && !svg.contains("a<b"));
    }

    #[test]
    fn a_plan_without_motion_says_so() {
        let file = TrajectoryFile {
            coordinates: vec!["a".into()],
            segments: Vec::new(),
            length: 0.0,
            duration: 0.0,
        };
        assert!(timeline(&file, &[]).contains("Nothing moves"));
    }
}
