//! Sums and products with outward rounding.
//!
//! A result of round-to-nearest differs from the exact one by less than the step to the neighboring number, so one
//! step outward after each operation encloses the exact value.

/// An interval that contains the exact value of what was computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Enclosure {
    /// At most the exact value.
    pub lower: f64,
    /// At least the exact value.
    pub upper: f64,
}

impl Enclosure {
    /// The number itself.
    pub fn exact(value: f64) -> Self {
        Self { lower: value, upper: value }
    }

    /// The zero.
    pub fn zero() -> Self {
        Self::exact(0.0)
    }

    /// `self + other`.
    pub fn plus(self, other: Self) -> Self {
        // Adding an exact zero is exact.
        if other.lower == 0.0 && other.upper == 0.0 {
            return self;
        }
        if self.lower == 0.0 && self.upper == 0.0 {
            return other;
        }
        Self { lower: (self.lower + other.lower).next_down(), upper: (self.upper + other.upper).next_up() }
    }

    /// `-self`.
    pub fn negated(self) -> Self {
        Self { lower: -self.upper, upper: -self.lower }
    }

    /// `self - other`.
    pub fn minus(self, other: Self) -> Self {
        self.plus(other.negated())
    }

    /// `self * other`. A zero factor and a factor of ±1 are exact.
    pub fn times(self, other: Self) -> Self {
        for (factor, rest) in [(self, other), (other, self)] {
            if factor.lower == factor.upper {
                if factor.lower == 0.0 {
                    return Self::zero();
                } else if factor.lower == 1.0 {
                    return rest;
                } else if factor.lower == -1.0 {
                    return rest.negated();
                }
            }
        }
        let ends = [
            self.lower * other.lower,
            self.lower * other.upper,
            self.upper * other.lower,
            self.upper * other.upper,
        ];
        Self {
            lower: ends.iter().copied().fold(f64::INFINITY, f64::min).next_down(),
            upper: ends.iter().copied().fold(f64::NEG_INFINITY, f64::max).next_up(),
        }
    }

    /// `Σ a_k x_k`.
    pub fn dot<'a>(a: impl Iterator<Item = &'a f64>, x: impl Iterator<Item = Self>) -> Self {
        a.zip(x).fold(Self::zero(), |sum, (&a, x)| sum.plus(Self::exact(a).times(x)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_enclose_the_exact_value() {
        // 0.1 + 0.2 as decimals of their doubles lies between the neighbors of the rounded sum.
        let sum = Enclosure::exact(0.1).plus(Enclosure::exact(0.2));
        assert!(sum.lower <= 0.3 && 0.30000000000000004 < sum.upper);
    }

    #[test]
    fn trivial_operations_are_exact() {
        let x = Enclosure::exact(-2.5);
        assert_eq!(x.times(Enclosure::exact(-1.0)), Enclosure::exact(2.5));
        assert_eq!(x.plus(Enclosure::zero()), x);
        assert_eq!(Enclosure::zero().times(x), Enclosure::zero());
    }

    proptest::proptest! {
        /// Integers are exact in doubles up to 2^53, so the true dot product is known.
        #[test]
        fn dot_encloses_scaled_integers(pairs in proptest::collection::vec((-1000i64..1000, -1000i64..1000), 1..8)) {
            let scale = 0.1_f64;
            let exact: i64 = pairs.iter().map(|(a, x)| a * x).sum();
            let a: Vec<f64> = pairs.iter().map(|p| p.0 as f64).collect();
            let enclosure = Enclosure::dot(a.iter(), pairs.iter().map(|p| Enclosure::exact(p.1 as f64)))
                .times(Enclosure::exact(scale));
            let true_value = Enclosure::exact(exact as f64).times(Enclosure::exact(scale));
            proptest::prop_assert!(enclosure.lower <= true_value.upper && true_value.lower <= enclosure.upper);
            proptest::prop_assert!(enclosure.lower <= exact as f64 * scale && exact as f64 * scale <= enclosure.upper);
        }
    }
}
