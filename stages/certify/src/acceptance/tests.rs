//! The acceptance check: a motion by hand, and one broken rule at a time.

// 3.14 is a joint limit of the scenes, not π.
#![allow(clippy::approx_constant)]

use super::{Motion, accept};
use ipc_types::artefact::{Mode, Region, Segment, TrajectoryFile};
use scene::Scene;
use std::path::Path;

fn scene() -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/bottle-cap-3dof");
    let mut scene = Scene::load(&folder).expect("a reference scene");
    // A task that two transits and a transfer within the long free interval of the band solve.
    let task = scene.tasks.get_mut("open").expect("its task");
    task.start = nalgebra::DVector::from_row_slice(&[0.0, 0.5, -0.03]);
    task.goal = nalgebra::DVector::from_row_slice(&[0.25, 0.75, -0.03]);
    scene
}

fn region() -> Region {
    let bounds = [[-3.14, 3.14], [0.4, 1.0], [-0.055, -0.0241]];
    let mut region = Region {
        id: 5,
        parent: Some(1),
        A: Vec::new(),
        b: Vec::new(),
        center: vec![0.0, 0.7, -0.03],
        method: "by hand".to_owned(),
        certified: true,
        margin: 0.0,
    };
    for (j, [lower, upper]) in bounds.into_iter().enumerate() {
        for (sign, b) in [(1.0, upper), (-1.0, -lower)] {
            let mut a = vec![0.0; 3];
            a[j] = sign;
            region.A.push(a);
            region.b.push(b);
        }
    }
    region
}

fn trajectory() -> TrajectoryFile {
    let segment = |mode, points: [[f64; 3]; 2]| Segment {
        mode,
        pieces: vec![points.iter().map(|q| q.to_vec()).collect()],
        regions: vec![5],
        length: 1.0,
        lower_bound: 0.0,
        certified: true,
    };
    TrajectoryFile {
        coordinates: vec!["cap".to_owned(), "gripper".to_owned(), "left_finger".to_owned()],
        segments: vec![
            segment(Mode::Transit, [[0.0, 0.5, -0.03], [0.0, 0.5, -0.0245]]),
            segment(Mode::Transfer, [[0.0, 0.5, -0.0245], [0.25, 0.75, -0.0245]]),
            segment(Mode::Transit, [[0.25, 0.75, -0.0245], [0.25, 0.75, -0.03]]),
        ],
        length: 3.0,
        duration: 3.0,
    }
}

/// The failures of `trajectory` in `regions`, as text.
fn failures(regions: &[Region], trajectory: &TrajectoryFile) -> Vec<String> {
    let scene = scene();
    let task = scene.task(None).expect("one task");
    let acceptance =
        accept(&scene, task, &Motion { regions, plan: None, trajectory }).expect("valid regions");
    acceptance.failures.iter().map(ToString::to_string).collect()
}

/// The failures after `change`; each must contain `words`.
fn expect(change: impl Fn(&mut TrajectoryFile), words: &str) {
    let mut trajectory = trajectory();
    change(&mut trajectory);
    let found = failures(&[region()], &trajectory);
    assert!(found.iter().any(|failure| failure.contains(words)), "{words:?} is not among {found:?}");
}

#[test]
fn a_good_motion_is_accepted() {
    assert_eq!(failures(&[region()], &trajectory()), Vec::<String>::new());
}

#[test]
fn each_broken_rule_is_named() {
    expect(|t| t.segments[0].pieces[0][0][1] = 0.51, "not at the start");
    expect(|t| t.segments[2].pieces[0][1][2] = -0.031, "not at the goal");
    expect(|t| t.segments[1].pieces[0][0][1] = 0.51, "does not begin where");
    expect(|t| t.segments[1].pieces[0][1][1] = 0.74, "kept form 0 of the transfer drifts");
    expect(|t| t.segments[2].pieces[0][1][0] = 0.26, "kept form 0 of the transit drifts");
    expect(|t| t.segments[1].pieces[0][1][2] = -0.0246, "kept form 1 of the transfer drifts");
    expect(|t| t.segments[1].pieces[0][1][2] = -0.0252, "outside CG");
    expect(|t| t.segments[0].pieces[0][1][2] = -0.0252, "outside CG ∩ CP");
    expect(|t| t.segments[0].pieces[0][1][2] = -0.056, "outside the joint limits");
    expect(|t| t.segments[1].pieces[0][1][1] = 0.39, "outside region 5");
    expect(|t| t.segments[1].regions[0] = 6, "does not exist");
    expect(|t| t.segments[1].mode = Mode::Transit, "do not alternate");
    expect(|t| drop(t.segments.pop()), "ends while the object is held");
    expect(|t| t.segments.clear(), "there is no motion");
}

#[test]
fn a_region_that_is_not_certified_and_a_collision_are_named() {
    let uncertified = Region { certified: false, ..region() };
    assert!(failures(&[uncertified], &trajectory())[0].contains("is not certified"));
    // A region that claims too much: the finger inside the cap.
    let mut wide = region();
    wide.b[4] = -0.01;
    let mut colliding = trajectory();
    for q in colliding.segments.iter_mut().flat_map(|s| &mut s.pieces).flatten() {
        if q[2] == -0.0245 {
            q[2] = -0.0235;
        }
    }
    let found = failures(&[wide], &colliding);
    assert!(found.iter().any(|failure| failure.contains("collide at")), "{found:?}");
}

#[test]
fn a_curved_piece_is_checked_along_its_curve() {
    let mut trajectory = trajectory();
    // A detour of a control point outside the region, although the ends are inside.
    trajectory.segments[0].pieces[0].insert(1, vec![0.0, 0.3, -0.027]);
    let found = failures(&[region()], &trajectory);
    assert!(found.iter().any(|failure| failure.contains("control point 1: outside region 5")), "{found:?}");
}
