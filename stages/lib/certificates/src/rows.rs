//! Rows a·q ≤ b that hold on a region, and what they bound on a cell.

use crate::cell::CellBox;
use crate::row_program::{Active, RowProgram, Verdict};
use convex_sets::HPolyhedron;

/// Multipliers: (row, μ ≥ 0).
pub type Multipliers = Vec<(u32, f64)>;

/// A list of rows that grows by cuts; indices stay.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    /// Coefficients of the rows, of unit length, one row after the other [n each].
    a: Vec<f64>,
    n: usize,
    /// Offsets.
    pub b: Vec<f64>,
    /// The rows that programmes use, by index, sorted; rows that others imply are left out.
    active: Vec<u32>,
    is_active: Vec<bool>,
    /// For each row a point that only it keeps out, of the rows in use before some index [n each], and that index; 0
    /// where no such point is known. They spare programmes, no more.
    kept_out: Vec<f64>,
    kept_out_before: Vec<u32>,
}

/// What a programme over cell ∩ region said.
#[derive(Debug, Clone)]
pub enum RowBound {
    /// g·δ ≥ `value` by the multipliers.
    Bound {
        /// L, evaluated from the multipliers and rounded down.
        value: f64,
        /// Why.
        multipliers: Multipliers,
    },
    /// The cell misses the region by these multipliers.
    Empty(Multipliers),
}

impl Rows {
    /// The faces of `polyhedron`, all active.
    pub fn new(polyhedron: &HPolyhedron) -> Self {
        let m = polyhedron.n_faces();
        Self {
            a: polyhedron.A.transpose().as_slice().to_vec(),
            n: polyhedron.ambient_dimension(),
            b: polyhedron.b.iter().copied().collect(),
            active: (0..m as u32).collect(),
            is_active: vec![true; m],
            kept_out: vec![0.0; m * polyhedron.ambient_dimension()],
            kept_out_before: vec![0; m],
        }
    }

    /// No rows, of `n` coefficients each.
    pub fn empty(n: usize) -> Self {
        Self {
            a: Vec::new(),
            n,
            b: Vec::new(),
            active: Vec::new(),
            is_active: Vec::new(),
            kept_out: Vec::new(),
            kept_out_before: Vec::new(),
        }
    }

    /// Coefficients of row `row` [n].
    #[inline]
    pub fn a(&self, row: usize) -> &[f64] {
        &self.a[row * self.n..(row + 1) * self.n]
    }

    /// Coefficients of all rows, one after the other [n each].
    pub fn faces(&self) -> impl Iterator<Item = &[f64]> {
        self.a.chunks_exact(self.n.max(1))
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.b.len()
    }

    /// Adds a row, which makes the row `superseded` (if any) superfluous; returns its index.
    pub fn push(&mut self, a: &[f64], b: f64, superseded: Option<u32>) -> u32 {
        let index = self.b.len() as u32;
        self.a.extend_from_slice(a);
        self.b.push(b);
        self.is_active.push(true);
        self.kept_out.extend(std::iter::repeat_n(0.0, self.n));
        self.kept_out_before.push(0);
        if let Some(row) = superseded {
            self.is_active[row as usize] = false;
        }
        self.active.push(index);
        self.active.retain(|&row| self.is_active[row as usize]);
        index
    }

    /// Takes the last row back, which had made `superseded` superfluous.
    pub fn pop(&mut self, superseded: Option<u32>) {
        self.a.truncate(self.a.len() - self.n);
        self.b.pop();
        self.is_active.pop();
        self.kept_out.truncate(self.a.len());
        self.kept_out_before.pop();
        // The next row takes the place of this one.
        let n_rows = self.b.len() as u32;
        self.kept_out_before.iter_mut().for_each(|before| *before = (*before).min(n_rows));
        if let Some(row) = superseded {
            self.is_active[row as usize] = true;
        }
        self.active = (0..self.b.len() as u32).filter(|&row| self.is_active[row as usize]).collect();
    }

    /// b − a·q of row `row`.
    pub fn slack(&self, row: usize, q: &[f64]) -> f64 {
        self.b[row] - self.a(row).iter().zip(q).map(|(a, q)| a * q).sum::<f64>()
    }

    /// A lower bound of g·δ + Σ μ (a·q − b) over the cell, δ = q − centre: L of the certificate. The value is rounded
    /// down by more than any order of evaluation can lose.
    pub fn bound(&self, cell: &CellBox, g: &[f64], multipliers: &[(u32, f64)]) -> f64 {
        let mut slope = g.to_vec();
        let mut slope_size: Vec<f64> = g.iter().map(|g| g.abs()).collect();
        let (mut sum, mut size) = (0.0, 0.0);
        for &(row, mu) in multipliers {
            let row = row as usize;
            for (j, a) in self.a(row).iter().enumerate() {
                slope[j] += mu * a;
                slope_size[j] += (mu * a).abs();
            }
            sum -= mu * self.b[row];
            size += (mu * self.b[row]).abs();
        }
        for j in 0..g.len() {
            sum += (slope[j] * cell.lower[j]).min(slope[j] * cell.upper[j]) - g[j] * cell.center(j);
            size += 2.0 * slope_size[j] * cell.lower[j].abs().max(cell.upper[j].abs());
        }
        let value = sum - 32.0 * f64::EPSILON * (g.len() + multipliers.len()) as f64 * size - 1e-300;
        if value.is_nan() { f64::NEG_INFINITY } else { value }
    }

    /// min { g·δ : q ∈ cell ∩ region } by its multipliers; it may stop once the bound exceeds `enough`.
    pub fn minimize(&self, program: &mut RowProgram, cell: &CellBox, g: &[f64], enough: f64) -> RowBound {
        self.minimize_over(program, &self.active, cell, g, enough)
    }

    /// As [`Rows::minimize`], by the rows `relevant` only.
    pub fn minimize_over(
        &self,
        program: &mut RowProgram,
        relevant: &[u32],
        cell: &CellBox,
        g: &[f64],
        enough: f64,
    ) -> RowBound {
        program.load(self, relevant, cell);
        self.minimize_loaded(program, cell, g, &[], enough)
    }

    /// As [`Rows::minimize_over`], where `program` has loaded the rows and the cell; `start` is where a similar
    /// programme ended, or empty.
    pub fn minimize_loaded(
        &self,
        program: &mut RowProgram,
        cell: &CellBox,
        g: &[f64],
        start: &[Active],
        enough: f64,
    ) -> RowBound {
        let multipliers = match program.minimize_loaded(g, start, enough) {
            Verdict::Bound(multipliers) => multipliers,
            Verdict::Infeasible(multipliers) => {
                if self.excludes(cell, &multipliers) {
                    return RowBound::Empty(multipliers);
                }
                Vec::new()
            }
        };
        RowBound::Bound { value: self.bound(cell, g, &multipliers), multipliers }
    }

    /// Whether Σ μ (a·q − b) > 0 on all of the cell, by more than rounding.
    pub fn excludes(&self, cell: &CellBox, multipliers: &[(u32, f64)]) -> bool {
        let zero = vec![0.0; cell.lower.len()];
        let size: f64 = multipliers.iter().map(|&(row, mu)| mu * (1.0 + self.b[row as usize].abs())).sum();
        size > 0.0 && self.bound(cell, &zero, multipliers) > MARGIN_EMPTY * size
    }

    /// Takes rows out of use that the others imply on `limits`, the latest first.
    pub fn prune(&mut self, program: &mut RowProgram, limits: &CellBox) {
        for position in (0..self.active.len()).rev() {
            let row = self.active[position];
            if self.still_keeps_out(row as usize) {
                continue;
            }
            self.active.remove(position);
            let minus_a: Vec<f64> = self.a(row as usize).iter().map(|a| -a).collect();
            let at_center: f64 = minus_a.iter().enumerate().map(|(j, a)| a * limits.center(j)).sum();
            let needed = -self.b[row as usize] - at_center;
            let implied = match self.minimize(program, limits, &minus_a, needed + TOL_IMPLIED) {
                RowBound::Bound { value, .. } => value >= needed,
                RowBound::Empty(_) => false,
            };
            if implied {
                self.is_active[row as usize] = false;
            } else {
                self.active.insert(position, row);
                let range = row as usize * self.n..(row as usize + 1) * self.n;
                self.kept_out[range].copy_from_slice(&program.point(limits));
                self.kept_out_before[row as usize] = self.b.len() as u32;
            }
        }
    }

    /// Whether a point is known that the row keeps out and no other row in use does.
    fn still_keeps_out(&mut self, row: usize) -> bool {
        let before = self.kept_out_before[row] as usize;
        let point = &self.kept_out[row * self.n..(row + 1) * self.n];
        let is_left = before > 0
            && self.slack(row, point) < -TOL_IMPLIED
            && (before..self.b.len()).all(|other| !self.is_active[other] || self.slack(other, point) >= 0.0);
        self.kept_out_before[row] = if is_left { self.b.len() as u32 } else { 0 };
        is_left
    }

    /// Whether the row is in use.
    pub fn is_active(&self, row: u32) -> bool {
        self.is_active[row as usize]
    }

    /// Rows in use, sorted.
    pub fn active(&self) -> &[u32] {
        &self.active
    }
}

/// A programme over rows stops once it exceeds what it is asked for by this, in units of the coordinates.
const TOL_IMPLIED: f64 = 1e-9;
/// A cell counts as outside the region if it misses it by this, in units of the coordinates. Erring side: keeps cells
/// that miss by less.
const MARGIN_EMPTY: f64 = 1e-12;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn pruning_leaves_the_region_and_no_row_that_others_imply(
            batches in prop::collection::vec(
                prop::collection::vec(([-1.0..1.0_f64, -1.0..1.0, -1.0..1.0], 0.1..1.2_f64), 1..8),
                1..6,
            ),
            superseded in any::<bool>(),
            points in prop::collection::vec([-1.0..1.0_f64, -1.0..1.0, -1.0..1.0], 100),
        ) {
            let limits = CellBox { lower: vec![-1.0; 3], upper: vec![1.0; 3] };
            let mut program = RowProgram::default();
            let mut rows = Rows::empty(3);
            for batch in &batches {
                for (a, b) in batch {
                    let norm = a.iter().map(|a| a * a).sum::<f64>().sqrt().max(1e-3);
                    let a: Vec<f64> = a.iter().map(|a| a / norm).collect();
                    // A row that is taken back leaves its place to another one.
                    let last = rows.active().last().copied().filter(|_| superseded);
                    rows.push(&a, 0.5 * b, last);
                    rows.pop(last);
                    rows.push(&a, *b, None);
                }
                rows.prune(&mut program, &limits);
            }
            let mut anew = Rows::empty(3);
            rows.active().iter().for_each(|&row| {
                anew.push(rows.a(row as usize), rows.b[row as usize], None);
            });
            anew.prune(&mut program, &limits);
            prop_assert_eq!(anew.active().len(), rows.active().len());
            for q in &points {
                let is_inside = |row: &u32| rows.slack(*row as usize, q) >= 0.0;
                if rows.active().iter().all(is_inside) {
                    prop_assert!((0..rows.len()).all(|row| rows.slack(row, q) >= -1e-7));
                }
            }
        }
    }
}
