//! Newest state of a stage, of fixed size.

use super::{bytes_text, text_bytes};
use crate::PROTOCOL_VERSION;
use crate::stage_name::StageName;
use iceoryx2::prelude::ZeroCopySend;

/// A progress record.
#[derive(Debug, Clone, Copy, PartialEq, ZeroCopySend)]
#[type_name("ProgressRecord")]
#[repr(C)]
pub struct ProgressRecord {
    /// [`PROTOCOL_VERSION`].
    pub protocol_version: u32,
    /// Number of the stage.
    pub stage: u32,
    /// Number of the worker; 0 where there is one.
    pub worker: u32,
    /// Filled with zeros.
    pub reserved: u32,
    /// Units done.
    pub done: u64,
    /// Units in all; 0: not known.
    pub total: u64,
    /// The figure that matters: coverage, gap, length.
    pub value: f64,
    /// A few words, UTF-8, filled with zeros.
    pub message: [u8; 128],
}

impl ProgressRecord {
    /// A record; words that are too long are cut.
    pub fn new(
        stage: StageName,
        worker: u32,
        done: u64,
        total: u64,
        value: f64,
        message: &str,
    ) -> ProgressRecord {
        ProgressRecord {
            protocol_version: PROTOCOL_VERSION,
            stage: stage.number(),
            worker,
            reserved: 0,
            done,
            total,
            value,
            message: text_bytes(message).0,
        }
    }

    /// The words.
    pub fn words(&self) -> String {
        bytes_text(&self.message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_cut_between_characters() {
        let record = ProgressRecord::new(StageName::Gcs, 0, 1, 2, 0.5, &"ä".repeat(100));
        assert_eq!(record.words(), "ä".repeat(64));
    }
}
