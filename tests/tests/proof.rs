//! The independent verifier: it accepts good runs, and of each kind of damage it says what does not hold.

#[path = "proof/answer_damage.rs"]
mod answer_damage;
#[path = "proof/certificate_damage.rs"]
mod certificate_damage;
#[path = "proof/damage.rs"]
mod damage;

use damage::{Damage, all_damages};
use pipeline_tests::programs::{Finished, plan, program};
use pipeline_tests::scenes::scene;
use std::path::Path;

fn check(run: &Path) -> Finished {
    program("regrasp-check").arg(run).output().expect("the verifier runs").into()
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).expect("a folder for the copy");
    for entry in std::fs::read_dir(from).expect("a run directory") {
        let path = entry.expect("an entry of the run").path();
        let target = to.join(path.file_name().expect("a file has a name"));
        if path.is_dir() {
            copy(&path, &target);
        } else {
            std::fs::copy(&path, &target).expect("the copy is written");
        }
    }
}

#[test]
fn a_good_run_is_accepted_and_every_damage_to_it_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let good = folder.path().join("good");
    plan(&scene("bottle-cap-3dof"), &good, &[]).expect_code(0);
    let accepted = check(&good).expect_code(0);
    assert!(accepted.stderr.contains("accepted"), "{}", accepted.stderr);

    let damages = all_damages();
    assert!(damages.len() >= 80, "{} kinds of damage", damages.len());
    let mut wrong = Vec::new();
    for Damage { name, apply, expected } in damages {
        let run = folder.path().join("damaged");
        copy(&good, &run);
        apply(&run);
        let answer = check(&run);
        if answer.code != Some(1) || !answer.stderr.contains(expected) {
            wrong.push(format!(
                "{name}: expected `{expected}`, exit 1; got exit {:?}: {}",
                answer.code, answer.stderr
            ));
        }
        std::fs::remove_dir_all(&run).expect("the copy is removed");
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_run_without_certificates_proves_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = folder.path().join("run");
    plan(&scene("two-rooms"), &run, &["--certify", "none"]).expect_code(0);
    let answer = check(&run).expect_code(1);
    assert!(answer.stderr.contains("no region is certified"), "{}", answer.stderr);
}

#[test]
fn what_is_no_run_is_bad_input() {
    let folder = tempfile::tempdir().expect("a folder");
    let answer = check(folder.path()).expect_code(2);
    assert!(answer.stderr.contains("run.json"), "{}", answer.stderr);
}
