//! Where regions go while they are found.

use wire::Region;

/// Where regions go as they are found, and where certified ones come from.
pub trait Sink {
    /// What can go wrong there.
    type Error;

    /// A region; ids count from 0.
    fn region(&mut self, region: &Region) -> Result<(), Self::Error>;

    /// `n_regions` were found, `coverage` of the set named in `message` is covered.
    fn progress(&mut self, n_regions: usize, coverage: f64, message: &str);

    /// The certified versions of the regions `ids`, once they are known; `None` if there is no certification.
    fn certified(&mut self, ids: &[u64]) -> Result<Option<Vec<Region>>, Self::Error>;
}

/// Keeps nothing and certifies nothing: for whoever wants what comes back in the end.
pub struct NoSink;

impl Sink for NoSink {
    type Error = std::convert::Infallible;

    fn region(&mut self, _: &Region) -> Result<(), Self::Error> {
        Ok(())
    }

    fn progress(&mut self, _: usize, _: f64, _: &str) {}

    fn certified(&mut self, _: &[u64]) -> Result<Option<Vec<Region>>, Self::Error> {
        Ok(None)
    }
}
