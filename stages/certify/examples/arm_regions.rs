//! Certifies the regions of a decomposition one by one and prints a table.
//!
//! `cargo run --release -p certify --example arm_regions -- SCENE DIR [first] [last]`, DIR with `decompose/regions.bin`.

use certify::{Candidate, Certifier, CertifyOptions, CertifyOutcome, Purpose};
use convex_sets::{HPolyhedron, HitAndRun};
use ipc_types::artefact::RegionsFile;
use ipc_types::store::read_bin;
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use scene::Scene;
use std::path::Path;
use std::time::Instant;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let scene = Scene::load(Path::new(&args[1])).expect("scene");
    let file: RegionsFile =
        read_bin(&Path::new(&args[2]).join("decompose/regions.bin"), None).expect("regions");
    let first: usize = args.get(3).map_or(0, |x| x.parse().expect("number"));
    let last: usize = args.get(4).map_or(file.regions.len(), |x| x.parse().expect("number"));
    let certifier = Certifier::new(&scene, |_| 0.0, &options(), 0).expect("options");
    println!("region faces | seconds cells cuts faces kept(guide) kept(held out)");
    for region in &file.regions[first..last] {
        let candidate = wire::Region::from_artefact(region, scene.dim()).expect("region");
        let candidate =
            Candidate { region_id: candidate.id, polyhedron: candidate.polyhedron, center: candidate.center };
        let begin = Instant::now();
        let outcome = certifier.certify_region(&candidate, &Purpose::default(), &|| false).expect("valid");
        let seconds = begin.elapsed().as_secs_f64();
        let CertifyOutcome::Certified(certified) = outcome else {
            println!("{} {outcome:?}", region.id);
            continue;
        };
        let kept = kept(&candidate.polyhedron, &candidate.center, &certified.polyhedron);
        println!(
            "{} {} | {seconds:.2} {} {} {} {:.3} {kept:.3}",
            region.id,
            candidate.polyhedron.n_faces(),
            certified.n_cells,
            certified.n_cuts,
            certified.polyhedron.n_faces(),
            certified.volume_kept,
        );
    }
}

/// Share of `before` that is in `after`, by samples of a walk of its own.
fn kept(before: &HPolyhedron, center: &DVector<f64>, after: &HPolyhedron) -> f64 {
    const N_SAMPLES: usize = 10_000;
    let n = center.len();
    let mut rng = ChaCha8Rng::seed_from_u64(4711);
    let mut walk = HitAndRun::new(before, center, DMatrix::identity(n, n));
    let mut n_kept = 0;
    for step in 0..N_SAMPLES + 100 {
        for _ in 0..8 {
            walk.step(&mut rng);
        }
        let q = DVector::from_column_slice(walk.point());
        n_kept += usize::from(step >= 100 && after.contains(&q, 0.0));
    }
    n_kept as f64 / N_SAMPLES as f64
}

fn options() -> CertifyOptions {
    let number =
        |name: &str, default: f64| std::env::var(name).map_or(default, |v| v.parse().expect("number"));
    let d = CertifyOptions::default();
    CertifyOptions {
        guide_samples: number("SAMPLES", d.guide_samples as f64) as usize,
        first_cut_loss: number("FIRST", d.first_cut_loss),
        max_cut_loss: number("MAX", d.max_cut_loss),
        cells_per_doubling: number("DOUBLING", d.cells_per_doubling as f64) as u64,
        ..d
    }
}
