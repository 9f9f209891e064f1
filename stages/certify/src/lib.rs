//! Certificates of freedom from collision for regions and paths.
