//! What is held over some pieces of a path: the scene it makes, and how far it is from where the path has it.

use super::{PathError, through};
use crate::body;
use crate::chain::Side;
use crate::interval::{self, Interval, Vec3};
use crate::path::at_parameter::{Stretch, Values};
use ipc_types::artefact::Attachment;
use ipc_types::path_input::InputPiece;
use scene::Scene;

/// The scene while the attachment lasts, its own data checked.
pub fn scene_of(
    scene: &Scene,
    attachment: &Attachment,
    before: Option<&Attachment>,
    n_pieces: usize,
) -> Result<Scene, PathError> {
    let Attachment { object, gripper, first, last, .. } = attachment;
    let foreign = |problem: String| PathError::Foreign(format!("{object} held by {gripper}: {problem}"));
    let follows = before.is_none_or(|before| before.last < *first);
    if !(follows && first <= last && (*last as usize) < n_pieces) {
        return Err(foreign(format!("its pieces {first} to {last} are not in order, or not of the path")));
    }
    let X_GO = scene::pose_from_numbers(attachment.rotation, attachment.translation)
        .ok_or_else(|| foreign("its pose is not finite numbers".to_owned()))?;
    scene.with_attached(object, gripper, &X_GO).map_err(|error| foreign(error.to_string()))
}

/// Upper bound of how far what is held is from where the path has it: where the holding begins, and where it ends unless
/// the path does.
pub fn displacement(
    scene: &Scene,
    held: &Scene,
    attachment: &Attachment,
    pieces: &[InputPiece],
) -> Option<f64> {
    let [first, last] = [attachment.first, attachment.last].map(|piece| piece as usize);
    let mut largest = at(scene, held, attachment, pieces.get(first)?.control_points.first()?)?;
    if last + 1 < pieces.len() {
        largest = largest.max(at(scene, held, attachment, pieces.get(last)?.control_points.last()?)?);
    }
    Some(largest)
}

/// The same at one configuration; `None` for links that are not there.
fn at(scene: &Scene, held: &Scene, attachment: &Attachment, q: &[f64]) -> Option<f64> {
    let object = scene.link_idx(&attachment.object)?;
    let stretch = Stretch::new(&[q.to_vec(), q.to_vec()], 0.0, 1.0);
    let mut largest: f64 = 0.0;
    for (body_idx, body) in scene.bodies.iter().enumerate() {
        if !hangs_on(scene, body.link_idx, object) {
            continue;
        }
        let extent = body::core_extent(&body.shape) + body::rounding_radius(&body.shape);
        let sides = [Side::new(scene, 0, body_idx)?, Side::new(held, 0, body_idx)?];
        let distance = between(&sides, &stretch.values[0], Interval::point(extent).hi());
        // A comparison with NaN is not to hide it.
        largest = if distance.is_nan() { f64::INFINITY } else { largest.max(distance) };
    }
    Some(largest)
}

/// Upper bound of how far a point within `extent` of the body's origin is from itself in the two scenes: a component
/// e·x is r·x_S + d in each.
fn between(sides: &[Side; 2], values: &Values, extent: f64) -> f64 {
    let component = |i: usize| {
        let e: Vec3 = std::array::from_fn(|k| if k == i { Interval::ONE } else { Interval::ZERO });
        let [(r_0, d_0), (r_1, d_1)] = [0, 1].map(|k| through(&sides[k].steps, values, &e));
        let turned = interval::norm(&std::array::from_fn(|k| r_1[k] - r_0[k]));
        Interval::point((d_1 - d_0).magnitude()) + turned * Interval::point(extent)
    };
    let bounds: Vec3 = std::array::from_fn(|i| Interval::point(component(i).hi()));
    interval::norm(&bounds).hi()
}

fn hangs_on(scene: &Scene, link: usize, ancestor: usize) -> bool {
    let mut at = Some(link);
    // A parent comes before its link, so this ends.
    while let Some(link) = at {
        if link == ancestor {
            return true;
        }
        at = scene.links.get(link).and_then(|l| l.parent).filter(|parent| *parent < link);
    }
    false
}
