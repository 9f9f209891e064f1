//! Nearly uniform points of a polyhedron: hit-and-run (Smith 1984).
//!
//! From a point of P a random direction is drawn, and the next point uniformly on the chord of P along it. The
//! ends of the chord lie on the boundary of P and come for free.

use nalgebra::{DMatrix, DVector};
use rand::{Rng, RngExt};

use crate::HPolyhedron;

/// Steps after which the slacks are recomputed, so that rounding cannot pile up.
const REFRESH_AFTER: usize = 64;

/// A walk inside a bounded polyhedron.
#[derive(Debug, Clone)]
pub struct HitAndRun {
    /// Rows of A, row-major [m × n].
    rows: Vec<f64>,
    b: Vec<f64>,
    /// Directions are `shape` times a point of the unit sphere [n × n].
    shape: DMatrix<f64>,
    x: Vec<f64>,
    slack: Vec<f64>,
    direction: Vec<f64>,
    speeds: Vec<f64>,
    n_steps: usize,
}

/// The chord of P through the present point: {x + t·direction : t_min ≤ t ≤ t_max}.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chord {
    /// Lower end, ≤ 0.
    pub t_min: f64,
    /// Upper end, ≥ 0.
    pub t_max: f64,
}

impl HitAndRun {
    /// A walk from `start`, which must lie in `P`. `shape` [n × n] makes directions: an ellipsoid
    /// {C u + d} inside P gives its C, so that thin sets mix as fast as round ones.
    pub fn new(P: &HPolyhedron, start: &DVector<f64>, shape: DMatrix<f64>) -> Self {
        let (m, n) = (P.n_faces(), P.ambient_dimension());
        let mut walk = Self {
            rows: Vec::with_capacity(m * n),
            b: Vec::with_capacity(m),
            shape,
            x: start.iter().copied().collect(),
            slack: Vec::with_capacity(m),
            direction: vec![0.0; n],
            speeds: Vec::with_capacity(m),
            n_steps: 0,
        };
        for i in 0..m {
            walk.push_row(&P.A.row(i).transpose(), P.b[i]);
        }
        walk
    }

    /// The present point.
    pub fn point(&self) -> &[f64] {
        &self.x
    }

    /// The direction of the last step.
    pub fn direction(&self) -> &[f64] {
        &self.direction
    }

    /// Adds the row `a`·x ≤ `b`; the present point must satisfy it, or be moved by [`HitAndRun::restart`].
    pub fn push_row(&mut self, a: &DVector<f64>, b: f64) {
        self.rows.extend(a.iter());
        self.b.push(b);
        self.slack.push(b - a.iter().zip(&self.x).map(|(a, x)| a * x).sum::<f64>());
        self.speeds.push(0.0);
    }

    /// Continues from another point of P.
    pub fn restart(&mut self, x: &[f64]) {
        self.x.copy_from_slice(x);
        self.refresh();
    }

    /// Whether the present point satisfies all rows.
    pub fn is_inside(&self) -> bool {
        self.slack.iter().all(|&s| s >= 0.0)
    }

    fn refresh(&mut self) {
        let n = self.x.len();
        for (i, slack) in self.slack.iter_mut().enumerate() {
            let row = &self.rows[i * n..(i + 1) * n];
            *slack = self.b[i] - row.iter().zip(&self.x).map(|(a, x)| a * x).sum::<f64>();
        }
    }

    /// One step; returns the chord it was drawn from, seen from the new point. If the point lies outside P by rounding, or P is
    /// unbounded along the direction, the point stays and the chord has no length.
    pub fn step(&mut self, rng: &mut impl Rng) -> Chord {
        let n = self.x.len();
        self.n_steps += 1;
        if self.n_steps.is_multiple_of(REFRESH_AFTER) {
            self.refresh();
        }
        let sphere: Vec<f64> = (0..n).map(|_| standard_normal(rng)).collect();
        for j in 0..n {
            self.direction[j] = (0..n).map(|k| self.shape[(j, k)] * sphere[k]).sum();
        }
        let (mut t_min, mut t_max) = (f64::NEG_INFINITY, f64::INFINITY);
        for i in 0..self.b.len() {
            let row = &self.rows[i * n..(i + 1) * n];
            let speed: f64 = row.iter().zip(&self.direction).map(|(a, d)| a * d).sum();
            self.speeds[i] = speed;
            let slack = self.slack[i].max(0.0);
            if speed > 0.0 {
                t_max = t_max.min(slack / speed);
            } else if speed < 0.0 {
                t_min = t_min.max(slack / speed);
            }
        }
        if !(t_min.is_finite() && t_max.is_finite() && t_min < t_max) {
            return Chord { t_min: 0.0, t_max: 0.0 };
        }
        let t = t_min + (t_max - t_min) * rng.random::<f64>();
        for j in 0..n {
            self.x[j] += t * self.direction[j];
        }
        for i in 0..self.b.len() {
            self.slack[i] -= t * self.speeds[i];
        }
        // Seen from the new point.
        Chord { t_min: t_min - t, t_max: t_max - t }
    }
}

/// A standard normal number (Marsaglia's polar method).
fn standard_normal(rng: &mut impl Rng) -> f64 {
    loop {
        let (u, v) = (2.0 * rng.random::<f64>() - 1.0, 2.0 * rng.random::<f64>() - 1.0);
        let s = u * u + v * v;
        if s > 0.0 && s < 1.0 {
            return u * (-2.0 * s.ln() / s).sqrt();
        }
    }
}
