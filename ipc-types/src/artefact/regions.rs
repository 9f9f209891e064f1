//! `regions.bin` / `regions.json`: convex regions of C-space.

use serde::{Deserialize, Serialize};

/// A region: the polytope {q : A q ≤ b}. Rows of `A` are unit and include the joint limits, so every region is
/// bounded and inside them; `center` is strictly inside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Region {
    /// Identifier, unique in a file.
    pub id: u64,
    /// For a certified region the candidate that it came from.
    pub parent: Option<u64>,
    /// Face normals, m rows of n coefficients.
    #[serde(rename = "A")]
    pub A: Vec<Vec<f64>>,
    /// Face offsets [m].
    pub b: Vec<f64>,
    /// A point strictly inside.
    pub center: Vec<f64>,
    /// How it was made (`iris-zo`, …).
    pub method: String,
    /// Whether a certificate covers the whole polytope.
    pub certified: bool,
    /// Distance that the certificate proves, metres; 0 is disjointness. Of a candidate: the configuration margin.
    pub margin: f64,
}

/// A share in [0, 1] estimated from samples, with its 95 % confidence interval. In JSON `[estimate, low, high]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate(pub f64, pub f64, pub f64);

/// Share of the free part of a set that some region covers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Coverage {
    /// Of CS_free.
    pub total: Estimate,
    /// Of CG_free; `None` (null) without a task.
    pub grasp: Option<Estimate>,
    /// Of CP_free; `None` (null) without a task.
    pub placement: Option<Estimate>,
}

/// The regions of a run, candidates or certified.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RegionsFile {
    /// Names of the coordinates, in the order of the columns of `A`.
    pub coordinates: Vec<String>,
    /// Sorted by id.
    pub regions: Vec<Region>,
    /// Measured coverage of these regions, if it was measured.
    pub coverage: Option<Coverage>,
}
