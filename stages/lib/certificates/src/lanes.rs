//! The threads of a region.

/// How many there are at most.
pub const N_LANES: usize = 2;

/// Does `work` for each of `items`, each [`N_LANES`]-th one on a thread of its own if `on_threads`, with buffers of that
/// thread; what comes out does not depend on the threads.
pub fn in_lanes<T: Sync, B: Default, R: Send>(
    items: &[T],
    on_threads: bool,
    work: impl Fn(&T, &mut B) -> R + Sync,
) -> Vec<R> {
    if !on_threads {
        let mut buffers = B::default();
        return items.iter().map(|item| work(item, &mut buffers)).collect();
    }
    let lane = |first: usize| -> Vec<R> {
        let mut buffers = B::default();
        items.iter().skip(first).step_by(N_LANES).map(|item| work(item, &mut buffers)).collect()
    };
    let mut lanes: Vec<std::vec::IntoIter<R>> = std::thread::scope(|scope| {
        let others: Vec<_> = (1..N_LANES).map(|first| scope.spawn(move || lane(first))).collect();
        let mut lanes = vec![lane(0).into_iter()];
        // A lane that panics takes the region with it.
        lanes.extend(others.into_iter().map(|other| match other.join() {
            Ok(results) => results.into_iter(),
            Err(panic) => std::panic::resume_unwind(panic),
        }));
        lanes
    });
    (0..items.len()).filter_map(|idx| lanes[idx % N_LANES].next()).collect()
}
