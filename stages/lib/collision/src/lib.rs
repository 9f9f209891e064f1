//! Configurations and edges against the scene.
