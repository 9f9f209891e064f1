//! Decompositions of planes whose free space is known by hand.

use convex_sets::{HPolyhedron, Hyperrectangle};
use decompose::{
    Anchor, Decomposition, Ending, FreeWhere, Options, Problem, ProblemError, Sink, covered, decompose,
    regions_at,
};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use wire::Region;

fn vector(values: &[f64]) -> DVector<f64> {
    DVector::from_column_slice(values)
}

/// The square [-1, 1]² in x, with a coordinate in front that nothing depends on.
fn problem<F: Fn(&[f64]) -> bool + Sync>(free: &FreeWhere<F>) -> Problem<'_> {
    Problem {
        limits: Hyperrectangle { lower: vector(&[-3.0, -1.0, -1.0]), upper: vector(&[3.0, 1.0, 1.0]) },
        relevant: vec![false, true, true],
        displacement: vector(&[0.0, 1.0, 1.0]),
        free,
        grasp: None,
        placement: None,
        transfer_keep: None,
        anchors: Vec::new(),
    }
}

/// Certifies by applying a function to each region, if there is one.
struct Certifying<F> {
    seen: Vec<Region>,
    certify: Option<F>,
}

impl<F: FnMut(&Region) -> Option<Region>> Sink for Certifying<F> {
    type Error = std::convert::Infallible;

    fn region(&mut self, region: &Region) -> Result<(), Self::Error> {
        self.seen.push(region.clone());
        Ok(())
    }

    fn progress(&mut self, _: usize, _: f64, _: &str) {}

    fn certified(&mut self, ids: &[u64]) -> Result<Option<Vec<Region>>, Self::Error> {
        let Some(certify) = &mut self.certify else { return Ok(None) };
        Ok(Some(self.seen.iter().filter(|region| ids.contains(&region.id)).filter_map(certify).collect()))
    }
}

type NoCertificates = fn(&Region) -> Option<Region>;

fn run(problem: &Problem<'_>, options: &Options, seed: u64) -> Decomposition {
    let mut sink = Certifying::<NoCertificates> { seen: Vec::new(), certify: None };
    let Ok(found) = decompose(problem, options, seed, &mut sink, &|| false);
    assert_eq!(found.regions, sink.seen);
    found
}

fn polyhedra(found: &Decomposition) -> Vec<HPolyhedron> {
    found.regions.iter().map(|region| region.polyhedron.clone()).collect()
}

/// Share of free samples that are covered, and of covered samples that are not free.
fn shares(problem: &Problem<'_>, regions: &[HPolyhedron]) -> (f64, f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(99);
    let (mut n_free, mut n_covered_free, mut n_covered) = (0, 0, 0);
    for _ in 0..40_000 {
        let q: Vec<f64> = (0..3)
            .map(|j| {
                let (l, u) = (problem.limits.lower[j], problem.limits.upper[j]);
                l + (u - l) * rng.random::<f64>()
            })
            .collect();
        let (free, covered) = (problem.free.is_free(&q), covered(regions, &q));
        n_free += usize::from(free);
        n_covered += usize::from(covered);
        n_covered_free += usize::from(free && covered);
    }
    (n_covered_free as f64 / n_free as f64, 1.0 - n_covered_free as f64 / n_covered as f64)
}

/// A wall with a gap of 0.02 around y = 0: two rooms and a passage with 1 % of the volume.
fn rooms(q: &[f64]) -> bool {
    q[1].abs() > 0.1 || q[2].abs() < 0.01
}

fn disc(q: &[f64]) -> bool {
    q[1].hypot(q[2]) > 0.5
}

#[test]
fn everything_free_is_one_region_and_the_joint_box() {
    let free = FreeWhere(|_: &[f64]| true);
    let found = run(&problem(&free), &Options::default(), 0);
    assert_eq!(found.ending, Ending::Covered);
    assert_eq!(found.regions.len(), 1);
    assert_eq!(found.regions[0].polyhedron, problem(&free).limits.to_polyhedron());
    assert_eq!(found.total.value, 1.0);
}

#[test]
fn no_relevant_coordinate_is_one_region_or_none() {
    let free = FreeWhere(|_: &[f64]| true);
    let all = Problem { relevant: vec![false; 3], ..problem(&free) };
    assert_eq!(run(&all, &Options::default(), 0).regions.len(), 1);
    let blocked = FreeWhere(|_: &[f64]| false);
    let nothing = Problem { relevant: vec![false; 3], ..problem(&blocked) };
    assert!(matches!(run(&nothing, &Options::default(), 0).ending, Ending::NowhereFree { .. }));
}

#[test]
fn nothing_free_is_an_answer() {
    let free = FreeWhere(|_: &[f64]| false);
    let found = run(&problem(&free), &Options::default(), 0);
    assert!(matches!(found.ending, Ending::NowhereFree { set: "CS_free", .. }), "{:?}", found.ending);
}

#[test]
fn grasp_space_that_is_nowhere_free_is_an_answer() {
    let free = FreeWhere(disc);
    let grasp = HPolyhedron::from_box(&vector(&[-3.0, -0.1, -0.1]), &vector(&[3.0, 0.1, 0.1]));
    let found = run(&Problem { grasp: Some(grasp), ..problem(&free) }, &Options::default(), 0);
    assert!(matches!(found.ending, Ending::NowhereFree { set: "CG_free", .. }), "{:?}", found.ending);
}

#[test]
fn around_a_disc() {
    let free = FreeWhere(disc);
    let problem = problem(&free);
    for seed in 0..3 {
        let found = run(&problem, &Options::default(), seed);
        assert_eq!(found.ending, Ending::Covered);
        let (covered, colliding) = shares(&problem, &polyhedra(&found));
        assert!(covered >= 0.985, "{covered}");
        assert!(colliding <= 0.002, "{colliding}");
        assert!(found.regions.len() <= 24, "{}", found.regions.len());
        for region in &found.regions {
            let P = &region.polyhedron;
            // Unit rows, the joint limits first and exact, the center strictly inside.
            assert_eq!(P.b.as_slice()[..6], [3.0, 1.0, 1.0, 3.0, 1.0, 1.0]);
            assert!((0..P.n_faces()).all(|i| (P.A.row(i).norm() - 1.0).abs() < 1e-12));
            assert!((&P.A * &region.center - &P.b).max() < 0.0);
            assert!(
                (0..P.n_faces()).skip(6).all(|i| P.A[(i, 0)] == 0.0),
                "a prism over the first coordinate"
            );
        }
    }
}

#[test]
fn a_passage_too_small_for_coverage_is_bridged() {
    let free = FreeWhere(rooms);
    let problem = problem(&free);
    let found = run(&problem, &Options { coverage: 0.9, ..Options::default() }, 1);
    let regions = polyhedra(&found);
    let mut reached = vec![0];
    while let Some(next) = (0..regions.len()).find(|&j| {
        !reached.contains(&j) && reached.iter().any(|&i| regions[i].interior_intersects(&regions[j]))
    }) {
        reached.push(next);
    }
    assert_eq!(reached.len(), regions.len(), "all regions are connected");
    assert!(regions.iter().any(|P| P.contains(&vector(&[0.0, 0.0, 0.0]), 0.0)));
}

#[test]
fn start_and_goal_are_inside_exactly_also_at_contact_and_limits() {
    let free = FreeWhere(disc);
    let on = 0.5 / 2.0_f64.sqrt() + 1e-9;
    let anchors = vec![
        Anchor { name: "start".into(), q: vector(&[-3.0, on, on]) },
        Anchor { name: "goal".into(), q: vector(&[3.0, -1.0, 0.123]) },
    ];
    let problem = Problem { anchors: anchors.clone(), ..problem(&free) };
    problem.check().unwrap();
    let found = run(&problem, &Options::default(), 3);
    for anchor in anchors {
        assert!(covered(&polyhedra(&found), anchor.q.as_slice()), "{}", anchor.name);
    }
}

#[test]
fn anchors_that_are_not_free_or_outside_are_refused() {
    let free = FreeWhere(disc);
    let with = |q: [f64; 3]| Problem {
        anchors: vec![Anchor { name: "goal".into(), q: vector(&q) }],
        ..problem(&free)
    };
    assert_eq!(with([0.0, 0.1, 0.1]).check(), Err(ProblemError::NotFree { name: "goal".into() }));
    assert!(matches!(with([0.0, 0.9, 1.1]).check(), Err(ProblemError::OutsideLimits { coordinate: 2, .. })));
    assert!(matches!(with([0.0, 0.9, f64::NAN]).check(), Err(ProblemError::OutsideLimits { .. })));
    let short =
        Problem { anchors: vec![Anchor { name: "goal".into(), q: vector(&[0.0]) }], ..problem(&free) };
    assert!(matches!(short.check(), Err(ProblemError::Dimension { found: 1, expected: 3, .. })));
}

#[test]
fn a_band_of_a_thousandth_is_covered_as_a_set_of_its_own() {
    // Free in the band: x in (-0.8, -0.6) and (0.2, 1), with slanted ends; contact at y = 0.
    let free =
        FreeWhere(|q: &[f64]| q[2] < 0.0 && (q[2] < -0.5 || (q[1] + 0.7).abs() < 0.1 - q[2] || q[1] > 0.2));
    let grasp = HPolyhedron::from_box(&vector(&[-3.0, -1.0, -0.001]), &vector(&[3.0, 1.0, 0.0]));
    let keep = DMatrix::from_row_slice(2, 3, &[-1.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    let problem = Problem { grasp: Some(grasp), transfer_keep: Some(keep), ..problem(&free) };
    let found = run(&problem, &Options::default(), 0);
    assert_eq!(found.ending, Ending::Covered);
    assert!(found.grasp.unwrap().value > 0.99);
    let chord = found.chord.unwrap();
    assert!(chord.share() > 0.998, "{chord:?}");
    assert!((chord.free / 6.0 - 0.8 / 6.0).abs() < 1e-3 || chord.free > 0.0);
}

#[test]
fn same_seed_same_regions_on_any_number_of_threads() {
    let free = FreeWhere(disc);
    let problem = problem(&free);
    let one = run(&problem, &Options::default(), 7);
    for threads in [2, 4] {
        assert_eq!(run(&problem, &Options { threads, ..Options::default() }, 7), one);
    }
    assert_ne!(run(&problem, &Options::default(), 8).regions, one.regions);
}

#[test]
fn what_certification_takes_is_grown_again() {
    let free = FreeWhere(disc);
    let problem = problem(&free);
    // The first regions come back without their half x > 0.
    let certify = |region: &Region| {
        let half = HPolyhedron { A: DMatrix::from_row_slice(1, 3, &[0.0, 1.0, 0.0]), b: vector(&[0.0]) };
        let cut =
            if region.id < 4 { region.polyhedron.intersection(&half) } else { region.polyhedron.clone() };
        Some(Region { parent: Some(region.id), polyhedron: cut, ..region.clone() })
    };
    let mut sink = Certifying { seen: Vec::new(), certify: Some(certify) };
    let Ok(found) = decompose(&problem, &Options::default(), 0, &mut sink, &|| false);
    assert_eq!(found.ending, Ending::Covered);
    assert!(found.certified[0].1.value > 0.97, "{:?}", found.certified);
    // Its twin: nothing is ever certified, and the work ends.
    let mut sink = Certifying { seen: Vec::new(), certify: Some(|_: &Region| None) };
    let Ok(found) =
        decompose(&problem, &Options { max_rounds: 3, ..Options::default() }, 0, &mut sink, &|| false);
    assert!(matches!(found.ending, Ending::Short(_)), "{:?}", found.ending);
}

#[test]
fn stops_when_told() {
    let free = FreeWhere(disc);
    let mut sink = Certifying::<NoCertificates> { seen: Vec::new(), certify: None };
    let Ok(found) = decompose(&problem(&free), &Options::default(), 0, &mut sink, &|| true);
    assert_eq!(found.ending, Ending::Stopped);
}

#[test]
fn single_regions_stay_in_their_domain() {
    let free = FreeWhere(disc);
    let problem = Problem {
        anchors: vec![Anchor { name: "seed".into(), q: vector(&[0.0, 0.8, 0.0]) }],
        ..problem(&free)
    };
    let mut sink = Certifying::<NoCertificates> { seen: Vec::new(), certify: None };
    let options = Options { domain_radius: 0.25, ..Options::default() };
    let Ok(regions) = regions_at(&problem, &options, 0, &mut sink, &|| false);
    let bounds = regions[0].polyhedron.bounding_box().unwrap();
    assert!(bounds.lower[1] >= 0.55 - 1e-9 && bounds.upper[2] <= 0.25 + 1e-9, "{bounds:?}");
    assert!(regions[0].polyhedron.contains(&vector(&[0.0, 0.8, 0.0]), 0.0));
}

#[test]
fn a_region_in_a_passage_reaches_both_ends() {
    let free = FreeWhere(rooms);
    let problem = Problem {
        anchors: vec![Anchor { name: "seed".into(), q: vector(&[0.0, 0.05, 0.003]) }],
        ..problem(&free)
    };
    // With more alternations the ellipsoid grows into a room.
    let options = Options { max_iterations: 1, ..Options::default() };
    for seed in 0..5 {
        let mut sink = Certifying::<NoCertificates> { seen: Vec::new(), certify: None };
        let Ok(regions) = regions_at(&problem, &options, seed, &mut sink, &|| false);
        let bounds = regions[0].polyhedron.bounding_box().unwrap();
        assert!(bounds.lower[1] < -0.1 && bounds.upper[1] > 0.1, "seed {seed}: {bounds:?}");
    }
}
