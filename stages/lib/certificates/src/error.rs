//! What can be wrong with a request.

use thiserror::Error;

/// A request that cannot be worked on (exit code 2).
#[derive(Debug, Clone, PartialEq, Error)]
#[allow(missing_docs)] // The messages say what the fields are.
pub enum CertifyError {
    #[error("region {region_id}: {problem}; make the regions again with regrasp-decompose")]
    Region { region_id: u64, problem: String },
    #[error("option {option} = {value}: {remedy}")]
    Option { option: &'static str, value: f64, remedy: &'static str },
}
