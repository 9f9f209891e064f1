//! `regrasp-check RUN`: verifies the proof that a run directory carries. `regrasp-check --path CERTIFICATE --scene SCENE
//! PATH`: verifies that of a path.

use check::answer::Answer;
use check::path;
use check::run::{self, Rejection};
use clap::Parser;
use ipc_types::exit_code::ExitCode;
use ipc_types::{artefact::PathCertificateFile, path_input, store};
use scene::Scene;
use std::path::{Path, PathBuf};

/// Verifies a run: that its files are whole and of one scene, that its certificates prove its regions free of
/// collision, that plan and trajectory stay inside them, keep what their modes keep, and reach the goal, and that no
/// motion over the regions has fewer grasps or a lower cost than the plan says, or that there is none at all. With
/// --path it verifies the certificate of a path instead, as `regrasp certify-path --out` writes it.
///
/// Exit codes: 0 accepted; 1 rejected, and why; 2 not a run directory, or a scene or path that cannot be read.
#[derive(Debug, Parser)]
#[command(name = "regrasp-check", version)]
struct Arguments {
    /// Run directory, as `regrasp plan` writes it; with --path the path, a table or a `trajectory.json`.
    run: PathBuf,
    /// Certificate of a path: `path.bin` or `path.json`.
    #[arg(long, value_name = "CERTIFICATE", requires = "scene")]
    path: Option<PathBuf>,
    /// Scene of the path: a folder, or its `scene.toml`.
    #[arg(long, value_name = "SCENE", requires = "path")]
    scene: Option<PathBuf>,
    /// Least clearance in metres that the certificate of the path must prove.
    #[arg(long, value_name = "M", default_value_t = 0.0, requires = "path")]
    clearance: f64,
    /// With --path: how far in metres what is held may be from where the path has it when the holding begins or ends.
    #[arg(long, value_name = "M", default_value_t = 1e-6, requires = "path")]
    tol_held: f64,
    /// Print the verdict as JSON on standard output.
    #[arg(long)]
    json: bool,
}

fn main() {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            // Neither help nor a complaint about arguments can be printed where the streams are closed.
            let _ = error.print();
            let code = if error.use_stderr() { ExitCode::BadInput } else { ExitCode::Done };
            std::process::exit(code.code());
        }
    };
    let code = match (&arguments.path, &arguments.scene) {
        (Some(certificate), Some(scene)) => check_path(&arguments, certificate, scene),
        _ => check(&arguments),
    };
    std::process::exit(code.code());
}

fn check_path(arguments: &Arguments, certificate: &Path, scene: &Path) -> ExitCode {
    match verify_path(arguments, certificate, scene) {
        Ok(verdict) => {
            if arguments.json {
                println!("{}", serde_json::json!({ "accepted": true, "verdict": verdict }));
            } else {
                eprintln!(
                    "accepted: {} pieces proven free against {} pairs with a clearance of {} m, by {} intervals",
                    verdict.n_pieces, verdict.n_pairs, verdict.clearance, verdict.n_intervals
                );
                if let Some(residual) = verdict.kept_residual {
                    eprintln!("kept forms change by at most {residual:e}");
                }
                if let Some(residual) = verdict.held_residual {
                    eprintln!(
                        "held: {}; within {residual:e} m of the path at its ends",
                        verdict.held.join(", ")
                    );
                }
            }
            ExitCode::Done
        }
        Err((code, reason)) => {
            if arguments.json {
                println!("{}", serde_json::json!({ "accepted": false, "reason": reason }));
            } else {
                eprintln!("rejected: {reason}");
            }
            code
        }
    }
}

fn verify_path(
    arguments: &Arguments,
    certificate: &Path,
    scene: &Path,
) -> Result<path::PathVerdict, (ExitCode, String)> {
    let scene = Scene::load(scene).map_err(|error| (ExitCode::BadInput, error.to_string()))?;
    let names: Vec<String> = scene.coordinates.iter().map(|c| c.name.clone()).collect();
    let pieces =
        path_input::read(&arguments.run, &names).map_err(|error| (ExitCode::BadInput, error.to_string()))?;
    let is_text = certificate.extension().is_some_and(|extension| extension == "json");
    let file: Result<PathCertificateFile, _> = if is_text {
        store::read_json(certificate)
    } else {
        store::read_bin(certificate, Some(&scene.digest))
    };
    let file = file.map_err(|error| (ExitCode::Negative, error.to_string()))?;
    path::verify(&scene, &file, &pieces, arguments.clearance, arguments.tol_held)
        .map_err(|error| (ExitCode::Negative, error.to_string()))
}

fn check(arguments: &Arguments) -> ExitCode {
    match run::verify(&arguments.run) {
        Ok(verdict) => {
            if arguments.json {
                println!("{}", serde_json::json!({ "accepted": true, "verdict": verdict }));
            } else {
                let apart = match verdict.clearance {
                    0.0 => String::new(),
                    clearance => format!(" with a clearance of {clearance} m"),
                };
                let motion = match verdict.n_control_points {
                    0 => String::new(),
                    n => format!("; {n} control points inside them"),
                };
                let sums = match verdict.n_sos_points {
                    0 => String::new(),
                    n => format!(" and sums of squares for {n} points"),
                };
                let (n_regions, n_cells) = (verdict.n_regions, verdict.n_cells);
                eprintln!(
                    "accepted: {n_regions} regions proven free by {n_cells} cells{sums}{apart}{motion}"
                );
                if let Some(answer) = &verdict.answer {
                    eprintln!("proven over these regions: {}", proven(answer));
                }
                for claim in &verdict.not_verified {
                    eprintln!("not verified: {claim}");
                }
            }
            ExitCode::Done
        }
        Err(rejection) => {
            if arguments.json {
                println!("{}", serde_json::json!({ "accepted": false, "reason": rejection.to_string() }));
            } else {
                eprintln!("rejected: {rejection}");
            }
            match rejection {
                Rejection::Record { .. } if !arguments.run.join("run.json").exists() => ExitCode::BadInput,
                _ => ExitCode::Negative,
            }
        }
    }
}

/// What is proven of the number of grasps and of the cost, in words.
fn proven(answer: &Answer) -> String {
    let nodes = format!("({} nodes replayed)", answer.n_nodes);
    match (answer.cost, answer.cost_lower_bound) {
        (Some(cost), Some(bound)) => {
            let fewer = match answer.fewest {
                0 => "no grasp is needed".to_owned(),
                fewest => format!("no motion has fewer than {}", grasps(fewest)),
            };
            format!("{fewer}; as many as here cost at least {bound:.6}, here {cost:.6} {nodes}")
        }
        (Some(_), None) => format!("no motion has fewer than {} {nodes}", grasps(answer.fewest)),
        _ => format!("there is no motion with at most {} {nodes}", grasps(answer.fewest.saturating_sub(1))),
    }
}

fn grasps(n: usize) -> String {
    format!("{n} {}", if n == 1 { "grasp" } else { "grasps" })
}
