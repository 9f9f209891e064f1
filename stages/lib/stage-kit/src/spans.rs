//! Spans: where the time goes, at the grain of a solver call or a collision batch.
//!
//! `let _span = spans::enter("certify.pair", region_id);` measures until the end of the scope. Without a harness that
//! collects them, as in tests, entering costs one atomic load.

use ipc_types::status::Span;
use std::cell::Cell;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// More spans than this are not kept: a log must not fill the disk.
const MAX_SPANS: usize = 1 << 20;

static COLLECTING: AtomicBool = AtomicBool::new(false);
static COLLECTION: Mutex<Option<Collection>> = Mutex::new(None);

thread_local! {
    static DEPTH: Cell<u32> = const { Cell::new(0) };
}

struct Collection {
    origin: Instant,
    worker: u32,
    spans: Vec<Span>,
}

/// An open span; it ends when this is dropped.
#[derive(Debug)]
#[must_use = "a span ends when its guard is dropped"]
pub struct OpenSpan {
    name: &'static str,
    id: u64,
    start: Option<Instant>,
}

/// Opens a span called `name` about the region, pair or segment `id`.
pub fn enter(name: &'static str, id: u64) -> OpenSpan {
    let start = COLLECTING.load(Ordering::Relaxed).then(Instant::now);
    if start.is_some() {
        DEPTH.with(|depth| depth.set(depth.get() + 1));
    }
    OpenSpan { name, id, start }
}

impl Drop for OpenSpan {
    fn drop(&mut self) {
        let Some(start) = self.start else { return };
        let seconds = start.elapsed().as_secs_f64();
        let depth = DEPTH.with(|depth| {
            depth.set(depth.get().saturating_sub(1));
            depth.get()
        });
        let Ok(mut slot) = COLLECTION.lock() else { return };
        let Some(collection) = slot.as_mut().filter(|collection| collection.spans.len() < MAX_SPANS) else {
            return;
        };
        let start = start.saturating_duration_since(collection.origin).as_secs_f64();
        let worker = collection.worker;
        collection.spans.push(Span {
            name: self.name.to_owned(),
            id: self.id,
            worker,
            start,
            seconds,
            depth,
        });
    }
}

/// Begins to collect the spans of this process.
pub(crate) fn collect(worker: u32) {
    if let Ok(mut slot) = COLLECTION.lock() {
        *slot = Some(Collection { origin: Instant::now(), worker, spans: Vec::new() });
        COLLECTING.store(true, Ordering::Relaxed);
    }
}

/// The spans collected so far, a line each, as in `spans.jsonl`.
pub(crate) fn lines() -> Vec<u8> {
    let mut text = Vec::new();
    let Ok(slot) = COLLECTION.lock() else { return text };
    for span in slot.iter().flat_map(|collection| &collection.spans) {
        if let Ok(line) = serde_json::to_vec(span) {
            text.extend(line);
            text.push(b'\n');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nested_spans_carry_their_depth() {
        collect(2);
        {
            let _outer = enter("outer", 1);
            let _inner = enter("inner", 7);
        }
        let text = String::from_utf8(lines()).unwrap();
        let spans: Vec<Span> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        let found: Vec<_> =
            spans.iter().map(|span| (span.name.as_str(), span.id, span.worker, span.depth)).collect();
        assert_eq!(found, [("inner", 7, 2, 1), ("outer", 1, 2, 0)]);
    }
}
