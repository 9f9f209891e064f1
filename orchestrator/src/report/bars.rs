//! Bars: coverage with its confidence interval, time of each stage.

use super::svg::{Scale, escaped, place, tick_label};
use crate::quantity::{seconds, share};
use crate::results::Results;
use ipc_types::artefact::{Coverage, Estimate};
use std::fmt::Write;

const WIDTH: f64 = 1000.0;
const LEFT: f64 = 190.0;
const RIGHT: f64 = 150.0;
const ROW: f64 = 26.0;
const BAR: f64 = 18.0;

/// Coverage of candidates and of certified regions, each with its 95 % interval.
pub fn coverage(results: &Results) -> String {
    let mut rows: Vec<(String, Estimate)> = Vec::new();
    let candidates = results.candidates.as_ref().and_then(|file| file.coverage.clone());
    for (coverage, who) in [(candidates, "candidates"), (results.certified_coverage(), "certified")] {
        if let Some(Coverage { total, grasp, placement }) = coverage {
            rows.push((format!("CS_free, {who}"), total));
            rows.extend(grasp.map(|e| (format!("CG_free, {who}"), e)));
            rows.extend(placement.map(|e| (format!("CP_free, {who}"), e)));
        }
    }
    let scale = Scale::new((0.0, 1.0), (LEFT, WIDTH - RIGHT));
    let mut svg = open(rows.len(), "Coverage of the free spaces by the regions");
    for (idx, (name, Estimate(value, low, high))) in rows.iter().enumerate() {
        let y = idx as f64 * ROW + 4.0;
        row(&mut svg, name, y, &format!("{} [{}, {}]", share(*value), share(*low), share(*high)));
        rectangle(&mut svg, "rest", (y, BAR), (LEFT, WIDTH - RIGHT));
        rectangle(&mut svg, "bar", (y, BAR), (LEFT, scale.at(value.clamp(0.0, 1.0))));
        // Writing to a string does not fail, here and below.
        let _ = write!(
            svg,
            "<line class=\"whisker\" x1=\"{}\" x2=\"{}\" y1=\"{2}\" y2=\"{2}\"/>",
            place(scale.at(low.clamp(0.0, 1.0))),
            place(scale.at(high.clamp(0.0, 1.0))),
            place(y + BAR / 2.0)
        );
    }
    format!(
        "<figure class=\"scroll\">{svg}</svg><figcaption>Share of sampled free configurations inside some region, with its 95 % confidence interval.</figcaption></figure>"
    )
}

/// Time of each stage: dark wall clock, light processor time.
pub fn stages(results: &Results) -> String {
    let stages = &results.record.stages;
    if stages.is_empty() {
        return "<p class=\"note\">No stage has run.</p>".into();
    }
    let longest = stages.iter().map(|s| s.seconds.max(s.cpu_seconds)).fold(0.0, f64::max);
    let scale = Scale::new((0.0, longest), (LEFT, WIDTH - RIGHT));
    let mut svg = open(stages.len() + 1, "Time of each stage");
    for (idx, stage) in stages.iter().enumerate() {
        let y = idx as f64 * ROW + 4.0;
        row(
            &mut svg,
            stage.stage.word(),
            y,
            &format!("{} · CPU {}", seconds(stage.seconds), seconds(stage.cpu_seconds)),
        );
        rectangle(&mut svg, "cpu", (y, BAR), (LEFT, scale.at(stage.cpu_seconds)));
        rectangle(&mut svg, "bar", (y + 4.0, BAR - 8.0), (LEFT, scale.at(stage.seconds)));
    }
    let y = stages.len() as f64 * ROW + 14.0;
    for tick in scale.ticks(5) {
        let _ = write!(
            svg,
            "<text class=\"label\" text-anchor=\"middle\" x=\"{}\" y=\"{}\">{} s</text>",
            place(scale.at(tick)),
            place(y),
            tick_label(tick)
        );
    }
    format!(
        "<figure class=\"scroll\">{svg}</svg><figcaption>Solid: from first start to last end; pale behind it: processor time of all its processes. Stages overlap: certification begins while regions still come.</figcaption></figure>"
    )
}

fn open(n_rows: usize, label: &str) -> String {
    format!(
        "<svg class=\"bars\" viewBox=\"0 0 {WIDTH} {}\" role=\"img\" aria-label=\"{label}\">",
        n_rows as f64 * ROW + 4.0
    )
}

fn row(svg: &mut String, name: &str, y: f64, value: &str) {
    let baseline = place(y + BAR / 2.0 + 4.0);
    let _ = write!(
        svg,
        "<text x=\"0\" y=\"{baseline}\">{}</text><text class=\"label\" x=\"{}\" y=\"{baseline}\">{}</text>",
        escaped(name),
        place(WIDTH - RIGHT + 10.0),
        escaped(value)
    );
}

/// A bar from `from` to `to`, `y` its top and `height` its height.
fn rectangle(svg: &mut String, class: &str, (y, height): (f64, f64), (from, to): (f64, f64)) {
    let _ = write!(
        svg,
        "<rect class=\"{class}\" x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" rx=\"2\"/>",
        place(from),
        place(y),
        place((to - from).max(0.5)),
        place(height)
    );
}
