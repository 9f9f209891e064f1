//! κ: the least gap of two swept bodies along a normal, over a cell.
//!
//! For an angle in [m − h, m + h], h < π/2, a rotation is a convex combination, with weights that do not depend on
//! the point, of three affine maps: the rotations by m − h and m + h, and the rotation by m after stretching the
//! directions across the axis by 1/cos h. Maps compose, so n·x is at least the least value over all choices of one
//! map a joint. With the same weights, h sin δ / sin h has the values −h, 0, h, and differs from δ by at most e(h).

use crate::body;
use crate::chain::{Side, Step};
use crate::interval::{self, Interval, Mat3, Vec3};
use scene::Shape;

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

/// The control maps of the motions of one side over one cell.
enum Maps {
    Fixed(Mat3, Vec3),
    Turn { maps: Box<[Mat3; 3]>, g_h: Interval },
    Slide { axis: Vec3, ends: [Interval; 2], g_h: Interval },
}

fn control_maps(side: &Side, extent: &Extent, g: &[f64]) -> Option<Vec<Maps>> {
    side.steps
        .iter()
        .map(|step| match step {
            Step::Fixed { R, p } => Some(Maps::Fixed(*R, *p)),
            Step::Turn { axis, sign, coordinate } => {
                let (m, h) = (*extent.center.get(*coordinate)?, *extent.half.get(*coordinate)?);
                if !(h <= MAX_HALF_ANGLE) {
                    return None;
                }
                let (m, h, sign) = (Interval::point(m), Interval::point(h), Interval::point(*sign));
                let (_, cos_h) = h.sin_cos();
                let at = |angle: Interval, stretch: Interval| {
                    let (s, c) = (sign * angle).sin_cos();
                    rotation(axis, s, c, stretch)
                };
                let maps =
                    Box::new([at(m - h, Interval::ONE), at(m, cos_h.recip()), at(m + h, Interval::ONE)]);
                Some(Maps::Turn { maps, g_h: Interval::point(*g.get(*coordinate)?) * h })
            }
            Step::Slide { axis, sign, coordinate } => {
                let (m, h) = (*extent.center.get(*coordinate)?, *extent.half.get(*coordinate)?);
                let (m, h, sign) = (Interval::point(m), Interval::point(h), Interval::point(*sign));
                let g_h = Interval::point(*g.get(*coordinate)?) * h;
                Some(Maps::Slide { axis: *axis, ends: [sign * (m - h), sign * (m + h)], g_h })
            }
        })
        .collect()
}

/// Lower bound of `r·x − Σ g_j δ_j` over all choices of control maps and all points x of the core.
fn least(maps: &[Maps], r: &Vec3, d: Interval, shape: &Shape) -> f64 {
    let Some((first, rest)) = maps.split_first() else {
        return (d - body::core_support(shape, r)).lo();
    };
    match first {
        Maps::Fixed(R, p) => least(rest, &interval::row_times(r, R), d + interval::dot(r, p), shape),
        Maps::Turn { maps, g_h } => {
            let terms = [d + *g_h, d, d - *g_h];
            (0..3)
                .map(|i| least(rest, &interval::row_times(r, &maps[i]), terms[i], shape))
                .fold(f64::INFINITY, f64::min)
        }
        Maps::Slide { axis, ends, g_h } => {
            let along = interval::dot(r, axis);
            let terms = [d + *g_h + along * ends[0], d - *g_h + along * ends[1]];
            terms.iter().map(|term| least(rest, r, *term, shape)).fold(f64::INFINITY, f64::min)
        }
    }
}

/// Lower bound κ with `n·(x_A(q) − x_B(q)) − g·δ ≥ κ` for all q in the cell, all points of the two bodies;
/// minus infinity if an angle of the cell is too wide.
pub fn kappa(sides: [(&Side, &Shape); 2], extent: &Extent, n: &Vec3, g: &[f64]) -> f64 {
    let signs = [*n, n.map(|x| -x)];
    let mut sum = Interval::ZERO;
    for ((side, shape), r) in sides.iter().zip(&signs) {
        let Some(maps) = control_maps(side, extent, g) else { return f64::NEG_INFINITY };
        sum = sum + Interval::point(least(&maps, r, Interval::ZERO, shape));
        let radius = Interval::point(body::rounding_radius(shape)) + Interval::point(side.inflation);
        sum = sum - interval::norm(n) * radius;
        for step in &side.steps {
            if let Step::Turn { coordinate, .. } = step
                && g[*coordinate] != 0.0
            {
                let excess = Interval::point(sine_excess(extent.half[*coordinate]));
                sum = sum - Interval::point(g[*coordinate].abs()) * excess;
            }
        }
    }
    let kappa = sum.lo();
    if kappa.is_nan() { f64::NEG_INFINITY } else { kappa }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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

    proptest! {
        /// A point turning about z stays above the bound with and without a row.
        #[test]
        fn turning_point_stays_above_kappa(m in -2.0f64..2.0, h in 0.001f64..1.2, g in -0.5f64..0.5,
                                           x in -1.0f64..1.0, y in -1.0f64..1.0, t in -1.0f64..1.0,
                                           nx in -1.0f64..1.0, ny in -1.0f64..1.0) {
            let side = Side {
                steps: vec![
                    Step::Turn { axis: interval::point3(0.0, 0.0, 1.0), sign: 1.0, coordinate: 0 },
                    Step::Fixed { R: rotation(&interval::point3(0.0, 0.0, 1.0), Interval::ZERO, Interval::ONE, Interval::ONE),
                                  p: interval::point3(x, y, 0.0) },
                ],
                inflation: 0.0,
            };
            let still = Side { steps: vec![], inflation: 0.0 };
            let point = Shape::Sphere { radius: 0.0 };
            let extent = Extent { center: vec![m], half: vec![h] };
            let n = interval::point3(nx, ny, 0.0);
            let bound = kappa([(&side, &point), (&still, &point)], &extent, &n, &[g]);
            let q: f64 = m + h * t;
            let value = nx * (q.cos() * x - q.sin() * y) + ny * (q.sin() * x + q.cos() * y) - g * h * t;
            prop_assert!(value >= bound - 1e-12, "{value} < {bound}");
        }
    }
}
