//! The command line of `regrasp`.

use clap::{Args, Parser, Subcommand, ValueEnum};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Plans regrasps: the fewest grasps and short paths that bring an object to its goal, with a proof that nothing
/// collides on the way.
///
/// Exit codes: 0 done; 1 a proven negative answer; 2 bad input; 3 a limit was hit; 4 a stage failed; 130 interrupted.
#[derive(Debug, Parser)]
#[command(name = "regrasp", version, about, long_about, max_term_width = 100)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Plan a scene: regions, certificates, grasps, paths.
    Plan(PlanArgs),
    /// Regions of a scene and their certificates, without a plan; the scene needs no task.
    Regions(RegionsArgs),
    /// Run one stage of an earlier run again; the stages after it become stale.
    Rerun(RerunArgs),
    /// Verify a run with the independent checker.
    Check(CheckArgs),
    /// Certify a path that any planner made.
    CertifyPath(CertifyPathArgs),
    /// Print an artefact (`.bin` or `.json`).
    Show(ShowArgs),
    /// Write the report of a run again.
    Report(RunArgs),
    /// Measure one stage alone on the files of a run.
    Profile(ProfileArgs),
    /// List the stages and the executables found for them.
    Stages(StagesArgs),
    /// Remove what dead runs left in shared memory.
    Clean(CleanArgs),
}

/// How regions are certified.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CertifyMethod {
    /// Swept hulls of the bodies over cells of the joint space.
    Swept,
    /// Sums of squares (C-IRIS).
    Sos,
    /// Not at all; every output then says "not certified".
    None,
}

impl CertifyMethod {
    /// The word on the command line.
    pub fn word(self) -> &'static str {
        match self {
            CertifyMethod::Swept => "swept",
            CertifyMethod::Sos => "sos",
            CertifyMethod::None => "none",
        }
    }
}

/// Arguments of `regrasp plan`.
#[derive(Debug, Args)]
pub struct PlanArgs {
    /// What every new run is given.
    #[command(flatten)]
    pub run: NewRunArgs,
    /// Largest number of grasps to try. Default: the task's.
    #[arg(long, value_name = "K")]
    pub max_grasps: Option<u32>,
}

/// Arguments of `regrasp regions`.
#[derive(Debug, Args)]
pub struct RegionsArgs {
    /// What every new run is given.
    #[command(flatten)]
    pub run: NewRunArgs,
    /// Grow a region around this configuration, and nothing else: comma-separated coordinates in the scene's order;
    /// repeat for more. Without it the regions cover CS_free.
    #[arg(long, value_name = "Q0,Q1,…", allow_hyphen_values = true)]
    pub region_at: Vec<String>,
    /// Cover CS_free and nothing else, whether or not the scene has a task: --coverage is then the share that certified
    /// regions must cover. With one --region-at and --radius: CS_free in that box.
    #[arg(long)]
    pub cover: bool,
    /// With --region-at: half-width of the box, radians or metres, that each region stays in.
    #[arg(long, value_name = "R", value_parser = half_width, requires = "region_at")]
    pub radius: Option<f64>,
}

/// What every new run is given.
#[derive(Debug, Args)]
pub struct NewRunArgs {
    /// Scene folder, or its `scene.toml`.
    pub scene: PathBuf,
    /// Task of the scene; a single one needs no choice.
    #[arg(long)]
    pub task: Option<String>,
    /// Run directory to write; must not exist. Default: the next free `runs/<scene>/<nnnn>`.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Seed of all random numbers; the same seed gives the same bytes.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub seed: u64,
    /// Certification workers. Default: the number of processors.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=256))]
    pub workers: Option<u32>,
    /// Share of CS_free, CG and CP that the regions should cover.
    #[arg(long, value_name = "C", value_parser = share)]
    pub coverage: Option<f64>,
    /// Begin with the regions and certificates of this run, whose scene may have been a little different: what still
    /// holds is verified, the rest is made anew.
    #[arg(long, value_name = "RUN")]
    pub extend: Option<PathBuf>,
    /// How regions are certified.
    #[arg(long, value_enum, default_value_t = CertifyMethod::Swept)]
    pub certify: CertifyMethod,
    /// Distance to keep between bodies, metres. Default: the task's, or 0.
    #[arg(long, value_name = "M", value_parser = distance)]
    pub clearance: Option<f64>,
    /// Option of a stage, as in `--set decompose.coverage=0.9`; `regrasp-<stage> run --help` lists them.
    #[arg(long = "set", value_name = "STAGE.KEY=VALUE")]
    pub set: Vec<String>,
    /// Command to run in place of a stage, as in `--stage gcs="python3 my_gcs.py"`.
    #[arg(long = "stage", value_name = "NAME=COMMAND")]
    pub stage: Vec<String>,
    /// Seconds after which the run is stopped with exit code 3.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub time_limit: Option<f64>,
    /// Print the outcome as JSON on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `regrasp rerun`.
#[derive(Debug, Args)]
pub struct RerunArgs {
    /// Run directory.
    pub run: PathBuf,
    /// Stage to run again; `NAME=COMMAND` puts another command in its place.
    #[arg(long, value_name = "NAME[=COMMAND]")]
    pub stage: String,
    /// Also run the stages after it.
    #[arg(long)]
    pub onward: bool,
    /// Option of a stage, as in `--set miqp.max_grasps=12`.
    #[arg(long = "set", value_name = "STAGE.KEY=VALUE")]
    pub set: Vec<String>,
    /// Print the outcome as JSON on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `regrasp check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// Run directory.
    pub run: PathBuf,
    /// Print the verdict as JSON on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `regrasp certify-path`.
#[derive(Debug, Args)]
pub struct CertifyPathArgs {
    /// Scene folder, or its `scene.toml`.
    pub scene: PathBuf,
    /// Path: CSV with every coordinate by name, optionally `t` and `mode`; or a `trajectory.json`.
    pub path: PathBuf,
    /// Task whose grasps say what is held when the mode is `transfer`.
    #[arg(long)]
    pub task: Option<String>,
    /// Distance to prove, metres. Default: the task's, or 0.
    #[arg(long, value_name = "M")]
    pub clearance: Option<f64>,
    /// What a gripper holds on which pieces, as in `--attach cap/cap=gripper/wsg_body@1..3`: there the object's link moves
    /// with the gripper's. `regrasp-certify path --help` says more.
    #[arg(long, value_name = "OBJECT_LINK=GRIPPER_LINK@FIRST..LAST")]
    pub attach: Vec<String>,
    /// How far from where the path puts it what was held may be when it is released, metres.
    #[arg(long, value_name = "M", value_parser = distance)]
    pub tol_held: Option<f64>,
    /// Folder for the certificate (`path.bin`, `path.json`), for `regrasp-check --path`.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print the verdict as JSON on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `regrasp show`.
#[derive(Debug, Args)]
pub struct ShowArgs {
    /// Artefact: a `.bin` or `.json` file of a run.
    pub file: PathBuf,
    /// Print all of it as JSON on standard output.
    #[arg(long)]
    pub json: bool,
}

/// A run directory and nothing else.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// Run directory.
    pub run: PathBuf,
}

/// Arguments of `regrasp profile`.
#[derive(Debug, Args)]
pub struct ProfileArgs {
    /// Run directory whose files the stage reads; it is not changed.
    pub run: PathBuf,
    /// Stage to measure.
    #[arg(long, value_name = "NAME")]
    pub stage: String,
    /// How often.
    #[arg(long, default_value_t = 5, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub repeat: u32,
    /// Option of the stage, as in `--set miqp.max_grasps=12`.
    #[arg(long = "set", value_name = "STAGE.KEY=VALUE")]
    pub set: Vec<String>,
    /// Print the figures as JSON on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `regrasp stages`.
#[derive(Debug, Args)]
pub struct StagesArgs {
    /// Print the list as JSON on standard output.
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `regrasp clean`.
#[derive(Debug, Args)]
pub struct CleanArgs {
    /// Say what would be removed, remove nothing.
    #[arg(long)]
    pub dry_run: bool,
}

/// A share in (0, 1].
fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= 1.0 => Ok(value),
        _ => Err("expected a share in (0, 1], such as 0.99".into()),
    }
}

/// A distance of at least 0.
fn distance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value >= 0.0 && value.is_finite() => Ok(value),
        _ => Err("expected a distance in metres, at least 0, such as 0.005".into()),
    }
}

/// Half the width of a box.
fn half_width(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("expected a positive number of radians or metres, such as 0.75".into()),
    }
}

/// A positive time.
fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("expected a positive number of seconds, such as 60".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn coverage_outside_its_range_is_refused() {
        for bad in ["0", "1.5", "nan", "-0.1", "much"] {
            assert!(Cli::try_parse_from(["regrasp", "plan", "s", "--coverage", bad]).is_err());
        }
        assert!(Cli::try_parse_from(["regrasp", "plan", "s", "--coverage", "0.7"]).is_ok());
    }

    #[test]
    fn regions_around_configurations_with_negative_coordinates() {
        let words =
            ["regrasp", "regions", "s", "--region-at", "-0.1,2", "--region-at", "0,1", "--radius", "0.5"];
        let Command::Regions(args) = Cli::try_parse_from(words).unwrap().command else {
            panic!("not regions")
        };
        assert_eq!((args.region_at, args.radius), (vec!["-0.1,2".into(), "0,1".into()], Some(0.5)));
        assert!(!args.cover);
        assert!(Cli::try_parse_from(["regrasp", "regions", "s", "--cover"]).is_ok());
        assert!(Cli::try_parse_from(["regrasp", "regions", "s", "--radius", "0.5"]).is_err());
        assert!(Cli::try_parse_from(["regrasp", "regions", "s", "--max-grasps", "3"]).is_err());
    }

    #[test]
    fn certify_none_is_a_word() {
        let cli = Cli::try_parse_from(["regrasp", "plan", "s", "--certify", "none"]).unwrap();
        let Command::Plan(plan) = cli.command else { panic!("not a plan") };
        assert_eq!(plan.run.certify, CertifyMethod::None);
    }
}
