//! What the certification workers left becomes the stage's files.

use super::work_queue::WorkQueue;
use crate::failure::Failure;
use ipc_types::artefact::{CertificatesFile, RegionsFile};
use ipc_types::exit_code::ExitCode;
use ipc_types::join::write_certified;
use ipc_types::status::Status;
use ipc_types::store::{read_json, write_artefact, write_at_once, write_bin, write_json};
use ipc_types::{Digest, hexadecimal};
use serde_json::Value;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::Path;

/// Joins the parts into `regions.*` and `certificates.bin`: sorted by id, so the same bytes with any number of workers.
pub fn write_joined(
    folder: &Path,
    coordinates: Vec<String>,
    queue: &WorkQueue,
    scene_digest: &Digest,
) -> Result<(), Failure> {
    Ok(write_certified(folder, coordinates, queue.parts(), scene_digest)?)
}

/// `--certify none`: the candidates are copied, and say that they are not certified.
pub fn write_uncertified(
    folder: &Path,
    candidates: &RegionsFile,
    scene_digest: &Digest,
) -> Result<(), Failure> {
    let mut regions = candidates.clone();
    for region in &mut regions.regions {
        region.certified = false;
    }
    write_artefact(folder, "regions", &regions, scene_digest)?;
    write_bin(folder, "certificates", &CertificatesFile { regions: Vec::new() }, scene_digest)?;
    let status = Status {
        stage: "certify".into(),
        version: env!("CARGO_PKG_VERSION").into(),
        outcome: ExitCode::Done,
        reason: format!("{} regions copied, not certified", regions.regions.len()),
        seconds: 0.0,
        cpu_seconds: 0.0,
        peak_bytes: 0,
        processes: 0,
        solver_calls: 0,
        scene_digest: hexadecimal(scene_digest),
        excluded_pairs: Vec::new(),
        task: None,
        seed: 0,
        options: Value::Null,
        details: BTreeMap::new(),
    };
    write_json(folder, "status", &status)?;
    Ok(write_at_once(&folder.join("spans.jsonl"), b"")?)
}

/// Joins what each worker says of itself into one `status.json` and one `spans.jsonl`. Numbers among the details are
/// added, lists joined; what is said of candidates is in the order of their ids, whichever worker had them.
pub fn join_statuses(folder: &Path, n_workers: u32, seconds: f64, queue: &WorkQueue) -> Result<(), Failure> {
    let mut joined: Option<Status> = None;
    let mut spans = Vec::new();
    for worker in 0..n_workers {
        let spans_path = folder.join(format!("spans-{worker}.jsonl"));
        spans.extend(std::fs::read(&spans_path).unwrap_or_default());
        let status_path = folder.join(format!("status-{worker}.json"));
        // A worker that was killed has left none.
        let Ok(status) = read_json::<Status>(&status_path) else { continue };
        joined = Some(match joined {
            None => status,
            Some(sum) => add(sum, status),
        });
        for path in [spans_path, status_path] {
            // It is joined; what cannot be removed does no harm.
            let _ = std::fs::remove_file(path);
        }
    }
    if let Some(mut status) = joined {
        status.seconds = seconds;
        if let Some(Value::Array(candidates)) = status.details.get_mut("candidates") {
            candidates.sort_by_key(|account| account["candidate"].as_u64());
        }
        if status.outcome == ExitCode::Done {
            status.reason = format!(
                "{} of {} candidates gave {} certified regions",
                queue.n_done(),
                queue.n_known(),
                queue.n_certified()
            );
        }
        write_json(folder, "status", &status)?;
    }
    Ok(write_at_once(&folder.join("spans.jsonl"), &spans)?)
}

fn add(mut sum: Status, other: Status) -> Status {
    sum.cpu_seconds += other.cpu_seconds;
    sum.peak_bytes = sum.peak_bytes.max(other.peak_bytes);
    sum.processes += other.processes;
    sum.solver_calls += other.solver_calls;
    if sum.outcome == ExitCode::Done && other.outcome != ExitCode::Done {
        (sum.outcome, sum.reason) = (other.outcome, other.reason);
    }
    for (key, value) in other.details {
        match sum.details.entry(key) {
            Entry::Vacant(place) => {
                place.insert(value);
            }
            Entry::Occupied(mut place) => add_detail(place.get_mut(), &value),
        }
    }
    sum
}

/// Numbers are added, lists joined; of anything else the first stays.
fn add_detail(sum: &mut Value, other: &Value) {
    if let (Value::Array(sum), Value::Array(other)) = (&mut *sum, other) {
        sum.extend_from_slice(other);
    } else if let Some(added) = sum.as_u64().zip(other.as_u64()).and_then(|(a, b)| a.checked_add(b)) {
        *sum = added.into();
    } else if let Some((a, b)) = sum.as_f64().zip(other.as_f64()) {
        *sum = (a + b).into();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ipc_types::artefact::Region;

    #[test]
    fn copied_regions_say_that_they_are_not_certified() {
        let folder = tempfile::tempdir().unwrap();
        let region = Region {
            id: 1,
            parent: None,
            A: vec![vec![1.0], vec![-1.0]],
            b: vec![1.0, 1.0],
            center: vec![0.0],
            method: "box".into(),
            certified: true,
            margin: 0.0,
        };
        let file = RegionsFile { coordinates: vec!["x".into()], regions: vec![region], coverage: None };
        write_uncertified(folder.path(), &file, &[1; 32]).unwrap();
        let back: RegionsFile =
            ipc_types::store::read_artefact(folder.path(), "regions", Some(&[1; 32])).unwrap();
        assert!(!back.regions[0].certified);
    }

    #[test]
    fn numbers_of_workers_are_added() {
        let folder = tempfile::tempdir().unwrap();
        let file = RegionsFile { coordinates: Vec::new(), regions: Vec::new(), coverage: None };
        write_uncertified(folder.path(), &file, &[1; 32]).unwrap();
        let mut status: Status = read_json(&folder.path().join("status.json")).unwrap();
        status.solver_calls = 5;
        status.processes = 1;
        status.details.insert("cells".into(), 7.into());
        let account = |id: u64| serde_json::json!({ "candidate": id, "cells": 10 * id });
        for (worker, candidates) in [[1, 4], [3, 2]].into_iter().enumerate() {
            status.details.insert("candidates".into(), candidates.map(account).to_vec().into());
            write_json(folder.path(), &format!("status-{worker}"), &status).unwrap();
        }
        join_statuses(folder.path(), 2, 1.5, &WorkQueue::default()).unwrap();
        let joined: Status = read_json(&folder.path().join("status.json")).unwrap();
        assert_eq!((joined.solver_calls, joined.processes, joined.seconds), (10, 2, 1.5));
        assert_eq!(joined.details["cells"], 14);
        assert_eq!(joined.details["candidates"], Value::from([1, 2, 3, 4].map(account).to_vec()));
        assert!(!folder.path().join("status-0.json").exists());
    }
}
