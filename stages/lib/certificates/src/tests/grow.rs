//! Bilinear alternation on scenes whose free space is known by hand.

use super::regions::samples;
use crate::sums::grow::{GrowError, GrowSettings, Grower, Grown};
use crate::{
    Candidate, CertifiedRegion, Certifier, CertifyOptions, CertifyOutcome, Method, Purpose, recheck,
};
use collision::CollisionChecker;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use scene::Scene;
use std::path::Path;

fn load(name: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenes").join(name);
    Scene::load(&folder).expect("a reference scene")
}

fn grow(scene: &Scene, seed: &[f64], max_iterations: usize) -> Result<Grown, GrowError> {
    let solver = conic::Settings::default();
    let settings = GrowSettings { max_iterations, least_growth: 0.02, max_margin: 0.1, solver };
    Grower::new(scene, |_| 0.0, seed, settings)?.grow(seed)
}

fn certified(scene: &Scene, grown: &Grown) -> CertifiedRegion {
    let options = CertifyOptions { method: Method::Sos, ..CertifyOptions::default() };
    let certifier = Certifier::new(scene, |_| 0.0, &options, 0).expect("options are valid");
    let candidate =
        Candidate { region_id: 0, polyhedron: grown.polyhedron.clone(), center: grown.center.clone() };
    match certifier.certify_region(&candidate, &Purpose::default(), &|| false).expect("a valid candidate") {
        CertifyOutcome::Certified(region) => *region,
        other => panic!("not certified: {other:?}"),
    }
}

/// The hinge is free on [-1.5, π/6].
#[test]
fn an_interval_grows_to_contact() {
    let scene = load("hinge");
    let grown = grow(&scene, &[-0.3], 20).expect("a free seed");
    let (first, last) =
        (grown.ellipsoid_volumes[0], grown.ellipsoid_volumes[grown.ellipsoid_volumes.len() - 1]);
    assert!(last > 1.5 * first, "{:?}", grown.ellipsoid_volumes);
    let region = certified(&scene, &grown);
    recheck(&scene, &region.polyhedron, &region.certificate).expect("a certificate that holds");
    let bounds = region.polyhedron.bounding_box().expect("bounded");
    let contact = std::f64::consts::FRAC_PI_6;
    assert!(
        bounds.upper[0] < contact && bounds.upper[0] - bounds.lower[0] > 0.85 * (contact + 1.5),
        "{bounds:?}"
    );
}

/// Between the boxes and beside them: the region grows, keeps its seed, and is free.
#[test]
fn a_region_of_two_coordinates_grows_and_stays_free() {
    let scene = load("slider-gap");
    let checker = CollisionChecker::new(&scene);
    let seed = [0.5 * (scene.lower()[0] + scene.upper()[0]), 0.5 * (scene.lower()[1] + scene.upper()[1])];
    assert!(checker.is_free(&seed));
    let volume = |iterations: usize| {
        let grown = grow(&scene, &seed, iterations).expect("a free seed");
        let region = certified(&scene, &grown);
        assert!(region.volume_kept > 0.8, "what was grown is nearly what is certified");
        assert!(region.polyhedron.contains(&nalgebra::DVector::from_column_slice(&seed), 0.0));
        for q in samples(&region.polyhedron, &scene, &mut ChaCha8Rng::seed_from_u64(0)) {
            assert!(checker.is_free(q.as_slice()), "{q:?}");
        }
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        region.polyhedron.estimate_volume(20_000, &mut rng).expect("bounded").volume
    };
    let (first, last) = (volume(0), volume(8));
    assert!(last > 2.0 * first, "{first} to {last}");
}

#[test]
fn seeds_that_cannot_grow_are_named() {
    let scene = load("hinge");
    assert_eq!(grow(&scene, &[0.9], 3).unwrap_err(), GrowError::Seed);
    assert_eq!(grow(&scene, &[9.0], 3).unwrap_err(), GrowError::Limits { found: 0, expected: 1 });
    assert_eq!(grow(&scene, &[0.0, 0.0], 3).unwrap_err(), GrowError::Limits { found: 1, expected: 1 });
}
