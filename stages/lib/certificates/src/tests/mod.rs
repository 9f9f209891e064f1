//! Tests that need scenes: cells against samples, bodies against κ, regions and certificates against the collision library, and reference scenes.

// 3.14 is a joint limit of the scenes, not π.
#![allow(clippy::approx_constant)]

mod cells;
mod grow;
mod random_scene;
mod reference_scenes;
mod regions;
mod reuse;
mod sampled_proofs;
mod sums;
mod swept_bodies;
