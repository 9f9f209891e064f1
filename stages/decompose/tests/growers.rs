//! Each grower on scenes whose free space is known by hand, and on the arm.

use collision::CollisionChecker;
use convex_sets::{HPolyhedron, HitAndRun};
use decompose::{
    Anchor, Ending, Method, NoSink, Options, Problem, ProblemError, ProvableSpace, Segment, decompose,
    problem_of_scene, regions_along, regions_at,
};
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use scene::Scene;
use std::path::Path;

const ALL: [Method; 4] = [Method::Iris, Method::IrisNp, Method::IrisNp2, Method::IrisZo];

fn load(name: &str) -> Scene {
    Scene::load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes").join(name)).unwrap()
}

fn anchor(q: &[f64]) -> Anchor {
    Anchor { name: "seed".into(), q: DVector::from_column_slice(q) }
}

/// The regions of `method` around `q`: one or none.
fn grown(scene: &Scene, q: &[f64], options: &Options) -> Vec<HPolyhedron> {
    let checker = CollisionChecker::new(scene);
    let problem = Problem { anchors: vec![anchor(q)], ..problem_of_scene(scene, None, &checker) };
    let Ok(regions) = regions_at(&problem, options, 0, &mut NoSink, &|| false);
    assert!(regions.iter().all(|region| region.method.starts_with(options.method.name())));
    regions.into_iter().map(|region| region.polyhedron).collect()
}

fn contains(P: &HPolyhedron, q: &[f64]) -> bool {
    P.contains(&DVector::from_column_slice(q), 0.0)
}

/// Uniform samples of P that are not free, as a share.
fn colliding_share(checker: &CollisionChecker, P: &HPolyhedron, n_samples: usize) -> f64 {
    let E = P.max_inscribed_ellipsoid().unwrap();
    let mut walk = HitAndRun::new(P, &E.center, E.image_of_ball().unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut n_colliding = 0;
    for _ in 0..n_samples {
        (0..4).for_each(|_| {
            walk.step(&mut rng);
        });
        n_colliding += usize::from(!checker.is_free(walk.point()));
    }
    n_colliding as f64 / n_samples as f64
}

/// A seed, the half-width of its domain, configurations just inside and just outside of faces known by hand.
struct Known {
    scene: &'static str,
    seed: &'static [f64],
    domain_radius: f64,
    inside: &'static [&'static [f64]],
    outside: &'static [&'static [f64]],
    /// A seed in collision.
    blocked: &'static [f64],
}

const KNOWN: [Known; 5] = [
    // The tip touches the wall at sin = 0.5.
    Known {
        scene: "hinge",
        seed: &[0.0],
        domain_radius: 0.0,
        inside: &[&[-1.5], &[0.5234]],
        outside: &[&[0.5237], &[-1.51]],
        blocked: &[0.6],
    },
    // Left of the upper box, whose side is slide = -0.2.
    Known {
        scene: "slider-gap",
        seed: &[-0.4, 0.3],
        domain_radius: 0.35,
        inside: &[&[-0.201, 0.45], &[-0.201, 0.0], &[-0.74, 0.49]],
        outside: &[&[-0.199, 0.45], &[-0.76, 0.3], &[-0.4, -0.06]],
        blocked: &[0.0, 0.3],
    },
    // In the gap, between lift = -0.1 and 0.1.
    Known {
        scene: "slider-gap",
        seed: &[0.0, 0.03],
        domain_radius: 0.15,
        inside: &[&[0.14, 0.0999], &[-0.14, -0.0999], &[0.14, -0.0999]],
        outside: &[&[0.0, 0.1001], &[0.14, -0.1001], &[0.151, 0.0]],
        blocked: &[0.1, -0.2],
    },
    // The wall's side is pusher_x = -0.03, the block's top pusher_y = 0.07.
    Known {
        scene: "two-rooms",
        seed: &[-0.25, -0.25, 0.3],
        domain_radius: 0.24,
        inside: &[&[-0.25, -0.031, 0.3], &[-0.25, -0.25, 0.0705], &[-0.2, -0.031, 0.0705]],
        outside: &[&[-0.25, -0.029, 0.3], &[-0.25, -0.25, 0.0695]],
        blocked: &[-0.25, -0.25, 0.06],
    },
    // Right of a wall without a gap.
    Known {
        scene: "two-rooms-closed",
        seed: &[0.1, 0.3, 0.3],
        domain_radius: 0.5,
        inside: &[&[0.1, 0.0305, 0.3], &[-0.3, 0.39, 0.39]],
        outside: &[&[0.1, 0.0295, 0.3], &[0.1, -0.3, 0.3], &[0.3, 0.3, 0.0695]],
        blocked: &[0.1, 0.0, 0.3],
    },
];

#[test]
fn every_grower_finds_the_faces_known_by_hand() {
    for Known { scene: name, seed, domain_radius, inside, outside, .. } in KNOWN {
        let scene = load(name);
        for method in ALL {
            if method == Method::Iris && name == "hinge" {
                continue;
            }
            let options = Options { method, domain_radius, ..Options::default() };
            let regions = grown(&scene, seed, &options);
            let [P] = regions.as_slice() else { panic!("{name}, {method:?}: no region") };
            for q in inside {
                assert!(contains(P, q), "{name}, {method:?}: {q:?} is outside of {P:?}");
            }
            for q in outside {
                assert!(!contains(P, q), "{name}, {method:?}: {q:?} is inside of {P:?}");
            }
            assert!(contains(P, seed));
        }
    }
}

#[test]
fn seeds_in_collision_are_refused() {
    for Known { scene: name, blocked, .. } in KNOWN {
        let scene = load(name);
        let checker = CollisionChecker::new(&scene);
        let problem = Problem { anchors: vec![anchor(blocked)], ..problem_of_scene(&scene, None, &checker) };
        assert_eq!(problem.check(), Err(ProblemError::NotFree { name: "seed".into() }), "{name}");
        // And a caller that does not ask gets no region.
        for method in ALL {
            assert!(grown(&scene, blocked, &Options { method, ..Options::default() }).is_empty(), "{name}");
        }
    }
}

#[test]
fn exact_planes_leave_no_collision() {
    for (name, seed) in [
        ("slider-gap", &[0.0, 0.0][..]),
        ("slider-gap", &[-0.9, 0.4]),
        ("two-rooms", &[0.0, 0.2, 0.1]),
        ("two-rooms", &[0.2, -0.3, 0.3]),
        ("two-rooms-closed", &[0.0, 0.2, 0.3]),
    ] {
        let scene = load(name);
        let options = Options { method: Method::Iris, ..Options::default() };
        let regions = grown(&scene, seed, &options);
        let [P] = regions.as_slice() else { panic!("{name}: no region") };
        assert_eq!(colliding_share(&CollisionChecker::new(&scene), P, 50_000), 0.0, "{name}");
    }
}

#[test]
fn methods_are_refused_where_they_do_not_apply() {
    let check = |name: &str, method: Method| {
        let scene = load(name);
        let checker = CollisionChecker::new(&scene);
        let problem = problem_of_scene(&scene, None, &checker);
        method.check(&problem, &|j| scene.coordinates[j].name.clone()).map_err(|error| error.to_string())
    };
    for method in ALL {
        assert_eq!(check("slider-gap", method), Ok(()));
    }
    let words = check("hinge", Method::Iris).unwrap_err();
    assert!(words.contains("joint hinge is revolute") && words.contains("iris-zo"), "{words}");
    let words = check("slider-gap", Method::CIris).unwrap_err();
    assert!(words.contains("the bodies of a scene") && words.contains("iris-zo"), "{words}");
}

/// What C-IRIS finds about `q`: one region or none.
fn grown_in_tangent_space(scene: &Scene, q: &[f64], options: &Options) -> Option<HPolyhedron> {
    let checker = CollisionChecker::new(scene);
    let space = ProvableSpace::new(scene, &checker);
    let problem = Problem { free: &space, ..problem_of_scene(scene, None, &checker) };
    assert_eq!(Method::CIris.check(&problem, &|_| String::new()), Ok(()));
    let problem = Problem { anchors: vec![anchor(q)], ..problem };
    let options = Options { method: Method::CIris, ..options.clone() };
    let Ok(regions) = regions_at(&problem, &options, 0, &mut NoSink, &|| false);
    assert!(regions.iter().all(|region| region.method.starts_with("c-iris")));
    regions.into_iter().next().map(|region| region.polyhedron)
}

/// The alternation ends beside the known faces, never beyond.
#[test]
fn c_iris_ends_beside_the_faces_known_by_hand() {
    type Case = (usize, &'static [f64], &'static [&'static [f64]]);
    let cases: [Case; 3] = [
        (0, &[-0.3], &[&[-1.45], &[0.3]]),
        (1, KNOWN[1].seed, &[&[-0.21, 0.4], &[-0.23, 0.0], &[-0.74, 0.45]]),
        (2, KNOWN[2].seed, &[&[0.13, 0.08], &[-0.13, -0.08], &[0.13, -0.08]]),
    ];
    for (known_idx, seed, inside) in cases {
        let Known { scene: name, domain_radius, outside, blocked, .. } = KNOWN[known_idx];
        let scene = load(name);
        let options = Options { domain_radius, ..Options::default() };
        let P = grown_in_tangent_space(&scene, seed, &options).expect(name);
        for q in inside {
            assert!(contains(&P, q), "{name}: {q:?} is outside of {P:?}");
        }
        for q in outside {
            assert!(!contains(&P, q), "{name}: {q:?} is inside of {P:?}");
        }
        assert!(contains(&P, seed));
        assert_eq!(colliding_share(&CollisionChecker::new(&scene), &P, 20_000), 0.0, "{name}");
        assert!(grown_in_tangent_space(&scene, blocked, &options).is_none(), "{name}");
    }
}

#[test]
fn c_iris_is_refused_where_sums_of_squares_are_out_of_reach() {
    let scene = load("iiwa14-shelf");
    let checker = CollisionChecker::new(&scene);
    let space = ProvableSpace::new(&scene, &checker);
    let problem = Problem { free: &space, ..problem_of_scene(&scene, None, &checker) };
    let words = Method::CIris.check(&problem, &|_| String::new()).unwrap_err().to_string();
    assert!(words.contains("7 coordinates") && words.contains("iris-zo"), "{words}");
}

/// A range of more than 5.6 rad is narrowed about the seed; a segment stays inside.
#[test]
fn c_iris_copes_with_wide_angles_and_segments() {
    let mut scene = load("hinge");
    (scene.coordinates[0].lower, scene.coordinates[0].upper) = (-3.1, 3.1);
    let options = Options { c_iris_iterations: 5, ..Options::default() };
    let P = grown_in_tangent_space(&scene, &[-1.0], &options).expect("a region");
    assert!(contains(&P, &[-1.0]) && !contains(&P, &[0.53]));
    let scene = load("slider-gap");
    let checker = CollisionChecker::new(&scene);
    let space = ProvableSpace::new(&scene, &checker);
    let problem = Problem { free: &space, ..problem_of_scene(&scene, None, &checker) };
    let ends = [[-0.8, 0.08], [0.9, -0.05]];
    let segment = Segment { name: "edge".into(), ends: ends.map(|q| DVector::from_column_slice(&q)) };
    let options = Options { method: Method::CIris, c_iris_iterations: 3, ..Options::default() };
    let Ok(regions) = regions_along(&problem, &[segment], &options, 0, &mut NoSink, &|| false);
    let [region] = regions.as_slice() else { panic!("no region") };
    assert!(ends.iter().all(|q| contains(&region.polyhedron, q)));
    assert_eq!(colliding_share(&checker, &region.polyhedron, 20_000), 0.0);
}

/// C-IRIS inside the clique cover, with the same regions by any number of threads.
#[test]
fn c_iris_covers() {
    for (name, coverage) in [("hinge", 0.99), ("slider-gap", 0.4)] {
        let scene = load(name);
        let checker = CollisionChecker::new(&scene);
        let space = ProvableSpace::new(&scene, &checker);
        let problem = Problem { free: &space, ..problem_of_scene(&scene, None, &checker) };
        let cover = |threads: usize| {
            let options = Options {
                method: Method::CIris,
                coverage,
                threads,
                c_iris_iterations: 1,
                ..Options::default()
            };
            let Ok(found) = decompose(&problem, &options, 0, &mut NoSink, &|| false);
            assert_eq!(found.ending, Ending::Covered, "{name}");
            found.regions
        };
        let regions = cover(1);
        assert_eq!(regions, cover(4), "{name}");
        for region in &regions {
            assert_eq!(colliding_share(&checker, &region.polyhedron, 5000), 0.0, "{name}");
        }
    }
}

/// Seeds of the arm: above, in the top and in the centre shelf, in both bins.
const ARM_SEEDS: [[f64; 7]; 5] = [
    [0.000064, 0.471953, -0.000149, -0.671673, 0.000185, 0.42617, 1.570692],
    [-0.000155, 0.397273, 0.00022, -1.367476, 0.000247, -0.192952, 1.570469],
    [-0.000176, 0.683028, 0.000245, -1.647823, 0.000021, -0.759055, 1.570626],
    [1.332666, 0.786593, 0.362338, -1.491653, -0.319251, 0.921732, 1.79119],
    [-1.332462, 0.786648, -0.362656, -1.491653, 0.319534, 0.921783, 1.350209],
];

#[test]
fn regions_of_the_arm_collide_less_than_epsilon() {
    let scene = load("iiwa14-shelf");
    let checker = CollisionChecker::new(&scene);
    for method in [Method::IrisZo, Method::IrisNp2] {
        for seed in ARM_SEEDS {
            let options = Options { method, epsilon: 0.01, delta: 0.05, ..Options::default() };
            let regions = grown(&scene, &seed, &options);
            let [P] = regions.as_slice() else { panic!("{method:?}: no region") };
            let share = colliding_share(&checker, P, 100_000);
            assert!(share < 0.01, "{method:?} at {seed:?}: {share}");
            assert!(contains(P, &seed));
        }
    }
}

/// The programmes alone miss collisions: of this region 1.4 % without the test.
#[test]
fn nonlinear_programmes_end_with_the_test() {
    let scene = load("iiwa14-shelf");
    let checker = CollisionChecker::new(&scene);
    let options = Options { method: Method::IrisNp, epsilon: 0.01, delta: 0.05, ..Options::default() };
    let regions = grown(&scene, &ARM_SEEDS[1], &options);
    let [P] = regions.as_slice() else { panic!("no region") };
    let share = colliding_share(&checker, P, 100_000);
    assert!(share < 0.01, "{share}");
    assert!(contains(P, &ARM_SEEDS[1]));
    for Known { scene: name, seed, domain_radius, .. } in KNOWN {
        let scene = load(name);
        let regions = grown(&scene, seed, &Options { domain_radius, ..options.clone() });
        let [P] = regions.as_slice() else { panic!("{name}: no region") };
        let share = colliding_share(&CollisionChecker::new(&scene), P, 20_000);
        assert!(share < 0.01, "{name}: {share}");
    }
}

#[test]
fn spent_faces_move_inwards() {
    let scene = load("iiwa14-shelf");
    let checker = CollisionChecker::new(&scene);
    for method in [Method::IrisZo, Method::IrisNp2, Method::IrisNp] {
        for max_faces in [6, 15] {
            let options =
                Options { method, max_faces, domain_radius: 0.8, epsilon: 0.01, ..Options::default() };
            let regions = grown(&scene, &ARM_SEEDS[2], &options);
            let [P] = regions.as_slice() else { panic!("{method:?}: no region") };
            // Joint limits, the domain, and the budget.
            assert!(P.n_faces() <= 14 + 14 + max_faces, "{method:?}: {} faces", P.n_faces());
            let share = colliding_share(&checker, P, 50_000);
            assert!(share < 0.01, "{method:?}, {max_faces} faces: {share}");
        }
    }
}

#[test]
fn a_region_along_a_segment_contains_it() {
    // Through the gap, from room to room; and from contact with the wall to the other side of the arm's range.
    for (name, ends) in [
        ("slider-gap", [&[-0.8, 0.08][..], &[0.9, -0.05]]),
        ("slider-gap", [&[-0.9, -0.4], &[-0.25, 0.45]]),
        ("two-rooms", [&[0.0, -0.3, 0.1], &[0.1, 0.35, 0.15]]),
        ("hinge", [&[-1.4], &[0.5]]),
    ] {
        let scene = load(name);
        let checker = CollisionChecker::new(&scene);
        let problem = problem_of_scene(&scene, None, &checker);
        for method in ALL {
            if method == Method::Iris && name == "hinge" {
                continue;
            }
            let segment = Segment { name: "edge".into(), ends: ends.map(DVector::from_column_slice) };
            let options = Options { method, ..Options::default() };
            let Ok(regions) = regions_along(&problem, &[segment], &options, 0, &mut NoSink, &|| false);
            let [region] = regions.as_slice() else { panic!("{name}, {method:?}: no region") };
            for end in ends {
                assert!(contains(&region.polyhedron, end), "{name}, {method:?}: {end:?}");
            }
            let share = colliding_share(&checker, &region.polyhedron, 20_000);
            assert!(share < 0.01, "{name}, {method:?}: {share}");
        }
    }
}

/// Faces are prisms over the coordinates that their pair does not depend on.
#[test]
fn faces_depend_on_what_some_pair_depends_on() {
    let scene = load("iiwa14-shelf");
    let checker = CollisionChecker::new(&scene);
    for method in [Method::IrisZo, Method::IrisNp2, Method::IrisNp] {
        let options = Options { method, epsilon: 0.02, ..Options::default() };
        let P = &grown(&scene, &ARM_SEEDS[0], &options)[0];
        let mut n_sparse = 0;
        for face_idx in 2 * scene.dim()..P.n_faces() {
            let depends: Vec<usize> = (0..scene.dim()).filter(|&j| P.A[(face_idx, j)] != 0.0).collect();
            let explains = |pair_idx| {
                let of_pair = checker.pair_coordinates(pair_idx);
                depends.iter().all(|j| of_pair.contains(j))
            };
            assert!((0..checker.n_pairs()).any(explains), "{method:?}: face over {depends:?}");
            n_sparse += usize::from(depends.len() < scene.dim());
        }
        assert!(n_sparse > 0, "{method:?}");
    }
}

#[test]
fn every_grower_covers_what_is_to_be_covered() {
    for (name, methods) in
        [("slider-gap", &ALL[..]), ("two-rooms", &ALL[..]), ("bottle-cap-3dof", &ALL[1..3])]
    {
        let scene = load(name);
        let task = scene.task(None).ok();
        let checker = CollisionChecker::new(&scene);
        let problem = problem_of_scene(&scene, task, &checker);
        for &method in methods {
            let options = Options { method, ..Options::default() };
            let Ok(found) = decompose(&problem, &options, 0, &mut NoSink, &|| false);
            assert_eq!(found.ending, Ending::Covered, "{name}, {method:?}");
            assert!(found.regions.len() <= 24, "{name}, {method:?}: {} regions", found.regions.len());
            assert!(found.regions.iter().all(|region| region.method.starts_with(method.name())));
        }
    }
}

#[test]
fn same_seed_same_region() {
    let scene = load("bottle-cap-4dof");
    let q = [0.0, -0.7, -0.04, 0.04];
    for method in [Method::IrisZo, Method::IrisNp2, Method::IrisNp] {
        let options = Options { method, ..Options::default() };
        let first = grown(&scene, &q, &options);
        assert_eq!(first.len(), 1, "{method:?}");
        assert_eq!(first, grown(&scene, &q, &Options { threads: 2, ..options }), "{method:?}");
    }
}
