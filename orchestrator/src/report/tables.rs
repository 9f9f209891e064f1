//! Tables: numbers of grasps tried, stages, what was asked.

use super::svg::escaped;
use crate::quantity::{bytes, figure, seconds};
use crate::results::Results;
use crate::summary::tried_words;
use ipc_types::artefact::{Tried, TriedStatus};
use std::fmt::Write;

/// One row for each ℓ that was tried.
pub fn tried(results: &Results) -> String {
    let tried = results.plan.as_ref().map_or(&[][..], |plan| &plan.tried);
    if tried.is_empty() {
        return "<p>No grasp is needed.</p>".into();
    }
    let mut html = String::from(
        "<p>Fewest grasps first. <em>Infeasible</em> and <em>at least</em> are proven by bounds that are rounded outward, over the regions below; other regions might allow more.</p><div class=\"scroll\"><table><tr><th class=\"n\">ℓ</th><th>outcome</th><th class=\"n\">cost</th><th class=\"n\">at least</th><th class=\"n\">nodes</th><th class=\"n\">time</th><th>why</th></tr>",
    );
    for one in tried {
        let cell = |value: Option<f64>| value.map_or_else(|| "–".into(), figure);
        let time = results.seconds_for(one.n_grasps).map_or_else(|| "–".into(), seconds);
        // Writing to a string does not fail, here and below.
        let _ = write!(
            html,
            "<tr><td class=\"n\">{}</td><td{}>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{time}</td><td class=\"soft\">{}</td></tr>",
            one.n_grasps,
            if matches!(one.status, TriedStatus::Optimal | TriedStatus::Feasible) {
                " class=\"good\""
            } else {
                ""
            },
            tried_words(&Tried { reason: String::new(), cost: None, ..one.clone() }),
            cell(one.cost),
            cell(one.lower_bound),
            one.nodes,
            escaped(&one.reason)
        );
    }
    html.push_str("</table></div>");
    html
}

/// What each stage cost and said of itself.
pub fn stages(results: &Results) -> String {
    let mut html = String::from(
        "<div class=\"scroll\"><table><tr><th>stage</th><th class=\"n\">wall</th><th class=\"n\">CPU</th><th class=\"n\">peak memory</th><th class=\"n\">processes</th><th class=\"n\">solver calls</th><th>what came out</th></tr>",
    );
    for stage in &results.record.stages {
        let status = results.status.get(&stage.stage);
        let _ = write!(
            html,
            "<tr><td>{}{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"soft\">{}</td></tr>",
            stage.stage.word(),
            if stage.stale { " <span class=\"bad\">stale</span>" } else { "" },
            seconds(stage.seconds),
            seconds(stage.cpu_seconds),
            bytes(stage.peak_bytes),
            stage.processes,
            status.map_or_else(|| "–".into(), |status| status.solver_calls.to_string()),
            escaped(status.map_or("", |status| &status.reason))
        );
    }
    let _ = write!(
        html,
        "<tr><td>all</td><td class=\"n\">{}</td><td></td><td></td><td></td><td></td><td></td></tr></table></div>",
        seconds(results.record.seconds)
    );
    html
}

/// What the run was asked, so that it can be repeated.
pub fn asked(results: &Results) -> String {
    let record = &results.record;
    let mut rows = vec![
        ("scene", escaped(&record.scene)),
        ("seed", record.seed.to_string()),
        ("workers", record.workers.to_string()),
        ("certify", record.certify.word().to_owned()),
    ];
    rows.extend(record.task.as_ref().map(|task| ("task", escaped(task))));
    rows.extend(record.clearance.map(|m| ("clearance", format!("{} m", figure(m)))));
    for (stage, options) in &record.options.0 {
        rows.extend(options.iter().map(|(key, value)| {
            ("option", format!("<code>{stage}.{}={}</code>", escaped(key), escaped(value)))
        }));
    }
    for (stage, words) in &record.commands.0 {
        rows.push(("in place of a stage", format!("<code>{stage}={}</code>", escaped(&words.join(" ")))));
    }
    let excluded = if record.excluded_pairs.is_empty() {
        "none".into()
    } else {
        escaped(&record.excluded_pairs.join(", "))
    };
    rows.push(("pairs left out", excluded));
    let rows = rows
        .into_iter()
        .map(|(name, value)| format!("<tr><td class=\"soft\">{name}</td><td>{value}</td></tr>"));
    format!("<table>{}</table>", rows.collect::<String>())
}
