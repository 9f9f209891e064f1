//! Cells of pairs whose corners are followed.

use super::cuts::attempt_of;
use super::{Answer, NO_SPLIT, Search};
use crate::cell::CellBox;
use crate::control_net::ControlNet;
use crate::corner_bound::CornerPair;
use crate::corner_search::{CornerAnswer, CornerTask};
use ipc_types::artefact::Cell;

impl Search<'_> {
    /// As [`Search::treat`], by the series of the corners.
    pub(super) fn treat_corners(
        &mut self,
        net: &mut ControlNet,
        node: usize,
        cell: &CellBox,
        pair: &CornerPair,
    ) -> Result<(), String> {
        loop {
            let mut program = std::mem::take(&mut self.program);
            let (relevant, start) = (&self.relevant[..], &self.start[..]);
            let task =
                CornerTask { model: self.model, pair, rows: &self.rows, relevant, start, seen: &self.seen };
            let answer = task.attempt(&mut program, cell);
            let mut open = match answer {
                CornerAnswer::Closed(leaf) => {
                    self.program = program;
                    self.tree.close(node, leaf);
                    return Ok(());
                }
                CornerAnswer::Open(open) => open,
            };
            let split_at = task.split_coordinate(cell, &open);
            self.start = program.basis().into();
            let seen = std::mem::take(&mut open.seen);
            self.program = program;
            self.seen = seen.into();
            if open.is_wide() && open.holds_to_first_order(self.model.demand()) {
                match self.attempt(net, self.frame_order[0], cell) {
                    Answer::Empty(multipliers) => {
                        self.tree.close(node, Cell::Empty { multipliers });
                        return Ok(());
                    }
                    Answer::Apart(frame_idx, plane, multipliers) => {
                        let with_row = multipliers.is_some();
                        self.close(node, frame_idx, &plane, with_row, multipliers.unwrap_or_default());
                        return Ok(());
                    }
                    Answer::Open(_) => {}
                }
            }
            let displacement = self.model.displacement(cell);
            if self.options.cuts_allowed() {
                let n_rows_before = self.rows.len();
                let loss = self.allowed_loss(displacement);
                if self.cut_contact(&open) || self.cut(net, cell, &attempt_of(pair, &open), loss).is_some() {
                    // The region has a face more, which this cell is tried again with.
                    self.note_new_rows(n_rows_before);
                    self.n_tried += 1;
                    if self.n_tried > self.options.max_cells {
                        self.queue.push(self.waiting(node, cell.clone()));
                        return Ok(());
                    }
                    continue;
                }
            }
            if displacement < self.options.give_up {
                return Err(self.given_up());
            }
            return match split_at {
                Some(j) if cell.lower[j] < cell.center(j) && cell.center(j) < cell.upper[j] => {
                    self.split(node, cell.clone(), j, Some(&open.nearest));
                    Ok(())
                }
                _ => Err(NO_SPLIT.to_owned()),
            };
        }
    }
}
