//! Coverage of the reference scenes by brute force.

use collision::CollisionChecker;
use decompose::{
    Decomposition, Ending, Options, Sink, covered, decompose, longest_chord_coverage, problem_of_scene,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::Scene;
use std::path::Path;
use wire::Region;

/// Keeps nothing and certifies nothing.
struct Nowhere;

impl Sink for Nowhere {
    type Error = std::convert::Infallible;

    fn region(&mut self, _: &Region) -> Result<(), Self::Error> {
        Ok(())
    }

    fn progress(&mut self, _: usize, _: f64, _: &str) {}

    fn certified(&mut self, _: &[u64]) -> Result<Option<Vec<Region>>, Self::Error> {
        Ok(None)
    }
}

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
    let Ok(found) = decompose(&problem, options, seed, &mut Nowhere, &|| false);
    found
}

/// Shares of free samples of the box that are covered, and of each region's samples that collide.
fn check_bottle_cap(name: &str, seeds: std::ops::Range<u64>) {
    let scene = load(name);
    let task = scene.task(None).unwrap();
    let checker = CollisionChecker::for_task(&scene, task);
    let problem = problem_of_scene(&scene, Some(task), &checker);
    assert_eq!(problem.relevant, [&[false][..], &vec![true; scene.dim() - 1]].concat());
    for seed in seeds {
        let begin = std::time::Instant::now();
        let found = run(&scene, &Options::default(), seed);
        eprintln!(
            "{name} seed {seed}: {} regions in {:?}, {:?}",
            found.regions.len(),
            begin.elapsed(),
            found.ending
        );
        eprintln!(
            "  total {:?} grasp {:?} chord {:?}",
            found.total,
            found.grasp,
            found.chord.as_ref().map(|c| (c.free, c.covered, c.share()))
        );
        let polyhedra: Vec<_> = found.regions.iter().map(|region| region.polyhedron.clone()).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(1000 + seed);
        for (set, lower, upper, wanted) in [
            ("CS", scene.lower(), scene.upper(), 0.99),
            ("CG", task.grasp.lower.clone(), task.grasp.upper.clone(), 0.99),
            ("CP", task.placement.lower.clone(), task.placement.upper.clone(), 0.99),
        ] {
            let (mut n_free, mut n_covered) = (0, 0);
            for _ in 0..100_000 {
                let q: Vec<f64> = (0..lower.len())
                    .map(|j| lower[j] + (upper[j] - lower[j]) * rng.random::<f64>())
                    .collect();
                if checker.is_free(&q) {
                    n_free += 1;
                    n_covered += usize::from(covered(&polyhedra, &q));
                }
            }
            let share = n_covered as f64 / n_free as f64;
            eprintln!("  {set}: {share:.5}");
            assert!(share >= wanted, "{name}, seed {seed}: {share} of {set}_free");
        }
        let chord = longest_chord_coverage(&problem, &polyhedra, seed).unwrap();
        assert!(chord.share() >= 0.99, "{name}, seed {seed}: {chord:?}");
        for q in [&task.start, &task.goal] {
            assert!(polyhedra.iter().any(|P| P.contains(q, 0.0)), "{name}, seed {seed}: {q}");
        }
        for region in &found.regions {
            let bounds = region.polyhedron.bounding_box().unwrap();
            let (mut n_inside, mut n_colliding) = (0, 0);
            for _ in 0..20_000 {
                let q: Vec<f64> = (0..scene.dim())
                    .map(|j| bounds.lower[j] + (bounds.upper[j] - bounds.lower[j]) * rng.random::<f64>())
                    .collect();
                if covered(std::slice::from_ref(&region.polyhedron), &q) {
                    n_inside += 1;
                    n_colliding += usize::from(!checker.is_free(&q));
                }
            }
            eprintln!(
                "  region {} {} faces {}: {n_colliding} of {n_inside}",
                region.id,
                region.method,
                region.polyhedron.n_faces()
            );
            assert!(n_colliding as f64 <= 0.01 * n_inside as f64 + 5.0, "region {}", region.id);
        }
        assert_eq!(found.ending, Ending::Covered);
    }
}

#[test]
fn bottle_cap_3dof() {
    check_bottle_cap("bottle-cap-3dof", 0..3);
}

#[test]
fn bottle_cap_4dof() {
    check_bottle_cap("bottle-cap-4dof", 0..3);
}
