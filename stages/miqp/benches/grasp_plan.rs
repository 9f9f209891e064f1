//! Time of a whole grasp plan (sets, bound on ℓ, branch and bound) on both reference tasks, over regions made by hand.

#[path = "../tests/bottle_cap/mod.rs"]
mod bottle_cap;

use criterion::{Criterion, criterion_group, criterion_main};
use miqp::{MiqpOptions, NoSink, plan};
use std::hint::black_box;

fn grasp_plan(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("grasp_plan");
    group.sample_size(10);
    for (name, dim) in [("bottle-cap-3dof", 3), ("bottle-cap-4dof", 4)] {
        for (size, regions) in
            [("3 regions", bottle_cap::three_regions(dim)), ("31 regions", bottle_cap::many_regions(dim, 5))]
        {
            group.bench_function(format!("{name}, {size}, sets"), |bencher| {
                bencher.iter(|| bottle_cap::fixture(dim, black_box(&regions)));
            });
            let fixture = bottle_cap::fixture(dim, &regions);
            group.bench_function(format!("{name}, {size}, plan"), |bencher| {
                bencher.iter(|| {
                    plan(black_box(&fixture.question(12)), &MiqpOptions::default(), &mut NoSink, &|| false)
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, grasp_plan);
criterion_main!(benches);
