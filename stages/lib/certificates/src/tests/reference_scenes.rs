//! The reference scenes: the grasp band of the bottle caps, and boxes about the seeds of the arm.

use crate::{Candidate, CertifiedRegion, Certifier, CertifyOptions, CertifyOutcome, Purpose, recheck};
use collision::CollisionChecker;
use convex_sets::HPolyhedron;
use nalgebra::DVector;
use scene::Scene;
use std::path::Path;

fn load(name: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenes").join(name);
    Scene::load(&folder).expect("a reference scene")
}

fn box_candidate(lower: &[f64], upper: &[f64]) -> Candidate {
    let (lower, upper) = (DVector::from_row_slice(lower), DVector::from_row_slice(upper));
    let center = (&lower + &upper) * 0.5;
    Candidate { region_id: 1, polyhedron: HPolyhedron::from_box(&lower, &upper), center }
}

fn outcome(scene: &Scene, candidate: &Candidate, options: &CertifyOptions) -> CertifyOutcome {
    let certifier = Certifier::new(scene, |_| 0.0, options, 0).expect("options are valid");
    certifier.certify_region(candidate, &Purpose::default(), &|| false).expect("a valid candidate")
}

fn certified(scene: &Scene, candidate: &Candidate) -> CertifiedRegion {
    match outcome(scene, candidate, &CertifyOptions::default()) {
        CertifyOutcome::Certified(region) => {
            recheck(scene, &region.polyhedron, &region.certificate).expect("a certificate that holds");
            *region
        }
        other => panic!("not certified: {other:?}"),
    }
}

/// Largest value of coordinate `j` in the region.
fn most(region: &CertifiedRegion, j: usize) -> f64 {
    region.polyhedron.bounding_box().expect("bounded").upper[j]
}

#[test]
fn the_grasp_band_is_certified_up_to_contact_and_nothing_else_is_lost() {
    let scene = load("bottle-cap-3dof");
    for (from, to) in [(0.36, 1.0), (-0.8064, -0.6437)] {
        let region = certified(&scene, &box_candidate(&[-3.14, from, -0.025], &[3.14, to, -0.024]));
        let bounds = region.polyhedron.bounding_box().expect("bounded");
        assert!((-0.024 - bounds.upper[2]).abs() < 2e-7 && bounds.upper[2] < -0.024);
        assert_eq!(bounds.lower[2], -0.025);
        assert!((bounds.lower[1] - from).abs() < 1e-12 && (bounds.upper[1] - to).abs() < 1e-12);
        assert!((bounds.upper[0] - 3.14).abs() < 1e-12 && (bounds.lower[0] + 3.14).abs() < 1e-12);
        assert_eq!(region.polyhedron.n_faces(), 6, "the cut takes the place of the face at contact");
    }
}

#[test]
fn a_candidate_beyond_contact_is_cut_at_contact() {
    let scene = load("bottle-cap-3dof");
    let region = certified(&scene, &box_candidate(&[-3.14, 0.36, -0.025], &[3.14, 1.0, -0.0235]));
    let upper = most(&region, 2);
    assert!((-0.0240003..-0.024).contains(&upper), "{upper}");
    let scene = load("bottle-cap-4dof");
    let candidate = box_candidate(&[-3.14, 0.36, -0.025, 0.0235], &[3.14, 1.0, -0.0235, 0.025]);
    let region = certified(&scene, &candidate);
    let bounds = region.polyhedron.bounding_box().expect("bounded");
    assert!((-0.0240003..-0.024).contains(&bounds.upper[2]));
    assert!((0.024..0.0240003).contains(&bounds.lower[3]));
    assert!((bounds.upper[1] - 1.0).abs() < 1e-12 && (bounds.lower[1] - 0.36).abs() < 1e-12);
}

/// The band beyond the free interval [0.3598, 1.0]: what remains covers at least 0.99 of it.
#[test]
fn the_free_interval_of_the_band_remains() {
    let scene = load("bottle-cap-3dof");
    let task = scene.task(None).expect("one task").clone();
    let candidate = Candidate {
        center: DVector::from_row_slice(&[0.0, 0.7, -0.0245]),
        ..box_candidate(&[-3.14, 0.34, -0.026], &[3.14, 1.0, -0.024])
    };
    let purpose = Purpose {
        spaces: vec![HPolyhedron::from_box(&task.grasp.lower, &task.grasp.upper)],
        keep: Vec::new(),
    };
    let certifier = Certifier::new(&scene, |_| 0.0, &CertifyOptions::default(), 0).expect("valid options");
    let Ok(CertifyOutcome::Certified(region)) = certifier.certify_region(&candidate, &purpose, &|| false)
    else {
        panic!("not certified")
    };
    // The whole width of the band is there from this angle on.
    let reaches = |gripper: f64| {
        [-0.025, -0.02401]
            .iter()
            .all(|&finger| region.polyhedron.contains(&DVector::from_row_slice(&[0.0, gripper, finger]), 0.0))
    };
    let first = (0..2000).map(|k| 0.34 + 0.0005 * f64::from(k)).find(|&gripper| reaches(gripper));
    let first = first.expect("some of the band remains");
    assert!((1.0 - first) / (1.0 - 0.3598) >= 0.99, "certified from {first} on");
}

const SEEDS: [[f64; 7]; 5] = [
    [0.000064, 0.471953, -0.000149, -0.671673, 0.000185, 0.42617, 1.570692],
    [-0.000155, 0.397273, 0.00022, -1.367476, 0.000247, -0.192952, 1.570469],
    [-0.000176, 0.683028, 0.000245, -1.647823, 0.000021, -0.759055, 1.570626],
    [1.332666, 0.786593, 0.362338, -1.491653, -0.319251, 0.921732, 1.79119],
    [-1.332462, 0.786648, -0.362656, -1.491653, 0.319534, 0.921783, 1.350209],
];

fn around(seed: &[f64; 7], half: f64) -> Candidate {
    box_candidate(&seed.map(|q| q - half), &seed.map(|q| q + half))
}

#[test]
fn boxes_about_the_seeds_of_the_arm_are_certified_as_they_are() {
    let scene = load("iiwa14-shelf");
    let checker = CollisionChecker::new(&scene);
    assert_eq!(scene.collision_pairs().len(), 324);
    for seed in &SEEDS {
        for corner in 0..128 {
            let q: Vec<f64> =
                (0..7).map(|j| seed[j] + if corner >> j & 1 == 0 { -0.02 } else { 0.02 }).collect();
            assert!(checker.is_free(&q));
        }
        let candidate = around(seed, 0.02);
        let region = certified(&scene, &candidate);
        assert_eq!((region.n_cuts, region.n_cells), (0, 324));
        assert_eq!(region.polyhedron, candidate.polyhedron);
    }
}

#[test]
fn a_larger_box_above_the_shelf_is_cut_or_refused() {
    let scene = load("iiwa14-shelf");
    let candidate = around(&SEEDS[0], 0.05);
    let region = certified(&scene, &candidate);
    assert!(region.n_cuts > 0 && region.volume_kept > 0.97, "kept {}", region.volume_kept);
    let forbidden = CertifyOptions { max_cut_loss: 0.0, ..CertifyOptions::default() };
    let CertifyOutcome::Rejected { pair, configuration, .. } = outcome(&scene, &candidate, &forbidden) else {
        panic!("it should be refused");
    };
    let name = |body: usize| scene.bodies[body].name.as_str();
    assert_eq!((name(pair.body_a), name(pair.body_b)), ("iiwa14/wsg", "shelves_top_board"));
    let checker = CollisionChecker::new(&scene);
    assert!(checker.colliding_pairs(&configuration).contains(&pair));
}
