mod bottle_cap;
use miqp::{MiqpOptions, NoSink, PlanOutcome, plan};
use std::time::Instant;
#[test]
fn probe() {
    for dim in [3, 4] {
        for n in [0, 2, 4, 5, 6] {
            let regions = if n == 0 { bottle_cap::three_regions(dim) } else { bottle_cap::many_regions(dim, n) };
            let t = Instant::now();
            let f = bottle_cap::fixture(dim, &regions);
            let t1 = t.elapsed();
            let t = Instant::now();
            let o = plan(&f.question(12), &MiqpOptions::default(), &mut NoSink, &|| false).unwrap();
            let t2 = t.elapsed();
            match o {
                PlanOutcome::Settled(p) => println!(
                    "dim {dim} regions {} sets {t1:?} plan {t2:?} nodes {:?} cost {:?} lb {:?} l {:?}",
                    regions.len(), p.tried.last().map(|t| t.nodes), p.cost, p.lower_bound, p.n_grasps
                ),
                PlanOutcome::Open { tried, .. } => println!("open {tried:?}"),
            }
        }
    }
}
