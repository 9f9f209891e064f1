//! Sum-of-squares certificates: random scenes against the collision library, planes against the bodies at sampled
//! configurations, corrupted and infeasible twins.

use super::random_scene::random_scene;
use super::regions::{candidate, samples};
use crate::sums::pair_sums::PairSums;
use crate::{
    Candidate, CertifiedRegion, Certifier, CertifyOptions, CertifyOutcome, Method, Purpose, recheck,
};
use collision::CollisionChecker;
use ipc_types::artefact::{PairProof, RegionCertificate, SosProof};
use kinematics::Support;
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use scene::Scene;

fn certify(scene: &Scene, candidate: &Candidate, clearance: f64, min_width: f64) -> CertifyOutcome {
    let options = CertifyOptions { method: Method::Sos, min_width, ..CertifyOptions::default() };
    let certifier = Certifier::new(scene, |_| clearance, &options, 0).expect("options are valid");
    certifier.certify_region(candidate, &Purpose::default(), &|| false).expect("a valid candidate")
}

fn sums(certificate: &mut RegionCertificate) -> impl Iterator<Item = &mut SosProof> {
    certificate.pairs.iter_mut().map(|pair| match &mut pair.proof {
        PairProof::SumOfSquares(proof) => &mut **proof,
        PairProof::Swept(_) => panic!("sums of squares were asked for"),
    })
}

/// The plane of each proof, at `q`, has both bodies on their sides, with half the clearance each.
fn assert_planes_separate(scene: &Scene, region: &CertifiedRegion, q: &[f64]) {
    for certificate in &region.certificate.pairs {
        let PairProof::SumOfSquares(proof) = &certificate.proof else { panic!("sums were asked for") };
        let bodies = [certificate.body_a as usize, certificate.body_b as usize];
        let pair = scene::CollisionPair { body_a: bodies[0], body_b: bodies[1] };
        let pair = PairSums::new(scene, pair, certificate.clearance);
        let mut a = Vector3::from(proof.plane_a[0]);
        let mut b = proof.plane_b[0];
        for (i, joint) in proof.joints.iter().enumerate() {
            let s = match pair.kinds[i] {
                scene::CoordinateKind::Revolute => {
                    (0.5 * (q[usize::from(joint.coordinate)] - joint.center)).tan() / joint.scale
                }
                scene::CoordinateKind::Prismatic => {
                    (q[usize::from(joint.coordinate)] - joint.center) / joint.scale
                }
            };
            assert!(s.abs() <= 1.0, "s = {s}");
            a += Vector3::from(proof.plane_a[i + 1]) * s;
            b += proof.plane_b[i + 1] * s;
        }
        for (side, sign) in [(0, 1.0), (1, -1.0)] {
            let body = &scene.bodies[bodies[side]];
            let chain = kinematics::Chain::to_body(scene, proof.frame.link as usize, bodies[side]);
            let X = chain.pose(q);
            // The least value of sign · (a·x + b) over the whole body.
            let w = X.rotation.inverse() * (a * -sign);
            let least = sign * (a.dot(&X.translation.vector) + b) - body.shape.support_value(&w);
            assert!(least > 0.5 * certificate.clearance * a.norm(), "{}: {least:e}", body.name);
        }
    }
}

#[test]
fn regions_of_random_scenes_are_certified_and_hold_no_collision() {
    let (mut n_certified, mut n_whole) = (0, 0);
    for seed in 0..18 {
        let scene = random_scene(seed);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let clearance = if seed % 3 == 0 { 0.005 } else { 0.0 };
        let Some(candidate) = candidate(&scene, &mut rng, 0.1) else { continue };
        let outcome = certify(&scene, &candidate, clearance, 0.1);
        let CertifyOutcome::Certified(region) = outcome else { continue };
        n_certified += 1;
        n_whole += usize::from(region.volume_kept == 1.0);
        recheck(&scene, &region.polyhedron, &region.certificate).expect("a certificate that holds");
        let checker = CollisionChecker::with_clearances(&scene, |_| clearance);
        for (idx, q) in samples(&region.polyhedron, &scene, &mut rng).iter().enumerate() {
            assert_eq!(checker.colliding_pair(q.as_slice()), None, "scene {seed}: {q:?}");
            if idx % 50 == 0 {
                assert_planes_separate(&scene, &region, q.as_slice());
            }
        }
    }
    assert!(n_certified > 10 && n_whole > 4 && n_whole < n_certified, "{n_certified}, {n_whole} whole");
}

/// A region with a collision is never certified as it is.
#[test]
fn a_region_with_a_collision_is_not_certified_whole() {
    let mut n_colliding = 0;
    for seed in 0..80 {
        let scene = random_scene(seed);
        // Programmes without a solution take long on long chains.
        if scene.dim() > 4 {
            continue;
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let Some(candidate) = candidate(&scene, &mut rng, 0.3) else { continue };
        let checker = CollisionChecker::new(&scene);
        let collides = samples(&candidate.polyhedron, &scene, &mut rng)
            .iter()
            .any(|q| checker.colliding_pair(q.as_slice()).is_some());
        if collides && n_colliding < 6 {
            n_colliding += 1;
            let outcome = certify(&scene, &candidate, 0.0, 1.0);
            assert!(matches!(outcome, CertifyOutcome::Rejected { .. }), "scene {seed}");
        }
    }
    assert_eq!(n_colliding, 6);
}

#[test]
fn a_corrupted_proof_is_refused() {
    type Damage = fn(&mut SosProof);
    let damages: [(&str, Damage); 12] = [
        ("the plane is turned round", |p| p.plane_a.iter_mut().flatten().for_each(|a| *a = -*a)),
        ("the plane is nothing", |p| p.plane_a.iter_mut().flatten().for_each(|a| *a = 0.0)),
        ("the plane is moved", |p| p.plane_b[0] += 1.0),
        ("a scale is smaller", |p| p.joints.iter_mut().for_each(|j| j.scale *= 0.9)),
        ("a bound is tighter", |p| p.joints.iter_mut().for_each(|j| j.upper -= 1e-3)),
        ("bounds are unproven", |p| {
            p.joints.iter_mut().for_each(|j| j.lower_multipliers.clear());
        }),
        ("a Gram matrix is indefinite", |p| {
            p.points_a[0][0].gram[0] = -1.0;
        }),
        ("a Gram matrix is larger", |p| {
            p.points_a[0][0].gram[0] += 1.0;
        }),
        ("a point is left out", |p| {
            p.points_b.pop();
        }),
        ("a frame is not between the bodies", |p| p.frame.link = 999),
        ("rotations are dropped", |p| p.frame.n_dropped_a += 1),
        ("a joint is left out", |p| {
            p.joints.pop();
        }),
    ];
    let mut n_corrupted = 0;
    for seed in 0..8 {
        let scene = random_scene(seed);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let Some(candidate) = candidate(&scene, &mut rng, 0.08) else { continue };
        let CertifyOutcome::Certified(region) = certify(&scene, &candidate, 0.0, 0.1) else { continue };
        for (what, damage) in &damages {
            let mut twin = region.certificate.clone();
            sums(&mut twin).for_each(damage);
            assert!(recheck(&scene, &region.polyhedron, &twin).is_err(), "scene {seed}: {what}");
            n_corrupted += 1;
        }
        let mut twin = region.certificate.clone();
        twin.pairs.iter_mut().for_each(|pair| pair.clearance = 10.0);
        assert!(recheck(&scene, &region.polyhedron, &twin).is_err(), "scene {seed}: more clearance");
    }
    assert!(n_corrupted >= 24);
}

#[test]
fn the_same_certificate_every_time() {
    let scene = random_scene(3);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let candidate = candidate(&scene, &mut rng, 0.1).expect("a free configuration");
    let certificates: Vec<RegionCertificate> = (0..2)
        .map(|_| match certify(&scene, &candidate, 0.0, 0.1) {
            CertifyOutcome::Certified(region) => region.certificate,
            other => panic!("not certified: {other:?}"),
        })
        .collect();
    assert_eq!(certificates[0], certificates[1]);
}
