//! One segment of the plan: the shortest path inside its leaf, or why there is none.

use crate::leaf_frame::LeafFrame;
use crate::leaf_graph::{Contact, LeafGraph};
use crate::options::Options;
use crate::path::Path;
use crate::search::{Found, search, straight_bound};
use crate::straight::straight_path;
use manipulation::{Manipulation, PathMode};
use nalgebra::DVector;
use rand_chacha::ChaCha8Rng;

/// What is known of a segment.
#[derive(Debug, Clone, PartialEq)]
pub enum SegmentOutcome {
    /// A path.
    Found(Found),
    /// Proven: no path inside the leaf. Positions of regions: all that can be reached from the start inside the leaf
    /// (none of them holds the goal), and the pairs (reached, not reached) that overlap anywhere.
    NoPath {
        /// Positions of the regions, sorted.
        reached: Vec<usize>,
        /// Pairs of positions, sorted.
        exits: Vec<(usize, usize)>,
    },
    /// Neither a path that could be verified nor a proof that there is none.
    Undecided {
        /// Why.
        reason: String,
    },
    /// No region holds the start.
    StartOutside,
    /// No region holds the goal.
    GoalOutside,
}

/// The shortest path of `mode` from `s` to `g`, whose kept forms agree.
pub fn solve_segment(
    manipulation: &Manipulation,
    mode: PathMode,
    s: &DVector<f64>,
    g: &DVector<f64>,
    options: &Options,
    rng: &mut ChaCha8Rng,
    cancelled: &dyn Fn() -> bool,
) -> SegmentOutcome {
    let free = manipulation.free(mode);
    let frame = LeafFrame::new(manipulation.kept_forms(mode), s);
    if let Some(path) = straight_path(free, &frame, g) {
        // A bend that is rounded makes the line longer by far less than any tolerance, but longer.
        let lower_bound = straight_bound(s, g).min(path.length());
        return SegmentOutcome::Found(Found { path, lower_bound, n_relaxations: 0 });
    }
    let graph = LeafGraph::new(manipulation, mode, frame, g);
    let touches = |contact: fn(&crate::leaf_graph::LeafVertex) -> Contact| {
        graph.vertices.iter().any(|vertex| contact(vertex) != Contact::Outside)
    };
    if !touches(|vertex| vertex.start) {
        return SegmentOutcome::StartOutside;
    }
    if !touches(|vertex| vertex.goal) {
        return SegmentOutcome::GoalOutside;
    }
    let reached = graph.reached();
    if reached.iter().all(|&v| graph.vertices[v].goal == Contact::Outside) {
        let reached: Vec<usize> = reached.iter().map(|&v| graph.vertices[v].region_idx).collect();
        let exits = manipulation.overlaps(mode).exits(&reached);
        return SegmentOutcome::NoPath { reached, exits };
    }
    match search(&graph, g, free, options, rng, cancelled) {
        Some(found) => SegmentOutcome::Found(found),
        None => SegmentOutcome::Undecided { reason: why_undecided(&graph) },
    }
}

fn why_undecided(graph: &LeafGraph) -> String {
    let inside = |contact: Contact| contact == Contact::Inside;
    if !graph.vertices.iter().any(|vertex| inside(vertex.start)) {
        "the start lies within rounding of the faces of the regions that hold it".into()
    } else if !graph.vertices.iter().any(|vertex| inside(vertex.goal)) {
        "the goal lies within rounding of the faces of the regions that hold it".into()
    } else {
        "the regions on the way overlap inside the leaf in less than a path needs to be verified".into()
    }
}

/// The Bézier pieces of a path, as rows of coordinates.
pub fn pieces(path: &Path, manipulation: &Manipulation, mode: PathMode, order: usize) -> Vec<Vec<Vec<f64>>> {
    let frame = LeafFrame::new(manipulation.kept_forms(mode), &path.points[0]);
    let curves = path.bezier_pieces(order, manipulation.free(mode), &frame);
    curves.into_iter().map(|piece| piece.into_iter().map(|q| q.iter().copied().collect()).collect()).collect()
}
