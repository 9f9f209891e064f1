//! What stages write to disk and read from it. The field names are those of the `.json` twins.

mod certificate;
mod cuts;
mod path_certificate;
mod plan;
mod proof;
mod regions;
mod sos_certificate;
mod trajectory;
mod trajectory_csv;

pub use certificate::{
    CONCAVE_ABSOLUTE, CONCAVE_SHARE, Cell, CertificatesFile, CornersBound, FrameChoice, NearCorners,
    PairCertificate, PairProof, RegionCertificate, RowOrigin, SweptProof, SweptRow,
};
pub use cuts::{CutsFile, LeafCut};
pub use path_certificate::{Attachment, CertifiedPiece, PathCertificateFile, PathPair, SeparatedInterval};
pub use plan::{Mode, PlanFile, PlanStatus, Tried, TriedStatus};
pub use proof::{Apart, ChainBound, Contained, EmptySet, ProofCut, ProofFile, ProofNode, ProofSet, Search};
pub use regions::{Coverage, Estimate, Region, RegionsFile};
pub use sos_certificate::{
    CoreEnclosure, MAX_SOS_EXPONENT, MAX_SOS_JOINTS, SosJoint, SosProof, SosRow, SosTerm,
};
pub use trajectory::{Segment, TrajectoryFile};
pub use trajectory_csv::{SAMPLES, TrajectoryRow};
