//! Time of all paths of a plan on both reference scenes, over regions made by hand.

#[path = "../tests/bottle_cap/mod.rs"]
mod bottle_cap;

use criterion::{Criterion, criterion_group, criterion_main};
use gcs::{Found, Options, Regions, Sink, plan_paths};
use ipc_types::artefact::{LeafCut, Segment};
use std::hint::black_box;

struct NoSink;

impl Sink for NoSink {
    fn segment(&mut self, _: usize, _: &Segment, _: &Found) {}
    fn cut(&mut self, _: usize, _: &LeafCut) {}
}

fn paths(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("paths");
    group.sample_size(10);
    for dim in [3, 4] {
        let scene = bottle_cap::scene(dim);
        let plan = bottle_cap::by_turns(&scene);
        let n_segments = plan.modes.as_ref().map_or(0, Vec::len);
        let coordinates: Vec<String> = scene.coordinates.iter().map(|c| c.name.clone()).collect();
        for n_each in [1, 3, 6] {
            let spaces = bottle_cap::manipulation(&scene, &bottle_cap::regions(&scene, n_each));
            let ids: Vec<u64> = (0..spaces.regions.len() as u64).collect();
            let certified = vec![true; ids.len()];
            let regions = Regions {
                manipulation: &spaces,
                ids: &ids,
                certified: &certified,
                coordinates: &coordinates,
            };
            let name = format!("{}, {} regions, {n_segments} segments", scene.name, ids.len());
            group.bench_function(name, |bencher| {
                bencher.iter(|| {
                    plan_paths(black_box(regions), &plan, &Options::default(), 7, &mut NoSink, &|| false)
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, paths);
criterion_main!(benches);
