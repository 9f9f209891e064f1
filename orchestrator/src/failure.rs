//! An ending that is not success, in one line for people.

pub use ipc_types::exit_code::ExitCode;
use std::fmt::Display;
use std::path::Path;

/// An ending that is not success: what, where, value, remedy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct Failure {
    /// How the program ends.
    pub exit_code: ExitCode,
    /// One line or a few.
    pub message: String,
}

impl Failure {
    /// Bad input.
    pub fn bad_input(message: impl Into<String>) -> Failure {
        Failure { exit_code: ExitCode::BadInput, message: message.into() }
    }

    /// A stage failed, or something of the machine did.
    pub fn stage_failed(message: impl Into<String>) -> Failure {
        Failure { exit_code: ExitCode::Failed, message: message.into() }
    }

    /// A file could not be read or written.
    pub fn file(action: &str, path: &Path, cause: impl Display) -> Failure {
        Failure::stage_failed(format!("cannot {action} {}: {cause}", path.display()))
    }
}

impl From<ipc_types::store::StoreError> for Failure {
    fn from(error: ipc_types::store::StoreError) -> Failure {
        use ipc_types::store::StoreError;
        match error {
            StoreError::Write { .. } => Failure::stage_failed(error.to_string()),
            _ => Failure::bad_input(error.to_string()),
        }
    }
}
