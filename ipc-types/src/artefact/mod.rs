//! What stages write to disk and read from it. The field names are those of the `.json` twins.

mod certificate;
mod cuts;
mod path_certificate;
mod plan;
mod regions;
mod trajectory;
mod trajectory_csv;

pub use certificate::{
    Cell, CertificatesFile, FrameChoice, PairCertificate, RegionCertificate, RowOrigin, SweptRow,
};
pub use cuts::{CutsFile, LeafCut};
pub use path_certificate::{CertifiedPiece, PathCertificateFile, PathPair, SeparatedInterval};
pub use plan::{Mode, PlanFile, PlanStatus, Tried, TriedStatus};
pub use regions::{Coverage, Estimate, Region, RegionsFile};
pub use trajectory::{Segment, TrajectoryFile};
pub use trajectory_csv::{SAMPLES, TrajectoryRow};
