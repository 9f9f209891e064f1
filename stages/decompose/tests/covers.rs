//! `--cover`: CS_free alone, whatever the task, or the part of it in a box.

use collision::CollisionChecker;
use convex_sets::HPolyhedron;
use decompose::{Ending, Options, Problem, Sink, covered, decompose, problem_of_scene};
use nalgebra::DVector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::Scene;
use std::path::Path;
use wire::Region;

fn load(name: &str) -> Scene {
    Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name)).unwrap()
}

/// "Certified" versions that lose what lies within `loss` of every face but those of the joint limits.
struct Shrinks {
    loss: f64,
    handed_over: Vec<Region>,
}

impl Sink for Shrinks {
    type Error = std::convert::Infallible;

    fn region(&mut self, region: &Region) -> Result<(), Self::Error> {
        self.handed_over.push(region.clone());
        Ok(())
    }

    fn progress(&mut self, _: usize, _: f64, _: &str) {}

    fn certified(&mut self, ids: &[u64]) -> Result<Option<Vec<Region>>, Self::Error> {
        let shrunk = |id: &u64| {
            let region = self.handed_over.iter().find(|region| region.id == *id).unwrap();
            let P = &region.polyhedron;
            let is_limit = |i: usize| P.A.row(i).iter().filter(|a| **a != 0.0).count() == 1;
            let b = DVector::from_fn(P.n_faces(), |i, _| P.b[i] - if is_limit(i) { 0.0 } else { self.loss });
            let polyhedron = HPolyhedron { A: P.A.clone(), b };
            polyhedron.interior_point().ok().map(|_| Region { polyhedron, ..region.clone() })
        };
        Ok(Some(ids.iter().filter_map(shrunk).collect()))
    }
}

/// Share of 40,000 free configurations of a box that `regions` cover.
fn share(checker: &CollisionChecker, lower: &DVector<f64>, upper: &DVector<f64>, regions: &[Region]) -> f64 {
    let polyhedra: Vec<HPolyhedron> = regions.iter().map(|region| region.polyhedron.clone()).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(77);
    let (mut n_free, mut n_covered) = (0, 0);
    while n_free < 40_000 {
        let q: Vec<f64> =
            (0..lower.len()).map(|j| lower[j] + (upper[j] - lower[j]) * rng.random::<f64>()).collect();
        if checker.is_free(&q) {
            n_free += 1;
            n_covered += usize::from(covered(&polyhedra, &q));
        }
    }
    n_covered as f64 / n_free as f64
}

#[test]
fn a_cover_of_a_scene_with_a_task_has_no_task_and_makes_good_what_certification_took() {
    let scene = load("bottle-cap-4dof");
    let checker = CollisionChecker::for_task(&scene, scene.task(None).unwrap());
    let problem = problem_of_scene(&scene, scene.task(None).ok(), &checker).without_task();
    let options = Options { cover: true, coverage: 0.9, ..Options::default() };
    let mut n_regions = Vec::new();
    for loss in [0.0, 2e-3] {
        let mut sink = Shrinks { loss, handed_over: Vec::new() };
        let Ok(found) = decompose(&problem, &options, 0, &mut sink, &|| false);
        assert_eq!(found.ending, Ending::Covered);
        assert!(found.grasp.is_none() && found.placement.is_none() && found.chord.is_none());
        assert!(found.regions.iter().all(|region| !region.method.contains("grasp space")));
        let ids: Vec<u64> = found.regions.iter().map(|region| region.id).collect();
        let Ok(certified) = sink.certified(&ids);
        let share = share(&checker, &scene.lower(), &scene.upper(), &certified.unwrap());
        assert!(share >= 0.9, "{share} with a loss of {loss}");
        n_regions.push(found.regions.len());
    }
    assert!(n_regions[0] < n_regions[1], "{n_regions:?}");
}

#[test]
fn a_cover_of_a_box_stays_in_it() {
    let scene = load("iiwa14-wrist");
    let checker = CollisionChecker::new(&scene);
    let q = DVector::from_vec(vec![-1.367, 0.0, -0.193, 1.570]);
    let problem: Problem<'_> = problem_of_scene(&scene, None, &checker).within(&q, 0.3);
    let options = Options { cover: true, coverage: 0.9, ..Options::default() };
    let mut sink = Shrinks { loss: 0.0, handed_over: Vec::new() };
    let Ok(found) = decompose(&problem, &options, 0, &mut sink, &|| false);
    assert_eq!(found.ending, Ending::Covered);
    let (lower, upper) = (q.add_scalar(-0.3), q.add_scalar(0.3));
    for region in &found.regions {
        let bounds = region.polyhedron.bounding_box().unwrap();
        assert!((0..4).all(|j| bounds.lower[j] >= lower[j] - 1e-9 && bounds.upper[j] <= upper[j] + 1e-9));
    }
    let share = share(&checker, &lower, &upper, &found.regions);
    assert!(share >= 0.9, "{share}");
}
