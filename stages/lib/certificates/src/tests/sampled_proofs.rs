//! Certificates of random scenes cell by cell and edge by edge, against samples by the collision library.

use super::random_scene::{random_scene, with_symmetric_ends};
use super::regions::{candidate, certify, samples};
use crate::path::{PathCertifier, PathWorkspace, PieceVerdict};
use collision::CollisionChecker;
use ipc_types::artefact::{Cell, PairProof};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::Scene;

/// The leaves of a tree of cells with their boxes.
fn leaves<'a>(cells: &'a [Cell], scene: &Scene) -> Vec<(Vec<f64>, Vec<f64>, &'a Cell)> {
    let mut open = vec![(scene.lower().as_slice().to_vec(), scene.upper().as_slice().to_vec())];
    let mut found = Vec::new();
    for cell in cells {
        let (lower, upper) = open.pop().expect("a tree that is complete");
        if let Cell::Split { coordinate, at } = cell {
            let j = usize::from(*coordinate);
            let (mut below, mut above) = (upper.clone(), lower.clone());
            (below[j], above[j]) = (*at, *at);
            open.push((above, upper));
            open.push((lower, below));
        } else {
            found.push((lower, upper, cell));
        }
    }
    assert!(open.is_empty());
    found
}

fn scenes(seed: u64) -> [Scene; 2] {
    [random_scene(seed), with_symmetric_ends(random_scene(seed), seed)]
}

#[test]
fn no_certified_cell_holds_a_collision() {
    let (mut n_boxes, mut n_in_region) = (0, 0);
    let (mut n_by_corners, mut n_by_tangents) = (0, 0);
    for (seed, scene) in (0..240).flat_map(|seed| scenes(seed).map(|scene| (seed, scene))) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let clearance = if seed % 3 == 1 { 0.01 } else { 0.0 };
        let Some(candidate) = candidate(&scene, &mut rng, 0.12) else { continue };
        let Some(region) = certify(&scene, &candidate, clearance) else { continue };
        let checker = CollisionChecker::with_clearances(&scene, |_| clearance);
        let inside = samples(&region.polyhedron, &scene, &mut rng);
        for (pair_idx, pair) in region.certificate.pairs.iter().enumerate() {
            let PairProof::Swept(proof) = &pair.proof else { panic!("by swept hulls") };
            let leaves = leaves(&proof.cells, &scene);
            // The whole box of a cell that needs no row of the region.
            for (lower, upper, cell) in &leaves {
                match cell {
                    Cell::Separated { g, multipliers, .. } if g.is_empty() && multipliers.is_empty() => {
                        n_boxes += 1;
                    }
                    Cell::Corners { near, multipliers, .. } if multipliers.is_empty() => {
                        n_by_corners += 1;
                        n_by_tangents += usize::from(near.iter().any(|near| !near.tangent.is_empty()));
                    }
                    _ => continue,
                }
                for sample in 0..30 {
                    let q: Vec<f64> = (0..scene.dim())
                        .map(|j| {
                            let t = rng.random::<f64>();
                            let t = if sample < 10 { t.round() } else { t };
                            (lower[j] + t * (upper[j] - lower[j])).clamp(lower[j], upper[j])
                        })
                        .collect();
                    assert!(checker.pair_is_free(pair_idx, &q), "scene {seed}, pair {pair_idx}: {q:?}");
                }
            }
            // Samples of the region lie in cells that are said to be apart, and are.
            for q in &inside {
                let holds = |lower: &[f64], upper: &[f64]| {
                    q.iter().zip(lower).zip(upper).all(|((q, lower), upper)| lower <= q && q <= upper)
                };
                // Vertices of the programme may lie outside the limits by rounding.
                let Some((.., cell)) = leaves.iter().find(|(lower, upper, _)| holds(lower, upper)) else {
                    continue;
                };
                let is_on_a_face = !region.polyhedron.contains(q, -1e-9);
                assert!(
                    is_on_a_face || matches!(cell, Cell::Separated { .. } | Cell::Corners { .. }),
                    "{q:?} is said not to be there"
                );
                assert!(checker.pair_is_free(pair_idx, q.as_slice()), "scene {seed}, pair {pair_idx}: {q:?}");
                n_in_region += 1;
            }
        }
    }
    assert!(n_boxes > 100 && n_in_region > 10_000, "{n_boxes} cells, {n_in_region} samples of regions");
    assert!(
        n_by_corners > 100 && n_by_tangents >= 5,
        "{n_by_corners} by corners, {n_by_tangents} by tangents"
    );
}

/// Point of the Bézier curve.
fn at(control_points: &[Vec<f64>], t: f64) -> Vec<f64> {
    let mut points = control_points.to_vec();
    while points.len() > 1 {
        let between =
            |pair: &[Vec<f64>]| pair[0].iter().zip(&pair[1]).map(|(a, b)| (1.0 - t) * a + t * b).collect();
        points = points.windows(2).map(between).collect();
    }
    points.swap_remove(0)
}

#[test]
fn no_certified_edge_holds_a_collision() {
    let (mut n_certified, mut n_refuted) = (0, 0);
    let mut workspace = PathWorkspace::default();
    for (seed, scene) in (0..60).flat_map(|seed| scenes(seed).map(|scene| (seed, scene))) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let clearance = if seed % 3 == 1 { 0.01 } else { 0.0 };
        let certifier = PathCertifier::new(&scene, |_| clearance);
        let checker = CollisionChecker::with_clearances(&scene, |_| clearance);
        for n_points in [2, 2, 2, 3, 4, 5] {
            let control_points: Vec<Vec<f64>> = (0..n_points)
                .map(|_| scene.coordinates.iter().map(|c| rng.random_range(c.lower..=c.upper)).collect())
                .collect();
            match certifier.certify_piece(&control_points, &mut workspace) {
                PieceVerdict::Certified => {
                    n_certified += 1;
                    for k in 0..=400 {
                        let q = at(&control_points, f64::from(k) / 400.0);
                        assert_eq!(checker.colliding_pair(&q), None, "scene {seed}: {q:?}");
                    }
                    // Around the ends of intervals, where bounds are tightest against nothing.
                    for interval in workspace.proof(certifier.n_pairs()).iter().flatten() {
                        assert_eq!(checker.colliding_pair(&at(&control_points, interval.t_0)), None);
                    }
                }
                PieceVerdict::Collision(found) => {
                    n_refuted += 1;
                    assert!(
                        checker.colliding_pairs(&found.q).contains(&found.pair),
                        "scene {seed}: {found:?}"
                    );
                }
                other => panic!("scene {seed}: neither certified nor refuted: {other:?}"),
            }
        }
    }
    assert!(n_certified > 200 && n_refuted > 50, "{n_certified} certified, {n_refuted} refuted");
}
