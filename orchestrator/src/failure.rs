//! Exit codes, and an ending that is not success, in one line for people.

use std::fmt::Display;
use std::path::Path;

/// Exit codes, the same for every program of the project.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExitCode {
    /// Done.
    Done,
    /// A proven negative answer: no plan with at most K grasps, path not certified, check failed.
    Negative,
    /// Bad input; the message names file, field, value and remedy.
    BadInput,
    /// A limit of time or memory was hit; the best result is kept.
    Limit,
    /// A stage failed.
    StageFailed,
    /// Interrupted; the state is kept.
    Interrupted,
}

impl ExitCode {
    /// The number.
    pub fn code(self) -> i32 {
        match self {
            ExitCode::Done => 0,
            ExitCode::Negative => 1,
            ExitCode::BadInput => 2,
            ExitCode::Limit => 3,
            ExitCode::StageFailed => 4,
            ExitCode::Interrupted => 130,
        }
    }

    /// The meaning of a process's exit code; what is not known is a failed stage.
    pub fn from_code(code: i32) -> ExitCode {
        match code {
            0 => ExitCode::Done,
            1 => ExitCode::Negative,
            2 => ExitCode::BadInput,
            3 => ExitCode::Limit,
            130 => ExitCode::Interrupted,
            _ => ExitCode::StageFailed,
        }
    }
}

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
        Failure { exit_code: ExitCode::StageFailed, message: message.into() }
    }

    /// A file could not be read or written.
    pub fn file(action: &str, path: &Path, cause: impl Display) -> Failure {
        Failure::stage_failed(format!("cannot {action} {}: {cause}", path.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_go_there_and_back() {
        for code in [0, 1, 2, 3, 4, 130] {
            assert_eq!(ExitCode::from_code(code).code(), code);
        }
        assert_eq!(ExitCode::from_code(101), ExitCode::StageFailed);
    }
}
