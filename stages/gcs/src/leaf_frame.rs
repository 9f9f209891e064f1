//! Coordinates of a leaf: q = s + B u, with F B = 0.
//!
//! Symbols: F [k × n] kept forms, s the start of the segment, {q : F q = F s} its leaf, u ∈ R^d, d = n − rank F.
//! Gauss-Jordan elimination splits the coordinates of q into *free* ones, which are u shifted by s, and *dependent*
//! ones. With coefficients 0 and ±1 the entries of B are 0 and ±1 too, F B = 0 holds exactly, and a point whose free
//! coordinates lie on a binary grid satisfies the kept forms bit for bit. An orthonormal basis would round; lengths
//! are ‖B u‖ instead.

use crate::exact;
use nalgebra::{DMatrix, DVector};

/// Step of the grid that control points lie on, the one that the plan's configurations are snapped to.
pub const GRID: f64 = 1.0 / (1_u64 << 40) as f64;

/// Most by which a kept form may differ between start and goal of a segment, in units of the form, before the plan is
/// refused. Erring side: a larger value accepts plans whose last piece leaves the leaf by this much.
pub const TOL_KEPT: f64 = 1e-9;

/// What a kept form may change by where no numbers near by keep it exactly, as a share of the sum of its terms' sizes:
/// a few units in the last place. Erring side: a larger value accepts paths that leave their leaf by this much.
const TOL_ROUNDING: f64 = 8.0 * f64::EPSILON;

/// A pivot below this counts as zero. Erring side: a form that nearly repeats others is kept as rows, not eliminated.
const TOL_PIVOT: f64 = 1e-9;

/// q = s + B u on the leaf of `F` through `s`.
#[derive(Debug, Clone)]
pub struct LeafFrame {
    /// Kept forms [k × n].
    pub F: DMatrix<f64>,
    /// Start of the segment [n].
    pub s: DVector<f64>,
    /// Basis [n × d]; F B = 0 exactly, or, if elimination rounds, the identity.
    pub B: DMatrix<f64>,
    /// Whether F B = 0; otherwise kept forms must be imposed as rows.
    pub eliminated: bool,
    /// Coordinate of q that each entry of u shifts [d].
    free: Vec<usize>,
}

impl LeafFrame {
    /// The frame of the leaf of `F` [k × n] through `s` [n].
    pub fn new(F: &DMatrix<f64>, s: &DVector<f64>) -> Self {
        let n = s.len();
        let (reduced, pivots) = gauss_jordan(F);
        let free: Vec<usize> = (0..n).filter(|j| !pivots.iter().any(|&(_, column)| column == *j)).collect();
        let mut B = DMatrix::zeros(n, free.len());
        for (k, &j) in free.iter().enumerate() {
            B[(j, k)] = 1.0;
            for &(row_idx, column) in &pivots {
                B[(column, k)] = -reduced[(row_idx, j)];
            }
        }
        if exact::annihilates(F, &B) {
            Self { F: F.clone(), s: s.clone(), B, eliminated: true, free }
        } else {
            let B = DMatrix::identity(n, n);
            Self { F: F.clone(), s: s.clone(), B, eliminated: false, free: (0..n).collect() }
        }
    }

    /// Dimension d of u.
    pub fn dimension(&self) -> usize {
        self.free.len()
    }

    /// Coordinate of q that entry `k` of u shifts.
    pub fn free_coordinate(&self, k: usize) -> usize {
        self.free[k]
    }

    /// u of a configuration on the leaf [d].
    pub fn u_of(&self, q: &DVector<f64>) -> DVector<f64> {
        DVector::from_iterator(self.free.len(), self.free.iter().map(|&j| q[j] - self.s[j]))
    }

    /// ‖B (u − v)‖, the distance in C-space.
    pub fn distance(&self, u: &DVector<f64>, v: &DVector<f64>) -> f64 {
        (&self.B * (u - v)).norm()
    }

    /// A configuration on the leaf within a few grid steps of s + B u. Kept forms equal those of `s` exactly if a
    /// point near by does that, else as [`LeafFrame::keeps_forms`] allows; `None` if none was found.
    pub fn place(&self, u: &DVector<f64>) -> Option<DVector<f64>> {
        if self.eliminated {
            // First the configuration on the grid, like those of the plan; if s is off the grid such that a
            // dependent coordinate rounds, the shift on the grid, then coarser shifts.
            let on_grid = self.shifted(u, |s_j, u_k| snap(s_j + u_k, GRID));
            let coarser = |coarse: f64| self.shifted(u, move |s_j, u_k| s_j + snap(u_k, coarse * GRID));
            let exact = std::iter::once(on_grid.clone())
                .chain([1.0, 16.0, 256.0].map(coarser))
                .find(|q| exact::same_leaf(&self.F, q, &self.s));
            return exact.or_else(|| self.keeps_forms(&on_grid).then_some(on_grid));
        }
        let q = &self.s + u;
        let residual = &self.F * &q - &self.F * &self.s;
        let pseudo_inverse = self.F.clone().pseudo_inverse(TOL_PIVOT).ok()?;
        let q = q - pseudo_inverse * residual;
        self.keeps_forms(&q).then_some(q)
    }

    /// Whether `q` lies on the leaf: exactly, or, where no numbers near by do (a start off the grid, coefficients
    /// other than 0 and ±1), within [`TOL_ROUNDING`] times the size of the form's terms.
    pub fn keeps_forms(&self, q: &DVector<f64>) -> bool {
        exact::same_leaf(&self.F, q, &self.s)
            || (0..self.F.nrows()).all(|row_idx| {
                let row = self.F.row(row_idx);
                let mut value = 0.0;
                let mut size = 0.0;
                for (f, (q_j, s_j)) in row.iter().zip(q.iter().zip(self.s.iter())) {
                    value += f * (q_j - s_j);
                    size += f.abs() * (q_j.abs() + s_j.abs());
                }
                value.abs() <= TOL_ROUNDING * size
            })
    }

    /// Free coordinates by `rule` (s_j, u_k), dependent ones from the shifts that these make.
    fn shifted(&self, u: &DVector<f64>, rule: impl Fn(f64, f64) -> f64) -> DVector<f64> {
        let mut q = self.s.clone();
        let mut shift = DVector::zeros(self.free.len());
        for (k, &j) in self.free.iter().enumerate() {
            // A coordinate that does not move keeps its value bit for bit.
            if u[k] != 0.0 {
                q[j] = rule(self.s[j], u[k]);
            }
            shift[k] = q[j] - self.s[j];
        }
        for j in (0..q.len()).filter(|j| !self.free.contains(j)) {
            q[j] = self.s[j] + self.B.row(j).iter().zip(shift.iter()).map(|(b, d)| b * d).sum::<f64>();
        }
        q
    }
}

fn snap(value: f64, step: f64) -> f64 {
    (value / step).round() * step
}

/// Reduced row echelon form and its pivots (row, column); the largest entry of a row is its pivot.
fn gauss_jordan(F: &DMatrix<f64>) -> (DMatrix<f64>, Vec<(usize, usize)>) {
    let mut reduced = F.clone();
    let mut pivots: Vec<(usize, usize)> = Vec::new();
    for row_idx in 0..F.nrows() {
        let mut column = None;
        for j in 0..F.ncols() {
            let size = reduced[(row_idx, j)].abs();
            if size > TOL_PIVOT && column.is_none_or(|best: usize| size > reduced[(row_idx, best)].abs()) {
                column = Some(j);
            }
        }
        let Some(column) = column else { continue };
        let pivot = reduced[(row_idx, column)];
        for j in 0..F.ncols() {
            reduced[(row_idx, j)] /= pivot;
        }
        for other in (0..F.nrows()).filter(|&other| other != row_idx) {
            let factor = reduced[(other, column)];
            if factor != 0.0 {
                for j in 0..F.ncols() {
                    let delta = factor * reduced[(row_idx, j)];
                    reduced[(other, j)] -= delta;
                }
            }
        }
        pivots.push((row_idx, column));
    }
    (reduced, pivots)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The forms of thesis 2, eq. 5.5a and 5.5b, on (cap, gripper, left_finger).
    fn transfer_forms() -> DMatrix<f64> {
        DMatrix::from_row_slice(2, 3, &[-1.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    }

    #[test]
    fn eq_5_5_transfer_leaf_is_a_line() {
        let s = DVector::from_vec(vec![-3.1, -0.78, -0.0245]);
        let frame = LeafFrame::new(&transfer_forms(), &s);
        assert!(frame.eliminated);
        assert_eq!(frame.dimension(), 1);
        let q = frame.place(&DVector::from_vec(vec![0.123456789])).unwrap();
        assert!(exact::same_leaf(&transfer_forms(), &q, &s));
        assert_eq!(q[2], s[2]);
        assert!((q[0] - s[0] - 0.123456789).abs() < 1e-11);
        assert!(
            (frame.distance(&DVector::from_vec(vec![1.0]), &DVector::zeros(1)) - 2.0_f64.sqrt()).abs()
                < 1e-15
        );
    }

    #[test]
    fn forms_that_round_are_kept_as_rows() {
        let F = DMatrix::from_row_slice(1, 2, &[0.3, 0.7]);
        let s = DVector::from_vec(vec![0.1, 0.2]);
        let frame = LeafFrame::new(&F, &s);
        assert!(!frame.eliminated);
        let q = frame.place(&DVector::from_vec(vec![0.7, -0.3 + 1e-6])).unwrap();
        assert!(exact::leaf_distance(&F, &q, &s) < 1e-15);
    }

    #[test]
    fn repeated_forms_count_once() {
        let F = DMatrix::from_row_slice(2, 2, &[1.0, -1.0, -2.0, 2.0]);
        let frame = LeafFrame::new(&F, &DVector::zeros(2));
        assert!(frame.eliminated);
        assert_eq!(frame.dimension(), 1);
    }

    #[test]
    fn without_forms_the_leaf_is_everything() {
        let frame = LeafFrame::new(&DMatrix::zeros(0, 3), &DVector::zeros(3));
        assert_eq!(frame.dimension(), 3);
        assert_eq!(
            frame.place(&DVector::from_vec(vec![0.5, 0.25, 0.0])).unwrap().as_slice(),
            [0.5, 0.25, 0.0]
        );
    }

    proptest::proptest! {
        /// Starts on the grid: placed points keep the forms exactly. Off it: as nearly as numbers allow. All are near.
        #[test]
        fn placed_points_are_on_the_leaf(
            s in proptest::collection::vec(-3.1..3.1_f64, 3),
            u in -0.5..0.5_f64,
        ) {
            let s = DVector::from_vec(s);
            let frame = LeafFrame::new(&transfer_forms(), &s);
            let q = frame.place(&DVector::from_vec(vec![u])).unwrap();
            proptest::prop_assert!(frame.keeps_forms(&q));
            proptest::prop_assert!((frame.u_of(&q)[0] - u).abs() < 300.0 * GRID);
            let snapped = s.map(|x| snap(x, GRID));
            let frame = LeafFrame::new(&transfer_forms(), &snapped);
            let q = frame.place(&DVector::from_vec(vec![u])).unwrap();
            proptest::prop_assert!(exact::same_leaf(&transfer_forms(), &q, &snapped));
        }
    }
}
