//! Random instances against all simple sequences of regions, each solved as a restriction.

use super::{manipulation, solve, thorough, with_faces};
use crate::leaf_frame::LeafFrame;
use crate::leaf_graph::{Contact, LeafGraph};
use crate::restriction::shortest_through;
use crate::segment::SegmentOutcome;
use convex_sets::HPolyhedron;
use manipulation::{Manipulation, PathMode};
use nalgebra::DVector;
use proptest::prelude::*;

/// Least length over all simple paths of vertices, by enumeration; +∞ if none has a path.
fn brute_force(manipulation: &Manipulation, mode: PathMode, s: &DVector<f64>, g: &DVector<f64>) -> f64 {
    let frame = LeafFrame::new(manipulation.kept_forms(mode), s);
    let graph = LeafGraph::new(manipulation, mode, frame, g);
    let mut best = f64::INFINITY;
    let mut stack: Vec<Vec<usize>> = (0..graph.vertices.len())
        .filter(|&v| graph.vertices[v].start == Contact::Inside)
        .map(|v| vec![v])
        .collect();
    while let Some(sequence) = stack.pop() {
        let last = sequence[sequence.len() - 1];
        if graph.vertices[last].goal == Contact::Inside
            && let Some(path) = shortest_through(&graph, &sequence, g, manipulation.free(mode))
        {
            best = best.min(path.length());
        }
        for next in 0..graph.vertices.len() {
            if !sequence.contains(&next) && graph.usable(last, next).is_some() {
                stack.push([&sequence[..], &[next]].concat());
            }
        }
    }
    best
}

/// A box about `center`, with a corner cut off in a random direction.
fn region(center: &[f64], half: &[f64], cut: &[f64], share: f64) -> HPolyhedron {
    let lower: Vec<f64> = center.iter().zip(half).map(|(c, h)| c - h).collect();
    let upper: Vec<f64> = center.iter().zip(half).map(|(c, h)| c + h).collect();
    let at_center: f64 = cut.iter().zip(center).map(|(a, c)| a * c).sum();
    let reach: f64 = cut.iter().zip(half).map(|(a, h)| a.abs() * h).sum();
    with_faces(super::cuboid(&lower, &upper), &[(cut, at_center + share * reach)])
}

fn regions(n: usize, count: usize) -> impl Strategy<Value = Vec<HPolyhedron>> {
    let vector = |low: f64, high: f64| proptest::collection::vec(low..high, n);
    proptest::collection::vec((vector(-2.0, 2.0), vector(0.4, 1.6), vector(-1.0, 1.0), 0.3..1.0_f64), count)
        .prop_filter_map("a direction to cut", |drawn| {
            drawn
                .into_iter()
                .map(|(center, half, cut, share)| {
                    (cut.iter().map(|c| c * c).sum::<f64>() > 1e-2)
                        .then(|| region(&center, &half, &cut, share))
                })
                .collect()
        })
}

fn check(manipulation: &Manipulation, s: &DVector<f64>, g: &DVector<f64>) -> Result<(), TestCaseError> {
    let best = brute_force(manipulation, PathMode::Transit, s, g);
    match solve(manipulation, PathMode::Transit, s.as_slice(), g.as_slice()) {
        SegmentOutcome::Found(found) => {
            let length = found.path.length();
            prop_assert!(best.is_finite());
            prop_assert!(found.lower_bound <= best + 1e-12, "bound {} above {best}", found.lower_bound);
            // The best of all is at most the gap away, and bends differ by the margin.
            let gap = length - found.lower_bound;
            prop_assert!(length <= best + gap + 1e-6, "length {length}, best {best}, gap {gap}");
            prop_assert!(length >= best - 1e-6, "length {length} below best {best}");
            prop_assert!(gap <= thorough().tol_gap * length + 1e-6, "gap {gap} of {length}, best {best}");
        }
        SegmentOutcome::NoPath { .. } => prop_assert!(best.is_infinite()),
        outcome => prop_assert!(best.is_infinite(), "{outcome:?}"),
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// In the plane, without kept forms.
    #[test]
    fn plane(regions in regions(2, 6), from in 0..6_usize, to in 0..6_usize) {
        let spaces = manipulation(&regions, &[], &[]);
        let center = |j: usize| regions[j].chebyshev_center().unwrap().center;
        check(&spaces, &center(from), &center(to))?;
    }

    /// In four dimensions with leaves of dimension two; start and goal on the grid of the plan.
    #[test]
    fn leaves_in_four_dimensions(regions in regions(4, 6), from in 0..6_usize, to in 0..6_usize) {
        let forms: [&[f64]; 2] = [&[1.0, -1.0, 0.0, 0.0], &[0.0, 0.0, 0.0, 1.0]];
        let spaces = manipulation(&regions, &forms, &[]);
        let snap = |x: f64| (x * (1_u64 << 40) as f64).round() / (1_u64 << 40) as f64;
        let center = |j: usize| regions[j].chebyshev_center().unwrap().center;
        let s = center(from).map(snap);
        let mut g = center(to).map(snap);
        // Onto the leaf of s.
        g[0] = g[1] + (s[0] - s[1]);
        g[3] = s[3];
        let inside = |q: &DVector<f64>| regions.iter().any(|P| P.contains(q, -1e-9));
        prop_assume!(inside(&s) && inside(&g));
        check(&spaces, &s, &g)?;
    }
}
