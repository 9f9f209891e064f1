//! What is certified, and what that rests on, in words that claim no more than holds.

use super::svg::escaped;
use crate::cli::CertifyMethod;
use crate::quantity::figure;
use crate::results::Results;
use crate::run_record::Asked;
use ipc_types::artefact::PlanStatus;
use std::fmt::Write;

/// The statement as HTML.
pub fn statement(results: &Results) -> String {
    let mut html = motion(results);
    html.push_str(&answer(results));
    html.push_str(&acceptance(results));
    let excluded = &results.record.excluded_pairs;
    if !excluded.is_empty() {
        // Writing to a string does not fail.
        let _ = write!(
            html,
            "<p>The scene leaves these pairs out of collision, so nothing is said of them: {}.</p>",
            escaped(&excluded.join(", "))
        );
    }
    html
}

fn motion(results: &Results) -> String {
    if results.record.certify == CertifyMethod::None {
        return "<p><strong class=\"bad\">Not certified.</strong> The run was asked to do without certificates. The regions were sampled: they may contain collisions, and so may the path.</p>".into();
    }
    let regions =
        results.regions.as_ref().map_or(0, |file| file.regions.iter().filter(|r| r.certified).count());
    match results.certified() {
        Some(true) => format!(
            "<p><strong class=\"good\">Certified.</strong> Every point of the motion lies in one of {regions} regions, and {}",
            proven_of_regions(results)
        ),
        Some(false) => {
            let open = results
                .trajectory
                .iter()
                .flat_map(|t| t.segments.iter().enumerate())
                .filter(|(_, s)| !s.certified);
            let numbers: Vec<String> = open.map(|(idx, _)| idx.to_string()).collect();
            format!(
                "<p><strong class=\"bad\">Not certified.</strong> Segments {} pass through regions without a certificate; these may contain collisions.</p>",
                numbers.join(", ")
            )
        }
        None if results.record.asked == Asked::Regions && regions > 0 => format!(
            "<p><strong class=\"good\">{regions} regions are certified</strong>: {}",
            proven_of_regions(results)
        ),
        None => format!("<p>There is no motion to certify; {regions} regions are certified.</p>"),
    }
}

/// What holds in certified regions, and on what that rests; the end of a sentence and a list.
fn proven_of_regions(results: &Results) -> String {
    let margins = results.regions.iter().flat_map(|file| &file.regions).map(|region| region.margin);
    let clearance = margins.fold(f64::INFINITY, f64::min);
    let kept = if clearance > 0.0 && clearance.is_finite() {
        format!("at least {} m apart", figure(clearance))
    } else {
        "disjoint".into()
    };
    format!(
        "in all of a certified region every pair of bodies that may collide is {kept}. This rests on</p><ul><li>the scene file: what is not modelled is not seen;</li><li>separating planes that hold on whole cells of each region, for every configuration in them and not for samples, stored in <code>certify/certificates.bin</code>;</li><li>bounds that are rounded outward; no solver's tolerance and no sample is part of the argument.</li></ul>"
    )
}

fn answer(results: &Results) -> String {
    if results.record.asked == Asked::Regions {
        return "<p>Regions were asked for, and no plan.</p>".into();
    }
    let Some(plan) = &results.plan else {
        return format!(
            "<p>There is no plan: {}.</p>",
            escaped(results.record.outcome.message.trim_end_matches('.'))
        );
    };
    // The words of a program in place of miqp count for no more than it gives to check.
    let (claim, evidence) = if results.has_proof {
        let evidence = "The evidence, multipliers and a tree, is in <code>miqp/proof.bin</code>; <code>regrasp check</code> replays it against the regions and the scene alone.";
        ("Proven", evidence)
    } else {
        ("Claimed by the planner", "There is no <code>miqp/proof.bin</code>, so it cannot be checked.")
    };
    match (plan.status, plan.n_grasps) {
        (PlanStatus::Infeasible, _) => format!(
            "<p>{claim}: no motion <em>within these regions</em> has at most {} grasps. Larger or other regions might allow one. {evidence}</p>",
            plan.tried.last().map_or(0, |tried| tried.n_grasps)
        ),
        (PlanStatus::Optimal, Some(n)) => {
            let fewer = match n {
                0 => "no grasp is needed".to_owned(),
                _ => format!("no motion within these regions has fewer than {n} grasps"),
            };
            let bound = match (plan.cost, plan.lower_bound) {
                (Some(cost), Some(bound)) => format!(
                    ", and the squared steps between grasp and release configurations sum to at least {}; here {}",
                    figure(bound),
                    figure(cost)
                ),
                _ => String::new(),
            };
            format!("<p>{claim}: {fewer}{bound}. {evidence}</p>")
        }
        (_, Some(n)) => format!(
            "<p>{n} grasps: fewer, or a lower cost, may be possible over these regions; that is not proven.</p>"
        ),
        _ => String::new(),
    }
}

fn acceptance(results: &Results) -> String {
    let Some(acceptance) = &results.record.acceptance else {
        return String::new();
    };
    let verdict = if acceptance.accepted {
        "<span class=\"good\">passed</span>"
    } else {
        "<span class=\"bad\">failed</span>"
    };
    let lines: String = acceptance.lines.iter().map(|line| format!("<li>{}</li>", escaped(line))).collect();
    format!("<p>Acceptance check of the finished plan: {verdict}.</p><ul>{lines}</ul>")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::results::tests::example;

    #[test]
    fn nothing_is_called_certified_that_is_not() {
        let mut results = example();
        assert!(statement(&results).contains("Certified."));
        if let Some(trajectory) = &mut results.trajectory {
            trajectory.segments[1].certified = false;
        }
        let text = statement(&results);
        assert!(text.contains("Not certified.") && text.contains("Segments 1 "));
        results.record.certify = CertifyMethod::None;
        assert!(statement(&results).starts_with("<p><strong class=\"bad\">Not certified."));
    }

    #[test]
    fn a_run_of_regions_speaks_of_regions_only() {
        let mut results = example();
        (results.plan, results.trajectory) = (None, None);
        results.record.asked = Asked::Regions;
        let text = statement(&results);
        assert!(text.contains("1 regions are certified") && !text.contains("There is no plan"), "{text}");
        results.regions = None;
        assert!(!statement(&results).contains("class=\"good\""));
    }

    #[test]
    fn infeasible_is_said_of_the_regions_only() {
        let mut results = example();
        if let Some(plan) = &mut results.plan {
            plan.status = PlanStatus::Infeasible;
            plan.n_grasps = None;
        }
        results.trajectory = None;
        assert!(statement(&results).contains("within these regions"));
    }

    #[test]
    fn an_answer_without_evidence_is_a_claim() {
        let mut results = example();
        if let Some(plan) = &mut results.plan {
            plan.status = PlanStatus::Optimal;
        }
        results.has_proof = true;
        assert!(statement(&results).contains("Proven:"));
        results.has_proof = false;
        let text = statement(&results);
        assert!(text.contains("Claimed by the planner:") && !text.contains("Proven"), "{text}");
    }
}
