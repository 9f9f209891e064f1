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

/// Buffers, reused between programmes.
#[derive(Debug, Default)]
pub struct RowProgram {
    n: usize,
    /// The rows that the cell can violate: their indices, α [n each] and β, of unit length.
    index: Vec<u32>,
    norm: Vec<f64>,
    alpha: Vec<f64>,
    beta: Vec<f64>,
    half: Vec<f64>,
    cost: Vec<f64>,
    /// The n active constraints: a row by its position, or m + 2j + side for a bound of u_j (side 1: upper).
    active: Vec<usize>,
    /// Inverse of the matrix of active normals, by columns [n × n].
    inverse: Vec<f64>,
    lambda: Vec<f64>,
    u: Vec<f64>,
    r: Vec<f64>,
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
        self.load(rows, relevant, cell, g);
        let n = self.n;
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

    /// The vertex that the last programme over `cell` ended at.
    pub fn point(&self, cell: &CellBox) -> Vec<f64> {
        (0..self.n).map(|j| cell.center(j) + self.half[j] * self.u[j].clamp(-1.0, 1.0)).collect()
    }

    /// Scales the programme and starts at the corner of the cell that is cheapest.
    fn load(&mut self, rows: &Rows, relevant: &[u32], cell: &CellBox, g: &[f64]) {
        let n = g.len();
        self.n = n;
        self.half.clear();
        self.half.extend((0..n).map(|j| cell.half(j)));
        self.cost.clear();
        self.cost.extend((0..n).map(|j| g[j] * self.half[j]));
        for buffer in [&mut self.alpha, &mut self.beta, &mut self.norm] {
            buffer.clear();
        }
        self.index.clear();
        for &row in relevant {
            let a = &rows.a[row as usize];
            let (mut beta, mut most, mut norm) = (rows.b[row as usize], 0.0, 0.0);
            for j in 0..n {
                let scaled = a[j] * self.half[j];
                beta -= a[j] * cell.center(j);
                most += scaled.abs();
                norm += scaled * scaled;
            }
            if most <= beta || norm <= 0.0 {
                continue;
            }
            let norm = norm.sqrt();
            self.index.push(row);
            self.norm.push(norm);
            self.beta.push(beta / norm);
            let half = &self.half;
            self.alpha.extend((0..n).map(|j| a[j] * half[j] / norm));
        }
        let m = self.index.len();
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

    fn most_violated(&self) -> Option<(usize, f64)> {
        let (m, n) = (self.index.len(), self.n);
        let mut worst = (usize::MAX, TOL_VIOLATED);
        for (i, alpha) in self.alpha.chunks_exact(n).enumerate() {
            let violation = alpha.iter().zip(&self.u).map(|(a, u)| a * u).sum::<f64>() - self.beta[i];
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
        (worst.0 != usize::MAX && !self.active.contains(&worst.0)).then_some(worst)
    }

    /// r with (normal of `constraint`) = Σ r_k (normal of active constraint k).
    fn coordinates_in_basis(&mut self, constraint: usize) {
        let (m, n) = (self.index.len(), self.n);
        for k in 0..n {
            let column = &self.inverse[k * n..(k + 1) * n];
            self.r[k] = if constraint < m {
                let alpha = &self.alpha[constraint * n..(constraint + 1) * n];
                alpha.iter().zip(column).map(|(a, v)| a * v).sum()
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
