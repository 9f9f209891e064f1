//! A run that begins with the regions and certificates of another, whose scene was a little different.

use pipeline_tests::judge::Judge;
use pipeline_tests::programs::{Word, json, plan, run};
use pipeline_tests::scenes::scene;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The scene with its first obstacle a centimetre further out.
fn moved(folder: &Path, name: &str) -> PathBuf {
    let moved = folder.join("moved");
    std::fs::create_dir(&moved).expect("a folder");
    for entry in std::fs::read_dir(scene(name)).expect("the scene's folder") {
        let file = entry.expect("an entry");
        std::fs::copy(file.path(), moved.join(file.file_name())).expect("a copy");
    }
    let toml = moved.join("scene.toml");
    let text = std::fs::read_to_string(&toml).expect("the scene");
    let changed = text.replace("xyz = [0.01, 0.035, 0.02]", "xyz = [0.01, 0.045, 0.02]");
    assert_ne!(text, changed, "the obstacle stands where it did");
    std::fs::write(&toml, changed).expect("the scene");
    moved
}

#[test]
fn after_an_obstacle_moved_what_still_holds_is_verified_and_the_rest_made_anew() {
    let folder = tempfile::tempdir().expect("a folder");
    let (before, after) = (folder.path().join("before"), folder.path().join("after"));
    plan(&scene("bottle-cap-4dof"), &before, &[]).expect_code(0);
    let moved = moved(folder.path(), "bottle-cap-4dof");
    plan(&moved, &after, &["--extend", before.to_str().expect("a path in UTF-8")]).expect_code(0);

    let decompose: Value = json(&after, "decompose/status.json");
    let count = |key: &str| decompose["details"][key].as_u64().unwrap_or(0);
    assert!(count("earlier_regions_free") > 0, "{decompose}");
    let record: Value = json(&after, "run.json");
    assert_eq!(record["acceptance"]["accepted"], true);

    // All certificates are of the new scene, by another program than the one that used them again.
    let arguments: Vec<Word<'_>> = vec![&"check", &after];
    run("regrasp", &arguments).expect_code(0);
    let judge = Judge::new(&moved, &after);
    judge.judge_motion();
    assert_eq!(judge.colliding_samples(), 0);
}

#[test]
fn a_run_that_cannot_be_extended_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    let nowhere = folder.path().join("nowhere");
    let finished = plan(&scene("bottle-cap-3dof"), &out, &["--extend", nowhere.to_str().expect("UTF-8")]);
    let said = finished.expect_code(2).stderr;
    assert!(said.contains("--extend") && said.contains("nowhere"), "{said}");

    // A run of a scene with other coordinates.
    plan(&scene("bottle-cap-3dof"), &out, &[]).expect_code(0);
    let other = folder.path().join("other");
    let finished = plan(&scene("bottle-cap-4dof"), &other, &["--extend", out.to_str().expect("UTF-8")]);
    let said = finished.expect_code(2).stderr;
    assert!(said.contains("coordinates"), "{said}");
}
