//! The sets of a task over a decomposition of CS_free.

use crate::connected_region::{ConnectedRegions, connected_regions};
use crate::error::ManipulationError;
use crate::leaf::{Leaf, PathMode};
use crate::overlap::{Overlaps, overlap_of_all};
use crate::proof::{Emptiness, Outer, proven_empty};
use crate::space::polytope_of_space;
use convex_sets::HPolyhedron;
use nalgebra::{DMatrix, DVector};
use scene::{LinearForm, Scene, Task};

/// Grasp and placement spaces over regions P_0 … P_{J-1}; polytope `j` of every list belongs to region `j`.
#[derive(Debug, Clone)]
pub struct Manipulation {
    /// The joint box.
    pub joint_box: Outer,
    /// `CG`, with the joint box.
    pub grasp_space: HPolyhedron,
    /// `CP`, with the joint box.
    pub placement_space: HPolyhedron,
    /// The regions P_j.
    pub regions: Vec<HPolyhedron>,
    /// CG ∩ P_j; `None` if proven empty (Eq. 5.2).
    pub grasp_free: Vec<Option<HPolyhedron>>,
    /// CP ∩ P_j; `None` if proven empty (Eq. 5.2).
    pub placement_free: Vec<Option<HPolyhedron>>,
    /// CG ∩ CP ∩ P_j; `None` if proven empty (Eq. 5.3).
    pub grasp_placement: Vec<Option<HPolyhedron>>,
    /// Overlaps of `grasp_free`.
    pub grasp_overlaps: Overlaps,
    /// Overlaps of `placement_free`.
    pub placement_overlaps: Overlaps,
    /// Connected regions of CG_free by overlaps that are not proven empty: for proofs.
    pub grasp_regions: ConnectedRegions,
    /// Connected regions of CP_free by overlaps that are not proven empty: for proofs.
    pub placement_regions: ConnectedRegions,
    /// Forms constant during a transfer, one a row (Eq. 5.5a, 5.5b).
    pub F_transfer: DMatrix<f64>,
    /// Forms constant during a transit, one a row (Eq. 5.5c).
    pub F_transit: DMatrix<f64>,
}

impl Manipulation {
    /// The sets of `task` over `regions`. Regions are bounded polytopes; the joint box is added to what needs it.
    pub fn new(scene: &Scene, task: &Task, regions: &[HPolyhedron]) -> Result<Self, ManipulationError> {
        Self::from_parts(Outer { lower: scene.lower(), upper: scene.upper() }, task, regions)
    }

    /// As [`Manipulation::new`], without a scene.
    pub fn from_parts(
        joint_box: Outer,
        task: &Task,
        regions: &[HPolyhedron],
    ) -> Result<Self, ManipulationError> {
        let n = joint_box.lower.len();
        for (region_idx, P) in regions.iter().enumerate() {
            if P.ambient_dimension() != n {
                let found = P.ambient_dimension();
                return Err(ManipulationError::RegionDimension { region_idx, found, expected: n });
            }
            if P.A.nrows() != P.b.len() || P.A.iter().chain(P.b.iter()).any(|x| !x.is_finite()) {
                let (n_rows, n_offsets) = (P.A.nrows(), P.b.len());
                return Err(ManipulationError::RegionMalformed { region_idx, n_rows, n_offsets });
            }
        }
        let grasp_space = polytope_of_space(&task.grasp);
        let placement_space = polytope_of_space(&task.placement);
        let within = |space: &HPolyhedron| -> Vec<Option<HPolyhedron>> {
            regions.iter().map(|P| not_empty(merged(P, space), &joint_box)).collect()
        };
        let grasp_free = within(&grasp_space);
        let placement_free = within(&placement_space);
        let grasp_placement = grasp_free
            .iter()
            .map(|P| P.as_ref().and_then(|P| not_empty(merged(P, &placement_space), &joint_box)))
            .collect();
        let grasp_overlaps = overlap_of_all(&grasp_free, &joint_box);
        let placement_overlaps = overlap_of_all(&placement_free, &joint_box);
        let classes = |polytopes: &[Option<HPolyhedron>], overlaps: &Overlaps| {
            let present: Vec<bool> = polytopes.iter().map(Option::is_some).collect();
            connected_regions(&present, overlaps.open_pairs())
        };
        Ok(Self {
            grasp_regions: classes(&grasp_free, &grasp_overlaps),
            placement_regions: classes(&placement_free, &placement_overlaps),
            F_transfer: matrix_of_forms(&task.transfer_keep, n),
            F_transit: matrix_of_forms(&task.transit_keep, n),
            regions: regions.to_vec(),
            joint_box,
            grasp_space,
            placement_space,
            grasp_free,
            placement_free,
            grasp_placement,
            grasp_overlaps,
            placement_overlaps,
        })
    }

    /// Dimension of C-space.
    pub fn dim(&self) -> usize {
        self.joint_box.lower.len()
    }

    /// Forms that are constant in `mode`, one a row.
    pub fn kept_forms(&self, mode: PathMode) -> &DMatrix<f64> {
        match mode {
            PathMode::Transit => &self.F_transit,
            PathMode::Transfer => &self.F_transfer,
        }
    }

    /// The polytopes that a path of `mode` lives in: CP ∩ P_j or CG ∩ P_j.
    pub fn free(&self, mode: PathMode) -> &[Option<HPolyhedron>] {
        match mode {
            PathMode::Transit => &self.placement_free,
            PathMode::Transfer => &self.grasp_free,
        }
    }

    /// Overlaps of [`Manipulation::free`].
    pub fn overlaps(&self, mode: PathMode) -> &Overlaps {
        match mode {
            PathMode::Transit => &self.placement_overlaps,
            PathMode::Transfer => &self.grasp_overlaps,
        }
    }

    /// Connected regions of [`Manipulation::free`] for proofs.
    pub fn connected_regions(&self, mode: PathMode) -> &ConnectedRegions {
        match mode {
            PathMode::Transit => &self.placement_regions,
            PathMode::Transfer => &self.grasp_regions,
        }
    }

    /// Connected regions of [`Manipulation::free`] by common interior: within one, a path surely exists.
    pub fn interior_regions(&self, mode: PathMode) -> ConnectedRegions {
        let present: Vec<bool> = self.free(mode).iter().map(Option::is_some).collect();
        connected_regions(&present, self.overlaps(mode).interior_pairs())
    }

    /// The leaf of `mode` through `q`.
    pub fn leaf(&self, mode: PathMode, q: &DVector<f64>) -> Leaf {
        Leaf::through(self.kept_forms(mode), q)
    }
}

/// `P` unless it is proven empty.
fn not_empty(P: HPolyhedron, outer: &Outer) -> Option<HPolyhedron> {
    (proven_empty(&P, outer) != Emptiness::Empty).then_some(P)
}

/// P ∩ `space` without rows that repeat one of P with a larger offset (regions carry the joint limits already).
fn merged(P: &HPolyhedron, space: &HPolyhedron) -> HPolyhedron {
    let mut both = P.intersection(space);
    let mut keep: Vec<usize> = Vec::new();
    for row_idx in 0..both.n_faces() {
        let twin = keep.iter().copied().find(|&kept| both.A.row(kept) == both.A.row(row_idx));
        match twin {
            Some(twin) => both.b[twin] = both.b[twin].min(both.b[row_idx]),
            None => keep.push(row_idx),
        }
    }
    HPolyhedron { A: both.A.select_rows(&keep), b: both.b.select_rows(&keep) }
}

fn matrix_of_forms(forms: &[LinearForm], n: usize) -> DMatrix<f64> {
    let mut F = DMatrix::zeros(forms.len(), n);
    for (row_idx, form) in forms.iter().enumerate() {
        F.row_mut(row_idx).copy_from(&form.transpose());
    }
    F
}
