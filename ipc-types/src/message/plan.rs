//! Plans, leaf cuts and segments as messages.

use super::NO_ID;
use crate::artefact::{LeafCut, Mode, PlanFile, PlanStatus, Segment};
use crate::{Digest, PROTOCOL_VERSION};
use iceoryx2::prelude::ZeroCopySend;

/// Header of a grasp plan. Payload: its configurations [(2ℓ + 2) · n]; empty if there are none.
#[derive(Debug, Clone, Copy, Default, PartialEq, ZeroCopySend)]
#[type_name("PlanHeader")]
#[repr(C)]
pub struct PlanHeader {
    /// [`PROTOCOL_VERSION`].
    pub protocol_version: u32,
    /// 1 optimal, 2 feasible, 3 infeasible.
    pub status: u32,
    /// ℓ, or [`NO_ID`].
    pub n_grasps: u64,
    /// n.
    pub dim: u64,
    /// Bit i of these 512 is 1 if segment i is a transfer.
    pub modes: [u64; 8],
    /// Cost; NaN without a plan.
    pub cost: f64,
    /// Proven lower bound on the cost; NaN without one.
    pub lower_bound: f64,
    /// Number of the job that found it.
    pub job: u64,
    /// Digest of the scene.
    pub scene_digest: Digest,
}

impl PlanHeader {
    /// Header and payload of a plan.
    pub fn encode(plan: &PlanFile, job: u64, scene_digest: &Digest) -> (PlanHeader, Vec<f64>) {
        let mut modes = [0; 8];
        for (i, mode) in plan.modes.iter().flatten().enumerate().take(512) {
            if *mode == Mode::Transfer {
                modes[i / 64] |= 1 << (i % 64);
            }
        }
        let configurations = plan.configurations.as_deref().unwrap_or_default();
        let header = PlanHeader {
            protocol_version: PROTOCOL_VERSION,
            status: match plan.status {
                PlanStatus::Optimal => 1,
                PlanStatus::Feasible => 2,
                PlanStatus::Infeasible => 3,
            },
            n_grasps: plan.n_grasps.map_or(NO_ID, |n| n as u64),
            dim: configurations.first().map_or(0, Vec::len) as u64,
            modes,
            cost: plan.cost.unwrap_or(f64::NAN),
            lower_bound: plan.lower_bound.unwrap_or(f64::NAN),
            job,
            scene_digest: *scene_digest,
        };
        (header, configurations.concat())
    }
}

/// Header of a leaf cut. Payload, `u64`: the reached ids, then the exits in pairs.
#[derive(Debug, Clone, Copy, Default, PartialEq, ZeroCopySend)]
#[type_name("CutHeader")]
#[repr(C)]
pub struct CutHeader {
    /// [`PROTOCOL_VERSION`].
    pub protocol_version: u32,
    /// 0 transit, 1 transfer.
    pub mode: u32,
    /// Ids reached.
    pub n_reached: u64,
    /// Exits.
    pub n_exits: u64,
    /// Digest of the scene.
    pub scene_digest: Digest,
}

impl CutHeader {
    /// Header and payload of a cut.
    pub fn encode(cut: &LeafCut, scene_digest: &Digest) -> (CutHeader, Vec<u64>) {
        let header = CutHeader {
            protocol_version: PROTOCOL_VERSION,
            mode: u32::from(cut.mode == Mode::Transfer),
            n_reached: cut.reached.len() as u64,
            n_exits: cut.exits.len() as u64,
            scene_digest: *scene_digest,
        };
        let mut payload = cut.reached.clone();
        payload.extend(cut.exits.iter().flat_map(|exit| [exit.0, exit.1]));
        (header, payload)
    }
}

/// Header of a segment. Payload: its control points [pieces · points · n], then the ids of the pieces' regions;
/// empty if its pieces are of different order.
#[derive(Debug, Clone, Copy, Default, PartialEq, ZeroCopySend)]
#[type_name("SegmentHeader")]
#[repr(C)]
pub struct SegmentHeader {
    /// [`PROTOCOL_VERSION`].
    pub protocol_version: u32,
    /// 0 transit, 1 transfer.
    pub mode: u32,
    /// Position in the plan.
    pub segment_idx: u64,
    /// Pieces.
    pub n_pieces: u64,
    /// Control points of each piece.
    pub n_points: u64,
    /// n.
    pub dim: u64,
    /// Length.
    pub length: f64,
    /// Proven lower bound on the length.
    pub lower_bound: f64,
    /// 1 if every region on the way is certified.
    pub certified: u64,
    /// Digest of the scene.
    pub scene_digest: Digest,
}

impl SegmentHeader {
    /// Header and payload of a segment.
    pub fn encode(segment_idx: u64, segment: &Segment, scene_digest: &Digest) -> (SegmentHeader, Vec<f64>) {
        let n_points = segment.pieces.first().map_or(0, Vec::len);
        let even = segment.pieces.iter().all(|piece| piece.len() == n_points);
        let mut payload = Vec::new();
        if even {
            payload.extend(segment.pieces.iter().flatten().flatten());
            // Ids are at most 2^53 (see `validate`), so they are exact.
            payload.extend(segment.regions.iter().map(|id| *id as f64));
        }
        let first_point = segment.pieces.first().and_then(|piece| piece.first());
        let header = SegmentHeader {
            protocol_version: PROTOCOL_VERSION,
            mode: u32::from(segment.mode == Mode::Transfer),
            segment_idx,
            n_pieces: segment.pieces.len() as u64,
            n_points: n_points as u64,
            dim: first_point.map_or(0, Vec::len) as u64,
            length: segment.length,
            lower_bound: segment.lower_bound,
            certified: u64::from(segment.certified),
            scene_digest: *scene_digest,
        };
        (header, payload)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_are_bits() {
        let plan = PlanFile {
            status: PlanStatus::Optimal,
            n_grasps: Some(1),
            configurations: Some(vec![vec![0.0], vec![1.0], vec![2.0], vec![3.0]]),
            regions: Some(vec![1; 4]),
            modes: Some(vec![Mode::Transit, Mode::Transfer, Mode::Transit]),
            cost: Some(3.0),
            lower_bound: None,
            tried: Vec::new(),
        };
        let (header, payload) = PlanHeader::encode(&plan, 4, &[0; 32]);
        assert_eq!((header.modes[0], header.n_grasps, header.dim, header.job), (0b010, 1, 1, 4));
        assert_eq!(payload, [0.0, 1.0, 2.0, 3.0]);
    }

    #[test]
    fn a_cut_is_its_ids_in_a_row() {
        let cut = LeafCut { mode: Mode::Transfer, reached: vec![4, 9], exits: vec![(4, 5), (9, 5)] };
        let (header, payload) = CutHeader::encode(&cut, &[0; 32]);
        assert_eq!((header.n_reached, header.n_exits, header.mode), (2, 2, 1));
        assert_eq!(payload, [4, 9, 4, 5, 9, 5]);
    }
}
