//! The stages that talk over channels.

use std::fmt;

/// A stage of the pipeline, in the order in which data flow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StageName {
    /// Regions of CS_free.
    Decompose,
    /// Certificates of regions.
    Certify,
    /// Grasp plan.
    Miqp,
    /// Transit and transfer paths.
    Gcs,
}

impl StageName {
    /// All stages in order.
    pub const ALL: [StageName; 4] =
        [StageName::Decompose, StageName::Certify, StageName::Miqp, StageName::Gcs];

    /// The name: of the executable after `regrasp-`, of the folder in a run directory, of the control channel.
    pub fn word(self) -> &'static str {
        match self {
            StageName::Decompose => "decompose",
            StageName::Certify => "certify",
            StageName::Miqp => "miqp",
            StageName::Gcs => "gcs",
        }
    }

    /// File name of the executable.
    pub fn executable(self) -> &'static str {
        match self {
            StageName::Decompose => "regrasp-decompose",
            StageName::Certify => "regrasp-certify",
            StageName::Miqp => "regrasp-miqp",
            StageName::Gcs => "regrasp-gcs",
        }
    }

    /// Number of the stage in messages.
    pub fn number(self) -> u32 {
        self as u32
    }

    /// The stage of that number.
    pub fn from_number(number: u32) -> Option<StageName> {
        StageName::ALL.into_iter().find(|stage| stage.number() == number)
    }
}

impl fmt::Display for StageName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}
