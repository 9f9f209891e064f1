//! The independent verifier: it accepts good runs, and of each kind of damage it says what does not hold.

#[path = "proof/answer_damage.rs"]
mod answer_damage;
#[path = "proof/certificate_damage.rs"]
mod certificate_damage;
#[path = "proof/corner_damage.rs"]
mod corner_damage;
#[path = "proof/damage.rs"]
mod damage;
#[path = "proof/sum_damage.rs"]
mod sum_damage;

use damage::{Damage, all_damages};
use pipeline_tests::judge::Judge;
use pipeline_tests::programs::{Finished, Word, bytes, plan, program, run};
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
    assert!(accepted.stderr.contains("no motion has fewer than 10 grasps"), "{}", accepted.stderr);
    assert!(!accepted.stderr.contains("not verified: that"), "{}", accepted.stderr);

    let damages = all_damages();
    assert!(damages.len() >= 80, "{} kinds of damage", damages.len());
    each_is_named(folder.path(), &good, damages);
}

/// The same for sums of squares; and no sample of a region that they certify collides.
#[test]
fn sums_of_squares_are_accepted_and_every_damage_to_them_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let good = folder.path().join("good");
    plan(&scene("bottle-cap-3dof"), &good, &["--certify", "sos"]).expect_code(0);
    let accepted = check(&good).expect_code(0);
    assert!(accepted.stderr.contains("sums of squares for"), "{}", accepted.stderr);
    let judge = Judge::new(&scene("bottle-cap-3dof"), &good);
    assert!(judge.regions.regions.iter().filter(|region| region.certified).count() > 5);
    assert_eq!(judge.colliding_samples(), 0);
    judge.judge_motion();
    each_is_named(folder.path(), &good, sum_damage::all());
}

/// The same for cells by the corners of the bodies of an arm.
#[test]
fn cells_by_corners_are_accepted_and_every_damage_to_them_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let good = folder.path().join("good");
    let at = "--region-at=-0.000155,0.397273,0.00022,-1.367476,0.000247,-0.192952,1.570469";
    let scene = scene("iiwa14-shelf");
    let arguments: [Word<'_>; 6] = [&"regions", &scene, &"--out", &good, &at, &"--radius=0.2"];
    run("regrasp", &arguments).expect_code(0);
    check(&good).expect_code(0);
    each_is_named(folder.path(), &good, corner_damage::all());
}

/// Each damage to a copy of the run `good` is rejected with the words expected.
fn each_is_named(folder: &Path, good: &Path, damages: Vec<Damage>) {
    let mut wrong = Vec::new();
    for Damage { name, apply, expected } in damages {
        let run = folder.join("damaged");
        copy(good, &run);
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

/// Also where the answer is no: that is what the proof is for.
#[test]
fn that_there_is_no_plan_is_replayed() {
    let folder = tempfile::tempdir().expect("a folder");
    let cases = [("two-rooms-closed", "3", 3), ("bottle-cap-3dof", "9", 9)];
    for (name, most, n_grasps) in cases {
        let run = folder.path().join(name);
        plan(&scene(name), &run, &["--max-grasps", most]).expect_code(1);
        let answer = check(&run).expect_code(0);
        let expected = format!("there is no motion with at most {n_grasps} grasps");
        assert!(answer.stderr.contains(&expected), "{}", answer.stderr);
        assert!(!answer.stderr.contains("not verified"), "{}", answer.stderr);
    }
}

/// A program in place of miqp need not write a proof; then the answer is its word, and the motion is verified all the same.
#[test]
fn an_answer_without_its_proof_is_not_verified() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = folder.path().join("run");
    plan(&scene("two-rooms"), &run, &[]).expect_code(0);
    std::fs::remove_file(run.join("miqp/proof.bin")).expect("a proof");
    let answer = check(&run).expect_code(0);
    assert!(answer.stderr.contains("accepted"), "{}", answer.stderr);
    let expected = "not verified: that no plan has fewer grasps or less cost";
    assert!(answer.stderr.contains(expected), "{}", answer.stderr);
    assert!(!answer.stderr.contains("proven over these regions"), "{}", answer.stderr);
}

/// The same inputs give the same proof, byte for byte, whatever the number of workers.
#[test]
fn a_proof_is_reproducible() {
    let folder = tempfile::tempdir().expect("a folder");
    let of = |workers: &str| {
        let run = folder.path().join(workers);
        plan(&scene("bottle-cap-3dof"), &run, &["--workers", workers]).expect_code(0);
        bytes(&run, "miqp/proof.bin")
    };
    assert!(of("1") == of("3"), "the proofs differ");
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
