//! How near the corners of a body come to a plane over a cell, by their series.
//!
//! `ipc_types::artefact::Cell::Corners` has the statement, `stages/check/src/corners.rs` the derivation and the bound on
//! rounding; symbols as there. Directions in which the gap is convex cost nothing, where a control net loses as much in
//! them as in the others, and each corner has a row g of its own, where a net has one for the whole body. On the other
//! hand a net holds for wide cells, where the fourth order of a series is large.

use crate::cell::CellBox;
use crate::pair_model::{PairFrame, PairModel};
use crate::support::Core;
use ipc_types::artefact::{CONCAVE_ABSOLUTE, CONCAVE_SHARE};
use nalgebra::{Matrix3, Rotation3, SMatrix, SymmetricEigen, Vector3};
use scene::CoordinateKind;

/// A pair one body of which has corners, seen from the link of the other.
#[derive(Debug, Clone)]
pub struct CornerPair {
    /// Position of the frame.
    pub frame_idx: usize,
    /// The side that moves.
    pub moving: usize,
    /// Corners of its core in the shape's frame, metres.
    pub corners: Vec<Vector3<f64>>,
}

impl CornerPair {
    /// Of the frames in which one body rests and the other has corners and many joints, the one in which that moves
    /// least, if any.
    pub fn new(frames: &[PairFrame]) -> Option<Self> {
        let mut best: Option<(f64, Self)> = None;
        for (frame_idx, frame) in frames.iter().enumerate() {
            for moving in 0..2 {
                let side = &frame.sides[moving];
                let corners = corners(&side.core);
                let rests = frame.sides[1 - moving].steps.is_empty();
                let reach: f64 = side.steps.iter().map(|step| step.lever).sum();
                if rests
                    && (MIN_JOINTS..=MAX_JOINTS).contains(&side.steps.len())
                    && !corners.is_empty()
                    && best.as_ref().is_none_or(|(least, _)| reach < *least)
                {
                    best = Some((reach, Self { frame_idx, moving, corners }));
                }
            }
        }
        best.map(|(_, pair)| pair)
    }
}

/// Points whose hull is the core; none for a round one.
fn corners(core: &Core) -> Vec<Vector3<f64>> {
    match *core {
        Core::Box(x, y, z) => (0..8)
            .map(|i| {
                let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
                Vector3::new(sign(0) * x, sign(1) * y, sign(2) * z)
            })
            .collect(),
        Core::Segment(half) => vec![Vector3::new(0.0, 0.0, half), Vector3::new(0.0, 0.0, -half)],
        Core::Point => vec![Vector3::zeros()],
        Core::Cylinder(..) => Vec::new(),
    }
}

/// Fewer joints have small control nets, which hold for wider cells.
const MIN_JOINTS: usize = 5;
/// Most joints of the moving side.
pub const MAX_JOINTS: usize = 8;
/// Triples of different joints.
const MAX_TRIPLES: usize = MAX_JOINTS * (MAX_JOINTS - 1) * (MAX_JOINTS - 2) / 6;

/// The joints of the moving side at the centre of a cell.
pub struct JointsAt {
    n: usize,
    is_angle: [bool; MAX_JOINTS],
    /// Signed axes and points on them.
    z: [Vector3<f64>; MAX_JOINTS],
    o: [Vector3<f64>; MAX_JOINTS],
    half: [f64; MAX_JOINTS],
    /// Sum of the lengths of the chain.
    length: f64,
    /// Pose of the moving body's shape in the frame.
    R: Matrix3<f64>,
    p: Vector3<f64>,
}

/// What a normal makes of the joints.
pub struct NormalAt<'a> {
    joints: &'a JointsAt,
    r: Vector3<f64>,
    /// r × z_i; zero for a slide.
    a: [Vector3<f64>; MAX_JOINTS],
    /// (r × z_i) × z_j for i ≤ j, both angles.
    c: [[Vector3<f64>; MAX_JOINTS]; MAX_JOINTS],
    /// s_i.
    s: [f64; MAX_JOINTS],
}

impl JointsAt {
    /// At the centre of `cell`.
    pub fn new(model: &PairModel, pair: &CornerPair, cell: &CellBox) -> Self {
        let side = &model.frames[pair.frame_idx].sides[pair.moving];
        let (mut R, mut p) = (Matrix3::identity(), Vector3::zeros());
        let zero = Vector3::zeros();
        let mut at = Self {
            n: side.steps.len(),
            is_angle: [false; MAX_JOINTS],
            z: [zero; MAX_JOINTS],
            o: [zero; MAX_JOINTS],
            half: [0.0; MAX_JOINTS],
            length: 1.0 + side.p_tail.norm(),
            R,
            p,
        };
        for (k, step) in side.steps.iter().enumerate() {
            at.length += step.p.norm();
            p += R * step.p;
            R *= step.R;
            at.is_angle[k] = step.kind == CoordinateKind::Revolute;
            at.z[k] = R.column(2) * step.sign;
            at.o[k] = p;
            at.half[k] = cell.half(step.coordinate);
            let value = step.sign * cell.center(step.coordinate);
            match step.kind {
                CoordinateKind::Revolute => {
                    R *= Rotation3::from_axis_angle(&Vector3::z_axis(), value).into_inner();
                }
                CoordinateKind::Prismatic => {
                    p += R.column(2) * value;
                    at.length += value.abs() + at.half[k];
                }
            }
        }
        (at.R, at.p) = (R * side.R_tail, p + R * side.p_tail);
        at
    }

    /// With the normal `r`.
    pub fn with_normal(&self, r: &Vector3<f64>) -> NormalAt<'_> {
        let zero = Vector3::zeros();
        let mut at = NormalAt {
            joints: self,
            r: *r,
            a: [zero; MAX_JOINTS],
            c: [[zero; MAX_JOINTS]; MAX_JOINTS],
            s: [0.0; MAX_JOINTS],
        };
        let mut turned = 0.0;
        for i in (0..self.n).filter(|&i| self.is_angle[i]) {
            at.a[i] = r.cross(&self.z[i]);
            at.s[i] = (at.a[i].norm() + turned).min(1.0);
            turned += at.s[i] * self.half[i];
            for j in (i..self.n).filter(|&j| self.is_angle[j]) {
                at.c[i][j] = at.a[i].cross(&self.z[j]);
            }
        }
        at
    }
}

/// The series of a corner at the centre of a cell.
#[derive(Debug, Clone)]
pub struct Series {
    n: usize,
    half: [f64; MAX_JOINTS],
    /// r·x at the centre.
    pub value: f64,
    /// Slope g, by the joints of the side: the gradient and what the third order adds to it.
    pub g: [f64; MAX_JOINTS],
    /// Ĥ.
    hessian: [[f64; MAX_JOINTS]; MAX_JOINTS],
    /// Third order in three different joints over the cell, for i < j < k in the order of three nested loops.
    cubic: [f64; MAX_TRIPLES],
    /// For each joint: how much of the third order hangs on it.
    cubic_sizes: [f64; MAX_JOINTS],
    /// Third order with a joint more than once, and fourth order.
    rest: f64,
    fourth: f64,
    cubic_size: f64,
    /// What rounding may do to any of it, here and where it is verified.
    rounding: f64,
}

impl NormalAt<'_> {
    /// The series of the corner at `corner` in the shape's frame.
    pub fn series(&self, corner: &Vector3<f64>) -> Series {
        let joints = self.joints;
        let n = joints.n;
        let x = joints.p + joints.R * corner;
        let h = &joints.half;
        let mut series = Series {
            n,
            half: *h,
            value: self.r.dot(&x),
            g: [0.0; MAX_JOINTS],
            hessian: [[0.0; MAX_JOINTS]; MAX_JOINTS],
            cubic: [0.0; MAX_TRIPLES],
            cubic_sizes: [0.0; MAX_JOINTS],
            rest: 0.0,
            fourth: 0.0,
            cubic_size: 0.0,
            rounding: 0.0,
        };
        let mut b = [Vector3::zeros(); MAX_JOINTS];
        let mut rho = [0.0; MAX_JOINTS];
        let mut moved = 0.0;
        for k in (0..n).rev() {
            (b[k], rho[k]) = if joints.is_angle[k] {
                let b = joints.z[k].cross(&(x - joints.o[k]));
                (b, b.norm() + moved)
            } else {
                (joints.z[k], 1.0)
            };
            moved += h[k] * rho[k];
            series.g[k] = self.r.dot(&b[k]);
        }
        for i in (0..n).filter(|&i| joints.is_angle[i]) {
            // Triples that begin with an earlier joint.
            let before = triples(n) - triples(n - i);
            for j in i..n {
                let value = h[i] * h[j] * self.a[i].dot(&b[j]);
                series.hessian[i][j] = value;
                series.hessian[j][i] = value;
                if !joints.is_angle[j] {
                    continue;
                }
                for k in j..n {
                    let t = self.c[i][j].dot(&b[k]);
                    if i == j && j == k {
                        series.g[i] += 0.125 * t * h[i] * h[i];
                        let size = (t * h[i] * h[i] * h[i]).abs() / 24.0;
                        series.rest += size;
                        series.cubic_sizes[i] += size;
                    } else if i == j || j == k {
                        let (twice, once) = if i == j { (i, k) } else { (j, i) };
                        series.g[once] += 0.25 * t * h[twice] * h[twice];
                        let size = 0.25 * (t * h[twice] * h[twice] * h[once]).abs();
                        series.rest += size;
                        series.cubic_sizes[twice] += size;
                        series.cubic_sizes[once] += size;
                    } else {
                        let value = t * h[i] * h[j] * h[k];
                        let of_first = before + pairs(n - i - 1) - pairs(n - j);
                        series.cubic[of_first + k - j - 1] = value;
                        series.cubic_size += value.abs();
                        for at in [i, j, k] {
                            series.cubic_sizes[at] += 0.5 * value.abs();
                        }
                    }
                }
            }
        }
        let mut sum = 0.0;
        for i in (0..n).filter(|&i| self.s[i] > 0.0) {
            let (mut with, mut without) = (0.0, 0.0);
            let mut share = 0.0;
            for l in i..n {
                let p4 = |x: f64| x * x * x * x;
                let (with_l, without_l) = (with + h[l], if l > i { without + h[l] } else { 0.0 });
                share += rho[l] * (p4(with_l) - p4(without_l) - p4(with) + p4(without));
                (with, without) = (with_l, without_l);
            }
            sum += self.s[i] * share;
        }
        series.fourth = sum / 24.0;
        let width: f64 = h[..n].iter().sum();
        let powers = 1.0 + width * (1.0 + width * (0.5 + width * (1.0 / 6.0 + width / 24.0)));
        series.rounding = ROUNDING * (joints.length + corner.norm()) * powers;
        series
    }
}

impl Series {
    /// What second, third and fourth order take away at most, at little cost.
    pub fn crude(&self) -> f64 {
        let second: f64 = self.hessian.iter().flatten().map(|x| x.abs()).sum();
        0.5 * second + self.cubic_size + self.rest + self.fourth + self.rounding
    }

    /// Vectors w and the matrix N = Σ w wᵀ + ε 1 that they stand for, with Ĥ + N positive semidefinite.
    pub fn concave(&self) -> Concave {
        let n = self.n;
        let (values, vectors) = eigen(&self.hessian, n);
        let mut w: Vec<[f32; MAX_JOINTS]> = Vec::new();
        for i in (0..MAX_JOINTS).filter(|&i| values[i] < -SMALLEST_CONCAVE) {
            let size = (-values[i]).sqrt();
            w.push(std::array::from_fn(|k| (size * vectors[k][i]) as f32));
        }
        Concave { N: concave_matrix(&w, n), w }
    }

    /// Slopes of σᵀ (Ĥ + N) τ and −½ τᵀ (Ĥ + N) τ.
    pub fn tangent(&self, N: &Matrix, tau: &[f32; MAX_JOINTS]) -> ([f64; MAX_JOINTS], f64) {
        let (mut slopes, mut constant) = ([0.0; MAX_JOINTS], 0.0);
        for i in 0..self.n {
            for j in 0..self.n {
                slopes[i] += (self.hessian[i][j] + N[i][j]) * f64::from(tau[j]);
            }
            constant -= 0.5 * slopes[i] * f64::from(tau[i]);
        }
        (slopes, constant)
    }

    /// ½ σᵀ Ĥ σ + C(σ) + T, more than which the series does not differ from f − f(m) − g·δ there.
    pub fn beyond_first(&self, sigma: &[f64; MAX_JOINTS]) -> f64 {
        let (mut sum, mut at) = (self.rest + self.fourth, 0);
        for i in 0..self.n {
            sum += 0.5 * self.hessian[i][i] * sigma[i] * sigma[i];
            for j in i + 1..self.n {
                let mut last = self.hessian[i][j];
                for k in j + 1..self.n {
                    last += self.cubic[at] * sigma[k];
                    at += 1;
                }
                sum += sigma[i] * sigma[j] * last;
            }
        }
        sum
    }

    /// min { s·σ − ½ σᵀ N σ + C(σ) : σ ∈ [-1, 1]ⁿ } − T: it is concave in each σ_i, so that corners are enough.
    pub fn least_at_corners(&self, N: &Matrix, s: &[f64; MAX_JOINTS]) -> f64 {
        let n = self.n;
        let mut least = f64::INFINITY;
        // Blocks of corners that differ in the first joints only are summed side by side.
        let n_lanes = N_LANE_BITS.min(n);
        for signs in 0..1_usize << (n - n_lanes) {
            let mut sign = [[1.0; 1 << N_LANE_BITS]; MAX_JOINTS];
            for (i, of_joint) in sign.iter_mut().enumerate() {
                for (lane, sign) in of_joint.iter_mut().enumerate() {
                    let bits = if i < n_lanes { lane >> i } else { signs >> (i - n_lanes) };
                    *sign = if bits & 1 == 1 { -1.0 } else { 1.0 };
                }
            }
            let (mut sum, mut at) = ([0.0; 1 << N_LANE_BITS], 0);
            for i in 0..n {
                let mut of_i = [s[i]; 1 << N_LANE_BITS];
                for j in i + 1..n {
                    let mut last = [-N[i][j]; 1 << N_LANE_BITS];
                    for k in j + 1..n {
                        let cubic = self.cubic[at];
                        at += 1;
                        last.iter_mut().zip(&sign[k]).for_each(|(last, sign)| *last += sign * cubic);
                    }
                    for ((of_i, sign), last) in of_i.iter_mut().zip(&sign[j]).zip(&last) {
                        *of_i += sign * last;
                    }
                }
                for ((sum, sign), of_i) in sum.iter_mut().zip(&sign[i]).zip(&of_i) {
                    *sum += sign * of_i;
                }
            }
            least = sum.iter().fold(least, |least, &sum| least.min(sum));
        }
        let diagonal: f64 = (0..n).map(|i| N[i][i]).sum();
        least - 0.5 * diagonal - self.rest - self.fourth - self.rounding
    }

    /// Whether Ĥ + N is positive definite, by more than rounding.
    pub fn is_convex_with(&self, N: &Matrix) -> bool {
        let mut factor = self.hessian;
        for i in 0..self.n {
            for j in 0..=i {
                let sum: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
                let margin = if i == j { 0.1 * CONCAVE_ABSOLUTE } else { 0.0 };
                let rest = factor[i][j] + N[i][j] - margin - sum;
                if i == j && !(rest > 0.0) {
                    return false;
                }
                factor[i][j] = if i == j { rest.sqrt() } else { rest / factor[j][j] };
            }
        }
        true
    }

    /// Eigenvalues and eigenvectors of Ĥ.
    pub fn spectrum(&self) -> ([f64; MAX_JOINTS], Matrix) {
        eigen(&self.hessian, self.n)
    }

    /// How much the higher orders gain where joint k is halved; `spectrum` is that of Ĥ.
    pub fn gain(&self, k: usize, spectrum: &([f64; MAX_JOINTS], Matrix)) -> f64 {
        let sum: f64 = self.half[..self.n].iter().sum();
        let (values, vectors) = spectrum;
        let mut second = 0.0;
        for i in (0..MAX_JOINTS).filter(|&i| values[i] < 0.0) {
            let size: f64 = (0..self.n).map(|k| vectors[k][i].abs()).sum();
            second -= values[i] * vectors[k][i].abs() * size;
        }
        SECOND_GAIN * second + self.cubic_sizes[k] + 2.0 * self.fourth * self.half[k] / sum
    }

    /// Whether the fourth order is most of what is taken away: then the cell is too wide for a series.
    pub fn is_wide(&self, less: f64) -> bool {
        self.fourth > WIDE_SHARE * less
    }
}

fn pairs(n: usize) -> usize {
    n * n.saturating_sub(1) / 2
}

fn triples(n: usize) -> usize {
    n * n.saturating_sub(1) * n.saturating_sub(2) / 6
}

/// By the joints of a side.
pub type Matrix = [[f64; MAX_JOINTS]; MAX_JOINTS];

/// The concave part of a second order.
pub struct Concave {
    /// Vectors w.
    pub w: Vec<[f32; MAX_JOINTS]>,
    /// N.
    pub N: Matrix,
}

/// N = Σ w wᵀ + ε 1, as `ipc_types::artefact::NearCorner` has it.
pub fn concave_matrix(w: &[[f32; MAX_JOINTS]], n: usize) -> Matrix {
    let mut N = [[0.0; MAX_JOINTS]; MAX_JOINTS];
    let mut size = 0.0;
    for w in w {
        for i in 0..n {
            size += f64::from(w[i]) * f64::from(w[i]);
            for j in 0..n {
                N[i][j] += f64::from(w[i]) * f64::from(w[j]);
            }
        }
    }
    (0..n).for_each(|i| N[i][i] += CONCAVE_ABSOLUTE + CONCAVE_SHARE * size);
    N
}

/// Eigenvalues and eigenvectors (by columns) of the leading n × n block of a symmetric matrix, whose other entries are
/// zero. Where they do not converge, the rows' sums and the coordinates, which bound the matrix as well.
fn eigen(A: &Matrix, n: usize) -> ([f64; MAX_JOINTS], Matrix) {
    let matrix = SMatrix::<f64, MAX_JOINTS, MAX_JOINTS>::from_fn(|i, j| A[i][j]);
    match SymmetricEigen::try_new(matrix, f64::EPSILON, MAX_EIGEN_STEPS) {
        Some(SymmetricEigen { eigenvalues, eigenvectors }) => {
            (eigenvalues.into(), std::array::from_fn(|i| std::array::from_fn(|j| eigenvectors[(i, j)])))
        }
        None => (
            std::array::from_fn(|i| -A[i][..n].iter().map(|x| x.abs()).sum::<f64>()),
            std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 })),
        ),
    }
}

/// Share that goes of what a negative eigenpair takes away when a coordinate is halved.
const SECOND_GAIN: f64 = 0.375;
/// A cell is wide for a series if the fourth order is this share of what it takes away.
const WIDE_SHARE: f64 = 0.4;
/// Corners of a cell that are summed side by side: 2 to this power.
const N_LANE_BITS: usize = 3;
/// Eigenvalues above the negative of this, metres, are left to the ε of N.
const SMALLEST_CONCAVE: f64 = 0.1 * CONCAVE_ABSOLUTE;
/// Steps after which the search for eigenvalues ends.
const MAX_EIGEN_STEPS: usize = 200;
/// Times the chain's length, the polynomial of the widths: more than the verifier takes off for rounding.
const ROUNDING: f64 = 3e-11;
