//! Certificates of an earlier run: used where they hold, never where they do not.

use super::random_scene::random_scene;
use crate::{
    Candidate, CertifiedRegion, Certifier, CertifyOptions, CertifyOutcome, EarlierCertificates, Purpose,
    recheck,
};
use collision::CollisionChecker;
use convex_sets::HPolyhedron;
use ipc_types::artefact::{Cell, PairProof, Region, RegionCertificate, RowOrigin};
use nalgebra::{DMatrix, DVector};
use scene::Scene;
use std::path::Path;

fn reference_scene(name: &str) -> Scene {
    Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenes").join(name))
        .expect("a reference scene")
}

fn certify(scene: &Scene, candidate: &Candidate, earlier: &EarlierCertificates) -> Option<CertifiedRegion> {
    let options = CertifyOptions { guide_samples: 1000, max_cells: 20_000, ..CertifyOptions::default() };
    let certifier = Certifier::new(scene, |_| 0.0, &options, 3).expect("options are valid");
    let outcome = certifier.certify_region_reusing(candidate, &Purpose::default(), earlier, &|| false);
    match outcome.expect("a valid candidate") {
        CertifyOutcome::Certified(region) => Some(*region),
        _ => None,
    }
}

/// A box about a free configuration, with half-widths of a share of the ranges.
fn candidate(scene: &Scene, share: f64) -> Option<Candidate> {
    let checker = CollisionChecker::new(scene);
    let (lower, upper) = (scene.lower(), scene.upper());
    let at = |k: usize| {
        DVector::from_fn(scene.dim(), |j, _| {
            let t = (0.37 + 0.618 * (k * (j + 1)) as f64).fract();
            lower[j] + t * (upper[j] - lower[j])
        })
    };
    let center = (0..200).map(at).find(|q| checker.is_free(q.as_slice()))?;
    let half = (&upper - &lower) * share;
    let polyhedron = HPolyhedron::from_box(
        &lower.zip_map(&(&center - &half), f64::max),
        &upper.zip_map(&(&center + &half), f64::min),
    );
    Some(Candidate { region_id: 7, polyhedron, center })
}

fn earlier(region: &CertifiedRegion, certificate: RegionCertificate) -> EarlierCertificates {
    let P = &region.polyhedron;
    let artefact = Region {
        id: 7,
        parent: None,
        A: (0..P.n_faces()).map(|i| P.A.row(i).iter().copied().collect()).collect(),
        b: P.b.iter().copied().collect(),
        center: region.center.iter().copied().collect(),
        method: String::new(),
        certified: true,
        margin: 0.0,
    };
    EarlierCertificates::new(vec![(artefact, certificate)])
}

fn again(region: &CertifiedRegion) -> Candidate {
    Candidate { region_id: 8, polyhedron: region.polyhedron.clone(), center: region.center.clone() }
}

#[test]
fn in_the_same_scene_every_pair_is_used_again_and_nothing_is_cut() {
    let mut n_seen = 0;
    for seed in 0..40 {
        let scene = random_scene(seed);
        let Some(candidate) = candidate(&scene, 0.15) else { continue };
        let Some(region) = certify(&scene, &candidate, &EarlierCertificates::default()) else { continue };
        assert_eq!(region.n_reused, 0);
        let earlier = earlier(&region, region.certificate.clone());
        let Some(second) = certify(&scene, &again(&region), &earlier) else {
            panic!("scene {seed}: refused")
        };
        recheck(&scene, &second.polyhedron, &second.certificate).expect("the certificate holds");
        assert_eq!(second.n_reused, scene.collision_pairs().len(), "scene {seed}");
        assert_eq!((second.n_cells, second.n_cuts, second.volume_kept), (0, 0, 1.0));
        // And once more, from what it has become.
        let third = certify(&scene, &again(&second), &self::earlier(&second, second.certificate.clone()));
        assert_eq!(third.map(|third| third.n_reused), Some(scene.collision_pairs().len()));
        n_seen += 1;
    }
    assert!(n_seen > 15, "{n_seen}");
}

#[test]
fn a_candidate_with_more_faces_uses_the_certificate_of_the_region_that_it_begins_with() {
    let scene = random_scene(1);
    let candidate = candidate(&scene, 0.15).expect("a free configuration");
    let region = certify(&scene, &candidate, &EarlierCertificates::default()).expect("certified");
    let earlier = earlier(&region, region.certificate.clone());
    let n = scene.dim();
    let a = DMatrix::from_fn(1, n, |_, j| if j == 0 { 1.0 } else { 0.0 });
    let face = HPolyhedron { b: &a * &region.center + DVector::from_element(1, 1e-3), A: a };
    let more = Candidate { polyhedron: region.polyhedron.intersection(&face), ..again(&region) };
    let second = certify(&scene, &more, &earlier).expect("certified");
    recheck(&scene, &second.polyhedron, &second.certificate).expect("the certificate holds");
    assert_eq!(second.n_reused, scene.collision_pairs().len());
    // Its twin: with the new face in front, the faces that rows name are others.
    let before = Candidate { polyhedron: face.intersection(&region.polyhedron), ..again(&region) };
    let second = certify(&scene, &before, &earlier).expect("certified by a search");
    assert_eq!(second.n_reused, 0);
}

/// What moves is searched, what does not is used: an obstacle a centimetre further.
#[test]
fn a_moved_obstacle_costs_its_own_pairs_only() {
    let scene = reference_scene("bottle-cap-3dof");
    let center = DVector::from_vec(vec![0.0, 0.0, -0.05]);
    let polyhedron = HPolyhedron::from_box(
        &DVector::from_vec(vec![-3.14, -0.05, -0.055]),
        &DVector::from_vec(vec![3.14, 0.05, -0.045]),
    );
    let candidate = Candidate { region_id: 7, polyhedron, center };
    let region = certify(&scene, &candidate, &EarlierCertificates::default()).expect("certified");
    let mut moved = scene.clone();
    let body = moved.bodies.iter_mut().find(|body| body.name == "obstacle_1").expect("an obstacle");
    body.X_LS.translation.vector.y += 0.01;
    let second =
        certify(&moved, &again(&region), &earlier(&region, region.certificate.clone())).expect("certified");
    recheck(&moved, &second.polyhedron, &second.certificate).expect("the certificate holds in the new scene");
    let obstacle = moved.bodies.iter().position(|body| body.name == "obstacle_1").expect("an obstacle");
    let touches = |pair: &&scene::CollisionPair| pair.body_a == obstacle || pair.body_b == obstacle;
    let pairs = moved.collision_pairs();
    assert!(second.n_reused >= pairs.len() - pairs.iter().filter(touches).count(), "{}", second.n_reused);
}

/// An obstacle that moves into the region: whatever the certificate says, the proof must be of the scene at hand.
#[test]
fn a_certificate_that_no_longer_holds_is_not_carried_over() {
    let (mut n_cut, mut n_refused) = (0, 0);
    for seed in 0..150 {
        let scene = random_scene(seed);
        let Some(candidate) = candidate(&scene, 0.15) else { continue };
        let Some(region) = certify(&scene, &candidate, &EarlierCertificates::default()) else { continue };
        let mut moved = scene.clone();
        for body in &mut moved.bodies {
            body.X_LS.translation.vector.x += 0.05;
        }
        let earlier = earlier(&region, region.certificate.clone());
        match certify(&moved, &again(&region), &earlier) {
            None => n_refused += 1,
            Some(second) => {
                recheck(&moved, &second.polyhedron, &second.certificate).expect("the certificate holds");
                n_cut += usize::from(second.n_reused < moved.collision_pairs().len());
            }
        }
    }
    assert!(n_cut + n_refused > 10, "{n_cut} searched, {n_refused} refused");
}

#[test]
fn corrupted_certificates_are_searched_anew() {
    let mut n_corrupted = 0;
    for seed in 0..30 {
        let scene = random_scene(seed);
        let Some(candidate) = candidate(&scene, 0.15) else { continue };
        let Some(region) = certify(&scene, &candidate, &EarlierCertificates::default()) else { continue };
        let n_pairs = scene.collision_pairs().len();
        let mut damage: Vec<RegionCertificate> = Vec::new();
        for pair_idx in 0..region.certificate.pairs.len() {
            let mut damaged = region.certificate.clone();
            let PairProof::Swept(proof) = &mut damaged.pairs[pair_idx].proof else { continue };
            for cell in &mut proof.cells {
                if let Cell::Separated { normal, .. } | Cell::Corners { normal, .. } = cell {
                    *normal = normal.map(|v| -v);
                }
            }
            damage.push(damaged);
            let mut shorter = region.certificate.clone();
            let PairProof::Swept(proof) = &mut shorter.pairs[pair_idx].proof else { continue };
            proof.cells.pop();
            damage.push(shorter);
        }
        for row_idx in 0..region.certificate.rows.len() {
            let mut damaged = region.certificate.clone();
            // So much that no row which is implied with room to spare still is.
            damaged.rows[row_idx].b -= 1e3;
            damage.push(damaged);
            let mut damaged = region.certificate.clone();
            damaged.rows[row_idx].origin = RowOrigin::Implied(vec![(9999, 1.0)]);
            damage.push(damaged);
            let mut damaged = region.certificate.clone();
            damaged.rows[row_idx].a.pop();
            damage.push(damaged);
            let mut damaged = region.certificate.clone();
            damaged.rows[row_idx].b = f64::NAN;
            damage.push(damaged);
        }
        for damaged in damage {
            let second = certify(&scene, &again(&region), &earlier(&region, damaged));
            let second = second.expect("a search certifies it as before");
            recheck(&scene, &second.polyhedron, &second.certificate).expect("the certificate holds");
            assert!(second.n_reused < n_pairs, "scene {seed}");
            n_corrupted += 1;
        }
    }
    assert!(n_corrupted > 50, "{n_corrupted}");
}
