//! What cannot be done: exit code 1, and the reason, which ℓ failed and whether grasps or paths were missing.

use ipc_types::artefact::{PlanFile, PlanStatus, TriedStatus};
use pipeline_tests::programs::{json, plan};
use pipeline_tests::scenes::scene;
use serde_json::Value;

#[test]
fn a_turn_that_needs_more_grasps_than_allowed() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = folder.path().join("run");
    let finished = plan(&scene("bottle-cap-3dof"), &run, &["--max-grasps", "9"]).expect_code(1);
    assert!(
        finished.stderr.contains("ℓ = 1 … 9") || finished.stderr.contains("ℓ = 9"),
        "{}",
        finished.stderr
    );
    assert!(finished.stderr.contains("infeasible"), "{}", finished.stderr);
    let answer: PlanFile = json(&run, "miqp/plan.json");
    assert_eq!(answer.status, PlanStatus::Infeasible);
    assert_eq!((answer.n_grasps, answer.configurations), (None, None));
    assert_eq!(answer.tried.len(), 9);
    assert!(
        answer.tried.iter().all(|tried| tried.status == TriedStatus::Infeasible && !tried.reason.is_empty())
    );
    let record: Value = json(&run, "run.json");
    assert_eq!(record["outcome"]["exit_code"], 1);
    assert!(
        std::fs::read_to_string(run.join("report.html")).expect("a report").contains("within these regions")
    );
}

#[test]
fn an_obstacle_across_the_only_way() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = folder.path().join("run");
    let finished = plan(&scene("two-rooms-closed"), &run, &["--json"]).expect_code(1);
    let summary: Value = serde_json::from_str(&finished.stdout).expect("JSON on standard output");
    let message = summary["outcome"]["message"].as_str().expect("a message");
    assert!(message.contains("grasp") || message.contains("path"), "{message}");
    let answer: PlanFile = json(&run, "miqp/plan.json");
    assert_eq!(answer.status, PlanStatus::Infeasible);
    assert_eq!(answer.tried.len(), 3);
}
