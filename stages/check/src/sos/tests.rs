use super::*;
use ipc_types::artefact::{CoreEnclosure, FrameChoice, PairProof, RowOrigin, SosRow};

/// A ball of radius 0.1 on an arm of length 1 that turns about z, and a wall at x ≥ 1.2; by hand.
const URDF: &str = r#"<robot name="arm"><link name="post"/><link name="arm"><collision><origin xyz="1 0 0"/>
    <geometry><sphere radius="0.1"/></geometry></collision></link><joint name="turn" type="revolute"><parent link="post"/>
    <child link="arm"/><axis xyz="0 0 1"/><limit lower="-1.5" upper="1.5" effort="1" velocity="1"/></joint></robot>"#;
const SCENE: &str = r#"
format = 1
name = "arm"
[[model]]
name = "arm"
role = "robot"
urdf = "arm.urdf"
[[obstacle]]
name = "wall"
box = { size = [1.0, 9.0, 9.0] }
xyz = [1.7, 0.0, 0.0]
[coordinates]
order = ["turn"]
"#;

fn scene() -> Scene {
    Scene::from_text(SCENE, &[("arm.urdf", URDF)]).unwrap()
}

const T: f64 = 0.94;

/// With t = T s the ball is at (1 − t², 2t)/(1 + t²). The plane x = 1.15 leaves
/// −(1 − t²) + (1.15 − 0.1)(1 + t²) = 0.05 + 2.05 t² on its side, of which 0.04 + 2.05 t² is a sum of squares.
fn swing() -> (PairCertificate, SosProof) {
    let term = SosTerm { factors: vec![], basis: 0, gram: vec![0.04, 0.0, 2.05 * T * T] };
    let proof = SosProof {
        frame: FrameChoice { link: 0, n_dropped_a: 0, n_dropped_b: 0 },
        enclosures: [CoreEnclosure::Core; 2],
        joints: vec![SosJoint {
            coordinate: 0,
            center: 0.0,
            scale: T,
            lower: -1.5,
            upper: 1.5,
            lower_multipliers: vec![],
            upper_multipliers: vec![],
        }],
        rows: vec![],
        plane_a: vec![[-1.0, 0.0, 0.0], [0.0; 3]],
        plane_b: vec![1.15, 0.0],
        bases: vec![vec![vec![0], vec![1]]],
        points_a: vec![vec![term]],
        points_b: vec![vec![]; 8],
    };
    let pair = PairCertificate {
        body_a: 0,
        body_b: 1,
        clearance: 0.0,
        proof: PairProof::SumOfSquares(Box::new(proof.clone())),
    };
    (pair, proof)
}

fn check(pair: &PairCertificate, proof: &SosProof, rows: &[SweptRow]) -> Result<usize, SosError> {
    verify(&scene(), pair, proof, rows, &[-1.5], &[1.5])
}

#[test]
fn a_swing_before_a_wall_is_proven() {
    let (pair, proof) = swing();
    assert_eq!(check(&pair, &proof, &[]), Ok(9));
}

#[test]
fn clearance_is_taken_from_both_sides() {
    let (mut pair, proof) = swing();
    pair.clearance = 0.01;
    assert_eq!(check(&pair, &proof, &[]), Ok(9));
    // Half of it at either side of the plane: 0.01 is left beside the sum of squares.
    pair.clearance = 0.021;
    assert!(matches!(check(&pair, &proof, &[]), Err(SosError::NotSeparated { side: 'A', .. })));
    pair.clearance = f64::NAN;
    assert!(matches!(check(&pair, &proof, &[]), Err(SosError::Frame { .. })));
}

/// Each kind of damage is found, and named for what it is.
#[test]
fn damage_is_rejected() {
    type Damage = fn(&mut SosProof);
    let cases: [(&str, Damage); 15] = [
        ("is malformed", |p| p.plane_b[0] = f64::NAN),
        ("is malformed", |p| p.points_a[0][0].basis = 1),
        ("does not see the bodies", |p| p.frame.link = 77),
        ("does not see the bodies", |p| p.frame.n_dropped_a = 1),
        ("does not see the bodies", |p| {
            p.joints.clear();
            p.plane_a.pop();
            p.plane_b.pop();
            p.bases[0] = vec![vec![], vec![]];
        }),
        ("is not proven to stay between -1.4 and 1.5", |p| p.joints[0].lower = -1.4),
        ("or its scale 0.9 is too small", |p| p.joints[0].scale = 0.9),
        ("row 0 of the sum-of-squares proof", |p| {
            p.rows.push(SosRow { c: vec![1.0], d: 0.5, multipliers: vec![] });
        }),
        ("the points of body A", |p| p.points_a.clear()),
        ("the points of body B", |p| p.points_b.truncate(7)),
        ("the points of body A", |p| p.enclosures[0] = CoreEnclosure::CylinderInCapsule),
        ("term 0 is not proven positive semidefinite", |p| p.points_a[0][0].gram[0] = -0.04),
        ("term 0 is not proven positive semidefinite", |p| p.points_a[0][0].gram[1] = 1.0),
        ("point 0 of body A: what the sums of squares leave", |p| p.points_a[0][0].gram[2] = 1.7),
        ("point 0 of body B: what the sums of squares leave", |p| p.plane_b[0] = 1.201),
    ];
    for (message, damage) in cases {
        let (pair, mut proof) = swing();
        damage(&mut proof);
        let error = check(&pair, &proof, &[]).expect_err(message).to_string();
        assert!(error.contains(message), "{message}: {error}");
    }
    let (pair, mut proof) = swing();
    proof.plane_a[0][0] = -1.1;
    assert!(matches!(check(&pair, &proof, &[]), Err(SosError::NotSeparated { .. })));
}

/// Rows and bounds are believed where their multipliers prove them, and not beyond.
#[test]
fn rows_are_believed_only_where_they_follow() {
    let rows = [SweptRow { a: vec![1.0], b: -0.5, origin: RowOrigin::Face(0) }];
    let (pair, mut proof) = swing();
    // q ≤ −0.5 on the region: s ≤ −tan(0.25)/T there. A little slack is for the rounding of the verifier.
    let d = -f64::tan(0.25) / T + 1e-8;
    proof.joints[0].upper = -0.5 + 1e-9;
    proof.joints[0].upper_multipliers = vec![(0, 1.0)];
    proof.rows = vec![SosRow { c: vec![1.0], d, multipliers: vec![(0, 1.0)] }];
    // With this multiplier the tangent is bounded over all of [-1.5, -0.5], which is not enough for d.
    assert_eq!(check(&pair, &proof, &rows), Err(SosError::Row { row_idx: 0 }));
    proof.rows[0].multipliers[0].1 = 0.0;
    assert_eq!(check(&pair, &proof, &rows), Ok(9));
    proof.rows[0].d = d - 1e-3;
    assert_eq!(check(&pair, &proof, &rows), Err(SosError::Row { row_idx: 0 }));
    proof.joints[0].upper = -0.6;
    assert!(matches!(check(&pair, &proof, &rows), Err(SosError::Variable { .. })));
}
