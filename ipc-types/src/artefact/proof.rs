//! `proof.bin`: why a plan has the fewest grasps and costs no less, or why there is none, to be re-checked without a solver.
//!
//! **What is proven.** P_0 … P_{J-1} are the regions of `certify/regions`, sorted by id; everything below names them by
//! position. CG and CP are the task's sets (within the joint limits), S the set of a mode: CP in a transit, CG in a
//! transfer; F the mode's kept forms. A *motion with ℓ grasps* is a list of points x_0 = start, x_1, …, x_{2ℓ+1} = goal
//! and continuous curves between neighbours: segment i from x_i to x_{i+1}, a transit if i is even, else a transfer, each
//! within ∪_j S ∩ P_j and with F constant along it. For a range of ℓ a [`Search`] proves `Σ ‖x_{i+1} - x_i‖² ≥ bound` for
//! every such motion; +∞ says that there is none. Nothing is assumed of curves or of how points are chosen in regions.
//!
//! **Sets and multipliers.** A set is a box l ≤ x ≤ u and rows A x ≤ b:
//!
//! | set | box | rows, in this order |
//! | --- | --- | --- |
//! | S ∩ P_j ∩ … (one region or two, the lower position first) | bounds of S | rows of S, faces of each region |
//! | W_j = CG ∩ CP ∩ P_j | the tighter of the bounds of CG and CP | rows of CG, rows of CP, faces of P_j |
//!
//! A row `lower ≤ f·x ≤ upper` of S is `f·x ≤ upper`, then `-f·x ≤ -lower`, without sides that are infinite. With
//! multipliers y ≥ 0, (row, y) in a sparse list:
//!
//! ```text
//! min { g·x : x in the set }  ≥  -y·b + Σ_k min { (g + Aᵀy)_k x_k : l_k ≤ x_k ≤ u_k }                            (1)
//! ```
//!
//! With g = 0 a positive value says that the set is empty; so does a box with l_k > u_k.
//!
//! **Connected regions.** Regions whose sets S ∩ P_a, S ∩ P_b are not proven apart ([`Apart`], or one of them
//! [`EmptySet`]) are joined; the classes that arise are named by their lowest position. The union of one class and that
//! of all others are closed and disjoint, so a curve within ∪_j S ∩ P_j stays in one class, whichever regions are said
//! to hold its points. Every x_i, 0 < i ≤ 2ℓ, lies in some W_j and may be given any region that holds it; regions of a
//! [`Contained`] are never needed. x_0 and x_{2ℓ+1} may be given any region whose faces they satisfy exactly. So there is a
//! *chain* of regions a_0 … a_{2ℓ+1} in which the two of each segment are of one class of its mode.
//!
//! **The bound of a node.** A node of the tree allows some regions to each a_i. For any vectors r_i (or none), any
//! multipliers μ_{i,c} of segment i in class c, and any λ_e of the exits e passed (below):
//!
//! ```text
//! Σ_i ‖x_{i+1} - x_i‖²  ≥  Σ_i  2 r_i·(x_{i+1} - x_i) - ‖r_i‖² + μ_{i,c(i)}·F (x_{i+1} - x_i)  +  Σ_e λ_e·F (y_e - x_{i(e)})   (2)
//! ```
//!
//! since the terms with F vanish. The right side is a sum of one linear function for each point, whose slope depends on
//! a_i only through its classes; its least value over W_{a_i} (over the exit's set for y_e) is bounded by (1), and the
//! least sum over all chains by a shortest path from a_0 to a_{2ℓ+1}. Without r_i the left side of (2) is replaced by 0,
//! and a positive bound says that the node has no motion. A node without any chain has none either.
//!
//! **The tree.** Regions that lie on no chain of a node are left out first. [`ProofNode::Waypoint`] splits by the region
//! of one point: each region left must be in a child. [`ProofNode::Cut`] splits by a set of regions R and a segment: both its
//! regions in R, neither, or one and not the other. In the last case the curve leaves R through a point y, with F y = F x_i,
//! of S ∩ P_a ∩ P_b, a in R and b not, that is not proven empty; one child for each such *exit* (a, b), sorted. This holds
//! for any R, so it does not matter where R comes from. The bound of the search is the least over the leaves.

use crate::artefact::Mode;
use serde::{Deserialize, Serialize};

/// The proof of a plan, or of the absence of one.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ProofFile {
    /// Lists of (row of the set, multiplier), without repetition; named by position.
    pub multipliers: Vec<Vec<(u32, f64)>>,
    /// Sets of single regions that are empty.
    pub empty: Vec<EmptySet>,
    /// Pairs of regions whose sets in a mode are disjoint, as far as that is needed.
    pub apart: Vec<Apart>,
    /// Regions that other ones make unnecessary for grasps and releases. The outer region of an entry is not the inner one
    /// of an earlier entry.
    pub contained: Vec<Contained>,
    /// Sets of regions that nodes split by.
    pub cuts: Vec<ProofCut>,
    /// Bounds of nodes, named by position.
    pub bounds: Vec<ChainBound>,
    /// What is proven for which ℓ, sorted by it.
    pub searches: Vec<Search>,
}

/// A set of one region.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ProofSet {
    /// CP ∩ P_j.
    Transit,
    /// CG ∩ P_j.
    Transfer,
    /// W_j = CG ∩ CP ∩ P_j.
    Waypoint,
}

/// A set that is empty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EmptySet {
    /// Which set.
    pub set: ProofSet,
    /// Position j of the region.
    pub region: u32,
    /// Multipliers that prove it.
    pub multipliers: u32,
}

/// S ∩ P_a ∩ P_b is empty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Apart {
    /// Mode whose S it is.
    pub mode: Mode,
    /// Position a.
    pub a: u32,
    /// Position b > a.
    pub b: u32,
    /// Multipliers that prove it.
    pub multipliers: u32,
}

/// W_inner lies in P_outer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Contained {
    /// Position of the region that is not needed.
    pub inner: u32,
    /// Position of the region that holds its points.
    pub outer: u32,
    /// For each face `f·x ≤ b` of P_outer multipliers over the rows of W_inner with which (1) gives -f·x ≥ -b.
    pub faces: Vec<u32>,
}

/// A set of regions R.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ProofCut {
    /// Mode of the segments that are split by it.
    pub mode: Mode,
    /// Positions of R, sorted.
    pub inside: Vec<u32>,
}

/// The tree for a range of ℓ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Search {
    /// Least ℓ that it speaks of.
    pub first: u32,
    /// Largest ℓ that it speaks of.
    pub last: u32,
    /// The tree in preorder: a node is followed by the subtrees of its children in turn.
    pub nodes: Vec<ProofNode>,
}

/// A node of a search.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ProofNode {
    /// A leaf, with the position of its bound. Without one: no chain, or a bound of 0.
    Leaf(Option<u32>),
    /// Split by the region of point `waypoint`, 1 … 2ℓ.
    Waypoint {
        /// i.
        waypoint: u32,
        /// Regions of each child.
        groups: Vec<Vec<u32>>,
    },
    /// Split by a set of regions: inside, outside, then each exit.
    Cut {
        /// i.
        segment: u32,
        /// Position in [`ProofFile::cuts`].
        cut: u32,
    },
}

/// Inequality (2) for a node.
///
/// `segments` and `waypoints` have an entry for each segment and for each of x_1 … x_{2ℓ}; or two each, for even and odd
/// segments, and for x_1, x_3, … and x_2, x_4, …, which makes it one for every ℓ.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ChainBound {
    /// r_i, one a segment; none at all to prove that there is no motion.
    pub steps: Vec<Vec<f64>>,
    /// μ_{i,c} for each segment: (class, one number a kept form). Classes that are not listed have 0.
    pub segments: Vec<Vec<(u32, Vec<f64>)>>,
    /// For each point: (region, multipliers) for (1). Regions that are not listed have none.
    pub waypoints: Vec<Vec<(u32, u32)>>,
    /// λ_e and the multipliers for the exit's set, in the order in which exits were chosen on the way from the root.
    pub exits: Vec<(Vec<f64>, u32)>,
}
