//! How far two placed shapes are apart, and along which direction.

use crate::placement::Placement;
use crate::{box_box, cylinder, general, round};
use kinematics::Support;
use nalgebra::Vector3;
use scene::Shape;

/// A gap up to this, in metres, counts as contact, and contact is not free. It covers the rounding of poses (below
/// 1e-14 for lengths of some metres). Erring side: calls free configurations at contact not free, never the reverse.
pub const TOL_CONTACT: f64 = 1e-12;

/// Two bodies apart from each other along a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Separation {
    /// min n·x over body A minus max n·x over body B, metres; positive if the bodies are apart. Penetration depth
    /// (the smallest found) with a minus sign if they overlap.
    pub gap: f64,
    /// Unit direction n in the world, from body B to body A.
    pub normal: Vector3<f64>,
}

/// A shape where it is.
#[derive(Debug, Clone, Copy)]
pub struct Placed<'a> {
    /// The shape.
    pub shape: &'a Shape,
    /// Pose of its frame in the world.
    pub X: &'a Placement,
}

impl Placed<'_> {
    /// max n·x over the body, n of unit length.
    #[inline]
    pub fn support_value(&self, n: &Vector3<f64>) -> f64 {
        n.dot(&self.X.p) + self.shape.core_support_value(&self.X.R.tr_mul(n)) + self.shape.rounding_radius()
    }

    /// min n·x over the body, n of unit length.
    #[inline]
    pub fn least_value(&self, n: &Vector3<f64>) -> f64 {
        n.dot(&self.X.p) - self.shape.core_support_value(&self.X.R.tr_mul(n)) - self.shape.rounding_radius()
    }
}

/// min n·x over `a` minus max n·x over `b` for the unit direction `n`.
#[inline]
pub fn gap_along(a: Placed<'_>, b: Placed<'_>, n: &Vector3<f64>) -> f64 {
    a.least_value(n) - b.support_value(n)
}

/// A direction in which `a` and `b` are apart, if they are: the gap is positive exactly if they do not touch (up to
/// rounding). It is their distance, except for two boxes, where it is the largest over the directions of their faces
/// and of the products of their edges.
pub fn separation(a: Placed<'_>, b: Placed<'_>) -> Separation {
    let flip = |s: Separation| Separation { gap: s.gap, normal: -s.normal };
    match (a.shape, b.shape) {
        (Shape::Sphere { radius }, _) => round::sphere_separation(&a.X.p, *radius, b),
        (_, Shape::Sphere { radius }) => flip(round::sphere_separation(&b.X.p, *radius, a)),
        (Shape::Box { half_extents: h_a }, Shape::Box { half_extents: h_b }) => {
            box_box::separation(a.X, h_a, b.X, h_b)
        }
        (Shape::Cylinder { .. }, Shape::Cylinder { .. } | Shape::Box { .. }) => {
            cylinder::parallel_separation(a, b).unwrap_or_else(|| general::separation(a, b))
        }
        (Shape::Box { .. }, Shape::Cylinder { .. }) => match cylinder::parallel_separation(b, a) {
            Some(s) => flip(s),
            None => general::separation(a, b),
        },
        _ => general::separation(a, b),
    }
}

/// As [`separation`], but the gap is the distance of `a` and `b`, also for two boxes, if they are apart.
pub fn distance_separation(a: Placed<'_>, b: Placed<'_>) -> Separation {
    let quick = separation(a, b);
    match (a.shape, b.shape) {
        (Shape::Box { .. }, Shape::Box { .. }) if quick.gap > 0.0 => {
            let exact = general::separation(a, b);
            if exact.gap > quick.gap { exact } else { quick }
        }
        _ => quick,
    }
}

/// Whether `a` and `b` are more than `clearance` (plus [`TOL_CONTACT`]) apart; stops at the first proof.
pub fn are_apart(a: Placed<'_>, b: Placed<'_>, clearance: f64) -> bool {
    let needed = clearance + TOL_CONTACT;
    let (core_a, core_b) = (a.shape.bounding_radius(), b.shape.bounding_radius());
    let between = a.X.p - b.X.p;
    let far = core_a + core_b + needed;
    if between.norm_squared() > far * far {
        return true;
    }
    if let (Shape::Box { half_extents: h_a }, Shape::Box { half_extents: h_b }) = (a.shape, b.shape) {
        if box_box::are_apart(a.X, h_a, b.X, h_b, needed) {
            return true;
        }
        return clearance > 0.0 && distance_separation(a, b).gap > needed;
    }
    // A ball around one body against the other body costs little and settles most pairs.
    match (a.shape, b.shape) {
        (Shape::Sphere { radius }, _) => return round::point_distance(&a.X.p, b) > radius + needed,
        (_, Shape::Sphere { radius }) => return round::point_distance(&b.X.p, a) > radius + needed,
        _ => {}
    }
    if round::point_distance(&a.X.p, b) > core_a + needed
        || round::point_distance(&b.X.p, a) > core_b + needed
    {
        return true;
    }
    separation(a, b).gap > needed
}

#[cfg(test)]
mod tests;
