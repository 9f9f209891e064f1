//! What a scene's pairs look like to the search: frames for normals, and bounds of acceleration seen from them.

use super::TOL_GAP;
use super::motion_bound::MotionBound;
use collision::CollisionChecker;
use ipc_types::artefact::{FrameChoice, PathPair};
use kinematics::{Chain, PairChain};
use nalgebra::Matrix3;
use scene::{CollisionPair, Scene};

/// Certifies paths in one scene for given clearances; free of locks, so one serves all threads.
#[derive(Debug, Clone)]
pub struct PathCertifier {
    pub(super) dim: usize,
    pub(super) checker: CollisionChecker,
    pub(super) pairs: Vec<PairModel>,
    /// Bounds of acceleration seen from the world, shared by the pairs of a body.
    pub(super) world_bounds: Vec<MotionBound>,
    /// Most halvings of a piece. Larger: fewer undecided pieces that graze an obstacle, more time on them.
    pub max_depth: u32,
    /// Most intervals of a piece that are looked at. Larger: as above.
    pub max_intervals: usize,
}

/// A pair of bodies.
#[derive(Debug, Clone)]
pub(super) struct PairModel {
    pub pair: CollisionPair,
    pub clearance: f64,
    /// What a gap must exceed, metres: clearance, [`TOL_GAP`] and what dropped rotations add, the latter twice: the gap
    /// is evaluated with these rotations and proven without them.
    pub needed: f64,
    /// Sum of the radii of the balls around the bodies, metres.
    pub radii: f64,
    /// The world as a frame, for the first, quick test.
    pub world: Option<WorldFrame>,
    /// All frames.
    pub frames: Vec<FrameModel>,
}

/// The world as the frame of a pair.
#[derive(Debug, Clone, Copy)]
pub(super) struct WorldFrame {
    /// Position in `PairModel::frames`.
    pub frame_idx: u16,
    /// Positions in `PathCertifier::world_bounds`.
    pub bound_a: u32,
    pub bound_b: u32,
}

/// A frame in which normals are fixed.
#[derive(Debug, Clone)]
pub(super) struct FrameModel {
    pub choice: FrameChoice,
    /// The rigid group of the frame's link, and the link's rotation in it.
    pub group: usize,
    pub R_GL: Matrix3<f64>,
    pub bound_a: MotionBound,
    pub bound_b: MotionBound,
}

impl PathCertifier {
    /// For all pairs of `scene`, each with the clearance in metres (not negative) that `clearance` gives it.
    pub fn new(scene: &Scene, clearance: impl Fn(CollisionPair) -> f64) -> Self {
        let checker = CollisionChecker::with_clearances(scene, &clearance);
        let mut world_bounds = WorldBounds::default();
        let pairs = scene
            .collision_pairs()
            .into_iter()
            .enumerate()
            .map(|(pair_idx, pair)| {
                let chain = PairChain::new(scene, pair);
                let mut frames: Vec<FrameModel> = chain
                    .frames
                    .iter()
                    .map(|frame| {
                        let sides = [&frame.to_a, &frame.to_b];
                        frame_model(scene, &checker, pair, frame.link_idx, sides, &chain)
                    })
                    .collect();
                let world = world_frame(scene, &checker, pair, &chain, &mut frames, &mut world_bounds);
                let clearance = clearance(pair);
                let needed = clearance + TOL_GAP + 2.0 * chain.inflation;
                PairModel { pair, clearance, needed, radii: checker.radii(pair_idx), world, frames }
            })
            .collect();
        let world_bounds = world_bounds.bounds;
        Self { dim: scene.dim(), checker, pairs, world_bounds, max_depth: 30, max_intervals: 10_000 }
    }

    /// The pairs as a certificate lists them.
    pub fn certificate_pairs(&self) -> Vec<PathPair> {
        let of_pair = |model: &PairModel| PathPair {
            body_a: model.pair.body_a as u32,
            body_b: model.pair.body_b as u32,
            clearance: model.clearance,
            frames: model.frames.iter().map(|frame| frame.choice.clone()).collect(),
        };
        self.pairs.iter().map(of_pair).collect()
    }

    /// Number of pairs.
    pub fn n_pairs(&self) -> usize {
        self.pairs.len()
    }
}

/// Bounds seen from the world, each body with its number of dropped rotations once.
#[derive(Default)]
struct WorldBounds {
    keys: Vec<(usize, u32)>,
    bounds: Vec<MotionBound>,
}

impl WorldBounds {
    fn position(&mut self, body_idx: usize, n_dropped: u32, bound: &MotionBound) -> u32 {
        let key = (body_idx, n_dropped);
        let known = self.keys.iter().position(|known| *known == key);
        known.unwrap_or_else(|| {
            self.keys.push(key);
            self.bounds.push(bound.clone());
            self.keys.len() - 1
        }) as u32
    }
}

fn frame_model(
    scene: &Scene,
    checker: &CollisionChecker,
    pair: CollisionPair,
    link_idx: usize,
    sides: [&Chain; 2],
    chain: &PairChain,
) -> FrameModel {
    let (group, X_GL) = checker.link_in_group(link_idx);
    let bound = |side: &Chain, body_idx: usize| {
        MotionBound::new(side, &scene.bodies[body_idx].shape, &scene.coordinates)
    };
    FrameModel {
        choice: FrameChoice {
            link: link_idx as u32,
            n_dropped_a: chain.n_dropped_a as u32,
            n_dropped_b: chain.n_dropped_b as u32,
        },
        group,
        R_GL: X_GL.rotation.to_rotation_matrix().into_inner(),
        bound_a: bound(sides[0], pair.body_a),
        bound_b: bound(sides[1], pair.body_b),
    }
}

/// The world as a frame of the pair. Where it does not lie between the bodies it is added to `frames`, without dropped
/// rotations: those next to a body on the way to the other one are not those on the way to the world. That is of no
/// use if the checker holds a coordinate still that moves the bodies in the world.
fn world_frame(
    scene: &Scene,
    checker: &CollisionChecker,
    pair: CollisionPair,
    chain: &PairChain,
    frames: &mut Vec<FrameModel>,
    world_bounds: &mut WorldBounds,
) -> Option<WorldFrame> {
    let between = frames.iter().position(|frame| frame.choice.link == 0);
    let frame_idx = between.or_else(|| {
        let sides = [pair.body_a, pair.body_b].map(|body_idx| Chain::to_body(scene, 0, body_idx));
        let nothing_dropped = PairChain { n_dropped_a: 0, n_dropped_b: 0, ..chain.clone() };
        let model = frame_model(scene, checker, pair, 0, [&sides[0], &sides[1]], &nothing_dropped);
        let still: Vec<bool> = checker.relevant_coordinates().iter().map(|relevant| !relevant).collect();
        if model.bound_a.involves(&still) || model.bound_b.involves(&still) {
            return None;
        }
        frames.push(model);
        Some(frames.len() - 1)
    })?;
    let frame = &frames[frame_idx];
    Some(WorldFrame {
        frame_idx: u16::try_from(frame_idx).ok()?,
        bound_a: world_bounds.position(pair.body_a, frame.choice.n_dropped_a, &frame.bound_a),
        bound_b: world_bounds.position(pair.body_b, frame.choice.n_dropped_b, &frame.bound_b),
    })
}
