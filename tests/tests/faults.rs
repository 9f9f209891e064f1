//! Stages that misbehave, and runs that are ended from outside: the right exit code and words, and nothing left behind.

use ipc_types::artefact::RegionsFile;
use pipeline_tests::programs::{self, Finished, program};
use pipeline_tests::scenes::scene;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::Duration;

/// A run that goes on.
struct Running {
    child: Child,
    out: PathBuf,
}

impl Running {
    fn start(scene_name: &str, out: &Path, further: &[&str]) -> Running {
        Running::start_command("plan", scene_name, out, further)
    }

    fn start_command(command: &str, scene_name: &str, out: &Path, further: &[&str]) -> Running {
        let child = program("regrasp")
            .arg(command)
            .arg(scene(scene_name))
            .arg("--out")
            .arg(out)
            .args(further)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        Running { child, out: out.to_owned() }
    }

    fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Waits until a process of the stage runs, or the run has ended.
    fn stage_process(&mut self, stage: &str) -> Option<u32> {
        loop {
            if let Some(pid) = children_of(self.pid())
                .into_iter()
                .find(|pid| executable_of(*pid) == Some(format!("regrasp-{stage}")))
            {
                return Some(pid);
            }
            if self.child.try_wait().unwrap().is_some() {
                return None;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Waits for the end; nothing of the run may be left then.
    #[track_caller]
    fn finish(mut self) -> Finished {
        let pid = self.pid();
        let mut stage_pids = children_of(pid);
        let (mut stdout, mut stderr) = (String::new(), String::new());
        self.child.stdout.take().unwrap().read_to_string(&mut stdout).unwrap();
        self.child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
        let code = self.child.wait().unwrap().code();
        stage_pids.retain(|stage_pid| {
            runs(*stage_pid) && executable_of(*stage_pid).is_some_and(|e| e.starts_with("regrasp"))
        });
        assert!(stage_pids.is_empty(), "processes {stage_pids:?} are left");
        assert_eq!(files_of(pid), Vec::<PathBuf>::new());
        Finished { code, stdout, stderr }
    }
}

/// Children of a process.
fn children_of(parent: u32) -> Vec<u32> {
    let entries = std::fs::read_dir("/proc").unwrap().flatten();
    let pids = entries.filter_map(|entry| entry.file_name().to_str()?.parse::<u32>().ok());
    pids.filter(|pid| parent_of(*pid) == Some(parent)).collect()
}

/// State and parent of a process: the fields after its name in parentheses.
fn stat(pid: u32) -> Option<(String, u32)> {
    let text = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    let mut fields = text.rsplit_once(')')?.1.split_whitespace();
    Some((fields.next()?.to_owned(), fields.next()?.parse().ok()?))
}

fn parent_of(pid: u32) -> Option<u32> {
    stat(pid).map(|(_, parent)| parent)
}

/// Whether a process runs; a zombie does not.
fn runs(pid: u32) -> bool {
    stat(pid).is_some_and(|(state, _)| state != "Z" && state != "X")
}

fn executable_of(pid: u32) -> Option<String> {
    let path = std::fs::read_link(format!("/proc/{pid}/exe")).ok()?;
    // The file may have been built anew meanwhile.
    Some(path.file_name()?.to_string_lossy().trim_end_matches(" (deleted)").to_owned())
}

/// Files in shared memory and of iceoryx2 that bear the process id of a run.
fn files_of(pid: u32) -> Vec<PathBuf> {
    let folders = ["/dev/shm", "/tmp/iceoryx2/services", "/tmp/iceoryx2/nodes"];
    let entries = folders.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten().flatten();
    let prefix = format!("regrasp-{pid}-");
    entries
        .filter(|entry| entry.file_name().to_string_lossy().starts_with(&prefix))
        .map(|e| e.path())
        .collect()
}

fn send(pid: u32, signal: i32) {
    let pid = libc::pid_t::try_from(pid).unwrap();
    // SAFETY: a signal to a process that this test started, directly or not.
    assert_eq!(unsafe { libc::kill(pid, signal) }, 0);
}

/// A shell script in place of a stage.
fn script(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

fn in_place_of(stage: &str, path: &Path) -> String {
    format!("{stage}=/bin/sh '{}'", path.display())
}

#[track_caller]
fn killed_stage(stage: &str) {
    let folder = tempfile::tempdir().unwrap();
    let mut run = Running::start("bottle-cap-3dof", &folder.path().join("run"), &[]);
    let pid = run.stage_process(stage).expect("the stage is started");
    send(pid, libc::SIGKILL);
    let out = run.out.clone();
    let finished = run.finish().expect_code(4);
    assert!(finished.stderr.contains(stage), "{}", finished.stderr);
    assert!(finished.stderr.contains("signal 9"), "{}", finished.stderr);
    let log = out.join(stage).join("log");
    assert!(finished.stderr.contains(log.to_str().unwrap()), "{}", finished.stderr);
}

#[test]
fn a_killed_decompose_ends_the_run() {
    killed_stage("decompose");
}

#[test]
fn a_killed_worker_ends_the_run() {
    killed_stage("certify");
}

#[test]
fn a_killed_miqp_ends_the_run() {
    killed_stage("miqp");
}

#[test]
fn a_killed_gcs_ends_the_run() {
    killed_stage("gcs");
}

#[test]
fn ctrl_c_ends_the_run_and_keeps_its_state() {
    let folder = tempfile::tempdir().unwrap();
    let mut run = Running::start("bottle-cap-3dof", &folder.path().join("run"), &[]);
    run.stage_process("gcs").expect("the stages are started");
    std::thread::sleep(Duration::from_millis(300));
    send(run.pid(), libc::SIGINT);
    let out = run.out.clone();
    run.finish().expect_code(130);
    let record: serde_json::Value = programs::json(&out, "run.json");
    assert_eq!(record["outcome"]["exit_code"], 130);
}

/// A signal reaches decompose while it waits for what certification makes of its candidates: it is no failure, all
/// files are there, and the message says what they hold.
#[test]
fn ctrl_c_keeps_candidates_and_certified_regions_of_a_cover() {
    let folder = tempfile::tempdir().unwrap();
    let further = ["--cover", "--coverage", "0.8", "--workers", "2"];
    let mut run = Running::start_command("regions", "iiwa14-wrist", &folder.path().join("run"), &further);
    let (parts, out) = (run.out.join("certify/parts"), run.out.clone());
    // A part is announced when its worker asks for more: with three parts of two workers, at least one is.
    let is_part =
        |entry: &std::fs::DirEntry| entry.path().extension().is_some_and(|extension| extension == "bin");
    while std::fs::read_dir(&parts).map_or(0, |entries| entries.flatten().filter(is_part).count()) < 3 {
        assert_eq!(run.child.try_wait().unwrap(), None, "it ends before it can be interrupted");
        std::thread::sleep(Duration::from_millis(1));
    }
    send(run.pid(), libc::SIGINT);
    let finished = run.finish().expect_code(130);
    let n = |file: &str| programs::json::<RegionsFile>(&out, file).regions.len();
    let (n_candidates, n_certified) = (n("decompose/regions.json"), n("certify/regions.json"));
    assert!(n_candidates > 1 && n_certified >= 1 && n_certified < n_candidates);
    let words = format!("interrupted; {n_candidates} candidates are kept, {n_certified} of them certified");
    assert!(finished.stderr.contains(&words), "{}", finished.stderr);
    let record: serde_json::Value = programs::json(&out, "run.json");
    assert_eq!(record["outcome"]["message"], words);
    assert!(record["stages"].as_array().unwrap().iter().all(|stage| stage["seconds"].as_f64() > Some(0.0)));
    let status: serde_json::Value = programs::json(&out, "decompose/status.json");
    assert_eq!(status["outcome"], "interrupted", "{}", status["reason"]);
    programs::run("regrasp", &[&"check", &out]).expect_code(0);

    // Before anything is found it says so.
    let mut run = Running::start_command("regions", "iiwa14-wrist", &folder.path().join("early"), &further);
    run.stage_process("certify").expect("the stages are started");
    std::thread::sleep(Duration::from_millis(100));
    send(run.pid(), libc::SIGINT);
    let finished = run.finish().expect_code(130);
    assert!(finished.stderr.contains("interrupted; no region was found yet"), "{}", finished.stderr);
}

#[test]
fn stages_die_with_a_killed_orchestrator_and_clean_removes_what_it_left() {
    let folder = tempfile::tempdir().unwrap();
    let mut run = Running::start("bottle-cap-3dof", &folder.path().join("run"), &[]);
    run.stage_process("gcs").expect("the stages are started");
    let (pid, stages) = (run.pid(), children_of(run.pid()));
    send(pid, libc::SIGKILL);
    run.child.wait().unwrap();
    while stages.iter().any(|stage| runs(*stage)) {
        std::thread::sleep(Duration::from_millis(1));
    }
    programs::run("regrasp", &[&"clean"]).expect_code(0);
    assert_eq!(files_of(pid), Vec::<PathBuf>::new());
}

/// Runs a small scene with a script in place of a stage.
#[track_caller]
fn with_script(stage: &str, text: &str, further: &[&str]) -> (Finished, tempfile::TempDir) {
    let folder = tempfile::tempdir().unwrap();
    let command = in_place_of(stage, &script(folder.path(), "stage.sh", text));
    let mut arguments = vec!["--stage", command.as_str()];
    arguments.extend(further);
    let run = Running::start("two-rooms", &folder.path().join("run"), &arguments);
    (run.finish(), folder)
}

#[test]
fn a_stage_that_crashes_at_once_is_named() {
    for stage in ["decompose", "certify", "miqp", "gcs"] {
        let (finished, _folder) = with_script(stage, "echo 'no memory' >&2; exit 7\n", &[]);
        let finished = finished.expect_code(4);
        for word in [stage, "exit code 7", "no memory", "log.txt"] {
            assert!(finished.stderr.contains(word), "{word}: {}", finished.stderr);
        }
    }
}

#[test]
fn a_stage_that_crashes_later_is_named() {
    let (finished, _folder) = with_script("decompose", "sleep 0.3; kill -SEGV $$\n", &[]);
    let finished = finished.expect_code(4);
    assert!(finished.stderr.contains("decompose was killed by signal 11"), "{}", finished.stderr);
}

#[test]
fn a_stage_that_hangs_and_ignores_sigterm_is_killed_after_the_time_limit() {
    let text = "trap '' TERM INT\nwhile true; do sleep 0.05; done\n";
    let (finished, _folder) = with_script("decompose", text, &["--time-limit", "0.5"]);
    finished.expect_code(3);
}

#[test]
fn a_stage_that_says_done_and_writes_nothing_is_found_out() {
    for stage in ["decompose", "certify", "miqp", "gcs"] {
        let (finished, _folder) = with_script(stage, "exit 0\n", &[]);
        assert!(matches!(finished.code, Some(2 | 4)), "{stage}: {:?} {}", finished.code, finished.stderr);
        assert!(finished.stderr.contains(stage), "{stage}: {}", finished.stderr);
    }
}

/// A decompose that writes this `regions.json`.
fn regions_script(regions: &str) -> String {
    format!(
        "while [ $# -gt 0 ]; do [ \"$1\" = --out ] && out=\"$2\"; shift; done\nmkdir -p \"$out\"\ncat > \"$out/regions.json\" <<'END'\n{regions}\nEND\n"
    )
}

#[test]
fn numbers_that_are_none_and_broken_regions_are_refused() {
    let broken = [
        r#"{"coordinates": ["pusher"], "regions": [{"id": 1, "parent": null, "A": [[null]], "b": [1], "center": [0], "method": "m", "certified": false, "margin": 0}], "coverage": null}"#,
        r#"{"coordinates": ["pusher"], "regions": [{"id": 1, "parent": null, "A": [[1]], "b": [1e999], "center": [0], "method": "m", "certified": false, "margin": 0}], "coverage": null}"#,
        r#"{"coordinates": ["pusher"], "regions": [{"id": 1, "parent": null, "A": [[2]], "b": [1], "center": [0], "method": "m", "certified": false, "margin": 0}], "coverage": null}"#,
        "not JSON",
    ];
    for regions in broken {
        let (finished, _folder) = with_script("decompose", &regions_script(regions), &[]);
        let finished = finished.expect_code(4);
        assert!(
            finished.stderr.contains("decompose") && finished.stderr.contains("regions"),
            "{}",
            finished.stderr
        );
        assert!(!finished.stderr.contains("panicked"), "{}", finished.stderr);
    }
}

#[test]
fn a_stage_in_place_of_another_works_on_files() {
    let folder = tempfile::tempdir().unwrap();
    let usual = Running::start("two-rooms", &folder.path().join("usual"), &[]);
    usual.finish().expect_code(0);
    for stage in ["decompose", "certify", "miqp", "gcs"] {
        let real = programs::folder().join(format!("regrasp-{stage}"));
        let text = format!("echo replaced >&2\nexec '{}' \"$@\"\n", real.display());
        let command = in_place_of(stage, &script(folder.path(), "stage.sh", &text));
        let out = folder.path().join(stage);
        Running::start("two-rooms", &out, &["--stage", &command]).finish().expect_code(0);
        let log = String::from_utf8(programs::bytes(&out, &format!("{stage}/log.txt"))).unwrap();
        assert!(log.starts_with("replaced"), "{log}");
        if matches!(stage, "decompose" | "certify") {
            // Where one of the two runs on files, once, nothing is certified while decompose still runs: it is not
            // asked for more regions, as it is over channels. What a stand-in promises is what it gives alone, and a
            // plan from that.
            let alone = folder.path().join(format!("{stage}-alone"));
            let mut command = program(&format!("regrasp-{stage}"));
            command.arg("run").arg("--scene").arg(scene("two-rooms")).arg("--out").arg(&alone);
            if stage == "certify" {
                command.arg("--in").arg(&out);
            }
            Finished::from(command.output().unwrap()).expect_code(0);
            assert_eq!(
                programs::bytes(&out, &format!("{stage}/regions.bin")),
                programs::bytes(&alone, "regions.bin"),
                "{stage}: a stand-in gives what it gives alone"
            );
            let plan: ipc_types::artefact::PlanFile = programs::json(&out, "miqp/plan.json");
            assert_eq!(plan.n_grasps, Some(1));
            continue;
        }
        for file in ["miqp/plan.json", "gcs/trajectory.csv"] {
            assert_eq!(
                programs::bytes(&out, file),
                programs::bytes(&folder.path().join("usual"), file),
                "{stage}: {file}"
            );
        }
    }
}

#[test]
fn a_stage_does_not_enter_the_domain_of_another_program() {
    // The default prefix of the library: other programs of the machine may be there.
    let folder = tempfile::tempdir().unwrap();
    let arguments: [&str; 6] =
        ["serve", "--domain", "iox2_", "--run", folder.path().to_str().unwrap(), "--scene"];
    let output = program("regrasp-miqp").args(arguments).arg(scene("two-rooms")).output().unwrap();
    assert_eq!(output.status.code(), Some(4));
    assert!(String::from_utf8_lossy(&output.stderr).contains("domain iox2_"));
}
