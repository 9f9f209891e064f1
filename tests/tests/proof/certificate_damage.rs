//! Kinds of damage to the certificates of a run.

use crate::damage::{Damage, certificates, damage};
use ipc_types::artefact::{Cell, CertificatesFile, PairCertificate, PairProof, RowOrigin, SweptProof};

/// The first pair, over all regions, whose tree has a leaf that `wanted` picks, and the leaf.
fn leaf(file: &mut CertificatesFile, wanted: fn(&Cell) -> bool) -> &mut Cell {
    file.regions
        .iter_mut()
        .flat_map(|region| &mut region.pairs)
        .flat_map(|pair| &mut swept(pair).cells)
        .find(|cell| wanted(cell))
        .expect("a cell of that kind")
}

fn is_plane(cell: &Cell) -> bool {
    matches!(cell, Cell::Separated { .. })
}

fn has_row(cell: &Cell) -> bool {
    matches!(cell, Cell::Separated { g, multipliers, .. } if !g.is_empty() && !multipliers.is_empty())
}

fn is_empty(cell: &Cell) -> bool {
    matches!(cell, Cell::Empty { .. })
}

fn swept(pair: &mut PairCertificate) -> &mut SweptProof {
    match &mut pair.proof {
        PairProof::Swept(proof) => proof,
        PairProof::SumOfSquares(_) => panic!("the run was certified by swept hulls"),
    }
}

/// The first pair, over all regions, with a split.
fn split_pair(file: &mut CertificatesFile) -> &mut SweptProof {
    file.regions
        .iter_mut()
        .flat_map(|region| &mut region.pairs)
        .map(swept)
        .find(|proof| matches!(proof.cells.first(), Some(Cell::Split { .. })))
        .expect("a pair with a split")
}

/// All kinds.
pub fn all() -> Vec<Damage> {
    vec![
        damage(
            "a region's certificate is dropped",
            certificates(|f| {
                f.regions.pop();
            }),
            "has no certificate",
        ),
        damage(
            "a certificate stands twice",
            certificates(|f| {
                let c = f.regions[0].clone();
                f.regions.push(c);
            }),
            "two certificates",
        ),
        damage(
            "two certificates exchange their regions",
            certificates(|f| {
                let (a, b) = (f.regions[0].region_id, f.regions[1].region_id);
                f.regions[0].region_id = b;
                f.regions[1].region_id = a;
            }),
            "region",
        ),
        damage(
            "a pair is dropped",
            certificates(|f| {
                f.regions[0].pairs.pop();
            }),
            "is missing",
        ),
        damage("two pairs are swapped", certificates(|f| f.regions[0].pairs.swap(0, 1)), "out of order"),
        damage(
            "a pair is added",
            certificates(|f| {
                let p = f.regions[0].pairs[0].clone();
                f.regions[0].pairs.push(p);
            }),
            "not a pair of the scene",
        ),
        damage(
            "a pair names other bodies",
            certificates(|f| {
                let cells = swept(&mut f.regions[0].pairs[1]).cells.clone();
                *swept(&mut f.regions[0].pairs[0]) = SweptProof { frames: Vec::new(), cells };
            }),
            "frame",
        ),
        damage(
            "less clearance is proven than asked",
            certificates(|f| f.regions[0].pairs[0].clearance = -1e-3),
            "clearance",
        ),
        damage(
            "more clearance is claimed than proven",
            certificates(|f| f.regions[0].pairs[0].clearance = 1.0),
            "proven gap",
        ),
        damage(
            "the last cell is dropped",
            certificates(|f| {
                split_pair(f).cells.pop();
            }),
            "still open",
        ),
        damage(
            "a cell is added",
            certificates(|f| {
                let p = split_pair(f);
                let c = p.cells[p.cells.len() - 1].clone();
                p.cells.push(c);
            }),
            "follow",
        ),
        damage("all cells are dropped", certificates(|f| split_pair(f).cells.clear()), "still open"),
        damage(
            "a split lies outside its cell",
            certificates(|f| {
                if let Cell::Split { at, .. } = &mut split_pair(f).cells[0] {
                    *at = 100.0;
                }
            }),
            "not inside it",
        ),
        damage(
            "a split is not a number",
            certificates(|f| {
                if let Cell::Split { at, .. } = &mut split_pair(f).cells[0] {
                    *at = f64::NAN;
                }
            }),
            "not inside it",
        ),
        damage(
            "a split is along no coordinate",
            certificates(|f| {
                if let Cell::Split { coordinate, .. } = &mut split_pair(f).cells[0] {
                    *coordinate = 99;
                }
            }),
            "not inside it",
        ),
        damage(
            "a plane is turned round",
            certificates(|f| {
                if let Cell::Separated { normal, .. } = leaf(f, is_plane) {
                    normal.iter_mut().for_each(|n| *n = -*n);
                }
            }),
            "proven gap",
        ),
        damage(
            "a plane is not a number",
            certificates(|f| {
                if let Cell::Separated { normal, .. } = leaf(f, is_plane) {
                    normal[0] = f64::NAN;
                }
            }),
            "proven gap",
        ),
        damage(
            "a plane is nothing",
            certificates(|f| {
                if let Cell::Separated { normal, .. } = leaf(f, is_plane) {
                    *normal = [0.0; 3];
                }
            }),
            "proven gap",
        ),
        damage(
            "a plane is in a frame that is not there",
            certificates(|f| {
                if let Cell::Separated { frame, .. } = leaf(f, is_plane) {
                    *frame = 77;
                }
            }),
            "frame 77",
        ),
        damage(
            "joints are dropped that move the body",
            certificates(|f| {
                f.regions.iter_mut().flat_map(|r| &mut r.pairs).flat_map(|p| &mut swept(p).frames).for_each(
                    |frame| {
                        frame.n_dropped_a += 1;
                        frame.n_dropped_b += 1;
                    },
                );
            }),
            "frame",
        ),
        damage(
            "a row has a coefficient on a coordinate that does not move the pair",
            certificates(|f| {
                if let Cell::Separated { g, .. } = leaf(f, is_plane) {
                    g.push((88, 1.0));
                }
            }),
            "coordinate 88",
        ),
        damage(
            "multipliers are scaled",
            certificates(|f| {
                if let Cell::Separated { multipliers, .. } = leaf(f, has_row) {
                    multipliers.iter_mut().for_each(|m| m.1 *= 3.0);
                }
            }),
            "proven gap",
        ),
        damage(
            "a multiplier is negative",
            certificates(|f| {
                if let Cell::Separated { multipliers, .. } = leaf(f, has_row) {
                    multipliers[0].1 = -1.0;
                }
            }),
            "multiplier",
        ),
        damage(
            "a multiplier is on a row that is not there",
            certificates(|f| {
                if let Cell::Separated { multipliers, .. } = leaf(f, has_row) {
                    multipliers[0].0 = 60_000;
                }
            }),
            "multiplier",
        ),
        damage(
            "an empty cell loses its multipliers",
            certificates(|f| {
                if let Cell::Empty { multipliers } = leaf(f, is_empty) {
                    multipliers.clear();
                }
            }),
            "said to miss",
        ),
        damage(
            "a separated cell is called empty",
            certificates(|f| {
                *leaf(f, is_plane) = Cell::Empty { multipliers: Vec::new() };
            }),
            "said to miss",
        ),
        damage(
            "a row is tightened",
            certificates(|f| {
                f.regions.iter_mut().flat_map(|r| &mut r.rows).for_each(|row| row.b -= 1e-3);
            }),
            "row 0",
        ),
        damage(
            "a row is called implied without a reason",
            certificates(|f| {
                f.regions
                    .iter_mut()
                    .flat_map(|r| &mut r.rows)
                    .for_each(|row| row.origin = RowOrigin::Implied(Vec::new()));
            }),
            "implied",
        ),
    ]
}
