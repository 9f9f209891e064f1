//! Pairs of bodies that may collide.

use crate::{Motion, Role, Scene, Task};

/// Two bodies that must not overlap, by their positions in `Scene::bodies`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CollisionPair {
    /// The body with the lower index.
    pub body_a: usize,
    /// The body with the higher index.
    pub body_b: usize,
}

impl Scene {
    /// The pairs that count, sorted; `pair_idx` everywhere is a position in this list.
    ///
    /// Link by link: bodies of two links count unless one joint joins the links, or both are rigidly fixed to
    /// each other (as all links fixed in the world are), or the scene excludes them.
    pub fn collision_pairs(&self) -> Vec<CollisionPair> {
        let anchors = self.anchors();
        let mut pairs = Vec::new();
        for body_a in 0..self.bodies.len() {
            for body_b in body_a + 1..self.bodies.len() {
                let (link_a, link_b) = (self.bodies[body_a].link_idx, self.bodies[body_b].link_idx);
                let links = (link_a.min(link_b), link_a.max(link_b));
                let counts = anchors[link_a] != anchors[link_b]
                    && self.adjacent_links.binary_search(&links).is_err()
                    && self.excluded_links.binary_search(&links).is_err();
                if counts {
                    pairs.push(CollisionPair { body_a, body_b });
                }
            }
        }
        pairs
    }

    /// The distance in metres that the bodies of `pair` keep in `task`: its clearance, but 0 (no penetration)
    /// between a link of a robot and a link of an object.
    pub fn required_clearance(&self, task: &Task, pair: CollisionPair) -> f64 {
        if self.is_contact_pair(pair) { 0.0 } else { task.clearance }
    }

    /// Whether `pair` is a link of a robot with a link of an object, which may touch.
    pub fn is_contact_pair(&self, pair: CollisionPair) -> bool {
        let role = |body_idx: usize| self.links[self.bodies[body_idx].link_idx].role;
        matches!(
            (role(pair.body_a), role(pair.body_b)),
            (Role::Robot, Role::Object) | (Role::Object, Role::Robot)
        )
    }

    /// For each link the topmost link that it is rigidly fixed to.
    fn anchors(&self) -> Vec<usize> {
        let mut anchors: Vec<usize> = Vec::with_capacity(self.links.len());
        for (link_idx, link) in self.links.iter().enumerate() {
            // A parent precedes its children, so its anchor is known.
            anchors.push(match (&link.motion, link.parent) {
                (Motion::Fixed, Some(parent)) => anchors[parent],
                _ => link_idx,
            });
        }
        anchors
    }
}
