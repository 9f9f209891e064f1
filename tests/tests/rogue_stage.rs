//! Processes on the channels of a run that do not keep to the contract: another version, numbers that are none, an end
//! before the work is acknowledged. This test speaks on the channels in place of the stage, whose process only waits.

use ipc_types::artefact::Region;
use ipc_types::channel::{self, ControlClient, PendingControl, RunNode};
use ipc_types::message::{ControlRequest, Question, RegionHeader};
use ipc_types::stage_name::StageName;
use ipc_types::{Digest, PROTOCOL_VERSION, domain};
use pipeline_tests::programs::{Finished, program};
use pipeline_tests::scenes;
use scene::Scene;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::Duration;

const SCENE: &str = "two-rooms";

/// A run whose decompose is a process that waits, while the test speaks for it.
struct Rogue {
    run: Child,
    folder: tempfile::TempDir,
    control: ControlClient,
    // Declared last: ports are dropped before the node they belong to.
    node: RunNode,
}

/// Waits for a file, which is put there whole.
fn awaited(file: &Path, run: &mut Child) -> String {
    loop {
        if let Ok(text) = std::fs::read_to_string(file) {
            return text;
        }
        assert!(run.try_wait().expect("a process").is_none(), "the run ended before its stage began");
        std::thread::sleep(Duration::from_millis(2));
    }
}

impl Rogue {
    fn start() -> Rogue {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| -> PathBuf { folder.path().join(name) };
        let script = format!(
            "printf %s \"$REGRASP_DOMAIN\" > '{0}.new'\nmv '{0}.new' '{0}'\nwhile [ ! -e '{1}' ]; do sleep 0.02; done\nexit 0\n",
            path("domain").display(),
            path("leave").display()
        );
        std::fs::write(path("stage.sh"), script).expect("a script");
        let mut run = program("regrasp")
            .arg("plan")
            .arg(scenes::scene(SCENE))
            .arg("--out")
            .arg(path("run"))
            .args(["--stage", &format!("decompose=/bin/sh '{}'", path("stage.sh").display())])
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program was just built");
        let domain = awaited(&path("domain"), &mut run);
        let node = domain::enter(&domain).expect("the domain of the run");
        let control = channel::control_client(&node, StageName::Decompose).expect("the channel of the stage");
        Rogue { run, folder, control, node }
    }

    /// Asks as decompose would.
    fn ask(&self, question: Question, protocol_version: u32) -> PendingControl {
        let mut request = self.control.loan_slice_uninit(0).expect("a request");
        *request.user_header_mut() = ControlRequest {
            protocol_version,
            stage: StageName::Decompose.number(),
            worker: 0,
            pid: std::process::id(),
            question: question as u32,
            exit_code: 0,
            job: 0,
            scene_digest: digest(),
        };
        request.write_from_fn(|_| 0).send().expect("the request is sent")
    }

    /// Asks for its job and waits until it has it.
    fn take_job(&mut self) {
        let pending = self.ask(Question::Ready, PROTOCOL_VERSION);
        while pending.receive().expect("an answer").is_none() {
            assert!(self.run.try_wait().expect("a process").is_none(), "the run ended instead");
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// Announces a candidate, whatever its numbers are.
    fn announce(&self, region: &Region) {
        let publisher = channel::publisher::<f64, RegionHeader>(&self.node, channel::CANDIDATES);
        let (header, payload) = RegionHeader::encode(region, &digest());
        let publisher = publisher.expect("the channel of candidates");
        channel::publish(&publisher, channel::CANDIDATES, header, &payload).expect("it is sent");
        // A sample vanishes with its writer: the run is to have read it.
        std::thread::sleep(Duration::from_millis(300));
    }

    /// The process of the stage ends.
    fn leave(&self) {
        std::fs::write(self.folder.path().join("leave"), "").expect("a file");
    }

    /// How the run ends.
    fn finish(mut self) -> Finished {
        let mut stderr = String::new();
        let mut pipe = self.run.stderr.take().expect("a pipe");
        pipe.read_to_string(&mut stderr).expect("text");
        let code = self.run.wait().expect("a process").code();
        self.leave();
        Finished { code, stdout: String::new(), stderr }
    }
}

fn digest() -> Digest {
    Scene::load(&scenes::scene(SCENE)).expect("a scene of the project").digest
}

/// The left of the room.
fn region() -> Region {
    let row = |j: usize, sign: f64| (0..3).map(|k| if k == j { sign } else { 0.0 }).collect::<Vec<f64>>();
    Region {
        id: 0,
        parent: None,
        A: (0..3).flat_map(|j| [row(j, 1.0), row(j, -1.0)]).collect(),
        b: vec![-0.2, 0.3, -0.1, 0.4, 0.4, -0.1],
        center: vec![-0.25, -0.25, 0.3],
        method: "by hand".to_owned(),
        certified: false,
        margin: 0.0,
    }
}

#[test]
fn a_process_of_another_version_is_refused() {
    let rogue = Rogue::start();
    let _pending = rogue.ask(Question::Ready, PROTOCOL_VERSION + 1);
    let finished = rogue.finish().expect_code(4);
    for words in ["stage decompose", &format!("protocol version {}", PROTOCOL_VERSION + 1), "same version"] {
        assert!(finished.stderr.contains(words), "{}", finished.stderr);
    }
}

#[test]
fn numbers_that_are_none_are_refused_on_the_channel() {
    for (change, words) in [
        ((|region: &mut Region| region.A[2][1] = f64::NAN) as fn(&mut Region), "region 0 in a message"),
        (|region| region.b[0] = f64::INFINITY, "region 0 in a message"),
        (|region| region.center[0] = 0.2, "region 0 in a message"),
    ] {
        let mut rogue = Rogue::start();
        rogue.take_job();
        let mut broken = region();
        change(&mut broken);
        rogue.announce(&broken);
        let finished = rogue.finish().expect_code(4);
        assert!(finished.stderr.contains(words), "{}", finished.stderr);
        assert!(!finished.stderr.contains("panicked"), "{}", finished.stderr);
    }
}

#[test]
fn a_stage_that_ends_before_its_output_is_acknowledged_is_named() {
    // Before it says anything of its job, and after a candidate.
    for announces in [false, true] {
        let mut rogue = Rogue::start();
        rogue.take_job();
        if announces {
            rogue.announce(&region());
        }
        rogue.leave();
        let finished = rogue.finish().expect_code(4);
        for words in ["stage decompose", "before it was told to stop", "log.txt"] {
            assert!(finished.stderr.contains(words), "{}", finished.stderr);
        }
    }
}
