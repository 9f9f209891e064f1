//! The straight line from start to goal, if regions cover it: the shortest path that there can be.

use crate::leaf_frame::LeafFrame;
use crate::path::Path;
use convex_sets::HPolyhedron;
use manipulation::contains_exactly;
use nalgebra::DVector;

/// Bends are put this far from where an interval of the line ends, at the least, as a share of the line. Erring
/// side: a larger value misses covers by thin overlaps.
const TOL_SHARE: f64 = 1e-9;

/// Part of the line s + t (g − s) in a polytope: from and to this t, in ordinary arithmetic.
#[derive(Debug, Clone, Copy)]
struct Interval {
    region_idx: usize,
    from: f64,
    to: f64,
}

/// The straight path from the frame's start to `g` inside `free`, verified; `None` if none was found. One region if
/// one holds both ends, else as few as possible.
pub fn straight_path(free: &[Option<HPolyhedron>], frame: &LeafFrame, g: &DVector<f64>) -> Option<Path> {
    let s = &frame.s;
    let holds = |region_idx: usize, q: &DVector<f64>| {
        free[region_idx].as_ref().is_some_and(|P| contains_exactly(P, q))
    };
    if let Some(region_idx) = (0..free.len()).find(|&j| holds(j, s) && holds(j, g)) {
        return Some(Path { regions: vec![region_idx], points: vec![s.clone(), g.clone()] });
    }
    let intervals: Vec<Interval> = free
        .iter()
        .enumerate()
        .filter_map(|(region_idx, P)| P.as_ref().and_then(|P| interval(region_idx, P, s, g)))
        .collect();
    let farthest = |intervals: &mut dyn Iterator<Item = Interval>| {
        intervals.fold(None, |best: Option<Interval>, next| match best {
            Some(best) if best.to >= next.to => Some(best),
            _ => Some(next),
        })
    };
    let mut current = farthest(&mut intervals.iter().copied().filter(|i| holds(i.region_idx, s)))?;
    let mut path = Path { regions: vec![current.region_idx], points: vec![s.clone()] };
    let mut at = 0.0_f64;
    let u_goal = frame.u_of(g);
    while !holds(current.region_idx, g) {
        let onward = |i: &Interval| i.from < current.to - 2.0 * TOL_SHARE && i.to > current.to + TOL_SHARE;
        let last = |i: &Interval| i.from < current.to - 2.0 * TOL_SHARE && holds(i.region_idx, g);
        let next = intervals
            .iter()
            .copied()
            .find(last)
            .or_else(|| farthest(&mut intervals.iter().copied().filter(onward)))?;
        at = 0.5 * (next.from.max(at) + current.to);
        let bend = frame.place(&(&u_goal * at))?;
        path.points.push(bend);
        path.regions.push(next.region_idx);
        // The last region holds the goal; before it, each reaches farther by more than the tolerance: this ends.
        current = next;
    }
    path.points.push(g.clone());
    path.is_verified(free, frame).then_some(path)
}

fn interval(region_idx: usize, P: &HPolyhedron, s: &DVector<f64>, g: &DVector<f64>) -> Option<Interval> {
    let along = &P.A * (g - s);
    let room = &P.b - &P.A * s;
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for (&slope, &room) in along.iter().zip(room.iter()) {
        // A row that hardly changes along the line decides as a whole; verification looks again.
        if slope.abs() < 1e-14 {
            if room < -1e-12 {
                return None;
            }
        } else if slope > 0.0 {
            to = to.min(room / slope);
        } else {
            from = from.max(room / slope);
        }
    }
    (from < to).then_some(Interval { region_idx, from, to })
}
