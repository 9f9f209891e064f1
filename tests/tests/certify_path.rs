//! `regrasp certify-path` and `regrasp-check --path`: paths of other planners, from file to verdict.

use pipeline_tests::programs::{Finished, Word, json, run};
use pipeline_tests::scenes::scene;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

fn written(folder: &Path, name: &str, text: &str) -> PathBuf {
    let file = folder.join(name);
    std::fs::write(&file, text).expect("the path is written");
    file
}

fn certify(scene_name: &str, path: &Path, further: &[&str]) -> Finished {
    let scene = scene(scene_name);
    let mut arguments: Vec<Word<'_>> = vec![&"certify-path", &scene, &path];
    arguments.extend(further.iter().map(|word| word as Word<'_>));
    run("regrasp", &arguments)
}

fn check(scene_name: &str, certificate: &Path, path: &Path, further: &[&str]) -> Finished {
    let scene = scene(scene_name);
    let mut arguments: Vec<Word<'_>> = vec![&"--path", &certificate, &"--scene", &scene, &path];
    arguments.extend(further.iter().map(|word| word as Word<'_>));
    run("regrasp-check", &arguments)
}

/// From above the shelf upwards and to the side, with columns in another order than the scene's.
const SHELF: &str = "joint_7,joint_1,joint_2,joint_3,joint_4,joint_5,joint_6,t
1.570692,0.000064,0.471953,-0.000149,-0.671673,0.000185,0.42617,0
1.57,0.0,0.2,0.0,-1.0,0.0,0.3,1
1.57,0.5,-0.2,0.0,-1.0,0.0,0.3,2
";

#[test]
fn a_path_is_certified_and_its_certificate_checked() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = written(folder.path(), "path.csv", SHELF);
    let out = folder.path().join("proof");
    let out_word = out.to_str().expect("a name in UTF-8");
    let printed = certify("iiwa14-shelf", &path, &["--json", "--out", out_word]).expect_code(0);
    let report: Value = serde_json::from_str(&printed.stdout).expect("JSON");
    assert_eq!((&report["certified"], &report["n_certified"]), (&json!(true), &json!(2)));
    for file in ["path.bin", "path.json"] {
        let accepted = check("iiwa14-shelf", &out.join(file), &path, &[]).expect_code(0);
        assert!(accepted.stderr.contains("2 pieces proven free against 324 pairs"), "{}", accepted.stderr);
    }
    let more = check("iiwa14-shelf", &out.join("path.bin"), &path, &["--clearance", "0.001"]).expect_code(1);
    assert!(more.stderr.contains("0.001 m are asked for"), "{}", more.stderr);
    let other = written(folder.path(), "other.csv", &SHELF.replace("-0.2,", "-0.21,"));
    let rejected = check("iiwa14-shelf", &out.join("path.bin"), &other, &[]).expect_code(1);
    assert!(rejected.stderr.contains("not the piece of the path"), "{}", rejected.stderr);
    let foreign = check("two-iiwa14", &out.join("path.bin"), &path, &[]).expect_code(2);
    assert!(foreign.stderr.contains("joint_7"), "{}", foreign.stderr);
    for (field, value, words) in [
        ("/pieces/0/intervals/0/0/normal", json!([0.0, 0.0, 0.0]), "not proven apart"),
        ("/pieces/1/intervals/9/0/t_1", json!(0.4999), "piece 1"),
        ("/pieces/1/intervals/9", json!([]), "nothing is proven"),
        ("/pieces/0/intervals", json!([]), "piece 0 is not certified"),
        ("/pieces/0/control_points/1/3", json!(-1.5), "not the piece of the path"),
        ("/pairs/7/body_b", json!(3), "pair 7"),
        ("/pairs/7/clearance", json!(5.0), "not proven apart"),
    ] {
        let mut damaged: Value = json(&out, "path.json");
        *damaged.pointer_mut(field).unwrap_or_else(|| panic!("no {field}")) = value;
        let file = written(folder.path(), "damaged.json", &damaged.to_string());
        let rejected = check("iiwa14-shelf", &file, &path, &[]).expect_code(1);
        assert!(rejected.stderr.contains(words), "{field}: {}", rejected.stderr);
    }
    let mut bytes = std::fs::read(out.join("path.bin")).expect("the certificate");
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    let flipped = folder.path().join("flipped.bin");
    std::fs::write(&flipped, bytes).expect("the damaged certificate");
    assert!(check("iiwa14-shelf", &flipped, &path, &[]).expect_code(1).stderr.contains("digest"));
}

#[test]
fn the_first_piece_that_is_not_certified_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = written(folder.path(), "path.csv", "lift,slide\n0,-0.3\n0.05,-0.25\n0.3,0\n0.3,0.3\n");
    let out = folder.path().join("proof");
    let out_word = out.to_str().expect("a name in UTF-8");
    let printed = certify("slider-gap", &path, &["--json", "--out", out_word]).expect_code(1);
    let report: Value = serde_json::from_str(&printed.stdout).expect("JSON");
    assert_eq!(report["first_failure"], json!(1));
    assert_eq!(report["pieces"][1]["verdict"], json!("collision"));
    assert_eq!(report["pieces"][1]["obstruction"]["body_b"], json!("upper_box"));
    for words in ["piece 1 (line 3)", "upper_box overlap", "t = ", "q = ["] {
        assert!(printed.stderr.contains(words), "{}", printed.stderr);
    }
    let rejected = check("slider-gap", &out.join("path.bin"), &path, &[]).expect_code(1);
    assert!(rejected.stderr.contains("piece 1 is not certified"), "{}", rejected.stderr);
}

#[test]
fn curves_and_clearance() {
    let folder = tempfile::tempdir().expect("a folder");
    // Straight through the gap of half-width 0.1, with a bend of 0.05 at most.
    let text = r#"{"coordinates": ["slide", "lift"], "segments": [{"pieces": [[[-0.3, 0.0], [0.0, 0.1], [0.3, 0.0]]]}]}"#;
    let path = written(folder.path(), "trajectory.json", text);
    let out = folder.path().join("proof");
    let out_word = out.to_str().expect("a name in UTF-8");
    certify("slider-gap", &path, &["--clearance", "0.0499", "--out", out_word]).expect_code(0);
    check("slider-gap", &out.join("path.bin"), &path, &["--clearance", "0.0499"]).expect_code(0);
    let closer = certify("slider-gap", &path, &["--clearance", "0.0501"]).expect_code(1);
    assert!(closer.stderr.contains("asked for are 0.0501 m"), "{}", closer.stderr);
}

#[test]
fn a_transfer_of_another_planner_is_certified_and_a_slip_is_not() {
    let folder = tempfile::tempdir().expect("a folder");
    let header = "mode,gripper,cap,left_finger";
    let grasp = format!("{header}\ntransfer,-0.8,-3,-0.0245\ntransfer,-0.65,-2.85,-0.0245\n");
    let path = written(folder.path(), "grasp.csv", &grasp);
    let out = folder.path().join("proof");
    let out_word = out.to_str().expect("a name in UTF-8");
    let held = certify("bottle-cap-3dof", &path, &["--task", "open", "--out", out_word]).expect_code(0);
    assert!(held.stderr.contains("kept forms change by at most"), "{}", held.stderr);
    check("bottle-cap-3dof", &out.join("path.bin"), &path, &[]).expect_code(0);
    let path = written(folder.path(), "slip.csv", &grasp.replace("-2.85", "-2.86"));
    let slip = certify("bottle-cap-3dof", &path, &["--task", "open"]).expect_code(1);
    assert!(slip.stderr.contains("form 0 that task open keeps in transfer changes by"), "{}", slip.stderr);
    // Without a task nothing is held, and the motion itself is free.
    certify("bottle-cap-3dof", &path, &[]).expect_code(0);
    let contact = written(folder.path(), "contact.csv", &grasp.replace("-0.0245", "-0.024"));
    let touching = certify("bottle-cap-3dof", &contact, &["--task", "open"]).expect_code(1);
    assert!(touching.stderr.contains("neither provably apart nor closer"), "{}", touching.stderr);
}

#[test]
fn bad_paths_are_bad_input() {
    let folder = tempfile::tempdir().expect("a folder");
    for (text, words) in [
        ("slide,lift\n0.3,NaN\n", ["path.csv:2", "`lift`", "`NaN`"]),
        ("slide,lift\n0.3,0\n0.3\n", ["path.csv:3", "1 fields", "expected 2"]),
        ("slide\n0.3\n", ["path.csv:1", "`lift`", "missing"]),
        ("slide,lift,tilt\n0.3,0,0\n", ["path.csv:1", "`tilt`", "unknown column"]),
        ("", ["path.csv", "empty", "header"]),
    ] {
        let path = written(folder.path(), "path.csv", text);
        let refused = certify("slider-gap", &path, &[]).expect_code(2);
        for word in words {
            assert!(refused.stderr.contains(word), "{}", refused.stderr);
        }
    }
    certify("slider-gap", &folder.path().join("missing.csv"), &[]).expect_code(2);
    let path = written(folder.path(), "path.csv", "slide,lift\n0.3,0\n");
    certify("slider-gap", &path, &["--task", "nothing"]).expect_code(2);
}

/// A block that hangs on the tip, 0.08 to its right, is carried past the wall, whose end is at 0.2.
const CARRY: &str = "block,pusher_x,pusher_y
-0.22,-0.3,0.0725
-0.22,-0.09,TOP
";
const HOLD: &str = "block/block=pusher/tip@0";

#[test]
fn what_is_attached_moves_with_the_gripper_whatever_its_coordinates_say() {
    let folder = tempfile::tempdir().expect("a folder");
    let high = written(folder.path(), "high.csv", &CARRY.replace("TOP", "0.3"));
    // The block that stays on its rail is not in the way, the one that is carried is.
    certify("two-rooms", &high, &[]).expect_code(0);
    let refused = certify("two-rooms", &high, &["--attach", HOLD]).expect_code(1);
    for words in ["block/block and wall", "held: block/block by pusher/tip on pieces 0 to 0"] {
        assert!(refused.stderr.contains(words), "{}", refused.stderr);
    }
    // Carried up to 0.2 it ends 0.05 + 0.2 − 0.0725 = 0.1775 high, 0.0225 below the wall.
    let low = written(folder.path(), "low.csv", &CARRY.replace("TOP", "0.2"));
    let closer = certify("two-rooms", &low, &["--attach", HOLD, "--clearance", "0.0226"]).expect_code(1);
    assert!(closer.stderr.contains("block/block and wall are"), "{}", closer.stderr);
    let out = folder.path().join("proof");
    let words = ["--attach", HOLD, "--clearance", "0.0224", "--out", out.to_str().expect("UTF-8")];
    certify("two-rooms", &low, &words).expect_code(0);
    for file in ["path.bin", "path.json"] {
        let accepted = check("two-rooms", &out.join(file), &low, &["--clearance", "0.0224"]).expect_code(0);
        assert!(accepted.stderr.contains("held: block/block by pusher/tip"), "{}", accepted.stderr);
    }
    for (field, value, words) in [
        ("/attachments/0/translation/0", json!(0.0811), "from where the path has it"),
        ("/attachments/0/rotation", json!([0.0, 0.0, 0.001, 1.0]), "from where the path has it"),
        ("/attachments/0/rotation", json!([0.0, 0.0, 0.0, 0.0]), "not finite numbers"),
        ("/attachments/0/object", json!("block/brick"), "there is no link block/brick"),
        ("/attachments/0/gripper", json!("wall"), "role robot"),
        ("/attachments/0/last", json!(1), "not of the path"),
        ("/attachments/0/grasp", json!([]), "piece 0 is not certified"),
        ("/attachments/0/grasp/0", json!([]), "nothing is proven"),
        ("/attachments/0/pairs/0/clearance", json!(-1.0), "asked for"),
        ("/attachments/0/pairs", json!([]), "pair 0"),
        ("/attachments", json!([]), "piece 0 is not certified"),
    ] {
        let mut damaged: Value = json(&out, "path.json");
        *damaged.pointer_mut(field).unwrap_or_else(|| panic!("no {field}")) = value;
        let file = written(folder.path(), "damaged.json", &damaged.to_string());
        let rejected = check("two-rooms", &file, &low, &[]).expect_code(1);
        assert!(rejected.stderr.contains(words), "{field}: {}", rejected.stderr);
    }
    for (words, expected) in [
        (["--attach", "block/block"], "OBJECT_LINK=GRIPPER_LINK@FIRST..LAST"),
        (["--attach", "block/brick=pusher/tip"], "no link block/brick; the links are"),
        (["--attach", "pusher/tip=pusher/tip"], "role object"),
        (["--attach", "block/block=pusher/tip@1..2"], "pieces 1 to 2, but the path has pieces 0 to 0"),
    ] {
        let refused = certify("two-rooms", &low, &words).expect_code(2);
        assert!(refused.stderr.contains(expected), "{}", refused.stderr);
    }
}

/// A planner that rounds its numbers: what is held is put down a little beside where the path has it.
#[test]
fn a_transfer_that_does_not_keep_its_forms_is_certified_as_attached() {
    let folder = tempfile::tempdir().expect("a folder");
    let table = "mode,gripper,cap,left_finger
transit,-0.8,-3,-0.03
transfer,-0.8,-3,-0.0245
transit,-0.65,CAP,-0.0245
transit,-0.65,CAP,-0.03
";
    // The cap follows by 0.15; the path says 0.1498.
    let path = written(folder.path(), "path.csv", &table.replace("CAP", "-2.8502"));
    let slip = certify("bottle-cap-3dof", &path, &["--task", "open"]).expect_code(1);
    assert!(slip.stderr.contains("form 0 that task open keeps in transfer changes by"), "{}", slip.stderr);
    let attach = ["--task", "open", "--attach", "cap/cap=gripper/wsg_body@1..1"];
    let refused = certify("bottle-cap-3dof", &path, &attach).expect_code(1);
    assert!(refused.stderr.contains("piece 1 (line 3): what is held is"), "{}", refused.stderr);
    let out = folder.path().join("proof");
    let further = ["--tol-held", "1e-5", "--out", out.to_str().expect("UTF-8")];
    certify("bottle-cap-3dof", &path, &[&attach[..], &further].concat()).expect_code(0);
    let certificate = out.join("path.bin");
    let refused = check("bottle-cap-3dof", &certificate, &path, &[]).expect_code(1);
    assert!(refused.stderr.contains("at most 1e-6 m are accepted"), "{}", refused.stderr);
    check("bottle-cap-3dof", &certificate, &path, &["--tol-held", "1e-5"]).expect_code(0);
    let exact = written(folder.path(), "exact.csv", &table.replace("CAP", "-2.85"));
    let out = folder.path().join("exact");
    let further = ["--out", out.to_str().expect("UTF-8")];
    certify("bottle-cap-3dof", &exact, &[&attach[..], &further].concat()).expect_code(0);
    check("bottle-cap-3dof", &out.join("path.bin"), &exact, &[]).expect_code(0);
}
