//! Derivatives, folded powers and bounds against differences, single terms and samples.

use super::*;
use crate::interval;
use proptest::prelude::*;

/// A chain of `kinds` (0: slide) with axes and offsets from `numbers`.
fn side(kinds: &[u8], numbers: &[f64]) -> Side {
    let mut steps = Vec::new();
    let mut numbers = numbers.iter().copied().cycle();
    let mut next = || numbers.next().unwrap_or(0.3);
    for (coordinate, kind) in kinds.iter().enumerate() {
        let (axis, angle) = (unit([next(), next(), next()]), Interval::point(3.0 * next()));
        let (sin, cos) = angle.sin_cos();
        let R = crate::swept::rotation(&axis.map(Interval::point), sin, cos, Interval::ONE);
        steps.push(Step::Fixed { R, p: interval::point3(next(), next(), next()) });
        let axis = unit([next(), next(), next()]).map(Interval::point);
        let sign = if next() > 0.0 { 1.0 } else { -1.0 };
        steps.push(match kind {
            0 => Step::Slide { axis, sign, coordinate },
            _ => Step::Turn { axis, sign, coordinate },
        });
    }
    Side { steps, inflation: 0.0 }
}

fn unit(v: V) -> V {
    let norm = dot(&v, &v).sqrt();
    if norm > 1e-3 { v.map(|x| x / norm) } else { [0.0, 0.0, 1.0] }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]
    #[test]
    fn the_gap_stays_above_the_bounds(
        kinds in prop::collection::vec(0_u8..5, 1..=8),
        numbers in prop::collection::vec(-1.0_f64..1.0, 90),
        width in 0.01_f64..0.9,
        corner in 0_usize..8,
        taus in prop::collection::vec(-1.0_f32..1.0, 8),
        shifts in prop::collection::vec(-0.2_f64..0.2, 8),
        samples in prop::collection::vec(prop::collection::vec(-1.0_f64..1.0, 8), 40),
    ) {
        let n = kinds.len();
        let side = side(&kinds, &numbers);
        let shape = Shape::Box { half_extents: [0.3, 0.2, 0.1].into() };
        let r = unit([numbers[0], numbers[1], numbers[2]]).map(|x| (1.0 - 1e-15) * x);
        let half: Vec<f64> = (0..n).map(|k| width * (0.6 + 0.4 * numbers[k + 3])).collect();
        let center: Vec<f64> = (0..n).map(|k| 2.0 * numbers[k + 20]).collect();
        let at = |center: Vec<f64>, half: Vec<f64>| {
            let moving = Moving::new(&side, &shape, &Extent { center, half }, &r).expect("few joints");
            moving.series(corner).expect("a corner")
        };
        let series = at(center.clone(), half.clone());
        let tau = &taus[..n];
        let (plain, folded) = (series.fold(&[]), series.fold(tau));
        // Diagonal, and as large as makes the rows dominant: what is convex with it for sure.
        let mut w = vec![0.0_f32; n * n];
        for i in 0..n {
            let row: f64 = folded.hessian[i].iter().map(|x| x.abs()).sum();
            let lacking = row - folded.hessian[i][i].abs() - folded.hessian[i][i];
            w[i * n + i] = (lacking.max(0.0).sqrt() as f32).next_up();
        }
        let slopes: Vec<f64> = (0..n).map(|k| folded.slopes[k] + shifts[k]).collect();
        let bound = folded.by_tangent(tau, &w, &slopes).expect("it is convex");
        let mut most = 0.0_f64;
        for (sample_idx, sample) in samples.iter().enumerate() {
            let sigma: Vec<f64> =
                sample[..n].iter().map(|s| if sample_idx % 2 == 0 { *s } else { s.signum() }).collect();
            let q: Vec<f64> = (0..n).map(|k| center[k] + half[k] * sigma[k]).collect();
            let value = at(q, vec![0.0; n]).value;
            let gap = value - plain.value();
            let linear: f64 = (0..n).map(|k| plain.slopes_by_joints()[k] * half[k] * sigma[k]).sum();
            let shifted: f64 = value - folded.value() + sigma.iter().zip(&shifts).map(|(s, shift)| s * shift).sum::<f64>();
            prop_assert!((gap - linear).abs() <= plain.by_sizes() + series.rounding, "by sizes");
            prop_assert!(shifted >= bound, "{shifted} < {bound}");
            most = most.max((gap - linear).abs());
        }
        // Neither says nothing.
        prop_assert!(plain.by_sizes() <= 200.0 * most + 1e-6, "{} for {most}", plain.by_sizes());
    }
}

/// A series of nothing.
fn nothing(n: usize) -> Series {
    Series {
        n,
        half: [1.0; MAX_JOINTS],
        value: 0.0,
        slopes: [0.0; MAX_JOINTS],
        hessian: [[0.0; MAX_JOINTS]; MAX_JOINTS],
        constant: 0.0,
        products: [0.0; 1 << MAX_JOINTS],
        squares: [[0.0; MAX_JOINTS]; MAX_JOINTS],
        squares_of_pairs: [[[0.0; MAX_JOINTS]; MAX_JOINTS]; MAX_JOINTS],
        rest: 0.0,
        rounding: 0.0,
    }
}

/// C(σ), term by term.
fn of_products(folded: &Folded<'_>, sigma: &[f64]) -> f64 {
    let product = |set: usize| -> f64 {
        (0..folded.series.n).filter(|i| set >> i & 1 == 1).map(|i| sigma[i]).product()
    };
    folded.series.products.iter().enumerate().map(|(set, c)| c * product(set)).sum()
}

/// The folded series at σ, without D.
fn at(folded: &Folded<'_>, sigma: &[f64]) -> f64 {
    let n = folded.series.n;
    let mut sum = folded.value();
    for i in 0..n {
        sum += folded.slopes[i] * sigma[i] - 0.5 * folded.kept[i] * sigma[i] * sigma[i];
        for j in 0..n {
            sum += 0.5 * folded.hessian[i][j] * sigma[i] * sigma[j];
        }
    }
    sum + of_products(folded, sigma)
}

/// One term of the series alone, for every pattern of equal joints: `t` over the factorials of the powers.
#[test]
fn each_power_is_folded_as_derived() {
    let n = 4;
    let steps = [-1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0];
    let grid: Vec<[f64; 4]> = (0..9_usize.pow(4))
        .map(|k| [steps[k % 9], steps[k / 9 % 9], steps[k / 81 % 9], steps[k / 729]])
        .collect();
    let mut terms: Vec<Vec<usize>> = Vec::new();
    for i in 0..n {
        for j in i..n {
            for k in j..n {
                terms.push(vec![i, j, k]);
                terms.extend((k..n).map(|l| vec![i, j, k, l]));
            }
        }
    }
    for (term, t) in terms.iter().flat_map(|term| [(term, 0.7), (term, -0.7)]) {
        let mut series = nothing(n);
        match term[..] {
            [i, j, k] => series.add_third([i, j, k], t),
            [i, j, k, l] => series.add_fourth([i, j, k, l], t),
            _ => unreachable!("terms have three or four joints"),
        }
        let powers: Vec<i32> =
            (0..n).map(|i| term.iter().filter(|&&joint| joint == i).count() as i32).collect();
        let factorials: f64 = powers.iter().map(|&p| (1..=p).map(f64::from).product::<f64>()).product();
        let exact = |sigma: &[f64; 4]| -> f64 {
            t / factorials * sigma.iter().zip(&powers).map(|(s, &p)| s.powi(p)).product::<f64>()
        };
        let plain = series.fold(&[]);
        let off = |sigma: &[f64; 4]| (exact(sigma) - at(&plain, sigma)).abs();
        let most = grid.iter().map(off).fold(0.0, f64::max);
        assert!(most <= plain.rest + 1e-12, "{term:?}: {most} above {}", plain.rest);
        assert!(most >= 0.99 * plain.rest, "{term:?}: {most} far below {}", plain.rest);
        // Kept: as good at the corners, and concave with D in between.
        let kept = series.fold(&[1.0; 4]);
        let beyond = |sigma: &[f64; 4]| {
            let d: f64 = (0..n).map(|i| 0.5 * kept.kept[i] * sigma[i] * sigma[i]).sum();
            exact(sigma) - at(&kept, sigma) - d
        };
        assert!(kept.rest <= plain.rest);
        let has_kept = kept.kept.iter().any(|d| *d > 0.0);
        assert_eq!(has_kept, plain.rest > kept.rest, "{term:?}");
        for sigma in grid.iter().filter(|sigma| sigma.iter().all(|s| s.abs() == 1.0)) {
            assert!((exact(sigma) - at(&kept, sigma)).abs() <= kept.rest + 1e-12, "{term:?} at {sigma:?}");
        }
        let mut steepest = f64::NEG_INFINITY;
        for sigma in grid.iter().filter(|_| has_kept) {
            for i in (0..n).filter(|&i| sigma[i].abs() < 1.0) {
                let (mut below, mut above) = (*sigma, *sigma);
                below[i] -= 0.25;
                above[i] += 0.25;
                let bend = beyond(&below) + beyond(&above) - 2.0 * beyond(sigma);
                assert!(bend <= 1e-12, "{term:?} bends by {bend} in {i} at {sigma:?}");
                if kept.kept[i] > 0.0 {
                    steepest = steepest.max(bend);
                }
            }
        }
        assert!(!has_kept || steepest > -1e-12, "{term:?}: D is larger than it need be");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]
    /// Against differences of the gap itself, and the fifth order by what is left.
    #[test]
    fn derivatives_are_those_of_the_gap(
        kinds in prop::collection::vec(0_u8..5, 1..=6),
        numbers in prop::collection::vec(-1.0_f64..1.0, 90),
        sample in prop::collection::vec(-1.0_f64..1.0, 8),
    ) {
        let n = kinds.len();
        let side = side(&kinds, &numbers);
        let shape = Shape::Box { half_extents: [0.3, 0.2, 0.1].into() };
        let r = unit([numbers[0], numbers[1], numbers[2]]).map(|x| (1.0 - 1e-15) * x);
        let center: Vec<f64> = (0..n).map(|k| 2.0 * numbers[k + 20]).collect();
        let moving = |center: Vec<f64>, half: f64| {
            let extent = Extent { center, half: vec![half; n] };
            Moving::new(&side, &shape, &extent, &r).expect("few joints")
        };
        let value = |q: Vec<f64>| moving(q, 0.0).series(0).expect("a corner").value;
        let half = 0.3;
        let here = moving(center.clone(), half);
        let series = here.series(0).expect("a corner");
        let corner = corner_of(&shape, 0).expect("a corner");
        let moved = times(&here.R, &corner);
        let x: V = std::array::from_fn(|i| here.p[i] + moved[i]);
        let (b, rho) = here.levers(&x);
        let mut terms: Vec<(Vec<usize>, f64)> = Vec::new();
        here.each_derivative(&b, |joints, t| terms.push((joints.to_vec(), t)));
        // Central differences, one for each joint of the term.
        let step: f64 = 0.02;
        for (joints, t) in &terms {
            let order = joints.len();
            let mut difference = 0.0;
            for signs in 0..1_usize << order {
                let mut q = center.clone();
                let mut sign = 1.0;
                for (bit, &j) in joints.iter().enumerate() {
                    let up = signs >> bit & 1 == 1;
                    q[j] += if up { step } else { -step };
                    sign *= if up { 1.0 } else { -1.0 };
                }
                difference += sign * value(q);
            }
            let found = difference / (2.0 * step).powi(order as i32) * half.powi(order as i32);
            let scale = half.powi(order as i32) * here.length;
            prop_assert!((found - t).abs() < 2e-3 * scale, "{joints:?}: {found} for {t}");
        }
        // The polynomial of all terms.
        let q: Vec<f64> = (0..n).map(|k| center[k] + half * sample[k]).collect();
        let mut polynomial = series.value;
        polynomial += (0..n).map(|k| half * sample[k] * dot(&r, &b[k])).sum::<f64>();
        for (joints, t) in &terms {
            let powers = (0..n).map(|i| joints.iter().filter(|&&joint| joint == i).count());
            let factorials: f64 = powers.map(|p| (1..=p).map(|x| x as f64).product::<f64>()).product();
            polynomial += t / factorials * joints.iter().map(|&j| sample[j]).product::<f64>();
        }
        // Fifth derivatives one by one, not by tuples as the code counts them.
        let mut fifth = 0.0;
        for tuple in 0..n.pow(5) {
            let joints: Vec<usize> = (0..5).map(|place| tuple / n.pow(place) % n).collect();
            let least = joints.iter().min().copied().unwrap_or(0);
            let most = joints.iter().max().copied().unwrap_or(0);
            fifth += here.s[least] * rho[most] * half.powi(5) / 120.0;
        }
        prop_assert!((value(q) - polynomial).abs() <= fifth + series.rounding);
        let mut without = nothing(n);
        for (joints, t) in &terms {
            match joints[..] {
                [i, j] => without.add_second(i, j, *t),
                [i, j, k] => without.add_third([i, j, k], *t),
                [i, j, k, l] => without.add_fourth([i, j, k, l], *t),
                _ => {}
            }
        }
        prop_assert!((series.rest - without.rest - fifth).abs() <= 1e-9 * (1.0 + fifth));
    }
}

#[test]
fn a_second_order_that_stays_concave_is_refused() {
    // A point turns about z and is seen along x: its gap is largest at 0.
    let side = side(&[1], &[0.0]);
    let side = Side {
        steps: side
            .steps
            .into_iter()
            .map(|step| match step {
                Step::Fixed { R, .. } => Step::Fixed { R, p: interval::point3(0.0, 0.0, 0.0) },
                other => other,
            })
            .chain([Step::Fixed {
                R: crate::swept::rotation(
                    &interval::point3(0.0, 0.0, 1.0),
                    Interval::ZERO,
                    Interval::ONE,
                    Interval::ONE,
                ),
                p: interval::point3(1.0, 0.0, 0.0),
            }])
            .collect(),
        inflation: 0.0,
    };
    let extent = Extent { center: vec![0.0], half: vec![0.1] };
    let shape = Shape::Sphere { radius: 0.0 };
    let moving = Moving::new(&side, &shape, &extent, &[1.0, 0.0, 0.0]).expect("one joint");
    let series = moving.series(0).expect("a point");
    assert!((series.hessian[0][0] + 0.01).abs() < 1e-5, "{}", series.hessian[0][0]);
    let series = series.fold(&[0.0]);
    assert_eq!(series.by_tangent(&[0.0], &[0.0999], &[0.0]), None);
    let bound = series.by_tangent(&[0.0], &[0.1001], &[0.0]).expect("it is convex");
    let least = 0.1_f64.cos() - 1.0;
    assert!(bound <= least && least < bound + 1e-4, "{bound} for {least}");
    assert_eq!(series.by_tangent(&[0.0, 0.0], &[0.1001], &[0.0]), None);
    assert_eq!(series.by_tangent(&[f32::NAN], &[0.1001], &[0.0]), None);
    assert_eq!(series.by_tangent(&[0.0], &[0.1, 0.1, f32::INFINITY], &[0.0]), None);
    // Slopes that are no numbers bound nothing: a verifier demands more than the clearance.
    for slope in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let bound = series.by_tangent(&[0.0], &[0.1001], &[slope]);
        assert!(!bound.is_some_and(|bound| bound > f64::NEG_INFINITY), "{bound:?}");
    }
}

/// Every corner summed term by term.
#[test]
fn the_least_corner_is_found() {
    for n in 1..=MAX_JOINTS {
        let mut number = (0..).map(|k| (f64::from(k) * 0.7391).sin());
        let mut next = || number.next().unwrap_or(0.0);
        let mut series = nothing(n);
        for set in (0..1_usize << n).filter(|set| (3..=4).contains(&set.count_ones())) {
            series.products[set] = next();
        }
        let mut N = [[0.0; MAX_JOINTS]; MAX_JOINTS];
        for i in 0..n {
            for j in 0..n {
                N[i][j] = if j < i { N[j][i] } else { next() };
            }
        }
        let s = std::array::from_fn(|i| if i < n { next() } else { 0.0 });
        let folded = series.fold(&[]);
        let least = (0..1_usize << n)
            .map(|signs| {
                let sigma: Vec<f64> = (0..n).map(|i| if signs >> i & 1 == 1 { 1.0 } else { -1.0 }).collect();
                let mut sum = of_products(&folded, &sigma);
                for i in 0..n {
                    sum += s[i] * sigma[i];
                    sum -= (i + 1..n).map(|j| N[i][j] * sigma[i] * sigma[j]).sum::<f64>();
                }
                sum
            })
            .fold(f64::INFINITY, f64::min);
        assert!((folded.least_at_corners(&N, &s) - least).abs() < 1e-12, "{n} joints");
    }
}
