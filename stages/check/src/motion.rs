//! Plan and trajectory: they agree, they are one continuous motion from start to goal, and every control point lies
//! where it is proven free. A Bézier piece lies in the hull of its control points, and a region is convex.

use crate::exact;
use ipc_types::artefact::{Mode, PlanFile, Region, TrajectoryFile};
use scene::{LinearForm, Scene, Space, Task};
use std::collections::BTreeMap;

/// Why the motion is not what it claims to be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MotionError {
    /// Plan and trajectory differ.
    #[error("plan and trajectory disagree: {0}")]
    Disagree(String),
    /// The motion jumps.
    #[error("segment {segment_idx}, piece {piece_idx}: it does not begin where the motion before it ended")]
    Jump {
        /// Segment.
        segment_idx: usize,
        /// Piece.
        piece_idx: usize,
    },
    /// A control point outside its region.
    #[error(
        "segment {segment_idx}, piece {piece_idx}, control point {point_idx}: outside region {region_id} (face {face_idx})"
    )]
    OutsideRegion {
        /// Segment.
        segment_idx: usize,
        /// Piece.
        piece_idx: usize,
        /// Control point.
        point_idx: usize,
        /// Region.
        region_id: u64,
        /// Face that is violated.
        face_idx: usize,
    },
    /// A piece in a region that is not certified or does not exist.
    #[error("segment {segment_idx}, piece {piece_idx}: region {region_id} {problem}")]
    Region {
        /// Segment.
        segment_idx: usize,
        /// Piece.
        piece_idx: usize,
        /// Region.
        region_id: u64,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// A control point outside joint limits, `CG` or `CP`.
    #[error("segment {segment_idx}, piece {piece_idx}, control point {point_idx}: outside {space} ({row})")]
    OutsideSpace {
        /// Segment.
        segment_idx: usize,
        /// Piece.
        piece_idx: usize,
        /// Control point.
        point_idx: usize,
        /// `the joint limits`, `CG` or `CP`.
        space: &'static str,
        /// Which bound.
        row: String,
    },
    /// A kept form changes.
    #[error(
        "segment {segment_idx} ({mode}): kept form {form_idx} changes by {residual:e}, more than {allowed:e}"
    )]
    NotKept {
        /// Segment.
        segment_idx: usize,
        /// Mode.
        mode: &'static str,
        /// Form.
        form_idx: usize,
        /// By how much.
        residual: f64,
        /// How much is allowed.
        allowed: f64,
    },
    /// Not the task's start or goal.
    #[error("the motion does not {0}")]
    Ends(&'static str),
    /// The modes do not alternate from transit to transit.
    #[error("segment {segment_idx} has the wrong mode: a plan alternates transit, transfer, …, transit")]
    Modes {
        /// Segment.
        segment_idx: usize,
    },
    /// A grasp or release that is not one.
    #[error("configuration {configuration_idx} must lie in CG and CP, but violates {row} of {space}")]
    NotAGrasp {
        /// Configuration.
        configuration_idx: usize,
        /// `CG` or `CP`.
        space: &'static str,
        /// Which bound.
        row: String,
    },
    /// Numbers that are not finite, or too few.
    #[error("segment {segment_idx}, piece {piece_idx}: {problem}")]
    Malformed {
        /// Segment.
        segment_idx: usize,
        /// Piece.
        piece_idx: usize,
        /// What is wrong.
        problem: &'static str,
    },
}

/// How much a kept form whose coefficients are not all 0, 1 or -1 may change along a segment; with such coefficients
/// points of a binary grid keep it exactly, and it may not change at all.
pub const KEPT_RESIDUAL: f64 = 1e-12;

/// What was found of a motion that passed.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionFacts {
    /// Control points that were located.
    pub n_control_points: usize,
    /// Largest change of a kept form along a segment.
    pub kept_residual: f64,
}

fn space_violation(scene: &Scene, space: &Space, q: &[f64]) -> Option<String> {
    for (j, coordinate) in scene.coordinates.iter().enumerate() {
        if !(space.lower[j] <= q[j] && q[j] <= space.upper[j]) {
            let (name, value) = (&coordinate.name, q[j]);
            return Some(format!("{name} = {value} is not in [{}, {}]", space.lower[j], space.upper[j]));
        }
    }
    space.rows.iter().enumerate().find_map(|(row_idx, row)| {
        let negated: Vec<f64> = row.form.iter().map(|x| -x).collect();
        let above = row.upper == f64::INFINITY || exact::satisfies(row.form.as_slice(), q, row.upper);
        let below = row.lower == f64::NEG_INFINITY || exact::satisfies(&negated, q, -row.lower);
        (!(above && below)).then(|| format!("row {row_idx}"))
    })
}

fn limits_violation(scene: &Scene, q: &[f64]) -> Option<String> {
    scene.coordinates.iter().zip(q).find_map(|(c, &q)| {
        (!(c.lower <= q && q <= c.upper))
            .then(|| format!("{} = {q} is not in [{}, {}]", c.name, c.lower, c.upper))
    })
}

/// Change of the kept forms over the control points of a segment, checked against what is allowed.
fn verify_kept(
    segment_idx: usize,
    mode: Mode,
    forms: &[LinearForm],
    points: &[&Vec<f64>],
) -> Result<f64, MotionError> {
    let mut largest: f64 = 0.0;
    for (form_idx, form) in forms.iter().enumerate() {
        let exact = form.iter().all(|c| *c == 0.0 || c.abs() == 1.0);
        let allowed = if exact { 0.0 } else { KEPT_RESIDUAL };
        for point in points {
            let residual = exact::difference(form.as_slice(), points[0], point);
            if !(residual <= allowed) {
                let mode = mode_name(mode);
                return Err(MotionError::NotKept { segment_idx, mode, form_idx, residual, allowed });
            }
            largest = largest.max(residual);
        }
    }
    Ok(largest)
}

fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Transit => "transit",
        Mode::Transfer => "transfer",
    }
}

/// Verifies a motion against the regions that are proven free (`proven` has the ids whose certificates hold; `None`
/// where nothing is claimed to be certified).
pub fn verify(
    scene: &Scene,
    task: &Task,
    plan: &PlanFile,
    trajectory: &TrajectoryFile,
    regions: &BTreeMap<u64, &Region>,
    proven: &BTreeMap<u64, bool>,
) -> Result<MotionFacts, MotionError> {
    let disagree = |what: &str| MotionError::Disagree(what.to_owned());
    let configurations =
        plan.configurations.as_ref().ok_or_else(|| disagree("the plan has no configurations"))?;
    let modes = plan.modes.as_ref().ok_or_else(|| disagree("the plan has no modes"))?;
    let held = plan.regions.as_ref().ok_or_else(|| disagree("the plan has no regions"))?;
    let n = scene.dim();
    if configurations.iter().any(|x| x.len() != n || x.iter().any(|x| !x.is_finite())) {
        return Err(disagree("a configuration of the plan is not one finite number a coordinate"));
    }
    if trajectory.coordinates.iter().ne(scene.coordinates.iter().map(|c| &c.name)) {
        return Err(disagree("the trajectory's coordinates are not the scene's"));
    }
    if trajectory.segments.len() != modes.len() || configurations.len() != modes.len() + 1 {
        return Err(disagree("the numbers of configurations, modes and segments do not fit"));
    }
    if held.len() != configurations.len() {
        return Err(disagree("the plan names a region for some configurations only"));
    }
    if plan.n_grasps != Some(modes.iter().filter(|&&mode| mode == Mode::Transfer).count()) {
        return Err(disagree("the number of grasps is not the number of transfers"));
    }
    let (first, last) = (configurations.first(), configurations.last());
    if first.is_none_or(|q| q.as_slice() != task.start.as_slice()) {
        return Err(MotionError::Ends("begin at the task's start"));
    }
    if last.is_none_or(|q| q.as_slice() != task.goal.as_slice()) {
        return Err(MotionError::Ends("end at the task's goal"));
    }
    for (configuration_idx, q) in configurations.iter().enumerate() {
        let region = regions.get(&held[configuration_idx]);
        let inside = region.is_some_and(|r| r.A.iter().zip(&r.b).all(|(a, b)| exact::satisfies(a, q, *b)));
        if !inside {
            return Err(disagree(&format!(
                "configuration {configuration_idx} is not in the region it names"
            )));
        }
        let inner = configuration_idx > 0 && configuration_idx + 1 < configurations.len();
        for (space, name) in [(&task.grasp, "CG"), (&task.placement, "CP")] {
            if !inner && name == "CG" {
                continue;
            }
            if let Some(row) = space_violation(scene, space, q) {
                return Err(MotionError::NotAGrasp { configuration_idx, space: name, row });
            }
        }
    }
    let mut facts = MotionFacts { n_control_points: 0, kept_residual: 0.0 };
    for (segment_idx, segment) in trajectory.segments.iter().enumerate() {
        let expected = if segment_idx % 2 == 0 { Mode::Transit } else { Mode::Transfer };
        if segment.mode != expected || modes[segment_idx] != expected {
            return Err(MotionError::Modes { segment_idx });
        }
        if segment.pieces.len() != segment.regions.len() || segment.pieces.is_empty() {
            let problem = "the segment has no pieces, or not one region a piece";
            return Err(MotionError::Malformed { segment_idx, piece_idx: 0, problem });
        }
        let mut at = &configurations[segment_idx];
        for (piece_idx, (piece, &region_id)) in segment.pieces.iter().zip(&segment.regions).enumerate() {
            let usable = |x: &Vec<f64>| x.len() == n && x.iter().all(|x| x.is_finite());
            let (Some(begin), Some(end), true) = (piece.first(), piece.last(), piece.iter().all(usable))
            else {
                let problem = "control points must be finite numbers, one a coordinate";
                return Err(MotionError::Malformed { segment_idx, piece_idx, problem });
            };
            if begin != at {
                return Err(MotionError::Jump { segment_idx, piece_idx });
            }
            at = end;
            let fail = |problem| MotionError::Region { segment_idx, piece_idx, region_id, problem };
            let region = regions.get(&region_id).ok_or_else(|| fail("does not exist"))?;
            if segment.certified && proven.get(&region_id) != Some(&true) {
                return Err(fail("is not certified, though the segment says so"));
            }
            for (point_idx, q) in piece.iter().enumerate() {
                let outside = region.A.iter().zip(&region.b).position(|(a, b)| !exact::satisfies(a, q, *b));
                if let Some(face_idx) = outside {
                    return Err(MotionError::OutsideRegion {
                        segment_idx,
                        piece_idx,
                        point_idx,
                        region_id,
                        face_idx,
                    });
                }
                let (space, name) = match segment.mode {
                    Mode::Transit => (&task.placement, "CP"),
                    Mode::Transfer => (&task.grasp, "CG"),
                };
                let violated = limits_violation(scene, q)
                    .map(|row| ("the joint limits", row))
                    .or_else(|| space_violation(scene, space, q).map(|row| (name, row)));
                if let Some((space, row)) = violated {
                    return Err(MotionError::OutsideSpace { segment_idx, piece_idx, point_idx, space, row });
                }
                facts.n_control_points += 1;
            }
        }
        if at != &configurations[segment_idx + 1] {
            return Err(disagree(&format!(
                "segment {segment_idx} does not end at configuration {}",
                segment_idx + 1
            )));
        }
        let forms = match segment.mode {
            Mode::Transit => &task.transit_keep,
            Mode::Transfer => &task.transfer_keep,
        };
        let points: Vec<&Vec<f64>> = segment.pieces.iter().flatten().collect();
        facts.kept_residual =
            facts.kept_residual.max(verify_kept(segment_idx, segment.mode, forms, &points)?);
    }
    Ok(facts)
}
