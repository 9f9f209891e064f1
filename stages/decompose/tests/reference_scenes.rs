//! Coverage of the reference scenes by brute force.

use collision::CollisionChecker;
use decompose::{
    Decomposition, Ending, NoSink, Options, covered, decompose, longest_chord_coverage, problem_of_scene,
};
use nalgebra::DVector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::Scene;
use std::path::Path;

fn load(name: &str) -> Scene {
    Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name)).unwrap()
}

fn run(scene: &Scene, options: &Options, seed: u64) -> Decomposition {
    let task = scene.task(None).ok();
    let checker = match task {
        Some(task) => CollisionChecker::for_task(scene, task),
        None => CollisionChecker::new(scene),
    };
    let problem = problem_of_scene(scene, task, &checker);
    problem.check().unwrap();
    let Ok(found) = decompose(&problem, options, seed, &mut NoSink, &|| false);
    found
}

/// Coverage and collisions by brute force, on samples of their own.
fn check_bottle_cap(name: &str, seeds: std::ops::Range<u64>, max_regions: usize) {
    let scene = load(name);
    let task = scene.task(None).unwrap();
    let checker = CollisionChecker::for_task(&scene, task);
    let problem = problem_of_scene(&scene, Some(task), &checker);
    assert_eq!(problem.relevant, [&[false][..], &vec![true; scene.dim() - 1]].concat());
    for seed in seeds {
        let found = run(&scene, &Options::default(), seed);
        assert_eq!(found.ending, Ending::Covered);
        assert!(found.regions.len() <= max_regions, "{name}, seed {seed}: {} regions", found.regions.len());
        let polyhedra: Vec<_> = found.regions.iter().map(|region| region.polyhedron.clone()).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(1000 + seed);
        for (set, lower, upper) in [
            ("CS", scene.lower(), scene.upper()),
            ("CG", task.grasp.lower.clone(), task.grasp.upper.clone()),
            ("CP", task.placement.lower.clone(), task.placement.upper.clone()),
        ] {
            let (mut n_free, mut n_covered) = (0, 0);
            for _ in 0..200_000 {
                let q = uniform(&lower, &upper, &mut rng);
                if checker.is_free(&q) {
                    n_free += 1;
                    n_covered += usize::from(covered(&polyhedra, &q));
                }
            }
            let share = n_covered as f64 / n_free as f64;
            assert!(share >= 0.99, "{name}, seed {seed}: {share} of {set}_free");
        }
        let chord = longest_chord_coverage(&problem, &polyhedra, seed).unwrap();
        assert!(chord.share() >= 0.998, "{name}, seed {seed}: {chord:?}");
        for q in [&task.start, &task.goal] {
            assert!(covered(&polyhedra, q.as_slice()), "{name}, seed {seed}: {q}");
        }
        for region in &found.regions {
            let bounds = region.polyhedron.bounding_box().unwrap();
            let (mut n_inside, mut n_colliding) = (0, 0);
            for _ in 0..20_000 {
                let q = uniform(&bounds.lower, &bounds.upper, &mut rng);
                if covered(std::slice::from_ref(&region.polyhedron), &q) {
                    n_inside += 1;
                    n_colliding += usize::from(!checker.is_free(&q));
                }
            }
            // ε of the probabilistic test, with room for sampling.
            let most = 0.005 * n_inside as f64 + 10.0;
            assert!(n_colliding as f64 <= most, "{name}, seed {seed}, region {}: {n_colliding}", region.id);
        }
    }
}

fn uniform(lower: &DVector<f64>, upper: &DVector<f64>, rng: &mut ChaCha8Rng) -> Vec<f64> {
    (0..lower.len()).map(|j| lower[j] + (upper[j] - lower[j]) * rng.random::<f64>()).collect()
}

#[test]
fn bottle_cap_3dof() {
    check_bottle_cap("bottle-cap-3dof", 0..4, 30);
}

#[test]
fn bottle_cap_4dof() {
    check_bottle_cap("bottle-cap-4dof", 0..3, 60);
}

/// The free space is the union of three boxes; the first regions bulge into the gap, so a few more are needed.
#[test]
fn slider_gap_is_covered_by_few_regions() {
    for seed in 0..4 {
        let found = run(&load("slider-gap"), &Options::default(), seed);
        assert_eq!(found.ending, Ending::Covered);
        assert!(found.regions.len() <= 8, "seed {seed}: {} regions", found.regions.len());
    }
}

/// One angle: free up to contact at sin = 0.5.
#[test]
fn hinge_is_one_interval() {
    let found = run(&load("hinge"), &Options::default(), 0);
    assert_eq!(found.regions.len(), 1);
    let bounds = found.regions[0].polyhedron.bounding_box().unwrap();
    assert!((bounds.lower[0] + 1.5).abs() < 1e-12);
    let contact = std::f64::consts::FRAC_PI_6;
    assert!(bounds.upper[0] < contact && bounds.upper[0] > contact - 1e-4, "{}", bounds.upper[0]);
}

/// The grasp space has rows over two coordinates.
#[test]
fn two_rooms_cover_their_grasp_space() {
    let found = run(&load("two-rooms"), &Options::default(), 0);
    assert_eq!(found.ending, Ending::Covered);
    assert!(found.grasp.unwrap().value >= 0.99);
}
