//! Independent work on all processors, with results in the order of the work.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// `work(i)` for all i in `0..n`, each once, those first whose `weight` is largest.
pub fn in_order<T: Send>(
    n: usize,
    weight: impl Fn(usize) -> usize,
    work: impl Fn(usize) -> T + Sync,
) -> Vec<T> {
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by_key(|&i| std::cmp::Reverse(weight(i)));
    let n_threads = std::thread::available_parallelism().map_or(1, |n| n.get()).min(n);
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::with_capacity(n)));
    let run = || {
        while let Some(&i) = order.get(next.fetch_add(1, Ordering::Relaxed)) {
            let result = work(i);
            // A lock is poisoned by a panic only, which the scope hands on anyway.
            done.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push((i, result));
        }
    };
    std::thread::scope(|scope| {
        (1..n_threads).for_each(|_| drop(scope.spawn(run)));
        run();
    });
    let mut done = done.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    done.sort_by_key(|(i, _)| *i);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn results_stand_in_the_order_of_the_work() {
        for n in [0, 1, 5, 300] {
            let squares = super::in_order(n, |i| i % 7, |i| i * i);
            assert_eq!(squares, (0..n).map(|i| i * i).collect::<Vec<usize>>());
        }
    }
}
