use super::*;
use nalgebra::{Isometry3, Translation3, UnitQuaternion};
use proptest::prelude::*;

fn placement(p: [f64; 3], turn: [f64; 3]) -> Placement {
    Placement::from(&Isometry3::from_parts(
        Translation3::from(p),
        UnitQuaternion::from_scaled_axis(Vector3::from(turn)),
    ))
}

fn shape(kind: usize, size: [f64; 3]) -> Shape {
    let [x, y, z] = size;
    match kind {
        0 => Shape::Box { half_extents: Vector3::new(x, y, z) },
        1 => Shape::Cylinder { radius: x, half_length: y },
        2 => Shape::Sphere { radius: x },
        _ => Shape::Capsule { radius: x, half_length: y },
    }
}

/// Nearest point of the body, by the definition of the shape.
fn project(point: &Vector3<f64>, body: Placed<'_>) -> Vector3<f64> {
    let x = body.X.R.tr_mul(&(point - body.X.p));
    let into_ball = |x: Vector3<f64>, radius: f64| x * (radius / x.norm()).min(1.0);
    let nearest = match body.shape {
        Shape::Box { half_extents: h } => x.zip_map(h, |x, h| x.clamp(-h, h)),
        Shape::Cylinder { radius, half_length } => {
            let disc = into_ball(Vector3::new(x.x, x.y, 0.0), *radius);
            Vector3::new(disc.x, disc.y, x.z.clamp(-half_length, *half_length))
        }
        Shape::Sphere { radius } => into_ball(x, *radius),
        Shape::Capsule { radius, half_length } => {
            let on_segment = Vector3::new(0.0, 0.0, x.z.clamp(-half_length, *half_length));
            on_segment + into_ball(x - on_segment, *radius)
        }
    };
    body.X.transform(&nearest)
}

/// Distance from above, by alternating projections (von Neumann): independent of separating directions and of parry.
fn alternating_distance(a: Placed<'_>, b: Placed<'_>) -> f64 {
    let mut x = a.X.p;
    let mut distance = f64::INFINITY;
    for _ in 0..3000 {
        let y = project(&x, b);
        x = project(&y, a);
        distance = (x - y).norm();
    }
    distance
}

#[test]
fn known_distances() {
    let cube = Shape::Box { half_extents: Vector3::repeat(1.0) };
    let cylinder = Shape::Cylinder { radius: 1.0, half_length: 2.0 };
    let ball = Shape::Sphere { radius: 0.5 };
    let rod = Shape::Capsule { radius: 0.5, half_length: 1.0 };
    let quarter = std::f64::consts::FRAC_PI_4;
    let cases = [
        // Corner to corner along the diagonal.
        (&cube, &cube, [3.0, 3.0, 3.0], [0.0; 3], 3.0_f64.sqrt()),
        (&cube, &cube, [2.5, 0.3, 0.0], [0.0; 3], 0.5),
        // An edge towards a face.
        (&cube, &cube, [1.0 + 2.0_f64.sqrt() + 0.25, 0.0, 0.0], [0.0, 0.0, quarter], 0.25),
        (&cylinder, &cylinder, [3.0, 0.0, 7.0], [0.0; 3], 10.0_f64.sqrt()),
        (&cylinder, &cylinder, [0.0, 0.0, 4.5], [0.0; 3], 0.5),
        (&cylinder, &cube, [2.0, 2.0, 0.0], [0.0; 3], 1.0 / 2.0_f64.sqrt() * 2.0 - 1.0),
        (&ball, &cube, [2.0, 2.0, 0.0], [0.0; 3], 2.0_f64.sqrt() - 0.5),
        (&ball, &cylinder, [2.0, 0.0, 3.0], [0.0; 3], 2.0_f64.sqrt() - 0.5),
        (&rod, &rod, [0.0, 2.0, 0.0], [0.0, 2.0 * quarter, 0.0], 1.0),
        (&rod, &cube, [0.0, 0.0, 3.0], [0.0; 3], 0.5),
    ];
    for (shape_a, shape_b, p, turn, expected) in cases {
        let (X_a, X_b) = (Placement::identity(), placement(p, turn));
        let (a, b) = (Placed { shape: shape_a, X: &X_a }, Placed { shape: shape_b, X: &X_b });
        for (a, b) in [(a, b), (b, a)] {
            let s = distance_separation(a, b);
            assert!(
                (s.gap - expected).abs() < 1e-9,
                "{shape_a:?} {shape_b:?} {p:?}: {s:?}, expected {expected}"
            );
            assert!(are_apart(a, b, 0.0) && are_apart(a, b, expected - 1e-8));
            assert!(!are_apart(a, b, expected + 1e-8));
        }
    }
}

#[test]
fn known_penetrations() {
    let cube = Shape::Box { half_extents: Vector3::repeat(1.0) };
    let cylinder = Shape::Cylinder { radius: 1.0, half_length: 2.0 };
    let ball = Shape::Sphere { radius: 0.5 };
    let cases = [
        (&cube, &cube, [1.75, 0.0, 0.0], -0.25),
        (&cylinder, &cylinder, [0.5, 0.0, 3.9], -0.1),
        (&cylinder, &cube, [1.9, 0.0, 0.0], -0.1),
        (&ball, &cube, [1.25, 0.0, 0.0], -0.25),
        (&ball, &cube, [0.0, 0.75, 0.0], -0.75),
        (&ball, &ball, [0.0, 0.0, 0.0], -1.0),
        (&cube, &cube, [0.0, 0.0, 0.0], -2.0),
    ];
    for (shape_a, shape_b, p, expected) in cases {
        let (X_a, X_b) = (Placement::identity(), placement(p, [0.0; 3]));
        let (a, b) = (Placed { shape: shape_a, X: &X_a }, Placed { shape: shape_b, X: &X_b });
        let s = distance_separation(a, b);
        assert!((s.gap - expected).abs() < 1e-9, "{shape_a:?} {shape_b:?} {p:?}: {s:?}");
        assert!(!are_apart(a, b, 0.0));
    }
}

/// At exact contact, and within the tolerance of it, bodies are not apart; just beyond they are.
#[test]
fn contact_is_not_apart() {
    let cube = Shape::Box { half_extents: Vector3::repeat(1.0) };
    let cylinder = Shape::Cylinder { radius: 1.0, half_length: 1.0 };
    let ball = Shape::Sphere { radius: 1.0 };
    for shape_a in [&cube, &cylinder, &ball] {
        for shape_b in [&cube, &cylinder, &ball] {
            let apart = |x: f64| {
                let (X_a, X_b) = (Placement::identity(), placement([x, 0.0, 0.0], [0.0; 3]));
                are_apart(Placed { shape: shape_a, X: &X_a }, Placed { shape: shape_b, X: &X_b }, 0.0)
            };
            assert!(!apart(2.0) && !apart(2.0 + 0.5 * TOL_CONTACT) && !apart(2.0 - 1e-9));
            assert!(apart(2.0 + 1e-11), "{shape_a:?} {shape_b:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    /// Every pair of shapes: the gap is taken along the normal, agrees with the distance found by projections, and the
    /// quick test agrees with it at clearances on both sides.
    #[test]
    fn separation_agrees_with_projections(
        kind_a in 0..4_usize, kind_b in 0..4_usize,
        size_a in prop::array::uniform3(0.05..1.0_f64), size_b in prop::array::uniform3(0.05..1.0_f64),
        p in prop::array::uniform3(-2.0..2.0_f64),
        turn_a in prop::array::uniform3(-2.0..2.0_f64), turn_b in prop::array::uniform3(-2.0..2.0_f64),
        parallel in any::<bool>(),
    ) {
        let (shape_a, shape_b) = (shape(kind_a, size_a), shape(kind_b, size_b));
        let X_a = placement([0.0; 3], turn_a);
        // The same turn but for one about z: parallel axes, as in the closed forms.
        let X_b = if parallel {
            let turned = placement([0.0; 3], [0.0, 0.0, turn_b[2]]);
            Placement { R: X_a.R * turned.R, p: Vector3::from(p) }
        } else {
            placement(p, turn_b)
        };
        let (a, b) = (Placed { shape: &shape_a, X: &X_a }, Placed { shape: &shape_b, X: &X_b });
        let s = separation(a, b);
        let exact = distance_separation(a, b);
        prop_assert!((s.normal.norm() - 1.0).abs() < 1e-9);
        // Near contact the directions of a distance are ill-defined; elsewhere the gap is that along the normal.
        if s.gap > 1e-6 {
            prop_assert!((gap_along(a, b, &s.normal) - s.gap).abs() < 1e-7, "{:?} along {}", s, gap_along(a, b, &s.normal));
        }
        let above = alternating_distance(a, b);
        prop_assert!(exact.gap <= above + 1e-12);
        if exact.gap > 0.0 {
            prop_assert!(above - exact.gap < 1e-3, "{} {}", above, exact.gap);
        } else {
            prop_assert!(above < 3e-3, "{} {}", above, exact.gap);
        }
        prop_assert_eq!(s.gap > TOL_CONTACT, exact.gap > TOL_CONTACT);
        prop_assert_eq!(are_apart(a, b, 0.0), s.gap > TOL_CONTACT);
        let clearance = exact.gap.abs();
        prop_assert!(!are_apart(a, b, clearance * (1.0 + 1e-9) + 1e-9));
        if exact.gap > 1e-6 {
            prop_assert!(are_apart(a, b, clearance * (1.0 - 1e-6) - 1e-8));
        }
    }

    /// Closed forms against parry's iterations, which stop short on curved bodies, always on the safe side.
    #[test]
    fn closed_forms_agree_with_parry(
        kind_a in 0..3_usize, kind_b in 0..3_usize,
        size_a in prop::array::uniform3(0.05..1.0_f64), size_b in prop::array::uniform3(0.05..1.0_f64),
        p in prop::array::uniform3(-2.0..2.0_f64), angle in -3.0..3.0_f64,
    ) {
        let (shape_a, shape_b) = (shape(kind_a, size_a), shape(kind_b, size_b));
        let (X_a, X_b) = (placement([0.0; 3], [0.0, 0.0, angle]), placement(p, [0.0; 3]));
        let (a, b) = (Placed { shape: &shape_a, X: &X_a }, Placed { shape: &shape_b, X: &X_b });
        let (closed, iterated) = (distance_separation(a, b), general::separation(a, b));
        if closed.gap > 0.0 {
            prop_assert!(iterated.gap <= closed.gap + 1e-12, "{:?} {:?}", closed, iterated);
            prop_assert!(closed.gap - iterated.gap < 1e-5, "{:?} {:?}", closed, iterated);
        } else {
            prop_assert!(iterated.gap <= 1e-12);
        }
    }
}
