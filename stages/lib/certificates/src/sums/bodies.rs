//! Bodies as hulls of finitely many points plus a ball; see `SosProof` for the order of the points.

use ipc_types::artefact::CoreEnclosure;
use nalgebra::Vector3;
use scene::Shape;
use std::f64::consts::PI;

/// A hull of points and the radius of the ball added to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Points {
    /// In the shape's frame.
    pub points: Vec<Vector3<f64>>,
    /// Radius.
    pub radius: f64,
}

/// The points of `shape` enclosed by `enclosure`; `None` if the two do not go together.
pub fn points(shape: &Shape, enclosure: CoreEnclosure) -> Option<Points> {
    let segment =
        |half_length: f64| vec![Vector3::new(0.0, 0.0, -half_length), Vector3::new(0.0, 0.0, half_length)];
    Some(match (shape, enclosure) {
        (Shape::Box { half_extents: h }, CoreEnclosure::Core) => {
            let signed = |p: usize, axis: usize| if p >> axis & 1 == 1 { h[axis] } else { -h[axis] };
            let points = (0..8).map(|p| Vector3::from_fn(|axis, _| signed(p, axis))).collect();
            Points { points, radius: 0.0 }
        }
        (Shape::Sphere { radius }, CoreEnclosure::Core) => {
            Points { points: vec![Vector3::zeros()], radius: *radius }
        }
        (Shape::Capsule { radius, half_length }, CoreEnclosure::Core)
        | (Shape::Cylinder { radius, half_length }, CoreEnclosure::CylinderInCapsule) => {
            Points { points: segment(*half_length), radius: *radius }
        }
        (Shape::Cylinder { radius, half_length }, CoreEnclosure::CylinderInPrism { n_facets, phase })
            if n_facets >= 3 =>
        {
            let step = PI / f64::from(n_facets);
            let rho = radius / step.cos();
            let mut points = Vec::with_capacity(2 * usize::from(n_facets));
            for z in [-half_length, *half_length] {
                for p in 0..n_facets {
                    let alpha = phase + f64::from(2 * u32::from(p) + 1) * step;
                    points.push(Vector3::new(rho * alpha.cos(), rho * alpha.sin(), z));
                }
            }
            Points { points, radius: 0.0 }
        }
        _ => return None,
    })
}

/// Facets of the prism around a cylinder. Larger: tighter, slower.
const N_FACETS: u16 = 8;
/// Turn of the normal over a region for which the prism is chosen, radians.
const EXPECTED_TURN: f64 = 0.2;

/// The enclosure that loses least where the plane's normal is near `normal_S` (unit, in the shape's frame, towards the
/// other body).
pub fn choose_enclosure(shape: &Shape, normal_S: &Vector3<f64>) -> CoreEnclosure {
    if !matches!(shape, Shape::Cylinder { .. }) {
        return CoreEnclosure::Core;
    }
    // The capsule adds radius · (1 − across); a prism whose facet faces the normal adds nothing there, and radius ·
    // across · tan(π / m) · turn after a turn of the normal.
    let across = normal_S.x.hypot(normal_S.y);
    if 1.0 - across < across * (PI / f64::from(N_FACETS)).tan() * EXPECTED_TURN {
        CoreEnclosure::CylinderInCapsule
    } else {
        CoreEnclosure::CylinderInPrism { n_facets: N_FACETS, phase: normal_S.y.atan2(normal_S.x) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kinematics::Support;
    use proptest::prelude::*;

    proptest! {
        /// The hull of the points, with the ball, reaches at least as far as the body in every direction; and for all
        /// but cylinders no farther.
        #[test]
        fn the_points_enclose_the_body(w in prop::array::uniform3(-1.0..1.0_f64), phase in -3.0..3.0_f64) {
            let w = Vector3::from(w);
            prop_assume!(w.norm() > 1e-3);
            let cylinder = Shape::Cylinder { radius: 0.3, half_length: 0.2 };
            let prism = CoreEnclosure::CylinderInPrism { n_facets: 8, phase };
            let cases = [
                (Shape::Box { half_extents: Vector3::new(0.1, 0.2, 0.3) }, CoreEnclosure::Core),
                (Shape::Sphere { radius: 0.4 }, CoreEnclosure::Core),
                (Shape::Capsule { radius: 0.1, half_length: 0.4 }, CoreEnclosure::Core),
                (cylinder.clone(), CoreEnclosure::CylinderInCapsule),
                (cylinder.clone(), prism),
                (cylinder.clone(), choose_enclosure(&cylinder, &w.normalize())),
            ];
            for (shape, enclosure) in cases {
                let Points { points, radius } = points(&shape, enclosure).expect("they go together");
                let reach = points.iter().map(|p| w.dot(p)).fold(f64::NEG_INFINITY, f64::max) + radius * w.norm();
                prop_assert!(reach >= shape.support_value(&w) - 1e-12);
                if enclosure == CoreEnclosure::Core {
                    prop_assert!(reach <= shape.support_value(&w) + 1e-12);
                }
            }
        }
    }

    #[test]
    fn a_prism_facing_the_normal_adds_nothing_there() {
        let cylinder = Shape::Cylinder { radius: 0.3, half_length: 0.2 };
        let n = Vector3::new(0.6, 0.0, 0.8);
        let enclosure = choose_enclosure(&cylinder, &n);
        assert!(matches!(enclosure, CoreEnclosure::CylinderInPrism { .. }));
        let hull = points(&cylinder, enclosure).expect("they go together");
        let reach = hull.points.iter().map(|p| n.dot(p)).fold(f64::NEG_INFINITY, f64::max);
        assert!((reach - cylinder.support_value(&n)).abs() < 1e-12);
        assert_eq!(choose_enclosure(&cylinder, &Vector3::x()), CoreEnclosure::CylinderInCapsule);
    }

    #[test]
    fn what_does_not_go_together_has_no_points() {
        assert_eq!(points(&Shape::Sphere { radius: 1.0 }, CoreEnclosure::CylinderInCapsule), None);
        let cylinder = Shape::Cylinder { radius: 0.3, half_length: 0.2 };
        assert_eq!(points(&cylinder, CoreEnclosure::Core), None);
        assert_eq!(points(&cylinder, CoreEnclosure::CylinderInPrism { n_facets: 2, phase: 0.0 }), None);
    }
}
