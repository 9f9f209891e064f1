//! Conic programmes over Clarabel, with bounds that hold in exact arithmetic.
