//! `status.json` and `spans.jsonl`: what a stage says of its own run. Times stand here, never in the outputs.

use crate::exit_code::ExitCode;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// `status.json` of a stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// The stage.
    pub stage: String,
    /// Version of the program.
    pub version: String,
    /// How it ended.
    pub outcome: ExitCode,
    /// Why, in words; of a good end what came out.
    pub reason: String,
    /// Wall-clock time of the work, seconds.
    pub seconds: f64,
    /// User and system time of the process, seconds.
    pub cpu_seconds: f64,
    /// Largest resident memory, bytes.
    pub peak_bytes: u64,
    /// Processes that did the work.
    pub processes: u32,
    /// Programmes that solvers were given.
    pub solver_calls: u64,
    /// BLAKE3 of the files of the scene, hexadecimal.
    pub scene_digest: String,
    /// Pairs of links that the scene leaves out of collision.
    pub excluded_pairs: Vec<String>,
    /// Task.
    pub task: Option<String>,
    /// Seed.
    pub seed: u64,
    /// Options of the stage.
    pub options: serde_json::Value,
    /// What only this stage has to say.
    #[serde(default)]
    pub details: BTreeMap<String, serde_json::Value>,
}

/// A line of `spans.jsonl`: one solver call, one collision batch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Span {
    /// What, as in `certify.pair`.
    pub name: String,
    /// On which region, pair, segment.
    pub id: u64,
    /// Worker that did it; 0 where there is one.
    #[serde(default)]
    pub worker: u32,
    /// From the start of the process to the start of the span, seconds.
    pub start: f64,
    /// Duration, seconds.
    pub seconds: f64,
    /// Depth of nesting on its thread.
    pub depth: u32,
}
