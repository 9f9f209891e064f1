use super::*;

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

/// The arm swings from −1 to 1: its gap to the wall along −x is 1.2 − 0.1 − cos, at least 0.1 in the middle.
fn swing() -> (PathCertificateFile, Vec<InputPiece>) {
    let control_points = vec![vec![-1.0], vec![1.0]];
    let pieces =
        vec![InputPiece { place: "line 2".into(), mode: None, control_points: control_points.clone() }];
    // M2 = 4 over the whole, so K/8 on a quarter of the whole's length is 4 / 16 / 32 < 0.1.
    let frame = FrameChoice { link: 0, n_dropped_a: 0, n_dropped_b: 0 };
    let interval = |k: u32| SeparatedInterval {
        t_0: f64::from(k) / 4.0,
        t_1: f64::from(k + 1) / 4.0,
        frame: 0,
        normal: [-1.0, 0.0, 0.0],
    };
    let certificate = PathCertificateFile {
        coordinates: vec!["turn".into()],
        task: None,
        clearance: 0.06,
        pairs: vec![PathPair { body_a: 0, body_b: 1, clearance: 0.06, frames: vec![frame] }],
        attachments: Vec::new(),
        pieces: vec![CertifiedPiece {
            mode: None,
            control_points,
            intervals: vec![(0..4).map(interval).collect()],
        }],
    };
    (certificate, pieces)
}

#[test]
fn a_swing_before_a_wall_is_proven() {
    let (certificate, pieces) = swing();
    let verdict = verify(&scene(), &certificate, &pieces, 0.06, 0.0).unwrap();
    assert_eq!((verdict.n_pieces, verdict.n_pairs, verdict.n_intervals), (1, 1, 4));
}

#[track_caller]
fn refused(change: impl Fn(&mut PathCertificateFile), words: &str) {
    let (mut certificate, pieces) = swing();
    change(&mut certificate);
    let message = verify(&scene(), &certificate, &pieces, 0.0, 0.0).unwrap_err().to_string();
    assert!(message.contains(words), "{message}");
}

#[test]
fn damage_is_refused() {
    refused(|c| _ = c.pieces[0].intervals[0].remove(1), "does not follow 0.25");
    refused(|c| _ = c.pieces[0].intervals[0].pop(), "nothing is proven from t = 0.75 on");
    refused(|c| c.pieces[0].intervals[0][0].normal = [1.0, 0.0, 0.0], "not proven apart on [0, 0.25]");
    refused(|c| c.pieces[0].intervals[0][0].normal = [0.0; 3], "not proven apart");
    refused(|c| c.pieces[0].intervals[0][0].normal[1] = f64::NAN, "not proven apart");
    refused(|c| c.pieces[0].intervals[0][2].frame = 1, "no such frame");
    refused(|c| c.pieces[0].intervals.clear(), "not certified");
    refused(|c| c.pieces[0].control_points[1][0] = 1.0 + 1e-15, "not the piece of the path");
    refused(|c| c.pieces[0].mode = Some(Mode::Transit), "not the piece of the path");
    refused(|c| c.pieces.clear(), "number of pieces");
    refused(|c| c.pairs.clear(), "arm/arm – wall");
    refused(|c| c.pairs[0].body_b = 0, "arm/arm – wall");
    refused(|c| c.pairs[0].clearance = 0.0, "0.06 m are asked for");
    refused(|c| c.pairs[0].clearance = 0.11, "not proven apart");
    refused(|c| c.clearance = f64::NAN, "clearance of NaN");
    refused(|c| c.coordinates[0] = "bend".into(), "coordinates");
    refused(|c| c.task = Some("open".into()), "task");
    refused(|c| c.pairs[0].frames[0].link = 9, "frame");
    // The ball is a metre from the axis that would have to be its own.
    refused(|c| c.pairs[0].frames[0].n_dropped_a = 1, "not proven apart");
    refused(|c| c.pairs[0].frames[0].n_dropped_a = 2, "frame");
    let whole = SeparatedInterval { t_0: 0.0, t_1: 1.0, frame: 0, normal: [-1.0, 0.0, 0.0] };
    // In one interval the parabola reaches down to 0.66/2 − 1/8 − 0.46²/2 = 0.0992 or a little less.
    let in_one = |c: &mut PathCertificateFile| {
        c.pieces[0].intervals[0] = vec![whole];
        c.pairs[0].clearance = 0.0995;
    };
    refused(in_one, "not proven apart on [0, 1]");
}

#[test]
fn more_clearance_than_certified_is_refused_and_so_is_another_path() {
    let (certificate, mut pieces) = swing();
    assert!(verify(&scene(), &certificate, &pieces, 0.07, 0.0).unwrap_err().to_string().contains("0.07 m"));
    pieces[0].control_points[0][0] = -1.01;
    assert!(verify(&scene(), &certificate, &pieces, 0.0, 0.0).is_err());
}

/// The clearance that can be proven lies on both sides of the least gap that the parabola allows.
#[test]
fn clearance_on_both_sides_of_the_bound() {
    let proven = |clearance: f64| {
        let (mut certificate, pieces) = swing();
        certificate.clearance = clearance;
        certificate.pairs[0].clearance = clearance;
        verify(&scene(), &certificate, &pieces, 0.0, 0.0).is_ok()
    };
    // At the middle t = 1/2 the gap is 0.1 and has slope 0; the bound there falls below by at most 4 / 16 / 32.
    assert!(proven(0.1 - 4.0 / 16.0 / 32.0));
    assert!(!proven(0.1));
}
