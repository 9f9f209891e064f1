//! Command line of a stage, its `status.json` and exit code.

use crate::file_mode;
use crate::process::{Stop, StopFlag, one_line, usage, without_panic};
use crate::serve;
use crate::spans;
use crate::stage::{Outcome, Stage, StageError};
use crate::work::Finished;
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use ipc_types::exit_code::ExitCode;
use ipc_types::status::Status;
use ipc_types::store::{write_at_once, write_json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Entry point of a stage that has no commands besides `run` and `serve`.
pub fn main<S: Stage>() -> std::process::ExitCode {
    main_with::<S, NoCommand>(|command| match command {})
}

/// Entry point of a stage with commands of its own, such as `regrasp-certify path`. `extra` runs one of these; its
/// words go to standard error, its exit code is that of the outcome.
pub fn main_with<S: Stage, X: Subcommand>(
    extra: impl FnOnce(X) -> Result<Outcome, StageError>,
) -> std::process::ExitCode {
    let began = Instant::now();
    let cli = match parse::<S, X>() {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version are answers, everything else is bad input; clap knows where each is printed.
            let code = if error.use_stderr() { ExitCode::BadInput } else { ExitCode::Done };
            let _ = error.print();
            return as_process_code(code);
        }
    };
    let code = match cli.command {
        Command::Run(args) => {
            spans::collect(0);
            let mut ending = file_mode::run::<S>(&args);
            ending.seconds = began.elapsed().as_secs_f64();
            let code = ending.record::<S>(&args.given, &args.out, "status", "spans.jsonl");
            say(S::NAME.executable(), code.0, &code.1);
            code.0
        }
        Command::Serve(args) => {
            spans::collect(args.worker);
            let (code, words) = serve::serve::<S>(&args);
            say(S::NAME.executable(), code, &words);
            code
        }
        Command::Extra(command) => {
            let result =
                without_panic(|| extra(command)).unwrap_or_else(|message| Err(StageError::Failed(message)));
            let ending = Ending { result: Some(result), ..Ending::default() };
            let (code, words) = ending.verdict();
            say(S::NAME.executable(), code, &words);
            code
        }
    };
    as_process_code(code)
}

/// No commands of its own.
#[derive(Debug, Clone, Copy)]
pub enum NoCommand {}

impl FromArgMatches for NoCommand {
    fn from_arg_matches(_matches: &clap::ArgMatches) -> Result<Self, clap::Error> {
        Err(clap::Error::new(clap::error::ErrorKind::InvalidSubcommand))
    }

    fn update_from_arg_matches(&mut self, _matches: &clap::ArgMatches) -> Result<(), clap::Error> {
        Err(clap::Error::new(clap::error::ErrorKind::InvalidSubcommand))
    }
}

impl Subcommand for NoCommand {
    fn augment_subcommands(command: clap::Command) -> clap::Command {
        command
    }

    fn augment_subcommands_for_update(command: clap::Command) -> clap::Command {
        command
    }

    fn has_subcommand(_name: &str) -> bool {
        false
    }
}

#[derive(Debug, Parser)]
struct Cli<O: Args, X: Subcommand> {
    #[command(subcommand)]
    command: Command<O, X>,
}

#[derive(Debug, Subcommand)]
enum Command<O: Args, X: Subcommand> {
    /// Run this stage alone on files.
    Run(RunArgs<O>),
    /// Work for an orchestrator, over channels.
    Serve(ServeArgs<O>),
    #[command(flatten)]
    Extra(X),
}

/// What both modes are given.
#[derive(Debug, Args)]
pub(crate) struct GivenArgs<O: Args> {
    /// Scene folder, or its `scene.toml`.
    #[arg(long, value_name = "SCENE")]
    pub scene: PathBuf,
    /// Task of the scene; a single one needs no choice.
    #[arg(long)]
    pub task: Option<String>,
    /// Seed of all random numbers; the same seed gives the same bytes.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub seed: u64,
    /// Distance to keep between bodies, metres. Default: the task's.
    #[arg(long, value_name = "M", value_parser = not_negative)]
    pub clearance: Option<f64>,
    #[command(flatten)]
    pub options: O,
}

/// Arguments of `run`.
#[derive(Debug, Args)]
pub(crate) struct RunArgs<O: Args> {
    /// Run directory to read.
    #[arg(long = "in", value_name = "DIR")]
    pub input: Option<PathBuf>,
    /// Folder to write.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Stop after this many seconds with the best result so far (exit code 3).
    #[arg(long, value_name = "SECONDS", value_parser = not_negative)]
    pub time_limit: Option<f64>,
    #[command(flatten)]
    pub given: GivenArgs<O>,
}

/// Arguments of `serve`.
#[derive(Debug, Args)]
pub(crate) struct ServeArgs<O: Args> {
    /// Prefix of the run's iceoryx2 domain.
    #[arg(long, value_name = "PREFIX")]
    pub domain: String,
    /// Run directory.
    #[arg(long, value_name = "DIR")]
    pub run: PathBuf,
    /// Number of this worker.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub worker: u32,
    /// Process of the orchestrator: the stage dies with it.
    #[arg(long, value_name = "PID")]
    pub parent: Option<u32>,
    #[command(flatten)]
    pub given: GivenArgs<O>,
}

fn not_negative(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=1e9).contains(&value) => Ok(value),
        _ => Err("expected a number from 0 to 1e9".into()),
    }
}

fn parse<S: Stage, X: Subcommand>() -> Result<Cli<S::Options, X>, clap::Error> {
    let reads: Vec<String> = S::READS.iter().map(|input| format!("  {}", input.help())).collect();
    let reads =
        if reads.is_empty() { String::new() } else { format!("Reads of --in:\n{}\n\n", reads.join("\n")) };
    let codes = "Exit codes: 0 done; 1 a proven negative answer; 2 bad input; 3 a limit was hit; 4 failed; \
                 130 interrupted.";
    let command = Cli::<S::Options, X>::command()
        .name(S::NAME.executable())
        .bin_name(S::NAME.executable())
        .version(env!("CARGO_PKG_VERSION"))
        .about(S::ABOUT)
        .max_term_width(110)
        .mut_subcommand("run", |run| run.after_help(format!("{reads}{codes}")))
        .after_help(codes);
    let matches = command.try_get_matches()?;
    Cli::from_arg_matches(&matches)
}

/// What `status.json` says of the scene.
#[derive(Debug, Clone, Default)]
pub(crate) struct ServedScene {
    pub digest: String,
    pub excluded_pairs: Vec<String>,
    pub task: Option<String>,
}

impl ServedScene {
    pub(crate) fn of(scene: &scene::Scene, task: Option<&scene::Task>) -> ServedScene {
        let name = |link: usize| scene.links.get(link).map_or("?", |link| link.name.as_str());
        ServedScene {
            digest: ipc_types::hexadecimal(&scene.digest),
            excluded_pairs: scene
                .excluded_links
                .iter()
                .map(|&(a, b)| format!("{} - {}", name(a), name(b)))
                .collect(),
            task: task.map(|task| task.name.clone()),
        }
    }
}

/// How the work ended, and what it says of itself.
#[derive(Debug, Default)]
pub(crate) struct Ending {
    pub result: Option<Result<Outcome, StageError>>,
    pub stop: StopFlag,
    pub scene: ServedScene,
    pub seconds: f64,
    pub solver_calls: u64,
    pub details: BTreeMap<String, serde_json::Value>,
}

impl Ending {
    /// Takes over what a job left.
    pub(crate) fn add(&mut self, finished: Finished) {
        self.result = Some(finished.result);
        self.solver_calls += finished.solver_calls;
        self.details = finished.details;
    }

    /// The exit code, and the words for people in one line.
    pub(crate) fn verdict(&self) -> (ExitCode, String) {
        let interrupted = self.stop.reason() == Some(Stop::Interrupted);
        match &self.result {
            Some(Ok(Outcome::Limit(_)) | Err(StageError::Stopped)) if interrupted => {
                (ExitCode::Interrupted, "interrupted; what was found is kept".to_owned())
            }
            Some(Ok(outcome)) => (outcome.exit_code(), one_line(outcome.words())),
            Some(Err(StageError::BadInput(words))) => (ExitCode::BadInput, one_line(words)),
            Some(Err(StageError::Failed(words))) => (ExitCode::Failed, one_line(words)),
            Some(Err(StageError::Stopped)) => {
                (ExitCode::Limit, "time limit; what was found is kept".to_owned())
            }
            None => (ExitCode::Failed, "ended without an outcome".to_owned()),
        }
    }

    /// Writes `<status>.json` and the spans; the exit code and the words for people.
    pub(crate) fn record<S: Stage>(
        &self,
        given: &GivenArgs<S::Options>,
        folder: &Path,
        status: &str,
        spans: &str,
    ) -> (ExitCode, String) {
        let (code, words) = self.verdict();
        // Bad input may have left no folder, and must not make one.
        if folder.is_dir() {
            let written = write_json(folder, status, &self.status::<S>(given, code, &words))
                .and_then(|()| write_at_once(&folder.join(spans), &spans::lines()));
            if let Err(error) = written {
                return (ExitCode::Failed, error.to_string());
            }
        }
        (code, words)
    }

    fn status<S: Stage>(&self, given: &GivenArgs<S::Options>, outcome: ExitCode, reason: &str) -> Status {
        let used = usage();
        Status {
            stage: S::NAME.word().to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            outcome,
            reason: reason.to_owned(),
            seconds: self.seconds,
            cpu_seconds: used.cpu_seconds,
            peak_bytes: used.peak_bytes,
            processes: 1,
            solver_calls: self.solver_calls,
            scene_digest: self.scene.digest.clone(),
            excluded_pairs: self.scene.excluded_pairs.clone(),
            task: self.scene.task.clone(),
            seed: given.seed,
            options: serde_json::to_value(&given.options).unwrap_or(serde_json::Value::Null),
            details: self.details.clone(),
        }
    }
}

/// One line to standard error.
pub(crate) fn say(program: &str, code: ExitCode, words: &str) {
    let kind = match code {
        ExitCode::Done => "done",
        ExitCode::Negative => "negative",
        ExitCode::BadInput => "bad input",
        ExitCode::Limit => "limit",
        ExitCode::Failed => "failed",
        ExitCode::Interrupted => "interrupted",
    };
    eprintln!("{program}: {kind}: {words}");
}

fn as_process_code(code: ExitCode) -> std::process::ExitCode {
    std::process::ExitCode::from(u8::try_from(code.code()).unwrap_or(4))
}
