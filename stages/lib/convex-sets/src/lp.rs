//! Small dense linear programmes by the dual simplex method.
//!
//! Symbols: min cᵀx  s.t.  A x ≤ b (m rows, n unknowns), l ≤ x ≤ u with a finite box.
//! The method keeps n *active* constraints, rows or bounds, whose normals g_k form a basis with
//! -c = Σ λ_k g_k, λ ≥ 0: the vertex x where they meet is optimal for them. A violated constraint enters, the
//! active one that first loses λ ≥ 0 leaves (Lemke 1954; Goldfarb & Idnani 1983 with P = 0). A violated
//! constraint that no active one can make way for gives Farkas multipliers.
//!
//! C-space mixes radians and metres, so the programme is solved in u = (x - mid) / half, where the box is
//! [-1, 1]ⁿ, with rows and costs scaled to norm 1: every tolerance is relative to the box.

use nalgebra::{DMatrix, DVector};

use crate::lp_bound::safe_lower_bound;

/// A row counts as violated beyond this, in units of the box. Erring side: calls a point feasible that misses
/// a row by this much.
pub const TOL_FEASIBLE: f64 = 1e-10;
/// A pivot below this is taken for zero. Erring side: leaves a programme undecided.
const TOL_PIVOT: f64 = 1e-10;
/// Largest gap between the value and its proven bound, relative to the cost's extent over the box. Erring side:
/// leaves a programme undecided.
const TOL_GAP: f64 = 1e-6;
/// Pivots between two factorisations of the basis.
const REFACTOR_AFTER: usize = 40;
/// Pivots without progress after which the smallest index enters and leaves (Bland), which cannot cycle.
const BLAND_AFTER: usize = 60;

/// What [`LinearProgram::minimize`] found.
#[derive(Debug, Clone, PartialEq)]
pub enum LpOutcome {
    /// A vertex that is optimal up to rounding.
    Optimal {
        /// The minimiser [n]; misses no row by more than [`TOL_FEASIBLE`] times the box.
        x: DVector<f64>,
        /// cᵀx.
        value: f64,
        /// y ≥ 0 [m]: one multiplier a row of A; `safe_lower_bound(c, …, y)` is close to `value`.
        multipliers: DVector<f64>,
    },
    /// No point of the box satisfies all rows. This is proven: with y = `farkas`, -bᵀy + min over the box of
    /// (Aᵀy)ᵀx is positive whatever rounding does.
    Infeasible {
        /// y ≥ 0 [m].
        farkas: DVector<f64>,
    },
    /// Rounding hides the answer (rows that nearly touch, values that are not finite): claim nothing.
    Undecided {
        /// The last point, possibly infeasible.
        x: DVector<f64>,
    },
}

impl LpOutcome {
    /// The minimiser, if the programme was solved.
    pub fn optimal_point(&self) -> Option<&DVector<f64>> {
        match self {
            Self::Optimal { x, .. } => Some(x),
            Self::Infeasible { .. } | Self::Undecided { .. } => None,
        }
    }

    /// The least value, if the programme was solved.
    pub fn optimal_value(&self) -> Option<f64> {
        match self {
            Self::Optimal { value, .. } => Some(*value),
            Self::Infeasible { .. } | Self::Undecided { .. } => None,
        }
    }

    /// Whether infeasibility is proven.
    pub fn is_infeasible(&self) -> bool {
        matches!(self, Self::Infeasible { .. })
    }
}

/// min cᵀx s.t. A x ≤ b, `lower` ≤ x ≤ `upper`: one programme; for several costs over one set keep a
/// [`LinearProgram`].
///
/// `c` [n], `A` [m × n], `b` [m]; the box must be finite.
pub fn minimize(
    c: &DVector<f64>,
    A: &DMatrix<f64>,
    b: &DVector<f64>,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
) -> LpOutcome {
    LinearProgram::new(A, b, lower, upper).minimize(c)
}

/// The feasible set of a programme, scaled once for any number of costs.
#[derive(Debug, Clone)]
pub struct LinearProgram<'a> {
    A: &'a DMatrix<f64>,
    b: &'a DVector<f64>,
    lower: &'a DVector<f64>,
    upper: &'a DVector<f64>,
    mid: Vec<f64>,
    half: Vec<f64>,
    /// Scaled rows, row-major [m × n].
    rows: Vec<f64>,
    /// Scaled offsets [m].
    offsets: Vec<f64>,
    /// Norm of each row over the box before scaling [m].
    norms: Vec<f64>,
    /// A row without any extent in the box that its offset contradicts.
    contradiction: Option<usize>,
    finite: bool,
}

/// One run of the method.
struct Basis {
    /// Active constraints [n]: row i < m; m + j the upper, m + n + j the lower bound of unknown j.
    active: Vec<usize>,
    /// Inverse of the matrix of active normals; stored by columns [n × n].
    inverse: Vec<f64>,
    lambda: Vec<f64>,
    u: Vec<f64>,
}

impl<'a> LinearProgram<'a> {
    /// The set {x : A x ≤ b, lower ≤ x ≤ upper}; shapes as in [`minimize`].
    pub fn new(
        A: &'a DMatrix<f64>,
        b: &'a DVector<f64>,
        lower: &'a DVector<f64>,
        upper: &'a DVector<f64>,
    ) -> Self {
        let (m, n) = (A.nrows(), lower.len());
        let mid: Vec<f64> = (0..n).map(|j| 0.5 * lower[j] + 0.5 * upper[j]).collect();
        let half: Vec<f64> = (0..n).map(|j| 0.5 * (upper[j] - lower[j])).collect();
        let mut finite = mid.iter().chain(&half).all(|v| v.is_finite());
        let mut rows = vec![0.0; m * n];
        let mut offsets = vec![0.0; m];
        let mut norms = vec![1.0; m];
        let mut contradiction = None;
        for i in 0..m {
            let row = &mut rows[i * n..(i + 1) * n];
            let mut offset = b[i];
            let mut size = b[i].abs();
            let mut norm = 0.0;
            for j in 0..n {
                row[j] = A[(i, j)] * half[j];
                norm += row[j] * row[j];
                offset -= A[(i, j)] * mid[j];
                size += (A[(i, j)] * mid[j]).abs();
            }
            let norm = norm.sqrt();
            finite &= norm.is_finite() && !offset.is_nan();
            if norm > 1e-14 * size.max(f64::MIN_POSITIVE) {
                row.iter_mut().for_each(|v| *v /= norm);
                offsets[i] = offset / norm;
                norms[i] = norm;
            } else {
                row.fill(0.0);
                offsets[i] = f64::INFINITY;
                if offset < 0.0 {
                    contradiction = Some(i);
                }
            }
        }
        Self { A, b, lower, upper, mid, half, rows, offsets, norms, contradiction, finite }
    }

    /// Solves for the cost `c` [n].
    pub fn minimize(&self, c: &DVector<f64>) -> LpOutcome {
        let (m, n) = (self.offsets.len(), self.mid.len());
        let middle = DVector::from_column_slice(&self.mid);
        if !self.finite || !c.iter().all(|v| v.is_finite()) {
            return LpOutcome::Undecided { x: middle };
        }
        if self.half.iter().any(|&h| h < 0.0) {
            return LpOutcome::Infeasible { farkas: DVector::zeros(m) };
        }
        if let Some(row_idx) = self.contradiction {
            let mut farkas = DVector::zeros(m);
            farkas[row_idx] = 1.0;
            return match self.is_proof(&farkas) {
                true => LpOutcome::Infeasible { farkas },
                false => LpOutcome::Undecided { x: middle },
            };
        }
        let mut cost: Vec<f64> = (0..n).map(|j| c[j] * self.half[j]).collect();
        let cost_scale = cost.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        if cost_scale > 0.0 {
            cost.iter_mut().for_each(|v| *v /= cost_scale);
        }
        let mut basis = Basis::at_cheapest_corner(&cost, m);
        let max_pivots = 50 * (m + n) + 1000;
        let mut since_refactored = 0;
        let mut stalled = 0;
        for _ in 0..max_pivots {
            let bland = stalled >= BLAND_AFTER;
            let Some((entering, violation)) = self.violated(&basis, bland) else {
                if since_refactored > 0 {
                    if !self.refactor(&mut basis, &cost) {
                        break;
                    }
                    since_refactored = 0;
                    if self.violated(&basis, bland).is_some() {
                        continue;
                    }
                }
                return self.optimal(c, &basis, cost_scale);
            };
            let r = self.coordinates_in_basis(&basis, entering);
            let Some(leaving) = leaving(&basis, &r, bland) else {
                if since_refactored > 0 && self.refactor(&mut basis, &cost) {
                    since_refactored = 0;
                    continue;
                }
                return self.infeasible(&basis, entering, &r);
            };
            let step = (basis.lambda[leaving] / r[leaving]).max(0.0);
            stalled = if step * violation > 1e-14 { 0 } else { stalled + 1 };
            basis.replace(leaving, entering, &r, step, violation);
            since_refactored += 1;
            if since_refactored >= REFACTOR_AFTER {
                if !self.refactor(&mut basis, &cost) {
                    break;
                }
                since_refactored = 0;
            }
        }
        LpOutcome::Undecided { x: self.unscaled(&basis.u) }
    }

    fn unscaled(&self, u: &[f64]) -> DVector<f64> {
        DVector::from_fn(u.len(), |j, _| {
            (self.mid[j] + self.half[j] * u[j]).clamp(self.lower[j], self.upper[j])
        })
    }

    /// The entering constraint: the most violated one, or with `first` the one of smallest index.
    fn violated(&self, basis: &Basis, first: bool) -> Option<(usize, f64)> {
        let (m, n) = (self.offsets.len(), self.mid.len());
        let mut worst: Option<(usize, f64)> = None;
        let mut offer = |idx: usize, violation: f64| {
            if violation > TOL_FEASIBLE && worst.is_none_or(|(_, w)| !first && violation > w) {
                worst = Some((idx, violation));
            }
        };
        for i in 0..m {
            let row = &self.rows[i * n..(i + 1) * n];
            offer(i, row.iter().zip(&basis.u).map(|(a, u)| a * u).sum::<f64>() - self.offsets[i]);
        }
        for j in 0..n {
            offer(m + j, basis.u[j] - 1.0);
            offer(m + n + j, -basis.u[j] - 1.0);
        }
        worst.filter(|(idx, _)| !basis.active.contains(idx))
    }

    /// r with (normal of `constraint`) = Σ r_k g_k.
    fn coordinates_in_basis(&self, basis: &Basis, constraint: usize) -> Vec<f64> {
        let (m, n) = (self.offsets.len(), self.mid.len());
        (0..n)
            .map(|k| {
                let column = &basis.inverse[k * n..(k + 1) * n];
                match constraint {
                    i if i < m => self.rows[i * n..(i + 1) * n].iter().zip(column).map(|(a, v)| a * v).sum(),
                    i if i < m + n => column[i - m],
                    i => -column[i - m - n],
                }
            })
            .collect()
    }

    /// Recomputes inverse, vertex and multipliers from the active set; false if its normals are dependent.
    fn refactor(&self, basis: &mut Basis, cost: &[f64]) -> bool {
        let (m, n) = (self.offsets.len(), self.mid.len());
        let mut G = DMatrix::zeros(n, n);
        let mut offsets = DVector::zeros(n);
        for (k, &idx) in basis.active.iter().enumerate() {
            match idx {
                i if i < m => {
                    (0..n).for_each(|j| G[(k, j)] = self.rows[i * n + j]);
                    offsets[k] = self.offsets[i];
                }
                i if i < m + n => {
                    G[(k, i - m)] = 1.0;
                    offsets[k] = 1.0;
                }
                i => {
                    G[(k, i - m - n)] = -1.0;
                    offsets[k] = 1.0;
                }
            }
        }
        let Some(inverse) = G.clone().try_inverse() else { return false };
        let mut u = &inverse * &offsets;
        u += &inverse * (&offsets - &G * &u);
        let c = DVector::from_column_slice(cost);
        let lambda = -(inverse.transpose() * &c);
        if !u.iter().chain(inverse.iter()).all(|v| v.is_finite()) {
            return false;
        }
        basis.inverse.copy_from_slice(inverse.as_slice());
        basis.u.copy_from_slice(u.as_slice());
        for k in 0..n {
            // Rounding alone makes a multiplier negative here.
            basis.lambda[k] = lambda[k].max(0.0);
        }
        true
    }

    fn optimal(&self, c: &DVector<f64>, basis: &Basis, cost_scale: f64) -> LpOutcome {
        let m = self.offsets.len();
        let mut multipliers = DVector::zeros(m);
        for (k, &idx) in basis.active.iter().enumerate() {
            if idx < m {
                multipliers[idx] = basis.lambda[k] * cost_scale / self.norms[idx];
            }
        }
        let x = self.unscaled(&basis.u);
        let value = c.dot(&x);
        let bound = safe_lower_bound(c, self.A, self.b, self.lower, self.upper, &multipliers);
        // Both sides of the optimum must agree, or the last basis was too ill-conditioned to trust.
        if value - bound > TOL_GAP * (cost_scale + value.abs()).max(1e-200) {
            return LpOutcome::Undecided { x };
        }
        LpOutcome::Optimal { value, x, multipliers }
    }

    /// From (normal of `entering`) = Σ r_k g_k with r ≤ 0: the entering row plus -r of the active ones cancel.
    fn infeasible(&self, basis: &Basis, entering: usize, r: &[f64]) -> LpOutcome {
        let m = self.offsets.len();
        let mut farkas = DVector::zeros(m);
        if entering < m {
            farkas[entering] = 1.0 / self.norms[entering];
        }
        for (k, &idx) in basis.active.iter().enumerate() {
            if idx < m {
                farkas[idx] = (-r[k]).max(0.0) / self.norms[idx];
            }
        }
        match self.is_proof(&farkas) {
            true => LpOutcome::Infeasible { farkas },
            false => LpOutcome::Undecided { x: self.unscaled(&basis.u) },
        }
    }

    fn is_proof(&self, farkas: &DVector<f64>) -> bool {
        let nothing = DVector::zeros(self.mid.len());
        safe_lower_bound(&nothing, self.A, self.b, self.lower, self.upper, farkas) > 0.0
    }
}

/// The active constraint that leaves for one with coordinates `r`: least λ_k / r_k over r_k > 0, among equals
/// the largest pivot, or with `bland` the smallest index.
fn leaving(basis: &Basis, r: &[f64], bland: bool) -> Option<usize> {
    let mut best: Option<(usize, f64)> = None;
    for k in 0..r.len() {
        if r[k] <= TOL_PIVOT {
            continue;
        }
        let ratio = basis.lambda[k] / r[k];
        let better = best.is_none_or(|(at, least)| {
            let tie = (ratio - least).abs() <= 1e-13 * (1.0 + least);
            match (tie, bland) {
                (true, true) => basis.active[k] < basis.active[at],
                (true, false) => r[k] > r[at],
                (false, _) => ratio < least,
            }
        });
        if better {
            best = Some((k, ratio));
        }
    }
    best.map(|(k, _)| k)
}

impl Basis {
    /// The corner of the box that is cheapest for `cost`: dual feasible by construction.
    fn at_cheapest_corner(cost: &[f64], m: usize) -> Self {
        let n = cost.len();
        let mut basis =
            Self { active: vec![0; n], inverse: vec![0.0; n * n], lambda: vec![0.0; n], u: vec![0.0; n] };
        for j in 0..n {
            let at_upper = cost[j] < 0.0;
            basis.active[j] = if at_upper { m + j } else { m + n + j };
            basis.inverse[j * n + j] = if at_upper { 1.0 } else { -1.0 };
            basis.lambda[j] = cost[j].abs();
            basis.u[j] = if at_upper { 1.0 } else { -1.0 };
        }
        basis
    }

    /// Puts `entering`, with coordinates `r` in the basis and missed by `violation`, in the place of the active
    /// constraint at `leaving`.
    fn replace(&mut self, leaving: usize, entering: usize, r: &[f64], step: f64, violation: f64) {
        let n = self.u.len();
        for j in 0..n {
            self.inverse[leaving * n + j] /= r[leaving];
        }
        for k in 0..n {
            if k != leaving && r[k] != 0.0 {
                for j in 0..n {
                    self.inverse[k * n + j] -= r[k] * self.inverse[leaving * n + j];
                }
                self.lambda[k] = (self.lambda[k] - step * r[k]).max(0.0);
            }
        }
        for j in 0..n {
            self.u[j] -= violation * self.inverse[leaving * n + j];
        }
        self.lambda[leaving] = step;
        self.active[leaving] = entering;
    }
}
