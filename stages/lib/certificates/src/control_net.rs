//! κ: the least gap of two swept bodies along a normal, over a cell, as a minimum over control points.
//!
//! ```text
//! n·(x_A(q) − x_B(q)) − g·δ ≥ κ = min over control maps of (n·x_A − Σ g_j h_j i_j)
//!                                + min over control maps of (−n·x_B − Σ g_j h_j i_j) − Σ |g_j| e_j − radii
//! ```
//!
//! with δ = q − m, m the cell's centre, h its half-widths. A rotation by an angle in [m − h, m + h] is a convex
//! combination of three affine maps that do not depend on the point: the rotations by m ∓ h, and the rotation by m
//! with 1/cos h in its plane; with the same weights h sin δ / sin h has the values −h, 0, h, and it differs from δ by
//! at most e. Rows n·M are pushed through the chain, three children a rotation. A translation needs no children: its
//! two ends give the same row. Source: mathematics.md 2.1.

use crate::cell::CellBox;
use crate::side::Side;
use nalgebra::{Matrix3, Vector3};
use scene::CoordinateKind;

/// Largest half-width of an angle for which control maps are used: the middle one grows as 1/cos h.
pub const MAX_HALF_ANGLE: f64 = 1.2;

/// A row whose part across the axis of a rotation is below this does not feel the rotation: what is left out is far
/// below the margin that certificates are held to.
const TOL_ALONG_AXIS: f64 = 1e-13;

/// max { h sin d / sin h − d : 0 ≤ d ≤ h }, reached where cos d = sin h / h; h < π.
pub fn sine_excess(h: f64) -> f64 {
    if h < 1e-4 {
        // e = 0.0641500299… h³ (1 + O(h²)).
        return 0.0642 * h * h * h;
    }
    let d = (h.sin() / h).clamp(-1.0, 1.0).acos();
    (h * d.sin() / h.sin() - d).max(0.0) + 1e-15
}

/// Sines and cosines of a joint on a cell.
#[derive(Debug, Clone, Copy)]
struct Motion {
    /// Cosine and sine of the control maps' angles at m − h, m, m + h; the middle ones over cos h.
    rotations: [(f64, f64); 3],
    /// sign · m and sign · h of a translation.
    translation: (f64, f64),
    half: f64,
}

impl Motion {
    fn new(side: &Side, step_idx: usize, center: f64, half: f64) -> Self {
        let step = &side.steps[step_idx];
        let mut motion = Self { rotations: [(1.0, 0.0); 3], translation: (0.0, 0.0), half };
        match step.kind {
            CoordinateKind::Prismatic => motion.translation = (step.sign * center, step.sign * half),
            CoordinateKind::Revolute => {
                let (s_m, c_m) = (step.sign * center).sin_cos();
                let (s_h, c_h) = (step.sign * half).sin_cos();
                motion.rotations = [
                    (c_m * c_h + s_m * s_h, s_m * c_h - c_m * s_h),
                    (c_m / c_h, s_m / c_h),
                    (c_m * c_h - s_m * s_h, s_m * c_h + c_m * s_h),
                ];
            }
        }
        motion
    }
}

/// Least value on one side and where it is reached.
#[derive(Debug, Clone, Default)]
pub struct Extreme {
    /// The least value.
    pub value: f64,
    /// The control map of each joint: 0, 1, 2 for −h, 0, +h.
    pub path: Vec<u8>,
}

/// Buffers of the rows, reused between cells.
#[derive(Debug, Default)]
pub struct ControlNet {
    rx: Vec<f64>,
    ry: Vec<f64>,
    rz: Vec<f64>,
    /// Offsets without and with the row g.
    d: [Vec<f64>; 2],
    motions: Vec<Motion>,
    /// Number of rows before the branching of each joint; 0 where it does not branch.
    branches: Vec<usize>,
}

fn row_times(r: [f64; 3], M: &Matrix3<f64>) -> [f64; 3] {
    [
        r[0] * M[(0, 0)] + r[1] * M[(1, 0)] + r[2] * M[(2, 0)],
        r[0] * M[(0, 1)] + r[1] * M[(1, 1)] + r[2] * M[(2, 1)],
        r[0] * M[(0, 2)] + r[1] * M[(1, 2)] + r[2] * M[(2, 2)],
    ]
}

impl ControlNet {
    /// The least `r·x − Σ g_j δ_j` over the control points of `side` on the cell, for g = 0 and for `g` (one
    /// coefficient a coordinate), radius and e not counted.
    pub fn least(&mut self, side: &Side, cell: &CellBox, r: &Vector3<f64>, g: &[f64]) -> [Extreme; 2] {
        self.motions.clear();
        self.motions.extend((0..side.steps.len()).map(|k| {
            let j = side.steps[k].coordinate;
            Motion::new(side, k, cell.center(j), cell.half(j))
        }));
        self.branches.clear();
        let capacity = 3_usize.pow(side.n_turns() as u32);
        for rows in [&mut self.rx, &mut self.ry, &mut self.rz] {
            rows.clear();
            rows.resize(capacity, 0.0);
        }
        for offsets in &mut self.d {
            offsets.clear();
            offsets.resize(capacity, 0.0);
        }
        (self.rx[0], self.ry[0], self.rz[0]) = (r.x, r.y, r.z);
        let mut n_rows = 1;
        for k in 0..side.steps.len() {
            let step = &side.steps[k];
            self.apply_fixed(n_rows, &step.R, &step.p);
            match step.kind {
                CoordinateKind::Prismatic => {
                    self.slide(n_rows, k, g[step.coordinate]);
                    self.branches.push(0);
                }
                CoordinateKind::Revolute if self.is_along_axis(n_rows) => {
                    let spread = (g[step.coordinate] * self.motions[k].half).abs();
                    self.d[1][..n_rows].iter_mut().for_each(|d| *d -= spread);
                    self.branches.push(0);
                }
                CoordinateKind::Revolute => {
                    self.turn(n_rows, k, g[step.coordinate]);
                    self.branches.push(n_rows);
                    n_rows *= 3;
                }
            }
        }
        self.close(n_rows, side);
        [0, 1].map(|variant| self.extreme(n_rows, side, variant, g))
    }

    /// d ← d + r·p, r ← r R.
    fn apply_fixed(&mut self, n_rows: usize, R: &Matrix3<f64>, p: &Vector3<f64>) {
        let [d0, dg] = &mut self.d;
        let (rx, ry, rz) = (&mut self.rx[..n_rows], &mut self.ry[..n_rows], &mut self.rz[..n_rows]);
        let (d0, dg) = (&mut d0[..n_rows], &mut dg[..n_rows]);
        for i in 0..n_rows {
            let r = [rx[i], ry[i], rz[i]];
            let along = r[0] * p.x + r[1] * p.y + r[2] * p.z;
            d0[i] += along;
            dg[i] += along;
            [rx[i], ry[i], rz[i]] = row_times(r, R);
        }
    }

    fn is_along_axis(&self, n_rows: usize) -> bool {
        (0..n_rows).all(|i| self.rx[i].abs() <= TOL_ALONG_AXIS && self.ry[i].abs() <= TOL_ALONG_AXIS)
    }

    /// The worse end of a translation: both give the same row.
    fn slide(&mut self, n_rows: usize, k: usize, g: f64) {
        let motion = self.motions[k];
        let (center, half) = motion.translation;
        for i in 0..n_rows {
            let rz = self.rz[i];
            self.d[0][i] += rz * center - (rz * half).abs();
            self.d[1][i] += rz * center - (rz * half - g * motion.half).abs();
        }
    }

    /// Three children a row, child-major.
    fn turn(&mut self, n_rows: usize, k: usize, g: f64) {
        let motion = self.motions[k];
        let g_h = g * motion.half;
        let [d0, dg] = &mut self.d;
        let shifts = [g_h, 0.0, -g_h];
        // The first child overwrites its parent, so it comes last.
        for child in [2, 1, 0] {
            let (c, s) = motion.rotations[child];
            let at = child * n_rows;
            for i in 0..n_rows {
                let (x, y) = (self.rx[i], self.ry[i]);
                self.rx[at + i] = x * c + y * s;
                self.ry[at + i] = y * c - x * s;
                self.rz[at + i] = self.rz[i];
                d0[at + i] = d0[i];
                dg[at + i] = dg[i] + shifts[child];
            }
        }
    }

    /// Adds tail and support function: d ← d + r·p_tail − σ(r R_tail).
    fn close(&mut self, n_rows: usize, side: &Side) {
        let [d0, dg] = &mut self.d;
        let (rx, ry, rz) = (&self.rx[..n_rows], &self.ry[..n_rows], &self.rz[..n_rows]);
        let (d0, dg) = (&mut d0[..n_rows], &mut dg[..n_rows]);
        let (p, R) = (&side.p_tail, &side.R_tail);
        for i in 0..n_rows {
            let r = [rx[i], ry[i], rz[i]];
            let term = r[0] * p.x + r[1] * p.y + r[2] * p.z - side.core.support(row_times(r, R));
            d0[i] += term;
            dg[i] += term;
        }
    }

    fn extreme(&self, n_rows: usize, side: &Side, variant: usize, g: &[f64]) -> Extreme {
        let values = &self.d[variant][..n_rows];
        let value = values.iter().fold(f64::INFINITY, |least, &v| least.min(v));
        let mut leaf = values.iter().position(|&v| v == value).unwrap_or(0);
        let mut path = vec![1; side.steps.len()];
        for k in (0..side.steps.len()).rev() {
            if let Some(child) = leaf.checked_div(self.branches[k]) {
                path[k] = child as u8;
                leaf %= self.branches[k];
            } else if side.steps[k].kind == CoordinateKind::Revolute && variant == 1 {
                path[k] = if g[side.steps[k].coordinate] > 0.0 { 2 } else { 0 };
            }
        }
        let value = if value.is_nan() { f64::NEG_INFINITY } else { value };
        Extreme { value, path }
    }
}

/// The value at the one control point `path`, for the cell with coordinate `halved` (if any) halved about its centre.
pub fn value_on_path(
    side: &Side,
    cell: &CellBox,
    r: &Vector3<f64>,
    g: &[f64],
    path: &[u8],
    halved: usize,
) -> f64 {
    let (mut r, mut d) = ([r.x, r.y, r.z], 0.0);
    for (k, step) in side.steps.iter().enumerate() {
        d += r[0] * step.p.x + r[1] * step.p.y + r[2] * step.p.z;
        r = row_times(r, &step.R);
        let j = step.coordinate;
        let half = if j == halved { 0.5 * cell.half(j) } else { cell.half(j) };
        let motion = Motion::new(side, k, cell.center(j), half);
        match step.kind {
            CoordinateKind::Prismatic => {
                let (center, half) = motion.translation;
                d += r[2] * center - (r[2] * half - g[j] * motion.half).abs();
            }
            CoordinateKind::Revolute => {
                let child = usize::from(path[k]);
                let (c, s) = motion.rotations[child];
                r = [r[0] * c + r[1] * s, r[1] * c - r[0] * s, r[2]];
                d += [1.0, 0.0, -1.0][child] * g[j] * motion.half;
            }
        }
    }
    d + r[0] * side.p_tail.x + r[1] * side.p_tail.y + r[2] * side.p_tail.z
        - side.core.support(row_times(r, &side.R_tail))
}
