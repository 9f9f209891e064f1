//! Time of a configuration and of an edge, mean over random ones of the joint box.

use collision::CollisionChecker;
use criterion::{Criterion, criterion_group, criterion_main};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::Scene;
use std::hint::black_box;
use std::path::Path;

const N_SAMPLES: usize = 4096;

fn benchmark(criterion: &mut Criterion) {
    for name in ["bottle-cap-3dof", "iiwa14-shelf"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenes").join(name);
        let Ok(scene) = Scene::load(&folder) else { continue };
        let checker = CollisionChecker::new(&scene);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut sample =
            || -> Vec<f64> { scene.coordinates.iter().map(|c| rng.random_range(c.lower..c.upper)).collect() };
        let samples: Vec<Vec<f64>> = (0..N_SAMPLES).map(|_| sample()).collect();
        let free: Vec<&Vec<f64>> = samples.iter().filter(|q| checker.is_free(q)).collect();
        let next = |k: &mut usize, n: usize| {
            *k = (*k + 1) % n;
            *k
        };
        let mut k = 0;
        criterion.bench_function(&format!("{name}/is_free"), |bencher| {
            bencher.iter(|| checker.is_free(black_box(&samples[next(&mut k, samples.len())])));
        });
        criterion.bench_function(&format!("{name}/is_free, free ones"), |bencher| {
            bencher.iter(|| checker.is_free(black_box(free[next(&mut k, free.len())])));
        });
        criterion.bench_function(&format!("{name}/min_distance, free ones"), |bencher| {
            bencher.iter(|| checker.min_distance(black_box(free[next(&mut k, free.len())])));
        });
        // Edges of length 1 (or to the limit) from free configurations, as in a visibility graph.
        criterion.bench_function(&format!("{name}/edge_is_free"), |bencher| {
            bencher.iter(|| {
                let j = next(&mut k, free.len() - 1);
                let (q_0, q_1) = (free[j], free[j + 1]);
                let length = q_0.iter().zip(q_1).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
                let share = (1.0 / length).min(1.0);
                let end: Vec<f64> = q_0.iter().zip(q_1).map(|(a, b)| a + share * (b - a)).collect();
                checker.edge_is_free(black_box(q_0), black_box(&end))
            });
        });
    }
}

criterion_group!(benches, benchmark);
criterion_main!(benches);
