//! A conic programme as data: objective, rows, cones.

/// A factor of the cone K.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cone {
    /// s = 0, this many rows. Its dual cone is the whole space.
    Zero(usize),
    /// s ≥ 0, this many rows. Self-dual.
    Nonnegative(usize),
    /// s_0 ≥ ‖(s_1, …)‖₂, this many rows. Self-dual.
    SecondOrder(usize),
    /// svec of a positive semidefinite matrix of this order: upper triangle by columns, off-diagonals times √2; order
    /// · (order + 1) / 2 rows. Self-dual.
    PositiveSemidefinite(usize),
}

impl Cone {
    /// Number of rows.
    pub fn n_rows(self) -> usize {
        match self {
            Cone::Zero(n) | Cone::Nonnegative(n) | Cone::SecondOrder(n) => n,
            Cone::PositiveSemidefinite(order) => order * (order + 1) / 2,
        }
    }
}

/// An affine form `Σ coefficient · x_index + constant`. An index may occur more than once.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Affine {
    /// (index of the variable, coefficient).
    pub terms: Vec<(usize, f64)>,
    /// Constant part.
    pub constant: f64,
}

impl Affine {
    /// The form with these terms and constant.
    pub fn new(terms: Vec<(usize, f64)>, constant: f64) -> Self {
        Self { terms, constant }
    }

    /// The form that is variable `index`.
    pub fn variable(index: usize) -> Self {
        Self { terms: vec![(index, 1.0)], constant: 0.0 }
    }
}

/// A term `½ weight (form)²` of the objective, `weight ≥ 0`.
#[derive(Debug, Clone, PartialEq)]
pub struct Square {
    /// Weight, not negative.
    pub weight: f64,
    /// Affine form that is squared.
    pub form: Affine,
}

/// min ½ Σ_k w_k (d_k·x + e_k)² + c·x  s.t.  A x + s = b, s ∈ K.
///
/// The quadratic part is a sum of squares of forms and not a matrix P, so that it is convex in exact arithmetic
/// whatever the numbers are. The data count as exact: bounds hold for this programme with these doubles.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ConicProgram {
    n_variables: usize,
    c: Vec<f64>,
    squares: Vec<Square>,
    /// Row r of A x + s = b, as terms and b.
    rows: Vec<Vec<(usize, f64)>>,
    b: Vec<f64>,
    /// How far the true b of a row may lie from `b`, where not 0.
    b_tolerances: Vec<(usize, f64)>,
    cones: Vec<Cone>,
}

impl ConicProgram {
    /// A programme in `n_variables` variables with zero objective and no rows.
    pub fn new(n_variables: usize) -> Self {
        Self { n_variables, c: vec![0.0; n_variables], ..Self::default() }
    }

    /// Appends `count` variables; returns the index of the first.
    pub fn add_variables(&mut self, count: usize) -> usize {
        let first = self.n_variables;
        self.n_variables += count;
        self.c.resize(self.n_variables, 0.0);
        first
    }

    /// Adds `coefficient · x_index` to the objective.
    pub fn add_linear_cost(&mut self, index: usize, coefficient: f64) {
        self.c[index] += coefficient;
    }

    /// Adds `½ weight (form)²` to the objective. A negative weight counts as 0: the objective stays convex.
    pub fn add_square_cost(&mut self, weight: f64, form: Affine) {
        self.squares.push(Square { weight: weight.max(0.0), form });
    }

    /// Adds `terms · x = rhs`; returns the row.
    pub fn add_equality(&mut self, terms: Vec<(usize, f64)>, rhs: f64) -> usize {
        self.push_row(terms, rhs, Cone::Zero(1))
    }

    /// Adds `terms · x ≤ rhs`; returns the row.
    pub fn add_less_equal(&mut self, terms: Vec<(usize, f64)>, rhs: f64) -> usize {
        self.push_row(terms, rhs, Cone::Nonnegative(1))
    }

    /// Adds `lower ≤ x ≤ upper` as rows, for finite bounds; the entries belong to variables `first, first + 1, …`.
    pub fn add_bounds(&mut self, first: usize, lower: &[f64], upper: &[f64]) {
        for (offset, (&l, &u)) in lower.iter().zip(upper).enumerate() {
            if u.is_finite() {
                self.add_less_equal(vec![(first + offset, 1.0)], u);
            }
            if l.is_finite() {
                self.add_less_equal(vec![(first + offset, -1.0)], -l);
            }
        }
    }

    /// Adds `‖(parts_0, parts_1, …)‖₂ ≤ head`; returns the first of the `1 + parts.len()` rows.
    pub fn add_second_order_cone(&mut self, head: Affine, parts: Vec<Affine>) -> usize {
        let first = self.rows.len();
        self.cones.push(Cone::SecondOrder(1 + parts.len()));
        for form in std::iter::once(head).chain(parts) {
            // s = b − A x is the form itself.
            self.rows.push(form.terms.into_iter().map(|(j, a)| (j, -a)).collect());
            self.b.push(form.constant);
        }
        first
    }

    /// Says that the symmetric matrix with the entries `svec` (variables or forms, upper triangle by columns, off-
    /// diagonals times √2) is positive semidefinite; returns the first row. Its order follows from their number, which
    /// must be a triangular one: entries beyond the last full column are left out.
    pub fn add_positive_semidefinite(&mut self, svec: Vec<Affine>) -> usize {
        let first = self.rows.len();
        let order = (0..).take_while(|order| (order + 1) * (order + 2) / 2 <= svec.len()).count();
        let cone = Cone::PositiveSemidefinite(order);
        self.cones.push(cone);
        for form in svec.into_iter().take(cone.n_rows()) {
            self.rows.push(form.terms.into_iter().map(|(j, a)| (j, -a)).collect());
            self.b.push(form.constant);
        }
        first
    }

    /// Says that the true b of `row` is known only to lie within `tolerance` of the one given, because it was rounded.
    /// The solver takes no notice; safe bounds and Farkas proofs hold for every b within.
    pub fn set_tolerance(&mut self, row: usize, tolerance: f64) {
        if tolerance > 0.0 {
            self.b_tolerances.push((row, tolerance));
        }
    }

    /// (row, tolerance of its b), for those that have one.
    pub fn b_tolerances(&self) -> &[(usize, f64)] {
        &self.b_tolerances
    }

    /// Takes the objective of `other`, a programme in the same variables; the rows stay.
    pub fn set_objective_of(&mut self, other: &Self) {
        self.c.clone_from(&other.c);
        self.c.resize(self.n_variables, 0.0);
        self.squares.clone_from(&other.squares);
    }

    /// Number of variables.
    pub fn n_variables(&self) -> usize {
        self.n_variables
    }

    /// Number of rows of A.
    pub fn n_rows(&self) -> usize {
        self.rows.len()
    }

    /// The cones, in the order of the rows; neighbours of the same linear kind are one.
    pub fn cones(&self) -> &[Cone] {
        &self.cones
    }

    /// c, the linear part of the objective.
    pub fn c(&self) -> &[f64] {
        &self.c
    }

    /// The squares of the objective.
    pub fn squares(&self) -> &[Square] {
        &self.squares
    }

    /// Row `row` of A, sparse.
    pub fn row(&self, row: usize) -> &[(usize, f64)] {
        &self.rows[row]
    }

    /// b.
    pub fn b(&self) -> &[f64] {
        &self.b
    }

    /// Value of the objective at `x`, in ordinary arithmetic.
    pub fn objective(&self, x: &[f64]) -> f64 {
        let form = |form: &Affine| form.terms.iter().map(|&(j, a)| a * x[j]).sum::<f64>() + form.constant;
        let squares: f64 = self.squares.iter().map(|s| 0.5 * s.weight * form(&s.form).powi(2)).sum();
        squares + self.c.iter().zip(x).map(|(c, x)| c * x).sum::<f64>()
    }

    fn push_row(&mut self, terms: Vec<(usize, f64)>, rhs: f64, cone: Cone) -> usize {
        let grown = match (self.cones.last_mut(), cone) {
            (Some(Cone::Zero(n)), Cone::Zero(_)) | (Some(Cone::Nonnegative(n)), Cone::Nonnegative(_)) => {
                *n += 1;
                true
            }
            _ => false,
        };
        if !grown {
            self.cones.push(cone);
        }
        self.rows.push(terms);
        self.b.push(rhs);
        self.rows.len() - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_rows_share_a_cone() {
        let mut program = ConicProgram::new(2);
        program.add_equality(vec![(0, 1.0)], 1.0);
        program.add_equality(vec![(1, 1.0)], 1.0);
        program.add_bounds(0, &[0.0, f64::NEG_INFINITY], &[1.0, 2.0]);
        program.add_second_order_cone(Affine::variable(0), vec![Affine::variable(1)]);
        program.add_second_order_cone(Affine::variable(0), vec![Affine::variable(1)]);
        let expected = [Cone::Zero(2), Cone::Nonnegative(3), Cone::SecondOrder(2), Cone::SecondOrder(2)];
        assert_eq!(program.cones(), expected);
        assert_eq!(program.cones().iter().map(|c| c.n_rows()).sum::<usize>(), program.n_rows());
    }

    #[test]
    fn objective_adds_squares_and_linear_part() {
        let mut program = ConicProgram::new(1);
        program.add_square_cost(2.0, Affine::new(vec![(0, 1.0)], -3.0));
        program.add_linear_cost(0, 10.0);
        assert_eq!(program.objective(&[1.0]), 14.0);
    }
}
