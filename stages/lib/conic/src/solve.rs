//! Hands a programme to Clarabel: its settings and its statuses are named here and nowhere else.

use crate::program::{Affine, Cone, ConicProgram};
use crate::tolerances;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use std::collections::BTreeMap;

/// How the solver runs. There is no time limit: results must not depend on the machine.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Residual at which it stops. Smaller: more iterations, tighter bounds.
    pub tol_feasibility: f64,
    /// Gap at which it stops, absolute and relative. Smaller: more iterations, tighter bounds.
    pub tol_gap: f64,
    /// Most iterations.
    pub max_iterations: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            tol_feasibility: tolerances::TOL_FEASIBILITY,
            tol_gap: tolerances::TOL_GAP_ABSOLUTE,
            max_iterations: tolerances::MAX_ITERATIONS,
        }
    }
}

/// What the solver says. Never proof: `Solved` and `PrimalInfeasible` say only which multipliers to try.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolveStatus {
    /// Primal and dual solution within the tolerances.
    Solved,
    /// Primal and dual solution within reduced tolerances.
    AlmostSolved,
    /// `y` is meant as a Farkas vector (also at reduced accuracy).
    PrimalInfeasible,
    /// The objective is meant to be unbounded below (also at reduced accuracy).
    DualInfeasible,
    /// Iterations ran out; `x` and `y` are the last iterates.
    Limit,
    /// Numerical trouble; `x` and `y` are the last iterates.
    Failed,
}

impl SolveStatus {
    /// Whether `x` is meant as a solution, possibly of reduced accuracy.
    pub fn has_solution(self) -> bool {
        matches!(self, SolveStatus::Solved | SolveStatus::AlmostSolved)
    }
}

/// Result of a solve, in the sign convention `c + P x + Aᵀ y = 0`, `y ∈ K*`.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// What the solver says.
    pub status: SolveStatus,
    /// Primal values [n].
    pub x: Vec<f64>,
    /// Multipliers of the rows [m].
    pub y: Vec<f64>,
    /// Primal objective as computed by the solver, including constants of squares.
    pub objective: f64,
    /// Interior point iterations.
    pub iterations: u32,
}

/// The programme could not be handed to the solver.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ConicError {
    /// A variable of a row or square does not exist.
    #[error("variable {index} in {place} does not exist: the programme has {n_variables} variables")]
    NoSuchVariable {
        /// Where it stands.
        place: String,
        /// The index.
        index: usize,
        /// How many there are.
        n_variables: usize,
    },
    /// A number is NaN or infinite.
    #[error("{place} has the value {value}, expected a finite number")]
    NotFinite {
        /// Where it stands.
        place: String,
        /// The value.
        value: f64,
    },
    /// The solver refused the programme.
    #[error("the conic solver refused the programme: {reason}")]
    Refused {
        /// In the solver's words.
        reason: String,
    },
}

/// Solves `program`. `Err` only for data that are no programme; every outcome of the solver is a status.
pub fn solve(program: &ConicProgram, settings: &Settings) -> Result<Solution, ConicError> {
    validate(program)?;
    let n = program.n_variables();
    let (P, q, constant) = quadratic(program);
    let A = matrix(program.n_rows(), n, (0..program.n_rows()).map(|row| program.row(row)));
    let cones: Vec<SupportedConeT<f64>> = program
        .cones()
        .iter()
        .map(|&cone| match cone {
            Cone::Zero(n_rows) => SupportedConeT::ZeroConeT(n_rows),
            Cone::Nonnegative(n_rows) => SupportedConeT::NonnegativeConeT(n_rows),
            Cone::SecondOrder(n_rows) => SupportedConeT::SecondOrderConeT(n_rows),
            Cone::PositiveSemidefinite(order) => SupportedConeT::PSDTriangleConeT(order),
        })
        .collect();
    let mut solver = DefaultSolver::new(&P, &q, &A, program.b(), &cones, clarabel_settings(settings))
        .map_err(|error| ConicError::Refused { reason: error.to_string() })?;
    solver.solve();
    let solution = &solver.solution;
    Ok(Solution {
        status: status(solution.status),
        x: solution.x.clone(),
        y: solution.z.clone(),
        objective: solution.obj_val + constant,
        iterations: solution.iterations,
    })
}

fn status(status: SolverStatus) -> SolveStatus {
    match status {
        SolverStatus::Solved => SolveStatus::Solved,
        SolverStatus::AlmostSolved => SolveStatus::AlmostSolved,
        SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => {
            SolveStatus::PrimalInfeasible
        }
        SolverStatus::DualInfeasible | SolverStatus::AlmostDualInfeasible => SolveStatus::DualInfeasible,
        SolverStatus::MaxIterations | SolverStatus::MaxTime => SolveStatus::Limit,
        SolverStatus::NumericalError
        | SolverStatus::InsufficientProgress
        | SolverStatus::CallbackTerminated
        | SolverStatus::Unsolved => SolveStatus::Failed,
    }
}

fn clarabel_settings(settings: &Settings) -> DefaultSettings<f64> {
    DefaultSettings {
        verbose: false,
        max_iter: settings.max_iterations,
        tol_feas: settings.tol_feasibility,
        tol_gap_abs: settings.tol_gap,
        tol_gap_rel: settings.tol_gap,
        tol_infeas_abs: tolerances::TOL_INFEASIBLE,
        tol_infeas_rel: tolerances::TOL_INFEASIBLE,
        // One thread and one factorisation: the same bits on every machine of a kind.
        max_threads: 1,
        direct_solve_method: "qdldl".to_string(),
        ..DefaultSettings::default()
    }
}

/// ½ Σ w (d·x + e)² = ½ xᵀ P x + (Σ w e d)·x + ½ Σ w e²: P (upper triangle), c plus the linear part, the constant.
fn quadratic(program: &ConicProgram) -> (CscMatrix<f64>, Vec<f64>, f64) {
    let n = program.n_variables();
    let mut q = program.c().to_vec();
    let mut constant = 0.0;
    let mut entries: BTreeMap<(usize, usize), f64> = BTreeMap::new();
    for square in program.squares() {
        let Affine { terms, constant: e } = &square.form;
        constant += 0.5 * square.weight * e * e;
        for &(j, d_j) in terms {
            q[j] += square.weight * e * d_j;
            for &(k, d_k) in terms {
                if j <= k {
                    *entries.entry((k, j)).or_insert(0.0) += square.weight * d_j * d_k;
                }
            }
        }
    }
    let mut colptr = vec![0; n + 1];
    for &(column, _) in entries.keys() {
        colptr[column + 1] += 1;
    }
    for column in 0..n {
        colptr[column + 1] += colptr[column];
    }
    let rows = entries.keys().map(|&(_, row)| row).collect();
    (CscMatrix::new(n, n, colptr, rows, entries.into_values().collect()), q, constant)
}

/// Sparse rows as a matrix by columns; terms of the same variable are added.
fn matrix<'a>(n_rows: usize, n: usize, rows: impl Iterator<Item = &'a [(usize, f64)]>) -> CscMatrix<f64> {
    let mut columns: Vec<Vec<(usize, f64)>> = vec![Vec::new(); n];
    for (row, terms) in rows.enumerate() {
        for &(j, a) in terms {
            match columns[j].last_mut() {
                Some((last_row, sum)) if *last_row == row => *sum += a,
                _ => columns[j].push((row, a)),
            }
        }
    }
    let mut colptr = Vec::with_capacity(n + 1);
    let (mut rowval, mut nzval) = (Vec::new(), Vec::new());
    colptr.push(0);
    for column in columns {
        for (row, a) in column {
            rowval.push(row);
            nzval.push(a);
        }
        colptr.push(rowval.len());
    }
    CscMatrix::new(n_rows, n, colptr, rowval, nzval)
}

fn validate(program: &ConicProgram) -> Result<(), ConicError> {
    let n_variables = program.n_variables();
    let check = |place: &dyn Fn() -> String, terms: &[(usize, f64)], constant: f64| {
        if let Some(&(index, _)) = terms.iter().find(|&&(index, _)| index >= n_variables) {
            return Err(ConicError::NoSuchVariable { place: place(), index, n_variables });
        }
        let mut values = terms.iter().map(|&(_, a)| a).chain([constant]);
        match values.find(|value| !value.is_finite()) {
            Some(value) => Err(ConicError::NotFinite { place: place(), value }),
            None => Ok(()),
        }
    };
    for row in 0..program.n_rows() {
        check(&|| format!("row {row}"), program.row(row), program.b()[row])?;
    }
    for (square_idx, square) in program.squares().iter().enumerate() {
        check(&|| format!("square {square_idx}"), &square.form.terms, square.form.constant)?;
        check(&|| format!("weight of square {square_idx}"), &[], square.weight)?;
    }
    for (index, &c) in program.c().iter().enumerate() {
        check(&|| format!("cost of variable {index}"), &[], c)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// min ½ (x − 3)² + ½ (y − 3)² s.t. x + y ≤ 2: x = y = 1, value 4.
    #[test]
    fn projection_on_a_half_plane() {
        let mut program = ConicProgram::new(2);
        program.add_square_cost(1.0, Affine::new(vec![(0, 1.0)], -3.0));
        program.add_square_cost(1.0, Affine::new(vec![(1, 1.0)], -3.0));
        program.add_less_equal(vec![(0, 1.0), (1, 1.0)], 2.0);
        let solution = solve(&program, &Settings::default()).unwrap();
        assert_eq!(solution.status, SolveStatus::Solved);
        assert!((solution.x[0] - 1.0).abs() < 1e-7 && (solution.x[1] - 1.0).abs() < 1e-7);
        assert!((solution.objective - 4.0).abs() < 1e-7);
        assert!((solution.y[0] - 2.0).abs() < 1e-6, "c + P x + A'y = 0");
    }

    /// Distance from (3, 4) to the origin by a cone; the point is fixed by equalities.
    #[test]
    fn norm_by_a_second_order_cone() {
        let mut program = ConicProgram::new(3);
        program.add_linear_cost(0, 1.0);
        program.add_equality(vec![(1, 1.0)], 3.0);
        program.add_equality(vec![(2, 0.5), (2, 0.5)], 4.0);
        program.add_second_order_cone(Affine::variable(0), vec![Affine::variable(1), Affine::variable(2)]);
        let solution = solve(&program, &Settings::default()).unwrap();
        assert_eq!(solution.status, SolveStatus::Solved);
        assert!((solution.objective - 5.0).abs() < 1e-7);
    }

    /// Least λ with λ I − M ⪰ 0 is the greatest eigenvalue of M, for orders with and without an explicit formula.
    #[test]
    fn greatest_eigenvalue_by_a_semidefinite_cone() {
        for order in [1, 2, 3, 4, 7] {
            let M = nalgebra::DMatrix::from_fn(order, order, |i, j| {
                ((3 * i.min(j) + 5 * i.max(j)) as f64 * 0.7).sin()
            });
            let mut program = ConicProgram::new(1);
            program.add_linear_cost(0, 1.0);
            let mut svec = Vec::new();
            for j in 0..order {
                for i in 0..j {
                    svec.push(Affine::new(Vec::new(), -std::f64::consts::SQRT_2 * M[(i, j)]));
                }
                svec.push(Affine::new(vec![(0, 1.0)], -M[(j, j)]));
            }
            program.add_positive_semidefinite(svec);
            let solution = solve(&program, &Settings::default()).unwrap();
            assert_eq!(solution.status, SolveStatus::Solved);
            assert!((solution.x[0] - M.symmetric_eigenvalues().max()).abs() < 1e-7, "order {order}");
            let bound = crate::safe_lower_bound(&program, &solution.y, &solution.x, &[-9.0], &[9.0]);
            assert!(bound <= solution.objective + 1e-7, "safe, if not tight");
        }
    }

    /// A matrix with a negative diagonal entry cannot be made semidefinite: the infeasible twin.
    #[test]
    fn an_indefinite_matrix_is_infeasible() {
        let mut program = ConicProgram::new(1);
        let entry = |constant| Affine::new(Vec::new(), constant);
        program.add_positive_semidefinite(vec![Affine::variable(0), entry(0.5), entry(-1.0)]);
        assert_eq!(solve(&program, &Settings::default()).unwrap().status, SolveStatus::PrimalInfeasible);
    }

    #[test]
    fn data_that_are_no_programme_are_errors() {
        let mut program = ConicProgram::new(1);
        program.add_less_equal(vec![(1, 1.0)], 0.0);
        assert!(matches!(
            solve(&program, &Settings::default()),
            Err(ConicError::NoSuchVariable { index: 1, n_variables: 1, .. })
        ));
        let mut program = ConicProgram::new(1);
        program.add_less_equal(vec![(0, f64::NAN)], 0.0);
        let error = solve(&program, &Settings::default()).unwrap_err();
        assert_eq!(error.to_string(), "row 0 has the value NaN, expected a finite number");
    }

    #[test]
    fn unbounded_is_a_status() {
        let mut program = ConicProgram::new(1);
        program.add_linear_cost(0, 1.0);
        program.add_less_equal(vec![(0, 1.0)], 0.0);
        assert_eq!(solve(&program, &Settings::default()).unwrap().status, SolveStatus::DualInfeasible);
    }
}
