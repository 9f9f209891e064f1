//! `regrasp profile`: one stage alone on the files of a run, several times, measured.

use crate::cli::ProfileArgs;
use crate::failure::{ExitCode, Failure};
use crate::pipeline::run_stage;
use crate::quantity;
use crate::run_directory::RunDirectory;
use crate::run_record::RunRecord;
use crate::stage::{StageOptions, stage_from_name};
use ipc_types::status::Status;
use ipc_types::store::read_json;
use serde::Serialize;

/// Least, median and largest of some measurements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct Spread {
    min: f64,
    median: f64,
    max: f64,
}

impl Spread {
    /// `None` of nothing. The median of an even number is the mean of the two in the middle.
    fn of(mut values: Vec<f64>) -> Option<Spread> {
        values.sort_by(f64::total_cmp);
        let (min, max) = (*values.first()?, *values.last()?);
        let middle = values.len() / 2;
        let median =
            if values.len() % 2 == 1 { values[middle] } else { (values[middle - 1] + values[middle]) / 2.0 };
        Some(Spread { min, median, max })
    }
}

/// What was measured.
#[derive(Debug, Serialize)]
struct Profile {
    stage: String,
    repeat: u32,
    exit_code: i32,
    seconds: Option<Spread>,
    cpu_seconds: Option<Spread>,
    peak_bytes: Option<Spread>,
    solver_calls: Option<Spread>,
}

/// Measures; the run is not changed.
pub fn profile(args: &ProfileArgs) -> Result<ExitCode, Failure> {
    let run = RunDirectory::open(&args.run)?;
    let record = RunRecord::read(run.path())?;
    let stage = stage_from_name(&args.stage)?;
    let mut options = record.options.clone();
    options.extend(&StageOptions::parse(&args.set)?);
    let scratch = Scratch::create()?;
    let (mut seconds, mut cpu, mut peak, mut calls) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut exit_code = 0;
    for turn in 0..args.repeat {
        let output = scratch.path.join(format!("{turn}"));
        let mut request = super::rerun::stage_request(&run, &record, stage, &options);
        request.output = output.clone();
        let cost = run_stage(&request)?;
        seconds.push(cost.seconds);
        cpu.push(cost.cpu_seconds);
        peak.push(cost.peak_bytes as f64);
        exit_code = cost.exit_code;
        if let Ok(status) = read_json::<Status>(&output.join("status.json")) {
            calls.push(status.solver_calls as f64);
        }
    }
    let profile = Profile {
        stage: stage.word().into(),
        repeat: args.repeat,
        exit_code,
        seconds: Spread::of(seconds),
        cpu_seconds: Spread::of(cpu),
        peak_bytes: Spread::of(peak),
        solver_calls: Spread::of(calls),
    };
    if args.json {
        super::print_json(&profile)?
    } else {
        super::print(table(&profile).as_bytes())?
    }
    Ok(ExitCode::Done)
}

fn table(profile: &Profile) -> String {
    let mut text = format!(
        "{} alone, {}, exit code {}\n{:<14}{:>12}{:>12}{:>12}\n",
        profile.stage,
        quantity::count(profile.repeat as usize, "run"),
        profile.exit_code,
        "",
        "min",
        "median",
        "max"
    );
    let mut line = |name: &str, spread: Option<Spread>, word: &dyn Fn(f64) -> String| {
        if let Some(Spread { min, median, max }) = spread {
            text.push_str(&format!("{name:<14}{:>12}{:>12}{:>12}\n", word(min), word(median), word(max)));
        }
    };
    line("wall", profile.seconds, &quantity::seconds);
    line("CPU", profile.cpu_seconds, &quantity::seconds);
    line("peak memory", profile.peak_bytes, &|value| quantity::bytes(value as u64));
    line("solver calls", profile.solver_calls, &|value| format!("{value:.0}"));
    text
}

/// A folder that goes when it is no longer needed, also on an error.
struct Scratch {
    path: std::path::PathBuf,
}

impl Scratch {
    fn create() -> Result<Scratch, Failure> {
        let path = std::env::temp_dir().join(format!("regrasp-profile-{}", std::process::id()));
        std::fs::create_dir(&path).map_err(|cause| Failure::file("create", &path, cause))?;
        Ok(Scratch { path })
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // What cannot be removed stays in the folder for temporary files.
        let _ = std::fs::remove_dir_all(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_in_the_middle() {
        assert_eq!(Spread::of(vec![3.0, 1.0, 2.0]), Some(Spread { min: 1.0, median: 2.0, max: 3.0 }));
        assert_eq!(Spread::of(vec![4.0, 1.0]).map(|s| s.median), Some(2.5));
        assert_eq!(Spread::of(vec![]), None);
    }
}
