//! Which pairs of bodies may collide, derived from the scene alone.
//!
//! Link by link: two links count unless one joint joins them, or both are rigidly fixed to each other, or the scene
//! file excludes them.

use scene::{Motion, Scene};

/// All pairs (a, b), a < b, of indices into the scene's bodies that must be proven apart; sorted.
pub fn required_pairs(scene: &Scene) -> Vec<(usize, usize)> {
    let mut rigid_root = Vec::with_capacity(scene.links.len());
    for (link_idx, link) in scene.links.iter().enumerate() {
        let root = match (&link.motion, link.parent) {
            (Motion::Fixed, Some(parent)) if parent < link_idx => rigid_root[parent],
            _ => link_idx,
        };
        rigid_root.push(root);
    }
    let listed = |list: &[(usize, usize)], a: usize, b: usize| list.contains(&(a.min(b), a.max(b)));
    let mut pairs = Vec::new();
    for (a, body_a) in scene.bodies.iter().enumerate() {
        for (b, body_b) in scene.bodies.iter().enumerate().skip(a + 1) {
            let (link_a, link_b) = (body_a.link_idx, body_b.link_idx);
            let counts = link_a != link_b
                && rigid_root[link_a] != rigid_root[link_b]
                && !listed(&scene.adjacent_links, link_a, link_b)
                && !listed(&scene.excluded_links, link_a, link_b);
            if counts {
                pairs.push((a, b));
            }
        }
    }
    pairs
}
