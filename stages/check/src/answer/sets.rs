//! Boxes with rows, and what multipliers prove of them (inequality (1) of `proof.bin`).

use super::AnswerError;
use crate::exact::rational;
use crate::interval::Interval;
use ipc_types::artefact::Region;
use num_rational::BigRational;
use num_traits::Zero;
use scene::Space;

/// {x : lower ≤ x ≤ upper, a·x ≤ b for the rows (a, b)}.
#[derive(Debug, Clone)]
pub struct BoxedSet {
    lower: Vec<f64>,
    upper: Vec<f64>,
    rows: Vec<(Vec<f64>, f64)>,
}

impl BoxedSet {
    /// The intersection of spaces and regions.
    pub fn new(spaces: &[&Space], regions: &[&Region]) -> Self {
        let n = spaces.first().map_or(0, |space| space.lower.len());
        let mut set =
            Self { lower: vec![f64::NEG_INFINITY; n], upper: vec![f64::INFINITY; n], rows: Vec::new() };
        for space in spaces {
            for k in 0..n {
                set.lower[k] = set.lower[k].max(space.lower[k]);
                set.upper[k] = set.upper[k].min(space.upper[k]);
            }
            for row in &space.rows {
                let negated = row.form.iter().map(|f| -f).collect();
                let sides = [(row.form.iter().copied().collect(), row.upper), (negated, -row.lower)];
                set.rows.extend(sides.into_iter().filter(|(_, b)| b.is_finite()));
            }
        }
        for region in regions {
            set.rows.extend(region.A.iter().cloned().zip(region.b.iter().copied()));
        }
        set
    }

    /// Whether the multipliers prove that the set is empty.
    pub fn is_empty(&self, multipliers: &[(u32, f64)]) -> Result<bool, AnswerError> {
        let is_crossed = self.lower.iter().zip(&self.upper).any(|(l, u)| l > u);
        let zero = vec![Interval::ZERO; self.lower.len()];
        Ok(is_crossed || self.minimum(&zero, multipliers)? > 0.0)
    }

    /// A number that is at most g·x for every x of the set.
    pub fn minimum(&self, g: &[Interval], multipliers: &[(u32, f64)]) -> Result<f64, AnswerError> {
        let mut slope = g.to_vec();
        let mut sum = Interval::ZERO;
        for &(row, y) in multipliers {
            let (a, b) = self.row(row, y)?;
            let y = Interval::point(y);
            for (slope, &a) in slope.iter_mut().zip(a) {
                *slope = *slope + y * Interval::point(a);
            }
            sum = sum - y * Interval::point(b);
        }
        for (k, slope) in slope.into_iter().enumerate() {
            sum = sum + slope * Interval::hull(self.lower[k], self.upper[k]);
        }
        Ok(sum.lo())
    }

    /// Whether the multipliers prove f·x ≤ b on the set, in exact arithmetic.
    pub fn implies(&self, f: &[f64], b: f64, multipliers: &[(u32, f64)]) -> Result<bool, AnswerError> {
        let finite = |x: f64| rational(x).ok_or(AnswerError::NotFinite("a set"));
        let mut slope = f.iter().map(|&f| finite(f)).collect::<Result<Vec<_>, _>>()?;
        let mut sum = BigRational::zero();
        for &(row, y) in multipliers {
            let (a, b) = self.row(row, y)?;
            let y = finite(y)?;
            for (slope, &a) in slope.iter_mut().zip(a) {
                *slope -= &y * finite(a)?;
            }
            sum += y * finite(b)?;
        }
        for (k, slope) in slope.into_iter().enumerate() {
            let end = if slope > BigRational::zero() { self.upper[k] } else { self.lower[k] };
            sum += slope * finite(end)?;
        }
        Ok(sum <= finite(b)?)
    }

    /// The row of a multiplier that is one.
    fn row(&self, row: u32, y: f64) -> Result<(&[f64], f64), AnswerError> {
        if !(y >= 0.0 && y.is_finite()) {
            return Err(AnswerError::Multiplier { row, value: y });
        }
        let found = self.rows.get(row as usize);
        let (a, b) =
            found.ok_or(AnswerError::NoSuch { what: "row", position: row, count: self.rows.len() })?;
        Ok((a, *b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;
    use proptest::prelude::*;
    use scene::BoundedRow;

    /// x + y ≤ 1 in the unit square, by a row of the space; and a region's face x ≤ 0.5.
    fn set() -> BoxedSet {
        let form = DVector::from_vec(vec![1.0, 1.0]);
        let space = Space {
            lower: DVector::zeros(2),
            upper: DVector::repeat(2, 1.0),
            rows: vec![BoundedRow { form, lower: f64::NEG_INFINITY, upper: 1.0 }],
        };
        let region = Region {
            id: 0,
            parent: None,
            A: vec![vec![1.0, 0.0]],
            b: vec![0.5],
            center: vec![0.1, 0.1],
            method: String::new(),
            certified: true,
            margin: 0.0,
        };
        BoxedSet::new(&[&space], &[&region])
    }

    #[test]
    fn containment_is_exact_on_a_face_that_both_share() {
        assert_eq!(set().implies(&[1.0, 0.0], 0.5, &[(1, 1.0)]), Ok(true));
        assert_eq!(set().implies(&[1.0, 0.0], 0.5f64.next_down(), &[(1, 1.0)]), Ok(false));
        assert_eq!(set().implies(&[0.0, 1.0], 1.0, &[]), Ok(true));
    }

    #[test]
    fn multipliers_that_are_none_are_named() {
        for y in [-1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(set().is_empty(&[(0, y)]), Err(AnswerError::Multiplier { row: 0, .. })));
        }
        assert!(matches!(
            set().is_empty(&[(2, 1.0)]),
            Err(AnswerError::NoSuch { position: 2, count: 2, .. })
        ));
    }

    proptest! {
        /// Whatever the multipliers: never above the value at a point of the set.
        #[test]
        fn a_minimum_is_below_every_point(
            g in (-2.0f64..2.0, -2.0f64..2.0),
            y in (0.0f64..3.0, 0.0f64..3.0),
            at in (0.0f64..0.5, 0.0f64..1.0),
        ) {
            let x = (at.0, at.1 * (1.0 - at.0));
            let g_points = [Interval::point(g.0), Interval::point(g.1)];
            let bound = set().minimum(&g_points, &[(0, y.0), (1, y.1)]).unwrap();
            prop_assert!(bound <= g.0 * x.0 + g.1 * x.1 + 1e-12);
            prop_assert_eq!(set().is_empty(&[(0, y.0), (1, y.1)]), Ok(false));
        }
    }
}
