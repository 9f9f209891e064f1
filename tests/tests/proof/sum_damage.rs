//! Kinds of damage to sum-of-squares certificates.

use crate::damage::{Damage, certificates, damage};
use ipc_types::artefact::{CertificatesFile, CoreEnclosure, PairProof, SosProof};

fn proofs(file: &mut CertificatesFile) -> impl Iterator<Item = &mut SosProof> {
    file.regions.iter_mut().flat_map(|region| &mut region.pairs).filter_map(|pair| match &mut pair.proof {
        PairProof::SumOfSquares(proof) => Some(&mut **proof),
        PairProof::Swept(_) => None,
    })
}

/// All kinds.
pub fn all() -> Vec<Damage> {
    vec![
        damage(
            "a Gram matrix is indefinite",
            certificates(|f| {
                let mut terms = proofs(f).flat_map(|p| &mut p.points_a).flatten();
                terms.next().expect("a term").gram[0] = -1e-3;
            }),
            "not proven positive semidefinite",
        ),
        damage(
            "a Gram matrix is larger",
            certificates(|f| {
                let mut terms = proofs(f).flat_map(|p| &mut p.points_b).flatten();
                terms.next().expect("a term").gram[0] += 1e-1;
            }),
            "what the sums of squares leave",
        ),
        damage(
            "a plane is moved by a tenth of a metre",
            certificates(|f| proofs(f).for_each(|p| p.plane_b[0] += 0.1)),
            "what the sums of squares leave",
        ),
        damage(
            "a plane is turned round",
            certificates(|f| proofs(f).flat_map(|p| &mut p.plane_a).flatten().for_each(|a| *a = -*a)),
            "what the sums of squares leave",
        ),
        damage(
            "a point of a body is left out",
            certificates(|f| proofs(f).for_each(|p| drop(p.points_a.pop()))),
            "are not those of its enclosure",
        ),
        damage(
            "a body is enclosed as if it were another shape",
            certificates(|f| {
                proofs(f).for_each(|p| {
                    p.enclosures[0] = CoreEnclosure::CylinderInPrism { n_facets: 3, phase: 0.0 }
                })
            }),
            "are not those of its enclosure",
        ),
        damage(
            "a scale of TC-space is smaller",
            certificates(|f| proofs(f).flat_map(|p| &mut p.joints).for_each(|j| j.scale *= 0.99)),
            "not proven to stay between",
        ),
        damage(
            "a bound on the region is tighter",
            certificates(|f| proofs(f).flat_map(|p| &mut p.joints).for_each(|j| j.upper -= 1e-4)),
            "not proven to stay between",
        ),
        damage(
            "a bound loses its multipliers",
            certificates(|f| proofs(f).flat_map(|p| &mut p.joints).for_each(|j| j.upper_multipliers.clear())),
            "not proven to stay between",
        ),
        damage(
            "a row of TC-space is tighter",
            certificates(|f| proofs(f).flat_map(|p| &mut p.rows).for_each(|row| row.d -= 1e-3)),
            "of the sum-of-squares proof is not proven to hold",
        ),
        damage(
            "a factor names a row that is not there",
            certificates(|f| {
                let mut terms = proofs(f).flat_map(|p| &mut p.points_a).flatten();
                terms.next().expect("a term").factors.push(999);
            }),
            "malformed",
        ),
        damage(
            "a Gram matrix is not a number",
            certificates(|f| {
                let mut terms = proofs(f).flat_map(|p| &mut p.points_a).flatten();
                terms.next().expect("a term").gram[0] = f64::NAN;
            }),
            "malformed",
        ),
        damage(
            "more clearance is claimed than proven",
            certificates(|f| f.regions[0].pairs[0].clearance = 1.0),
            "what the sums of squares leave",
        ),
    ]
}
