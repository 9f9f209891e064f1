//! Whether kept forms hold exactly: sums of products without any rounding.
//!
//! A sum is kept as an expansion, numbers whose exact sum it is; error-free transformations add to it.
//! Source: Shewchuk 1997 (grow-expansion), Ogita et al. 2005 (product with a fused multiply-add).

use nalgebra::{DMatrix, DVector};

/// Whether `F q = F s` in exact arithmetic. `F` [k × n]. Numbers so large or small that a product over- or underflows
/// count as different.
pub fn same_leaf(F: &DMatrix<f64>, q: &DVector<f64>, s: &DVector<f64>) -> bool {
    (0..F.nrows()).all(|row_idx| {
        let mut sum = Expansion::default();
        for (&f, (&q_j, &s_j)) in F.row(row_idx).iter().zip(q.iter().zip(s)) {
            // Equal coordinates cancel whatever the coefficient is.
            if f != 0.0 && q_j != s_j {
                sum.add_product(f, q_j);
                sum.add_product(f, -s_j);
            }
        }
        sum.is_zero()
    })
}

/// Whether `F B = 0` in exact arithmetic. `F` [k × n], `B` [n × d].
pub fn annihilates(F: &DMatrix<f64>, B: &DMatrix<f64>) -> bool {
    (0..B.ncols()).all(|column| same_leaf(F, &B.column(column).into_owned(), &DVector::zeros(B.nrows())))
}

/// Largest difference between `F q` and `F s`, in ordinary arithmetic.
pub fn leaf_distance(F: &DMatrix<f64>, q: &DVector<f64>, s: &DVector<f64>) -> f64 {
    if F.nrows() == 0 { 0.0 } else { (F * (q - s)).amax() }
}

/// Numbers whose exact sum is the value.
#[derive(Debug, Default)]
struct Expansion {
    components: Vec<f64>,
    broken: bool,
}

impl Expansion {
    fn add_product(&mut self, a: f64, b: f64) {
        let product = a * b;
        // Below this the error of the product may itself underflow.
        const SMALLEST: f64 = 1e-280;
        self.broken |= !product.is_finite() || (product.abs() < SMALLEST && a != 0.0 && b != 0.0);
        self.add(a.mul_add(b, -product));
        self.add(product);
    }

    fn add(&mut self, value: f64) {
        let mut sum = value;
        self.components.retain_mut(|component| {
            let (high, low) = two_sum(sum, *component);
            sum = high;
            *component = low;
            low != 0.0
        });
        if sum != 0.0 {
            self.components.push(sum);
        }
    }

    /// The components of an expansion do not overlap, so it is zero only if all of them are.
    fn is_zero(&self) -> bool {
        !self.broken && self.components.is_empty()
    }
}

/// a + b as its rounded value and the error, exactly (Knuth).
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let high = a + b;
    let b_part = high - a;
    (high, (a - (high - b_part)) + (b - b_part))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn difference() -> DMatrix<f64> {
        DMatrix::from_row_slice(1, 2, &[1.0, -1.0])
    }

    #[test]
    fn differences_are_judged_without_rounding() {
        let s = DVector::from_vec(vec![-3.1, 0.5]);
        let exact = DVector::from_vec(vec![-3.1 + 0.25, 0.75]);
        assert!(same_leaf(&difference(), &exact, &s));
        // 0.1 + 0.2 rounds: the difference of the two coordinates changes by one unit in the last place.
        let s = DVector::from_vec(vec![0.1, 0.0]);
        let rounded = DVector::from_vec(vec![0.1 + 0.2, 0.2]);
        assert!(!same_leaf(&difference(), &rounded, &s));
        assert!(leaf_distance(&difference(), &rounded, &s) < 1e-15);
    }

    #[test]
    fn one_unit_in_the_last_place_counts() {
        let s = DVector::from_vec(vec![1.0, 1.0]);
        let q = DVector::from_vec(vec![1.0_f64.next_up(), 1.0]);
        assert!(!same_leaf(&difference(), &q, &s));
        assert!(!same_leaf(&difference(), &DVector::from_vec(vec![f64::NAN, 1.0]), &s));
        assert!(same_leaf(&DMatrix::zeros(0, 2), &q, &s));
    }

    proptest::proptest! {
        /// Integers have exact sums: the verdict is that of i128.
        #[test]
        fn verdict_is_that_of_integers(
            f in proptest::collection::vec(-9_i64..9, 4),
            q in proptest::collection::vec(-(1_i64 << 50)..(1_i64 << 50), 4),
            shift in -2_i64..3,
        ) {
            let float = |v: &[i64]| DVector::from_iterator(4, v.iter().map(|&x| x as f64));
            let F = DMatrix::from_row_slice(1, 4, float(&f).as_slice());
            let s: Vec<i64> = (0..4).map(|k| q[(k + 1) % 4] + shift).collect();
            let form = |v: &[i64]| f.iter().zip(v).map(|(&a, &b)| i128::from(a) * i128::from(b)).sum::<i128>();
            proptest::prop_assert_eq!(same_leaf(&F, &float(&q), &float(&s)), form(&q) == form(&s));
        }
    }
}
