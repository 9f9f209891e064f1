//! A scene: robot, movable object, obstacles and tasks, read from `scene.toml` and URDF files.
//!
//! Everything downstream works on the plain data of [`Scene`]; only this crate knows file formats.
//! Links form one tree (the *composite tree*) whose root, link 0, is the world. Every link moves against its
//! parent by at most one revolute or prismatic joint: other joint kinds are decomposed into these
//! (thesis 2, appendix F), with links without bodies in between.

mod attached;
mod body;
mod collision_pair;
mod coordinate;
mod document;
mod error;
mod feasibility;
mod link;
mod load;
mod naming;
mod numbers;
mod ordering;
mod reading_tasks;
mod task;
mod tree;
mod urdf;
mod xml_guard;

pub use attached::{AttachError, pose_from_numbers};
pub use body::{Body, Shape};
pub use collision_pair::CollisionPair;
pub use coordinate::{Coordinate, CoordinateKind};
pub use error::{Place, SceneError};
pub use link::{Link, Motion, Role};
pub use load::SCENE_FILE;
pub use task::{BoundedRow, LinearForm, Space, Task};

use std::collections::BTreeMap;

/// Pose of frame B measured in frame A: `X_AB` maps coordinates in B to coordinates in A.
pub type RigidTransform = nalgebra::Isometry3<f64>;

/// A file that was read to make the scene.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneFile {
    /// Path relative to the scene folder, with `/`.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// Robot, object and obstacles as one kinematic tree with convex bodies, and the tasks asked of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    /// Name of the scene.
    pub name: String,
    /// What the scene is about, in prose.
    pub description: String,
    /// The coordinates of C-space in the order of `[coordinates] order`; `q[i]` belongs to `coordinates[i]`.
    pub coordinates: Vec<Coordinate>,
    /// Links of the composite tree; link 0 is the world, a parent precedes its children.
    pub links: Vec<Link>,
    /// Convex collision bodies, each rigid on its link.
    pub bodies: Vec<Body>,
    /// Pairs of links, lower index first and sorted, that one joint of a model joins (also a joint that was
    /// decomposed into several).
    pub adjacent_links: Vec<(usize, usize)>,
    /// Pairs of links, lower index first and sorted, that the scene file excludes from collision.
    pub excluded_links: Vec<(usize, usize)>,
    /// Tasks by name.
    pub tasks: BTreeMap<String, Task>,
    /// The files that were read, sorted by name.
    pub files: Vec<SceneFile>,
    /// BLAKE3 over the files, in the order of their names, each preceded by its name and length.
    pub digest: [u8; 32],
}

impl Scene {
    /// Dimension of C-space.
    pub fn dim(&self) -> usize {
        self.coordinates.len()
    }

    /// Lower joint limits, in the order of the coordinates (radians, metres).
    pub fn lower(&self) -> nalgebra::DVector<f64> {
        nalgebra::DVector::from_iterator(self.dim(), self.coordinates.iter().map(|c| c.lower))
    }

    /// Upper joint limits, in the order of the coordinates (radians, metres).
    pub fn upper(&self) -> nalgebra::DVector<f64> {
        nalgebra::DVector::from_iterator(self.dim(), self.coordinates.iter().map(|c| c.upper))
    }

    /// Position of the coordinate called `name`, spelled as the scene's `order` spells it.
    pub fn coordinate_idx(&self, name: &str) -> Option<usize> {
        self.coordinates.iter().position(|coordinate| coordinate.name == name)
    }

    /// Position of the link called `name` (`model/link`, or an obstacle's name).
    pub fn link_idx(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.name == name)
    }

    /// Position of the body called `name`.
    pub fn body_idx(&self, name: &str) -> Option<usize> {
        self.bodies.iter().position(|body| body.name == name)
    }

    /// The task called `name`; without a name, the only one there is.
    pub fn task(&self, name: Option<&str>) -> Result<&Task, SceneError> {
        let file = || format!("scene {}", self.name);
        let known = || error::listed(self.tasks.keys());
        match name {
            Some(name) => self.tasks.get(name).ok_or_else(|| SceneError::UnknownTask {
                file: file(),
                name: name.to_owned(),
                known: known(),
            }),
            None => match self.tasks.len() {
                0 => Err(SceneError::NoTask { file: file() }),
                1 => self.tasks.values().next().ok_or_else(|| SceneError::NoTask { file: file() }),
                _ => Err(SceneError::TaskNeeded { file: file(), known: known() }),
            },
        }
    }
}
