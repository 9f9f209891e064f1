//! All other pairs of shapes, by parry's GJK (distance) and EPA (penetration) on the cores.
//!
//! Parry only proposes a direction; the gap along it is evaluated afresh by support functions, so a positive gap is
//! never more than the distance, up to rounding, whatever parry's tolerances. On curved bodies its direction is good to
//! about 1e-4, so the gap falls short of the distance by up to about 1e-7 of it.

use crate::separation::{Placed, Separation, gap_along};
use kinematics::Support;
use nalgebra::{Point3, Vector3};
use parry3d_f64::query::details::contact_support_map_support_map;
use parry3d_f64::shape::SupportMap;
use scene::Shape;

/// The core of a shape, for parry.
struct Core<'a>(&'a Shape);

impl SupportMap for Core<'_> {
    fn local_support_point(&self, direction: &Vector3<f64>) -> Point3<f64> {
        self.0.core_support_point(direction).into()
    }
}

/// Distance and direction of `a` and `b`; if they overlap, EPA's penetration with a minus sign.
pub fn separation(a: Placed<'_>, b: Placed<'_>) -> Separation {
    let X_AB = a.X.to_isometry().inv_mul(&b.X.to_isometry());
    let contact = contact_support_map_support_map(&X_AB, &Core(a.shape), &Core(b.shape), f64::MAX);
    let proposed = contact.map(|contact| -(a.X.R * contact.normal1.into_inner()));
    let centers = (a.X.p - b.X.p).try_normalize(0.0);
    let axes = [a.X.R.column(2), b.X.R.column(2)].map(|axis| {
        let axis: Vector3<f64> = axis.into();
        axis * 1.0_f64.copysign(axis.dot(&(a.X.p - b.X.p)))
    });
    let mut best = Separation { gap: f64::NEG_INFINITY, normal: Vector3::z() };
    // The others matter only where parry gives up or its direction is worn out by rounding near contact.
    for normal in proposed.into_iter().chain(centers).chain(axes) {
        if let Some(normal) = normal.try_normalize(0.5) {
            let gap = gap_along(a, b, &normal);
            if gap > best.gap {
                best = Separation { gap, normal };
            }
        }
    }
    best
}
