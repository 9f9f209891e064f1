//! Random numbers: one stream for each unit of work, so that results do not depend on who does it when.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Hands out streams in a fixed order.
#[derive(Debug, Clone)]
pub(crate) struct Streams {
    seed: u64,
    next: u64,
}

impl Streams {
    pub(crate) fn new(seed: u64) -> Self {
        Self { seed, next: 0 }
    }

    /// The next stream; to be called from one thread, in an order that the work alone determines.
    pub(crate) fn take(&mut self) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(self.next);
        self.next += 1;
        rng
    }
}
