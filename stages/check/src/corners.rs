//! A cell proven by the series of the corners of the body that moves.
//!
//! One body rests in the frame. r is the normal, signed so that the gap of a corner x of the other body along it is
//! f(q) = r·x(q) + const. With joints counted from the frame outwards and axes z_i through o_i at the cell's centre m,
//!
//! ```text
//! ∂_i f = r·b_i,  b_i = z_i × (x − o_i) for an angle, z_i for a slide
//! ∂_i ∂_j f = (r × z_i)·b_j,  ∂_i ∂_j ∂_k f = ((r × z_i) × z_j)·b_k,  ∂_i ∂_j ∂_k ∂_l f = (((r × z_i) × z_j) × z_k)·b_l
//!      i ≤ j ≤ k ≤ l; 0 unless all but the last are angles
//! |fifth derivative| ≤ s_i ρ_l,  i its least joint, l its greatest; s_i ≥ |r × z_i|, ρ_l ≥ |b_l| on all of the cell
//! ```
//!
//! because a rotation about z_i turns all that follows it and leaves what lies before it alone. s_i: the angle between
//! r and z_i changes by at most s_l h_l for each earlier angle l. ρ_l: the corner moves by at most ρ_k h_k, seen from
//! joint l, for each later joint k.
//!
//! Powers, with σ = δ / h in [-1, 1] and c a coefficient of the series. They are folded into lower orders:
//!
//! ```text
//! σ_i³ = ¾ σ_i ± ¼,  σ_i³ σ_j = ¾ σ_i σ_j ± ¼,  σ_i⁴ = σ_i² − ⅛ ± ⅛,  σ_i² σ_j² = ½ σ_i² + ½ σ_j² − ¼ ± ¼
//! c σ_i² σ_j = ½ c σ_j ± ½ |c|,  c σ_i² σ_j σ_k = ½ c σ_j σ_k ± ½ |c|                    unless i is kept
//! ```
//!
//! Where joint i is kept (|τ_i| large), its squares beside other joints stay: at a corner of the cell they are c σ_j and
//! c σ_j σ_k, and so they are folded; what that leaves, c (σ_i² − 1) σ_j and c (σ_i² − 1) σ_j σ_k, is 0 at corners and of
//! second derivative at most D_i = 2 Σ |c| in σ_i, none in other joints. D_i is added to the convex part and taken off
//! the concave one, which keeps that concave in each σ_i, so that its least value is at a corner. Products of three and of
//! four different joints are linear in each: they stay as they are.
//!
//! Rounding. These are computed in `f64`, not in intervals, and [`Series::rounding`] is taken off. Let L be the sum of
//! all lengths of the chain, the corner's included, at least 1. Each of at most 17 factors of a pose is known to 2e-14
//! an entry ([`POSE_SLACK`], sine, cosine, products), so orientations to 17 · 6e-14 < 1.2e-12 and positions to
//! 1.2e-12 L; b to 4e-12 L, axes to 2.1e-12, so r × z_i, … to 6.4e-12 after three products, and every derivative to
//! 2e-11 L. Over the cell, with H the sum of the half-widths, that is at most 2e-11 L (1 + H + H²/2 + H³/6 + H⁴/24 +
//! H⁵/120); sums of less than 10⁴ terms, each below L times the same polynomial, add less than 1e-12 of it. What holds
//! of powers and of D_i then holds of the coefficients as computed.
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

/// Corner `corner` of the core of `shape` in its frame, as `ipc_types::artefact::CornersBound` numbers them.
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
        let (b, rho) = self.levers(&x);
        let mut series = Series {
            n,
            half: *h,
            value: dot(&self.r, &x),
            slopes: std::array::from_fn(|k| if k < n { dot(&self.r, &b[k]) * h[k] } else { 0.0 }),
            hessian: [[0.0; MAX_JOINTS]; MAX_JOINTS],
            constant: 0.0,
            products: [0.0; 1 << MAX_JOINTS],
            squares: [[0.0; MAX_JOINTS]; MAX_JOINTS],
            squares_of_pairs: [[[0.0; MAX_JOINTS]; MAX_JOINTS]; MAX_JOINTS],
            rest: 0.0,
            rounding: 0.0,
        };
        self.each_derivative(&b, |joints, t| match *joints {
            [i, j] => series.add_second(i, j, t),
            [i, j, k] => series.add_third([i, j, k], t),
            [i, j, k, l] => series.add_fourth([i, j, k, l], t),
            _ => {}
        });
        for i in (0..n).filter(|&i| self.is_angle[i]) {
            // All quintuples with least index i and greatest l: those within i..=l less those that lack i or l.
            let (mut with, mut without) = (0.0, 0.0);
            for l in i..n {
                let fifth = |x: f64| x * x * x * x * x;
                let (with_l, without_l) = (with + h[l], if l > i { without + h[l] } else { 0.0 });
                let tuples = fifth(with_l) - fifth(without_l) - fifth(with) + fifth(without);
                series.rest += self.s[i] * rho[l] * tuples / 120.0;
                (with, without) = (with_l, without_l);
            }
        }
        let length = self.length + dot(&corner, &corner).sqrt();
        let width: f64 = h[..n].iter().sum();
        let powers =
            1.0 + width * (1.0 + width * (0.5 + width * (1.0 / 6.0 + width * (1.0 / 24.0 + width / 120.0))));
        series.rounding = 2.1e-11 * length * powers;
        Some(series)
    }

    /// b_k of the point `x`, and ρ_k.
    fn levers(&self, x: &V) -> (Joints<V>, Joints<f64>) {
        let mut b = [[0.0; 3]; MAX_JOINTS];
        let mut rho = [0.0; MAX_JOINTS];
        let mut moved = 0.0;
        for k in (0..self.coordinates.len()).rev() {
            (b[k], rho[k]) = if self.is_angle[k] {
                let b = cross(&self.z[k], &minus(x, &self.o[k]));
                (b, dot(&b, &b).sqrt() + moved)
            } else {
                (self.z[k], 1.0)
            };
            moved += self.half[k] * rho[k];
        }
        (b, rho)
    }

    /// Derivatives of second to fourth order by joints in ascending order, over the cell.
    fn each_derivative(&self, b: &Joints<V>, mut visit: impl FnMut(&[usize], f64)) {
        let (n, h) = (self.coordinates.len(), &self.half);
        for i in (0..n).filter(|&i| self.is_angle[i]) {
            for j in i..n {
                visit(&[i, j], h[i] * h[j] * dot(&self.a[i], &b[j]));
                if !self.is_angle[j] {
                    continue;
                }
                let c = cross(&self.a[i], &self.z[j]);
                for k in j..n {
                    visit(&[i, j, k], h[i] * h[j] * h[k] * dot(&c, &b[k]));
                    if !self.is_angle[k] {
                        continue;
                    }
                    let d = cross(&c, &self.z[k]);
                    for l in k..n {
                        visit(&[i, j, k, l], h[i] * h[j] * h[k] * h[l] * dot(&d, &b[l]));
                    }
                }
            }
        }
    }
}

/// The series of a corner at the centre of a cell, by σ.
pub struct Series {
    n: usize,
    half: Joints<f64>,
    /// r·x at the centre.
    value: f64,
    /// First and second order and a constant, with what powers add to them that are folded in any case.
    slopes: Joints<f64>,
    hessian: Joints<Joints<f64>>,
    constant: f64,
    /// Coefficients of products of three and four different joints, by the set of the joints (bit i: joint i).
    products: [f64; 1 << MAX_JOINTS],
    /// Coefficients of σ_i² σ_j and of σ_i² σ_j σ_k, j < k.
    squares: Joints<Joints<f64>>,
    squares_of_pairs: Joints<Joints<Joints<f64>>>,
    /// What those powers lose, and the fifth order.
    rest: f64,
    /// What rounding may have done to any of it, over the cell.
    pub rounding: f64,
}

impl Series {
    /// c σ_i σ_j with the derivative `t`.
    fn add_second(&mut self, i: usize, j: usize, t: f64) {
        self.hessian[i][j] += t;
        if i != j {
            self.hessian[j][i] += t;
        }
    }

    fn add_third(&mut self, joints: [usize; 3], t: f64) {
        match joints {
            [i, _, k] if i == k => {
                let c = t / 6.0;
                self.slopes[i] += 0.75 * c;
                self.rest += 0.25 * c.abs();
            }
            [i, j, k] if i == j => self.squares[i][k] += 0.5 * t,
            [i, j, k] if j == k => self.squares[j][i] += 0.5 * t,
            [i, j, k] => self.products[1 << i | 1 << j | 1 << k] = t,
        }
    }

    fn add_fourth(&mut self, joints: [usize; 4], t: f64) {
        match joints {
            [i, _, _, l] if i == l => {
                let c = t / 24.0;
                self.add_second(i, i, 2.0 * c);
                self.constant -= 0.125 * c;
                self.rest += 0.125 * c.abs();
            }
            [i, j, k, l] if i == k || j == l => {
                let c = t / 6.0;
                // Of i = j = k < l and i < j = k = l the products are the same two joints.
                self.add_second(i, l, 0.75 * c);
                self.rest += 0.25 * c.abs();
            }
            [i, j, k, l] if i == j && k == l => {
                let c = t / 4.0;
                self.add_second(i, i, c);
                self.add_second(k, k, c);
                self.constant -= 0.25 * c;
                self.rest += 0.25 * c.abs();
            }
            [i, j, k, l] if i == j => self.squares_of_pairs[i][k][l] += 0.5 * t,
            [i, j, k, l] if j == k => self.squares_of_pairs[j][i][l] += 0.5 * t,
            [i, j, k, l] if k == l => self.squares_of_pairs[k][i][j] += 0.5 * t,
            [i, j, k, l] => self.products[1 << i | 1 << j | 1 << k | 1 << l] = t,
        }
    }

    /// The series with the squares folded; those of joints where `tangent` is near the ends of the cell are kept. An
    /// empty tangent keeps none.
    pub fn fold(&self, tangent: &[f32]) -> Folded<'_> {
        let n = self.n;
        let (mut slopes, mut hessian) = (self.slopes, self.hessian);
        let (mut kept, mut rest) = ([0.0; MAX_JOINTS], self.rest);
        for i in 0..n {
            let is_kept = tangent.get(i).is_some_and(|tau| tau * tau > KEPT);
            let share = if is_kept { 1.0 } else { 0.5 };
            let mut size = 0.0;
            for j in 0..n {
                slopes[j] += share * self.squares[i][j];
                size += self.squares[i][j].abs();
                for k in j + 1..n {
                    let c = self.squares_of_pairs[i][j][k];
                    hessian[j][k] += share * c;
                    hessian[k][j] += share * c;
                    size += c.abs();
                }
            }
            if is_kept {
                kept[i] = 2.0 * size;
                hessian[i][i] += 2.0 * size;
            } else {
                rest += 0.5 * size;
            }
        }
        Folded { series: self, slopes, hessian, kept, rest }
    }
}

/// The square of τ_i from which the squares of joint i are kept.
const KEPT: f32 = 0.5;

/// A series of first to fourth order that differs from f by at most `rest` (and what rounding does) where no square is
/// kept, and at the corners of the cell in any case.
pub struct Folded<'a> {
    series: &'a Series,
    /// First order, by σ.
    slopes: Joints<f64>,
    /// Ĥ, with D.
    hessian: Joints<Joints<f64>>,
    /// D_i, 0 where the squares of joint i are not kept.
    kept: Joints<f64>,
    rest: f64,
}

impl Folded<'_> {
    /// r·x at the centre and the constant.
    pub fn value(&self) -> f64 {
        self.series.value + self.series.constant
    }

    /// Slopes by the joints; 0 where the cell has no width.
    pub fn slopes_by_joints(&self) -> Joints<f64> {
        std::array::from_fn(|k| {
            let half = self.series.half[k];
            if half > 0.0 { self.slopes[k] / half } else { 0.0 }
        })
    }

    /// What second and higher orders take away at most, by absolute values; where no square is kept.
    pub fn by_sizes(&self) -> f64 {
        let second: f64 = self.hessian.iter().flatten().map(|x| x.abs()).sum();
        let products: f64 = self.series.products.iter().map(|x| x.abs()).sum();
        0.5 * second + products + self.rest
    }

    /// Lower bound of f(q) − value + Σ μ (a·q − b) over the cell, by the tangent at τ and N = Σ w wᵀ + ε 1 (see
    /// [`ipc_types::artefact::Cell::Corners`]); `None` if Ĥ + N is not proven positive semidefinite. `slopes` are those
    /// of g·δ + Σ μ (a·q − b), by σ.
    ///
    /// A Cholesky factorisation in `f64` that ends has factored a matrix that differs from the given one by less than
    /// 1e-14 of its trace; that is left of each diagonal entry.
    pub fn by_tangent(&self, tangent: &[f32], concave: &[f32], slopes: &[f64]) -> Option<f64> {
        let n = self.series.n;
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
            constant -= 0.5 * slope * tau(i) + 0.5 * (N[i][i] + self.kept[i]);
            s[i] = slopes[i] + slope;
            let tau_size: f64 = (0..n).map(|j| (convex[i][j] * tau(j)).abs()).sum();
            sizes += slopes[i].abs() + tau_size * (1.0 + tau(i).abs()) + self.kept[i];
            sizes += N[i].iter().map(|x| x.abs()).sum::<f64>();
        }
        // Sums of less than 500 terms, rounded once each: 500 · 2⁻⁵³ < 1e-13.
        let rounding = self.series.rounding + 1e-13 * (sizes + self.by_sizes());
        Some(constant + self.least_at_corners(&N, &s) - self.rest - rounding)
    }

    /// min { s·σ − Σ_{i<j} N_ij σ_i σ_j + C(σ) : σ ∈ {-1, 1}ⁿ }, by a Walsh–Hadamard transform: from the coefficients by
    /// sets of joints to the values at the corners, by the sets of joints at −1.
    fn least_at_corners(&self, N: &Joints<Joints<f64>>, s: &Joints<f64>) -> f64 {
        let n = self.series.n;
        let mut values = self.series.products;
        for i in 0..n {
            values[1 << i] = s[i];
            for j in i + 1..n {
                values[1 << i | 1 << j] = -N[i][j];
            }
        }
        let values = &mut values[..1 << n];
        for i in 0..n {
            for pair in values.chunks_exact_mut(2 << i) {
                let (plus, minus) = pair.split_at_mut(1 << i);
                for (plus, minus) in plus.iter_mut().zip(minus) {
                    (*plus, *minus) = (*plus + *minus, *plus - *minus);
                }
            }
        }
        values.iter().fold(f64::INFINITY, |least, &value| least.min(value))
    }
}

#[cfg(test)]
mod tests;
