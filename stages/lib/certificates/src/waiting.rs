//! The order in which cells are tried: near collisions first, then the largest.

use crate::cell::CellBox;
use crate::corner_search::Seen;
use crate::row_program::Active;
use std::cmp::Ordering;
use std::rc::Rc;

/// A cell that waits.
pub struct Waiting {
    /// Its order, metres: largest first, and before these the urgent ones, which have the largest number.
    pub size: f64,
    /// Its node in the tree.
    pub node: usize,
    /// The cell.
    pub cell: CellBox,
    /// Rows that the cell may violate, of the first `n_rows_seen`.
    pub rows: Rc<[u32]>,
    /// Where the programme of the cell around it ended.
    pub start: Rc<[Active]>,
    /// What was seen in it.
    pub seen: Rc<[Rc<Seen>]>,
    /// How many rows there were when it was made.
    pub n_rows_seen: usize,
}

impl PartialEq for Waiting {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Waiting {}
impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Waiting {
    /// Largest first, of equal ones the first made.
    fn cmp(&self, other: &Self) -> Ordering {
        self.size.total_cmp(&other.size).then(other.node.cmp(&self.node))
    }
}
