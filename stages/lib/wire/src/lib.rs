//! Conversions between artefacts and mathematical types.
