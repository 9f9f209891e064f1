//! Tests that need scenes: cells against samples, regions against the collision library, reference scenes, acceptance.

mod acceptance;
mod cells;
mod random_scene;
mod reference_scenes;
mod regions;
