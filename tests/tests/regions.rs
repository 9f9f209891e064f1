//! `regrasp regions`: regions and certificates without a plan, and the clearance that they keep.

use ipc_types::artefact::{CertificatesFile, RegionsFile};
use ipc_types::store;
use pipeline_tests::programs::{Finished, Word, bytes, json, plan, run, stage_alone};
use pipeline_tests::scenes::scene;
use serde_json::{Value, json};
use std::path::Path;

/// Two of the IRIS seeds of the arm: above the shelf and in its top.
const ABOVE_SHELF: &str = "0.000064,0.471953,-0.000149,-0.671673,0.000185,0.42617,1.570692";
const TOP_SHELF: &str = "-0.000155,0.397273,0.00022,-1.367476,0.000247,-0.192952,1.570469";

fn regions(scene_name: &str, out: &Path, further: &[&str]) -> Finished {
    let scene = scene(scene_name);
    let mut arguments: Vec<Word<'_>> = vec![&"regions", &scene, &"--out", &out];
    arguments.extend(further.iter().map(|word| word as Word<'_>));
    run("regrasp", &arguments)
}

fn check(run_folder: &Path) -> Finished {
    run("regrasp", &[&"check", &run_folder])
}

/// Replaces a value of `run.json`, as whoever claims something else would.
fn claim(run_folder: &Path, field: &str, value: Value) {
    let mut record: Value = json(run_folder, "run.json");
    record[field] = value;
    std::fs::write(run_folder.join("run.json"), record.to_string()).expect("run.json is written");
}

#[test]
fn regions_of_a_scene_without_a_task_are_certified_and_checked() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    let further = ["--region-at", ABOVE_SHELF, "--region-at", TOP_SHELF, "--radius", "0.05", "--json"];
    let made = regions("iiwa14-shelf", &out, &further).expect_code(0);
    let summary: Value = serde_json::from_str(&made.stdout).expect("JSON on standard output");
    assert_eq!((&summary["asked"], &summary["certified_regions"]), (&json!("regions"), &json!(2)));
    assert!(made.stderr.contains("2 regions around 2 configurations; 2 certified"), "{}", made.stderr);
    let accepted = check(&out).expect_code(0);
    assert!(accepted.stderr.contains("accepted: 2 regions proven free by"), "{}", accepted.stderr);
    let report = String::from_utf8(bytes(&out, "report.html")).expect("a report in UTF-8");
    assert!(report.contains("2 regions are certified</strong>"));
    for absent in ["miqp", "gcs", "certify/parts"] {
        assert!(!out.join(absent).exists(), "{absent}");
    }
    // Every region holds its configuration, inside its box.
    let file: RegionsFile = json(&out, "certify/regions.json");
    for (region, seed) in file.regions.iter().zip([ABOVE_SHELF, TOP_SHELF]) {
        let q: Vec<f64> = seed.split(',').map(|q| q.parse().expect("a number")).collect();
        assert!(pipeline_tests::polytope_samples::Walk::excess(region, &q) <= 0.0);
        let center = region.center.iter().zip(&q);
        assert!(center.clone().count() == 7 && center.into_iter().all(|(c, q)| (c - q).abs() <= 0.05));
    }

    run("regrasp", &[&"rerun", &out, &"--stage", &"certify", &"--onward"]).expect_code(0);
    check(&out).expect_code(0);
    let refused = run("regrasp", &[&"rerun", &out, &"--stage", &"miqp"]).expect_code(2);
    assert!(refused.stderr.contains("run of regions, which ends with certify"), "{}", refused.stderr);

    // A run of regions is not to pass for a plan, nor one with a plan for regions.
    claim(&out, "asked", json!("plan"));
    let refused = check(&out).expect_code(1);
    assert!(refused.stderr.contains("task names none of the scene"), "{}", refused.stderr);
    claim(&out, "asked", json!("regions"));
    std::fs::create_dir(out.join("gcs")).expect("a folder");
    let refused = check(&out).expect_code(1);
    assert!(refused.stderr.contains("asked is regions, but there is gcs/"), "{}", refused.stderr);
}

/// The task of the scene is nobody's business then, and what certification takes is grown again.
#[test]
fn a_cover_is_certified_to_the_share_that_was_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("run");
    regions("bottle-cap-4dof", &out, &["--cover", "--coverage", "0.9"]).expect_code(0);
    check(&out).expect_code(0);
    let status: Value = json(&out, "decompose/status.json");
    let low = status["details"]["certified_CS_free"][1].as_f64();
    assert!(low.is_some_and(|low| low >= 0.9), "{status}");
    let file: RegionsFile = json(&out, "decompose/regions.json");
    let coverage = file.coverage.expect("a coverage");
    assert!(coverage.grasp.is_none() && coverage.placement.is_none(), "no task is asked after");
    let refused =
        regions("bottle-cap-4dof", &folder.path().join("two"), &["--cover", "--region-at", "0,0,0,0.05"]);
    assert!(refused.expect_code(2).stderr.contains("domain-radius"));
}

#[test]
fn workers_make_no_difference_and_a_plan_still_needs_a_task() {
    let folder = tempfile::tempdir().expect("a folder");
    let [one, three] = ["1", "3"].map(|workers| {
        let out = folder.path().join(workers);
        regions("slider-gap", &out, &["--workers", workers]).expect_code(0);
        check(&out).expect_code(0);
        out
    });
    for file in ["regions.bin", "regions.json", "certificates.bin"] {
        assert!(bytes(&one.join("certify"), file) == bytes(&three.join("certify"), file), "{file}");
    }
    let out = folder.path().join("plan");
    let refused = plan(&scene("slider-gap"), &out, &[]).expect_code(2);
    assert!(refused.stderr.contains("has no task"), "{}", refused.stderr);
    let refused = regions("slider-gap", &out, &["--set", "gcs.order=3"]).expect_code(2);
    assert!(refused.stderr.contains("gcs is not run"), "{}", refused.stderr);
    let uncertified = folder.path().join("uncertified");
    regions("slider-gap", &uncertified, &["--certify", "none"]).expect_code(0);
    assert!(check(&uncertified).expect_code(1).stderr.contains("no region is certified"));
}

/// The cube in the gap has 0.1 m on either side of it: just less is certified, just more is not.
#[test]
fn a_known_gap_decides_what_clearance_regions_have() {
    let folder = tempfile::tempdir().expect("a folder");
    let made = |name: &str, clearance: &str, code: i32| {
        let out = folder.path().join(name);
        let finished =
            regions("slider-gap", &out, &["--region-at", "0,0", "--clearance", clearance]).expect_code(code);
        (out, finished)
    };
    let (below, _) = made("below", "0.0999", 0);
    let accepted = check(&below).expect_code(0);
    assert!(accepted.stderr.contains("with a clearance of 0.0999 m"), "{}", accepted.stderr);
    let file: RegionsFile = json(&below, "certify/regions.json");
    // |lift| is at most what the gap leaves.
    assert!(file.regions.iter().all(|region| region.margin == 0.0999));
    let (_, above) = made("above", "0.1001", 2);
    assert!(above.stderr.contains("slider/cube and lower_box are in collision"), "{}", above.stderr);

    // A region that was grown without clearance: the certifier alone refuses it above, and cuts it below.
    let (without, _) = made("without", "0", 0);
    let certify = |name: &str, clearance: &str| {
        let out = folder.path().join(name);
        stage_alone("certify", &scene("slider-gap"), &without, &out, &["--clearance", clearance])
    };
    let refused = certify("alone-above", "0.1001").expect_code(1);
    assert!(refused.stderr.contains("0 of 1 candidates certified"), "{}", refused.stderr);
    certify("alone-below", "0.05").expect_code(0);
    let cut: RegionsFile = json(&folder.path().join("alone-below"), "regions.json");
    for corner in [[0.0, 0.0501], [0.0, -0.0501]] {
        assert!(pipeline_tests::polytope_samples::Walk::excess(&cut.regions[0], &corner) > 0.0);
    }

    // Less is certified than is claimed: by the record alone, and by the certificates as well.
    claim(&below, "clearance", json!(0.09991));
    let refused = check(&below).expect_code(1);
    let words = "certified for a clearance of 0.0999 m, asked for are 0.09991 m";
    assert!(refused.stderr.contains(words), "{}", refused.stderr);
    let (bin, certify) = (below.join("certify/certificates.bin"), below.join("certify"));
    let mut forged: CertificatesFile = store::read_bin(&bin, None).expect("certificates");
    let digest = scene::Scene::load(&below.join("scene")).expect("the copy of the scene").digest;
    forged.regions.iter_mut().flat_map(|region| &mut region.pairs).for_each(|pair| pair.clearance = 0.15);
    store::write_bin(&certify, "certificates", &forged, &digest).expect("the forgery");
    claim(&below, "clearance", json!(0.15));
    let refused = check(&below).expect_code(1);
    assert!(refused.stderr.contains("which does not exceed 1.5e-1 m"), "{}", refused.stderr);
}

/// The tip that pushes the block has 0.11 m to the wall at the most, where it touches the block.
#[test]
fn a_known_gap_decides_whether_there_is_a_plan() {
    let folder = tempfile::tempdir().expect("a folder");
    let (below, above) = (folder.path().join("below"), folder.path().join("above"));
    plan(&scene("two-rooms"), &below, &["--clearance", "0.105"]).expect_code(0);
    let accepted = check(&below).expect_code(0);
    assert!(accepted.stderr.contains("with a clearance of 0.105 m"), "{}", accepted.stderr);
    plan(&scene("two-rooms"), &above, &["--clearance", "0.1105"]).expect_code(1);
    claim(&below, "clearance", json!(0.11));
    let refused = check(&below).expect_code(1);
    assert!(refused.stderr.contains("asked for are 0.11 m"), "{}", refused.stderr);
}
