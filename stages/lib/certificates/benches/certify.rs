//! Time to certify regions made by hand: grasp bands and approaches of the bottle caps, boxes about an arm's seeds among
//! shelves as they are and among tilted ones with clutter.

// 3.14 is a joint limit of the scenes, not π.
#![allow(clippy::approx_constant)]

use certificates::{Candidate, Certifier, CertifyOptions, CertifyOutcome, Purpose};
use collision::CollisionChecker;
use convex_sets::HPolyhedron;
use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{DVector, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::{Body, Link, Motion, RigidTransform, Role, Scene, Shape};
use std::hint::black_box;
use std::path::Path;

fn load(name: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenes").join(name);
    Scene::load(&folder).expect("a reference scene")
}

fn candidate(region_id: u64, lower: &[f64], upper: &[f64]) -> Candidate {
    let (lower, upper) = (DVector::from_row_slice(lower), DVector::from_row_slice(upper));
    let center = (&lower + &upper) * 0.5;
    Candidate { region_id, polyhedron: HPolyhedron::from_box(&lower, &upper), center }
}

/// Certifies all candidates; each must come out certified.
fn certify_all(certifier: &Certifier, candidates: &[Candidate]) -> usize {
    let purpose = Purpose::default();
    let certified =
        candidates.iter().map(|candidate| match certifier.certify_region(candidate, &purpose, &|| false) {
            Ok(CertifyOutcome::Certified(region)) => region.polyhedron.n_faces(),
            other => panic!("candidate {}: {other:?}", candidate.region_id),
        });
    certified.sum()
}

fn bench(c: &mut Criterion, name: &str, scene: &Scene, candidates: &[Candidate]) {
    let certifier = Certifier::new(scene, |_| 0.0, &CertifyOptions::default(), 0).expect("valid options");
    c.bench_function(name, |b| b.iter(|| certify_all(&certifier, black_box(candidates))));
}

fn bottle_caps(c: &mut Criterion) {
    let candidates = [
        candidate(0, &[-3.14, 0.36, -0.025], &[3.14, 1.0, -0.024]),
        candidate(1, &[-3.14, -0.8064, -0.025], &[3.14, -0.6437, -0.024]),
        candidate(2, &[-3.14, -0.8, -0.055], &[3.14, 1.0, -0.043]),
        candidate(3, &[-3.14, 0.38, -0.055], &[3.14, 1.0, -0.0239]),
    ];
    bench(c, "certify bottle-cap-3dof", &load("bottle-cap-3dof"), &candidates);
    let candidates = [
        candidate(0, &[-3.14, 0.36, -0.025, 0.024], &[3.14, 1.0, -0.024, 0.025]),
        candidate(1, &[-3.14, -0.8064, -0.025, 0.024], &[3.14, -0.6437, -0.024, 0.03]),
        candidate(2, &[-3.14, -0.79, -0.055, 0.024], &[3.14, 1.0, -0.043, 0.03]),
        candidate(3, &[-3.14, 0.38, -0.055, 0.0239], &[3.14, 1.0, -0.0239, 0.055]),
    ];
    bench(c, "certify bottle-cap-4dof", &load("bottle-cap-4dof"), &candidates);
}

const SEEDS: [(&str, [f64; 7]); 5] = [
    ("above shelf", [0.000064, 0.471953, -0.000149, -0.671673, 0.000185, 0.42617, 1.570692]),
    ("top shelf", [-0.000155, 0.397273, 0.00022, -1.367476, 0.000247, -0.192952, 1.570469]),
    ("centre shelf", [-0.000176, 0.683028, 0.000245, -1.647823, 0.000021, -0.759055, 1.570626]),
    ("left bin", [1.332666, 0.786593, 0.362338, -1.491653, -0.319251, 0.921732, 1.79119]),
    ("right bin", [-1.332462, 0.786648, -0.362656, -1.491653, 0.319534, 0.921783, 1.350209]),
];

fn arm(c: &mut Criterion) {
    let scene = load("iiwa14-shelf");
    let around = |seed: &[f64; 7], half: f64| candidate(0, &seed.map(|q| q - half), &seed.map(|q| q + half));
    for (name, seed) in &SEEDS {
        bench(c, &format!("certify iiwa14-shelf ±0.02 {name}"), &scene, &[around(seed, 0.02)]);
    }
    bench(c, "certify iiwa14-shelf ±0.05 above shelf, cut", &scene, &[around(&SEEDS[0].1, 0.05)]);
}

/// The arm's scene with every obstacle tilted by up to 0.3 rad and 40 boxes at random poses added, as far as the arm is
/// free at all seeds: nothing is parallel to anything, as it is with shelves.
fn tilted(mut scene: Scene) -> Scene {
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let mut vector = |size: f64| Vector3::from_fn(|_, _| size * (2.0 * rng.random::<f64>() - 1.0));
    let is_free = |scene: &Scene| {
        let checker = CollisionChecker::new(scene);
        SEEDS.iter().all(|(_, seed)| checker.is_free(seed))
    };
    let obstacles = (0..scene.bodies.len())
        .filter(|&body| scene.links[scene.bodies[body].link_idx].role == Role::Obstacle)
        .collect::<Vec<_>>();
    let mut n_tilted = 0;
    for &body in &obstacles {
        let X_LS = scene.bodies[body].X_LS;
        let tilt = UnitQuaternion::from_scaled_axis(vector(0.3 / 3.0_f64.sqrt()));
        scene.bodies[body].X_LS = X_LS * tilt;
        if is_free(&scene) {
            n_tilted += 1;
        } else {
            scene.bodies[body].X_LS = X_LS;
        }
    }
    for k in 0..40 {
        let X_PF = RigidTransform::from_parts(
            Translation3::from(Vector3::new(0.5, 0.0, 0.6) + vector(0.5)),
            UnitQuaternion::from_scaled_axis(vector(2.0)),
        );
        let half_extents = vector(0.03).map(|x| 0.05 + x);
        let name = format!("clutter_{k}");
        let link =
            Link { name: name.clone(), role: Role::Obstacle, parent: Some(0), X_PF, motion: Motion::Fixed };
        scene.links.push(link);
        let link_idx = scene.links.len() - 1;
        let shape = Shape::Box { half_extents };
        scene.bodies.push(Body { name, link_idx, X_LS: RigidTransform::identity(), shape });
        if !is_free(&scene) {
            scene.links.pop();
            scene.bodies.pop();
        }
    }
    println!("{n_tilted} of {} obstacles tilted, {} bodies in all", obstacles.len(), scene.bodies.len());
    scene
}

/// Boxes of ±0.1 rad about the arm's seeds, among shelves as they are and among tilted ones with clutter.
fn clutter(c: &mut Criterion) {
    let straight = load("iiwa14-shelf");
    let tilted = tilted(load("iiwa14-shelf"));
    for (kind, scene) in [("straight", &straight), ("tilted, cluttered", &tilted)] {
        let certifier = Certifier::new(scene, |_| 0.0, &CertifyOptions::default(), 0).expect("valid options");
        let checker = CollisionChecker::new(scene);
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for (name, seed) in &SEEDS {
            let sample = |_| seed.map(|q| q + 0.1 * (2.0 * rng.random::<f64>() - 1.0));
            let n_free = (0..4000).map(sample).filter(|q| checker.is_free(q)).count();
            let around = candidate(0, &seed.map(|q| q - 0.1), &seed.map(|q| q + 0.1));
            match certifier.certify_region(&around, &Purpose::default(), &|| false) {
                Ok(CertifyOutcome::Certified(region)) => println!(
                    "{kind}, {name}: free {:.3}, kept {:.3}, {} cells, {} cuts",
                    n_free as f64 / 4000.0,
                    region.volume_kept,
                    region.n_cells,
                    region.n_cuts
                ),
                other => println!("{kind}, {name}: {other:?}"),
            }
            c.bench_function(&format!("certify iiwa14-shelf {kind} ±0.1 {name}"), |b| {
                b.iter(|| certifier.certify_region(black_box(&around), &Purpose::default(), &|| false))
            });
        }
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = bottle_caps, arm, clutter
}
criterion_main!(benches);
