//! Coordinates that no pair of bodies depends on.

use crate::PairChain;
use scene::{CollisionPair, Scene};

/// For each coordinate, whether the distance of some pair depends on it, after dropping rotations about axes of
/// symmetry: false for the angle of a bottle cap about its own axis.
pub fn relevant_coordinates(scene: &Scene, pairs: &[CollisionPair]) -> Vec<bool> {
    let mut relevant = vec![false; scene.dim()];
    for &pair in pairs {
        for joint in PairChain::new(scene, pair).joints {
            relevant[joint.coordinate_idx] = true;
        }
    }
    relevant
}
