//! A region with the cuts made so far, and the samples that they leave.

use crate::assemble::SharedProof;
use crate::cell::CellBox;
use crate::clean_up::{CleanUp, clean_up};
use crate::guide::Guide;
use crate::options::CertifyOptions;
use crate::pair_model::PairModel;
use crate::pair_search::PairProof;
use crate::region_data::{RegionData, keeps};
use crate::row_program::RowProgram;
use crate::rows::Rows;

/// A region with the cuts made so far.
#[derive(Debug, Clone)]
pub struct CutRegion {
    /// Its rows, then the cuts.
    pub rows: Rows,
    /// Samples that are left; `None` until a cut is judged.
    pub guide: Option<Guide>,
}

impl CutRegion {
    /// Takes the cuts of a proof over that was found on the first `n_base` rows; `guide` makes the samples.
    pub fn join(&mut self, n_base: usize, proof: PairProof, guide: &dyn Fn() -> Guide) -> SharedProof {
        let offset = self.rows.len();
        for (a, b) in &proof.cuts {
            // What an earlier proof brings is implied by the region: no sample is lost to it.
            if !proof.is_reused {
                self.guide.get_or_insert_with(guide).cut(a, *b);
            }
            self.rows.push(a, *b, None);
        }
        SharedProof { n_base, offset, proof }
    }

    /// Cuts collisions of `models` off.
    pub fn clean_up(
        &mut self,
        models: &[&PairModel],
        region: &RegionData<'_>,
        options: &CertifyOptions,
        on_threads: bool,
    ) {
        let left = self.guide.get_or_insert_with(region.guide);
        let may_cut = |a: &[f64], b: f64| keeps(region, a, b);
        let task = CleanUp {
            limits: region.limits,
            center: region.center,
            may_cut: &may_cut,
            max_loss: options.max_clean_up_loss,
            room: options.room,
        };
        clean_up(models, &mut self.rows, left, &task, on_threads);
    }

    /// Takes rows out of use that others imply.
    pub fn prune(&mut self, limits: &CellBox) {
        self.rows.prune(&mut RowProgram::default(), limits);
    }
}
