//! Bad input ends with exit code 2 and a few lines that name file, field, value and remedy; no backtrace, no run.

use pipeline_tests::programs::{Finished, plan, run, stage_alone};
use pipeline_tests::scenes::{Change, changed, scene};
use std::path::Path;

/// Changes of a scene, and words that the message must hold: the file, the field, the value.
const CASES: [(&str, Change<'_>, &[&str]); 16] = [
    (
        "bottle-cap-3dof",
        Change { file: "scene.toml", from: "cap.urdf", to: "none.urdf" },
        &["scene.toml", "urdf", "none.urdf"],
    ),
    (
        "bottle-cap-3dof",
        Change { file: "scene.toml", from: "format = 1", to: "format = 1\ncolour = 3" },
        &["scene.toml", "colour"],
    ),
    (
        "bottle-cap-3dof",
        Change { file: "scene.toml", from: "bounds = { left_finger =", to: "bounds = { thumb =" },
        &["scene.toml", "bounds", "thumb"],
    ),
    (
        "bottle-cap-3dof",
        Change {
            file: "scene.toml",
            from: "{ gripper = 1.0, cap = -1.0 }",
            to: "{ wrist = 1.0, cap = -1.0 }",
        },
        &["scene.toml", "keep", "wrist"],
    ),
    (
        "bottle-cap-3dof",
        Change { file: "scene.toml", from: "[-0.025, -0.024]", to: "[-0.024, -0.025]" },
        &["scene.toml", "left_finger", "-0.024", "-0.025"],
    ),
    (
        "bottle-cap-3dof",
        Change { file: "scene.toml", from: "[-0.025, -0.024]", to: "[nan, -0.024]" },
        &["scene.toml", "left_finger", "NaN"],
    ),
    (
        "bottle-cap-3dof",
        Change {
            file: "scene.toml",
            from: "start = [-3.14, -0.78, -0.025]",
            to: "start = [-3.14, 0.0, -0.025]",
        },
        &["scene.toml", "start"],
    ),
    (
        "bottle-cap-3dof",
        Change { file: "scene.toml", from: "goal = [3.14, -0.78, -0.03]", to: "goal = [3.14, 0.0, -0.03]" },
        &["scene.toml", "goal"],
    ),
    (
        "bottle-cap-3dof",
        Change { file: "scene.toml", from: "goal = [3.14, -0.78, -0.03]", to: "goal = [3.2, -0.78, -0.03]" },
        &["scene.toml", "goal", "3.2"],
    ),
    (
        "bottle-cap-3dof",
        Change {
            file: "scene.toml",
            from: "placement = {}",
            to: "placement = { bounds = { cap = [-3.14, 0.0] } }",
        },
        &["scene.toml", "goal"],
    ),
    (
        "bottle-cap-3dof",
        Change {
            file: "scene.toml",
            from: "grasp = { bounds = { left_finger = [-0.025, -0.024] } }",
            to: "grasp = { bounds = { left_finger = [-0.025, -0.024] }, rows = [{ form = { left_finger = 1.0 }, lower = -0.01, upper = 0.0 }] }",
        },
        &["scene.toml", "grasp"],
    ),
    (
        "bottle-cap-3dof",
        Change { file: "scene.toml", from: "cylinder = { radius = 0.007", to: "cylinder = { radius = 0.0" },
        &["scene.toml", "radius", "0"],
    ),
    (
        "bottle-cap-3dof",
        Change { file: "cap.urdf", from: "<cylinder", to: "<mesh filename=\"cap.stl\"/><cylinder" },
        &["cap.urdf"],
    ),
    (
        "bottle-cap-3dof",
        Change { file: "cap.urdf", from: "type=\"revolute\"", to: "type=\"continuous\"" },
        &["scene.toml", "cap", "limits"],
    ),
    (
        "bottle-cap-3dof",
        Change { file: "cap.urdf", from: "type=\"revolute\"", to: "type=\"floating\"" },
        &["cap.urdf", "floating"],
    ),
    (
        "two-rooms",
        Change { file: "scene.toml", from: "max_grasps = 3", to: "max_grasps = 0" },
        &["scene.toml", "max_grasps", "0"],
    ),
];

/// A message of a few lines and nothing of the program's insides.
#[track_caller]
fn judge_message(finished: Finished, words: &[&str]) {
    let finished = finished.expect_code(2);
    let message = &finished.stderr;
    for word in words {
        assert!(message.contains(word), "no `{word}` in:\n{message}");
    }
    for inside in ["panicked", "backtrace", "RUST_BACKTRACE", "unwrap"] {
        assert!(!message.contains(inside), "{message}");
    }
    assert!(message.lines().count() <= 6, "too much is said:\n{message}");
}

#[test]
fn a_bad_scene_is_refused_and_leaves_no_run() {
    let folder = tempfile::tempdir().expect("a folder");
    for (idx, (name, change, words)) in CASES.iter().enumerate() {
        let copy = changed(name, &folder.path().join(idx.to_string()), change);
        let out = folder.path().join(format!("run-{idx}"));
        judge_message(plan(&copy, &out, &[]), words);
        assert!(!out.exists(), "a refused scene left {}", out.display());
    }
}

#[test]
fn a_missing_scene_an_unknown_task_and_a_taken_directory_are_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    judge_message(plan(Path::new("scenes/none"), &out, &[]), &["scenes/none"]);
    judge_message(plan(&scene("two-rooms"), &out, &["--task", "fly"]), &["task", "fly", "carry"]);
    judge_message(plan(&scene("hinge"), &out, &[]), &["hinge", "task"]);
    judge_message(plan(&scene("two-rooms"), folder.path(), &[]), &["--out", "exists already"]);
    judge_message(plan(&scene("two-rooms"), &out, &["--set", "paint.colour=red"]), &["--set", "paint"]);
    judge_message(
        plan(&scene("two-rooms"), &out, &["--stage", "gcs=/none/at/all"]),
        &["gcs", "/none/at/all"],
    );
    judge_message(plan(&scene("two-rooms"), &out, &["--set", "gcs.colour=red"]), &["gcs", "colour"]);
    assert!(!out.exists());
}

#[test]
fn what_is_no_run_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    for command in ["rerun", "profile"] {
        judge_message(run("regrasp", &[&command, &here, &"--stage", &"gcs"]), &["run.json"]);
    }
    for command in ["report", "check"] {
        judge_message(run("regrasp", &[&command, &here]), &["run.json"]);
    }
    let file = here.join("x.bin");
    judge_message(run("regrasp", &[&"show", &file]), &["x.bin"]);
    std::fs::write(&file, "no artefact").expect("a file");
    judge_message(run("regrasp", &[&"show", &file]), &["x.bin", "REGRASP"]);
}

#[test]
fn a_run_of_another_scene_is_refused_by_every_stage() {
    let folder = tempfile::tempdir().expect("a folder");
    let planned = folder.path().join("run");
    plan(&scene("two-rooms"), &planned, &[]).expect_code(0);
    let moved = Change { file: "scene.toml", from: "xyz = [0.0, 0.4, 0.0]", to: "xyz = [0.001, 0.4, 0.0]" };
    let other = changed("two-rooms", folder.path(), &moved);
    for stage in ["certify", "miqp", "gcs"] {
        let out = folder.path().join(format!("{stage}-out"));
        let finished = stage_alone(stage, &other, &planned, &out, &[]);
        judge_message(finished, &["another scene", ".bin"]);
    }
}
