//! Movable joints to the coordinates of C-space: their order and their limits.

use crate::document::CoordinatesTable;
use crate::error::{Place, SceneError};
use crate::naming::CoordinateNames;
use crate::numbers::finite;
use crate::tree::MovableJoint;
use crate::{Coordinate, CoordinateKind};
use std::f64::consts::PI;

/// The coordinates in the scene's order, and for each movable joint its position among them.
pub fn coordinates(
    table: &CoordinatesTable,
    movable: &[MovableJoint],
    names: &CoordinateNames,
    place: &dyn Fn(String) -> Place,
) -> Result<(Vec<Coordinate>, Vec<usize>), SceneError> {
    let at_order = || place("coordinates.order".to_owned());
    if movable.is_empty() {
        return Err(SceneError::NoCoordinates { at: at_order() });
    }
    let at_limits = |name: &str| place(format!("coordinates.limits.{name}"));
    let limits = names.resolve_table(&table.limits, at_limits)?;
    let mut position: Vec<Option<usize>> = vec![None; movable.len()];
    let mut coordinates = Vec::with_capacity(movable.len());
    for (order_idx, name) in table.order.iter().enumerate() {
        let at = || place(format!("coordinates.order[{order_idx}]"));
        let movable_idx = names.resolve(at(), name)?;
        if position[movable_idx].replace(order_idx).is_some() {
            return Err(SceneError::RepeatedCoordinate { at: at(), value: name.clone() });
        }
        let joint = &movable[movable_idx];
        let narrowed = limits.get(&movable_idx).map(|&(spelling, range)| (at_limits(spelling), *range));
        let in_file = || place(format!("coordinates.order[{order_idx}] \"{name}\""));
        let (at, lower, upper) = match (narrowed, joint.limits) {
            (Some((at, [lower, upper])), limits) => {
                finite(at.clone(), lower)?;
                finite(at.clone(), upper)?;
                if lower >= upper {
                    return Err(SceneError::NotOrdered { at, lower, upper });
                }
                if let Some((limit_lower, limit_upper)) = limits
                    && (lower < limit_lower || upper > limit_upper)
                {
                    return Err(SceneError::OutsideLimits { at, lower, upper, limit_lower, limit_upper });
                }
                (at, lower, upper)
            }
            (None, Some((lower, upper))) => (in_file(), lower, upper),
            (None, None) => {
                let at = in_file();
                return Err(SceneError::LimitsNeeded { at, kind: joint.joint_kind, name: name.clone() });
            }
        };
        if joint.kind == CoordinateKind::Revolute && !(-PI < lower && upper < PI) {
            return Err(SceneError::RevoluteRange { at, lower, upper });
        }
        coordinates.push(Coordinate { name: name.clone(), kind: joint.kind, lower, upper });
    }
    let mut order_of = Vec::with_capacity(movable.len());
    for (movable_idx, position) in position.into_iter().enumerate() {
        match position {
            Some(order_idx) => order_of.push(order_idx),
            None => {
                let value = names.shortest(movable, movable_idx);
                return Err(SceneError::CoordinateMissing { at: at_order(), value });
            }
        }
    }
    Ok((coordinates, order_of))
}
