//! Regions and trajectory drawn over pairs of coordinates.
//!
//! A region {q : A q ≤ b} is shown by its slice through its own centre: the other coordinates stand at the centre's
//! values, and the rectangle of the axes is clipped by one half-plane a row. The trajectory is projected.

use crate::report::svg::{Scale, escaped, place, points, tick_label};
use ipc_types::artefact::{Mode, Region, TrajectoryFile};
use std::fmt::Write;

const WIDTH: f64 = 480.0;
const HEIGHT: f64 = 340.0;
const LEFT: f64 = 56.0;
const RIGHT: f64 = 10.0;
const TOP: f64 = 10.0;
const FOOT: f64 = 42.0;
/// Pairs of coordinates beyond these are not drawn; seven joints would give 21.
const MAX_PANELS: usize = 6;

/// One SVG a pair of coordinates.
pub fn slices(
    coordinates: &[String],
    regions: &[Region],
    trajectory: Option<&TrajectoryFile>,
    ranges: &[(f64, f64)],
) -> String {
    let n = coordinates.len();
    let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
    let panels = pairs.take(MAX_PANELS).map(|pair| panel(coordinates, regions, trajectory, ranges, pair));
    // Many regions lie over each other: the more there are, the paler each is.
    let opacity = (1.2 / regions.len().max(1) as f64).min(0.1);
    format!("<div class=\"panels\" style=\"--fill:{opacity:.3}\">{}</div>", panels.collect::<String>())
}

/// Ranges of the coordinates: the axis-parallel rows that every region carries are the joint limits.
pub fn ranges(
    coordinates: &[String],
    regions: &[Region],
    trajectory: Option<&TrajectoryFile>,
) -> Vec<(f64, f64)> {
    let mut ranges = vec![(f64::INFINITY, f64::NEG_INFINITY); coordinates.len()];
    let mut include = |idx: usize, value: f64| {
        if let Some(range) = ranges.get_mut(idx) {
            *range = (range.0.min(value), range.1.max(value));
        }
    };
    for region in regions {
        for (row, offset) in region.A.iter().zip(&region.b) {
            let mut entries = row.iter().enumerate().filter(|(_, value)| **value != 0.0);
            if let (Some((idx, value)), None) = (entries.next(), entries.next()) {
                include(idx, offset / value);
            }
        }
    }
    for row in trajectory.map(TrajectoryFile::rows).unwrap_or_default() {
        row.q.iter().enumerate().for_each(|(idx, value)| include(idx, *value));
    }
    ranges
}

fn panel(
    coordinates: &[String],
    regions: &[Region],
    trajectory: Option<&TrajectoryFile>,
    ranges: &[(f64, f64)],
    (i, j): (usize, usize),
) -> String {
    let (across, up) = (padded(ranges[i]), padded(ranges[j]));
    let x = Scale::new(across, (LEFT, WIDTH - RIGHT));
    let y = Scale::new(up, (HEIGHT - FOOT, TOP));
    let (name_x, name_y) = (escaped(&coordinates[i]), escaped(&coordinates[j]));
    let mut svg = format!(
        "<svg class=\"panel\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"Regions over {name_x} and {name_y}\"><rect class=\"frame\" x=\"{LEFT}\" y=\"{TOP}\" width=\"{}\" height=\"{}\"/>",
        place(WIDTH - RIGHT - LEFT),
        place(HEIGHT - FOOT - TOP)
    );
    for region in regions {
        let outline = slice(region, (i, j), across, up);
        if outline.len() < 3 {
            continue;
        }
        // The golden angle keeps neighbouring numbers apart in colour. Writing to a string does not fail.
        let hue = (region.id as f64 * 137.508) % 360.0;
        let parent = region.parent.map(|id| format!(", from candidate {id}")).unwrap_or_default();
        let _ = write!(
            svg,
            "<polygon class=\"region\" style=\"--hue:{hue:.0}\" points=\"{}\"><title>region {}{parent}: {} faces</title></polygon>",
            points(outline.iter().map(|p| (x.at(p[0]), y.at(p[1])))),
            region.id,
            region.b.len()
        );
    }
    for segment in trajectory.map(|t| t.segments.as_slice()).unwrap_or_default() {
        let class = if segment.mode == Mode::Transfer { "transfer" } else { "transit" };
        let places =
            segment.pieces.iter().flatten().filter(|q| q.len() > j).map(|q| (x.at(q[i]), y.at(q[j])));
        let _ = write!(svg, "<polyline class=\"{class}\" points=\"{}\"/>", points(places));
    }
    if let Some(t) = trajectory {
        let ends = [
            (t.segments.first().and_then(|s| s.pieces.first()?.first()), "start"),
            (t.segments.last().and_then(|s| s.pieces.last()?.last()), "goal"),
        ];
        for (q, class) in ends {
            if let Some(q) = q.filter(|q| q.len() > j) {
                let _ = write!(
                    svg,
                    "<circle class=\"{class}\" cx=\"{}\" cy=\"{}\" r=\"4.5\"><title>{class}</title></circle>",
                    place(x.at(q[i])),
                    place(y.at(q[j]))
                );
            }
        }
    }
    axes(&mut svg, &x, &y, &name_x, &name_y);
    svg.push_str("</svg>");
    svg
}

fn axes(svg: &mut String, x: &Scale, y: &Scale, name_x: &str, name_y: &str) {
    for tick in x.ticks(5) {
        let _ = write!(
            svg,
            "<text class=\"label\" text-anchor=\"middle\" x=\"{}\" y=\"{}\">{}</text>",
            place(x.at(tick)),
            place(HEIGHT - FOOT + 16.0),
            tick_label(tick)
        );
    }
    for tick in y.ticks(5) {
        let _ = write!(
            svg,
            "<text class=\"label\" text-anchor=\"end\" x=\"{}\" y=\"{}\" dy=\"3.5\">{}</text>",
            place(LEFT - 6.0),
            place(y.at(tick)),
            tick_label(tick)
        );
    }
    let _ = write!(
        svg,
        "<text class=\"name\" text-anchor=\"middle\" x=\"{}\" y=\"{}\">{name_x}</text><text class=\"name\" text-anchor=\"middle\" transform=\"translate(12,{}) rotate(-90)\">{name_y}</text>",
        place((LEFT + WIDTH - RIGHT) / 2.0),
        place(HEIGHT - 6.0),
        place((TOP + HEIGHT - FOOT) / 2.0)
    );
}

/// Corners of the slice of a region through its centre, in order; fewer than three if it has no area.
fn slice(region: &Region, (i, j): (usize, usize), across: (f64, f64), up: (f64, f64)) -> Vec<[f64; 2]> {
    let mut corners = vec![[across.0, up.0], [across.1, up.0], [across.1, up.1], [across.0, up.1]];
    for (row, offset) in region.A.iter().zip(&region.b) {
        if row.len() <= j || region.center.len() < row.len() {
            return Vec::new();
        }
        let others = row.iter().zip(&region.center).enumerate().filter(|(k, _)| *k != i && *k != j);
        let rest = offset - others.map(|(_, (a, c))| a * c).sum::<f64>();
        corners = clipped(&corners, [row[i], row[j]], rest);
    }
    corners
}

/// The part of a convex polygon with `a·p ≤ b`.
fn clipped(corners: &[[f64; 2]], a: [f64; 2], b: f64) -> Vec<[f64; 2]> {
    let excess = |p: &[f64; 2]| a[0] * p[0] + a[1] * p[1] - b;
    let mut kept = Vec::with_capacity(corners.len() + 1);
    for (idx, p) in corners.iter().enumerate() {
        let next = &corners[(idx + 1) % corners.len()];
        let (here, there) = (excess(p), excess(next));
        if here <= 0.0 {
            kept.push(*p);
        }
        if (here < 0.0 && there > 0.0) || (here > 0.0 && there < 0.0) {
            let s = here / (here - there);
            kept.push([p[0] + s * (next[0] - p[0]), p[1] + s * (next[1] - p[1])]);
        }
    }
    kept
}

/// The range with a little air around it.
fn padded((lower, upper): (f64, f64)) -> (f64, f64) {
    let air = 0.03 * (upper - lower);
    (lower - air, upper + air)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle_prism() -> Region {
        // x ≥ 0, y ≥ 0, x + y ≤ z over z in [0, 2], centre at z = 1.
        Region {
            id: 7,
            parent: Some(2),
            A: vec![
                vec![-1.0, 0.0, 0.0],
                vec![0.0, -1.0, 0.0],
                vec![1.0, 1.0, -1.0],
                vec![0.0, 0.0, 1.0],
                vec![0.0, 0.0, -1.0],
            ],
            b: vec![0.0, 0.0, 0.0, 2.0, 0.0],
            center: vec![0.25, 0.25, 1.0],
            method: "test".into(),
            certified: true,
            margin: 0.0,
        }
    }

    #[test]
    fn the_slice_through_the_centre_of_a_wedge_is_a_triangle() {
        let mut corners = slice(&triangle_prism(), (0, 1), (-5.0, 5.0), (-5.0, 5.0));
        corners.dedup();
        corners.sort_by(|a, b| a.partial_cmp(b).unwrap());
        assert_eq!(corners, [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]]);
    }

    #[test]
    fn an_empty_slice_has_no_corners() {
        assert!(clipped(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [1.0, 0.0], -1.0).is_empty());
    }

    #[test]
    fn joint_limits_come_from_axis_parallel_rows() {
        let names = ["x".to_string(), "y".to_string(), "z".to_string()];
        let ranges = ranges(&names, &[triangle_prism()], None);
        assert_eq!(ranges[2], (0.0, 2.0));
        assert_eq!(ranges[0], (0.0, 0.0));
    }

    #[test]
    fn seven_joints_do_not_flood_the_page() {
        let names: Vec<String> = (0..7).map(|k| format!("q{k}")).collect();
        let page = slices(&names, &[], None, &[(0.0, 1.0); 7]);
        assert_eq!(page.matches("<svg").count(), MAX_PANELS);
    }
}
