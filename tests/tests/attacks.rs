//! Certified regions under attack: samples and descents of distance, by the collision library, find no collision in
//! them; in regions that are known to be bad they do.

use collision::CollisionChecker;
use ipc_types::artefact::{CertificatesFile, PairProof, Region, RegionsFile};
use ipc_types::store;
use pipeline_tests::attack::Attack;
use pipeline_tests::polytope_samples::Walk;
use pipeline_tests::programs::{Word, json, run};
use pipeline_tests::scenes;
use scene::Scene;
use std::path::{Path, PathBuf};

/// Seeds of the arm: above, in the top and the centre of the shelf, the bins, and three more.
const SEEDS: [[f64; 7]; 8] = [
    [0.000064, 0.471953, -0.000149, -0.671673, 0.000185, 0.42617, 1.570692],
    [-0.000155, 0.397273, 0.00022, -1.367476, 0.000247, -0.192952, 1.570469],
    [-0.000176, 0.683028, 0.000245, -1.647823, 0.000021, -0.759055, 1.570626],
    [1.332666, 0.786593, 0.362338, -1.491653, -0.319251, 0.921732, 1.79119],
    [-1.332462, 0.786648, -0.362656, -1.491653, 0.319534, 0.921783, 1.350209],
    [0.0, 0.2, 0.0, -2.09, 0.0, -0.3, std::f64::consts::FRAC_PI_2],
    [0.8, 0.7, 0.0, -1.6, 0.0, 0.0, std::f64::consts::FRAC_PI_2],
    [-0.8, 0.7, 0.0, -1.6, 0.0, 0.0, std::f64::consts::FRAC_PI_2],
];

/// Closest pairs of bodies that descents start for, in turn.
const N_CLOSEST: usize = 5;

fn is_slow() -> bool {
    std::env::var_os("SLOW").is_some_and(|word| word == "1")
}

/// Certified regions of one scene.
struct Target {
    name: String,
    scene: Scene,
    regions: Vec<Region>,
}

/// Makes certified regions by `regrasp regions` with `further` arguments.
fn made(folder: &Path, name: &str, scene_name: &str, further: &[String]) -> Target {
    let (scene, out): (PathBuf, PathBuf) = (scenes::scene(scene_name), folder.join(name));
    let mut arguments: Vec<Word<'_>> = vec![&"regions", &scene, &"--out", &out];
    arguments.extend(further.iter().map(|word| word as Word<'_>));
    run("regrasp", &arguments).expect_code(0);
    let file: RegionsFile = json(&out, "certify/regions.json");
    let regions: Vec<Region> = file.regions.into_iter().filter(|region| region.certified).collect();
    assert!(!regions.is_empty(), "{name}: nothing is certified");
    Target { name: name.to_owned(), scene: Scene::load(&scene).expect("it was decomposed"), regions }
}

fn around(seeds: &[[f64; 7]], radius: &str) -> Vec<String> {
    let numbers = |seed: &[f64; 7]| seed.map(|q| q.to_string()).join(",");
    let mut words: Vec<String> =
        seeds.iter().flat_map(|seed| ["--region-at".to_owned(), numbers(seed)]).collect();
    words.extend(["--radius".to_owned(), radius.to_owned()]);
    words
}

/// Attacks all regions of all targets: samples in equal shares, and descents in turn. The least distance found.
fn attack(targets: &[Target], n_samples: usize, n_descents: usize) -> f64 {
    let n_regions: usize = targets.iter().map(|target| target.regions.len()).sum();
    let mut least = f64::INFINITY;
    let (mut n_sampled, mut n_descended) = (0, 0);
    for target in targets {
        let checker = CollisionChecker::new(&target.scene);
        for region in &target.regions {
            let attack = Attack::new(&target.scene, &checker, region);
            let share = n_samples.div_ceil(n_regions);
            let found = attack.colliding_sample(share, region.id);
            assert_eq!(found, None, "{}: region {} collides", target.name, region.id);
            n_sampled += share;
            let mut walk = Walk::new(region, region.id ^ 1);
            for turn in 0..n_descents.div_ceil(n_regions) {
                let start = (0..10).map(|_| walk.step().to_vec()).last().expect("ten steps");
                let pairs = attack.pairs_by_distance(&start);
                let pair_idx = pairs[turn % N_CLOSEST.min(pairs.len())];
                let end = attack.descend(pair_idx, &start);
                let place = format!("{}: region {}, pair {pair_idx}: {end:?}", target.name, region.id);
                assert!(!end.collides && end.excess > -1e-9, "{place}");
                least = least.min(end.excess);
                n_descended += 1;
            }
        }
    }
    assert!(n_sampled >= n_samples && n_descended >= n_descents);
    least
}

/// 10⁶ samples with `SLOW=1`, a tenth without it; 200 descents. Regions by swept hulls.
#[test]
fn no_attack_finds_a_collision_in_certified_regions() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let (n_grown, radius) = if is_slow() { (SEEDS.len(), "0.75") } else { (2, "0.3") };
    let targets = [
        made(folder, "cap-3", "bottle-cap-3dof", &[]),
        made(folder, "cap-4", "bottle-cap-4dof", &[]),
        made(folder, "arm-small", "iiwa14-shelf", &around(&SEEDS, "0.05")),
        made(folder, "arm-grown", "iiwa14-shelf", &around(&SEEDS[..n_grown], radius)),
    ];
    let least = attack(&targets, if is_slow() { 1_000_000 } else { 100_000 }, 200);
    // The descents do get to where bodies nearly touch: the certifier cuts at 1e-7 m.
    assert!(least < 1e-5, "the closest any descent came is {least} m");
}

/// The same for regions by sums of squares.
#[test]
fn no_attack_finds_a_collision_in_regions_by_sums_of_squares() {
    let folder = tempfile::tempdir().expect("a folder");
    let by_sums = ["--certify", "sos", "--coverage", "0.6"].map(str::to_owned);
    let targets = ["slider-gap", "hinge", "two-rooms", "bottle-cap-3dof", "bottle-cap-4dof"]
        .map(|name| made(folder.path(), name, name, &by_sums));
    for target in &targets {
        let file = folder.path().join(&target.name).join("certify/certificates.bin");
        let certificates: CertificatesFile =
            store::read_bin(&file, Some(&target.scene.digest)).expect("it was certified");
        let mut proofs = certificates.regions.iter().flat_map(|region| &region.pairs);
        assert!(
            proofs.all(|pair| matches!(pair.proof, PairProof::SumOfSquares(_))),
            "{}: another kind of proof",
            target.name
        );
    }
    let least = attack(&targets, if is_slow() { 1_000_000 } else { 100_000 }, 200);
    // A region is shrunk until it is certified, so none comes as near as where swept hulls cut.
    assert!(least < 1e-3, "the closest any descent came is {least} m");
}

/// Unit rows of a box.
fn box_region(lower: &[f64], upper: &[f64]) -> Region {
    let n = lower.len();
    let row = |j: usize, sign: f64| (0..n).map(|k| if k == j { sign } else { 0.0 }).collect::<Vec<f64>>();
    Region {
        id: 0,
        parent: None,
        A: (0..n).flat_map(|j| [row(j, 1.0), row(j, -1.0)]).collect(),
        b: (0..n).flat_map(|j| [upper[j], -lower[j]]).collect(),
        center: lower.iter().zip(upper).map(|(l, u)| 0.5 * (l + u)).collect(),
        method: "by hand".to_owned(),
        certified: false,
        margin: 0.0,
    }
}

/// Whether one of `n` descents from samples of the region ends in a collision.
fn descents_find_a_collision(scene: &Scene, region: &Region, n: usize) -> bool {
    let checker = CollisionChecker::new(scene);
    let attack = Attack::new(scene, &checker, region);
    let mut walk = Walk::new(region, 7);
    (0..n).any(|_| {
        let start = walk.step().to_vec();
        let pairs = attack.pairs_by_distance(&start);
        pairs.iter().take(N_CLOSEST).any(|pair_idx| attack.descend(*pair_idx, &start).collides)
    })
}

/// The cube touches the gap's edge at lift = 0.1: a sliver of 1e-6 beyond it is too thin for samples.
#[test]
fn descents_find_a_sliver_that_samples_miss() {
    let scene = Scene::load(&scenes::scene("slider-gap")).expect("a scene of the project");
    let checker = CollisionChecker::new(&scene);
    let bad = box_region(&[-0.15, -0.05], &[0.15, 0.100001]);
    assert!(!checker.is_free(&[0.0, 0.1000009]), "known by hand");
    assert_eq!(Attack::new(&scene, &checker, &bad).colliding_sample(2_000, 3), None);
    assert!(descents_find_a_collision(&scene, &bad, 1));
    let good = box_region(&[-0.15, -0.05], &[0.15, 0.0999999]);
    assert!(!descents_find_a_collision(&scene, &good, 20));
}

/// Boxes around seeds of the arm, the smallest of a row of sizes with a colliding corner.
#[test]
fn descents_find_the_corner_of_a_box_that_collides() {
    let scene = Scene::load(&scenes::scene("iiwa14-shelf")).expect("a scene of the project");
    let checker = CollisionChecker::new(&scene);
    let (mut n_bad, mut n_missed_by_samples) = (0, 0);
    for seed in &SEEDS {
        let corner = |half: f64, k: u32| -> Vec<f64> {
            (0..7).map(|j| seed[j as usize] + if k >> j & 1 == 0 { -half } else { half }).collect()
        };
        let sizes = (1..40).map(|k| 0.005 * f64::from(k));
        let half = sizes.into_iter().find(|&half| (0..128).any(|k| !checker.is_free(&corner(half, k))));
        let Some(half) = half else { continue };
        let bad = box_region(&corner(half, 0), &corner(half, 127));
        n_bad += 1;
        assert!(descents_find_a_collision(&scene, &bad, 5), "half-width {half} around {seed:?}");
        let samples = Attack::new(&scene, &checker, &bad).colliding_sample(2_000, 1);
        n_missed_by_samples += usize::from(samples.is_none());
    }
    assert!(n_bad >= 5 && n_missed_by_samples >= 1, "{n_bad} boxes, {n_missed_by_samples} missed by samples");
}

/// Certified regions of the grasp band, widened by 0.1 mm, reach into the cap; samples and descents both say so.
#[test]
fn widened_regions_are_found_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let target = made(folder.path(), "cap", "bottle-cap-3dof", &[]);
    let checker = CollisionChecker::new(&target.scene);
    let (mut n_by_samples, mut n_by_descents) = (0, 0);
    for region in &target.regions {
        let mut bad = region.clone();
        bad.b.iter_mut().for_each(|b| *b += 1e-4);
        let attack = Attack::new(&target.scene, &checker, &bad);
        n_by_samples += usize::from(attack.colliding_sample(20_000, 1).is_some());
        n_by_descents += usize::from(descents_find_a_collision(&target.scene, &bad, 3));
    }
    let n = target.regions.len();
    assert!(2 * n_by_descents > n, "descents found {n_by_descents} of {n}");
    assert!(n_by_samples > 0 && n_by_descents >= n_by_samples, "samples found {n_by_samples}");
}
