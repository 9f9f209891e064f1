//! Single regions of the arm by each grower at (ε, δ) = (0.01, 0.05): first a table of what they are, then their times.
//!
//! `cargo bench -p decompose --bench growers`

use collision::CollisionChecker;
use convex_sets::{HPolyhedron, HitAndRun};
use criterion::{Criterion, criterion_group, criterion_main};
use decompose::{Anchor, Method, NoSink, Options, Problem, problem_of_scene, regions_at};
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use scene::Scene;
use std::path::Path;

/// Seeds of Marcucci et al. 2023: shelves and bins, then C, L and R.
const SEEDS: [(&str, [f64; 7]); 8] = [
    ("above shelf", [0.000064, 0.471953, -0.000149, -0.671673, 0.000185, 0.42617, 1.570692]),
    ("top shelf", [-0.000155, 0.397273, 0.00022, -1.367476, 0.000247, -0.192952, 1.570469]),
    ("centre shelf", [-0.000176, 0.683028, 0.000245, -1.647823, 0.000021, -0.759055, 1.570626]),
    ("left bin", [1.332666, 0.786593, 0.362338, -1.491653, -0.319251, 0.921732, 1.79119]),
    ("right bin", [-1.332462, 0.786648, -0.362656, -1.491653, 0.319534, 0.921783, 1.350209]),
    ("C", [0.0, 0.2, 0.0, -2.09, 0.0, -0.3, std::f64::consts::FRAC_PI_2]),
    ("L", [0.8, 0.7, 0.0, -1.6, 0.0, 0.0, std::f64::consts::FRAC_PI_2]),
    ("R", [-0.8, 0.7, 0.0, -1.6, 0.0, 0.0, std::f64::consts::FRAC_PI_2]),
];
const METHODS: [Method; 3] = [Method::IrisZo, Method::IrisNp2, Method::IrisNp];

/// Seconds that this thread has spent on a processor, so that a busy machine counts for nothing; 0 where Linux does
/// not say.
fn cpu_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    text.split(' ').next().and_then(|nanos| nanos.parse::<f64>().ok()).map_or(0.0, |nanos| nanos * 1e-9)
}

fn colliding_share(checker: &CollisionChecker, P: &HPolyhedron, n_samples: usize) -> f64 {
    let E = P.max_inscribed_ellipsoid().expect("a region has an interior");
    let C = E.image_of_ball().expect("an ellipsoid that is not flat");
    let mut walk = HitAndRun::new(P, &E.center, C);
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut n_colliding = 0;
    for _ in 0..n_samples {
        (0..10).for_each(|_| {
            walk.step(&mut rng);
        });
        n_colliding += usize::from(!checker.is_free(walk.point()));
    }
    n_colliding as f64 / n_samples as f64
}

fn growers(criterion: &mut Criterion) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/iiwa14-shelf");
    let scene = Scene::load(&path).expect("the reference scenes are part of the project");
    let checker = CollisionChecker::new(&scene);
    let at = |q: &[f64]| Problem {
        anchors: vec![Anchor { name: "seed".into(), q: DVector::from_column_slice(q) }],
        ..problem_of_scene(&scene, None, &checker)
    };
    let options = |method| Options { method, epsilon: 0.01, delta: 0.05, ..Options::default() };
    eprintln!("| seed | method | CPU s | faces | mean half-axis, rad | in collision |");
    eprintln!("| --- | --- | --- | --- | --- | --- |");
    for (name, seed) in SEEDS {
        for method in METHODS {
            let problem = at(&seed);
            let before = cpu_seconds();
            let Ok(regions) = regions_at(&problem, &options(method), 0, &mut NoSink, &|| false);
            let seconds = cpu_seconds() - before;
            let Some(P) = regions.first().map(|region| &region.polyhedron) else { continue };
            let volume = P.max_inscribed_ellipsoid().map_or(0.0, |E| E.relative_volume());
            let share = colliding_share(&checker, P, 100_000);
            let half_axis = volume.powf(1.0 / 7.0);
            let method = method.name();
            eprintln!(
                "| {name} | {method} | {seconds:.2} | {} | {half_axis:.3} | {share:.5} |",
                P.n_faces() - 14
            );
        }
    }
    let mut group = criterion.benchmark_group("iiwa14-shelf");
    group.sample_size(10);
    for method in [Method::IrisZo, Method::IrisNp2] {
        for (name, seed) in &SEEDS[..3] {
            let (problem, options) = (at(seed), options(method));
            group.bench_function(format!("{}, {name}", method.name()), |bencher| {
                bencher.iter(|| regions_at(&problem, &options, 0, &mut NoSink, &|| false));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, growers);
criterion_main!(benches);
