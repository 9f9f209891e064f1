//! Configurations against the scene.

use crate::motion_tree::MotionTree;
use crate::placement::Placement;
use crate::separation::{self, Placed, Separation, TOL_CONTACT};
use kinematics::{Chain, PairChain, Reach, Support};
use scene::{CollisionPair, CoordinateKind, RigidTransform, Scene, Shape, Task};
use std::cell::RefCell;

/// Collision checker of one scene; free of locks, so one serves all threads.
///
/// A configuration is `&[f64]` with `Scene::dim` entries; joint limits are not its business.
#[derive(Debug, Clone)]
pub struct CollisionChecker {
    pub(crate) dim: usize,
    pub(crate) tree: MotionTree,
    bodies: Vec<CheckedBody>,
    pub(crate) pairs: Vec<CheckedPair>,
    relevant: Vec<bool>,
}

#[derive(Debug, Clone)]
struct CheckedBody {
    shape: Shape,
    group: usize,
    X_GS: Placement,
    radius: f64,
    /// Part of some pair; the others are never placed.
    needed: bool,
}

impl CheckedBody {
    #[inline]
    fn placement(&self, groups: &[Placement]) -> Placement {
        if self.group == 0 {
            self.X_GS
        } else if let Shape::Sphere { .. } = self.shape {
            // Nobody asks how a sphere is turned.
            let X_WG = &groups[self.group];
            Placement { R: X_WG.R, p: X_WG.transform(&self.X_GS.p) }
        } else {
            groups[self.group].compose(&self.X_GS)
        }
    }
}

/// A pair with what edges need of it.
#[derive(Debug, Clone)]
pub(crate) struct CheckedPair {
    pub pair: CollisionPair,
    pub clearance: f64,
    /// Sum of the bounding radii plus the clearance.
    far: f64,
    /// Between the bodies, each frame's group with the reach of both bodies from it.
    pub frames: Vec<(usize, Reach, Reach)>,
    /// Coordinates that the pair depends on, sorted.
    pub coordinates: Vec<usize>,
    /// What dropped rotations add to the radii.
    pub inflation: f64,
    /// Coordinate of the first revolute joint between the bodies; `None` if they only translate.
    pub revolute: Option<usize>,
}

/// Where everything is at one configuration, with coordinates that no pair depends on held at 0.
#[derive(Debug, Default, Clone)]
pub struct Placements {
    /// Groups of links that are rigid against each other; see [`CollisionChecker::link_in_group`].
    pub groups: Vec<Placement>,
    /// Bodies; only the position of a sphere is right, its rotation is its group's.
    pub bodies: Vec<Placement>,
}

thread_local! {
    static SCRATCH: RefCell<Placements> = RefCell::default();
}

impl CollisionChecker {
    /// Checks that no pair of `scene` touches (clearance 0).
    pub fn new(scene: &Scene) -> Self {
        Self::with_clearances(scene, |_| 0.0)
    }

    /// Checks that the pairs of `scene` keep the clearances of `task`.
    pub fn for_task(scene: &Scene, task: &Task) -> Self {
        Self::with_clearances(scene, |pair| scene.required_clearance(task, pair))
    }

    /// Checks that each pair keeps the distance in metres that `clearance` gives it.
    pub fn with_clearances(scene: &Scene, clearance: impl Fn(CollisionPair) -> f64) -> Self {
        let collision_pairs = scene.collision_pairs();
        let chains: Vec<PairChain> =
            collision_pairs.iter().map(|&pair| PairChain::new(scene, pair)).collect();
        let mut relevant = vec![false; scene.dim()];
        for joint in chains.iter().flat_map(|chain| &chain.joints) {
            relevant[joint.coordinate_idx] = true;
        }
        let tree = MotionTree::new(scene, &collision_pairs, &relevant);
        let mut bodies: Vec<CheckedBody> = scene
            .bodies
            .iter()
            .map(|body| CheckedBody {
                shape: body.shape.clone(),
                group: tree.group_of_link[body.link_idx],
                X_GS: Placement::from(&(tree.X_GL[body.link_idx] * body.X_LS)),
                radius: body.shape.bounding_radius(),
                needed: false,
            })
            .collect();
        let reach = |chain: &Chain, body_idx: usize| {
            Reach::new(chain, &scene.bodies[body_idx].shape, &scene.coordinates)
        };
        let pairs = chains
            .into_iter()
            .map(|chain| {
                let pair = chain.pair;
                bodies[pair.body_a].needed = true;
                bodies[pair.body_b].needed = true;
                let clearance = clearance(pair);
                CheckedPair {
                    pair,
                    clearance,
                    far: bodies[pair.body_a].radius + bodies[pair.body_b].radius + clearance + TOL_CONTACT,
                    frames: chain
                        .frames
                        .iter()
                        .map(|frame| {
                            let group = tree.group_of_link[frame.link_idx];
                            (group, reach(&frame.to_a, pair.body_a), reach(&frame.to_b, pair.body_b))
                        })
                        .collect(),
                    coordinates: chain.coordinates(),
                    inflation: chain.inflation,
                    revolute: chain
                        .joints
                        .iter()
                        .find(|joint| joint.kind == CoordinateKind::Revolute)
                        .map(|joint| joint.coordinate_idx),
                }
            })
            .collect();
        Self { dim: scene.dim(), tree, bodies, pairs, relevant }
    }

    /// Number of pairs.
    pub fn n_pairs(&self) -> usize {
        self.pairs.len()
    }

    /// The pair `pair_idx`, in the order of `Scene::collision_pairs`.
    pub fn pair(&self, pair_idx: usize) -> CollisionPair {
        self.pairs[pair_idx].pair
    }

    /// Clearance of pair `pair_idx`, metres.
    pub fn clearance(&self, pair_idx: usize) -> f64 {
        self.pairs[pair_idx].clearance
    }

    /// For each coordinate, whether some pair depends on it; the answers do not depend on the others.
    pub fn relevant_coordinates(&self) -> &[bool] {
        &self.relevant
    }

    /// Coordinates that pair `pair_idx` depends on, sorted.
    pub fn pair_coordinates(&self, pair_idx: usize) -> &[usize] {
        &self.pairs[pair_idx].coordinates
    }

    /// Whether all pairs keep more than their clearance at `q`.
    pub fn is_free(&self, q: &[f64]) -> bool {
        self.colliding_pair_idx(q).is_none()
    }

    /// The first pair that does not keep its clearance at `q`.
    pub fn colliding_pair(&self, q: &[f64]) -> Option<CollisionPair> {
        self.colliding_pair_idx(q).map(|pair_idx| self.pair(pair_idx))
    }

    /// The position of the first pair that does not keep its clearance at `q`.
    pub fn colliding_pair_idx(&self, q: &[f64]) -> Option<usize> {
        self.with_placements(q, |at| (0..self.pairs.len()).find(|&pair_idx| !self.is_apart(pair_idx, at)))
    }

    /// All pairs that do not keep their clearance at `q`, in order.
    pub fn colliding_pairs(&self, q: &[f64]) -> Vec<CollisionPair> {
        self.with_placements(q, |at| {
            let colliding = (0..self.pairs.len()).filter(|&pair_idx| !self.is_apart(pair_idx, at));
            colliding.map(|pair_idx| self.pair(pair_idx)).collect()
        })
    }

    /// Whether pair `pair_idx` keeps more than its clearance at `q`.
    pub fn pair_is_free(&self, pair_idx: usize, q: &[f64]) -> bool {
        self.with_pair_placed(pair_idx, q, |at| self.is_apart(pair_idx, at))
    }

    /// Signed distance of pair `pair_idx` at `q`, metres, not reduced by the clearance: the distance if the bodies are
    /// apart, else minus a penetration depth.
    pub fn pair_distance(&self, pair_idx: usize, q: &[f64]) -> f64 {
        self.pair_separation(pair_idx, q).gap
    }

    /// As [`CollisionChecker::pair_distance`], with the direction.
    pub fn pair_separation(&self, pair_idx: usize, q: &[f64]) -> Separation {
        self.with_pair_placed(pair_idx, q, |at| {
            let (a, b) = self.placed(pair_idx, at);
            separation::distance_separation(a, b)
        })
    }

    /// Smallest signed distance over all pairs at `q`, metres, and its pair's position; `None` without pairs.
    pub fn min_distance(&self, q: &[f64]) -> Option<(f64, usize)> {
        self.with_placements(q, |at| {
            let mut least: Option<(f64, usize)> = None;
            for (pair_idx, checked) in self.pairs.iter().enumerate() {
                let (a, b) = self.placed(pair_idx, at);
                // Bounding balls further apart than the least distance so far cannot lower it.
                let radii = checked.far - checked.clearance;
                if least.is_some_and(|(gap, _)| (a.X.p - b.X.p).norm() - radii > gap) {
                    continue;
                }
                let gap = separation::distance_separation(a, b).gap;
                if least.is_none_or(|(least_gap, _)| gap < least_gap) {
                    least = Some((gap, pair_idx));
                }
            }
            least
        })
    }

    /// X_WS of body `body_idx` at `q`, with coordinates that no pair depends on held at 0; the world's origin for a
    /// body of no pair.
    pub fn body_pose(&self, body_idx: usize, q: &[f64]) -> RigidTransform {
        self.with_placements(q, |at| at.bodies[body_idx].to_isometry())
    }

    pub(crate) fn is_apart(&self, pair_idx: usize, at: &Placements) -> bool {
        let checked = &self.pairs[pair_idx];
        let (X_a, X_b) = (&at.bodies[checked.pair.body_a], &at.bodies[checked.pair.body_b]);
        if (X_a.p - X_b.p).norm_squared() > checked.far * checked.far {
            return true;
        }
        let (a, b) = self.placed(pair_idx, at);
        separation::are_apart(a, b, checked.clearance)
    }

    /// Bodies A and B of pair `pair_idx`.
    pub fn placed<'a>(&'a self, pair_idx: usize, at: &'a Placements) -> (Placed<'a>, Placed<'a>) {
        let CollisionPair { body_a, body_b } = self.pairs[pair_idx].pair;
        let placed =
            |body_idx: usize| Placed { shape: &self.bodies[body_idx].shape, X: &at.bodies[body_idx] };
        (placed(body_a), placed(body_b))
    }

    /// Sum of the bounding radii of pair `pair_idx`, metres.
    pub fn radii(&self, pair_idx: usize) -> f64 {
        let CollisionPair { body_a, body_b } = self.pairs[pair_idx].pair;
        self.bodies[body_a].radius + self.bodies[body_b].radius
    }

    /// The group of link `link_idx`, a position in [`Placements::groups`], and the link's pose in it.
    pub fn link_in_group(&self, link_idx: usize) -> (usize, &RigidTransform) {
        (self.tree.group_of_link[link_idx], &self.tree.X_GL[link_idx])
    }

    /// Places everything at `q` into `at`, which keeps its allocation between calls.
    pub fn place(&self, q: &[f64], at: &mut Placements) {
        debug_assert_eq!(q.len(), self.dim);
        self.tree.group_placements(q, &mut at.groups);
        at.bodies.clear();
        for body in &self.bodies {
            at.bodies.push(if body.needed { body.placement(&at.groups) } else { Placement::identity() });
        }
    }

    /// The groups that the bodies of pair `pair_idx` belong to.
    pub(crate) fn groups_of_pair(&self, pair_idx: usize) -> (usize, usize) {
        let CollisionPair { body_a, body_b } = self.pairs[pair_idx].pair;
        (self.bodies[body_a].group, self.bodies[body_b].group)
    }

    /// As [`CollisionChecker::with_placements`], but of the bodies only those of one pair are where they are at `q`.
    pub(crate) fn with_pair_placed<T>(
        &self,
        pair_idx: usize,
        q: &[f64],
        use_them: impl FnOnce(&Placements) -> T,
    ) -> T {
        SCRATCH.with(|scratch| {
            let mut at = std::mem::take(&mut *scratch.borrow_mut());
            self.tree.group_placements(q, &mut at.groups);
            at.bodies.resize(self.bodies.len(), Placement::identity());
            let CollisionPair { body_a, body_b } = self.pairs[pair_idx].pair;
            for body_idx in [body_a, body_b] {
                at.bodies[body_idx] = self.bodies[body_idx].placement(&at.groups);
            }
            let result = use_them(&at);
            *scratch.borrow_mut() = at;
            result
        })
    }

    fn with_placements<T>(&self, q: &[f64], use_them: impl FnOnce(&Placements) -> T) -> T {
        SCRATCH.with(|scratch| {
            // Nothing called from here comes back here, so the buffer is never borrowed twice.
            let mut at = std::mem::take(&mut *scratch.borrow_mut());
            self.place(q, &mut at);
            let result = use_them(&at);
            *scratch.borrow_mut() = at;
            result
        })
    }
}
