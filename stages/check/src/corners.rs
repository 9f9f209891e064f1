//! A cell proven by the series of the corners of the body that moves.
//!
//! One body rests in the frame. r is the normal, signed so that the gap of a corner x of the other body along it is
//! f(q) = r·x(q) + const. With joints counted from the frame outwards and axes z_i through o_i at the cell's centre m,
//!
//! ```text
//! ∂_i f = r·b_i,  b_i = z_i × (x − o_i) for an angle, z_i for a slide
//! ∂_i ∂_j f = (r × z_i)·b_j,  ∂_i ∂_j ∂_k f = ((r × z_i) × z_j)·b_k      i ≤ j ≤ k; 0 unless i (and j) is an angle
//! |∂_i ∂_j ∂_k ∂_l f| ≤ s_i ρ_l,  s_i ≥ |r × z_i|, ρ_l ≥ |b_l| on all of the cell
//! ```
//!
//! because a rotation about z_i turns all that follows it and leaves what lies before it alone. s_i: the angle between
//! r and z_i changes by at most s_l h_l for each earlier angle l. ρ_l: the corner moves by at most ρ_k h_k, seen from
//! joint l, for each later joint k.
//!
//! Third order: δ_i³ is within h_i³/4 of ¾ h_i² δ_i, and δ_i² δ_k within ½ h_i² h_k of ½ h_i² δ_k, so their slopes go to
//! g.
//!
//! Rounding. These are computed in `f64`, not in intervals, and [`Series::rounding`] is taken off. Let L be the sum of
//! all lengths of the chain, the corner's included, at least 1. Each of at most 17 factors of a pose is known to 2e-14
//! an entry ([`POSE_SLACK`], sine, cosine, products), so orientations to 17 · 6e-14 < 1.2e-12 and positions to
//! 1.2e-12 L; b to 4e-12 L, ∂_i ∂_j f to 1e-11 L, ∂_i ∂_j ∂_k f to 2e-11 L. Over the cell, with H the sum of the
//! half-widths, that is at most 2e-11 L (1 + H + H²/2 + H³/6 + H⁴/24); sums of less than 10⁴ terms, each below L times
//! the same polynomial, add less than 1e-12 of it.
//!
//! [`POSE_SLACK`]: crate::chain::POSE_SLACK

use crate::body;
use crate::chain::{Side, Step};
use crate::interval::{Interval, Mat3, Vec3};
use crate::swept::Extent;
use ipc_types::artefact::{CONCAVE_ABSOLUTE, CONCAVE_SHARE};
use scene::Shape;

/// Most joints of the moving side.
pub const MAX_JOINTS: usize = 8;

/// Normals that are longer are refused: the bounds above are for unit normals, up to rounding.
pub const MAX_NORMAL: f64 = 1.0 + 1e-12;

type V = [f64; 3];
type Joints<T> = [T; MAX_JOINTS];

fn dot(a: &V, b: &V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: &V, b: &V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn minus(a: &V, b: &V) -> V {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn mid(x: Interval) -> f64 {
    0.5 * x.lo() + 0.5 * x.hi()
}

fn mid3(v: &Vec3) -> V {
    v.map(mid)
}

fn times(R: &[V; 3], v: &V) -> V {
    [dot(&R[0], v), dot(&R[1], v), dot(&R[2], v)]
}

fn product(R: &[V; 3], M: &[V; 3]) -> [V; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..3).map(|k| R[i][k] * M[k][j]).sum()))
}

fn mid_matrix(M: &Mat3) -> [V; 3] {
    std::array::from_fn(|i| mid3(&M[i]))
}

/// Corner `corner` of the core of `shape` in its frame, as `ipc_types::artefact::NearCorner` numbers them.
fn corner_of(shape: &Shape, corner: usize) -> Option<V> {
    let sign = |bit: usize| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
    match shape {
        Shape::Box { half_extents: e } if corner < 8 => Some([sign(0) * e.x, sign(1) * e.y, sign(2) * e.z]),
        Shape::Capsule { half_length, .. } if corner < 2 => Some([0.0, 0.0, -sign(0) * half_length]),
        Shape::Sphere { .. } if corner < 1 => Some([0.0; 3]),
        _ => None,
    }
}

/// How many corners the core of `shape` has; `None` for a round one.
pub fn n_corners(shape: &Shape) -> Option<usize> {
    match shape {
        Shape::Box { .. } => Some(8),
        Shape::Capsule { .. } => Some(2),
        Shape::Sphere { .. } => Some(1),
        Shape::Cylinder { .. } => None,
    }
}

/// Radius around the core of `shape`, what dropped rotations add included.
pub fn radius(shape: &Shape, side: &Side) -> Interval {
    Interval::point(body::rounding_radius(shape)) + Interval::point(side.inflation)
}

/// The joints of the moving side at the centre of a cell, and what the normal makes of them.
pub struct Moving<'a> {
    shape: &'a Shape,
    /// Coordinates of the joints, from the frame outwards.
    pub coordinates: Vec<usize>,
    r: V,
    is_angle: Joints<bool>,
    z: Joints<V>,
    o: Joints<V>,
    half: Joints<f64>,
    a: Joints<V>,
    /// s_i.
    s: Joints<f64>,
    R: [V; 3],
    p: V,
    length: f64,
}

impl<'a> Moving<'a> {
    /// `None` if there are too many joints, or an angle is wider than its series is meant for.
    pub fn new(side: &Side, shape: &'a Shape, extent: &Extent, r: &V) -> Option<Self> {
        let mut at = Self {
            shape,
            coordinates: Vec::with_capacity(MAX_JOINTS),
            r: *r,
            is_angle: [false; MAX_JOINTS],
            z: [[0.0; 3]; MAX_JOINTS],
            o: [[0.0; 3]; MAX_JOINTS],
            half: [0.0; MAX_JOINTS],
            a: [[0.0; 3]; MAX_JOINTS],
            s: [0.0; MAX_JOINTS],
            R: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            p: [0.0; 3],
            length: 1.0,
        };
        for step in &side.steps {
            let (axis, sign, j, is_angle) = match step {
                Step::Fixed { R, p } => {
                    let moved = times(&at.R, &mid3(p));
                    at.p = std::array::from_fn(|i| at.p[i] + moved[i]);
                    at.length += dot(&moved, &moved).sqrt();
                    at.R = product(&at.R, &mid_matrix(R));
                    continue;
                }
                Step::Turn { axis, sign, coordinate } => (axis, *sign, *coordinate, true),
                Step::Slide { axis, sign, coordinate } => (axis, *sign, *coordinate, false),
            };
            let k = at.coordinates.len();
            let (m, h) = (*extent.center.get(j)?, *extent.half.get(j)?);
            if k == MAX_JOINTS || (is_angle && !(h <= crate::swept::MAX_HALF_ANGLE)) {
                return None;
            }
            at.coordinates.push(j);
            at.is_angle[k] = is_angle;
            at.z[k] = times(&at.R, &mid3(axis)).map(|x| sign * x);
            at.o[k] = at.p;
            at.half[k] = h;
            if is_angle {
                let (sin, cos) = Interval::point(sign * m).sin_cos();
                at.R = product(&at.R, &mid_matrix(&crate::swept::rotation(axis, sin, cos, Interval::ONE)));
            } else {
                at.p = std::array::from_fn(|i| at.p[i] + at.z[k][i] * m);
                at.length += m.abs() + h;
            }
        }
        let mut turned = 0.0;
        for i in 0..at.coordinates.len() {
            if at.is_angle[i] {
                at.a[i] = cross(&at.r, &at.z[i]);
                at.s[i] = (dot(&at.a[i], &at.a[i]).sqrt() + turned).min(MAX_NORMAL);
                turned += at.s[i] * at.half[i];
            }
        }
        Some(at)
    }

    /// The series of a corner, or `None` if there is no such corner.
    pub fn series(&self, corner: usize) -> Option<Series> {
        let corner = corner_of(self.shape, corner)?;
        let n = self.coordinates.len();
        let h = &self.half;
        let moved = times(&self.R, &corner);
        let x: V = std::array::from_fn(|i| self.p[i] + moved[i]);
        let mut b = [[0.0; 3]; MAX_JOINTS];
        let mut rho = [0.0; MAX_JOINTS];
        let mut moved = 0.0;
        for k in (0..n).rev() {
            (b[k], rho[k]) = if self.is_angle[k] {
                let b = cross(&self.z[k], &minus(&x, &self.o[k]));
                (b, dot(&b, &b).sqrt() + moved)
            } else {
                (self.z[k], 1.0)
            };
            moved += h[k] * rho[k];
        }
        let mut series = Series {
            n,
            value: dot(&self.r, &x),
            g: std::array::from_fn(|k| dot(&self.r, &b[k])),
            hessian: [[0.0; MAX_JOINTS]; MAX_JOINTS],
            cubic: [[[0.0; MAX_JOINTS]; MAX_JOINTS]; MAX_JOINTS],
            rest: 0.0,
            rounding: 0.0,
        };
        for i in (0..n).filter(|&i| self.is_angle[i]) {
            for j in i..n {
                let value = h[i] * h[j] * dot(&self.a[i], &b[j]);
                (series.hessian[i][j], series.hessian[j][i]) = (value, value);
                if !self.is_angle[j] {
                    continue;
                }
                let c = cross(&self.a[i], &self.z[j]);
                for k in j..n {
                    let t = dot(&c, &b[k]);
                    if i == j && j == k {
                        series.g[i] += 0.125 * t * h[i] * h[i];
                        series.rest += (t * h[i] * h[i] * h[i]).abs() / 24.0;
                    } else if i == j || j == k {
                        let (twice, once) = if i == j { (i, k) } else { (j, i) };
                        series.g[once] += 0.25 * t * h[twice] * h[twice];
                        series.rest += 0.25 * (t * h[twice] * h[twice] * h[once]).abs();
                    } else {
                        series.cubic[i][j][k] = t * h[i] * h[j] * h[k];
                    }
                }
            }
            // All quadruples with least index i and greatest l: those within i..=l less those that lack i or l.
            let (mut with, mut without) = (0.0, 0.0);
            for l in i..n {
                let fourth = |x: f64| x * x * x * x;
                let (with_l, without_l) = (with + h[l], if l > i { without + h[l] } else { 0.0 });
                let tuples = fourth(with_l) - fourth(without_l) - fourth(with) + fourth(without);
                series.rest += self.s[i] * rho[l] * tuples / 24.0;
                (with, without) = (with_l, without_l);
            }
        }
        let length = self.length + dot(&corner, &corner).sqrt();
        let width: f64 = h[..n].iter().sum();
        let powers = 1.0 + width * (1.0 + width * (0.5 + width * (1.0 / 6.0 + width / 24.0)));
        series.rounding = 2.1e-11 * length * powers;
        Some(series)
    }
}

/// The series of a corner at the centre of a cell, scaled to the cell.
pub struct Series {
    n: usize,
    /// r·x at the centre.
    pub value: f64,
    /// Slopes by the joints.
    pub g: Joints<f64>,
    hessian: Joints<Joints<f64>>,
    cubic: Joints<Joints<Joints<f64>>>,
    /// Third order with a joint more than once, and fourth order.
    rest: f64,
    /// What rounding may have done to any of it, over the cell.
    pub rounding: f64,
}

impl Series {
    /// What second to fourth order take away at most, by absolute values.
    pub fn by_sizes(&self) -> f64 {
        let second: f64 = self.hessian.iter().flatten().map(|x| x.abs()).sum();
        let cubic: f64 = self.cubic.iter().flatten().flatten().map(|x| x.abs()).sum();
        0.5 * second + cubic + self.rest
    }

    /// Lower bound of f(q) − value + Σ μ (a·q − b) over the cell, by the tangent at τ and N = Σ w wᵀ + ε 1 (see
    /// [`ipc_types::artefact::Cell::Corners`]); `None` if Ĥ + N is not proven positive semidefinite. `slopes` are those
    /// of g·δ + Σ μ (a·q − b), by σ.
    ///
    /// A Cholesky factorisation in `f64` that ends has factored a matrix that differs from the given one by less than
    /// 1e-14 of its trace; that is left of each diagonal entry.
    pub fn by_tangent(&self, tangent: &[f32], concave: &[f32], slopes: &[f64]) -> Option<f64> {
        let n = self.n;
        let finite = tangent.iter().chain(concave).all(|x| x.is_finite());
        if !finite || n == 0 || tangent.len() != n || slopes.len() != n || !concave.len().is_multiple_of(n) {
            return None;
        }
        let mut N = [[0.0; MAX_JOINTS]; MAX_JOINTS];
        let w = |k: usize| f64::from(concave[k]);
        let size: f64 = (0..concave.len()).map(|k| w(k) * w(k)).sum();
        for i in 0..n {
            for j in 0..n {
                N[i][j] = (0..concave.len()).step_by(n).map(|k| w(k + i) * w(k + j)).sum();
            }
            N[i][i] += CONCAVE_ABSOLUTE + CONCAVE_SHARE * size;
        }
        let convex: Joints<Joints<f64>> =
            std::array::from_fn(|i| std::array::from_fn(|j| self.hessian[i][j] + N[i][j]));
        let trace: f64 = (0..n).map(|i| convex[i][i].abs()).sum();
        let mut factor = convex;
        for i in 0..n {
            factor[i][i] -= 1e-13 * trace;
            for j in 0..=i {
                let sum: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
                let rest = factor[i][j] - sum;
                factor[i][j] = if i > j {
                    rest / factor[j][j]
                } else if rest > 0.0 {
                    rest.sqrt()
                } else {
                    return None;
                };
            }
        }
        let tau = |k: usize| f64::from(tangent[k]);
        let mut s = [0.0; MAX_JOINTS];
        let (mut constant, mut sizes) = (0.0, 0.0);
        for i in 0..n {
            let slope: f64 = (0..n).map(|j| convex[i][j] * tau(j)).sum();
            constant -= 0.5 * slope * tau(i) + 0.5 * N[i][i];
            s[i] = slopes[i] + slope;
            let tau_size: f64 = (0..n).map(|j| (convex[i][j] * tau(j)).abs()).sum();
            sizes +=
                slopes[i].abs() + tau_size * (1.0 + tau(i).abs()) + N[i].iter().map(|x| x.abs()).sum::<f64>();
        }
        // Sums of less than 500 terms, rounded once each: 500 · 2⁻⁵³ < 1e-13.
        let rounding = self.rounding + 1e-13 * (sizes + self.by_sizes());
        Some(constant + self.least_at_corners(&N, &s) - self.rest - rounding)
    }

    /// min { s·σ − Σ_{i<j} N_ij σ_i σ_j + C(σ) : σ ∈ {-1, 1}ⁿ }.
    fn least_at_corners(&self, N: &Joints<Joints<f64>>, s: &Joints<f64>) -> f64 {
        let n = self.n;
        let mut least = f64::INFINITY;
        for signs in 0..1_usize << n {
            let sign: Joints<f64> = std::array::from_fn(|i| if signs >> i & 1 == 1 { -1.0 } else { 1.0 });
            let mut sum = 0.0;
            for i in 0..n {
                let mut of_i = s[i];
                for j in i + 1..n {
                    let last: f64 = (j + 1..n).map(|k| sign[k] * self.cubic[i][j][k]).sum();
                    of_i += sign[j] * (last - N[i][j]);
                }
                sum += sign[i] * of_i;
            }
            least = least.min(sum);
        }
        least
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interval;
    use proptest::prelude::*;

    /// A chain of `kinds` (0: slide) with axes and offsets from `numbers`.
    fn side(kinds: &[u8], numbers: &[f64]) -> Side {
        let mut steps = Vec::new();
        let mut numbers = numbers.iter().copied().cycle();
        let mut next = || numbers.next().unwrap_or(0.3);
        for (coordinate, kind) in kinds.iter().enumerate() {
            let (axis, angle) = (unit([next(), next(), next()]), Interval::point(3.0 * next()));
            let (sin, cos) = angle.sin_cos();
            let R = crate::swept::rotation(&axis.map(Interval::point), sin, cos, Interval::ONE);
            steps.push(Step::Fixed { R, p: interval::point3(next(), next(), next()) });
            let axis = unit([next(), next(), next()]).map(Interval::point);
            let sign = if next() > 0.0 { 1.0 } else { -1.0 };
            steps.push(match kind {
                0 => Step::Slide { axis, sign, coordinate },
                _ => Step::Turn { axis, sign, coordinate },
            });
        }
        Side { steps, inflation: 0.0 }
    }

    fn unit(v: V) -> V {
        let norm = dot(&v, &v).sqrt();
        if norm > 1e-3 { v.map(|x| x / norm) } else { [0.0, 0.0, 1.0] }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]
        #[test]
        fn the_gap_stays_above_the_bounds(
            kinds in prop::collection::vec(0_u8..5, 1..=8),
            numbers in prop::collection::vec(-1.0_f64..1.0, 90),
            width in 0.01_f64..0.6,
            corner in 0_usize..8,
            taus in prop::collection::vec(-1.0_f32..1.0, 8),
            shifts in prop::collection::vec(-0.2_f64..0.2, 8),
            samples in prop::collection::vec(prop::collection::vec(-1.0_f64..1.0, 8), 40),
        ) {
            let n = kinds.len();
            let side = side(&kinds, &numbers);
            let shape = Shape::Box { half_extents: [0.3, 0.2, 0.1].into() };
            let r = unit([numbers[0], numbers[1], numbers[2]]).map(|x| (1.0 - 1e-15) * x);
            let half: Vec<f64> = (0..n).map(|k| width * (0.6 + 0.4 * numbers[k + 3])).collect();
            let center: Vec<f64> = (0..n).map(|k| 2.0 * numbers[k + 20]).collect();
            let at = |center: Vec<f64>, half: Vec<f64>| {
                let moving = Moving::new(&side, &shape, &Extent { center, half }, &r).expect("few joints");
                moving.series(corner).expect("a corner")
            };
            let series = at(center.clone(), half.clone());
            let tau = &taus[..n];
            // Diagonal, and as large as the rows of Ĥ: what is convex with it for sure.
            let mut w = vec![0.0_f32; n * n];
            for i in 0..n {
                let row: f64 = series.hessian[i].iter().map(|x| x.abs()).sum();
                w[i * n + i] = (row.sqrt() as f32).next_up();
            }
            let slopes: Vec<f64> = (0..n).map(|k| series.g[k] * half[k] + shifts[k]).collect();
            let bound = series.by_tangent(tau, &w, &slopes).expect("it is convex");
            let mut most = 0.0_f64;
            for (sample_idx, sample) in samples.iter().enumerate() {
                let sigma: Vec<f64> =
                    sample[..n].iter().map(|s| if sample_idx % 2 == 0 { *s } else { s.signum() }).collect();
                let q: Vec<f64> = (0..n).map(|k| center[k] + half[k] * sigma[k]).collect();
                let gap = at(q, vec![0.0; n]).value - series.value;
                let linear: f64 = (0..n).map(|k| series.g[k] * half[k] * sigma[k]).sum();
                let shifted: f64 = gap + sigma.iter().zip(&shifts).map(|(s, shift)| s * shift).sum::<f64>();
                prop_assert!((gap - linear).abs() <= series.by_sizes() + series.rounding, "by sizes");
                prop_assert!(shifted >= bound, "{shifted} < {bound}");
                most = most.max((gap - linear).abs());
            }
            // Neither says nothing.
            prop_assert!(series.by_sizes() <= 200.0 * most + 1e-6, "{} for {most}", series.by_sizes());
        }
    }

    #[test]
    fn a_second_order_that_stays_concave_is_refused() {
        // A point turns about z and is seen along x: its gap is largest at 0.
        let side = side(&[1], &[0.0]);
        let side = Side {
            steps: side
                .steps
                .into_iter()
                .map(|step| match step {
                    Step::Fixed { R, .. } => Step::Fixed { R, p: interval::point3(0.0, 0.0, 0.0) },
                    other => other,
                })
                .chain([Step::Fixed {
                    R: crate::swept::rotation(
                        &interval::point3(0.0, 0.0, 1.0),
                        Interval::ZERO,
                        Interval::ONE,
                        Interval::ONE,
                    ),
                    p: interval::point3(1.0, 0.0, 0.0),
                }])
                .collect(),
            inflation: 0.0,
        };
        let extent = Extent { center: vec![0.0], half: vec![0.1] };
        let shape = Shape::Sphere { radius: 0.0 };
        let moving = Moving::new(&side, &shape, &extent, &[1.0, 0.0, 0.0]).expect("one joint");
        let series = moving.series(0).expect("a point");
        assert!((series.hessian[0][0] + 0.01).abs() < 1e-9, "{}", series.hessian[0][0]);
        assert_eq!(series.by_tangent(&[0.0], &[0.0999], &[0.0]), None);
        let bound = series.by_tangent(&[0.0], &[0.1001], &[0.0]).expect("it is convex");
        let least = 0.1_f64.cos() - 1.0;
        assert!(bound <= least && least < bound + 1e-4, "{bound} for {least}");
        assert_eq!(series.by_tangent(&[0.0, 0.0], &[0.1001], &[0.0]), None);
        assert_eq!(series.by_tangent(&[f32::NAN], &[0.1001], &[0.0]), None);
        assert_eq!(series.by_tangent(&[0.0], &[0.1, 0.1, f32::INFINITY], &[0.0]), None);
    }
}
