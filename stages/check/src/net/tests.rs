use super::*;
use crate::cells;
use ipc_types::artefact::{Cell, FrameChoice, PairCertificate, PairProof, SweptProof};
use proptest::prelude::*;
use scene::Scene;

/// Least value over all control maps by intervals, as an enclosure of the exact one.
fn enclosed(
    factors: &[(&Step, Mat3, Vec3)],
    cell: &Extent,
    r: &Vec3,
    d: Interval,
    g: &[f64],
    shape: &Shape,
) -> Interval {
    let Some(((step, R, p), rest)) = factors.split_first() else { return d - body::core_support(shape, r) };
    let next = |r: &Vec3, d: Interval| {
        let d = d + interval::dot(r, p);
        enclosed(rest, cell, &interval::row_times(r, R), d, g, shape)
    };
    let j = step.coordinate().expect("a motion");
    let [m, h, g_j] = [cell.center[j], cell.half[j], g[j]].map(Interval::point);
    let children: Vec<Interval> = match step {
        Step::Turn { axis, sign, .. } => {
            [(-1.0, Interval::ONE), (0.0, h.sin_cos().1.recip()), (1.0, Interval::ONE)]
                .map(|(i, stretch)| {
                    let (s, c) = (Interval::point(*sign) * (m + Interval::point(i) * h)).sin_cos();
                    next(
                        &interval::row_times(r, &rotation(axis, s, c, stretch)),
                        d - Interval::point(i) * g_j * h,
                    )
                })
                .to_vec()
        }
        Step::Slide { axis, sign, .. } => [-1.0, 1.0]
            .map(|i| {
                let q = Interval::point(*sign) * (m + Interval::point(i) * h);
                next(r, d + interval::dot(r, axis) * q - Interval::point(i) * g_j * h)
            })
            .to_vec(),
        Step::Fixed { .. } => unreachable!("paired with its motion"),
    };
    children.into_iter().reduce(Interval::min).expect("two or three")
}

fn unit(v: [f64; 3]) -> Vec3 {
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt().max(1e-3);
    v.map(|x| Interval::point(x / length))
}

fn vector(size: f64) -> impl Strategy<Value = [f64; 3]> {
    [-size..size, -size..size, -size..size]
}

fn shape() -> impl Strategy<Value = Shape> {
    let size = || 0.01..0.3f64;
    prop_oneof![
        vector(0.3).prop_map(|e| Shape::Box { half_extents: nalgebra::Vector3::from(e.map(f64::abs)) }),
        (size(), size()).prop_map(|(radius, half_length)| Shape::Cylinder { radius, half_length }),
        (size(), size()).prop_map(|(radius, half_length)| Shape::Capsule { radius, half_length }),
        size().prop_map(|radius| Shape::Sphere { radius }),
    ]
}

/// Joints: whether it turns, axis (that of the normal where `along`), the transform behind it, and m, h, g.
type Joint = (bool, bool, [f64; 3], [f64; 3], [f64; 3], f64, (f64, f64, f64));

fn joint() -> impl Strategy<Value = Joint> {
    let of_cell = (-2.0..2.0f64, 1e-4..0.8f64, -0.5..0.5f64);
    (any::<bool>(), any::<bool>(), vector(1.0), vector(1.0), vector(1.0), -3.0..3.0f64, of_cell)
}

proptest! {
    /// The bound in doubles is below the exact least value, for chains of all joints and shapes, and not far below.
    #[test]
    fn doubles_stay_below_the_exact_least_value(joints in prop::collection::vec(joint(), 0..5), shape in shape(),
                                                n in vector(1.0), along_z in any::<bool>()) {
        let n = if along_z { [0.0, 0.0, 1.0] } else { n };
        let mut steps = Vec::new();
        for (k, (turns, along, axis, turned, p, angle, _)) in joints.iter().enumerate() {
            let axis = if *along { [0.0, 0.0, 1.0] } else { *axis };
            let (axis, sign) = (unit(axis), if *angle > 0.0 { 1.0 } else { -1.0 });
            steps.push(if *turns {
                Step::Turn { axis, sign, coordinate: k }
            } else {
                Step::Slide { axis, sign, coordinate: k }
            });
            let (s, c) = Interval::point(if *along { 0.0 } else { *angle }).sin_cos();
            steps.push(Step::Fixed { R: rotation(&unit(*turned), s, c, Interval::ONE), p: p.map(Interval::point) });
        }
        let side = Side { steps, inflation: 0.0 };
        let of_cell: Vec<(f64, f64, f64)> = joints.iter().map(|joint| joint.6).collect();
        let lower: Vec<f64> = of_cell.iter().map(|(m, h, _)| m - h).collect();
        let upper: Vec<f64> = of_cell.iter().map(|(m, h, _)| m + h).collect();
        let g: Vec<f64> = of_cell.iter().map(|&(m, _, g)| if m > 1.0 { 0.0 } else { g }).collect();
        let cell = Extent::new(&lower, &upper);
        let pairs: Vec<(&Step, Mat3, Vec3)> = side.steps.chunks(2).map(|both| match both {
            [motion, Step::Fixed { R, p }] => (motion, *R, *p),
            _ => unreachable!("pushed so"),
        }).collect();
        let n_exact = n.map(Interval::point);
        let mut exact = enclosed(&pairs, &cell, &n_exact, Interval::ZERO, &g, &shape);
        exact = exact - interval::norm(&n_exact) * Interval::point(body::rounding_radius(&shape));
        for (step, j) in pairs.iter().zip(0..).map(|((step, ..), j): (_, usize)| (*step, j)) {
            if matches!(step, Step::Turn { .. }) {
                exact = exact - Interval::point(g[j].abs()) * Interval::point(sine_excess(cell.half[j]));
            }
        }
        let least = Net::new(&side, &shape).least(&lower, &upper, n, &g).expect("a short chain").lo();
        prop_assert!(least <= exact.lo(), "{least} against {exact:?}");
        prop_assert!(exact.lo() - least < 1e-9, "{least} against {exact:?}");
        // Another order of work, the same bound: what was made before is kept.
        let mut net = Net::new(&side, &shape);
        net.least(&lower, &cell.center, n, &g);
        prop_assert_eq!(net.least(&lower, &upper, n, &g).expect("a short chain").lo(), least);
    }
}

#[test]
fn what_doubles_can_not_tell_is_refused() {
    let turn = |coordinate| Step::Turn { axis: interval::point3(0.6, 0.0, 0.8), sign: 1.0, coordinate };
    let shape = Shape::Sphere { radius: 0.1 };
    let least = |n_joints: usize, half: f64, n: f64, g: f64| {
        let side = Side { steps: (0..n_joints).map(turn).collect(), inflation: 0.0 };
        let all = |value: f64| vec![value; n_joints];
        Net::new(&side, &shape).least(&all(-half), &all(half), [n, 0.0, 0.0], &all(g))
    };
    assert!(least(5, 0.5, 1.0, 0.1).is_some());
    for refused in [
        least(5, 1.4, 1.0, 0.1),
        least(16, 0.5, 1.0, 0.1),
        least(5, 0.5, f64::NAN, 0.1),
        least(5, 0.5, 1e300, 0.1),
        least(5, 0.5, f64::INFINITY, 0.1),
        least(5, 0.5, 1.0, 1e300),
    ] {
        assert!(refused.is_none(), "{refused:?}");
    }
}

/// A ball that slides along a wall that stands askew, and touches it up to the rounding of their places: what proves
/// nothing but the rounding of a sum is refused, and one nanometre of air is accepted.
#[test]
fn a_gap_the_size_of_rounding_is_no_proof() {
    let (mut n_by_doubles, mut n_near) = (0, 0);
    for k in 0..200 {
        let (x, radius) = (0.01 * f64::from(k), 0.001 * f64::from(k % 17 + 1));
        let (s, c) = (0.1 * f64::from(k % 31)).sin_cos();
        let urdf = format!(
            r#"<robot name="ball"><link name="rail"/><link name="ball"><collision><geometry><sphere radius="{radius:?}"/>
               </geometry></collision></link><joint name="slide" type="prismatic"><origin xyz="{:?} {:?} 0"/>
               <parent link="rail"/><child link="ball"/><axis xyz="{:?} {c:?} 0"/>
               <limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"#,
            x * c,
            x * s,
            -s
        );
        let scene = |air: f64| {
            let middle = x + radius + 1.0 + air;
            let text = format!(
                "format = 1\nname = \"touch\"\n[[model]]\nname = \"ball\"\nrole = \"robot\"\nurdf = \"ball.urdf\"\n\
                 [[obstacle]]\nname = \"wall\"\nbox = {{ size = [2.0, 9.0, 9.0] }}\nxyz = [{:?}, {:?}, 0.0]\n\
                 rpy = [0.0, 0.0, {:?}]\n[coordinates]\norder = [\"slide\"]\n",
                middle * c,
                middle * s,
                0.1 * f64::from(k % 31)
            );
            Scene::from_text(&text, &[("ball.urdf", &urdf)]).expect("a scene")
        };
        let frame = FrameChoice { link: 0, n_dropped_a: 0, n_dropped_b: 0 };
        let normal = [-c, -s, 0.0];
        let cell = Cell::Separated { frame: 0, normal, g: vec![], multipliers: vec![] };
        let proof = SweptProof { frames: vec![frame], cells: vec![cell] };
        let pair =
            PairCertificate { body_a: 0, body_b: 1, clearance: 0.0, proof: PairProof::Swept(proof.clone()) };
        let verdict = |air| cells::verify(&scene(air), &pair, &proof, &[], &[-1.0], &[1.0]);
        for air in [0.0, 4e-16, 1e-15] {
            let refused = verdict(air);
            assert!(matches!(refused, Err(cells::CellError::NotSeparated { .. })), "{k}, {air}: {refused:?}");
            // The same without what is known of the rounding.
            let scene = scene(air);
            let gap = [(0, normal), (1, normal.map(|x| -x))].map(|(body_idx, n)| {
                let side = Side::new(&scene, 0, body_idx).expect("a body");
                let mut net = Net::new(&side, &scene.bodies[body_idx].shape);
                let (value, bound) = net.core_least(&[-1.0], &[1.0], n, &[0.0]).expect("short");
                (value - body::rounding_radius(&scene.bodies[body_idx].shape), bound)
            });
            n_by_doubles += usize::from(gap[0].0 + gap[1].0 > 0.0);
            n_near += usize::from(gap[0].0 + gap[1].0 < gap[0].1 + gap[1].1);
        }
        assert_eq!(verdict(1e-9), Ok(1), "{k}");
    }
    assert!(n_by_doubles >= 50 && n_near == 600, "{n_by_doubles} of {n_near} would pass by doubles alone");
}
