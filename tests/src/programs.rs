//! The executables under test: built once, run with all their output caught.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

/// Top of the project.
pub fn project() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_owned()
}

/// Folder of the executables. The first call of a test process builds them: `cargo test` builds only those of the
/// package under test, and a test of an old program would say nothing. With `PREBUILT=1` they are taken as they are.
///
/// # Panics
/// If they cannot be built; there is nothing to test then.
pub fn folder() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        // target/<profile>/deps/<test>-<hash>
        let test = std::env::current_exe().expect("a running program has a path");
        let folder = test.ancestors().nth(2).expect("a test lies in target/<profile>/deps").to_owned();
        if std::env::var_os("PREBUILT").is_some_and(|word| word == "1") {
            return folder;
        }
        let profile = match folder.file_name().and_then(OsStr::to_str) {
            Some("debug") | None => "dev".to_owned(),
            Some(profile) => profile.to_owned(),
        };
        let status = Command::new(env!("CARGO"))
            .args(["build", "--quiet", "--workspace", "--bins", "--profile", &profile])
            .arg("--target-dir")
            .arg(folder.parent().expect("a profile's folder lies in the target folder"))
            .current_dir(project())
            .stdin(Stdio::null())
            .status()
            .expect("cargo runs, since it runs the tests");
        assert!(status.success(), "the executables cannot be built");
        folder
    })
}

/// A finished program.
#[derive(Debug)]
pub struct Finished {
    /// Exit code; `None` if a signal ended it.
    pub code: Option<i32>,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

impl From<Output> for Finished {
    fn from(output: Output) -> Finished {
        Finished {
            code: output.status.code(),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }
}

impl Finished {
    /// Fails the test unless the program ended with this code.
    ///
    /// # Panics
    /// If it ended otherwise.
    #[track_caller]
    pub fn expect_code(self, code: i32) -> Finished {
        assert_eq!(self.code, Some(code), "stdout:\n{}\nstderr:\n{}", self.stdout, self.stderr);
        self
    }
}

/// A program of the project, ready to be given arguments. It runs at the top of the project.
pub fn program(name: &str) -> Command {
    let mut command = Command::new(folder().join(name));
    command.current_dir(project()).stdin(Stdio::null()).env_remove("RUST_BACKTRACE");
    command
}

/// A word of a command line: text or a path.
pub type Word<'a> = &'a dyn AsRef<OsStr>;

/// Runs a program of the project to its end.
///
/// # Panics
/// If it cannot be started.
pub fn run(name: &str, arguments: &[Word<'_>]) -> Finished {
    program(name).args(arguments).output().expect("the program was just built").into()
}

/// `regrasp plan SCENE --out OUT` and further arguments.
pub fn plan(scene: &Path, out: &Path, further: &[&str]) -> Finished {
    let mut arguments: Vec<Word<'_>> = vec![&"plan", &scene, &"--out", &out];
    arguments.extend(further.iter().map(|word| word as Word<'_>));
    run("regrasp", &arguments)
}

/// `regrasp-<stage> run` on the files of `input` and further arguments.
pub fn stage_alone(stage: &str, scene: &Path, input: &Path, out: &Path, further: &[&str]) -> Finished {
    let mut arguments: Vec<Word<'_>> = vec![&"run", &"--scene", &scene, &"--in", &input, &"--out", &out];
    arguments.extend(further.iter().map(|word| word as Word<'_>));
    run(&format!("regrasp-{stage}"), &arguments)
}

/// Reads a file of a run.
///
/// # Panics
/// If it is not there.
#[track_caller]
pub fn bytes(run: &Path, file: &str) -> Vec<u8> {
    let path = run.join(file);
    std::fs::read(&path).unwrap_or_else(|cause| panic!("{}: {cause}", path.display()))
}

/// Reads a JSON file of a run.
///
/// # Panics
/// If it is not there or not what it should be.
#[track_caller]
pub fn json<T: serde::de::DeserializeOwned>(run: &Path, file: &str) -> T {
    serde_json::from_slice(&bytes(run, file)).unwrap_or_else(|cause| panic!("{file}: {cause}"))
}
