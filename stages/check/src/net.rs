//! The least value over the control points of one side, in plain doubles, with a proven bound of what rounding did.
//!
//! A side is a product of factors: each has one to three affine maps x ↦ A x + b, a joint's control map after which the
//! fixed transform up to the next joint is applied. Rows are pushed outwards: r ← r A, d ← d + r·b + c, c = −g_j h_j i_j;
//! the value of a choice of maps is d − σ(r), σ the support function of the core. All choices are made, so there are
//! 3^k values; there is no other search.
//!
//! **The bound.** Let u = 2^-53, n the normal, k the number of factors, and for each factor: s ≥ 1 with ‖A‖ ≤ s for its
//! true maps (a rotation stretched by 1/cos h), ε the largest difference of an entry of A or b from the double that is
//! used for it, known from an evaluation in intervals, ℓ the largest ‖b‖ as used. Let N = ‖n‖ Π s, which bounds every row;
//! η = 4 ε + 10 u with the largest ε; L = Σ ℓ + the core's extent; G = Σ |g_j| h_j. Then
//!
//! - a row's step errs by at most ‖r‖ (‖δA‖_F + γ_3 ‖A‖_F) ≤ ‖r‖ s η, with ‖δA‖_F ≤ 3 ε and ‖A‖_F ≤ √3 s + 3 ε, so after j
//!   steps the row is within N ((1 + η)^j − 1) ≤ 1.01 j η N of the true one, as long as j η ≤ 0.01;
//! - thus all r·b together err by at most 1.01 k η N L + k √3 ε N, for a wrong row and a wrong b, and σ(r) is part of that;
//! - every number on the way to a value is at most 1.01 (N L + G) in magnitude, so each of the 8 roundings of a step and
//!   the at most 8 of the support function (a root included) adds at most 1.02 u (N L + G).
//!
//! Together that is less than 2 (k + 1) η (N (L + 1) + G), for k ≤ 100; it is taken 1 % larger for its own rounding.
//! Where a joint does not turn the one row there is (n along its axis: rows of its maps within η/2 ‖r‖), one row stands
//! for all; that is one more step of error, so k counts it twice.

use crate::body;
use crate::chain::{Side, Step};
use crate::interval::{self, IDENTITY, Interval, Mat3, Vec3};
use crate::swept::{Extent, MAX_HALF_ANGLE, rotation, sine_excess};
use scene::Shape;
use std::collections::HashMap;
use std::rc::Rc;

/// Half the distance from 1 to the next double.
const UNIT_ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// x ↦ A x + b as doubles.
#[derive(Debug, Clone, Copy)]
struct Affine {
    A: [[f64; 3]; 3],
    b: [f64; 3],
}

/// The control maps of one joint on a range, each followed by the fixed transform behind the joint.
#[derive(Debug)]
struct Factor {
    maps: Vec<Affine>,
    /// Half-width h of the joint's range, 0 without a joint.
    half: f64,
    /// Upper bound e(h) of what δ and its control values differ by.
    excess: f64,
    /// Upper bound of ‖A‖.
    stretch: f64,
    /// Upper bound of the difference of an entry from the true one.
    epsilon: f64,
    /// Largest ‖b‖.
    length: f64,
}

impl Factor {
    /// `None` for an angle that is too wide.
    fn new(motion: Option<&Step>, R: &Mat3, p: &Vec3, lower: f64, upper: f64) -> Option<Self> {
        let extent = Extent::new(&[lower], &[upper]);
        let [m, h] = [extent.center[0], extent.half[0]].map(Interval::point);
        let (mut stretch, mut excess) = (Interval::ONE, 0.0);
        let maps: Vec<(Mat3, Vec3)> = match motion {
            None | Some(Step::Fixed { .. }) => vec![(*R, *p)],
            Some(Step::Slide { axis, sign, .. }) => [m - h, m + h]
                .map(|q| (*R, std::array::from_fn(|i| axis[i] * Interval::point(*sign) * q + p[i])))
                .to_vec(),
            Some(Step::Turn { axis, sign, .. }) => {
                if !(h.hi() <= MAX_HALF_ANGLE) {
                    return None;
                }
                stretch = h.sin_cos().1.recip();
                excess = sine_excess(h.hi());
                [(m - h, Interval::ONE), (m, stretch), (m + h, Interval::ONE)]
                    .map(|(angle, stretch)| {
                        let (s, c) = (Interval::point(*sign) * angle).sin_cos();
                        let M = rotation(axis, s, c, stretch);
                        (interval::times(&M, R), interval::times_vec(&M, p))
                    })
                    .to_vec()
            }
        };
        let mut epsilon: f64 = 0.0;
        let mut middle = |x: Interval| {
            let middle = 0.5 * x.lo() + 0.5 * x.hi();
            epsilon = epsilon.max((x - Interval::point(middle)).magnitude());
            middle
        };
        let maps: Vec<Affine> = maps
            .iter()
            .map(|(A, b)| Affine { A: A.map(|row| row.map(&mut middle)), b: b.map(&mut middle) })
            .collect();
        let length = |b: &[f64; 3]| interval::norm(&b.map(Interval::point)).hi();
        let length = maps.iter().map(|map| length(&map.b)).fold(0.0, f64::max);
        Some(Self { maps, half: h.hi(), excess, stretch: stretch.hi(), epsilon, length })
    }

    /// Each map with its c for the coefficient g.
    fn with_offsets(&self, g: f64) -> impl Iterator<Item = (&Affine, f64)> {
        let signs: &[f64] = match self.maps.len() {
            1 => &[0.0],
            2 => &[1.0, -1.0],
            _ => &[1.0, 0.0, -1.0],
        };
        self.maps.iter().zip(signs).map(move |(map, sign)| (map, g * self.half * sign))
    }
}

/// Rows and offsets, by component.
#[derive(Debug, Default)]
struct Rows {
    r: [Vec<f64>; 3],
    d: Vec<f64>,
}

impl Rows {
    fn clear(&mut self) {
        self.r.iter_mut().for_each(Vec::clear);
        self.d.clear();
    }

    fn all(&self) -> impl Iterator<Item = ([f64; 3], f64)> {
        let [x, y, z] = &self.r;
        x.iter().zip(y).zip(z).zip(&self.d).map(|(((x, y), z), d)| ([*x, *y, *z], *d))
    }

    /// Adds the children of `parents` by one map.
    fn push(&mut self, parents: &Rows, map: &Affine, c: f64) {
        for (i, children) in self.r.iter_mut().enumerate() {
            children.extend(parents.all().map(|(r, _)| map.component(&r, i)));
        }
        self.d.extend(parents.all().map(|(r, d)| map.offset(&r) + (d + c)));
    }

    /// Whether no row differs from the first by more than `tolerance`.
    fn is_one_row(&self, tolerance: f64) -> bool {
        let differs = |x: &Vec<f64>, i: usize| (x[i] - x[0]).abs();
        (1..self.d.len()).all(|i| self.r.iter().map(|x| differs(x, i)).sum::<f64>() <= tolerance)
    }

    /// The first row for all, with the least offset.
    fn keep_least(&mut self) {
        self.d[0] = self.d.iter().copied().fold(f64::INFINITY, f64::min);
        self.d.truncate(1);
        self.r.iter_mut().for_each(|x| x.truncate(1));
    }

    /// The least value of the children by one map, for the core with this support function; `values` is a buffer.
    fn least(&self, map: &Affine, c: f64, values: &mut Vec<f64>, support: impl Fn([f64; 3]) -> f64) -> f64 {
        values.clear();
        let row = |r: &[f64; 3]| [0, 1, 2].map(|i| map.component(r, i));
        values.extend(self.all().map(|(r, d)| map.offset(&r) + (d + c) - support(row(&r))));
        values.iter().copied().fold(f64::INFINITY, f64::min)
    }
}

impl Affine {
    #[inline(always)]
    fn component(&self, r: &[f64; 3], i: usize) -> f64 {
        r[0] * self.A[0][i] + r[1] * self.A[1][i] + r[2] * self.A[2][i]
    }

    #[inline(always)]
    fn offset(&self, r: &[f64; 3]) -> f64 {
        r[0] * self.b[0] + r[1] * self.b[1] + r[2] * self.b[2]
    }
}

/// One side of a pair: what its factors are made of, and those that have been made.
pub struct Net {
    /// Joint (none in front of the first one's) and the transform behind it.
    parts: Vec<(Option<Step>, Mat3, Vec3)>,
    made: Vec<HashMap<[u64; 2], Option<Rc<Factor>>>>,
    /// Those of the present cell, each with its coordinate.
    factors: Vec<(Rc<Factor>, Option<usize>)>,
    shape: Shape,
    extent: f64,
    /// Upper bound of the radius around the core.
    radius: Interval,
    rows: [Rows; 2],
}

/// Most values of a net: 15 joints that turn on one side of a frame.
const MAX_VALUES: usize = 14_348_907;

impl Net {
    /// For `shape` at the end of `side`.
    pub fn new(side: &Side, shape: &Shape) -> Self {
        let nothing = [Interval::ZERO; 3];
        let mut parts = vec![(None, IDENTITY, nothing)];
        for step in &side.steps {
            match (step, parts.last_mut()) {
                // Neighbouring transforms are one already, so this is the first behind its joint.
                (Step::Fixed { R, p }, Some(last)) => (last.1, last.2) = (*R, *p),
                _ => parts.push((Some(step.clone()), IDENTITY, nothing)),
            }
        }
        let made = vec![HashMap::new(); parts.len()];
        let radius = Interval::point(body::rounding_radius(shape)) + Interval::point(side.inflation);
        let extent = body::core_extent(shape);
        Self {
            parts,
            made,
            factors: Vec::new(),
            shape: shape.clone(),
            extent,
            radius,
            rows: Default::default(),
        }
    }

    /// Makes the factors on the cell [lower, upper], or finds them; `None` if an angle is too wide.
    fn take_factors(&mut self, lower: &[f64], upper: &[f64]) -> Option<()> {
        self.factors.clear();
        for ((motion, R, p), made) in self.parts.iter().zip(&mut self.made) {
            let coordinate = motion.as_ref().and_then(Step::coordinate);
            let [low, high] = coordinate.map_or([0.0; 2], |j| [lower[j], upper[j]]);
            let factor = made
                .entry([low.to_bits(), high.to_bits()])
                .or_insert_with(|| Factor::new(motion.as_ref(), R, p, low, high).map(Rc::new));
            self.factors.push((factor.clone()?, coordinate));
        }
        Some(())
    }

    /// Lower bound of `n·x − g·δ` over the body, radius included, and the cell. `None` where an angle
    /// is too wide, or the bound of rounding says nothing.
    pub fn least(&mut self, lower: &[f64], upper: &[f64], n: [f64; 3], g: &[f64]) -> Option<Interval> {
        let (value, bound) = self.core_least(lower, upper, n, g)?;
        let mut least = Interval::point(value) - Interval::point(bound);
        least = least - interval::norm(&n.map(Interval::point)) * self.radius;
        for (factor, coordinate) in &self.factors {
            let g_j = Interval::point(coordinate.map_or(0.0, |j| g[j].abs()));
            least = least - g_j * Interval::point(factor.excess);
        }
        Some(least)
    }

    /// The least `r·x − Σ g_j h_j i_j` over the control points of the core, as doubles have it, and the bound of its error.
    fn core_least(&mut self, lower: &[f64], upper: &[f64], n: [f64; 3], g: &[f64]) -> Option<(f64, f64)> {
        self.take_factors(lower, upper)?;
        let factors = &self.factors;
        let length = interval::norm(&n.map(Interval::point));
        let g_of = |coordinate: &Option<usize>| coordinate.map_or(0.0, |j| g[j]);
        let (mut epsilon, mut N, mut L, mut G): (f64, _, _, _) = (0.0, length.hi(), self.extent, 0.0);
        let (mut k, mut n_values) = (factors.len(), 1_usize);
        for (factor, coordinate) in factors {
            let g_j = g_of(coordinate).abs();
            epsilon = epsilon.max(factor.epsilon);
            N *= factor.stretch;
            L += factor.length;
            G += g_j * factor.half;
            n_values = n_values.saturating_mul(factor.maps.len());
        }
        if n_values > MAX_VALUES {
            return None;
        }
        let eta = 4.0 * epsilon + 10.0 * UNIT_ROUNDOFF;
        let (last, before) = factors.split_last()?;
        let [parents, children] = &mut self.rows;
        parents.clear();
        (0..3).for_each(|i| parents.r[i].push(n[i]));
        parents.d.push(0.0);
        for (factor, coordinate) in before {
            children.clear();
            for (map, c) in factor.with_offsets(g_of(coordinate)) {
                children.push(parents, map, c);
            }
            if factor.maps.len() > 1 && parents.d.len() == 1 && children.is_one_row(0.5 * eta * length.lo()) {
                children.keep_least();
                k += 1;
            }
            std::mem::swap(parents, children);
        }
        let bound = 1.01 * (2.0 * (k as f64 + 1.0) * eta * (N * (L + 1.0) + G));
        // A bound that is not a number is refused too.
        if !(k <= 100 && k as f64 * eta <= 0.01 && bound <= 1.0) {
            return None;
        }
        let values = &mut children.d;
        let mut least = f64::INFINITY;
        for (map, c) in last.0.with_offsets(g_of(&last.1)) {
            least = least.min(match &self.shape {
                Shape::Sphere { .. } => parents.least(map, c, values, |_| 0.0),
                Shape::Capsule { half_length: l, .. } => parents.least(map, c, values, |r| l * r[2].abs()),
                Shape::Box { half_extents: e } => {
                    parents.least(map, c, values, |r| e.x * r[0].abs() + e.y * r[1].abs() + e.z * r[2].abs())
                }
                Shape::Cylinder { radius, half_length: l } => parents
                    .least(map, c, values, |r| radius * (r[0] * r[0] + r[1] * r[1]).sqrt() + l * r[2].abs()),
            });
        }
        Some((least, bound))
    }
}

#[cfg(test)]
mod tests;
