//! min { g·δ : q ∈ cell, A q ≤ b } by the dual simplex method, for bounds that are wanted by the thousand.
//!
//! Symbols: δ = q − m with m the cell's centre; u = δ / h, so that the cell is [-1, 1]ⁿ; c = g·h; each row becomes
//! α·u ≤ β. As `convex_sets::lp`, but it keeps its buffers, leaves rows out that hold on the whole cell, and stops as
//! soon as the bound is good enough: the objective only rises. What it returns are multipliers; whoever uses them
//! evaluates the bound from them, so nothing here has to be right.

use crate::cell::CellBox;
use crate::rows::{Multipliers, Rows};

/// A row counts as violated beyond this, in units of the cell.
const TOL_VIOLATED: f64 = 1e-10;
/// A pivot below this is taken for zero.
const TOL_PIVOT: f64 = 1e-11;
/// A pivot below this on the way to a first vertex: another one is taken.
const TOL_START: f64 = 1e-7;
/// Rows whose violations are computed side by side.
const LANES: usize = 8;
/// Pivots after which the bound reached is taken as it is.
const MAX_PIVOTS: usize = 80;

/// What the multipliers are for.
#[derive(Debug, Clone)]
pub enum Verdict {
    /// They bound g·δ from below.
    Bound(Multipliers),
    /// They exclude the cell (up to rounding).
    Infeasible(Multipliers),
}

/// An active constraint of a vertex: a row of the region, or a bound of coordinate j (true: the upper).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Active {
    /// Row.
    Row(u32),
    /// Bound.
    Bound(u16, bool),
}

/// Buffers, reused between programmes.
#[derive(Debug, Default)]
pub struct RowProgram {
    n: usize,
    /// The rows that the cell can violate: their indices, α [blocks of [`LANES`] rows, in each one lane after the other
    /// for each coordinate; the last block is filled with rows 0 ≤ 1] and β, of unit length.
    index: Vec<u32>,
    norm: Vec<f64>,
    alpha: Vec<f64>,
    beta: Vec<f64>,
    half: Vec<f64>,
    center: Vec<f64>,
    /// Coefficients of the row that is being loaded, over the cell.
    scaled: Vec<f64>,
    cost: Vec<f64>,
    /// The n active constraints: a row by its position, or m + 2j + side for a bound of u_j (side 1: upper).
    active: Vec<usize>,
    /// Inverse of the matrix of active normals, by columns [n × n].
    inverse: Vec<f64>,
    lambda: Vec<f64>,
    u: Vec<f64>,
    r: Vec<f64>,
    /// Positions of the rows that were active since the rows were loaded: looked at first, since similar programmes end
    /// at few of them.
    hot: Vec<usize>,
    /// [N | N⁻¹].
    table: Vec<f64>,
}

impl RowProgram {
    /// Multipliers of the active rows of `rows` for min g·δ over the cell; it may stop once the bound exceeds
    /// `enough`.
    pub fn minimize(
        &mut self,
        rows: &Rows,
        relevant: &[u32],
        cell: &CellBox,
        g: &[f64],
        enough: f64,
    ) -> Verdict {
        self.load(rows, relevant, cell);
        self.minimize_loaded(g, &[], enough)
    }

    /// As [`RowProgram::minimize`], over the cell that was loaded last; `start` is where a similar programme ended, or
    /// empty.
    pub fn minimize_loaded(&mut self, g: &[f64], start: &[Active], enough: f64) -> Verdict {
        let n = self.n;
        self.cost.clear();
        self.cost.extend((0..n).map(|j| g[j] * self.half[j]));
        if !self.start_at(start) {
            self.start_at_corner();
        }
        for _ in 0..MAX_PIVOTS {
            let objective: f64 = self.cost.iter().zip(&self.u).map(|(c, u)| c * u).sum();
            if objective > enough {
                break;
            }
            let Some((entering, violation)) = self.most_violated() else { break };
            self.coordinates_in_basis(entering);
            let Some(leaving) = self.leaving() else {
                return Verdict::Infeasible(self.farkas(entering));
            };
            let step = (self.lambda[leaving] / self.r[leaving]).max(0.0);
            let pivot = self.r[leaving];
            for k in 0..n {
                if k != leaving {
                    self.lambda[k] = (self.lambda[k] - step * self.r[k]).max(0.0);
                }
            }
            self.lambda[leaving] = step;
            // The vertex moves along the edge that leaves constraint `leaving`.
            for j in 0..n {
                self.u[j] -= violation / pivot * self.inverse[leaving * n + j];
            }
            for j in 0..n {
                let edge = self.inverse[leaving * n + j] / pivot;
                for k in 0..n {
                    if k != leaving {
                        self.inverse[k * n + j] -= self.r[k] * edge;
                    }
                }
                self.inverse[leaving * n + j] = edge;
            }
            self.active[leaving] = entering;
        }
        Verdict::Bound(self.multipliers(|k| self.lambda[k]))
    }

    /// Where the last programme ended.
    pub fn basis(&self) -> Vec<Active> {
        let m = self.index.len();
        let of = |&constraint: &usize| match constraint.checked_sub(m) {
            None => Active::Row(self.index[constraint]),
            Some(bound) => Active::Bound((bound / 2) as u16, bound % 2 == 1),
        };
        self.active.iter().map(of).collect()
    }

    /// Starts at the vertex of `start`, if that is one and its multipliers are not negative.
    fn start_at(&mut self, start: &[Active]) -> bool {
        let (m, n) = (self.index.len(), self.n);
        if start.len() != n || n == 0 {
            return false;
        }
        self.active.clear();
        for constraint in start {
            self.active.push(match *constraint {
                Active::Row(row) => match self.index.iter().position(|&index| index == row) {
                    Some(position) => {
                        if !self.hot.contains(&position) {
                            self.hot.push(position);
                        }
                        position
                    }
                    None => return false,
                },
                Active::Bound(j, upper) => m + 2 * usize::from(j) + usize::from(upper),
            });
        }
        // [N | I], N the normals by rows.
        let width = 2 * n;
        self.table.clear();
        self.table.resize(n * width, 0.0);
        for k in 0..n {
            for j in 0..n {
                self.table[k * width + j] = self.normal(self.active[k], j);
            }
            self.table[k * width + n + k] = 1.0;
        }
        if !eliminate(&mut self.table, n) {
            return false;
        }
        // Row j of the right half is row j of N⁻¹; `inverse` holds columns.
        self.inverse.clear();
        self.inverse.resize(n * n, 0.0);
        self.lambda.clear();
        for k in 0..n {
            for j in 0..n {
                self.inverse[k * n + j] = self.table[j * width + n + k];
            }
            let column = &mut self.inverse[k * n..(k + 1) * n];
            let mut lambda: f64 = -self.cost.iter().zip(&*column).map(|(c, v)| c * v).sum::<f64>();
            if lambda < 0.0 {
                let Some(bound) = self.active[k].checked_sub(m) else { return false };
                // The other bound of the same coordinate has the opposite normal.
                self.active[k] = m + (bound ^ 1);
                column.iter_mut().for_each(|v| *v = -*v);
                lambda = -lambda;
            }
            self.lambda.push(lambda);
        }
        self.u.clear();
        self.u.resize(n, 0.0);
        for k in 0..n {
            let beta = if self.active[k] < m { self.beta[self.active[k]] } else { 1.0 };
            for j in 0..n {
                self.u[j] += beta * self.inverse[k * n + j];
            }
        }
        self.r.clear();
        self.r.resize(n, 0.0);
        true
    }

    fn normal(&self, constraint: usize, j: usize) -> f64 {
        let m = self.index.len();
        match constraint.checked_sub(m) {
            None => self.alpha[self.position(constraint) + j * LANES],
            Some(bound) if bound / 2 != j => 0.0,
            Some(bound) => {
                if bound % 2 == 1 {
                    1.0
                } else {
                    -1.0
                }
            }
        }
    }

    /// The vertex that the last programme over `cell` ended at.
    pub fn point(&self, cell: &CellBox) -> Vec<f64> {
        (0..self.n).map(|j| cell.center(j) + self.half[j] * self.u[j].clamp(-1.0, 1.0)).collect()
    }

    /// Scales the rows to the cell and leaves those out that it can not violate.
    pub fn load(&mut self, rows: &Rows, relevant: &[u32], cell: &CellBox) {
        let n = cell.lower.len();
        self.n = n;
        self.half.clear();
        self.half.extend((0..n).map(|j| cell.half(j)));
        self.center.clear();
        self.center.extend((0..n).map(|j| cell.center(j)));
        for buffer in [&mut self.alpha, &mut self.beta, &mut self.norm] {
            buffer.clear();
        }
        self.index.clear();
        self.hot.clear();
        for &row in relevant {
            let (mut beta, mut most, mut norm) = (rows.b[row as usize], 0.0, 0.0);
            self.scaled.clear();
            for ((a, half), center) in rows.a(row as usize).iter().zip(&self.half).zip(&self.center) {
                let scaled = a * half;
                beta -= a * center;
                most += scaled.abs();
                norm += scaled * scaled;
                self.scaled.push(scaled);
            }
            if most <= beta || norm <= 0.0 {
                continue;
            }
            let (i, norm) = (self.index.len(), norm.sqrt());
            self.index.push(row);
            self.norm.push(norm);
            self.beta.push(beta / norm);
            if i.is_multiple_of(LANES) {
                self.alpha.resize((i + LANES) * n, 0.0);
            }
            let first = self.position(i);
            let scale = 1.0 / norm;
            for (alpha, scaled) in self.alpha[first..].iter_mut().step_by(LANES).zip(&self.scaled) {
                *alpha = scaled * scale;
            }
        }
        self.beta.resize(self.index.len().next_multiple_of(LANES), 1.0);
    }

    /// Where α of row `i` begins; the coordinates follow at distances of [`LANES`].
    #[inline]
    fn position(&self, i: usize) -> usize {
        i / LANES * LANES * self.n + i % LANES
    }

    /// Starts at the corner of the cell that is cheapest.
    fn start_at_corner(&mut self) {
        let (m, n) = (self.index.len(), self.n);
        self.active.clear();
        self.inverse.clear();
        self.inverse.resize(n * n, 0.0);
        self.lambda.clear();
        self.u.clear();
        self.r.clear();
        self.r.resize(n, 0.0);
        for j in 0..n {
            let at_upper = self.cost[j] < 0.0;
            let sign = if at_upper { 1.0 } else { -1.0 };
            self.active.push(m + 2 * j + usize::from(at_upper));
            self.inverse[j * n + j] = sign;
            self.lambda.push(self.cost[j].abs());
            self.u.push(sign);
        }
    }

    fn most_violated(&mut self) -> Option<(usize, f64)> {
        let (m, n) = (self.index.len(), self.n);
        let mut worst = (usize::MAX, TOL_VIOLATED);
        for &i in &self.hot {
            let alpha = self.alpha[self.position(i)..].iter().step_by(LANES);
            let violation = alpha.zip(&self.u).map(|(alpha, u)| alpha * u).sum::<f64>() - self.beta[i];
            if violation > worst.1 {
                worst = (i, violation);
            }
        }
        for j in 0..n {
            let violation = self.u[j].abs() - 1.0;
            if violation > worst.1 {
                worst = (m + 2 * j + usize::from(self.u[j] > 0.0), violation);
            }
        }
        if worst.0 != usize::MAX && !self.active.contains(&worst.0) {
            return Some(worst);
        }
        worst = (usize::MAX, TOL_VIOLATED);
        let blocks = self.alpha.chunks_exact((n * LANES).max(1)).zip(self.beta.chunks_exact(LANES));
        for (block, (alpha, beta)) in blocks.enumerate() {
            let mut violation: [f64; LANES] = std::array::from_fn(|lane| -beta[lane]);
            for (alpha, u) in alpha.chunks_exact(LANES).zip(&self.u) {
                for (violation, alpha) in violation.iter_mut().zip(alpha) {
                    *violation += alpha * u;
                }
            }
            if violation.iter().fold(f64::NEG_INFINITY, |most, &x| most.max(x)) > worst.1 {
                for (lane, &violation) in violation.iter().enumerate() {
                    if violation > worst.1 {
                        worst = (block * LANES + lane, violation);
                    }
                }
            }
        }
        if worst.0 == usize::MAX || self.active.contains(&worst.0) {
            return None;
        }
        if !self.hot.contains(&worst.0) {
            self.hot.push(worst.0);
        }
        Some(worst)
    }

    /// r with (normal of `constraint`) = Σ r_k (normal of active constraint k).
    fn coordinates_in_basis(&mut self, constraint: usize) {
        let (m, n) = (self.index.len(), self.n);
        for k in 0..n {
            let column = &self.inverse[k * n..(k + 1) * n];
            self.r[k] = if constraint < m {
                let alpha = self.alpha[self.position(constraint)..].iter().step_by(LANES);
                column.iter().zip(alpha).map(|(v, alpha)| alpha * v).sum()
            } else {
                let (j, upper) = ((constraint - m) / 2, (constraint - m) % 2 == 1);
                if upper { column[j] } else { -column[j] }
            };
        }
    }

    /// The active constraint that first loses its multiplier; of equal ones that with the largest pivot.
    fn leaving(&self) -> Option<usize> {
        let mut best: Option<(usize, f64)> = None;
        for k in 0..self.n {
            if self.r[k] <= TOL_PIVOT {
                continue;
            }
            let ratio = self.lambda[k] / self.r[k];
            let better =
                best.is_none_or(|(at, least)| ratio < least || (ratio == least && self.r[k] > self.r[at]));
            if better {
                best = Some((k, ratio));
            }
        }
        best.map(|(k, _)| k)
    }

    fn multipliers(&self, value: impl Fn(usize) -> f64) -> Multipliers {
        let m = self.index.len();
        let mut multipliers: Multipliers = (0..self.n)
            .filter(|&k| self.active[k] < m && value(k) > 0.0)
            .map(|k| (self.index[self.active[k]], value(k) / self.norm[self.active[k]]))
            .collect();
        multipliers.sort_unstable_by_key(|&(row, _)| row);
        multipliers
    }

    fn farkas(&self, entering: usize) -> Multipliers {
        let mut multipliers = self.multipliers(|k| -self.r[k]);
        if entering < self.index.len() {
            multipliers.push((self.index[entering], 1.0 / self.norm[entering]));
        }
        multipliers.sort_unstable_by_key(|&(row, _)| row);
        multipliers
    }
}

/// [N | I] → [I | N⁻¹], n rows of 2n; false where a pivot is too small.
fn eliminate(table: &mut [f64], n: usize) -> bool {
    let width = 2 * n;
    for j in 0..n {
        let size = |k: usize| table[k * width + j].abs();
        let Some(pivot) = (j..n).max_by(|&x, &y| size(x).total_cmp(&size(y))) else { return false };
        if !(size(pivot) > TOL_START) {
            return false;
        }
        if pivot != j {
            for c in 0..width {
                table.swap(pivot * width + c, j * width + c);
            }
        }
        let scale = 1.0 / table[j * width + j];
        table[j * width..(j + 1) * width].iter_mut().for_each(|x| *x *= scale);
        for k in 0..n {
            let factor = table[k * width + j];
            if k != j && factor != 0.0 {
                for c in j..width {
                    table[k * width + c] -= factor * table[j * width + c];
                }
            }
        }
    }
    true
}
