//! `regrasp-certify grow SCENE --at Q…`: certified regions grown about configurations by sums of squares.

use certificates::sums::grow::{GrowError, GrowSettings, Grower};
use certificates::{Candidate, Certifier, CertifyOptions, CertifyOutcome, Method, Purpose};
use ipc_types::artefact::{CertificatesFile, RegionsFile};
use ipc_types::store;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use scene::{CollisionPair, Scene};
use serde::Serialize;
use stage_kit::{Outcome, StageError};
use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

/// Arguments of `grow`.
#[derive(Debug, Clone, clap::Args)]
pub struct GrowArgs {
    /// Scene folder, or its `scene.toml`.
    pub scene: PathBuf,
    /// Seed: a configuration, its coordinates separated by commas, in the scene's order. May stand several times.
    #[arg(long, value_name = "Q", required = true, allow_hyphen_values = true)]
    pub at: Vec<String>,
    /// Task whose clearance holds. Without it bodies are proven not to touch.
    #[arg(long, value_name = "T")]
    pub task: Option<String>,
    /// Most alternations between multipliers and faces. Larger: more volume, more time.
    #[arg(long, value_name = "N", default_value_t = 20)]
    pub iterations: usize,
    /// Growth of the ellipsoid's volume, as a share, below which the margin falls. Smaller: more volume, more time.
    #[arg(long, value_name = "SHARE", default_value_t = 0.05)]
    pub least_growth: f64,
    /// The margin that multipliers are sought for at first, metres; it falls when growth is slow.
    #[arg(long, value_name = "M", default_value_t = 0.1)]
    pub max_margin: f64,
    /// Folder for `regions.bin`, `regions.json` and `certificates.bin`.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// What became of a seed, one line of JSON each on standard output.
#[derive(Debug, Clone, Serialize)]
struct SeedLine {
    seed: Vec<f64>,
    /// Volume of the ellipsoid in TC-space before the first and after each alternation, relative to the unit ball's.
    ellipsoid_volumes: Vec<f64>,
    /// Volume of the certified region, estimated from samples, as a share of the box of joint limits.
    share_of_joint_box: f64,
    /// Width that certification has left of the grown region.
    width_kept: f64,
    faces: usize,
    seconds: f64,
    reason: String,
}

/// Samples by which volumes are estimated.
const VOLUME_SAMPLES: usize = 100_000;

/// Grows a region about each seed and certifies it. Seeds without a region make the outcome negative.
pub fn run(args: &GrowArgs, out: &mut dyn Write) -> Result<Outcome, StageError> {
    let scene = Scene::load(&args.scene).map_err(StageError::bad_input)?;
    let task = args.task.as_deref().map(|name| scene.task(Some(name))).transpose();
    let task = task.map_err(StageError::bad_input)?;
    let clearance = |pair: CollisionPair| task.map_or(0.0, |task| scene.required_clearance(task, pair));
    let settings = GrowSettings {
        max_iterations: args.iterations,
        least_growth: args.least_growth,
        max_margin: args.max_margin,
        solver: conic::Settings::default(),
    };
    let options = CertifyOptions { method: Method::Sos, ..CertifyOptions::default() };
    let certifier = Certifier::new(&scene, clearance, &options, 0).map_err(StageError::bad_input)?;
    let whole: f64 = scene.coordinates.iter().map(|c| c.upper - c.lower).product();
    let (mut regions, mut certificates) = (Vec::new(), Vec::new());
    for (seed_idx, text) in args.at.iter().enumerate() {
        let seed = parse(text).map_err(StageError::bad_input)?;
        let start = Instant::now();
        let mut line = SeedLine {
            seed: seed.clone(),
            ellipsoid_volumes: Vec::new(),
            share_of_joint_box: 0.0,
            width_kept: 0.0,
            faces: 0,
            seconds: 0.0,
            reason: String::new(),
        };
        let grown =
            Grower::new(&scene, clearance, &seed, settings.clone()).and_then(|grower| grower.grow(&seed));
        match grown {
            Err(error @ GrowError::Seed) => line.reason = error.to_string(),
            Err(error) => return Err(StageError::bad_input(error)),
            Ok(grown) => {
                line.ellipsoid_volumes = grown.ellipsoid_volumes;
                let region_id = seed_idx as u64;
                let candidate = Candidate { region_id, polyhedron: grown.polyhedron, center: grown.center };
                let outcome = certifier
                    .certify_region(&candidate, &Purpose::default(), &|| false)
                    .map_err(StageError::failed)?;
                match outcome {
                    CertifyOutcome::Certified(region) => {
                        let mut rng = ChaCha8Rng::seed_from_u64(region_id);
                        let volume = region.polyhedron.estimate_volume(VOLUME_SAMPLES, &mut rng);
                        line.share_of_joint_box = volume.map_or(0.0, |volume| volume.volume / whole);
                        line.width_kept = region.volume_kept.powf(1.0 / scene.dim() as f64);
                        line.faces = region.polyhedron.n_faces();
                        let artefact = wire::Region {
                            id: region_id,
                            parent: None,
                            polyhedron: region.polyhedron,
                            center: region.center,
                            method: "c-iris".to_owned(),
                            certified: true,
                            margin: task.map_or(0.0, |task| task.clearance),
                        };
                        regions.push(artefact.to_artefact());
                        certificates.push(region.certificate);
                    }
                    CertifyOutcome::Rejected { reason, .. } => line.reason = reason,
                    CertifyOutcome::Limit { .. } | CertifyOutcome::Stopped => {
                        line.reason = "it was stopped".to_owned();
                    }
                }
            }
        }
        line.seconds = start.elapsed().as_secs_f64();
        let text = ipc_types::json::to_text(&line).map_err(StageError::failed)?;
        // A closed pipe is the reader's choice.
        let _ = out.write_all(&text).and_then(|()| out.write_all(b"\n"));
    }
    let n_grown = regions.len();
    if let Some(folder) = &args.out {
        let coordinates = scene.coordinates.iter().map(|c| c.name.clone()).collect();
        let file = RegionsFile { coordinates, regions, coverage: None };
        store::write_artefact(folder, "regions", &file, &scene.digest).map_err(StageError::failed)?;
        let file = CertificatesFile { regions: certificates };
        store::write_bin(folder, "certificates", &file, &scene.digest).map_err(StageError::failed)?;
    }
    let words = format!("{n_grown} of {} seeds grew to a certified region", args.at.len());
    Ok(if n_grown == args.at.len() { Outcome::Done(words) } else { Outcome::Negative(words) })
}

fn parse(text: &str) -> Result<Vec<f64>, String> {
    text.split(',')
        .map(|word| match word.trim().parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => Err(format!("--at {text}: '{word}' is no number; give the coordinates separated by commas")),
        })
        .collect()
}
