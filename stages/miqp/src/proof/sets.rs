//! The sets that a proof speaks of, box and rows in the order of `proof.bin`, and multipliers for them.

use crate::exact::rational;
use convex_sets::HPolyhedron;
use convex_sets::lp::LpOutcome;
use manipulation::{Manipulation, Outer, PathMode, bound_above, solve};
use nalgebra::{DMatrix, DVector};
use num_rational::BigRational;
use num_traits::Zero;

/// (row, multiplier > 0), sorted by row.
pub type Sparse = Vec<(u32, f64)>;

/// What a bound must have to spare, as a share of the sizes of its terms: whoever sums them in another order, or with
/// another outward rounding, must come to the same verdict. Erring side: proves less.
const TOL_ROUNDING: f64 = 1e-12;

/// {x : l ≤ x ≤ u, A x ≤ b}.
#[derive(Debug, Clone)]
pub struct BoxedSet {
    /// A x ≤ b.
    pub rows: HPolyhedron,
    /// l ≤ x ≤ u.
    pub outer: Outer,
}

/// A lower bound of a linear function on a set.
#[derive(Debug, Clone, PartialEq)]
pub struct Support {
    /// The bound, with room for rounding.
    pub value: f64,
    /// Multipliers that give it.
    pub multipliers: Sparse,
}

impl BoxedSet {
    /// S ∩ P_j for one region, S ∩ P_a ∩ P_b for two.
    pub fn of_mode(manipulation: &Manipulation, mode: PathMode, regions: &[usize]) -> Self {
        let space = match mode {
            PathMode::Transit => &manipulation.placement_space,
            PathMode::Transfer => &manipulation.grasp_space,
        };
        Self::of(manipulation, &[space], regions)
    }

    /// CG ∩ CP ∩ P_j.
    pub fn of_waypoint(manipulation: &Manipulation, region_idx: usize) -> Self {
        Self::of(manipulation, &[&manipulation.grasp_space, &manipulation.placement_space], &[region_idx])
    }

    fn of(manipulation: &Manipulation, spaces: &[&HPolyhedron], regions: &[usize]) -> Self {
        let n = manipulation.dim();
        let mut outer =
            Outer { lower: DVector::repeat(n, f64::NEG_INFINITY), upper: DVector::repeat(n, f64::INFINITY) };
        let mut rows = HPolyhedron { A: DMatrix::zeros(0, n), b: DVector::zeros(0) };
        for space in spaces {
            // The first 2n rows of a space are its bounds, upper before lower (`polytope_of_space`).
            for k in 0..n {
                outer.upper[k] = outer.upper[k].min(space.b[k]);
                outer.lower[k] = outer.lower[k].max(-space.b[n + k]);
            }
            let others: Vec<usize> = (2 * n..space.n_faces()).collect();
            let (A, b) = space.select(&others);
            rows = rows.intersection(&HPolyhedron { A, b });
        }
        for &region_idx in regions {
            rows = rows.intersection(&manipulation.regions[region_idx]);
        }
        Self { rows, outer }
    }

    /// The same set as rows only.
    pub fn polyhedron(&self) -> HPolyhedron {
        HPolyhedron::from_box(&self.outer.lower, &self.outer.upper).intersection(&self.rows)
    }

    /// A bound of min g·x. `size` bounds the rounding of `g`: sums of the sizes of what each entry was summed from.
    pub fn minimum(&self, g: &DVector<f64>, size: &DVector<f64>) -> Support {
        let multipliers = match solve(g, &self.rows, &self.outer) {
            Some(LpOutcome::Optimal { multipliers, .. }) => sparse(&multipliers),
            _ => Vec::new(),
        };
        let value = self.bound(g, size, &multipliers);
        let trivial = self.bound(g, size, &[]);
        if value > trivial {
            Support { value, multipliers }
        } else {
            Support { value: trivial, multipliers: Vec::new() }
        }
    }

    /// Multipliers that prove the set empty; `None` proves nothing.
    pub fn emptiness(&self) -> Option<Sparse> {
        let zero = DVector::zeros(self.rows.ambient_dimension());
        let crossed = (0..zero.len()).any(|k| self.outer.lower[k] > self.outer.upper[k]);
        if crossed {
            // The box alone is empty, which needs no multipliers.
            return Some(Vec::new());
        }
        match solve(&zero, &self.rows, &self.outer) {
            Some(LpOutcome::Infeasible { farkas }) => {
                let multipliers = sparse(&farkas);
                (self.bound(&zero, &zero, &multipliers) > 0.0).then_some(multipliers)
            }
            _ => None,
        }
    }

    /// Multipliers that prove `f·x ≤ b` on the set in exact arithmetic; `None` proves nothing.
    pub fn implies(&self, f: &DVector<f64>, b: f64) -> Option<Sparse> {
        let twin = (0..self.rows.n_faces())
            .find(|&row| self.rows.b[row] <= b && self.rows.A.row(row) == f.transpose());
        let candidates = || {
            let solved = match solve(&-f, &self.rows, &self.outer) {
                Some(LpOutcome::Optimal { multipliers, .. }) => Some(sparse(&multipliers)),
                _ => None,
            };
            [Some(Vec::new()), solved].into_iter().flatten()
        };
        match twin {
            Some(row) => Some(vec![(row as u32, 1.0)]),
            None => candidates().find(|multipliers| self.exact_maximum(f, multipliers) <= rational(b)),
        }
    }

    /// y·b + max over the box of (f - Aᵀy)·x, exactly.
    fn exact_maximum(&self, f: &DVector<f64>, multipliers: &[(u32, f64)]) -> BigRational {
        let mut slope: Vec<BigRational> = f.iter().map(|&f| rational(f)).collect();
        let mut sum = BigRational::zero();
        for &(row, y) in multipliers {
            let y = rational(y);
            for (k, slope) in slope.iter_mut().enumerate() {
                *slope -= &y * rational(self.rows.A[(row as usize, k)]);
            }
            sum += y * rational(self.rows.b[row as usize]);
        }
        for (k, slope) in slope.into_iter().enumerate() {
            let end = if slope > BigRational::zero() { self.outer.upper[k] } else { self.outer.lower[k] };
            sum += slope * rational(end);
        }
        sum
    }

    /// -y·b + min over the box of (g + Aᵀy)·x, rounded down with room to spare.
    fn bound(&self, g: &DVector<f64>, size: &DVector<f64>, multipliers: &[(u32, f64)]) -> f64 {
        let reach = |k: usize| self.outer.lower[k].abs().max(self.outer.upper[k].abs());
        let mut dense = vec![0.0; self.rows.n_faces()];
        let mut sizes: f64 = (0..g.len()).map(|k| size[k] * reach(k)).sum();
        for &(row, y) in multipliers {
            let row = row as usize;
            dense[row] = y;
            let extent: f64 = (0..g.len()).map(|k| self.rows.A[(row, k)].abs() * reach(k)).sum();
            sizes += y * (self.rows.b[row].abs() + extent);
        }
        -bound_above(&-g, &self.rows, &self.outer, &dense) - TOL_ROUNDING * sizes
    }
}

/// Room for rounding in a sum of numbers with these sizes.
pub fn room(size: f64) -> f64 {
    TOL_ROUNDING * size
}

fn sparse(multipliers: &DVector<f64>) -> Sparse {
    let positive = multipliers.iter().enumerate().filter(|(_, y)| **y > 0.0 && y.is_finite());
    positive.map(|(row, &y)| (row as u32, y)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x + y ≤ 1 in the unit square.
    fn triangle() -> BoxedSet {
        BoxedSet {
            rows: HPolyhedron {
                A: DMatrix::from_row_slice(1, 2, &[1.0, 1.0]),
                b: DVector::from_vec(vec![1.0]),
            },
            outer: Outer { lower: DVector::zeros(2), upper: DVector::repeat(2, 1.0) },
        }
    }

    fn vector(x: f64, y: f64) -> DVector<f64> {
        DVector::from_vec(vec![x, y])
    }

    #[test]
    fn a_minimum_is_tight_and_below() {
        let g = vector(-2.0, -1.0);
        let support = triangle().minimum(&g, &g.abs());
        assert!(support.value <= -2.0 && support.value > -2.0 - 1e-10, "{support:?}");
        assert_eq!(support.multipliers.len(), 1);
    }

    #[test]
    fn what_is_implied_is_proven_and_what_is_not_is_not() {
        assert_eq!(triangle().implies(&vector(1.0, 1.0), 1.0), Some(vec![(0, 1.0)]));
        assert_eq!(triangle().implies(&vector(1.0, 0.0), 1.0), Some(Vec::new()));
        assert!(triangle().implies(&vector(2.0, 2.0), 2.0).is_some());
        assert_eq!(triangle().implies(&vector(1.0, 1.0), 1.0f64.next_down()), None);
    }

    #[test]
    fn emptiness_needs_a_gap() {
        let mut set = triangle();
        set.rows.b[0] = -0.1;
        assert!(set.emptiness().is_some());
        set.rows.b[0] = 0.0;
        assert_eq!(set.emptiness(), None);
        assert_eq!(triangle().emptiness(), None);
    }
}
