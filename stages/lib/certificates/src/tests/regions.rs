//! Certified regions of random scenes against the collision library, and corrupted certificates.

use super::random_scene::random_scene;
use crate::{Candidate, CertifiedRegion, Certifier, CertifyOptions, CertifyOutcome, Purpose, recheck};
use collision::CollisionChecker;
use convex_sets::HPolyhedron;
use ipc_types::artefact::{Cell, PairCertificate, PairProof, RegionCertificate, RowOrigin, SweptRow};
use nalgebra::DVector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use scene::Scene;

fn options() -> CertifyOptions {
    CertifyOptions { guide_samples: 1000, max_cells: 20_000, ..CertifyOptions::default() }
}

/// A box about a free configuration of the scene, with widths a share of the ranges.
pub(super) fn candidate(scene: &Scene, rng: &mut ChaCha8Rng, share: f64) -> Option<Candidate> {
    let checker = CollisionChecker::new(scene);
    let (lower, upper) = (scene.lower(), scene.upper());
    let random = |rng: &mut ChaCha8Rng| {
        DVector::from_fn(scene.dim(), |j, _| lower[j] + rng.random::<f64>() * (upper[j] - lower[j]))
    };
    let center = (0..100).map(|_| random(rng)).find(|q| checker.is_free(q.as_slice()))?;
    let half = (&upper - &lower) * share;
    let polyhedron = HPolyhedron::from_box(
        &lower.zip_map(&(&center - &half), f64::max),
        &upper.zip_map(&(&center + &half), f64::min),
    );
    Some(Candidate { region_id: rng.random_range(0..1000), polyhedron, center })
}

pub fn certify(scene: &Scene, candidate: &Candidate, clearance: f64) -> Option<CertifiedRegion> {
    let certifier = Certifier::new(scene, |_| clearance, &options(), 3).expect("options are valid");
    match certifier.certify_region(candidate, &Purpose::default(), &|| false).expect("a valid candidate") {
        CertifyOutcome::Certified(region) => Some(*region),
        _ => None,
    }
}

fn cells(pair: &mut PairCertificate) -> &mut Vec<Cell> {
    match &mut pair.proof {
        PairProof::Swept(proof) => &mut proof.cells,
        PairProof::SumOfSquares(_) => panic!("swept hulls were asked for"),
    }
}

/// Samples of a polytope: uniform in its joint box, kept if inside; vertices towards random directions.
pub(super) fn samples(polyhedron: &HPolyhedron, scene: &Scene, rng: &mut ChaCha8Rng) -> Vec<DVector<f64>> {
    let bounds = polyhedron.bounding_box().expect("a region is bounded");
    let mut found = Vec::new();
    for _ in 0..2000 {
        let q = DVector::from_fn(scene.dim(), |j, _| {
            bounds.lower[j] + rng.random::<f64>() * (bounds.upper[j] - bounds.lower[j])
        });
        if polyhedron.contains(&q, 0.0) {
            found.push(q);
        }
    }
    for _ in 0..50 {
        let c = DVector::from_fn(scene.dim(), |_, _| rng.random::<f64>() - 0.5);
        let lp = convex_sets::lp::minimize(&c, &polyhedron.A, &polyhedron.b, &bounds.lower, &bounds.upper);
        found.extend(lp.optimal_point().cloned());
    }
    found
}

#[test]
fn certified_regions_hold_no_collision() {
    let (mut n_certified, mut n_cut) = (0, 0);
    for seed in 0..60 {
        let scene = random_scene(seed);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let clearance = if seed % 3 == 0 { 0.01 } else { 0.0 };
        let Some(candidate) = candidate(&scene, &mut rng, 0.15) else { continue };
        let Some(region) = certify(&scene, &candidate, clearance) else { continue };
        n_certified += 1;
        n_cut += usize::from(region.n_cuts > 0);
        recheck(&scene, &region.polyhedron, &region.certificate)
            .expect("the certificate says what was meant");
        assert!(region.polyhedron.contains(&region.center, -1e-12));
        let checker = CollisionChecker::with_clearances(&scene, |_| clearance);
        for q in samples(&region.polyhedron, &scene, &mut rng) {
            assert_eq!(checker.colliding_pair(q.as_slice()), None, "scene {seed}: {q:?}");
            // A vertex of the programme lies on the faces up to rounding.
            assert!(candidate.polyhedron.contains(&q, 1e-7), "it grew");
        }
    }
    assert!(n_certified > 30 && n_cut > 3, "{n_certified} certified, {n_cut} of them cut");
}

#[test]
fn a_corrupted_certificate_is_refused() {
    let mut n_corrupted = 0;
    for seed in 0..40 {
        let scene = random_scene(seed);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let Some(candidate) = candidate(&scene, &mut rng, 0.15) else { continue };
        let Some(region) = certify(&scene, &candidate, 0.0) else { continue };
        let check = |certificate: &RegionCertificate| recheck(&scene, &region.polyhedron, certificate);
        assert!(check(&region.certificate).is_ok());
        // Normals turned round, leaves left out, clearance raised, rows moved, pairs left out.
        let mut twin = region.certificate.clone();
        for cell in twin.pairs.iter_mut().flat_map(cells) {
            if let Cell::Separated { normal, .. } = cell {
                *normal = normal.map(|x| -x);
            }
        }
        assert!(check(&twin).is_err());
        let mut twin = region.certificate.clone();
        cells(&mut twin.pairs[0]).pop();
        assert!(check(&twin).is_err());
        let mut twin = region.certificate.clone();
        twin.pairs[0].clearance = 10.0;
        assert!(check(&twin).is_err());
        let mut twin = region.certificate.clone();
        twin.pairs.pop();
        assert!(check(&twin).is_err());
        for row_idx in 0..region.certificate.rows.len() {
            let mut twin = region.certificate.clone();
            // By more than any slack that an implied row may have.
            twin.rows[row_idx].b -= 20.0;
            assert!(check(&twin).is_err(), "row {row_idx}");
            if let RowOrigin::Face(_) = &twin.rows[row_idx].origin {
                twin.rows[row_idx].b += 20.0 + 1e-9;
                assert!(check(&twin).is_err(), "row {row_idx}");
            }
        }
        // A region that is larger than what was certified, where the proof leans on a cut.
        let P = &candidate.polyhedron;
        let is_of_candidate = |a: &[f64], b: f64| {
            (0..P.n_faces()).any(|i| P.b[i] == b && P.A.row(i).iter().zip(a).all(|(x, y)| x == y))
        };
        let is_cut = |row: &SweptRow| !is_of_candidate(&row.a, row.b);
        if region.certificate.rows.iter().any(is_cut) {
            assert!(recheck(&scene, &candidate.polyhedron, &region.certificate).is_err());
            n_corrupted += 1;
        }
    }
    assert!(n_corrupted > 0);
}

#[test]
fn a_centre_in_collision_is_refused_with_its_pair() {
    let mut n_refused = 0;
    for seed in 0..200 {
        let scene = random_scene(seed);
        let checker = CollisionChecker::new(&scene);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let q = DVector::from_fn(scene.dim(), |j, _| {
            let c = &scene.coordinates[j];
            c.lower + (0.1 + 0.8 * rng.random::<f64>()) * (c.upper - c.lower)
        });
        if checker.is_free(q.as_slice()) {
            continue;
        }
        let half = DVector::from_element(scene.dim(), 0.001);
        let polyhedron = HPolyhedron::from_box(&(&q - &half), &(&q + &half));
        let candidate = Candidate { region_id: 0, polyhedron, center: q.clone() };
        let certifier = Certifier::new(&scene, |_| 0.0, &options(), 0).expect("options are valid");
        match certifier.certify_region(&candidate, &Purpose::default(), &|| false) {
            Ok(CertifyOutcome::Rejected { pair, configuration, .. }) => {
                assert!(checker.colliding_pairs(q.as_slice()).contains(&pair));
                assert_eq!(configuration.len(), scene.dim());
                n_refused += 1;
            }
            other => panic!("scene {seed}: {other:?}"),
        }
    }
    assert!(n_refused > 5);
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    let scene = random_scene(11);
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let candidate = candidate(&scene, &mut rng, 0.1).expect("this scene has free configurations");
    let runs: Vec<String> = (0..2).map(|_| format!("{:?}", certify(&scene, &candidate, 0.0))).collect();
    assert_eq!(runs[0], runs[1]);
}

#[test]
fn malformed_candidates_and_options_are_refused_by_name() {
    let scene = random_scene(1);
    let certifier = Certifier::new(&scene, |_| 0.0, &options(), 0).expect("options are valid");
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let good = candidate(&scene, &mut rng, 0.05).expect("this scene has free configurations");
    let refused = |candidate: &Candidate| {
        let outcome = certifier.certify_region(candidate, &Purpose::default(), &|| false);
        outcome.expect_err("it is malformed").to_string()
    };
    let outside = Candidate { center: scene.upper() * 2.0, ..good.clone() };
    assert!(refused(&outside).contains("not strictly inside"));
    let mut not_finite = good.clone();
    not_finite.polyhedron.b[0] = f64::NAN;
    assert!(refused(&not_finite).contains("not finite"));
    let foreign = Candidate { center: DVector::zeros(scene.dim() + 1), ..good };
    assert!(refused(&foreign).contains("coordinates"));
    let nothing = CertifyOptions { shrink_resolution: 0.0, ..options() };
    let error = Certifier::new(&scene, |_| 0.0, &nothing, 0).expect_err("no share");
    assert!(error.to_string().contains("shrink-resolution"));
    let negative = CertifyOptions { thin: -1.0, ..options() };
    let error = Certifier::new(&scene, |_| 0.0, &negative, 0).expect_err("a negative length");
    assert!(error.to_string().contains("thin"));
}
