//! `regrasp show`: an artefact as text.

use crate::cli::ShowArgs;
use crate::failure::{ExitCode, Failure};
use crate::quantity::{bytes, count, figure, share};
use ipc_types::artefact::{
    Cell, CertificatesFile, CutsFile, Estimate, LeafCut, PairProof, PathCertificateFile, PlanFile,
    PlanStatus, ProofFile, ProofNode, Region, RegionsFile, Segment, TrajectoryFile, TriedStatus,
};
use ipc_types::container::{Artefact, CertifiedPart, Kind, header};
use ipc_types::hexadecimal;
use ipc_types::store::{StoreError, read_bin, read_json};
use serde_json::Value;
use std::path::Path;

/// Prints what an artefact holds: some lines for people, or all of it as JSON.
pub fn show(args: &ShowArgs) -> Result<ExitCode, Failure> {
    let file = &args.file;
    if file.is_dir() {
        return Err(Failure::bad_input(format!(
            "{}: a folder; give one file of it, such as miqp/plan.bin",
            file.display()
        )));
    }
    if file.extension().is_some_and(|extension| extension == "json") {
        let value: Value = read_json(file)?;
        super::print_json(&value)?;
        return Ok(ExitCode::Done);
    }
    let content = std::fs::read(file).map_err(|source| StoreError::Read { file: file.clone(), source })?;
    let head = header(file, &content).map_err(StoreError::from)?;
    if !args.json {
        super::print(
            format!(
                "{}: {}, {}, scene {}\n",
                file.display(),
                head.kind.word(),
                bytes(content.len() as u64),
                &hexadecimal(&head.scene_digest)[..16]
            )
            .as_bytes(),
        )?;
    }
    match head.kind {
        Kind::Regions => print_as::<RegionsFile>(args, regions),
        Kind::Certificates => print_as::<CertificatesFile>(args, certificates),
        Kind::Plan => print_as::<PlanFile>(args, plan),
        Kind::Trajectory => print_as::<TrajectoryFile>(args, trajectory),
        Kind::Cuts => print_as::<CutsFile>(args, |file| file.cuts.iter().map(cut).collect()),
        Kind::Region => print_as::<Region>(args, |one| vec![region(one)]),
        Kind::CertifiedPart => print_as::<CertifiedPart>(args, |part| {
            let mut lines =
                vec![format!("candidate {}: {}", part.candidate_id, count(part.regions.len(), "region"))];
            lines.extend(part.regions.iter().map(region));
            lines.extend((!part.reason.is_empty()).then(|| part.reason.clone()));
            lines
        }),
        Kind::Segment => print_as::<Segment>(args, |one| vec![segment(0, one)]),
        Kind::Cut => print_as::<LeafCut>(args, |one| vec![cut(one)]),
        Kind::PathCertificate => print_as::<PathCertificateFile>(args, path_certificate),
        Kind::Proof => print_as::<ProofFile>(args, proof),
    }?;
    Ok(ExitCode::Done)
}

fn print_as<A: Artefact>(args: &ShowArgs, lines: impl Fn(&A) -> Vec<String>) -> Result<(), Failure> {
    let value: A = read(&args.file)?;
    if args.json {
        super::print_json(&value)
    } else {
        super::print((lines(&value).join("\n") + "\n").as_bytes())
    }
}

fn read<A: Artefact>(file: &Path) -> Result<A, Failure> {
    Ok(read_bin(file, None)?)
}

fn regions(file: &RegionsFile) -> Vec<String> {
    let mut lines =
        vec![format!("{} over ({})", count(file.regions.len(), "region"), file.coordinates.join(", "))];
    if let Some(coverage) = &file.coverage {
        let estimate = |Estimate(value, low, high): Estimate| {
            format!("{} [{}, {}]", share(value), share(low), share(high))
        };
        lines.push(format!("covers {} of CS_free", estimate(coverage.total)));
        lines.extend(coverage.grasp.map(|e| format!("covers {} of CG_free", estimate(e))));
        lines.extend(coverage.placement.map(|e| format!("covers {} of CP_free", estimate(e))));
    }
    lines.extend(file.regions.iter().map(region));
    lines
}

fn proof(file: &ProofFile) -> Vec<String> {
    let mut lines = vec![format!(
        "{} of multipliers: {} empty, {} apart, {} contained in another; {}",
        count(file.multipliers.len(), "list"),
        count(file.empty.len(), "set"),
        count(file.apart.len(), "pair"),
        count(file.contained.len(), "region"),
        count(file.cuts.len(), "leaf cut")
    )];
    for search in &file.searches {
        let leaves = search.nodes.iter().filter(|node| matches!(node, ProofNode::Leaf(_))).count();
        let grasps = if search.first == search.last {
            format!("ℓ = {}", search.first)
        } else {
            format!("ℓ = {} … {}", search.first, search.last)
        };
        lines.push(format!("  {grasps}: {}, {leaves} of them leaves", count(search.nodes.len(), "node")));
    }
    lines
}

fn path_certificate(file: &PathCertificateFile) -> Vec<String> {
    let mut lines = vec![format!(
        "{} against {} of bodies, clearance {} m",
        count(file.pieces.len(), "piece"),
        count(file.pairs.len(), "pair"),
        file.clearance
    )];
    for (piece_idx, piece) in file.pieces.iter().enumerate() {
        let mode = piece.mode.map(|mode| format!(", {}", mode.word())).unwrap_or_default();
        let proof = if piece.intervals.is_empty() && !file.pairs.is_empty() {
            "not certified".to_owned()
        } else {
            count(piece.intervals.iter().map(Vec::len).sum(), "interval")
        };
        lines.push(format!(
            "  piece {piece_idx}: order {}{mode}, {proof}",
            piece.control_points.len().saturating_sub(1)
        ));
    }
    lines
}

fn region(region: &Region) -> String {
    let parent = region.parent.map(|id| format!(", from candidate {id}")).unwrap_or_default();
    let certified = if region.certified { "certified" } else { "not certified" };
    format!(
        "  region {}: {}, {}, {certified}{parent}, centre {}",
        region.id,
        count(region.b.len(), "face"),
        region.method,
        configuration(&region.center)
    )
}

fn certificates(file: &CertificatesFile) -> Vec<String> {
    let mut lines = vec![count(file.regions.len(), "certificate")];
    for certificate in &file.regions {
        let (mut n_leaves, mut n_sums) = (0, 0);
        for pair in &certificate.pairs {
            match &pair.proof {
                PairProof::Swept(proof) => {
                    n_leaves += proof.cells.iter().filter(|cell| !matches!(cell, Cell::Split { .. })).count();
                }
                PairProof::SumOfSquares(_) => n_sums += 1,
            }
        }
        let sums = if n_sums > 0 { format!(", {n_sums} of them by sums of squares") } else { String::new() };
        lines.push(format!(
            "  region {}: {} of bodies{sums}, {}",
            certificate.region_id,
            count(certificate.pairs.len(), "pair"),
            count(n_leaves, "proven cell")
        ));
    }
    lines
}

fn plan(plan: &PlanFile) -> Vec<String> {
    let status = match plan.status {
        PlanStatus::Optimal => "optimal",
        PlanStatus::Feasible => "feasible",
        PlanStatus::Infeasible => "infeasible",
    };
    let grasps = plan.n_grasps.map(|n| format!(", {}", count(n, "grasp"))).unwrap_or_default();
    let cost = plan.cost.map(|c| format!(", cost {}", figure(c))).unwrap_or_default();
    let bound = plan.lower_bound.map(|c| format!(", lower bound {}", figure(c))).unwrap_or_default();
    let mut lines = vec![format!("{status}{grasps}{cost}{bound}")];
    for tried in &plan.tried {
        let status = match tried.status {
            TriedStatus::Infeasible => "infeasible",
            TriedStatus::Optimal => "optimal",
            TriedStatus::Feasible => "feasible",
            TriedStatus::Limit => "limit",
        };
        lines.push(format!(
            "  ℓ = {}: {status}, {}; {}",
            tried.n_grasps,
            count(tried.nodes as usize, "node"),
            tried.reason
        ));
    }
    for (idx, q) in plan.configurations.iter().flatten().enumerate() {
        let region = plan.regions.as_ref().and_then(|ids| ids.get(idx)).map(|id| format!(" in region {id}"));
        lines.push(format!("  x_{idx} = {}{}", configuration(q), region.unwrap_or_default()));
    }
    lines
}

fn trajectory(file: &TrajectoryFile) -> Vec<String> {
    let mut lines = vec![format!(
        "{} over ({}), length {}",
        count(file.segments.len(), "segment"),
        file.coordinates.join(", "),
        figure(file.length)
    )];
    lines.extend(file.segments.iter().enumerate().map(|(idx, one)| segment(idx, one)));
    lines
}

fn segment(idx: usize, segment: &Segment) -> String {
    let certified = if segment.certified { "certified" } else { "not certified" };
    format!(
        "  segment {idx}: {}, {}, length {} (at least {}), {certified}",
        segment.mode.word(),
        count(segment.pieces.len(), "piece"),
        figure(segment.length),
        figure(segment.lower_bound)
    )
}

fn cut(cut: &LeafCut) -> String {
    format!("  {}: from {:?} out through {:?}", cut.mode.word(), cut.reached, cut.exits)
}

fn configuration(q: &[f64]) -> String {
    format!("({})", q.iter().map(|value| figure(*value)).collect::<Vec<_>>().join(", "))
}
