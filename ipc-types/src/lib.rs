//! The contract between the processes of regrasp: artefact formats and message layouts. No algorithm, no solver.
//!
//! - [`artefact`]: what stages write to disk, as plain data with the field names of the `.json` twins;
//! - [`container`]: the `.bin` form, a checked header before a binary body; [`store`] reads and writes both forms;
//! - [`path_input`]: the paths of other planners, as a table or as curves;
//! - [`join`]: parts that several processes wrote become one file, the same bytes whoever wrote them;
//! - [`status`]: `status.json` and `spans.jsonl`, what a stage says of its own run;
//! - [`exit_code`]: how every program of the project ends.

pub mod artefact;
pub mod channel;
pub mod container;
pub mod domain;
pub mod exit_code;
pub mod join;
pub mod json;
pub mod message;
pub mod path_input;
pub mod stage_name;
pub mod status;
pub mod store;
pub mod validate;

/// Version of messages, artefacts and channel names together. A process of another version is refused.
pub const PROTOCOL_VERSION: u32 = 2;

/// BLAKE3 digest.
pub type Digest = [u8; 32];

/// A digest in hexadecimal, as in `run.json` and in messages for people.
pub fn hexadecimal(digest: &Digest) -> String {
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}
