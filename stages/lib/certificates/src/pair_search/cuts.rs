//! Cuts for cells that have no plane: how much they may lose, and where they are made.

use super::{Attempt, CUTS_BETWEEN_PRUNINGS, Search};
use crate::cell::CellBox;
use crate::clean_up::{CleanUp, NEAR_SHARE, cut as cut_collision};
use crate::control_net::ControlNet;
use crate::corner_bound::CornerPair;
use crate::corner_search::OpenCorner;
use crate::pair_model::Plane;
use crate::region_data::keeps;
use crate::rows::Multipliers;

impl Search<'_> {
    /// Share of the samples that a cut for a cell of this displacement may lose now.
    pub(super) fn allowed_loss(&self, displacement: f64) -> f64 {
        let options = self.options;
        if displacement < options.give_up {
            1.0 - options.min_kept
        } else if displacement < options.thin {
            options.max_thin_cut_loss.max(options.max_cut_loss)
        } else {
            let doublings = (self.n_tried / options.cells_per_doubling.max(1)).min(60);
            (options.first_cut_loss * 2_f64.powi(doublings as i32)).min(options.max_cut_loss)
        }
    }

    /// Cuts a collision, or what comes too near one, off where the pair is nearest in the cell.
    pub(super) fn cut_contact(&mut self, open: &OpenCorner) -> bool {
        let (at, gap) = &open.nearest;
        if *gap > self.model.clearance + NEAR_SHARE * NEAR_SHARE * self.options.room {
            return false;
        }
        let region = self.region;
        let may_cut = |a: &[f64], b: f64| keeps(region, a, b);
        let guide = self.guide.get_or_insert_with(region.guide);
        let max_loss =
            self.options.max_clean_up_loss.min((guide.least_kept() - self.options.min_kept).max(0.0));
        let task = CleanUp {
            limits: region.limits,
            center: region.center,
            may_cut: &may_cut,
            max_loss,
            room: self.options.room,
        };
        let has_cut = cut_collision(self.model, &mut self.rows, guide, &task, at);
        if has_cut {
            self.prune_now_and_then();
        }
        has_cut
    }

    fn prune_now_and_then(&mut self) {
        if (self.rows.len() - self.region.rows.len()).is_multiple_of(CUTS_BETWEEN_PRUNINGS) {
            self.rows.prune(&mut self.program, self.region.limits);
        }
    }

    /// Cuts the region so that the plane separates the bodies on the cell, if a cut keeps what it must and loses at most
    /// the share `loss`; returns the plane and its multipliers.
    pub(super) fn cut(
        &mut self,
        net: &mut ControlNet,
        cell: &CellBox,
        attempt: &Attempt,
        loss: f64,
    ) -> Option<(Plane, Multipliers)> {
        let (frame_idx, multipliers) = (attempt.frame_idx, &attempt.multipliers);
        let computed;
        let plane = match &attempt.plane {
            Some(plane) => plane,
            None => {
                computed = self.model.kappa(net, frame_idx, cell, &attempt.n, &attempt.g);
                &computed
            }
        };
        let gap = plane.kappa[1] + attempt.bound;
        let demand = self.model.clearance + self.options.cut_margin.max(2.0 * self.model.margin);
        let mut candidates: Vec<(Vec<f64>, f64, Option<u32>, Multipliers)> = Vec::new();
        // A face that the bound leans on, moved inwards until the gap is there.
        for (position, &(row, mu)) in multipliers.iter().enumerate() {
            let shift = (demand - gap) / mu;
            let b = self.rows.b[row as usize] - shift;
            let mut moved = multipliers.clone();
            moved[position].0 = self.rows.len() as u32;
            candidates.push((self.rows.a(row as usize).to_vec(), b, Some(row), moved));
        }
        // The half-space of the plane: g·δ ≥ demand − κ.
        let norm = plane.g.iter().map(|g| g * g).sum::<f64>().sqrt();
        if norm > 0.0 {
            let at_center: f64 = plane.g.iter().enumerate().map(|(j, g)| g * cell.center(j)).sum();
            // 0 − 0 is 0, not −0.
            let a: Vec<f64> = plane.g.iter().map(|g| 0.0 - g / norm).collect();
            let b = (plane.kappa[1] - demand - at_center) / norm;
            candidates.push((a, b, None, vec![(self.rows.len() as u32, norm)]));
        }
        let guide = self.guide.get_or_insert_with(self.region.guide);
        let room = guide.least_kept() - self.options.min_kept;
        let mut judged: Vec<(f64, usize)> = Vec::new();
        for (position, (a, b, ..)) in candidates.iter().enumerate() {
            if keeps(self.region, a, *b)
                && let Some(loss) = guide.loss(a, *b, loss.min(room))
            {
                judged.push((loss, position));
            }
        }
        // Moved faces come first: of cuts that lose the same they leave fewer faces.
        judged.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        for (_, position) in judged {
            let (a, b, superseded, multipliers) = candidates[position].clone();
            self.rows.push(&a, b, superseded);
            let bound = self.rows.bound(cell, &plane.g, &multipliers);
            if plane.kappa[1] + bound > self.model.demand() {
                let row = self.rows.len() - 1;
                if let Some(guide) = &mut self.guide {
                    guide.cut(self.rows.a(row), self.rows.b[row]);
                }
                let plane = plane.clone();
                self.prune_now_and_then();
                return Some((plane, multipliers));
            }
            self.rows.pop(superseded);
        }
        None
    }
}

/// What a cut needs to know of a corner that comes too near.
pub(super) fn attempt_of(pair: &CornerPair, open: &OpenCorner) -> Attempt {
    let kappa = [f64::NEG_INFINITY, open.kappa];
    Attempt {
        frame_idx: pair.frame_idx,
        gap: open.kappa + open.bound,
        n: open.n,
        g: open.g.clone(),
        plane: Some(Plane { n: open.n, g: open.g.clone(), kappa, paths: Default::default() }),
        with_row: true,
        multipliers: open.multipliers.clone(),
        bound: open.bound,
        witnesses: Vec::new(),
    }
}
