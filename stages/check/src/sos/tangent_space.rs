//! What holds on the image of the region in TC-space: bounds of the variables, and rows c·s ≤ d.

use crate::interval::Interval;
use ipc_types::artefact::{SosJoint, SosRow, SweptRow};
use scene::{CoordinateKind, Scene};

/// Largest angle of a joint from its centre; below π.
const MAX_ANGLE: f64 = 3.1;

/// The box of joint limits, the kinds of joints, and the rows that hold on the region.
#[derive(Debug, Clone, Copy)]
pub struct Ground<'a> {
    /// Scene.
    pub scene: &'a Scene,
    /// `RegionCertificate::rows`.
    pub rows: &'a [SweptRow],
    /// Lower joint limits.
    pub lower: &'a [f64],
    /// Upper joint limits.
    pub upper: &'a [f64],
}

/// Σ μ_r a_r and Σ μ_r b_r; `None` for a row that does not exist or a multiplier that is negative or not finite.
fn combination(ground: &Ground<'_>, multipliers: &[(u32, f64)]) -> Option<(Vec<Interval>, Interval)> {
    let mut a = vec![Interval::ZERO; ground.lower.len()];
    let mut b = Interval::ZERO;
    for &(row_idx, mu) in multipliers {
        let row = ground.rows.get(row_idx as usize).filter(|row| row.a.len() == a.len())?;
        if !(mu >= 0.0 && mu.is_finite()) {
            return None;
        }
        let mu = Interval::point(mu);
        for (a, &coefficient) in a.iter_mut().zip(&row.a) {
            *a = *a + mu * Interval::point(coefficient);
        }
        b = b + mu * Interval::point(row.b);
    }
    Some((a, b))
}

fn limits(ground: &Ground<'_>, j: usize) -> Interval {
    Interval::hull(ground.lower[j], ground.upper[j])
}

/// Whether l ≤ q_j ≤ u on the region, and −1 ≤ s ≤ 1 there.
pub fn joint_holds(ground: &Ground<'_>, joint: &SosJoint) -> bool {
    let j = usize::from(joint.coordinate);
    if j >= ground.lower.len() || !(joint.lower < joint.upper && joint.scale > 0.0) {
        return false;
    }
    // ±q_j − bound ≤ Σ μ (a·q − b) on the box of joint limits.
    let holds = |sign: f64, bound: f64, multipliers: &[(u32, f64)]| {
        let Some((mut a, b)) = combination(ground, multipliers) else { return false };
        a[j] = a[j] - Interval::point(sign);
        let least =
            a.iter().enumerate().fold(Interval::point(bound) - b, |sum, (i, a)| sum + *a * limits(ground, i));
        least.lo() >= 0.0
    };
    let limit_holds = |sign: f64, bound: f64, multipliers: &[(u32, f64)]| {
        // The joint limit itself needs no multipliers, and no rounding.
        let within = if sign > 0.0 { ground.upper[j] <= bound } else { -ground.lower[j] <= bound };
        within || holds(sign, bound, multipliers)
    };
    if !limit_holds(1.0, joint.upper, &joint.upper_multipliers)
        || !limit_holds(-1.0, -joint.lower, &joint.lower_multipliers)
    {
        return false;
    }
    let center = Interval::point(joint.center);
    [Interval::point(joint.upper) - center, center - Interval::point(joint.lower)].iter().all(|&reach| {
        let size = match ground.scene.coordinates[j].kind {
            CoordinateKind::Revolute => tangent_of_half(reach),
            CoordinateKind::Prismatic => Some(reach),
        };
        size.is_some_and(|size| size.hi() <= joint.scale)
    })
}

/// tan(δ/2) for |δ| ≤ [`MAX_ANGLE`].
fn tangent_of_half(delta: Interval) -> Option<Interval> {
    if !(delta.magnitude() <= MAX_ANGLE) {
        return None;
    }
    // The function rises: the ends of the interval bound it.
    let at = |x: f64| {
        let (s, c) = (Interval::point(x) * Interval::point(0.5)).sin_cos();
        s * c.recip()
    };
    Some(Interval::hull(at(delta.lo()).lo(), at(delta.hi()).hi()))
}

/// Whether `row` holds on the image of the region.
pub fn row_holds(ground: &Ground<'_>, joints: &[SosJoint], row: &SosRow) -> bool {
    let Some((a, b)) = combination(ground, &row.multipliers) else { return false };
    if row.c.len() != joints.len() {
        return false;
    }
    let mut bound = b;
    for j in 0..a.len() {
        let least = match joints.iter().position(|joint| usize::from(joint.coordinate) == j) {
            None => (a[j] * limits(ground, j)).lo(),
            Some(i) => match ground.scene.coordinates[j].kind {
                CoordinateKind::Prismatic => least_of_line(a[j], row.c[i], &joints[i]),
                CoordinateKind::Revolute => least_of_tangent(a[j], row.c[i], &joints[i]),
            },
        };
        bound = bound - Interval::point(least);
    }
    bound.hi() <= row.d
}

/// Lower bound of a q − c (q − q*)/T on [l, u].
fn least_of_line(a: Interval, c: f64, joint: &SosJoint) -> f64 {
    let slope = Interval::point(c) * Interval::point(joint.scale).recip();
    let q = Interval::hull(joint.lower, joint.upper);
    ((a - slope) * q + slope * Interval::point(joint.center)).lo()
}

/// Lower bound of a q − c tan((q − q*)/2)/T on [l, u]: where c δ ≥ 0 the function is concave, least at an end;
/// where c δ ≤ 0 it is convex, above each of its tangents.
fn least_of_tangent(a: Interval, c: f64, joint: &SosJoint) -> f64 {
    let center = Interval::point(joint.center);
    let slope = Interval::point(c) * Interval::point(joint.scale).recip();
    let value =
        |delta: Interval| tangent_of_half(delta).map_or(f64::NEG_INFINITY, |t| (a * delta - slope * t).lo());
    let (low, high) =
        ((Interval::point(joint.lower) - center).lo(), (Interval::point(joint.upper) - center).hi());
    let mut least = f64::INFINITY;
    for (from, to) in [(low, high.min(0.0)), (low.max(0.0), high)] {
        if from > to {
            continue;
        }
        let is_concave = if c >= 0.0 { from >= 0.0 } else { to <= 0.0 };
        let of_piece = if is_concave {
            value(Interval::point(from)).min(value(Interval::point(to)))
        } else {
            above_tangent(a, slope, from, to).unwrap_or(f64::NEG_INFINITY)
        };
        least = least.min(of_piece);
    }
    (Interval::point(least) + a * center).lo()
}

/// Lower bound of a δ − k tan(δ/2), convex on [from, to], by its tangent near the least value.
fn above_tangent(a: Interval, k: Interval, from: f64, to: f64) -> Option<f64> {
    // a = k (1 + t²)/2 where the slope vanishes; the choice needs no care, any point does.
    let square = (a.lo() + a.hi()) / (0.5 * (k.lo() + k.hi())) - 1.0;
    let turn = if square > 0.0 { 2.0 * square.sqrt().atan() } else { 0.0 };
    let wanted = if to <= 0.0 { -turn } else { turn };
    let at = if wanted.is_finite() { wanted.clamp(from, to) } else { from };
    let t = tangent_of_half(Interval::point(at))?;
    let value = a * Interval::point(at) - k * t;
    let slope = a - k * (Interval::ONE + t.square()) * Interval::point(0.5);
    let ends = Interval::hull(
        (Interval::point(from) - Interval::point(at)).lo(),
        (Interval::point(to) - Interval::point(at)).hi(),
    );
    Some((value + slope * ends).lo())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// The bound is below the function, and near its least value.
        #[test]
        fn least_of_tangent_is_the_least(a in -3.0f64..3.0, c in -3.0f64..3.0, center in -1.0f64..1.0,
                                         lower in -1.2f64..0.4, width in 0.01f64..1.5, scale in 0.3f64..2.0) {
            let joint = SosJoint { coordinate: 0, center, scale, lower: center + lower, upper: center + lower + width,
                                   lower_multipliers: vec![], upper_multipliers: vec![] };
            let bound = least_of_tangent(Interval::point(a), c, &joint);
            let least = (0..=2000)
                .map(|k| joint.lower + width * f64::from(k) / 2000.0)
                .map(|q| a * q - c * f64::tan((q - center) / 2.0) / scale)
                .fold(f64::INFINITY, f64::min);
            prop_assert!(bound <= least + 1e-12, "{bound} above {least}");
            prop_assert!(bound >= least - 1e-4, "{bound} far below {least}");
        }
    }
}
