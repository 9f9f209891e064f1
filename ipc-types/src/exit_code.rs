//! Exit codes, the same for every program of the project.

/// How a program ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
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
    Failed,
    /// Interrupted; the state is kept.
    Interrupted,
}

impl ExitCode {
    /// All of them.
    pub const ALL: [ExitCode; 6] = [
        ExitCode::Done,
        ExitCode::Negative,
        ExitCode::BadInput,
        ExitCode::Limit,
        ExitCode::Failed,
        ExitCode::Interrupted,
    ];

    /// The number that the shell sees.
    pub fn code(self) -> i32 {
        match self {
            ExitCode::Done => 0,
            ExitCode::Negative => 1,
            ExitCode::BadInput => 2,
            ExitCode::Limit => 3,
            ExitCode::Failed => 4,
            ExitCode::Interrupted => 130,
        }
    }

    /// The meaning of a number; what is not known is a failure.
    pub fn from_code(code: i32) -> ExitCode {
        ExitCode::ALL.into_iter().find(|known| known.code() == code).unwrap_or(ExitCode::Failed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_go_there_and_back() {
        for code in ExitCode::ALL {
            assert_eq!(ExitCode::from_code(code.code()), code);
        }
        assert_eq!(ExitCode::from_code(101), ExitCode::Failed);
    }
}
