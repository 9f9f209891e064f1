//! The joints that matter for a pair of bodies, seen from every link between them.

use crate::{Chain, ChainJoint, deviation_from_symmetry};
use scene::{CollisionPair, Scene};

/// A pair of bodies and the joints between them, without the rotations that move neither.
///
/// A rotation about a body's axis of symmetry drops out if every joint between it and the body drops out too: it maps
/// the body to itself up to a distance, which is in `inflation`.
#[derive(Debug, Clone, PartialEq)]
pub struct PairChain {
    /// The bodies.
    pub pair: CollisionPair,
    /// The joints that are kept, from body A to body B.
    pub joints: Vec<ChainJoint>,
    /// `joints.len() + 1` frames; in frame i the first i joints move body A, the others body B.
    pub frames: Vec<PairFrame>,
    /// Number of joints dropped next to body A.
    pub n_dropped_a: usize,
    /// Number of joints dropped next to body B.
    pub n_dropped_b: usize,
    /// What the dropped rotations add to the sum of both bodies' radii, metres, rounded up.
    pub inflation: f64,
}

/// Both bodies seen from a link between them.
#[derive(Debug, Clone, PartialEq)]
pub struct PairFrame {
    /// The link.
    pub link_idx: usize,
    /// From the link to the shape of body A; its joints are the pair's first ones in reverse order.
    pub to_a: Chain,
    /// From the link to the shape of body B; its joints are the pair's last ones in order.
    pub to_b: Chain,
}

impl PairChain {
    /// The joints between the bodies of `pair`.
    pub fn new(scene: &Scene, pair: CollisionPair) -> Self {
        let mut chain = Chain::between_bodies(scene, pair.body_a, pair.body_b);
        let mut inflation = 0.0;
        let n_dropped_b = drop_rotations(scene, &mut chain, pair.body_b, &mut inflation);
        let mut chain = chain.reversed();
        let n_dropped_a = drop_rotations(scene, &mut chain, pair.body_a, &mut inflation);
        let chain = chain.reversed();
        let side = |link_idx, body_idx, n_dropped| {
            let mut side = Chain::to_body(scene, link_idx, body_idx);
            (0..n_dropped).for_each(|_| side.drop_last());
            side
        };
        // The frames of the whole chain between the dropped ends: those of the shortened chain would merge links
        // that dropped rotations move against each other.
        let all = Chain::between_bodies(scene, pair.body_a, pair.body_b).frame_links;
        let frames = all[n_dropped_a..all.len() - n_dropped_b]
            .iter()
            .map(|&link_idx| PairFrame {
                link_idx,
                to_a: side(link_idx, pair.body_a, n_dropped_a),
                to_b: side(link_idx, pair.body_b, n_dropped_b),
            })
            .collect();
        Self { pair, joints: chain.joints, frames, n_dropped_a, n_dropped_b, inflation }
    }

    /// The coordinates that the pair depends on, sorted.
    pub fn coordinates(&self) -> Vec<usize> {
        let mut coordinates: Vec<usize> = self.joints.iter().map(|joint| joint.coordinate_idx).collect();
        coordinates.sort_unstable();
        coordinates.dedup();
        coordinates
    }
}

/// Drops the last joints of `chain`, which ends at the shape of `body_idx`, while they map the body to itself.
fn drop_rotations(scene: &Scene, chain: &mut Chain, body_idx: usize, inflation: &mut f64) -> usize {
    let shape = &scene.bodies[body_idx].shape;
    let mut n_dropped = 0;
    while let (Some(joint), Some(X_FS)) = (chain.joints.last(), chain.transforms.last()) {
        if joint.kind != scene::CoordinateKind::Revolute {
            break;
        }
        let Some(deviation) = deviation_from_symmetry(shape, X_FS, &joint.axis) else { break };
        *inflation += deviation.inflation(shape);
        chain.drop_last();
        n_dropped += 1;
    }
    n_dropped
}
