//! Whether a polytope given by bounds and rows is provably empty.
//!
//! P = {x : l ≤ x ≤ u, g_i · x ≤ h_i}. A Farkas vector `y ≥ 0` with `min_{l ≤ x ≤ u} (Σ y_i g_i) · x > Σ y_i h_i`
//! proves P empty. A small simplex finds a candidate in floating point; the proof is the inequality itself,
//! evaluated with outward rounding. So an empty P may pass, but what is refused is empty.

use crate::numbers::Enclosure;
use crate::task::Space;

/// Pivot elements and reduced costs below this count as zero. Erring side: no candidate is found.
const TOL_PIVOT: f64 = 1e-11;

/// Multipliers of this size, after scaling to a largest of one, are dropped: rounding noise of the simplex.
const TOL_MULTIPLIER: f64 = 1e-9;

/// Pivots after which the search for a candidate ends. Erring side: an empty space passes.
const MAX_PIVOTS: usize = 2000;

/// The rows that contradict each other within the bounds, by their position in `Space::rows`; `None` if the
/// space is not proven empty. Bounds are taken as ordered.
pub fn prove_empty(space: &Space) -> Option<Vec<usize>> {
    let half_rows = half_rows(space);
    if let Some(alone) = half_rows.iter().find(|half_row| proves_empty(space, &[(half_row, 1.0)])) {
        return Some(vec![alone.row_idx]);
    }
    let multipliers = farkas_candidate(space, &half_rows)?;
    let weighted: Vec<(&HalfRow, f64)> =
        half_rows.iter().zip(multipliers).filter(|&(_, multiplier)| multiplier > 0.0).collect();
    if !proves_empty(space, &weighted) {
        return None;
    }
    let mut rows: Vec<usize> = weighted.iter().map(|(half_row, _)| half_row.row_idx).collect();
    rows.dedup();
    Some(rows)
}

/// `g · x ≤ h`, one side of a row.
struct HalfRow {
    row_idx: usize,
    g: Vec<f64>,
    h: f64,
}

fn half_rows(space: &Space) -> Vec<HalfRow> {
    let mut half_rows = Vec::new();
    for (row_idx, row) in space.rows.iter().enumerate() {
        if row.upper.is_finite() {
            half_rows.push(HalfRow { row_idx, g: row.form.iter().copied().collect(), h: row.upper });
        }
        if row.lower.is_finite() {
            half_rows.push(HalfRow { row_idx, g: row.form.iter().map(|c| -c).collect(), h: -row.lower });
        }
    }
    half_rows
}

/// The Farkas inequality for rows with their multipliers y_i > 0, with outward rounding.
fn proves_empty(space: &Space, weighted: &[(&HalfRow, f64)]) -> bool {
    let y = || weighted.iter().map(|&(_, y)| Enclosure::exact(y));
    let form = (0..space.lower.len())
        .map(|k| Enclosure::dot(y(), weighted.iter().map(|(half_row, _)| Enclosure::exact(half_row.g[k]))));
    let box_sides =
        space.lower.iter().zip(space.upper.iter()).map(|(&lower, &upper)| Enclosure { lower, upper });
    let left = Enclosure::dot(form, box_sides);
    let right = Enclosure::dot(y(), weighted.iter().map(|(half_row, _)| Enclosure::exact(half_row.h)));
    left.lower > right.upper
}

/// Multipliers from phase 1 of the simplex method: min x_0 s.t. G z - x_0 ≤ h, z ≤ 1, z, x_0 ≥ 0, where
/// x = l + (u - l) z and the rows are scaled to a largest coefficient of one. `None` if x_0 reaches 0.
fn farkas_candidate(space: &Space, half_rows: &[HalfRow]) -> Option<Vec<f64>> {
    let n = space.lower.len();
    let width = &space.upper - &space.lower;
    let mut scales = Vec::with_capacity(half_rows.len());
    let mut dictionary = Vec::with_capacity(half_rows.len() + n);
    let mut b = Vec::with_capacity(half_rows.len() + n);
    for half_row in half_rows {
        let mut row: Vec<f64> = (0..n).map(|k| half_row.g[k] * width[k]).collect();
        let largest = row.iter().fold(0.0_f64, |largest, c| largest.max(c.abs()));
        let scale = if largest > 0.0 { 1.0 / largest } else { 0.0 };
        let offset: f64 = (0..n).map(|k| half_row.g[k] * space.lower[k]).sum();
        row.iter_mut().for_each(|c| *c *= scale);
        row.push(-1.0);
        dictionary.push(row);
        b.push((half_row.h - offset) * scale);
        scales.push(scale);
    }
    for k in 0..n {
        let mut row = vec![0.0; n + 1];
        row[k] = 1.0;
        dictionary.push(row);
        b.push(1.0);
    }
    // Variables: z_k is k, x_0 is n, the slack of row i is n + 1 + i.
    let mut simplex = Dictionary {
        basic: (0..b.len()).map(|i| n + 1 + i).collect(),
        nonbasic: (0..=n).collect(),
        a: dictionary,
        b,
        cost: (0..=n).map(|j| if j == n { -1.0 } else { 0.0 }).collect(),
    };
    let entering_row = (0..simplex.b.len()).min_by(|&i, &k| simplex.b[i].total_cmp(&simplex.b[k]))?;
    if simplex.b[entering_row] >= 0.0 {
        return None;
    }
    simplex.pivot(entering_row, n);
    for _ in 0..MAX_PIVOTS {
        if !simplex.step() {
            break;
        }
    }
    let mut multipliers = vec![0.0_f64; half_rows.len()];
    for (j, &variable) in simplex.nonbasic.iter().enumerate() {
        if let Some(row_idx) = variable.checked_sub(n + 1).filter(|&row_idx| row_idx < half_rows.len()) {
            multipliers[row_idx] = -simplex.cost[j] * scales[row_idx];
        }
    }
    let largest = multipliers.iter().fold(0.0_f64, |largest, &y| largest.max(y));
    if !(largest > 0.0 && largest.is_finite()) {
        return None;
    }
    let cleaned = multipliers.iter().map(|&y| if y > TOL_MULTIPLIER * largest { y / largest } else { 0.0 });
    Some(cleaned.collect())
}

/// Simplex dictionary: basic_i = b_i - Σ_j a_ij nonbasic_j; maximise z_0 + Σ_j cost_j nonbasic_j.
struct Dictionary {
    basic: Vec<usize>,
    nonbasic: Vec<usize>,
    a: Vec<Vec<f64>>,
    b: Vec<f64>,
    cost: Vec<f64>,
}

impl Dictionary {
    /// One pivot by Bland's rule, which cannot cycle; false at an optimum.
    fn step(&mut self) -> bool {
        let Some(column) =
            (0..self.nonbasic.len()).filter(|&j| self.cost[j] > TOL_PIVOT).min_by_key(|&j| self.nonbasic[j])
        else {
            return false;
        };
        let row = (0..self.basic.len()).filter(|&i| self.a[i][column] > TOL_PIVOT).min_by(|&i, &k| {
            let (ratio_i, ratio_k) = (self.b[i] / self.a[i][column], self.b[k] / self.a[k][column]);
            ratio_i.total_cmp(&ratio_k).then(self.basic[i].cmp(&self.basic[k]))
        });
        row.map(|row| self.pivot(row, column)).is_some()
    }

    /// Exchanges basic variable `row` with nonbasic variable `column`.
    fn pivot(&mut self, row: usize, column: usize) {
        let pivot = self.a[row][column];
        self.a[row].iter_mut().for_each(|c| *c /= pivot);
        self.a[row][column] = 1.0 / pivot;
        self.b[row] /= pivot;
        let (pivot_row, pivot_b) = (self.a[row].clone(), self.b[row]);
        for i in (0..self.a.len()).filter(|&i| i != row) {
            let factor = self.a[i][column];
            if factor != 0.0 {
                self.a[i][column] = 0.0;
                self.a[i].iter_mut().zip(&pivot_row).for_each(|(c, p)| *c -= factor * p);
                self.b[i] -= factor * pivot_b;
            }
        }
        let factor = self.cost[column];
        self.cost[column] = 0.0;
        self.cost.iter_mut().zip(&pivot_row).for_each(|(c, p)| *c -= factor * p);
        std::mem::swap(&mut self.basic[row], &mut self.nonbasic[column]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::BoundedRow;
    use nalgebra::DVector;

    fn unit_box_with(rows: &[(&[f64], f64, f64)]) -> Space {
        let n = rows.first().map_or(1, |(form, _, _)| form.len());
        let row = |&(form, lower, upper): &(&[f64], f64, f64)| BoundedRow {
            form: DVector::from_column_slice(form),
            lower,
            upper,
        };
        Space {
            lower: DVector::zeros(n),
            upper: DVector::repeat(n, 1.0),
            rows: rows.iter().map(row).collect(),
        }
    }

    const INF: f64 = f64::INFINITY;

    #[test]
    fn one_row_on_both_sides_of_the_corner() {
        assert_eq!(prove_empty(&unit_box_with(&[(&[1.0, 1.0], 2.0, INF)])), None);
        assert_eq!(prove_empty(&unit_box_with(&[(&[1.0, 1.0], 2.0 + 1e-12, INF)])), Some(vec![0]));
        assert_eq!(prove_empty(&unit_box_with(&[(&[1.0, -1.0], -INF, -1.0)])), None);
        assert_eq!(prove_empty(&unit_box_with(&[(&[1.0, -1.0], -INF, -1.0 - 1e-12)])), Some(vec![0]));
    }

    #[test]
    fn rows_that_only_together_leave_nothing() {
        // x + y ≤ 0.8 and x - y ≥ 0.2 and y ≥ 0.3 meet in one point (0.5, 0.3).
        let rows = |y: f64| {
            unit_box_with(&[(&[1.0, 1.0], -INF, 0.8), (&[1.0, -1.0], 0.2, INF), (&[0.0, 1.0], y, INF)])
        };
        assert_eq!(prove_empty(&rows(0.299)), None);
        assert_eq!(prove_empty(&rows(0.301)), Some(vec![0, 1, 2]));
    }

    #[test]
    fn nothing_is_empty_without_rows() {
        assert_eq!(prove_empty(&unit_box_with(&[])), None);
    }

    proptest::proptest! {
        /// A space that has a point is never refused, whatever rows are put around that point.
        #[test]
        fn a_space_with_a_point_is_not_empty(
            point in proptest::collection::vec(0.0..1.0_f64, 3),
            forms in proptest::collection::vec(proptest::collection::vec(-2.0..2.0_f64, 3), 1..8),
            slack in 0.0..1e-3_f64,
        ) {
            let values: Vec<f64> = forms
                .iter()
                .map(|form| form.iter().zip(&point).map(|(c, x)| c * x).sum())
                .collect();
            let rows: Vec<_> = forms
                .iter()
                .zip(&values)
                .map(|(form, &value)| (form.as_slice(), value - slack - 1e-12, value + slack + 1e-12))
                .collect();
            proptest::prop_assert_eq!(prove_empty(&unit_box_with(&rows)), None);
        }

        /// Forms f and -f with bounds that exclude each other are always found, among other rows.
        #[test]
        fn a_contradiction_is_found(
            form in proptest::collection::vec(0.1..2.0_f64, 3),
            share in 0.1..0.9_f64,
            gap in 1e-6..1e-2_f64,
            other in proptest::collection::vec(-2.0..2.0_f64, 3),
        ) {
            let bound = share * form.iter().sum::<f64>();
            let opposite: Vec<f64> = form.iter().map(|c| -2.0 * c).collect();
            let space = unit_box_with(&[
                (&other, -10.0, INF),
                (&form, -INF, bound - gap),
                (&opposite, -INF, -2.0 * (bound + gap)),
            ]);
            proptest::prop_assert_eq!(prove_empty(&space), Some(vec![1, 2]));
        }
    }
}
