//! Regions of an earlier run, after an obstacle has moved.

use convex_sets::{HPolyhedron, Hyperrectangle};
use decompose::{
    Decomposition, Ending, FreeWhere, Kept, NoSink, Options, Problem, covered, decompose, extend,
};
use nalgebra::DVector;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use wire::Region;

fn vector(values: &[f64]) -> DVector<f64> {
    DVector::from_column_slice(values)
}

/// The square [-1, 1]² in the last two coordinates; nothing depends on the first.
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

/// Two discs, the second about (x, 0.5).
fn discs(x: f64) -> FreeWhere<impl Fn(&[f64]) -> bool + Sync> {
    FreeWhere(move |q: &[f64]| (q[1] + 0.6).hypot(q[2] + 0.6) > 0.25 && (q[1] - x).hypot(q[2] - 0.5) > 0.25)
}

fn first(problem: &Problem<'_>) -> Vec<Region> {
    let Ok(found) = decompose(problem, &Options::default(), 0, &mut NoSink, &|| false);
    assert_eq!(found.ending, Ending::Covered);
    // As certification would leave them, by and large: away from contact.
    let shrunk = |region: &Region| {
        let P = &region.polyhedron;
        let moved = |i: usize| if i < 6 { P.b[i] } else { P.b[i] - 2e-3 };
        let polyhedron = HPolyhedron { A: P.A.clone(), b: DVector::from_fn(P.n_faces(), |i, _| moved(i)) };
        Region { polyhedron, ..region.clone() }
    };
    found.regions.iter().map(shrunk).collect()
}

fn extended(problem: &Problem<'_>, earlier: &[Region], options: &Options) -> (Decomposition, Kept) {
    let Ok(found) = extend(problem, earlier, options, 1, &mut NoSink, &|| false);
    found
}

/// Share of free samples that are covered, and of covered samples that are not free.
fn shares(problem: &Problem<'_>, regions: &[Region]) -> (f64, f64) {
    let regions: Vec<HPolyhedron> = regions.iter().map(|region| region.polyhedron.clone()).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(99);
    let (mut n_free, mut n_covered_free, mut n_covered) = (0, 0, 0);
    for _ in 0..40_000 {
        let q = [0.0, rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)];
        let (free, covered) = (problem.free.is_free(&q), covered(&regions, &q));
        n_free += usize::from(free);
        n_covered += usize::from(covered);
        n_covered_free += usize::from(free && covered);
    }
    (n_covered_free as f64 / n_free as f64, 1.0 - n_covered_free as f64 / n_covered as f64)
}

#[test]
fn an_unchanged_scene_keeps_every_region_as_it_is() {
    let free = discs(0.4);
    let problem = problem(&free);
    let earlier = first(&problem);
    let (found, kept) = extended(&problem, &earlier, &Options::default());
    assert_eq!(kept, Kept { n_free: earlier.len(), n_cut: 0, n_lost: 0 });
    assert_eq!(found.ending, Ending::Covered);
    for (before, now) in earlier.iter().zip(&found.regions) {
        assert_eq!(before.polyhedron, now.polyhedron, "bit for bit, so that its certificate can be verified");
        assert_eq!(before.center, now.center);
    }
}

#[test]
fn a_disc_that_moves_costs_the_regions_that_it_enters() {
    let before = discs(0.4);
    let earlier = first(&problem(&before));
    let after = discs(0.5);
    let problem = problem(&after);
    let (found, kept) = extended(&problem, &earlier, &Options::default());
    assert!(kept.n_free > 0 && kept.n_cut > 0, "{kept:?}");
    assert_eq!(kept.n_free + kept.n_cut + kept.n_lost, earlier.len());
    assert_eq!(found.ending, Ending::Covered);
    let (covered, colliding) = shares(&problem, &found.regions);
    assert!(covered >= 0.985, "{covered}");
    assert!(colliding <= 0.005, "{colliding}");
    // Its twin: the earlier regions as they were collide in the new scene.
    let (_, colliding) = shares(&problem, &earlier);
    assert!(colliding > 0.005, "{colliding}");
    // A cut region begins with the faces that it had.
    let begins = |now: &Region, before: &Region| {
        let n = before.polyhedron.n_faces();
        now.polyhedron.n_faces() > n
            && now.polyhedron.A.rows(0, n) == before.polyhedron.A.rows(0, n)
            && now.polyhedron.b.rows(0, n) == before.polyhedron.b.rows(0, n)
    };
    let n_cut = found.regions.iter().filter(|now| earlier.iter().any(|before| begins(now, before))).count();
    assert!(n_cut <= kept.n_cut);
}

#[test]
fn regions_beyond_the_new_joint_limits_are_cut_at_them_or_lost() {
    let free = discs(0.4);
    let earlier = first(&problem(&free));
    let mut narrow = problem(&free);
    narrow.limits = Hyperrectangle { lower: vector(&[-3.0, -1.0, -1.0]), upper: vector(&[3.0, 0.0, 1.0]) };
    let (found, kept) = extended(&narrow, &earlier, &Options::default());
    assert_eq!(kept.n_free + kept.n_cut + kept.n_lost, earlier.len());
    for region in &found.regions {
        let bounds = region.polyhedron.bounding_box().expect("a region is bounded");
        assert!(bounds.upper[1] <= 1e-9, "{bounds:?}");
        assert!((&region.polyhedron.A * &region.center - &region.polyhedron.b).max() < 0.0);
    }
}

#[test]
fn where_nothing_is_free_nothing_is_kept() {
    let before = discs(0.4);
    let earlier = first(&problem(&before));
    let nowhere = FreeWhere(|_: &[f64]| false);
    let (found, kept) = extended(&problem(&nowhere), &earlier, &Options::default());
    assert_eq!(kept, Kept { n_free: 0, n_cut: 0, n_lost: earlier.len() });
    assert!(matches!(found.ending, Ending::NowhereFree { .. }), "{:?}", found.ending);
}

#[test]
fn same_seed_same_regions_on_any_number_of_threads() {
    let before = discs(0.4);
    let earlier = first(&problem(&before));
    let after = discs(0.48);
    let problem = problem(&after);
    let one = extended(&problem, &earlier, &Options::default());
    for threads in [2, 4] {
        assert_eq!(extended(&problem, &earlier, &Options { threads, ..Options::default() }), one);
    }
}
