//! Edges of 1 rad against all pairs: certified, and checked by samples at 0.01 rad, in one run.
//!
//! One iteration does all of a set of 200 edges; the ratio of the medians over edges is printed first.

use certificates::path::{PathCertifier, PathWorkspace};
use collision::CollisionChecker;
use criterion::{Criterion, criterion_group, criterion_main};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::Scene;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

type Edge = [Vec<f64>; 2];

fn sampled_free(checker: &CollisionChecker, edge: &Edge, n_steps: u32) -> bool {
    let mut q = edge[0].clone();
    (0..=n_steps).all(|k| {
        let t = f64::from(k) / f64::from(n_steps);
        for j in 0..q.len() {
            q[j] = edge[0][j] + t * (edge[1][j] - edge[0][j]);
        }
        checker.is_free(&q)
    })
}

/// Edges of length 1 from free configurations; with `free`, only those whose samples are free.
fn edges(scene: &Scene, checker: &CollisionChecker, n_edges: usize, free: bool) -> Vec<Edge> {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut uniform =
        || -> Vec<f64> { scene.coordinates.iter().map(|c| rng.random_range(c.lower..=c.upper)).collect() };
    let mut edges = Vec::new();
    while edges.len() < n_edges {
        let (from, towards) = (uniform(), uniform());
        let length = from.iter().zip(&towards).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        let to = from.iter().zip(&towards).map(|(a, b)| a + (b - a) / length).collect();
        let edge = [from, to];
        if length >= 1.0 && checker.is_free(&edge[0]) && (!free || sampled_free(checker, &edge, 100)) {
            edges.push(edge);
        }
    }
    edges
}

/// Median over the edges of the least of three times, microseconds.
fn median_micros(edges: &[Edge], mut work: impl FnMut(&Edge)) -> f64 {
    let mut times: Vec<f64> = edges
        .iter()
        .map(|edge| {
            let once = |_| {
                let began = Instant::now();
                work(edge);
                began.elapsed().as_secs_f64() * 1e6
            };
            (0..3).map(once).fold(f64::INFINITY, f64::min)
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn paths(criterion: &mut Criterion) {
    for name in ["iiwa14-shelf", "two-iiwa14"] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenes").join(name);
        let Ok(scene) = Scene::load(&folder) else { continue };
        let certifier = PathCertifier::new(&scene, |_| 0.0);
        let checker = CollisionChecker::new(&scene);
        let mut workspace = PathWorkspace::default();
        for (kind, free) in [("free", true), ("mixed", false)] {
            let edges = edges(&scene, &checker, 200, free);
            let certified = median_micros(&edges, |edge| {
                black_box(certifier.certify_piece(edge, &mut workspace));
            });
            let sampled = median_micros(&edges, |edge| {
                black_box(sampled_free(&checker, edge, 100));
            });
            println!(
                "{name}, {} pairs, {kind} edges of 1 rad, medians: certified {certified:.1} us, sampled at 0.01 rad \
                 {sampled:.1} us, ratio {:.3}",
                certifier.n_pairs(),
                certified / sampled
            );
            let mut group = criterion.benchmark_group(format!("200 {kind} edges of 1 rad, {name}"));
            group.sample_size(10);
            group.bench_function("certified", |bencher| {
                bencher.iter(|| {
                    for edge in &edges {
                        black_box(certifier.certify_piece(edge, &mut workspace));
                    }
                });
            });
            group.bench_function("sampled at 0.01 rad", |bencher| {
                bencher.iter(|| edges.iter().filter(|edge| sampled_free(&checker, edge, 100)).count());
            });
            group.finish();
        }
    }
}

criterion_group!(benches, paths);
criterion_main!(benches);
