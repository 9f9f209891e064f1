//! What the search concludes, in a form that can be checked without it: `miqp/proof.bin`
//! ([`ipc_types::artefact::ProofFile`] has the mathematics).

mod chain;
mod relations;
mod sets;
mod tree;
mod writer;

pub use chain::{ChainValue, KnownSupports, Multipliers, evaluate};
pub use relations::Relations;
pub use sets::{BoxedSet, Sparse, Support};
pub use tree::{Branching, ProofTree};
pub use writer::ProofWriter;
