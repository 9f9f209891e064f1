//! Points whose hull contains the core of a body, and the radius that goes with them.

use crate::body;
use crate::interval::{Interval, Vec3};
use ipc_types::artefact::CoreEnclosure;
use scene::Shape;

/// Points in the shape's frame, in the order of the artefact's definition, and the radius to add; `None` for a shape
/// and an enclosure that do not go together.
pub fn enclose(shape: &Shape, enclosure: &CoreEnclosure) -> Option<(Vec<Vec3>, f64)> {
    let point = |x: f64, y: f64, z: f64| [x, y, z].map(Interval::point);
    let on_axis = |h: f64| vec![point(0.0, 0.0, -h), point(0.0, 0.0, h)];
    let points = match (shape, enclosure) {
        (Shape::Box { half_extents: h }, CoreEnclosure::Core) => (0..8)
            .map(|p| {
                let sign = |bit: usize| if p >> bit & 1 == 1 { 1.0 } else { -1.0 };
                point(sign(0) * h.x, sign(1) * h.y, sign(2) * h.z)
            })
            .collect(),
        (Shape::Sphere { .. }, CoreEnclosure::Core) => vec![point(0.0, 0.0, 0.0)],
        (Shape::Capsule { half_length, .. }, CoreEnclosure::Core) => on_axis(*half_length),
        (Shape::Cylinder { radius, half_length }, CoreEnclosure::CylinderInCapsule) => {
            return Some((on_axis(*half_length), *radius));
        }
        (Shape::Cylinder { radius, half_length }, CoreEnclosure::CylinderInPrism { n_facets, phase }) => {
            prism(*radius, *half_length, *n_facets, *phase)?
        }
        _ => return None,
    };
    Some((points, body::rounding_radius(shape)))
}

/// Corners of the regular prism whose facets touch the cylinder.
fn prism(radius: f64, half_length: f64, n_facets: u16, phase: f64) -> Option<Vec<Vec3>> {
    // π lies between this double and the next.
    let pi = Interval::hull(std::f64::consts::PI, std::f64::consts::PI.next_up());
    if n_facets < 3 || !(phase.abs() <= 8.0) {
        return None;
    }
    let step = pi * Interval::point(f64::from(n_facets)).recip();
    let (_, cos_step) = step.sin_cos();
    let rho = Interval::point(radius) * cos_step.recip();
    let ring: Vec<[Interval; 2]> = (0..n_facets)
        .map(|p| {
            let angle = Interval::point(phase) + Interval::point(f64::from(2 * u32::from(p) + 1)) * step;
            let (s, c) = angle.sin_cos();
            [rho * c, rho * s]
        })
        .collect();
    let at = |z: f64| ring.iter().map(move |xy| [xy[0], xy[1], Interval::point(z)]);
    Some(at(-half_length).chain(at(half_length)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The prism's support is never below the cylinder's.
    #[test]
    fn prism_contains_its_cylinder() {
        let shape = Shape::Cylinder { radius: 0.3, half_length: 0.2 };
        for n_facets in [3, 4, 7, 16] {
            let enclosure = CoreEnclosure::CylinderInPrism { n_facets, phase: 0.4 };
            let (points, radius) = enclose(&shape, &enclosure).expect("a cylinder in a prism");
            assert_eq!((points.len(), radius), (2 * usize::from(n_facets), 0.0));
            for k in 0..1000 {
                let angle = 0.00628 * f64::from(k);
                let support = points
                    .iter()
                    .map(|p| p[0].hi() * angle.cos() + p[1].hi() * angle.sin())
                    .fold(0.0, f64::max);
                assert!(support >= 0.3 - 1e-12, "{n_facets} facets, angle {angle}: {support}");
            }
        }
    }

    #[test]
    fn combinations_that_do_not_exist() {
        let sphere = Shape::Sphere { radius: 0.1 };
        let cylinder = Shape::Cylinder { radius: 0.1, half_length: 0.1 };
        assert!(enclose(&sphere, &CoreEnclosure::CylinderInCapsule).is_none());
        assert!(enclose(&cylinder, &CoreEnclosure::Core).is_none());
        assert!(enclose(&cylinder, &CoreEnclosure::CylinderInPrism { n_facets: 2, phase: 0.0 }).is_none());
    }
}
