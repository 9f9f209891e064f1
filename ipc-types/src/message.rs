//! Layouts of the messages: `#[repr(C)]` headers, the same in every language. Payloads are slices of `f64` or `u64`.
//!
//! Every header begins with [`crate::PROTOCOL_VERSION`] and carries the digest of the scene, so that a process of
//! another version, or that read another scene, is refused. An output whose payload is empty did not fit the channel:
//! it is read from disk, where it always is before it is announced.

mod control;
mod plan;
mod progress;
mod region;

pub use control::{ControlAnswer, ControlRequest, Question, Reply, WorkAnswer, WorkReply, WorkRequest};
pub use plan::{CutHeader, PlanHeader, SegmentHeader};
pub use progress::ProgressRecord;
pub use region::{RegionHeader, RegionStatus};

use crate::validate::Violation;
use crate::{Digest, PROTOCOL_VERSION, hexadecimal};

/// An id that means none.
pub const NO_ID: u64 = u64::MAX;

/// A message that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)] // The messages say what the fields are.
pub enum MessageError {
    #[error(
        "message of protocol version {found}, this program speaks {PROTOCOL_VERSION}; use programs of the same version"
    )]
    Version { found: u32 },
    #[error(
        "message about another scene (digest {found}, this run has {expected}); did a scene file change during the run?"
    )]
    ForeignScene { found: String, expected: String },
    #[error("{field} = {value} in a message: expected {expected}")]
    Field { field: &'static str, value: u64, expected: String },
    #[error("region {id} in a message: {violation}")]
    Region { id: u64, violation: Violation },
}

/// Refuses another version and another scene.
pub fn check(version: u32, scene: &Digest, expected_scene: &Digest) -> Result<(), MessageError> {
    if version != PROTOCOL_VERSION {
        return Err(MessageError::Version { found: version });
    }
    if scene != expected_scene {
        return Err(MessageError::ForeignScene {
            found: hexadecimal(scene),
            expected: hexadecimal(expected_scene),
        });
    }
    Ok(())
}

/// `text` in `N` bytes, filled with zeros, cut at a character; and whether all of it fitted.
fn text_bytes<const N: usize>(text: &str) -> ([u8; N], bool) {
    let mut end = text.len().min(N);
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let mut bytes = [0; N];
    bytes[..end].copy_from_slice(&text.as_bytes()[..end]);
    (bytes, end == text.len())
}

/// The text in bytes that are filled with zeros; what is not UTF-8 is replaced.
fn bytes_text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}
