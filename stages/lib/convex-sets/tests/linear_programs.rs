//! The dual simplex against brute force over all vertices, on hand-known programmes and on random ones.

use convex_sets::lp::{LpOutcome, minimize};
use convex_sets::safe_lower_bound;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

/// Least value of cᵀx over the vertices of {A x ≤ b} ∩ box, `None` if there is no vertex: all choices of n
/// constraints, exact enough for small n.
fn least_vertex_value(
    c: &DVector<f64>,
    A: &DMatrix<f64>,
    b: &DVector<f64>,
    lower: &DVector<f64>,
    upper: &DVector<f64>,
    tol: f64,
) -> Option<f64> {
    let (m, n) = (A.nrows(), c.len());
    let mut rows: Vec<(DVector<f64>, f64)> = (0..m).map(|i| (A.row(i).transpose(), b[i])).collect();
    for j in 0..n {
        let mut e = DVector::zeros(n);
        e[j] = 1.0;
        rows.push((e.clone(), upper[j]));
        rows.push((-e, -lower[j]));
    }
    let mut best: Option<f64> = None;
    let mut chosen: Vec<usize> = (0..n).collect();
    loop {
        let G = DMatrix::from_fn(n, n, |k, j| rows[chosen[k]].0[j]);
        let h = DVector::from_fn(n, |k, _| rows[chosen[k]].1);
        if let Some(x) = G.lu().solve(&h)
            && x.iter().all(|v| v.is_finite())
            && rows.iter().all(|(a, b)| a.dot(&x) <= b + tol * (1.0 + a.norm()))
        {
            let value = c.dot(&x);
            best = Some(best.map_or(value, |b: f64| b.min(value)));
        }
        // Next combination.
        let mut k = n;
        while k > 0 && chosen[k - 1] == rows.len() - n + k - 1 {
            k -= 1;
        }
        if k == 0 {
            return best;
        }
        chosen[k - 1] += 1;
        for l in k..n {
            chosen[l] = chosen[l - 1] + 1;
        }
    }
}

fn vector(values: &[f64]) -> DVector<f64> {
    DVector::from_column_slice(values)
}

#[test]
fn corner_of_a_triangle() {
    let A = DMatrix::from_row_slice(1, 2, &[1.0, 1.0]);
    let (b, l, u) = (vector(&[1.0]), vector(&[0.0, 0.0]), vector(&[10.0, 10.0]));
    let outcome = minimize(&vector(&[-1.0, -2.0]), &A, &b, &l, &u);
    let LpOutcome::Optimal { x, value, multipliers } = outcome else { panic!("{outcome:?}") };
    assert!((x - vector(&[0.0, 1.0])).norm() < 1e-12);
    assert!((value + 2.0).abs() < 1e-12);
    assert!((multipliers[0] - 2.0).abs() < 1e-12, "dual: y = 2, the bound of x_0 carries the rest");
}

#[test]
fn no_rows_and_no_cost() {
    let (l, u) = (vector(&[-1.0, 2.0]), vector(&[3.0, 4.0]));
    let (A, b) = (DMatrix::zeros(0, 2), DVector::zeros(0));
    assert_eq!(minimize(&vector(&[1.0, -1.0]), &A, &b, &l, &u).optimal_value(), Some(-5.0));
    assert_eq!(minimize(&vector(&[0.0, 0.0]), &A, &b, &l, &u).optimal_value(), Some(0.0));
}

#[test]
fn rows_that_contradict_are_proven_infeasible() {
    // x + y ≤ 1 and x + y ≥ 1 + gap.
    let A = DMatrix::from_row_slice(2, 2, &[1.0, 1.0, -1.0, -1.0]);
    let (l, u) = (vector(&[-5.0, -5.0]), vector(&[5.0, 5.0]));
    for gap in [1.0, 1e-3, 1e-8] {
        let b = vector(&[1.0, -1.0 - gap]);
        let outcome = minimize(&vector(&[1.0, 0.3]), &A, &b, &l, &u);
        let LpOutcome::Infeasible { farkas } = outcome else { panic!("gap {gap}: {outcome:?}") };
        assert!(safe_lower_bound(&DVector::zeros(2), &A, &b, &l, &u, &farkas) > 0.0);
    }
    // Its twin, which touches, is feasible.
    let b = vector(&[1.0, -1.0]);
    let value = minimize(&vector(&[1.0, 0.0]), &A, &b, &l, &u).optimal_value().unwrap();
    assert!((value + 4.0).abs() < 1e-9);
}

#[test]
fn rows_without_coefficients() {
    let (A, l, u) = (DMatrix::zeros(1, 2), vector(&[0.0, 0.0]), vector(&[1.0, 1.0]));
    assert!(minimize(&vector(&[1.0, 1.0]), &A, &vector(&[-1.0]), &l, &u).is_infeasible());
    assert_eq!(minimize(&vector(&[1.0, 1.0]), &A, &vector(&[0.0]), &l, &u).optimal_value(), Some(0.0));
}

#[test]
fn fixed_coordinates_inverted_boxes_and_bad_numbers() {
    let A = DMatrix::from_row_slice(1, 2, &[1.0, 1.0]);
    let fixed =
        minimize(&vector(&[0.0, -1.0]), &A, &vector(&[1.0]), &vector(&[0.25, 0.0]), &vector(&[0.25, 9.0]));
    assert!((fixed.optimal_value().unwrap() + 0.75).abs() < 1e-12);
    let inverted =
        minimize(&vector(&[0.0, 1.0]), &A, &vector(&[1.0]), &vector(&[1.0, 0.0]), &vector(&[0.0, 1.0]));
    assert!(inverted.is_infeasible());
    let nan =
        minimize(&vector(&[f64::NAN, 1.0]), &A, &vector(&[1.0]), &vector(&[0.0, 0.0]), &vector(&[1.0, 1.0]));
    assert!(matches!(nan, LpOutcome::Undecided { .. }));
}

#[test]
fn units_of_the_coordinates_do_not_matter() {
    // The same set in metres and in micrometres.
    let scale = 1e-6;
    let A = DMatrix::from_row_slice(2, 2, &[1.0, 2.0, -3.0, 1.0]);
    let b = vector(&[1.0, 0.5]);
    let c = vector(&[-1.0, -1.0]);
    let plain = minimize(&c, &A, &b, &vector(&[0.0, 0.0]), &vector(&[1.0, 1.0])).optimal_value().unwrap();
    let mut A_small = A.clone();
    A_small.column_mut(1).unscale_mut(scale);
    let c_small = vector(&[-1.0, -1.0 / scale]);
    let small = minimize(&c_small, &A_small, &b, &vector(&[0.0, 0.0]), &vector(&[1.0, scale]))
        .optimal_value()
        .unwrap();
    assert!((plain - small).abs() < 1e-9, "{plain} {small}");
}

/// Many faces through one vertex, where a method without a guard may cycle.
#[test]
fn degenerate_cones_end() {
    for n in 2..8 {
        let m = 40 * n;
        let A = DMatrix::from_fn(m, n, |i, j| ((i * 7 + j * 13 + i * j) % 11) as f64 - 4.0);
        let b = DVector::zeros(m);
        let (l, u) = (DVector::from_element(n, -1.0), DVector::from_element(n, 1.0));
        for k in 0..20 {
            let c = DVector::from_fn(n, |j, _| ((k * 5 + j * 3) % 7) as f64 - 3.0);
            let outcome = minimize(&c, &A, &b, &l, &u);
            let LpOutcome::Optimal { value, multipliers, .. } = outcome else { panic!("{outcome:?}") };
            let bound = safe_lower_bound(&c, &A, &b, &l, &u, &multipliers);
            assert!(value - bound < 1e-9, "{value} {bound}");
        }
    }
}

/// Klee-Minty-like long skinny faces, 20 unknowns and 1000 rows.
#[test]
fn largest_intended_size() {
    let (n, m) = (20, 1000);
    let mut state = 12345_u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let A = DMatrix::from_fn(m, n, |_, _| random());
    let b = DVector::from_fn(m, |_, _| 0.05 + 0.1 * random().abs());
    let c = DVector::from_fn(n, |_, _| random());
    let (l, u) = (DVector::from_element(n, -10.0), DVector::from_element(n, 10.0));
    let outcome = minimize(&c, &A, &b, &l, &u);
    let LpOutcome::Optimal { x, value, multipliers } = outcome else { panic!("{outcome:?}") };
    assert!((&A * &x - &b).max() < 1e-8);
    assert!(value - safe_lower_bound(&c, &A, &b, &l, &u, &multipliers) < 1e-8);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]

    /// Rows are small integers, so many programmes are degenerate, many infeasible.
    #[test]
    fn agrees_with_brute_force(
        n in 1_usize..4,
        m in 0_usize..7,
        entries in prop::collection::vec(-3_i32..=3, 21),
        offsets in prop::collection::vec(-4_i32..=6, 7),
        costs in prop::collection::vec(-3_i32..=3, 3),
        log_units in prop::collection::vec(-6_i32..=6, 3),
    ) {
        // Each coordinate in units of its own, from 1/64 to 64.
        let unit = |j: usize| 2.0_f64.powi(log_units[j]);
        let A = DMatrix::from_fn(m, n, |i, j| f64::from(entries[i * 3 + j]) / unit(j));
        let b = DVector::from_fn(m, |i, _| f64::from(offsets[i]));
        let c = DVector::from_fn(n, |j, _| f64::from(costs[j]) / unit(j));
        let lower = DVector::from_fn(n, |j, _| -2.0 * unit(j));
        let upper = DVector::from_fn(n, |j, _| 3.0 * unit(j));
        let expected = least_vertex_value(&c, &A, &b, &lower, &upper, 1e-9);
        match minimize(&c, &A, &b, &lower, &upper) {
            LpOutcome::Optimal { x, value, multipliers } => {
                prop_assert!(expected.is_some_and(|e| (e - value).abs() < 1e-8), "{expected:?} {value}");
                prop_assert!((0..m).all(|i| A.row(i).transpose().dot(&x) <= b[i] + 1e-8));
                prop_assert!((0..n).all(|j| lower[j] <= x[j] && x[j] <= upper[j]));
                prop_assert!(multipliers.iter().all(|&y| y >= 0.0));
                let bound = safe_lower_bound(&c, &A, &b, &lower, &upper, &multipliers);
                prop_assert!(bound <= value && value - bound < 1e-8, "{bound} {value}");
            }
            LpOutcome::Infeasible { farkas } => {
                prop_assert!(expected.is_none(), "{expected:?}");
                let nothing = DVector::zeros(n);
                prop_assert!(safe_lower_bound(&nothing, &A, &b, &lower, &upper, &farkas) > 0.0);
            }
            LpOutcome::Undecided { .. } => prop_assert!(false, "undecided, expected {expected:?}"),
        }
    }

    /// Whatever the multipliers, the safe bound is not above the value at any feasible point.
    #[test]
    fn safe_bound_is_below_every_feasible_point(
        entries in prop::collection::vec(-1.0_f64..1.0, 12),
        slack in prop::collection::vec(0.0_f64..0.5, 4),
        point in prop::collection::vec(-1.0_f64..1.0, 3),
        costs in prop::collection::vec(-1.0_f64..1.0, 3),
        y in prop::collection::vec(-1.0_f64..3.0, 4),
    ) {
        let A = DMatrix::from_row_slice(4, 3, &entries);
        let x = vector(&point);
        let b = &A * &x + vector(&slack);
        let (l, u, c) = (vector(&[-1.0; 3]), vector(&[1.0; 3]), vector(&costs));
        let value = minimize(&c, &A, &b, &l, &u).optimal_value().unwrap();
        prop_assert!(value <= c.dot(&x) + 1e-9);
        prop_assert!(safe_lower_bound(&c, &A, &b, &l, &u, &vector(&y)) <= value + 1e-9);
    }
}
