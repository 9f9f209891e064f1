//! One stage alone: on the files of a run, run again, replaced by another program, measured.

use pipeline_tests::programs::{Finished, Word, bytes, json, plan, run, stage_alone};
use pipeline_tests::scenes::scene;
use serde_json::Value;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

const SCENE: &str = "bottle-cap-3dof";

/// Outputs of each stage that must not depend on how the stage is run.
const OUTPUTS: [(&str, &[&str]); 4] = [
    ("decompose", &["regions.bin", "regions.json"]),
    ("certify", &["regions.bin", "regions.json", "certificates.bin"]),
    ("miqp", &["plan.bin", "plan.json"]),
    ("gcs", &["trajectory.bin", "trajectory.json", "trajectory.csv", "cuts.json"]),
];

fn planned(folder: &Path) -> PathBuf {
    let out = folder.join("run");
    plan(&scene(SCENE), &out, &["--seed", "3"]).expect_code(0);
    out
}

#[test]
fn a_stage_alone_gives_what_it_gave_in_the_pipeline() {
    let folder = tempfile::tempdir().expect("a folder");
    let planned = planned(folder.path());
    for (stage, files) in OUTPUTS {
        let out = folder.path().join(stage);
        stage_alone(stage, &scene(SCENE), &planned, &out, &["--seed", "3"]).expect_code(0);
        for file in files {
            assert!(bytes(&planned.join(stage), file) == bytes(&out, file), "{stage}/{file} differs");
        }
        let status: Value = json(&out, "status.json");
        assert!(status["seconds"].as_f64().is_some_and(|seconds| seconds > 0.0));
    }
}

fn rerun(planned: &Path, further: &[&str]) -> Finished {
    let mut arguments: Vec<Word<'_>> = vec![&"rerun", &planned];
    arguments.extend(further.iter().map(|word| word as Word<'_>));
    run("regrasp", &arguments)
}

fn stale(planned: &Path) -> Vec<String> {
    let record: Value = json(planned, "run.json");
    let stages = record["stages"].as_array().expect("stages");
    let stale = stages.iter().filter(|stage| stage["stale"] == true);
    stale.filter_map(|stage| stage["stage"].as_str().map(str::to_owned)).collect()
}

#[test]
fn a_stage_is_run_again_in_its_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let planned = planned(folder.path());
    let before = bytes(&planned, "gcs/trajectory.csv");
    rerun(&planned, &["--stage", "gcs"]).expect_code(0);
    assert!(before == bytes(&planned, "gcs/trajectory.csv"));
    assert!(stale(&planned).is_empty());

    rerun(&planned, &["--stage", "certify"]).expect_code(0);
    assert_eq!(stale(&planned), ["miqp", "gcs"]);
    let record: Value = json(&planned, "run.json");
    assert!(record["acceptance"].is_null(), "a stale plan must not look accepted");

    rerun(&planned, &["--stage", "certify", "--onward"]).expect_code(0);
    assert!(stale(&planned).is_empty());
    assert!(before == bytes(&planned, "gcs/trajectory.csv"));
    let record: Value = json(&planned, "run.json");
    assert_eq!(record["acceptance"]["accepted"], true);
    assert!(!planned.join("certify.new").exists());
}

#[test]
fn a_new_option_of_a_stage_takes_effect_and_is_recorded() {
    let folder = tempfile::tempdir().expect("a folder");
    let planned = planned(folder.path());
    rerun(&planned, &["--stage", "miqp", "--onward", "--set", "miqp.max_grasps=9"]).expect_code(1);
    let record: Value = json(&planned, "run.json");
    assert_eq!(record["options"]["miqp"]["max_grasps"], "9");
    assert_eq!(record["outcome"]["exit_code"], 1);
}

/// A stage in another language: it knows `--in` and `--out`, and writes no `.bin`.
fn stand_in(folder: &Path, earlier: &Path) -> PathBuf {
    let script = folder.join("stand-in.sh");
    let text = format!(
        "#!/bin/sh\nset -eu\n[ \"$1\" = run ]\nwhile [ $# -gt 0 ]; do\n  case \"$1\" in\n    --out) out=$2; shift ;;\n    --out=*) out=${{1#--out=}} ;;\n  esac\n  shift\ndone\nmkdir -p \"$out\"\ncp '{}' \"$out/plan.json\"\n",
        earlier.join("miqp/plan.json").display()
    );
    std::fs::write(&script, text).expect("a script");
    std::fs::set_permissions(&script, std::fs::Permissions::from_mode(0o755)).expect("an executable script");
    script
}

#[test]
fn another_program_takes_the_place_of_a_stage() {
    let folder = tempfile::tempdir().expect("a folder");
    let planned = planned(folder.path());
    let script = stand_in(folder.path(), &planned);
    let out = folder.path().join("with-stand-in");
    let option = format!("miqp='{}'", script.display());
    plan(&scene(SCENE), &out, &["--seed", "3", "--stage", &option]).expect_code(0);
    assert!(!out.join("miqp/plan.bin").exists(), "the stand-in writes no .bin");
    assert!(bytes(&planned, "gcs/trajectory.csv") == bytes(&out, "gcs/trajectory.csv"));
    let record: Value = json(&out, "run.json");
    assert_eq!(record["commands"]["miqp"][0], script.to_str().expect("a path of ASCII"));
    assert_eq!(record["acceptance"]["accepted"], true);
}

#[test]
fn a_stage_is_measured_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let planned = planned(folder.path());
    let before = bytes(&planned, "run.json");
    let arguments: [Word<'_>; 6] = [&"profile", &planned, &"--stage", &"miqp", &"--repeat", &"3"];
    let people = run("regrasp", &arguments).expect_code(0);
    for word in ["min", "median", "max", "wall", "CPU", "peak memory", "solver calls"] {
        assert!(people.stdout.contains(word), "{}", people.stdout);
    }
    let machine = run("regrasp", &[&arguments[..], &[&"--json"]].concat()).expect_code(0);
    let figures: Value = serde_json::from_str(&machine.stdout).expect("JSON on standard output");
    for key in ["seconds", "cpu_seconds", "peak_bytes", "solver_calls"] {
        let [min, median, max] =
            ["min", "median", "max"].map(|k| figures[key][k].as_f64().expect("a number"));
        assert!(0.0 <= min && min <= median && median <= max, "{key}: {figures}");
    }
    assert!(figures["peak_bytes"]["min"].as_f64() > Some(1e5), "{figures}");
    assert!(before == bytes(&planned, "run.json"), "profiling changed the run");
}

#[test]
fn artefacts_are_shown_as_text_and_as_json() {
    let folder = tempfile::tempdir().expect("a folder");
    let planned = planned(folder.path());
    let show = |file: &str, further: &[Word<'_>]| {
        let path = planned.join(file);
        let arguments: [Word<'_>; 2] = [&"show", &path];
        run("regrasp", &[&arguments[..], further].concat()).expect_code(0).stdout
    };
    assert!(show("miqp/plan.bin", &[]).contains("optimal, 10 grasps"));
    assert!(show("certify/regions.bin", &[]).contains("certified"));
    assert!(show("certify/certificates.bin", &[]).contains("pairs of bodies"));
    let twin: Value = json(&planned, "gcs/trajectory.json");
    let shown: Value = serde_json::from_str(&show("gcs/trajectory.bin", &[&"--json"])).expect("JSON");
    assert_eq!(shown, twin);
}
