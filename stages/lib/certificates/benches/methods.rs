//! Swept hulls against sums of squares on regions of 3 and 4 coordinates: time (criterion), and as a table the volume
//! that is certified, the size of the certificates, and the time to certify and to check.
//!
//! Boxes beside contact, and the same boxes turned: polytopes whose faces are not parallel to the axes.

// 3.14 is a joint limit of the scenes, not π.
#![allow(clippy::approx_constant)]

use certificates::{Candidate, CertifiedRegion, Certifier, CertifyOptions, CertifyOutcome, Method, Purpose};
use convex_sets::HPolyhedron;
use criterion::{Criterion, criterion_group, criterion_main};
use ipc_types::artefact::{CertificatesFile, Region};
use nalgebra::{DMatrix, DVector};
use scene::Scene;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

fn load(name: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenes").join(name);
    Scene::load(&folder).expect("a reference scene")
}

fn boxed(region_id: u64, lower: &[f64], upper: &[f64]) -> Candidate {
    let (lower, upper) = (DVector::from_row_slice(lower), DVector::from_row_slice(upper));
    let center = (&lower + &upper) * 0.5;
    Candidate { region_id, polyhedron: HPolyhedron::from_box(&lower, &upper), center }
}

/// The box with its corners cut off by rows over all coordinates but the first: Σ ±(q_j − c_j)/h_j ≤ 1.5.
fn cut_corners(candidate: &Candidate) -> Candidate {
    let (P, c) = (&candidate.polyhedron, &candidate.center);
    let bounds = P.bounding_box().expect("a box");
    let n = c.len();
    let mut rows: Vec<(DVector<f64>, f64)> =
        (0..P.n_faces()).map(|r| (P.A.row(r).transpose(), P.b[r])).collect();
    for corner in 0..1_usize << (n - 1) {
        let a = DVector::from_fn(n, |j, _| match j {
            0 => 0.0,
            _ => (if corner >> (j - 1) & 1 == 1 { 2.0 } else { -2.0 }) / (bounds.upper[j] - bounds.lower[j]),
        });
        let norm = a.norm();
        rows.push((&a / norm, (a.dot(c) + 1.5) / norm));
    }
    let polyhedron = HPolyhedron {
        A: DMatrix::from_fn(rows.len(), n, |r, j| rows[r].0[j]),
        b: DVector::from_fn(rows.len(), |r, _| rows[r].1),
    };
    Candidate { region_id: candidate.region_id + 100, polyhedron, center: c.clone() }
}

fn candidates_3dof() -> Vec<Candidate> {
    let boxes = [
        boxed(0, &[-3.14, 0.36, -0.025], &[3.14, 1.0, -0.024]),
        boxed(1, &[-3.14, -0.8064, -0.025], &[3.14, -0.6437, -0.024]),
        boxed(2, &[-3.14, -0.8, -0.055], &[3.14, 1.0, -0.043]),
        boxed(3, &[-3.14, 0.38, -0.055], &[3.14, 1.0, -0.0239]),
    ];
    boxes.iter().cloned().chain(boxes.iter().map(cut_corners)).collect()
}

fn candidates_4dof() -> Vec<Candidate> {
    let boxes = [
        boxed(0, &[-3.14, 0.36, -0.025, 0.024], &[3.14, 1.0, -0.024, 0.025]),
        boxed(1, &[-3.14, -0.8064, -0.025, 0.024], &[3.14, -0.6437, -0.024, 0.03]),
        boxed(2, &[-3.14, -0.79, -0.055, 0.024], &[3.14, 1.0, -0.043, 0.03]),
        boxed(3, &[-3.14, 0.38, -0.055, 0.0239], &[3.14, 1.0, -0.0239, 0.055]),
    ];
    boxes.iter().cloned().chain(boxes.iter().map(cut_corners)).collect()
}

fn certified(certifier: &Certifier, candidate: &Candidate) -> Option<CertifiedRegion> {
    match certifier.certify_region(candidate, &Purpose::default(), &|| false) {
        Ok(CertifyOutcome::Certified(region)) => Some(*region),
        _ => None,
    }
}

fn certifier(scene: &Scene, method: Method) -> Certifier {
    let options = CertifyOptions { method, ..CertifyOptions::default() };
    Certifier::new(scene, |_| 0.0, &options, 0).expect("valid options")
}

fn artefact(region: &CertifiedRegion) -> Region {
    let P = &region.polyhedron;
    Region {
        id: region.certificate.region_id,
        parent: None,
        A: (0..P.n_faces()).map(|r| P.A.row(r).iter().copied().collect()).collect(),
        b: P.b.iter().copied().collect(),
        center: region.center.iter().copied().collect(),
        method: "bench".to_owned(),
        certified: true,
        margin: 0.0,
    }
}

/// One row a candidate and method: kept volume, bytes, milliseconds to certify and to check.
fn table(name: &str, scene: &Scene, candidates: &[Candidate]) {
    println!("\n| {name}, region | method | volume kept | certificate, kB | certify, ms | check, ms |");
    println!("| --- | --- | --- | --- | --- | --- |");
    for candidate in candidates {
        for method in [Method::Swept, Method::Sos] {
            let certifier = certifier(scene, method);
            let start = Instant::now();
            let region = certified(&certifier, candidate);
            let millis = start.elapsed().as_secs_f64() * 1e3;
            let shape = if candidate.region_id < 100 { "box" } else { "cut box" };
            let head = format!("| {shape} {} | {method:?}", candidate.region_id % 100);
            let Some(region) = region else {
                println!("{head} | not certified | | {millis:.1} | |");
                continue;
            };
            let file = CertificatesFile { regions: vec![region.certificate.clone()] };
            let bytes =
                ipc_types::container::encode(Path::new("bench"), &file, &scene.digest).expect("it fits");
            let start = Instant::now();
            check::region::verify(scene, &artefact(&region), &region.certificate, 0.0).expect("it holds");
            let check_millis = start.elapsed().as_secs_f64() * 1e3;
            println!(
                "{head} | {:.3} | {:.1} | {millis:.1} | {check_millis:.1} |",
                region.volume_kept,
                bytes.len() as f64 / 1e3
            );
        }
    }
}

fn methods(c: &mut Criterion) {
    for (name, candidates) in [("bottle-cap-3dof", candidates_3dof()), ("bottle-cap-4dof", candidates_4dof())]
    {
        let scene = load(name);
        table(name, &scene, &candidates);
        for method in [Method::Swept, Method::Sos] {
            let certifier = certifier(&scene, method);
            c.bench_function(&format!("{name}, {} regions, {method:?}", candidates.len()), |b| {
                b.iter(|| {
                    for candidate in &candidates {
                        black_box(certified(&certifier, candidate));
                    }
                });
            });
        }
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = methods
}
criterion_main!(benches);
