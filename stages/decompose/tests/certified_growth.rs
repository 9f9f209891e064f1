//! Growth that the certifier's cuts guide: what comes out certifies without loss.

use certificates::{Candidate, Certifier, CertifyOptions, CertifyOutcome, Purpose};
use collision::CollisionChecker;
use decompose::{
    Anchor, Ending, Method, NoSink, Options, Problem, ProvableSpace, decompose, problem_of_scene, regions_at,
};
use nalgebra::DVector;
use scene::Scene;
use std::path::Path;
use wire::Region;

fn load(name: &str) -> Scene {
    Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name)).unwrap()
}

/// The region about `q`, or a cover without `q`.
fn regions(scene: &Scene, q: Option<&[f64]>, options: &Options) -> Vec<Region> {
    let checker = CollisionChecker::new(scene);
    let space = ProvableSpace::new(scene, &checker).with_certifier(Purpose::default(), 0).unwrap();
    let problem = Problem { free: &space, ..problem_of_scene(scene, None, &checker) };
    match q {
        Some(q) => {
            let anchor = Anchor { name: "seed".into(), q: DVector::from_column_slice(q) };
            let problem = Problem { anchors: vec![anchor], ..problem };
            let Ok(regions) = regions_at(&problem, options, 0, &mut NoSink, &|| false);
            regions
        }
        None => {
            let Ok(found) = decompose(&problem, options, 0, &mut NoSink, &|| false);
            assert_eq!(found.ending, Ending::Covered);
            found.regions
        }
    }
}

/// Share that the certifier leaves of a region, and how often it cuts.
fn certified(scene: &Scene, region: &Region) -> (f64, usize) {
    let certifier = Certifier::new(scene, |_| 0.0, &CertifyOptions::default(), 0).unwrap();
    let candidate = Candidate {
        region_id: region.id,
        polyhedron: region.polyhedron.clone(),
        center: region.center.clone(),
    };
    match certifier.certify_region(&candidate, &Purpose::default(), &|| false).unwrap() {
        CertifyOutcome::Certified(found) => (found.volume_kept, found.n_cuts),
        other => panic!("not certified: {other:?}"),
    }
}

/// In `two-rooms` certification takes some per cent of what IRIS-ZO has grown.
#[test]
fn certification_takes_nothing_from_what_it_has_guided() {
    let scene = load("two-rooms");
    let seed = [0.0, 0.2, 0.1];
    let at = |certify_growth: usize| {
        let options = Options { certify_growth, epsilon: 0.05, ..Options::default() };
        let found = regions(&scene, Some(&seed), &options);
        let [region] = found.as_slice() else { panic!("no region") };
        assert!(region.polyhedron.contains(&DVector::from_column_slice(&seed), 0.0));
        region.clone()
    };
    let (without, n_cuts) = certified(&scene, &at(0));
    assert!(without < 1.0 && n_cuts > 0, "{without}, {n_cuts} cuts");
    for certify_growth in [1, 2] {
        assert_eq!(certified(&scene, &at(certify_growth)), (1.0, 0), "{certify_growth} rounds");
    }
}

#[test]
fn every_grower_is_guided() {
    let scene = load("slider-gap");
    for method in [Method::Iris, Method::IrisNp, Method::IrisNp2, Method::IrisZo, Method::CIris] {
        let options = Options {
            method,
            certify_growth: 2,
            domain_radius: 0.15,
            c_iris_iterations: 2,
            ..Options::default()
        };
        let found = regions(&scene, Some(&[0.0, 0.03]), &options);
        let [region] = found.as_slice() else { panic!("{method:?}: no region") };
        assert!(region.polyhedron.contains(&DVector::from_vec(vec![0.0, 0.03]), 0.0));
        assert_eq!(certified(&scene, region), (1.0, 0), "{method:?}");
    }
}

#[test]
fn the_cover_is_the_same_by_any_number_of_threads() {
    let scene = load("two-rooms");
    let options = Options { certify_growth: 2, coverage: 0.9, ..Options::default() };
    let first = regions(&scene, None, &options);
    assert_eq!(first, regions(&scene, None, &Options { threads: 4, ..options }));
    assert!(first.iter().all(|region| certified(&scene, region).0 == 1.0));
}
