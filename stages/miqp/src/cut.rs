//! Leaf cuts (mathematics, section 5) as disjunctions.
//!
//! S is a set of regions, a segment of the cut's mode runs from x_i in region a to x_{i+1} in region b, with kept forms
//! λ. If exactly one of a, b is in S, the segment passes an overlap between S and the other regions, so λ lies in the
//! projection of one of these. This holds for *any* S, so the exits are taken from the decomposition itself (all
//! overlaps out of S that are not proven empty), and what a cut file says of them cannot make a proof wrong.

use crate::error::MiqpError;
use crate::proof::{BoxedSet, Relations};
use convex_sets::HPolyhedron;
use ipc_types::artefact::{LeafCut, Mode};
use manipulation::{Emptiness, Leaf, Manipulation, PathMode, proven_empty};
use nalgebra::DVector;
use std::collections::BTreeMap;

/// Half-width of the slab about a leaf in which an exit is looked for. Erring side: takes an exit that is missed by
/// less; the plan is then checked with its exit.
const TOL_LEAF: f64 = 1e-9;

/// A way out of S.
#[derive(Debug, Clone)]
pub struct Exit {
    /// Region inside S.
    pub inside: usize,
    /// Region outside S.
    pub outside: usize,
    /// P_inside ∩ P_outside ∩ (CP or CG).
    pub polytope: HPolyhedron,
}

/// A leaf cut.
#[derive(Debug, Clone)]
pub struct Cut {
    /// Mode of the segments it speaks of.
    pub mode: PathMode,
    /// For each region, whether it is in S.
    pub is_reached: Vec<bool>,
    /// All ways out of S.
    pub exits: Vec<Exit>,
}

impl Cut {
    /// The cuts of a file, over the regions with the ids `region_ids`; each S and mode once.
    pub fn all(
        manipulation: &Manipulation,
        relations: &mut Relations,
        region_ids: &[u64],
        cuts: &[LeafCut],
    ) -> Result<Vec<Self>, MiqpError> {
        let idx_of: BTreeMap<u64, usize> =
            region_ids.iter().enumerate().map(|(idx, &id)| (id, idx)).collect();
        let mut distinct: BTreeMap<(PathMode, Vec<usize>), Self> = BTreeMap::new();
        for (cut_idx, cut) in cuts.iter().enumerate() {
            let mut inside = Vec::with_capacity(cut.reached.len());
            for &region_id in &cut.reached {
                inside.push(*idx_of.get(&region_id).ok_or(MiqpError::UnknownRegion { cut_idx, region_id })?);
            }
            inside.sort_unstable();
            inside.dedup();
            let mode = match cut.mode {
                Mode::Transit => PathMode::Transit,
                Mode::Transfer => PathMode::Transfer,
            };
            distinct
                .entry((mode, inside.clone()))
                .or_insert_with(|| Self::new(manipulation, relations, mode, &inside));
        }
        Ok(distinct.into_values().collect())
    }

    /// The cut of S = `inside` (sorted).
    pub fn new(
        manipulation: &Manipulation,
        relations: &mut Relations,
        mode: PathMode,
        inside: &[usize],
    ) -> Self {
        let n_regions = manipulation.regions.len();
        let is_reached: Vec<bool> = (0..n_regions).map(|idx| inside.binary_search(&idx).is_ok()).collect();
        let open = manipulation.overlaps(mode);
        let mut exits = Vec::new();
        for &a in inside {
            for b in (0..n_regions).filter(|&b| !is_reached[b]) {
                let present = !relations.is_free_of(mode, a) && !relations.is_free_of(mode, b);
                // What is not proven empty in the proof's own terms is a way out.
                if present && (open.get(a, b).is_open() || !relations.prove_apart(manipulation, mode, a, b)) {
                    let polytope = BoxedSet::of_mode(manipulation, mode, &[a.min(b), a.max(b)]).polyhedron();
                    let polytope = polytope.remove_redundant().unwrap_or(polytope);
                    exits.push(Exit { inside: a, outside: b, polytope });
                }
            }
        }
        Self { mode, is_reached, exits }
    }

    /// Whether a segment between these regions passes an exit.
    pub fn parts(&self, a: usize, b: usize) -> bool {
        self.is_reached[a] != self.is_reached[b]
    }

    /// Position of the first exit that meets the leaf through `x`, up to a tolerance.
    pub fn exit_at(&self, manipulation: &Manipulation, x: &DVector<f64>) -> Option<usize> {
        let slab = Leaf::through(manipulation.kept_forms(self.mode), x).slab(TOL_LEAF);
        self.exits.iter().position(|exit| {
            let meets = proven_empty(&exit.polytope.intersection(&slab), &manipulation.joint_box);
            matches!(meets, Emptiness::Point(_))
        })
    }
}
