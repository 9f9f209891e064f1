//! The control maps of a joint that turns, and what the row g adds: why the least value of [`crate::net`] bounds a gap.
//!
//! For an angle in [m − h, m + h], h < π/2, a rotation is a convex combination, with weights that do not depend on
//! the point, of three affine maps: the rotations by m − h and m + h, and the rotation by m after stretching the
//! directions across the axis by 1/cos h. Maps compose, so n·x is at least the least value over all choices of one
//! map a joint. With the same weights, h sin δ / sin h has the values −h, 0, h, and differs from δ by at most e(h).

use crate::interval::{Interval, Mat3, Vec3};

/// Half-widths of angles beyond this are refused: the middle map grows as 1/cos h.
pub const MAX_HALF_ANGLE: f64 = 1.3;

/// A cell: for each coordinate its centre and a half-width (rounded up) about it.
#[derive(Debug, Clone)]
pub struct Extent {
    /// Centre m of each coordinate.
    pub center: Vec<f64>,
    /// Half-width h of each coordinate.
    pub half: Vec<f64>,
}

impl Extent {
    /// Of the box [lower, upper].
    pub fn new(lower: &[f64], upper: &[f64]) -> Self {
        let center: Vec<f64> = lower.iter().zip(upper).map(|(l, u)| 0.5 * l + 0.5 * u).collect();
        let half = (0..center.len())
            .map(|i| {
                let m = Interval::point(center[i]);
                (Interval::point(upper[i]) - m).hi().max((m - Interval::point(lower[i])).hi())
            })
            .collect();
        Self { center, half }
    }
}

/// Rotation about `axis` with sine `s`, cosine `c`, and directions across the axis stretched by `stretch`:
/// a aᵀ + stretch (c (I − a aᵀ) + s [a]×).
pub(crate) fn rotation(axis: &Vec3, s: Interval, c: Interval, stretch: Interval) -> Mat3 {
    let (sc, ss) = (stretch * c, stretch * s);
    let mut M = [[Interval::ZERO; 3]; 3];
    let skew = [
        [Interval::ZERO, -axis[2], axis[1]],
        [axis[2], Interval::ZERO, -axis[0]],
        [-axis[1], axis[0], Interval::ZERO],
    ];
    for i in 0..3 {
        for j in 0..3 {
            let outer = if i == j { axis[i].square() } else { axis[i] * axis[j] };
            let unit = if i == j { Interval::ONE } else { Interval::ZERO };
            M[i][j] = outer + sc * (unit - outer) + ss * skew[i][j];
        }
    }
    M
}

/// Upper bound of max { h sin d / sin h − d : 0 ≤ d ≤ h }. The function is concave in d, so its tangent at any d₀
/// bounds it.
pub fn sine_excess(h: f64) -> f64 {
    if h <= 0.0 {
        return 0.0;
    }
    let (sin_h, _) = Interval::point(h).sin_cos();
    let ratio = Interval::point(h) * sin_h.recip();
    let d0 = (h.sin() / h).clamp(-1.0, 1.0).acos().min(h);
    let (sin_d, cos_d) = Interval::point(d0).sin_cos();
    let value = ratio * sin_d - Interval::point(d0);
    let slope = ratio * cos_d - Interval::ONE;
    (value + Interval::point(slope.magnitude()) * Interval::point(h)).hi().max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_excess_is_tight_from_above() {
        for h in [1e-6, 0.01, 0.3, 0.7, 1.2] {
            let exact = (0..=100_000)
                .map(|k| h * f64::from(k) / 100_000.0)
                .map(|d: f64| h * d.sin() / f64::sin(h) - d)
                .fold(0.0, f64::max);
            let bound = sine_excess(h);
            assert!(exact - 1e-15 <= bound && bound <= exact + 1e-9, "h {h}: {exact} against {bound}");
        }
    }
}
