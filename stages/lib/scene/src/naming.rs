//! Names of coordinates: how a scene file may spell them, and what they stand for.

use crate::error::{Place, SceneError, listed};
use crate::tree::MovableJoint;
use std::collections::{BTreeMap, BTreeSet};

/// Every accepted spelling of every movable joint: `model/joint`, and `joint`.
pub struct CoordinateNames {
    spellings: BTreeMap<String, BTreeSet<usize>>,
    full_names: Vec<String>,
}

impl CoordinateNames {
    /// Of all movable joints.
    pub fn new(movable: &[MovableJoint]) -> Self {
        let full_names: Vec<String> =
            movable.iter().map(|joint| format!("{}/{}", joint.model, joint.name)).collect();
        let mut spellings: BTreeMap<String, BTreeSet<usize>> = BTreeMap::new();
        for (movable_idx, joint) in movable.iter().enumerate() {
            spellings.entry(joint.name.clone()).or_default().insert(movable_idx);
            spellings.entry(full_names[movable_idx].clone()).or_default().insert(movable_idx);
        }
        Self { spellings, full_names }
    }

    /// The shortest spelling that names this joint only.
    pub fn shortest(&self, movable: &[MovableJoint], movable_idx: usize) -> String {
        let name = &movable[movable_idx].name;
        let unique = self.spellings.get(name).is_some_and(|joints| joints.len() == 1);
        if unique { name.clone() } else { self.full_names[movable_idx].clone() }
    }

    /// Position of the joint that `name` stands for.
    pub fn resolve(&self, at: Place, name: &str) -> Result<usize, SceneError> {
        let Some(joints) = self.spellings.get(name) else {
            let known = listed(&self.full_names);
            return Err(SceneError::UnknownCoordinate { at, value: name.to_owned(), known });
        };
        match joints.first() {
            Some(&only) if joints.len() == 1 => Ok(only),
            _ => {
                let known = listed(joints.iter().map(|&joint| &self.full_names[joint]));
                Err(SceneError::AmbiguousCoordinate { at, value: name.to_owned(), known })
            }
        }
    }

    /// A table by names as pairs of position and value, sorted by position; a joint named twice is refused.
    pub fn resolve_table<'a, T>(
        &self,
        table: &'a BTreeMap<String, T>,
        at: impl Fn(&str) -> Place,
    ) -> Result<BTreeMap<usize, (&'a str, &'a T)>, SceneError> {
        let mut resolved = BTreeMap::new();
        for (name, value) in table {
            let movable_idx = self.resolve(at(name), name)?;
            if resolved.insert(movable_idx, (name.as_str(), value)).is_some() {
                return Err(SceneError::RepeatedCoordinate { at: at(name), value: name.clone() });
            }
        }
        Ok(resolved)
    }
}
