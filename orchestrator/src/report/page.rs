//! The page: headline, figures, and a section for each thing that one wants to know of a run.

use super::svg::escaped;
use super::{bars, slices, statement, tables, timeline};
use crate::quantity::{bytes, figure, seconds, share};
use crate::results::Results;
use crate::summary::certification;
use ipc_types::artefact::RegionsFile;
use std::fmt::Write;

const STYLE: &str = include_str!("style.css");

/// The whole HTML document. `run` names the run directory.
pub fn page(run: &str, results: &Results) -> String {
    let record = &results.record;
    let scene = scene_title(&record.scene);
    let mut html = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n<title>{0} · regrasp</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n",
        escaped(&scene)
    );
    let task = record.task.as_ref().map(|task| format!(" · task {}", escaped(task))).unwrap_or_default();
    // Writing to a string does not fail, here and below.
    let _ = writeln!(
        html,
        "<header><p class=\"kicker\">{}{task} · seed {}</p><h1>{}</h1></header>",
        escaped(&scene),
        record.seed,
        escaped(&headline(results))
    );
    tiles(&mut html, results);
    section(&mut html, "What is certified, and on what it rests", &statement::statement(results));
    let shown = shown_regions(results);
    let ranges = shown.map_or_else(Vec::new, |file| {
        slices::ranges(&file.coordinates, &file.regions, results.trajectory.as_ref())
    });
    if let Some(trajectory) = &results.trajectory {
        let figure = format!(
            "<figure class=\"scroll\">{}<figcaption><i class=\"key\" style=\"background:var(--held)\"></i>object held, numbered by grasp; ● grasp, ○ release</figcaption></figure>",
            timeline::timeline(trajectory, &ranges)
        );
        section(&mut html, "The plan over the length travelled", &figure);
    }
    if results.plan.is_some() {
        section(&mut html, "How many grasps", &tables::tried(results));
    }
    if let Some(file) = shown {
        section(&mut html, "Regions", &regions(file, results, &ranges));
    }
    if results.candidates.iter().chain(&results.regions).any(|file| file.coverage.is_some()) {
        section(&mut html, "Coverage", &bars::coverage(results));
    }
    section(&mut html, "Time and memory", &format!("{}{}", bars::stages(results), tables::stages(results)));
    section(&mut html, "Asked", &tables::asked(results));
    let digest = if record.scene_digest.is_empty() { "unknown" } else { &record.scene_digest };
    let _ = writeln!(
        html,
        "<footer><p>regrasp {} · {} · scene digest <code>{}</code></p></footer>\n</main>\n</body>\n</html>",
        escaped(&record.version),
        escaped(run),
        escaped(digest)
    );
    html
}

/// Name of the scene's folder.
fn scene_title(scene: &str) -> String {
    let path = std::path::Path::new(scene.trim_end_matches("scene.toml"));
    path.file_name().map_or_else(|| scene.to_owned(), |name| name.to_string_lossy().into_owned())
}

fn headline(results: &Results) -> String {
    let grasps = results.plan.as_ref().and_then(|plan| plan.n_grasps);
    match (grasps, &results.trajectory, results.record.outcome.exit_code) {
        (Some(0), Some(_), 0) => "The start already is the goal".into(),
        (Some(1), Some(_), 0) => format!("One grasp, {}", certification(results)),
        (Some(n), Some(_), 0) => format!("{n} grasps, {}", certification(results)),
        _ => results.record.outcome.message.lines().next().unwrap_or("The run has not ended").to_owned(),
    }
}

/// Certified regions if there are some, else the candidates.
fn shown_regions(results: &Results) -> Option<&RegionsFile> {
    results.regions.as_ref().filter(|file| !file.regions.is_empty()).or(results.candidates.as_ref())
}

fn tiles(html: &mut String, results: &Results) {
    html.push_str("<dl class=\"tiles\">");
    let mut tile = |name: &str, value: String, small: String| {
        let _ = write!(html, "<div><dt>{name}</dt><dd>{value}<small>{small}</small></dd></div>");
    };
    if let Some(n) = results.plan.as_ref().and_then(|plan| plan.n_grasps) {
        let proven = results.plan.iter().flat_map(|plan| &plan.tried).filter(|t| t.n_grasps < n);
        let small = match proven.count() {
            0 => String::new(),
            1 => "one fewer is proven impossible over the regions".into(),
            count => format!("1 … {count} are proven impossible over the regions"),
        };
        tile("grasps", n.to_string(), small);
    }
    if let Some(trajectory) = &results.trajectory {
        let bound = results.length_bound().map(|b| format!("at least {}", figure(b))).unwrap_or_default();
        tile("length", figure(trajectory.length), bound);
    }
    if let Some(certified) = results.certified() {
        let (class, word) = if certified { ("good", "all") } else { ("bad", "not certified") };
        let n = results.trajectory.as_ref().map_or(0, |t| t.segments.len());
        tile("certified segments", format!("<span class=\"{class}\">{word}</span>"), format!("{n} segments"));
    }
    if let Some(coverage) = results.candidates.as_ref().and_then(|file| file.coverage.as_ref()) {
        tile("coverage of CS_free", share(coverage.total.0), "before certification".into());
    }
    tile("time", seconds(results.record.seconds), format!("{} workers", results.record.workers));
    let peak = results.record.stages.iter().map(|stage| stage.peak_bytes).max().unwrap_or(0);
    tile("peak memory", bytes(peak), "of one process".into());
    html.push_str("</dl>\n");
}

fn section(html: &mut String, title: &str, body: &str) {
    let _ = writeln!(html, "<section><h2>{title}</h2>\n{body}\n</section>");
}

fn regions(file: &RegionsFile, results: &Results, ranges: &[(f64, f64)]) -> String {
    let volumes = results.volumes_kept();
    let least = volumes.iter().copied().reduce(f64::min);
    let kept = least
        .map(|least| format!("; of its volume a candidate kept {} at least", share(least)))
        .unwrap_or_default();
    let certified = file.regions.iter().filter(|region| region.certified).count();
    let faces: usize = file.regions.iter().map(|region| region.b.len()).sum();
    format!(
        "<p>{} regions with {} faces, {} certified{kept}.</p><figure>{}<figcaption>Each region is shown by its slice through its own centre; the path is projected: <i class=\"key\" style=\"background:var(--ink)\"></i>transit, <i class=\"key\" style=\"background:var(--held)\"></i>transfer, ○ start, ● goal.</figcaption></figure>",
        file.regions.len(),
        faces,
        certified,
        slices::slices(&file.coordinates, &file.regions, results.trajectory.as_ref(), ranges)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::CertifyMethod;
    use crate::results::tests::example;

    #[test]
    fn the_page_needs_nothing_from_elsewhere() {
        let html = page("runs/x/0001", &example());
        for word in ["<script", "http://", "https://", "url(", "@import", "src=", "<link"] {
            assert!(!html.contains(word), "{word}");
        }
        assert!(html.contains("prefers-color-scheme: dark"));
    }

    #[test]
    fn names_from_files_cannot_break_the_page() {
        let mut results = example();
        results.record.outcome.message = "</h1><b>".into();
        results.record.outcome.exit_code = 1;
        let html = page("<run>", &results);
        assert!(!html.contains("<finger>") && html.contains("&lt;finger&gt;"));
        assert!(!html.contains("<b>") && !html.contains("<run>"));
    }

    #[test]
    fn elements_are_balanced() {
        let html = page("run", &example());
        let count = |text: &str| html.matches(text).count();
        for element in ["section", "svg", "table", "dl", "div", "figure", "main", "ul"] {
            let (open, close) = (count(&format!("<{element}")), count(&format!("</{element}>")));
            assert_eq!(open, close, "{element}");
        }
    }

    #[test]
    fn a_run_without_certificates_says_so() {
        let mut results = example();
        results.record.certify = CertifyMethod::None;
        assert!(page("run", &results).contains("not certified"));
    }

    #[test]
    fn a_run_that_broke_off_still_has_a_page() {
        let mut results = example();
        results.plan = None;
        results.trajectory = None;
        results.regions = None;
        results.candidates = None;
        results.record.outcome.exit_code = 4;
        results.record.outcome.message = "stage miqp died; see miqp/log.txt\nmore".into();
        assert!(page("run", &results).contains("stage miqp died; see miqp/log.txt</h1>"));
    }
}
