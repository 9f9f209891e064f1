//! How near the corners of a body come to a plane over a cell, by their series.
//!
//! `ipc_types::artefact::Cell::Corners` has the statement, `stages/check/src/corners.rs` the derivation and the bound on
//! rounding; symbols as there. Directions in which the gap is convex cost nothing, where a control net loses as much in
//! them as in the others, and each corner has a row g of its own, where a net has one for the whole body. On the other
//! hand a net holds for wide cells, where the fifth order of a series is large.

use crate::cell::CellBox;
use crate::corner_series::{MAX_JOINTS, Series};
use crate::pair_model::{PairFrame, PairModel};
use crate::support::Core;
use nalgebra::{Matrix3, Rotation3, Vector3};
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
    /// ((r × z_i) × z_j) × z_k for i ≤ j ≤ k, all angles, in the order of three nested loops.
    d: Vec<Vector3<f64>>,
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

    /// b_i for the point `x`, and ρ_i.
    fn levers(&self, x: &Vector3<f64>) -> ([Vector3<f64>; MAX_JOINTS], [f64; MAX_JOINTS]) {
        let mut b = [Vector3::zeros(); MAX_JOINTS];
        let mut rho = [0.0; MAX_JOINTS];
        let mut moved = 0.0;
        for k in (0..self.n).rev() {
            (b[k], rho[k]) = if self.is_angle[k] {
                let b = self.z[k].cross(&(x - self.o[k]));
                (b, b.norm() + moved)
            } else {
                (self.z[k], 1.0)
            };
            moved += self.half[k] * rho[k];
        }
        (b, rho)
    }

    /// With the normal `r`.
    pub fn with_normal(&self, r: &Vector3<f64>) -> NormalAt<'_> {
        let zero = Vector3::zeros();
        let mut at = NormalAt {
            joints: self,
            r: *r,
            a: [zero; MAX_JOINTS],
            c: [[zero; MAX_JOINTS]; MAX_JOINTS],
            // As many as there are triples i ≤ j ≤ k.
            d: Vec::with_capacity(self.n * (self.n + 1) * (self.n + 2) / 6),
            s: [0.0; MAX_JOINTS],
        };
        let mut turned = 0.0;
        for i in (0..self.n).filter(|&i| self.is_angle[i]) {
            at.a[i] = r.cross(&self.z[i]);
            at.s[i] = (at.a[i].norm() + turned).min(1.0);
            turned += at.s[i] * self.half[i];
            for j in (i..self.n).filter(|&j| self.is_angle[j]) {
                at.c[i][j] = at.a[i].cross(&self.z[j]);
                for k in (j..self.n).filter(|&k| self.is_angle[k]) {
                    at.d.push(at.c[i][j].cross(&self.z[k]));
                }
            }
        }
        at
    }
}

impl NormalAt<'_> {
    /// More than the series of the corner takes away in all, at little cost; r·x at the centre; and r·b_i.
    pub fn outline(&self, corner: &Vector3<f64>) -> (f64, f64, [f64; MAX_JOINTS]) {
        let joints = self.joints;
        let x = joints.p + joints.R * corner;
        let (b, rho) = joints.levers(&x);
        let [_, _, second, third, fourth, fifth] = self.sizes(&rho);
        // Folding a term of the fourth order adds at most half of it.
        let sizes = second + third + 1.5 * fourth + fifth;
        let slopes = std::array::from_fn(|k| if k < joints.n { self.r.dot(&b[k]) } else { 0.0 });
        (self.r.dot(&x), sizes, slopes)
    }

    /// What rounding may do to the series of the corner at `corner`.
    pub fn rounding(&self, corner: &Vector3<f64>) -> f64 {
        let joints = self.joints;
        let width: f64 = joints.half[..joints.n].iter().sum();
        let powers =
            1.0 + width * (1.0 + width * (0.5 + width * (1.0 / 6.0 + width * (1.0 / 24.0 + width / 120.0))));
        ROUNDING * (joints.length + corner.norm()) * powers
    }

    /// Bounds of all derivatives of an order, by powers of the widths over factorials: Σ s_i ρ_l over the tuples whose
    /// least joint is i and whose greatest is l; orders 0 to 5.
    fn sizes(&self, rho: &[f64; MAX_JOINTS]) -> [f64; 6] {
        let joints = self.joints;
        let (n, h) = (joints.n, &joints.half);
        let mut sizes = [0.0; 6];
        for i in (0..n).filter(|&i| self.s[i] > 0.0) {
            let (mut with, mut without) = (0.0, 0.0);
            for l in i..n {
                let (with_l, without_l) = (with + h[l], if l > i { without + h[l] } else { 0.0 });
                let mut powers = [1.0; 4];
                let mut factorial = 1.0;
                for (order, size) in sizes.iter_mut().enumerate().skip(1) {
                    for (power, base) in powers.iter_mut().zip([with_l, without_l, with, without]) {
                        *power *= base;
                    }
                    factorial *= order as f64;
                    let tuples = powers[0] - powers[1] - powers[2] + powers[3];
                    *size += self.s[i] * rho[l] * tuples / factorial;
                }
                (with, without) = (with_l, without_l);
            }
        }
        sizes
    }

    /// The series of the corner at `corner` in the shape's frame.
    pub fn series(&self, corner: &Vector3<f64>) -> Series {
        let joints = self.joints;
        let n = joints.n;
        let x = joints.p + joints.R * corner;
        let h = &joints.half;
        let (b, rho) = joints.levers(&x);
        let mut d = self.d.iter();
        let mut series = Series::new(n, h, self.r.dot(&x), self.sizes(&rho)[5], self.rounding(corner));
        for (k, b) in b[..n].iter().enumerate() {
            series.add_first(k, self.r.dot(b) * h[k]);
        }
        for i in (0..n).filter(|&i| joints.is_angle[i]) {
            for j in i..n {
                series.add_second(i, j, self.a[i].dot(&b[j]) * h[i] * h[j]);
                if !joints.is_angle[j] {
                    continue;
                }
                for k in j..n {
                    series.add_third([i, j, k], self.c[i][j].dot(&b[k]) * h[i] * h[j] * h[k]);
                    if joints.is_angle[k]
                        && let Some(d) = d.next()
                    {
                        let scale = h[i] * h[j] * h[k];
                        for l in k..n {
                            series.add_fourth([i, j, k, l], d.dot(&b[l]) * h[l] * scale);
                        }
                    }
                }
            }
        }
        series
    }
}

/// Times the chain's length, the polynomial of the widths: more than the verifier takes off for rounding.
const ROUNDING: f64 = 3e-11;
