//! Grasp and placement spaces, their free parts as unions of polytopes, connected regions, leaves.
//!
//! Symbols: P_j the regions of CS_free; CG, CP the grasp and placement space; CG_free = ∪ CG ∩ P_j,
//! CP_free = ∪ CP ∩ P_j, CC = ∪ CG ∩ CP ∩ P_j (thesis 2, Eq. 5.2, 5.3); F_transit, F_transfer the kept forms of
//! the two modes (Eq. 5.5a to 5.5c); a *leaf* is {q : F q = λ}.
//!
//! Two relations say that polytopes overlap, and which one is safe depends on the claim:
//! * [`Overlap::Interior`]: a ball lies in both, so a path may use the overlap;
//! * [`Overlap::is_open`]: the closed intersection is *not proven empty*. A proof that something is impossible
//!   drops an overlap only where a Farkas vector shows that it is empty.

mod connected_region;
mod error;
mod leaf;
mod manipulation;
mod overlap;
mod proof;
mod rounding;
mod space;

pub use connected_region::{ConnectedRegions, connected_regions};
pub use error::ManipulationError;
pub use leaf::{Leaf, PathMode, reached_in_leaf};
pub use manipulation::Manipulation;
pub use overlap::{Overlap, Overlaps, overlap_of, overlap_of_all};
pub use proof::{
    Emptiness, Outer, bound_above, contains_exactly, proven_box, proven_contained, proven_empty,
    proven_maximum, solve,
};
pub use rounding::Enclosure;
pub use space::polytope_of_space;
