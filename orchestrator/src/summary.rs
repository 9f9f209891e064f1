//! The summary of a run in the terminal, and its machine-readable twin.

use crate::cli::CertifyMethod;
use crate::quantity::{bytes, count, figure, seconds, share};
use crate::results::Results;
use crate::run_directory::RunDirectory;
use crate::run_record::{Acceptance, Asked, Outcome, StageRecord};
use ipc_types::artefact::{Coverage, Tried, TriedStatus};
use serde::Serialize;
use std::fmt::Write;

/// What `--json` prints.
#[derive(Debug, Serialize)]
pub struct Summary<'a> {
    /// Run directory.
    pub run: String,
    /// What was asked for.
    pub asked: Asked,
    /// How it ended.
    pub outcome: &'a Outcome,
    /// Whether every part of the trajectory is certified; `null` without a trajectory.
    pub certified: Option<bool>,
    /// What is certified, in words; "not certified" where nothing is.
    pub certification: String,
    /// ℓ; `null` without a plan.
    pub n_grasps: Option<usize>,
    /// Length of the trajectory; `null` without one.
    pub length: Option<f64>,
    /// Sum of the proven lower bounds of its segments; `null` without a trajectory.
    pub length_lower_bound: Option<f64>,
    /// Outcome for each ℓ.
    pub tried: &'a [Tried],
    /// Number of candidate regions.
    pub candidate_regions: usize,
    /// Number of certified regions.
    pub certified_regions: usize,
    /// Coverage of the candidates.
    pub coverage: Option<&'a Coverage>,
    /// Coverage of the certified regions.
    pub certified_coverage: Option<Coverage>,
    /// Least and mean share of its volume that a candidate kept; `null` if it was not measured.
    pub volume_kept: Option<(f64, f64)>,
    /// Pairs of links that the scene leaves out of collision.
    pub excluded_pairs: &'a [String],
    /// Acceptance check.
    pub acceptance: Option<&'a Acceptance>,
    /// Wall-clock time of the run.
    pub seconds: f64,
    /// Cost of each stage.
    pub stages: &'a [StageRecord],
    /// The report.
    pub report: String,
}

impl<'a> Summary<'a> {
    /// The summary of a run.
    pub fn of(run: &RunDirectory, results: &'a Results) -> Summary<'a> {
        let regions = |file: &Option<ipc_types::artefact::RegionsFile>, only_certified: bool| {
            file.as_ref().map_or(0, |f| f.regions.iter().filter(|r| r.certified || !only_certified).count())
        };
        Summary {
            run: run.path().display().to_string(),
            asked: results.record.asked,
            outcome: &results.record.outcome,
            certified: results.certified(),
            certification: certification(results),
            n_grasps: results.plan.as_ref().and_then(|plan| plan.n_grasps),
            length: results.trajectory.as_ref().map(|t| t.length),
            length_lower_bound: results.length_bound(),
            tried: results.plan.as_ref().map_or(&[], |plan| &plan.tried),
            candidate_regions: regions(&results.candidates, false),
            certified_regions: regions(&results.regions, true),
            coverage: results.candidates.as_ref().and_then(|f| f.coverage.as_ref()),
            certified_coverage: results.certified_coverage(),
            volume_kept: least_and_mean(&results.volumes_kept()),
            excluded_pairs: &results.record.excluded_pairs,
            acceptance: results.record.acceptance.as_ref(),
            seconds: results.record.seconds,
            stages: &results.record.stages,
            report: run.report().display().to_string(),
        }
    }

    /// Lines for people.
    pub fn text(&self) -> String {
        let mut text = String::new();
        // Writing to a string does not fail, here and below.
        let _ = writeln!(text, "\n{}", self.headline());
        for (from, to, tried) in grouped(self.tried) {
            let range = if from == to { format!("ℓ = {from}") } else { format!("ℓ = {from} … {to}") };
            let _ = writeln!(text, "  {range:<12} {}", tried_words(tried));
        }
        let _ = writeln!(text, "  {:<12} {}", "regions", self.regions());
        let excluded =
            if self.excluded_pairs.is_empty() { "none".into() } else { self.excluded_pairs.join(", ") };
        let _ = writeln!(text, "  {:<12} {excluded}", "excluded");
        if let Some(acceptance) = self.acceptance {
            let verdict = if acceptance.accepted { "passed" } else { "FAILED" };
            let _ = writeln!(text, "  {:<12} {verdict}", "acceptance");
            for line in acceptance.lines.iter().filter(|_| !acceptance.accepted) {
                let _ = writeln!(text, "  {:<12} {line}", "");
            }
        }
        let _ = writeln!(text, "\n  {:<12} {:>9} {:>9} {:>9}", "stage", "time", "CPU", "memory");
        for stage in self.stages {
            let stale = if stage.stale { "  stale: an earlier stage was run again" } else { "" };
            let _ = writeln!(
                text,
                "  {:<12} {:>9} {:>9} {:>9}{stale}",
                stage.stage.word(),
                seconds(stage.seconds),
                seconds(stage.cpu_seconds),
                bytes(stage.peak_bytes)
            );
        }
        let _ = writeln!(text, "  {:<12} {:>9}   stages overlap", "all", seconds(self.seconds));
        let _ = writeln!(text, "\n  report       {}", self.report);
        text
    }

    /// The answer in one line.
    pub fn headline(&self) -> String {
        match (self.n_grasps, self.length) {
            (Some(n), Some(length)) if self.outcome.exit_code == 0 => {
                let bound =
                    self.length_lower_bound.map(|b| format!(" (at least {})", figure(b))).unwrap_or_default();
                format!("{}, length {}{bound}, {}", count(n, "grasp"), figure(length), self.certification)
            }
            // Regions alone are all that such a run speaks of.
            _ if self.asked == Asked::Regions => self.outcome.message.trim_end_matches('.').to_owned(),
            _ => format!("{}; {}", self.outcome.message.trim_end_matches('.'), self.certification),
        }
    }

    fn regions(&self) -> String {
        let mut text = count(self.candidate_regions, "candidate");
        if let Some(coverage) = self.coverage {
            let _ = write!(text, " cover {}", coverage_words(coverage));
        }
        let _ = write!(text, "; {} certified", self.certified_regions);
        if let Some(coverage) = &self.certified_coverage {
            let _ = write!(text, ", cover {}", coverage_words(coverage));
        }
        text
    }
}

/// `None` of nothing.
fn least_and_mean(values: &[f64]) -> Option<(f64, f64)> {
    let least = values.iter().copied().reduce(f64::min)?;
    Some((least, values.iter().sum::<f64>() / values.len() as f64))
}

/// What of the run is certified, in words.
pub fn certification(results: &Results) -> String {
    match results.certified() {
        _ if results.record.certify == CertifyMethod::None => "not certified".into(),
        Some(true) => "all segments certified".into(),
        Some(false) => {
            let segments = results.trajectory.iter().flat_map(|t| &t.segments);
            let (all, open) =
                segments.fold((0, 0), |(all, open), s| (all + 1, open + usize::from(!s.certified)));
            format!("not certified: {open} of {all} segments are not")
        }
        None if results.record.asked == Asked::Regions => {
            let certified =
                results.regions.iter().flat_map(|file| &file.regions).filter(|r| r.certified).count();
            let asked = results.candidates.as_ref().map_or(0, |file| file.regions.len());
            format!("{certified} of {} certified", count(asked, "region"))
        }
        None => "no trajectory to certify".into(),
    }
}

/// `99.2 % of CS_free, 100 % of CG_free`.
pub fn coverage_words(coverage: &Coverage) -> String {
    let mut parts = vec![format!("{} of CS_free", share(coverage.total.0))];
    parts.extend(coverage.grasp.map(|e| format!("{} of CG_free", share(e.0))));
    parts.extend(coverage.placement.map(|e| format!("{} of CP_free", share(e.0))));
    parts.join(", ")
}

/// Outcome for one ℓ, in words.
pub fn tried_words(tried: &Tried) -> String {
    let status = match tried.status {
        TriedStatus::Infeasible => "infeasible",
        TriedStatus::Optimal => "optimal",
        TriedStatus::Feasible => "feasible",
        TriedStatus::Limit => "limit hit",
    };
    let cost = match (tried.cost, tried.lower_bound) {
        (Some(cost), Some(bound)) => format!(", cost {} (at least {})", figure(cost), figure(bound)),
        _ => String::new(),
    };
    let reason = if tried.reason.is_empty() { String::new() } else { format!(": {}", tried.reason) };
    format!("{status}{cost}{reason}")
}

/// Neighbours with the same outcome and reason in one line: (from, to, one of them).
fn grouped(tried: &[Tried]) -> Vec<(usize, usize, &Tried)> {
    let mut groups: Vec<(usize, usize, &Tried)> = Vec::new();
    for one in tried {
        match groups.last_mut() {
            Some((_, to, first))
                if first.status == one.status && first.reason == one.reason && one.cost.is_none() =>
            {
                *to = one.n_grasps;
            }
            _ => groups.push((one.n_grasps, one.n_grasps, one)),
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::tests::example;

    fn tried(n_grasps: usize, status: TriedStatus, reason: &str) -> Tried {
        Tried { n_grasps, status, reason: reason.into(), cost: None, lower_bound: None, nodes: 0 }
    }

    #[test]
    fn neighbours_with_one_reason_share_a_line() {
        let list = [
            tried(1, TriedStatus::Infeasible, "too few turns"),
            tried(2, TriedStatus::Infeasible, "too few turns"),
            tried(3, TriedStatus::Infeasible, "no path"),
        ];
        let groups: Vec<_> = grouped(&list).iter().map(|(from, to, _)| (*from, *to)).collect();
        assert_eq!(groups, [(1, 2), (3, 3)]);
    }

    #[test]
    fn a_run_without_certificates_says_so() {
        let mut results = example();
        assert_eq!(certification(&results), "all segments certified");
        results.record.certify = CertifyMethod::None;
        assert_eq!(certification(&results), "not certified");
        let folder = tempfile::tempdir().unwrap();
        let run = RunDirectory::create_at(&folder.path().join("run")).unwrap();
        let summary = Summary::of(&run, &results);
        assert!(summary.text().contains("not certified"));
        assert!(serde_json::to_string(&summary).unwrap().contains("not certified"));
    }

    #[test]
    fn excluded_pairs_are_printed() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunDirectory::create_at(&folder.path().join("run")).unwrap();
        assert!(Summary::of(&run, &example()).text().contains("a / b"));
    }
}
