//! Paths on the reference scenes: certified and refuted, against samples by the collision checker.

use certificates::path::{PathCertifier, PathOptions, PathWorkspace, PieceVerdict, TOL_GAP, certify_path};
use collision::CollisionChecker;
use ipc_types::artefact::Mode;
use ipc_types::path_input::InputPiece;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::Scene;
use std::path::Path;

fn scene(name: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenes").join(name);
    Scene::load(&folder).expect("a reference scene")
}

fn uniform(scene: &Scene, rng: &mut ChaCha8Rng) -> Vec<f64> {
    scene.coordinates.iter().map(|c| rng.random_range(c.lower..=c.upper)).collect()
}

/// Point of the Bézier curve with these control points.
fn at(control_points: &[Vec<f64>], t: f64) -> Vec<f64> {
    let mut points = control_points.to_vec();
    while points.len() > 1 {
        let between =
            |pair: &[Vec<f64>]| pair[0].iter().zip(&pair[1]).map(|(a, b)| a + t * (b - a)).collect();
        points = points.windows(2).map(between).collect();
    }
    points.swap_remove(0)
}

/// Certifies random curves with `n_points` control points near each other; checks every verdict by samples. Numbers of
/// (certified, colliding).
fn random_curves(name: &str, n_curves: usize, n_points: usize, extent: f64, seed: u64) -> (usize, usize) {
    let scene = scene(name);
    let certifier = PathCertifier::new(&scene, |_| 0.0);
    let checker = CollisionChecker::new(&scene);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut workspace = PathWorkspace::default();
    let (mut n_certified, mut n_colliding) = (0, 0);
    for _ in 0..n_curves {
        let center = uniform(&scene, &mut rng);
        let control_points: Vec<Vec<f64>> = (0..n_points)
            .map(|_| {
                let other = uniform(&scene, &mut rng);
                center.iter().zip(&other).map(|(c, o)| c + extent * (o - c)).collect()
            })
            .collect();
        match certifier.certify_piece(&control_points, &mut workspace) {
            PieceVerdict::Certified => {
                n_certified += 1;
                for k in 0..=300 {
                    let q = at(&control_points, f64::from(k) / 300.0);
                    assert_eq!(checker.colliding_pair(&q), None, "{name}: certified, but {q:?} collides");
                }
                let proof = workspace.proof(certifier.n_pairs());
                assert!(proof.iter().all(|list| {
                    list[0].t_0 == 0.0
                        && list[list.len() - 1].t_1 == 1.0
                        && list.windows(2).all(|pair| pair[0].t_1 == pair[1].t_0)
                }));
            }
            PieceVerdict::Collision(found) => {
                n_colliding += 1;
                assert!(checker.colliding_pairs(&found.q).contains(&found.pair), "{name}: {found:?}");
                assert!(found.gap < -TOL_GAP);
                let on_curve = at(&control_points, found.t);
                assert!(on_curve.iter().zip(&found.q).all(|(a, b)| (a - b).abs() < 1e-12));
            }
            other => panic!("{name}: neither certified nor refuted: {other:?}"),
        }
    }
    (n_certified, n_colliding)
}

#[test]
fn straight_pieces_and_curves_agree_with_samples() {
    for name in ["hinge", "slider-gap", "bottle-cap-3dof", "bottle-cap-4dof", "two-rooms"] {
        for n_points in [2, 3, 5] {
            let (n_certified, n_colliding) = random_curves(name, 150, n_points, 0.3, n_points as u64);
            assert!(n_certified > 0 && n_colliding > 0, "{name}: {n_certified}, {n_colliding}");
        }
    }
}

/// SLOW=1: the thousand edges of issue 4.
#[test]
fn edges_of_a_radian_of_the_arm_are_certified_or_refuted() {
    let n_edges = if std::env::var_os("SLOW").is_some() { 1_000 } else { 100 };
    let scene = scene("iiwa14-shelf");
    let certifier = PathCertifier::new(&scene, |_| 0.0);
    let checker = CollisionChecker::new(&scene);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut workspace = PathWorkspace::default();
    let (mut n_certified, mut n_colliding) = (0, 0);
    while n_certified + n_colliding < n_edges {
        let (from, towards) = (uniform(&scene, &mut rng), uniform(&scene, &mut rng));
        let length = from.iter().zip(&towards).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        if length < 1.0 || !checker.is_free(&from) {
            continue;
        }
        let to = from.iter().zip(&towards).map(|(a, b)| a + (b - a) / length).collect();
        let edge = [from, to];
        let samples_collide = (0..=1_000).any(|k| !checker.is_free(&at(&edge, f64::from(k) / 1_000.0)));
        match certifier.certify_piece(&edge, &mut workspace) {
            PieceVerdict::Certified => {
                assert!(!samples_collide);
                n_certified += 1;
            }
            PieceVerdict::Collision(found) => {
                assert!(checker.colliding_pairs(&found.q).contains(&found.pair));
                n_colliding += 1;
            }
            other => panic!("neither certified nor refuted: {other:?}"),
        }
    }
    assert!(n_certified > n_edges / 4 && n_colliding > 0, "{n_certified} certified, {n_colliding} colliding");
}

fn piece(from: &[f64], to: &[f64], mode: Option<Mode>) -> InputPiece {
    InputPiece { place: "line 2".into(), mode, control_points: vec![from.to_vec(), to.to_vec()] }
}

/// The cap turns with the gripper, the fingers 0.5 mm from it: seen from the gripper nothing moves.
#[test]
fn a_grasp_with_a_gap_is_certified_in_one_interval() {
    let scene = scene("bottle-cap-3dof");
    let task = scene.task(None).expect("one task");
    let grasp = [piece(&[-3.0, -0.8, -0.0245], &[-2.85, -0.65, -0.0245], Some(Mode::Transfer))];
    let certified = certify_path(&scene, Some(task), &grasp, &PathOptions::default());
    assert_eq!(certified.first_failure(), None, "{:?}", certified.pieces[0]);
    let name = |body: u32| scene.bodies[body as usize].name.as_str();
    let finger_and_cap = certified
        .certificate
        .pairs
        .iter()
        .position(|pair| {
            let names = [name(pair.body_a), name(pair.body_b)];
            names.contains(&"gripper/left_finger") && names.contains(&"cap/cap")
        })
        .expect("finger and cap count");
    assert_eq!(certified.certificate.pieces[0].intervals[finger_and_cap].len(), 1);
    assert!(certified.pieces[0].kept_residual.is_some_and(|residual| residual < 1e-12));
}

#[test]
fn a_grasp_at_contact_is_said_to_touch_and_one_below_collides() {
    let scene = scene("bottle-cap-3dof");
    let verdict = |finger: f64| {
        let grasp = [piece(&[-3.0, -0.8, finger], &[-2.85, -0.65, finger], Some(Mode::Transfer))];
        certify_path(&scene, None, &grasp, &PathOptions::default()).pieces.swap_remove(0).verdict
    };
    assert!(matches!(verdict(-0.024), PieceVerdict::Touching(_)), "{:?}", verdict(-0.024));
    assert!(matches!(verdict(-0.0239), PieceVerdict::Collision(_)));
    assert!(matches!(verdict(-0.02401), PieceVerdict::Certified), "{:?}", verdict(-0.02401));
}

#[test]
fn clearance_limits_jumps_and_kept_forms() {
    let scene = scene("slider-gap");
    let verdicts = |pieces: &[InputPiece], clearance: f64| {
        let options = PathOptions { clearance: Some(clearance), ..PathOptions::default() };
        let certified = certify_path(&scene, None, pieces, &options);
        certified.pieces.into_iter().map(|piece| piece.verdict).collect::<Vec<_>>()
    };
    // Through the gap, 0.1 from its edges.
    let through = [piece(&[-0.3, 0.0], &[0.3, 0.0], None)];
    assert!(verdicts(&through, 0.0999)[0].is_certified());
    assert!(matches!(&verdicts(&through, 0.1001)[0], PieceVerdict::Collision(found) if found.gap > 0.09));
    assert!(matches!(verdicts(&through, 0.1)[0], PieceVerdict::Touching(_)));
    let beyond = scene.coordinates[0].upper + 1e-9;
    let outside = [piece(&[-0.3, 0.0], &[beyond, 0.0], None)];
    assert!(matches!(
        verdicts(&outside, 0.0)[0],
        PieceVerdict::OutsideLimits { point_idx: 1, coordinate_idx: 0, .. }
    ));
    let jumping = [piece(&[-0.3, 0.0], &[0.0, 0.0], None), piece(&[0.01, 0.0], &[0.3, 0.0], None)];
    let found = verdicts(&jumping, 0.0);
    assert!(found[0].is_certified() && matches!(found[1], PieceVerdict::Jump { coordinate_idx: 0, .. }));

    let cap = self::scene("bottle-cap-3dof");
    let task = cap.task(None).expect("one task");
    let slips = [piece(&[-3.0, -0.8, -0.0245], &[-2.85, -0.66, -0.0245], Some(Mode::Transfer))];
    let slipped = certify_path(&cap, Some(task), &slips, &PathOptions::default());
    assert!(matches!(slipped.pieces[0].verdict, PieceVerdict::NotKept { form_idx: 0, .. }));
    let transit = [piece(&[-3.0, -0.8, -0.0245], &[-3.0, -0.66, -0.0245], Some(Mode::Transit))];
    assert_eq!(certify_path(&cap, Some(task), &transit, &PathOptions::default()).first_failure(), None);
}
