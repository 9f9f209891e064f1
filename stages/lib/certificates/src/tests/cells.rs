//! The bounds on a cell against configurations in it.

use super::random_scene::random_scene;
use crate::cell::CellBox;
use crate::control_net::ControlNet;
use crate::pair_model::PairModel;
use crate::row_program::{RowProgram, Verdict};
use crate::rows::{RowBound, Rows};
use crate::separating_normal::{PlacedCore, gap_along, separating_normal};
use convex_sets::HPolyhedron;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A cell about a random configuration, angles up to half-width `half`, lengths in proportion.
pub fn random_cell(scene: &scene::Scene, half: f64, rng: &mut ChaCha8Rng) -> CellBox {
    let mut cell = CellBox { lower: Vec::new(), upper: Vec::new() };
    for coordinate in &scene.coordinates {
        let range = coordinate.upper - coordinate.lower;
        let h = half * rng.random::<f64>() * range / 5.0;
        let m = coordinate.lower + h + rng.random::<f64>() * (range - 2.0 * h);
        cell.lower.push(m - h);
        cell.upper.push(m + h);
    }
    cell
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// n·(x_A − x_B) − g·δ ≥ κ for every configuration of the cell, for every joint kind, shape and frame.
    #[test]
    fn bodies_stay_above_the_affine_bound(seed in 0_u64..1 << 40, half in 0.0..1.2_f64) {
        let scene = random_scene(seed);
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 1);
        let cell = random_cell(&scene, half, &mut rng);
        let center = cell.centers();
        let mut net = ControlNet::default();
        for pair in scene.collision_pairs() {
            let model = PairModel::new(&scene, pair, 0.0);
            for frame_idx in 0..model.frames.len() {
                let plane = model.plane(&mut net, frame_idx, &cell);
                for sample in 0..40 {
                    let q: Vec<f64> = (0..center.len())
                        .map(|j| {
                            // Corners and edges as well as the inside.
                            let t = match (sample, rng.random_range(0..4)) {
                                (0, _) | (_, 3) => rng.random::<f64>(),
                                (_, choice) => f64::from(choice) / 2.0,
                            };
                            cell.lower[j] + t * (cell.upper[j] - cell.lower[j])
                        })
                        .collect();
                    let [a, b] = [0, 1].map(|k| {
                        let side = &model.frames[frame_idx].sides[k];
                        let (R, p) = side.pose(&q);
                        PlacedCore { core: side.core, R, p }
                    });
                    let gap = gap_along(&a, &b, &plane.n) - model.radius;
                    let along: f64 = (0..q.len()).map(|j| plane.g[j] * (q[j] - center[j])).sum();
                    prop_assert!(gap >= plane.kappa[0] - 1e-12, "{gap} < {}", plane.kappa[0]);
                    prop_assert!(gap - along >= plane.kappa[1] - 1e-12, "{} < {}", gap - along, plane.kappa[1]);
                }
            }
        }
    }

    /// Seen from every frame the gap at one configuration is the same, and it agrees with the collision library.
    #[test]
    fn gap_is_that_of_the_collision_library(seed in 0_u64..1 << 40) {
        let scene = random_scene(seed);
        let checker = collision::CollisionChecker::new(&scene);
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 2);
        let q = random_cell(&scene, 0.0, &mut rng).centers();
        for (pair_idx, pair) in scene.collision_pairs().into_iter().enumerate() {
            let model = PairModel::new(&scene, pair, 0.0);
            let distance = checker.pair_distance(pair_idx, &q);
            let gap = model.gap(&q);
            // A gap along one direction is never more than the distance, which the library gives from below.
            prop_assert!(gap <= distance.max(0.0) + 1e-4, "{gap} > {distance}");
            if distance <= 0.0 {
                prop_assert!(gap <= 1e-6);
            } else {
                prop_assert!(gap > 0.0 || distance < 1e-6, "{gap} although {distance} apart");
            }
            // Short of the distance it is by design between boxes (axes only). Elsewhere the iteration ends early at
            // rims close to contact: 1e-5 m at most in 180,000 pairs of random scenes.
            let is_box = |body: usize| matches!(scene.bodies[body].shape, scene::Shape::Box { .. });
            let both_boxes = is_box(pair.body_a) && is_box(pair.body_b);
            prop_assert!(both_boxes || distance <= 0.0 || gap >= distance - 1e-4, "{gap} short of {distance}");
            for frame_idx in 0..model.frames.len() {
                let other = model.tangent(frame_idx, &q).gap;
                prop_assert!((other - gap).abs() < 1e-4, "{gap}, but {other} from frame {frame_idx}");
            }
        }
    }

    /// Multipliers bound every sample of the cell that satisfies the rows; the vertex attains the bound.
    #[test]
    fn row_bounds_hold_on_samples(seed in 0_u64..1 << 40) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let n = rng.random_range(1..6);
        let mut number = |size: f64| size * (2.0 * rng.random::<f64>() - 1.0);
        let m = 2 * n + 3;
        let A = DMatrix::from_fn(m, n, |_, _| number(1.0));
        let A = DMatrix::from_fn(m, n, |i, j| A[(i, j)] / A.row(i).norm());
        let rows = Rows::new(&HPolyhedron { A, b: DVector::from_fn(m, |_, _| number(0.5) + 0.3) });
        let g: Vec<f64> = (0..n).map(|_| number(1.0)).collect();
        let cell = CellBox { lower: vec![-1.0; n], upper: (0..n).map(|j| 0.5 + j as f64).collect() };
        let mut program = RowProgram::default();
        let verdict = program.minimize(&rows, rows.active(), &cell, &g, f64::INFINITY);
        let (multipliers, is_empty) = match verdict {
            Verdict::Bound(multipliers) => (multipliers, false),
            Verdict::Infeasible(multipliers) => (multipliers, true),
        };
        let bound = rows.bound(&cell, &g, &multipliers);
        let is_proven_empty = is_empty && rows.excludes(&cell, &multipliers);
        for _ in 0..200 {
            let q: Vec<f64> = (0..n)
                .map(|j| cell.lower[j] + rng.random::<f64>() * (cell.upper[j] - cell.lower[j]))
                .collect();
            if (0..rows.len()).all(|row| rows.slack(row, &q) >= 0.0) {
                let value: f64 = (0..n).map(|j| g[j] * (q[j] - cell.center(j))).sum();
                prop_assert!(!is_proven_empty);
                prop_assert!(is_empty || value >= bound);
            }
        }
        if !is_empty {
            // The vertex it ended at attains the bound.
            let at: f64 = program.point(&cell).iter().zip(&g).enumerate().map(|(j, (q, g))| g * (q - cell.center(j))).sum();
            prop_assert!((at - bound).abs() < 1e-6 * (1.0 + bound.abs()), "{at} against {bound}");
        }
    }

    /// Programmes over rows that are loaded already, from where others ended, find what they find from the beginning.
    #[test]
    fn programmes_that_follow_others_end_where_fresh_ones_do(seed in 0_u64..1 << 40) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let n = rng.random_range(1..8);
        let m = rng.random_range(0..40);
        let mut number = |size: f64| size * (2.0 * rng.random::<f64>() - 1.0);
        let A = DMatrix::from_fn(m, n, |_, _| number(1.0));
        let A = DMatrix::from_fn(m, n, |i, j| A[(i, j)] / A.row(i).norm());
        let rows = Rows::new(&HPolyhedron { A, b: DVector::from_fn(m, |_, _| number(0.2) + 0.4) });
        let cell = CellBox { lower: vec![-1.0; n], upper: (0..n).map(|j| 0.5 + 0.2 * j as f64).collect() };
        let mut program = RowProgram::default();
        program.load(&rows, rows.active(), &cell);
        let mut basis = Vec::new();
        for _ in 0..4 {
            let g: Vec<f64> = (0..n).map(|_| number(1.0)).collect();
            let followed = rows.minimize_loaded(&mut program, &cell, &g, &basis, f64::INFINITY);
            basis = program.basis();
            let fresh = rows.minimize(&mut RowProgram::default(), &cell, &g, f64::INFINITY);
            match (followed, fresh) {
                (RowBound::Bound { value, .. }, RowBound::Bound { value: fresh, .. }) => {
                    prop_assert!((value - fresh).abs() < 1e-7 * (1.0 + fresh.abs()), "{value} against {fresh}");
                }
                (RowBound::Empty(_), RowBound::Empty(_)) => {}
                (followed, fresh) => prop_assert!(false, "{followed:?} against {fresh:?}"),
            }
        }
    }
}

/// Boxes side by side: the normal and the gap are known.
#[test]
fn normal_of_boxes_side_by_side() {
    use crate::support::Core;
    use nalgebra::{Matrix3, Vector3};
    let at = |x: f64| PlacedCore {
        core: Core::Box(1.0, 2.0, 3.0),
        R: Matrix3::identity(),
        p: Vector3::new(x, 0.5, 0.0),
    };
    let (n, gap) = separating_normal(&at(4.0), &at(0.0));
    assert_eq!((n, gap), (Vector3::x(), 2.0));
    let (n, gap) = separating_normal(&at(-1.5), &at(0.0));
    assert_eq!((n, gap), (-Vector3::x(), -0.5));
}
