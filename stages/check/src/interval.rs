//! Interval arithmetic with outward rounding.
//!
//! An [`Interval`] encloses a real number that is known only to lie in it. Each operation computes in `f64`, whose
//! `+ - * / sqrt` round to nearest (IEEE 754), and widens the result by one step on either side; so the enclosure
//! holds whatever the operands in their intervals are. Sine and cosine are Taylor series with their remainder: no
//! library function has to be believed.

use std::ops::{Add, Mul, Neg, Sub};

/// A closed interval [lo, hi] of reals. An operation that overflows or meets NaN gives the whole line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    lo: f64,
    hi: f64,
}

impl Interval {
    /// Exactly zero.
    pub const ZERO: Self = Self { lo: 0.0, hi: 0.0 };
    /// Exactly one.
    pub const ONE: Self = Self { lo: 1.0, hi: 1.0 };

    /// The number itself.
    pub fn point(x: f64) -> Self {
        Self::hull(x, x)
    }

    /// [lo, hi]; the whole line if that is not an interval of numbers.
    pub fn hull(lo: f64, hi: f64) -> Self {
        if lo <= hi { Self { lo, hi } } else { Self { lo: f64::NEG_INFINITY, hi: f64::INFINITY } }
    }

    /// The result of a rounded operation, widened by one step.
    fn widened(lo: f64, hi: f64) -> Self {
        Self::hull(lo.next_down(), hi.next_up())
    }

    /// Lower end.
    pub fn lo(self) -> f64 {
        self.lo
    }

    /// Upper end.
    pub fn hi(self) -> f64 {
        self.hi
    }

    /// Upper bound of the absolute value.
    pub fn magnitude(self) -> f64 {
        self.lo.abs().max(self.hi.abs())
    }

    /// Enclosure of the absolute value.
    pub fn abs(self) -> Self {
        if self.lo >= 0.0 {
            self
        } else if self.hi <= 0.0 {
            -self
        } else {
            Self::hull(0.0, self.magnitude())
        }
    }

    /// Enclosure of x².
    pub fn square(self) -> Self {
        let a = self.abs();
        Self::widened(a.lo * a.lo, a.hi * a.hi).non_negative()
    }

    /// Enclosure of √x of a number that is known not to be negative.
    pub fn sqrt(self) -> Self {
        Self::widened(self.lo.max(0.0).sqrt(), self.hi.max(0.0).sqrt()).non_negative()
    }

    /// The part that is not negative, for a quantity that can not be.
    fn non_negative(self) -> Self {
        Self::hull(self.lo.max(0.0), self.hi.max(0.0))
    }

    /// Enclosure of 1/x; the whole line if x may be zero.
    pub fn recip(self) -> Self {
        if self.lo > 0.0 || self.hi < 0.0 {
            Self::widened(1.0 / self.hi, 1.0 / self.lo)
        } else {
            Self::hull(1.0, -1.0)
        }
    }

    /// Enclosure of the smaller of two numbers.
    pub fn min(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.min(other.hi) }
    }

    /// Enclosures of sin x and cos x, for |x| ≤ 16; [-1, 1] beyond.
    ///
    /// Both series at x/16, where |x/16| ≤ 1, then four doublings. The remainder of an alternating series with
    /// falling terms is at most its first omitted term.
    pub fn sin_cos(self) -> (Self, Self) {
        const N_DOUBLINGS: usize = 4;
        let unit = Self::hull(-1.0, 1.0);
        if !(self.magnitude() <= 16.0) {
            return (unit, unit);
        }
        // A wide argument would be widened much further by the doublings: sine and cosine have slope at most 1.
        let mid = 0.5 * self.lo + 0.5 * self.hi;
        let radius =
            (Self::point(self.hi) - Self::point(mid)).max_abs_with(Self::point(mid) - Self::point(self.lo));
        let x = Self::point(mid * 0.0625);
        // mid/16 is exact: a power of two, far from underflow unless mid is subnormal.
        if x.lo * 16.0 != mid {
            return (unit, unit);
        }
        let x2 = x.square();
        let (mut sin, mut cos) = (Self::ZERO, Self::ZERO);
        let (mut term_sin, mut term_cos) = (x, Self::ONE);
        const N_TERMS: u32 = 9;
        for k in 0..N_TERMS {
            sin = sin + term_sin;
            cos = cos + term_cos;
            let k = f64::from(k);
            term_cos = -(term_cos * x2 * Self::point((2.0 * k + 1.0) * (2.0 * k + 2.0)).recip());
            term_sin = -(term_sin * x2 * Self::point((2.0 * k + 2.0) * (2.0 * k + 3.0)).recip());
        }
        sin = sin + Self::hull(-term_sin.magnitude(), term_sin.magnitude());
        cos = cos + Self::hull(-term_cos.magnitude(), term_cos.magnitude());
        let two = Self::point(2.0);
        for _ in 0..N_DOUBLINGS {
            (sin, cos) = (two * sin * cos, Self::ONE - two * sin.square());
        }
        let slack = Self::hull(-radius, radius);
        let clip = |v: Self| Self { lo: v.lo.max(-1.0), hi: v.hi.min(1.0) };
        (clip(sin + slack), clip(cos + slack))
    }

    fn max_abs_with(self, other: Self) -> f64 {
        self.magnitude().max(other.magnitude())
    }
}

impl Add for Interval {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::widened(self.lo + other.lo, self.hi + other.hi)
    }
}

impl Sub for Interval {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::widened(self.lo - other.hi, self.hi - other.lo)
    }
}

impl Neg for Interval {
    type Output = Self;
    fn neg(self) -> Self {
        Self { lo: -self.hi, hi: -self.lo }
    }
}

impl Mul for Interval {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        // Exact zeros stay exact: most entries of transforms are zero.
        if (self.lo == 0.0 && self.hi == 0.0) || (other.lo == 0.0 && other.hi == 0.0) {
            let finite = self.magnitude().is_finite() && other.magnitude().is_finite();
            return if finite { Self::ZERO } else { Self::hull(1.0, -1.0) };
        }
        let products = [self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi];
        if products.iter().any(|p| p.is_nan()) {
            return Self::hull(1.0, -1.0);
        }
        let lo = products.iter().copied().fold(f64::INFINITY, f64::min);
        let hi = products.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Self::widened(lo, hi)
    }
}

/// A vector of three intervals.
pub type Vec3 = [Interval; 3];
/// A 3 × 3 matrix of intervals, by rows.
pub type Mat3 = [Vec3; 3];

/// The identity.
pub const IDENTITY: Mat3 = [
    [Interval::ONE, Interval::ZERO, Interval::ZERO],
    [Interval::ZERO, Interval::ONE, Interval::ZERO],
    [Interval::ZERO, Interval::ZERO, Interval::ONE],
];

/// Inner product.
pub fn dot(a: &Vec3, b: &Vec3) -> Interval {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Enclosure of the Euclidean length.
pub fn norm(a: &Vec3) -> Interval {
    (a[0].square() + a[1].square() + a[2].square()).sqrt()
}

/// Row vector times matrix.
pub fn row_times(r: &Vec3, M: &Mat3) -> Vec3 {
    std::array::from_fn(|j| r[0] * M[0][j] + r[1] * M[1][j] + r[2] * M[2][j])
}

/// Matrix times vector.
pub fn times_vec(M: &Mat3, v: &Vec3) -> Vec3 {
    std::array::from_fn(|i| dot(&M[i], v))
}

/// Matrix product.
pub fn times(A: &Mat3, B: &Mat3) -> Mat3 {
    std::array::from_fn(|i| row_times(&A[i], B))
}

/// Transpose.
pub fn transpose(M: &Mat3) -> Mat3 {
    std::array::from_fn(|i| std::array::from_fn(|j| M[j][i]))
}

/// Points as degenerate intervals.
pub fn point3(x: f64, y: f64, z: f64) -> Vec3 {
    [Interval::point(x), Interval::point(y), Interval::point(z)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn encloses(x: Interval, value: f64) -> bool {
        x.lo() <= value && value <= x.hi()
    }

    #[test]
    fn one_tenth_thrice_encloses_three_tenths() {
        let x = Interval::point(0.1);
        let sum = x + x + x;
        assert!(encloses(sum, 0.3) && sum.hi() - sum.lo() < 1e-15);
    }

    #[test]
    fn not_a_number_is_the_whole_line() {
        assert_eq!(Interval::point(f64::NAN).hi(), f64::INFINITY);
        assert_eq!((Interval::point(f64::INFINITY) * Interval::ZERO).lo(), f64::NEG_INFINITY);
        assert_eq!(Interval::hull(-1.0, 1.0).recip().hi(), f64::INFINITY);
    }

    proptest! {
        #[test]
        fn sine_and_cosine_enclose_and_are_thin(x in -7.0f64..7.0) {
            let (s, c) = Interval::point(x).sin_cos();
            prop_assert!(encloses(s, x.sin()) && encloses(c, x.cos()));
            prop_assert!(s.hi() - s.lo() < 1e-13 && c.hi() - c.lo() < 1e-13);
        }

        #[test]
        fn wide_sine_encloses_inner_values(x in -3.0f64..3.0, w in 0.0f64..0.3, t in 0.0f64..1.0) {
            let (s, c) = Interval::hull(x, x + w).sin_cos();
            let y = x + w * t;
            prop_assert!(encloses(s, y.sin()) && encloses(c, y.cos()));
        }

        #[test]
        fn products_enclose(a in -2.0f64..2.0, b in -2.0f64..2.0, wa in 0.0f64..1.0, wb in 0.0f64..1.0,
                            s in 0.0f64..1.0, t in 0.0f64..1.0) {
            let product = Interval::hull(a, a + wa) * Interval::hull(b, b + wb);
            prop_assert!(encloses(product, (a + wa * s) * (b + wb * t)));
            prop_assert!(encloses(Interval::hull(a, a + wa).square(), (a + wa * s).powi(2)));
        }
    }
}
