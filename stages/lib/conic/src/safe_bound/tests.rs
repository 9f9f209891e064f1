//! Bounds against optima known by hand or found by the solver, and Farkas proofs against twins with a point.

use super::*;
use crate::program::Affine;
use crate::solve::{Settings, SolveStatus, solve};
use proptest::prelude::*;

/// Largest distance of a safe bound at the solver's multipliers from the optimum. Erring side: the test fails.
const TOL_BOUND: f64 = 1e-6;

const BOX: f64 = 10.0;

/// min ½ (x − 3)² + ½ (y − 3)² s.t. x + y ≤ 2, whose value is 4.
fn half_plane() -> ConicProgram {
    let mut program = ConicProgram::new(2);
    program.add_square_cost(1.0, Affine::new(vec![(0, 1.0)], -3.0));
    program.add_square_cost(1.0, Affine::new(vec![(1, 1.0)], -3.0));
    program.add_less_equal(vec![(0, 1.0), (1, 1.0)], 2.0);
    program
}

#[test]
fn exact_multipliers_give_the_value() {
    let bound = safe_lower_bound(&half_plane(), &[2.0], &[1.0, 1.0], &[-BOX; 2], &[BOX; 2]);
    assert!(bound <= 4.0 && bound > 4.0 - 1e-12, "{bound}");
}

#[test]
fn any_multipliers_give_a_bound() {
    for y in [[-1.0], [0.0], [1.0], [1e9], [f64::NAN], [f64::INFINITY]] {
        for x_hat in [[0.0, 0.0], [5.0, -7.0], [f64::NAN, f64::INFINITY]] {
            let bound = safe_lower_bound(&half_plane(), &y, &x_hat, &[-BOX; 2], &[BOX; 2]);
            assert!(bound <= 4.0, "{bound}");
        }
    }
}

#[test]
fn without_bounds_a_rounding_of_the_gradient_says_nothing() {
    let bound = safe_lower_bound(&half_plane(), &[1.9], &[1.0, 1.0], &[], &[]);
    assert_eq!(bound, f64::NEG_INFINITY);
}

#[test]
fn short_multipliers_count_as_zero() {
    assert!(safe_lower_bound(&half_plane(), &[], &[], &[-BOX; 2], &[BOX; 2]) <= 4.0);
    assert!(!safe_farkas(&half_plane(), &[], &[-BOX; 2], &[BOX; 2]));
}

#[test]
fn heads_of_cones_are_raised() {
    let mut program = ConicProgram::new(3);
    program.add_second_order_cone(Affine::variable(0), vec![Affine::variable(1), Affine::variable(2)]);
    let y = project_dual(&program, &[4.9, 3.0, 4.0]);
    assert!(y[0] >= 5.0 && y[0] < 5.0 + 1e-12);
    assert_eq!(y[1..], [3.0, 4.0]);
    assert_eq!(project_dual(&program, &[6.0, 3.0, 4.0]), [6.0, 3.0, 4.0]);
    assert_eq!(project_dual(&program, &[1.0, f64::INFINITY, 0.0]), [0.0; 3]);
}

/// x ≤ a and x ≥ 1: infeasible for a < 1 only, however near.
#[test]
fn farkas_on_both_sides_of_touching() {
    let touching = |a: f64| {
        let mut program = ConicProgram::new(1);
        program.add_less_equal(vec![(0, 1.0)], a);
        program.add_less_equal(vec![(0, -1.0)], -1.0);
        safe_farkas(&program, &[1.0, 1.0], &[-BOX], &[BOX])
    };
    assert!(touching(1.0 - 1e-12));
    assert!(!touching(1.0));
    assert!(!touching(1.0 + 1e-12));
}

/// The same with b known within 1e-3: what is proven holds for every b within.
#[test]
fn tolerances_of_b_are_paid_for() {
    let touching = |a: f64| {
        let mut program = ConicProgram::new(1);
        let row = program.add_less_equal(vec![(0, 1.0)], a);
        program.add_less_equal(vec![(0, -1.0)], -1.0);
        program.set_tolerance(row, 1e-3);
        safe_farkas(&program, &[1.0, 1.0], &[-BOX], &[BOX])
    };
    assert!(touching(0.9989));
    assert!(!touching(0.9991));
    let mut program = half_plane();
    program.set_tolerance(0, 0.5);
    let bound = safe_lower_bound(&program, &[2.0], &[1.0, 1.0], &[-BOX; 2], &[BOX; 2]);
    assert!(bound <= 3.0 && bound > 3.0 - 1e-12, "{bound}");
}

/// ‖(x, y)‖ ≤ 1 and x + y ≥ a: infeasible for a > √2.
#[test]
fn farkas_of_a_disc_and_a_half_plane() {
    let disc = |a: f64| {
        let mut program = ConicProgram::new(2);
        program
            .add_second_order_cone(Affine::new(vec![], 1.0), vec![Affine::variable(0), Affine::variable(1)]);
        program.add_less_equal(vec![(0, -1.0), (1, -1.0)], -a);
        let solution = solve(&program, &Settings::default()).unwrap();
        (solution.status, safe_farkas(&program, &solution.y, &[-BOX; 2], &[BOX; 2]))
    };
    assert_eq!(disc(1.4143), (SolveStatus::PrimalInfeasible, true));
    assert!(!disc(1.41).1);
}

/// A feasible programme: rows through or above a known point, squares, cones around that point.
#[derive(Debug, Clone)]
struct Instance {
    point: Vec<f64>,
    program: ConicProgram,
}

const N: usize = 4;

fn instance() -> impl Strategy<Value = Instance> {
    let vector = || proptest::collection::vec(-2.0..2.0_f64, N);
    let row = || (vector(), 0.0..1.0_f64);
    (
        vector(),
        vector(),
        proptest::collection::vec((vector(), -2.0..2.0_f64, 0.1..3.0_f64), 0..4),
        proptest::collection::vec(row(), 1..6),
        proptest::collection::vec(vector(), 0..2),
        proptest::collection::vec((vector(), vector(), vector(), 0.1..1.0_f64), 0..3),
    )
        .prop_map(|(point, c, squares, rows, equalities, cones)| {
            let sparse = |v: &[f64]| v.iter().copied().enumerate().collect::<Vec<_>>();
            let dot = |v: &[f64]| v.iter().zip(&point).map(|(a, b)| a * b).sum::<f64>();
            let mut program = ConicProgram::new(N);
            for (j, c) in c.into_iter().enumerate() {
                program.add_linear_cost(j, c);
            }
            for (d, e, weight) in squares {
                program.add_square_cost(weight, Affine::new(sparse(&d), e));
            }
            for (a, slack) in &rows {
                program.add_less_equal(sparse(a), dot(a) + slack);
            }
            for a in &equalities {
                program.add_equality(sparse(a), dot(a));
            }
            for (head, part_0, part_1, slack) in &cones {
                // head·x + constant ≥ ‖parts‖ holds at the point with `slack` to spare.
                let norm = dot(part_0).hypot(dot(part_1));
                program.add_second_order_cone(
                    Affine::new(sparse(head), norm - dot(head) + slack),
                    vec![Affine::new(sparse(part_0), 0.0), Affine::new(sparse(part_1), 0.0)],
                );
            }
            program.add_bounds(0, &[-BOX; N], &[BOX; N]);
            Instance { point, program }
        })
}

proptest! {
    /// At the solver's multipliers the bound is within 1e-6 of the optimum and not above it; the point of the
    /// instance, feasible by construction up to rounding, is not below it.
    #[test]
    fn bound_meets_the_optimum(instance in instance()) {
        let Instance { point, program } = instance;
        let solution = solve(&program, &Settings::default()).unwrap();
        prop_assert!(solution.status.has_solution(), "{:?}", solution.status);
        let bound = safe_lower_bound(&program, &solution.y, &solution.x, &[-BOX; N], &[BOX; N]);
        let scale = 1.0 + solution.objective.abs();
        prop_assert!(bound <= solution.objective + TOL_BOUND * scale);
        prop_assert!(bound >= solution.objective - TOL_BOUND * scale, "{bound} {}", solution.objective);
        prop_assert!(bound <= program.objective(&point) + 1e-9);
    }

    /// Multipliers and x̂ changed at will: the bound still holds at the feasible point.
    #[test]
    fn perturbed_multipliers_bound_too(
        instance in instance(),
        noise in proptest::collection::vec(-1.0..1.0_f64, 64),
        size in prop_oneof![Just(1e-9), Just(1e-3), Just(1.0), Just(1e3)],
    ) {
        let Instance { point, program } = instance;
        let solution = solve(&program, &Settings::default()).unwrap();
        let noisy = |values: &[f64]| values.iter().zip(noise.iter().cycle()).map(|(v, e)| v + size * e).collect::<Vec<_>>();
        let bound = safe_lower_bound(&program, &noisy(&solution.y), &noisy(&solution.x), &[-BOX; N], &[BOX; N]);
        prop_assert!(bound <= program.objective(&point) + 1e-9 * (1.0 + size));
        prop_assert!(!safe_farkas(&program, &noisy(&solution.y), &[-BOX; N], &[BOX; N]));
    }

    /// A row that excludes the whole programme's feasible set makes it infeasible, and Farkas proves it; its twin,
    /// the same row on the other side, is feasible and never proven.
    #[test]
    fn infeasible_is_proven_and_its_twin_is_not(instance in instance(), gap in 1e-3..1.0_f64) {
        let Instance { point, program } = instance;
        let objective_row: Vec<_> = (0..N).map(|j| (j, 1.0)).collect();
        let mut lowest = program.clone();
        let mut linear = ConicProgram::new(N);
        // Lowest value of Σ x_j over the rows alone.
        for j in 0..N {
            linear.add_linear_cost(j, 1.0);
        }
        let value = {
            let mut rows_only = lowest.clone();
            rows_only.set_objective_of(&linear);
            solve(&rows_only, &Settings::default()).unwrap().objective
        };
        lowest.add_less_equal(objective_row.clone(), value - gap);
        let solution = solve(&lowest, &Settings::default()).unwrap();
        prop_assert!(safe_farkas(&lowest, &solution.y, &[-BOX; N], &[BOX; N]), "{:?}", solution.status);
        let mut twin = program;
        twin.add_less_equal(objective_row, point.iter().sum::<f64>() + 1e-9);
        let solution = solve(&twin, &Settings::default()).unwrap();
        prop_assert!(!safe_farkas(&twin, &solution.y, &[-BOX; N], &[BOX; N]));
    }
}
