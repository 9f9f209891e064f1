//! Where a region touches or enters a C-obstacle, found by samples and by descent of the gap.
//!
//! Guides cuts and refusals; proves nothing but what it shows (a configuration without a separating plane).

use crate::cell::CellBox;
use crate::guide::Guide;
use crate::pair_model::{PairModel, Tangent};
use crate::row_program::RowProgram;
use crate::rows::Rows;

/// Steps of descent.
const MAX_DESCENTS: usize = 12;
/// Halvings on the way from the centre to a colliding sample.
const N_BISECTIONS: usize = 20;
/// Cuts are placed this share of the centre's gap, and at most [`MAX_ROOM`] metres, off contact.
const ROOM_SHARE: f64 = 0.01;
/// See [`ROOM_SHARE`].
const MAX_ROOM: f64 = 1e-4;
/// Colliding samples that are followed to contact.
const MAX_CONTACTS: usize = 400;

/// A configuration of the region with a small gap, by repeated steps to the vertex where the linearised gap is least
/// (Frank & Wolfe 1956), and the gap there, metres.
pub fn least_gap(
    model: &PairModel,
    rows: &Rows,
    limits: &CellBox,
    from: &[f64],
    program: &mut RowProgram,
) -> (f64, Vec<f64>) {
    let mut q = from.to_vec();
    let mut tangent = model.tangent(0, &q);
    for _ in 0..MAX_DESCENTS {
        program.minimize(rows, limits, &tangent.g, f64::INFINITY);
        let vertex = program.point(limits);
        let next = model.tangent(0, &vertex);
        if !(next.gap < tangent.gap) {
            break;
        }
        (q, tangent) = (vertex, next);
    }
    (tangent.gap, q)
}

/// Half-spaces (a, b) that cut the colliding samples of `guide` away, tangent to the C-obstacle where the way from the
/// centre meets it, nearest first.
pub fn contact_cuts(
    model: &PairModel,
    center: &[f64],
    guide: &Guide,
    limits: &CellBox,
) -> Vec<(Vec<f64>, f64)> {
    let room = (ROOM_SHARE * (model.gap(center) - model.clearance)).clamp(0.0, MAX_ROOM);
    let mut contacts: Vec<(f64, Vec<f64>, &[f64])> = guide
        .samples()
        .filter(|q| model.gap(q) <= model.clearance)
        .take(MAX_CONTACTS)
        .map(|q| {
            let contact = contact(model, center, q);
            let distance: f64 =
                (0..q.len()).map(|j| ((contact[j] - center[j]) / limits.half(j)).powi(2)).sum();
            (distance, contact, q)
        })
        .collect();
    contacts.sort_by(|x, y| x.0.total_cmp(&y.0));
    let mut cuts: Vec<(Vec<f64>, f64)> = Vec::new();
    for (_, contact, sample) in contacts {
        let is_cut = |(a, b): &(Vec<f64>, f64)| dot(a, sample) > *b;
        if cuts.iter().any(is_cut) {
            continue;
        }
        let Tangent { g, .. } = model.tangent(0, &contact);
        let norm = dot(&g, &g).sqrt();
        if norm > 0.0 {
            let a: Vec<f64> = g.iter().map(|g| 0.0 - g / norm).collect();
            let b = dot(&a, &contact) - room / norm;
            cuts.push((a, b));
        }
    }
    cuts
}

/// The last configuration on the way from the free `center` to the colliding `q` that is free, by bisection.
fn contact(model: &PairModel, center: &[f64], q: &[f64]) -> Vec<f64> {
    let at = |t: f64| -> Vec<f64> { center.iter().zip(q).map(|(c, q)| c + t * (q - c)).collect() };
    let (mut free, mut colliding) = (0.0, 1.0);
    for _ in 0..N_BISECTIONS {
        let t = 0.5 * (free + colliding);
        if model.gap(&at(t)) > model.clearance { free = t } else { colliding = t }
    }
    at(free)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
