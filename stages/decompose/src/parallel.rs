//! Work on any number of threads with results in the order of the work.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// `work(0..n)` in order of the index; `None` for work that gave none, or had not begun when `is_stopped` turned true.
pub(crate) fn for_each<T: Send>(
    n: usize,
    threads: usize,
    is_stopped: &(dyn Fn() -> bool + Sync),
    work: &(dyn Fn(usize) -> Option<T> + Sync),
) -> Vec<Option<T>> {
    let results: Vec<Mutex<Option<T>>> = (0..n).map(|_| Mutex::new(None)).collect();
    let next = AtomicUsize::new(0);
    let worker = || {
        loop {
            let idx = next.fetch_add(1, Ordering::Relaxed);
            if idx >= n || is_stopped() {
                return;
            }
            let result = work(idx);
            // A poisoned lock only says that another thread panicked; the slot itself is whole.
            *results[idx].lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = result;
        }
    };
    if threads <= 1 || n <= 1 {
        worker();
    } else {
        std::thread::scope(|scope| {
            for _ in 0..threads.min(n) {
                scope.spawn(worker);
            }
        });
    }
    results
        .into_iter()
        .map(|slot| slot.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_keep_their_order() {
        for threads in [1, 3] {
            let squares = for_each(20, threads, &|| false, &|k| (k != 7).then_some(k * k));
            assert_eq!(squares.iter().flatten().count(), 19);
            assert!(squares.iter().enumerate().all(|(k, square)| square.is_none_or(|s| s == k * k)));
        }
        assert!(for_each(3, 2, &|| true, &|k| Some(k)).iter().all(Option::is_none));
    }
}
