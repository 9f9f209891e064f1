//! Time of the whole decomposition of both reference scenes, and of one region around a seed of the arm.

use collision::CollisionChecker;
use criterion::{Criterion, criterion_group, criterion_main};
use decompose::{Anchor, NoSink, Options, decompose, problem_of_scene, regions_at};
use nalgebra::DVector;
use scene::Scene;
use std::path::Path;

fn load(name: &str) -> Scene {
    Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name))
        .expect("the reference scenes are part of the project")
}

fn reference_scenes(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("decompose");
    group.sample_size(10);
    for name in ["bottle-cap-3dof", "bottle-cap-4dof"] {
        let scene = load(name);
        let task = scene.task(None).expect("a reference scene has one task");
        let checker = CollisionChecker::for_task(&scene, task);
        let problem = problem_of_scene(&scene, Some(task), &checker);
        let options = Options::default();
        group.bench_function(name, |bencher| {
            bencher.iter(|| decompose(&problem, &options, 0, &mut NoSink, &|| false));
        });
    }
    let scene = load("iiwa14-shelf");
    let checker = CollisionChecker::new(&scene);
    let mut problem = problem_of_scene(&scene, None, &checker);
    let q = [0.000064, 0.471953, -0.000149, -0.671673, 0.000185, 0.42617, 1.570692];
    problem.anchors = vec![Anchor { name: "above shelf".into(), q: DVector::from_column_slice(&q) }];
    let options = Options { domain_radius: 0.5, ..Options::default() };
    group.bench_function("iiwa14-shelf, one region", |bencher| {
        bencher.iter(|| regions_at(&problem, &options, 0, &mut NoSink, &|| false));
    });
    group.finish();
}

criterion_group!(benches, reference_scenes);
criterion_main!(benches);
