//! The same scene, options and seed give the same bytes, whatever the number of workers.

use pipeline_tests::programs::{bytes, plan};
use pipeline_tests::scenes::scene;

const OUTPUTS: [&str; 6] = [
    "miqp/plan.json",
    "gcs/trajectory.csv",
    "gcs/trajectory.json",
    "certify/regions.json",
    "certify/certificates.bin",
    "decompose/regions.json",
];

fn outputs_do_not_depend_on_workers(name: &str, certify: &str) {
    let folder = tempfile::tempdir().expect("a folder");
    let runs = ["1", "2", "4"].map(|workers| {
        let run = folder.path().join(workers);
        plan(&scene(name), &run, &["--seed", "5", "--certify", certify, "--workers", workers]).expect_code(0);
        run
    });
    for file in OUTPUTS {
        for run in &runs[1..] {
            assert!(bytes(&runs[0], file) == bytes(run, file), "{file} differs with {}", run.display());
        }
    }
}

#[test]
fn workers_do_not_change_a_plan_of_3_coordinates() {
    outputs_do_not_depend_on_workers("bottle-cap-3dof", "swept");
}

#[test]
fn workers_do_not_change_a_plan_of_4_coordinates() {
    outputs_do_not_depend_on_workers("bottle-cap-4dof", "swept");
}

#[test]
fn workers_do_not_change_what_sums_of_squares_certify() {
    outputs_do_not_depend_on_workers("bottle-cap-3dof", "sos");
}
