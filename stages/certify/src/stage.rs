//! The stage: candidates in, certified regions out, on as many threads as asked for.

use certificates::{
    Candidate, Certifier, CertifyError, CertifyOptions, CertifyOutcome, EarlierCertificates, Purpose,
};
use ipc_types::artefact::Region;
use ipc_types::container::CertifiedPart;
use scene::{CollisionPair, Scene};
use serde::Serialize;
use stage_kit::{Host, Input, Job, Outcome, Stage, StageError, StageName, spans};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, mpsc};

/// A certified region's id is its candidate's plus this.
pub const CERTIFIED_ID_OFFSET: u64 = 1_000_000;

/// `regrasp-certify`.
#[derive(Debug, Default)]
pub struct CertifyStage;

/// What became of a candidate, for `status.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Account {
    candidate: u64,
    volume_kept: f64,
    faces: usize,
    cells: u64,
    cuts: usize,
    /// Pairs of bodies whose proof is of an earlier run.
    reused_pairs: usize,
    reason: String,
    /// Whether the budget ended before the answer.
    #[serde(skip)]
    is_limit: bool,
}

impl Stage for CertifyStage {
    type Options = CertifyOptions;

    const NAME: StageName = StageName::Certify;
    const ABOUT: &'static str =
        "Certificates that regions are free of collision; regions are cut where they are not";
    const READS: &'static [Input] = &[Input::Candidates];

    fn run(&mut self, job: &Job, options: &CertifyOptions, host: &mut Host) -> Result<Outcome, StageError> {
        let scene = &job.scene;
        let clearance = |pair: CollisionPair| job.required_clearance(pair);
        let certifier = Certifier::new(scene, clearance, options, job.seed).map_err(StageError::bad_input)?;
        let earlier = match &options.reuse {
            Some(run) => {
                EarlierCertificates::of_run(run, &job.coordinates()).map_err(StageError::BadInput)?
            }
            None => EarlierCertificates::default(),
        };
        let work = Work {
            scene,
            certifier: &certifier,
            purpose: &job.task.as_ref().map_or_else(Purpose::default, |task| Purpose::of_task(scene, task)),
            margin: job.clearance,
            earlier: &earlier,
        };
        let accounts = certify_all(&work, options, host)?;
        let n_certified = accounts.values().filter(|account| account.faces > 0).count();
        let rejected: Vec<&Account> = accounts.values().filter(|account| account.faces == 0).collect();
        host.solver_calls(accounts.values().map(|account| account.cells).sum());
        host.detail("candidates", accounts.values().collect::<Vec<_>>());
        let words = format!("{n_certified} of {} candidates certified", accounts.len());
        match rejected.first() {
            Some(first) if n_certified == 0 => {
                let words = format!("{words}; candidate {}: {}", first.candidate, first.reason);
                // A limit that was hit proves nothing.
                let is_limit = rejected.iter().any(|account| account.is_limit);
                Ok(if is_limit { Outcome::Limit(words) } else { Outcome::Negative(words) })
            }
            Some(first) => {
                Ok(Outcome::Done(format!("{words}; not candidate {}: {}", first.candidate, first.reason)))
            }
            None => Ok(Outcome::Done(words)),
        }
    }
}

struct Work<'a> {
    scene: &'a Scene,
    certifier: &'a Certifier,
    purpose: &'a Purpose,
    margin: f64,
    earlier: &'a EarlierCertificates,
}

type Certified = (CertifiedPart, Account);

/// What a thread made of a region; `None` if it was stopped.
type Result1 = Result<Option<Certified>, CertifyError>;

/// Hands the host's candidates to threads, and what comes out to the host. Results do not depend on the threads.
fn certify_all(
    work: &Work<'_>,
    options: &CertifyOptions,
    host: &mut Host,
) -> Result<BTreeMap<u64, Account>, StageError> {
    let n_threads = match options.workers {
        // Other workers share the queue: take no more than is being worked on.
        0 if host.shares_work() => 1,
        0 => std::thread::available_parallelism().map_or(1, std::num::NonZero::get),
        n => n,
    };
    let stop = host.stop_flag();
    let is_canceled = AtomicBool::new(false);
    let (work_sender, work_receiver) = mpsc::channel::<Region>();
    let (done_sender, done_receiver) = mpsc::channel::<Result1>();
    let work_receiver = Mutex::new(work_receiver);
    std::thread::scope(|scope| {
        // Dropped at the end of the scope's body, which ends the threads.
        let work_sender = work_sender;
        for _ in 0..n_threads {
            let (done_sender, stop) = (done_sender.clone(), stop.clone());
            let (work_receiver, is_canceled) = (&work_receiver, &is_canceled);
            scope.spawn(move || {
                let is_stopped = || is_canceled.load(Ordering::Relaxed) || stop.is_set();
                while let Some(region) = next(work_receiver) {
                    if done_sender.send(work.certify(&region, &is_stopped)).is_err() {
                        break;
                    }
                }
            });
        }
        drop(done_sender);
        let result = feed(host, n_threads, &work_sender, &done_receiver);
        is_canceled.store(result.is_err(), Ordering::Relaxed);
        result
    })
}

fn next(receiver: &Mutex<mpsc::Receiver<Region>>) -> Option<Region> {
    receiver.lock().ok()?.recv().ok()
}

fn feed(
    host: &mut Host,
    n_threads: usize,
    work: &mpsc::Sender<Region>,
    done: &mpsc::Receiver<Result1>,
) -> Result<BTreeMap<u64, Account>, StageError> {
    let mut accounts = BTreeMap::new();
    let (mut n_open, mut n_given, mut is_over) = (0, 0, false);
    let lost = || StageError::Failed("a thread of the certifier ended before its work".to_owned());
    loop {
        while !is_over && n_open < n_threads {
            match host.next_candidate()? {
                Some(region) => {
                    work.send(region).map_err(|_| lost())?;
                    (n_open, n_given) = (n_open + 1, n_given + 1);
                }
                None => is_over = true,
            }
        }
        if n_open == 0 {
            return Ok(accounts);
        }
        let result = done.recv().map_err(|_| lost())?;
        n_open -= 1;
        let (part, account) = result.map_err(StageError::bad_input)?.ok_or(StageError::Stopped)?;
        host.certified(part)?;
        let kept = account.volume_kept;
        accounts.insert(account.candidate, account);
        host.progress(accounts.len() as u64, n_given, kept, "regions certified");
    }
}

impl Work<'_> {
    fn certify(&self, region: &Region, is_stopped: &(dyn Fn() -> bool + Sync)) -> Result1 {
        let _span = spans::enter("certify.region", region.id);
        let candidate = wire::Region::from_artefact(region, self.scene.dim())
            .map_err(|error| CertifyError::Region { region_id: region.id, problem: error.to_string() })?;
        let candidate =
            Candidate { region_id: candidate.id, polyhedron: candidate.polyhedron, center: candidate.center };
        let outcome =
            self.certifier.certify_region_reusing(&candidate, self.purpose, self.earlier, is_stopped)?;
        let mut part = CertifiedPart {
            candidate_id: region.id,
            regions: Vec::new(),
            certificates: Vec::new(),
            reason: String::new(),
        };
        let mut account = Account {
            candidate: region.id,
            volume_kept: 0.0,
            faces: 0,
            cells: 0,
            cuts: 0,
            reused_pairs: 0,
            reason: String::new(),
            is_limit: false,
        };
        let name = |pair: CollisionPair| {
            format!("{} – {}", self.scene.bodies[pair.body_a].name, self.scene.bodies[pair.body_b].name)
        };
        match outcome {
            CertifyOutcome::Stopped => return Ok(None),
            CertifyOutcome::Rejected { pair, configuration, reason } => {
                account.reason = format!("{}: {reason}, at {configuration:?}", name(pair));
            }
            CertifyOutcome::Limit { pair, n_cells } => {
                (account.cells, account.is_limit) = (n_cells, true);
                account.reason = format!("{}: {n_cells} cells were not enough", name(pair));
            }
            CertifyOutcome::Certified(certified) => {
                let id = region.id.saturating_add(CERTIFIED_ID_OFFSET);
                let polyhedron = certified.polyhedron;
                account.volume_kept = certified.volume_kept;
                account.faces = polyhedron.n_faces();
                (account.cells, account.cuts) = (certified.n_cells, certified.n_cuts);
                account.reused_pairs = certified.n_reused;
                let artefact = wire::Region {
                    id,
                    parent: Some(region.id),
                    polyhedron,
                    center: certified.center,
                    method: region.method.clone(),
                    certified: true,
                    margin: self.margin,
                }
                .to_artefact();
                let mut certificate = certified.certificate;
                certificate.region_id = id;
                part.regions.push(artefact);
                part.certificates.push(certificate);
            }
        }
        part.reason.clone_from(&account.reason);
        Ok(Some((part, account)))
    }
}
