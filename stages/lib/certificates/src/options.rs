//! Options of the certifier.

use crate::error::CertifyError;
use crate::sums::region_sums::Shrinking;
use crate::sums::search_sums::SumsSettings;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Kind of certificate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Swept hulls in C-space (mathematics.md 2.1).
    #[default]
    Swept,
    /// Sums of squares in TC-space (mathematics.md 2.2): a region is shrunk, not cut.
    Sos,
}

/// Options of the certifier. Budgets count cells, never seconds: the result depends on nothing else.
#[derive(Debug, Clone, PartialEq, clap::Args, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CertifyOptions {
    /// Kind of certificate.
    #[arg(long, value_enum, default_value_t = Method::Swept)]
    pub method: Method,
    /// Regions that are certified at a time, each on two threads, or on one if this is 1; 0: as many as cores, or one
    /// where other processes share the work. The result does not depend on it.
    #[arg(long, default_value_t = 0)]
    pub workers: usize,
    /// Samples by which the loss of a cut is judged, for each of region, grasp space and placement space; (n − 3) times
    /// as many in n > 4 dimensions. With --reuse, where little is cut, at most 500. Larger: smaller losses are seen, more
    /// time.
    #[arg(long, default_value_t = 4000)]
    pub guide_samples: usize,
    /// Share of the samples that a cut may lose at first. Larger: fewer cells, less volume.
    #[arg(long, default_value_t = 3e-5)]
    pub first_cut_loss: f64,
    /// Share of the samples that a cut may lose at most; it doubles from the first share up to here. In n > 4
    /// dimensions it is divided by n − 3. 0: no cut is made, and a region that needs one is rejected.
    #[arg(long, default_value_t = 1e-3)]
    pub max_cut_loss: f64,
    /// Cells of a pair after which the share of a cut doubles. Larger: more time, more volume.
    #[arg(long, default_value_t = 2000)]
    pub cells_per_doubling: u64,
    /// Share of the samples that a cut may lose where a cell is thin (see `thin`).
    #[arg(long, default_value_t = 0.02)]
    pub max_thin_cut_loss: f64,
    /// Share of the samples that one cut of a collision may lose. For bodies between which more than four joints turn,
    /// cuts that are made before cells are tried may lose a quarter of it, the first ones less. Larger: fewer cells, less
    /// volume.
    #[arg(long, default_value_t = 0.01)]
    pub max_clean_up_loss: f64,
    /// Gap that cuts of collisions leave between bodies of which one moves by more than four joints, metres: near
    /// contact cells are small. Larger: fewer cells, less volume.
    #[arg(long, default_value_t = 2e-3)]
    pub room: f64,
    /// Displacement of the bodies over a cell, metres, below which it is thin.
    #[arg(long, default_value_t = 1e-3)]
    pub thin: f64,
    /// Displacement of the bodies over a cell, metres, below which it is given up: any cut that keeps the centre is
    /// made, and if there is none, the region is rejected.
    #[arg(long, default_value_t = 1e-5)]
    pub give_up: f64,
    /// Gap that a cut leaves between the bodies, metres. Larger: sturdier against rounding, less volume.
    #[arg(long, default_value_t = 1e-7)]
    pub cut_margin: f64,
    /// Share of a region's samples that must remain, or it is rejected.
    #[arg(long, default_value_t = 0.25)]
    pub min_kept: f64,
    /// Cells that a pair may use in one region before it is given up.
    #[arg(long, default_value_t = 400_000)]
    pub max_cells: u64,
    /// Sums of squares: the width of a region is found up to this share of it. Smaller: more volume, more time.
    #[arg(long, default_value_t = 0.005)]
    pub shrink_resolution: f64,
    /// Sums of squares: a region that would be shrunk to less than this share of its width is rejected.
    #[arg(long, default_value_t = 0.1)]
    pub min_width: f64,
    /// Sums of squares: most rows that a programme uses beside the box of the pair's joints. Larger: more volume, more
    /// time.
    #[arg(long, default_value_t = 12)]
    pub max_rows: usize,
    /// Sums of squares: frames in which a pair's plane is sought. Larger: more volume, more time where there is none.
    #[arg(long, default_value_t = 2)]
    pub max_frames: usize,
    /// Certificates of this run directory, whose scene may have been a little different, are used where they still
    /// hold: each is evaluated anew, and only pairs of bodies whose proof fails are searched.
    #[arg(long, value_name = "RUN")]
    pub reuse: Option<PathBuf>,
}

impl Default for CertifyOptions {
    fn default() -> Self {
        Self {
            method: Method::Swept,
            workers: 0,
            guide_samples: 4000,
            first_cut_loss: 3e-5,
            max_cut_loss: 1e-3,
            cells_per_doubling: 2000,
            max_thin_cut_loss: 0.02,
            max_clean_up_loss: 0.01,
            room: 2e-3,
            thin: 1e-3,
            give_up: 1e-5,
            cut_margin: 1e-7,
            min_kept: 0.25,
            max_cells: 400_000,
            shrink_resolution: 0.005,
            min_width: 0.1,
            max_rows: 12,
            max_frames: 2,
            reuse: None,
        }
    }
}

impl CertifyOptions {
    /// Whether all values make sense.
    pub fn validate(&self) -> Result<(), CertifyError> {
        let shares = [
            ("first-cut-loss", self.first_cut_loss),
            ("max-cut-loss", self.max_cut_loss),
            ("max-thin-cut-loss", self.max_thin_cut_loss),
            ("max-clean-up-loss", self.max_clean_up_loss),
            ("min-kept", self.min_kept),
            ("shrink-resolution", self.shrink_resolution),
            ("min-width", self.min_width),
        ];
        for (option, value) in shares {
            if !(0.0..=1.0).contains(&value) {
                return Err(CertifyError::Option { option, value, remedy: "give a share between 0 and 1" });
            }
        }
        for (option, value) in [("shrink-resolution", self.shrink_resolution), ("min-width", self.min_width)]
        {
            if value == 0.0 {
                return Err(CertifyError::Option { option, value, remedy: "give a share above 0" });
            }
        }
        let lengths = [
            ("thin", self.thin),
            ("give-up", self.give_up),
            ("cut-margin", self.cut_margin),
            ("room", self.room),
        ];
        for (option, value) in lengths {
            if !(value > 0.0 && value.is_finite()) {
                return Err(CertifyError::Option {
                    option,
                    value,
                    remedy: "give a positive length in metres",
                });
            }
        }
        Ok(())
    }

    /// What sums of squares need.
    pub(crate) fn shrinking(&self) -> Shrinking {
        Shrinking { resolution: self.shrink_resolution, least: self.min_width }
    }

    /// What sums of squares need.
    pub(crate) fn sums_settings(&self) -> SumsSettings {
        SumsSettings {
            max_rows: self.max_rows,
            max_frames: self.max_frames,
            solver: conic::Settings::default(),
        }
    }

    /// Whether regions may be cut.
    pub fn cuts_allowed(&self) -> bool {
        self.max_cut_loss > 0.0
    }
}
