//! A region as mathematics: a polyhedron with a name and a history.

use convex_sets::HPolyhedron;
use ipc_types::artefact;
use ipc_types::validate::{self, Violation};
use nalgebra::{DMatrix, DVector};

/// A region of C-space. Rows of the polyhedron are unit and include the joint limits, so it is bounded and inside
/// them; the centre is strictly inside.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// Identifier, unique among the regions of a stage.
    pub id: u64,
    /// For a certified region the candidate that it came from.
    pub parent: Option<u64>,
    /// {q : A q ≤ b}.
    pub polyhedron: HPolyhedron,
    /// A point strictly inside [n].
    pub center: DVector<f64>,
    /// How it was made.
    pub method: String,
    /// Whether a certificate covers the whole polytope.
    pub certified: bool,
    /// Distance that the certificate proves, metres; 0 is disjointness. Of a candidate: the configuration margin.
    pub margin: f64,
}

/// A region that is not one.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("region {id}: {violation}; run the stage that wrote it again")]
pub struct RegionError {
    /// Id of the region.
    pub id: u64,
    /// Field, value, what is expected.
    pub violation: Violation,
}

impl Region {
    /// The region of an artefact over `dim` coordinates; every number, row and length is checked.
    pub fn from_artefact(region: &artefact::Region, dim: usize) -> Result<Region, RegionError> {
        validate::region(region, dim).map_err(|violation| RegionError { id: region.id, violation })?;
        let rows = region.A.iter().flatten().copied();
        Ok(Region {
            id: region.id,
            parent: region.parent,
            polyhedron: HPolyhedron {
                A: DMatrix::from_row_iterator(region.A.len(), dim, rows),
                b: DVector::from_column_slice(&region.b),
            },
            center: DVector::from_column_slice(&region.center),
            method: region.method.clone(),
            certified: region.certified,
            margin: region.margin,
        })
    }

    /// The artefact: the same numbers, bit for bit.
    pub fn to_artefact(&self) -> artefact::Region {
        artefact::Region {
            id: self.id,
            parent: self.parent,
            A: self.polyhedron.A.row_iter().map(|row| row.iter().copied().collect()).collect(),
            b: self.polyhedron.b.iter().copied().collect(),
            center: self.center.iter().copied().collect(),
            method: self.method.clone(),
            certified: self.certified,
            margin: self.margin,
        }
    }

    /// Dimension n of C-space.
    pub fn dim(&self) -> usize {
        self.polyhedron.ambient_dimension()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle() -> Region {
        let side = 0.5_f64.sqrt();
        Region {
            id: 9,
            parent: Some(4),
            polyhedron: HPolyhedron {
                A: DMatrix::from_row_slice(3, 2, &[-1.0, 0.0, 0.0, -1.0, side, side]),
                b: DVector::from_column_slice(&[0.0, 0.0, side]),
            },
            center: DVector::from_column_slice(&[0.25, 0.25]),
            method: "by hand".into(),
            certified: true,
            margin: 0.001,
        }
    }

    #[test]
    fn an_artefact_and_back_is_the_same_bit_for_bit() {
        let region = triangle();
        let artefact = region.to_artefact();
        assert_eq!(artefact.A[2], vec![0.5_f64.sqrt(); 2]);
        assert_eq!(Region::from_artefact(&artefact, 2).unwrap(), region);
    }

    #[test]
    fn a_ragged_or_foreign_matrix_is_refused() {
        let mut artefact = triangle().to_artefact();
        assert!(Region::from_artefact(&artefact, 3).is_err());
        artefact.A[1].push(0.0);
        let error = Region::from_artefact(&artefact, 2).unwrap_err();
        assert!(error.to_string().contains("region 9") && error.to_string().contains("A[1]"), "{error}");
    }

    #[test]
    fn a_number_that_is_none_is_refused() {
        let mut artefact = triangle().to_artefact();
        artefact.b[1] = f64::NAN;
        assert!(Region::from_artefact(&artefact, 2).unwrap_err().to_string().contains("b[1]"));
    }
}
