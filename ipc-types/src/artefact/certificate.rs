//! `certificates.bin`: why certified regions are free of collision, to be re-checked without a solver.
//!
//! Each pair's proof is of one of two kinds; one region may mix them. Sums of squares: [`crate::artefact::SosProof`].
//! Swept hulls: for one pair of bodies (A, B) on the region P, cells (boxes in the coordinates of
//! the joints between the two) form a binary tree whose root is the box of joint limits; each leaf either misses P,
//! or has a normal n, fixed in the frame of a link on the chain between A and B, and a row g with
//!
//! ```text
//! n·(x_A(q) − x_B(q)) − g·δ ≥ κ      for all q in the cell, all points x_A of A, x_B of B, δ = q − centre of cell
//! g·δ ≥ L                            for all q in cell ∩ P, by the stored multipliers
//! κ + L > clearance
//! ```
//!
//! A verifier recomputes κ and L from these data alone; nothing here has to be believed.

use crate::artefact::SosProof;
use serde::{Deserialize, Serialize};

/// The certificates of all certified regions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CertificatesFile {
    /// Sorted by region id.
    pub regions: Vec<RegionCertificate>,
}

/// Certificate of one region against all pairs of bodies.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RegionCertificate {
    /// Id of the certified region in `certify/regions.bin`.
    pub region_id: u64,
    /// The rows `a·q ≤ b` that the proofs' multipliers index. Each is satisfied by all of the region.
    pub rows: Vec<SweptRow>,
    /// One entry for every pair of bodies that may collide, sorted by (body_a, body_b).
    pub pairs: Vec<PairCertificate>,
}

/// A row `a·q ≤ b` that holds on the region, and why it holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SweptRow {
    /// Coefficients [n].
    pub a: Vec<f64>,
    /// Offset.
    pub b: f64,
    /// Why the row holds on the region.
    pub origin: RowOrigin,
}

/// Why a row holds on the region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum RowOrigin {
    /// It is this row of the region, bit for bit.
    Face(u32),
    /// It follows from rows of the region: for all q in the joint box,
    /// `a·q − b ≤ Σ μ_r (A_r q − b_r)` with these (row of the region, μ_r ≥ 0).
    Implied(Vec<(u32, f64)>),
}

/// Certificate of one pair of bodies on one region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PairCertificate {
    /// Index of body A in the scene's bodies.
    pub body_a: u32,
    /// Index of body B, greater than `body_a`.
    pub body_b: u32,
    /// Distance that is proven, metres; 0 is disjointness.
    pub clearance: f64,
    /// Why.
    pub proof: PairProof,
}

/// Why two bodies are apart on a region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum PairProof {
    /// By swept hulls on a tree of cells.
    Swept(SweptProof),
    /// By sums of squares.
    SumOfSquares(Box<SosProof>),
}

/// A proof by swept hulls.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SweptProof {
    /// The frames that leaves name by position.
    pub frames: Vec<FrameChoice>,
    /// The tree of cells in preorder: a split is followed by its lower, then its upper subtree. The root cell is the
    /// box of joint limits.
    pub cells: Vec<Cell>,
}

/// A frame in which normals are constant, and what drops out seen from it.
///
/// The chain between the bodies runs from the link of A through the links between to the link of B. Seen from the
/// frame's link, the joints on A's side and those on B's side move the two bodies. A revolute joint about an axis of
/// symmetry of the body (a cylinder or capsule about its z axis, a sphere about any axis through its centre) maps the
/// body to itself; it drops out if all joints between it and the body drop out too.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameChoice {
    /// Index of the link, on the chain between the two bodies, in whose frame the normals are fixed.
    pub link: u32,
    /// How many of the moving joints on A's side, counted from A, drop out. Their coordinates have g = 0.
    pub n_dropped_a: u32,
    /// How many of the moving joints on B's side, counted from B, drop out. Their coordinates have g = 0.
    pub n_dropped_b: u32,
}

/// A node of the tree of cells.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Cell {
    /// The cell is cut at `q[coordinate] = at`, strictly inside it.
    Split {
        /// Index of the coordinate.
        coordinate: u16,
        /// Where.
        at: f64,
    },
    /// The cell misses the region: Σ μ_r (a_r·q − b_r) > 0 on all of the cell (other coordinates within their joint
    /// limits), with (index into `RegionCertificate::rows`, μ_r ≥ 0).
    Empty {
        /// Multipliers.
        multipliers: Vec<(u32, f64)>,
    },
    /// The bodies are apart on all of the cell ∩ region.
    Separated {
        /// Position in `SweptProof::frames`.
        frame: u16,
        /// Normal in the frame's link; points from B to A; of unit length within rounding (a verifier divides by a
        /// bound on its length where the clearance is positive).
        normal: [f64; 3],
        /// The row g, one coefficient for each coordinate with a non-zero entry: (coordinate, g). Empty means g = 0.
        g: Vec<(u16, f64)>,
        /// Multipliers (index into `RegionCertificate::rows`, μ_r ≥ 0) that bound g·δ from below on cell ∩ region:
        /// L = min over the cell, other coordinates within their joint limits, of g·δ + Σ μ_r (a_r·q − b_r).
        multipliers: Vec<(u32, f64)>,
    },
    /// The bodies are apart on all of the cell ∩ region, by the series to the fourth order of each corner of the body
    /// that moves, seen from the link of the other one.
    ///
    /// With r the normal, signed so that f(q) = r·x(q) + const is the gap of corner x along it, and σ_i = δ_i / h_i in
    /// [-1, 1], powers of the series are folded into lower orders: v, g, Ĥ are the value at the centre, the gradient and
    /// h_i h_j ∂_i ∂_j f with what is folded into them, C the products of three and of four different σ, and T a bound
    /// of what that leaves and of the fifth order. Where τ_i² > ½, squares σ_i² beside other joints are folded as
    /// they are at the corners of the cell, and Ĥ has 2 Σ |c| over their coefficients more on its diagonal, D_i; else D_i
    /// is 0. `stages/check/src/corners.rs` has the rules and why they hold.
    ///
    /// ```text
    /// f(q) ≥ v + g·δ + σᵀ (Ĥ + N) τ − ½ τᵀ (Ĥ + N) τ − ½ σᵀ (N + D) σ + C(σ) + (0 at corners) − T
    /// ```
    ///
    /// for any τ and any N with Ĥ + N positive semidefinite: what it belongs to is convex and above its tangent at τ.
    /// With multipliers μ as in `Separated` Σ μ_r (a_r·q − b_r) is added, which is at most 0 on the region. What remains
    /// is concave in each σ_i, so its least value over the cell is at a corner of it. A verifier recomputes all of this
    /// and demands more than the clearance for each corner of the body.
    Corners {
        /// Position in `SweptProof::frames`; it is the link of the body that rests.
        frame: u16,
        /// As in `Separated`.
        normal: [f64; 3],
        /// Corners that need multipliers or a tangent; of entries that name the same one the last counts.
        near: Vec<NearCorners>,
        /// Multipliers as in `Separated`, those of the first of `near` first.
        multipliers: Vec<(u32, f64)>,
    },
}

/// Corners that come near the plane of a cell and stay beyond it with the same tangent and multipliers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NearCorners {
    /// How many of the cell's multipliers are these corners'.
    pub n_multipliers: u16,
    /// τ by the joints from the frame outwards; not used where no concave part is given.
    pub tangent: Vec<f32>,
    /// The corners.
    pub bounds: Vec<CornersBound>,
}

/// Corners of which the second order is bounded in the same way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CornersBound {
    /// The corners, bit k for number k. Numbers of a box: bit 0 set for +x, bit 1 for +y, bit 2 for +z. Of a capsule: 0 for
    /// +z, 1 for −z.
    pub corners: u8,
    /// Vectors w by the joints, one after the other: N = Σ w wᵀ + ε 1, ε = [`CONCAVE_ABSOLUTE`] + [`CONCAVE_SHARE`] Σ |w|².
    /// None: ½ σᵀ Ĥ σ + C(σ) is bounded by the sizes of its coefficients, no square is kept and τ is not used.
    pub concave: Option<Vec<f32>>,
}

impl CornersBound {
    /// Numbers of the corners, ascending.
    pub fn numbers(&self) -> impl Iterator<Item = usize> + use<> {
        let corners = self.corners;
        (0..8).filter(move |number| corners >> number & 1 == 1)
    }
}

/// Of N in [`CornersBound`], metres: leaves room for rounding.
pub const CONCAVE_ABSOLUTE: f64 = 1e-9;
/// Of N in [`CornersBound`]: leaves room for the rounding of the vectors.
pub const CONCAVE_SHARE: f64 = 1e-6;
