//! Progress for people: bars on a terminal, a line for each stage that ends elsewhere.

use crate::pipeline::{ProgressSink, StageProgress};
use crate::quantity::count;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use ipc_types::stage_name::StageName;
use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::time::Duration;

/// Bars, or lines.
pub struct Progress {
    /// `None` where standard error is no terminal.
    bars: Option<MultiProgress>,
    by_stage: BTreeMap<StageName, ProgressBar>,
    ended: BTreeMap<StageName, String>,
}

impl Progress {
    /// Draws on standard error.
    pub fn new() -> Progress {
        let terminal = std::io::stderr().is_terminal();
        let bars = terminal.then(|| MultiProgress::with_draw_target(ProgressDrawTarget::stderr_with_hz(10)));
        Progress { bars, by_stage: BTreeMap::new(), ended: BTreeMap::new() }
    }

    /// Takes the bars away; what follows is the summary.
    pub fn finish(&mut self) {
        for bar in self.by_stage.values() {
            bar.finish_and_clear();
        }
        self.by_stage.clear();
    }
}

impl ProgressSink for Progress {
    fn progress(&mut self, progress: &StageProgress) {
        let Some(stage) = progress.stage else { return };
        match &self.bars {
            Some(bars) => {
                let bar = self.by_stage.entry(stage).or_insert_with(|| {
                    let bar = bars.add(ProgressBar::new(0));
                    bar.set_prefix(stage.word());
                    bar.enable_steady_tick(Duration::from_millis(120));
                    bar
                });
                bar.set_style(style(progress.total > 0));
                bar.set_length(progress.total.max(progress.done));
                bar.set_position(progress.done);
                bar.set_message(line(stage, progress));
                if progress.finished {
                    bar.disable_steady_tick();
                    bar.abandon();
                }
            }
            None => {
                let line = line(stage, progress);
                if progress.finished && self.ended.get(&stage) != Some(&line) {
                    eprintln!("{:<10} {line}", stage.word());
                    self.ended.insert(stage, line);
                }
            }
        }
    }
}

/// The templates are fixed, so that a wrong one shows in the test below; then the default style is as good.
fn style(known_total: bool) -> ProgressStyle {
    let template = if known_total {
        "{prefix:10.bold} {bar:28.cyan/dim} {elapsed:>4.dim}  {wide_msg}"
    } else {
        "{prefix:10.bold} {spinner:.cyan}                            {elapsed:>4.dim}  {wide_msg}"
    };
    ProgressStyle::with_template(template)
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .progress_chars("━╸─")
}

/// What a stage counts, and its own words.
fn line(stage: StageName, progress: &StageProgress) -> String {
    let unit = match stage {
        StageName::Decompose | StageName::Certify => "region",
        StageName::Miqp => "number of grasps",
        StageName::Gcs => "segment",
    };
    let done = match stage {
        StageName::Miqp => format!("{} tried", progress.done),
        _ if progress.total > 0 => format!("{} of {}", progress.done, count(progress.total as usize, unit)),
        _ => count(progress.done as usize, unit),
    };
    if progress.message.is_empty() { done } else { format!("{done}, {}", progress.message) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn templates_are_well_formed() {
        for template in [
            "{prefix:10.bold} {bar:28.cyan/dim} {elapsed:>4.dim}  {wide_msg}",
            "{prefix:10.bold} {spinner:.cyan}                            {elapsed:>4.dim}  {wide_msg}",
        ] {
            assert!(ProgressStyle::with_template(template).is_ok());
        }
    }

    #[test]
    fn lines_count_what_the_stage_counts() {
        let mut progress =
            StageProgress { done: 3, total: 14, message: "0.97 kept".into(), ..Default::default() };
        assert_eq!(line(StageName::Certify, &progress), "3 of 14 regions, 0.97 kept");
        progress.total = 0;
        progress.message.clear();
        assert_eq!(line(StageName::Decompose, &progress), "3 regions");
    }
}
