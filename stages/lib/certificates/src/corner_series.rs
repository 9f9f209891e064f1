//! The series of a corner's gap, and how its powers are folded into a second order that can be bounded.
//!
//! The rules, and why they hold, are at the head of `stages/check/src/corners.rs`; symbols as there.

use ipc_types::artefact::{CONCAVE_ABSOLUTE, CONCAVE_SHARE};
use nalgebra::{SMatrix, SymmetricEigen};

/// Most joints of the moving side.
pub const MAX_JOINTS: usize = 8;

/// The series of a corner at the centre of a cell, by σ_i = δ_i / h_i.
#[derive(Debug, Clone)]
pub struct Series {
    n: usize,
    half: [f64; MAX_JOINTS],
    /// r·x at the centre.
    pub value: f64,
    /// Slopes, second order and constant that hold whichever squares are kept: those of the series and what cubes,
    /// fourth powers and products of squares add to them.
    slopes: [f64; MAX_JOINTS],
    hessian: Matrix,
    constant: f64,
    /// Coefficients over the cell of products of three and four different joints, by the set of the joints (bit i: joint
    /// i).
    products: [f64; 1 << MAX_JOINTS],
    /// Coefficients of σ_i² σ_j, i ≠ j.
    squares: Matrix,
    /// Coefficients of σ_i² σ_j σ_k, i ≠ j < k ≠ i.
    squares_of_pairs: [Matrix; MAX_JOINTS],
    /// For each joint: how much of what is lost goes where it is halved.
    sizes: [f64; MAX_JOINTS],
    /// What cubes, fourth powers and products of squares lose, and the fifth order.
    rest: f64,
    fifth: f64,
    /// Sum of the sizes of `products`.
    products_size: f64,
    /// What rounding may do to any of it, here and where it is verified.
    rounding: f64,
}

/// A series whose squares σ_i² beside other joints are 1 at the corners, for some i, and ½ ± ½ for the others.
#[derive(Debug, Clone)]
pub struct Folded<'a> {
    series: &'a Series,
    /// Slopes by σ.
    pub slopes: [f64; MAX_JOINTS],
    /// Ĥ, D included.
    hessian: Matrix,
    /// D_i: with it what is kept is concave in σ_i.
    kept: [f64; MAX_JOINTS],
    /// T.
    rest: f64,
}

impl Series {
    /// A series of `n` joints of half-widths `half` with nothing in it but its value at the centre, a bound of its fifth
    /// order over the cell, and one of rounding.
    pub fn new(n: usize, half: &[f64; MAX_JOINTS], value: f64, fifth: f64, rounding: f64) -> Self {
        let zero = [[0.0; MAX_JOINTS]; MAX_JOINTS];
        let width: f64 = half[..n].iter().sum();
        // Of the fifth order about half goes where the joint is halved that has a fifth of the width.
        let share = |half: f64| 2.5 * fifth * half / width.max(f64::MIN_POSITIVE);
        Self {
            n,
            half: *half,
            value,
            slopes: [0.0; MAX_JOINTS],
            hessian: zero,
            constant: 0.0,
            products: [0.0; 1 << MAX_JOINTS],
            squares: zero,
            squares_of_pairs: [zero; MAX_JOINTS],
            sizes: half.map(share),
            rest: 0.0,
            fifth,
            products_size: 0.0,
            rounding,
        }
    }

    /// Adds the derivative `t` by joint i over the cell.
    pub fn add_first(&mut self, i: usize, t: f64) {
        self.slopes[i] += t;
    }

    /// Adds the derivative `t` by joints i ≤ j over the cell.
    pub fn add_second(&mut self, i: usize, j: usize, t: f64) {
        self.hessian[i][j] += t;
        if i != j {
            self.hessian[j][i] += t;
        }
    }

    /// Adds the derivative `t` by joints i ≤ j ≤ k over the cell.
    pub fn add_third(&mut self, [i, j, k]: [usize; 3], t: f64) {
        if i < j && j < k {
            self.add_product(&[i, j, k], t);
            return;
        }
        if i == k {
            let c = t / 6.0;
            self.slopes[i] += 0.75 * c;
            self.lose(0.25 * c.abs(), &[(i, 0.875)]);
        } else {
            let (twice, once) = if i == j { (i, k) } else { (j, i) };
            self.squares[twice][once] = 0.5 * t;
            for (at, share) in [(twice, 0.75), (once, 0.5)] {
                self.sizes[at] += 0.25 * t.abs() * share;
            }
        }
    }

    /// Adds the derivative `t` by joints i ≤ j ≤ k ≤ l over the cell.
    pub fn add_fourth(&mut self, [i, j, k, l]: [usize; 4], t: f64) {
        if i == l {
            let c = t / 24.0;
            self.add_second(i, i, 2.0 * c);
            self.constant -= 0.125 * c;
            self.lose(0.125 * c.abs(), &[(i, 0.9375)]);
        } else if i == k || j == l {
            let (cubed, once) = if i == k { (i, l) } else { (j, i) };
            let c = t / 6.0;
            self.add_second(i, l, 0.75 * c);
            self.lose(0.25 * c.abs(), &[(cubed, 0.875), (once, 0.5)]);
        } else if i == j && k == l {
            let c = 0.25 * t;
            self.add_second(i, i, c);
            self.add_second(k, k, c);
            self.constant -= 0.25 * c;
            self.lose(0.25 * c.abs(), &[(i, 0.75), (k, 0.75)]);
        } else if i == j || j == k || k == l {
            let (twice, one, other) = if i == j {
                (i, k, l)
            } else if j == k {
                (j, i, l)
            } else {
                (k, i, j)
            };
            self.squares_of_pairs[twice][one][other] = 0.5 * t;
            for (at, share) in [(twice, 0.75), (one, 0.5), (other, 0.5)] {
                self.sizes[at] += 0.25 * t.abs() * share;
            }
        } else {
            self.add_product(&[i, j, k, l], t);
        }
    }

    /// Adds t σ_i σ_j … of different joints.
    fn add_product(&mut self, joints: &[usize], t: f64) {
        self.products[joints.iter().map(|&at| 1 << at).sum::<usize>()] = t;
        self.products_size += t.abs();
        for &at in joints {
            self.sizes[at] += 0.5 * t.abs();
        }
    }

    fn lose(&mut self, size: f64, shares: &[(usize, f64)]) {
        self.rest += size;
        for &(at, share) in shares {
            self.sizes[at] += share * size;
        }
    }

    /// With the squares of the joints in `kept` (bit i: joint i) as they are at the corners.
    pub fn fold(&self, kept: u8) -> Folded<'_> {
        let mut folded = Folded {
            series: self,
            slopes: self.slopes,
            hessian: self.hessian,
            kept: [0.0; MAX_JOINTS],
            rest: self.rest + self.fifth,
        };
        let n = self.n;
        for i in 0..n {
            let is_kept = kept >> i & 1 == 1;
            let share = if is_kept { 1.0 } else { 0.5 };
            let mut size = 0.0;
            for j in 0..n {
                let c = self.squares[i][j];
                folded.slopes[j] += share * c;
                size += c.abs();
                for k in j + 1..n {
                    let c = self.squares_of_pairs[i][j][k];
                    folded.hessian[j][k] += share * c;
                    folded.hessian[k][j] += share * c;
                    size += c.abs();
                }
            }
            if is_kept {
                folded.kept[i] = 2.0 * size;
                folded.hessian[i][i] += 2.0 * size;
            } else {
                folded.rest += 0.5 * size;
            }
        }
        folded
    }

    /// What every bound takes away.
    pub fn least_loss(&self) -> f64 {
        self.rest + self.fifth + self.rounding
    }

    /// Eigenvalues and eigenvectors of Ĥ.
    pub fn spectrum(&self) -> ([f64; MAX_JOINTS], Matrix) {
        eigen(&self.hessian, self.n)
    }

    /// How much the higher orders gain where joint k is halved; `spectrum` is that of Ĥ.
    pub fn gain(&self, k: usize, spectrum: &([f64; MAX_JOINTS], Matrix)) -> f64 {
        let (values, vectors) = spectrum;
        let mut second = 0.0;
        for i in (0..MAX_JOINTS).filter(|&i| values[i] < 0.0) {
            let size: f64 = (0..self.n).map(|k| vectors[k][i].abs()).sum();
            second -= values[i] * vectors[k][i].abs() * size;
        }
        SECOND_GAIN * second + self.sizes[k]
    }

    /// Whether the fifth order is most of what is taken away: then the cell is too wide for a series.
    pub fn is_wide(&self, less: f64) -> bool {
        self.fifth > WIDE_SHARE * less
    }
}

/// Joints whose squares are kept for a tangent at `tau`: those nearer to the ends of the cell than to its middle, where
/// the corners lose less than ½ ± ½.
pub fn kept_squares(tau: &[f32; MAX_JOINTS]) -> u8 {
    (0..MAX_JOINTS).filter(|&i| tau[i] * tau[i] > 0.5).map(|i| 1 << i).sum()
}

impl Folded<'_> {
    /// f(m) as far as the terms of the fourth order add to it: value and their constant.
    pub fn value(&self) -> f64 {
        self.series.value + self.series.constant
    }

    /// Slopes by the joints.
    pub fn by_joints(&self) -> [f64; MAX_JOINTS] {
        std::array::from_fn(|k| self.slopes[k] / self.series.half[k].max(f64::MIN_POSITIVE))
    }

    /// What second to fifth order take away at most, at little cost.
    pub fn crude(&self) -> f64 {
        let second: f64 = self.hessian.iter().flatten().map(|x| x.abs()).sum();
        0.5 * second + self.series.products_size + self.rest + self.series.rounding
    }

    /// Vectors w and the matrix N = Σ w wᵀ + ε 1 that they stand for, with Ĥ + N positive semidefinite.
    pub fn concave(&self) -> Concave {
        let n = self.series.n;
        let (values, vectors) = eigen(&self.hessian, n);
        let mut w: Vec<[f32; MAX_JOINTS]> = Vec::new();
        for i in (0..MAX_JOINTS).filter(|&i| values[i] < -SMALLEST_CONCAVE) {
            let size = (-values[i]).sqrt();
            w.push(std::array::from_fn(|k| (size * vectors[k][i]) as f32));
        }
        Concave { N: concave_matrix(&w, n), w }
    }

    /// N of the vectors `w`.
    pub fn concave_matrix(&self, w: &[[f32; MAX_JOINTS]]) -> Matrix {
        concave_matrix(w, self.series.n)
    }

    /// Slopes of σᵀ (Ĥ + N) τ and −½ τᵀ (Ĥ + N) τ.
    pub fn tangent(&self, N: &Matrix, tau: &[f32; MAX_JOINTS]) -> ([f64; MAX_JOINTS], f64) {
        let n = self.series.n;
        let (mut slopes, mut constant) = ([0.0; MAX_JOINTS], 0.0);
        for i in 0..n {
            for j in 0..n {
                slopes[i] += (self.hessian[i][j] + N[i][j]) * f64::from(tau[j]);
            }
            constant -= 0.5 * slopes[i] * f64::from(tau[i]);
        }
        (slopes, constant)
    }

    /// f at σ, up to T, where no square is kept.
    pub fn at(&self, sigma: &[f64; MAX_JOINTS]) -> f64 {
        let (n, products) = (self.series.n, &self.series.products);
        let mut sum = self.value();
        for i in 0..n {
            sum += self.slopes[i] * sigma[i] + 0.5 * self.hessian[i][i] * sigma[i] * sigma[i];
            for j in i + 1..n {
                let mut last = self.hessian[i][j];
                for k in j + 1..n {
                    let set = 1 << i | 1 << j | 1 << k;
                    let with_fourth: f64 = (k + 1..n).map(|l| products[set | 1 << l] * sigma[l]).sum();
                    last += (products[set] + with_fourth) * sigma[k];
                }
                sum += sigma[i] * sigma[j] * last;
            }
        }
        sum
    }

    /// min { s·σ − ½ σᵀ (N + D) σ + C(σ) : σ ∈ [-1, 1]ⁿ } − T: with the kept squares it is concave in each σ_i, so that
    /// corners are enough.
    pub fn least_at_corners(&self, N: &Matrix, s: &[f64; MAX_JOINTS]) -> f64 {
        let (n, series) = (self.series.n, self.series);
        let mut values = series.products;
        for i in 0..n {
            values[1 << i] = s[i];
            for j in i + 1..n {
                values[1 << i | 1 << j] = -N[i][j];
            }
        }
        let values = &mut values[..1 << n];
        at_corners(values);
        let least = values.iter().fold(f64::INFINITY, |least, &value| least.min(value));
        let diagonal: f64 = (0..n).map(|i| N[i][i] + self.kept[i]).sum();
        least - 0.5 * diagonal - self.rest - series.rounding
    }

    /// Whether Ĥ + N is positive definite, by more than rounding.
    pub fn is_convex_with(&self, N: &Matrix) -> bool {
        let mut factor = self.hessian;
        for i in 0..self.series.n {
            for j in 0..=i {
                let sum: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
                let margin = if i == j { 0.1 * CONCAVE_ABSOLUTE } else { 0.0 };
                let rest = factor[i][j] + N[i][j] - margin - sum;
                if i == j && !(rest > 0.0) {
                    return false;
                }
                factor[i][j] = if i == j { rest.sqrt() } else { rest / factor[j][j] };
            }
        }
        true
    }
}

/// From the coefficients of a polynomial linear in each variable, by the set of its variables, to its values at the corners
/// of [-1, 1]ⁿ, by the set of variables that are −1: a Walsh–Hadamard transform.
fn at_corners(values: &mut [f64]) {
    let mut half = 1;
    while half < values.len() {
        for block in values.chunks_exact_mut(2 * half) {
            let (plus, minus) = block.split_at_mut(half);
            for (plus, minus) in plus.iter_mut().zip(minus) {
                (*plus, *minus) = (*plus + *minus, *plus - *minus);
            }
        }
        half *= 2;
    }
}

/// By the joints of a side.
pub type Matrix = [[f64; MAX_JOINTS]; MAX_JOINTS];

/// The concave part of a second order.
pub struct Concave {
    /// Vectors w.
    pub w: Vec<[f32; MAX_JOINTS]>,
    /// N.
    pub N: Matrix,
}

/// N = Σ w wᵀ + ε 1, as `ipc_types::artefact::CornersBound` has it.
pub fn concave_matrix(w: &[[f32; MAX_JOINTS]], n: usize) -> Matrix {
    let mut N = [[0.0; MAX_JOINTS]; MAX_JOINTS];
    let mut size = 0.0;
    for w in w {
        for i in 0..n {
            size += f64::from(w[i]) * f64::from(w[i]);
            for j in 0..n {
                N[i][j] += f64::from(w[i]) * f64::from(w[j]);
            }
        }
    }
    (0..n).for_each(|i| N[i][i] += CONCAVE_ABSOLUTE + CONCAVE_SHARE * size);
    N
}

/// Eigenvalues and eigenvectors (by columns) of the leading n × n block of a symmetric matrix, whose other entries are
/// zero. Where they do not converge, the rows' sums and the coordinates, which bound the matrix as well.
fn eigen(A: &Matrix, n: usize) -> ([f64; MAX_JOINTS], Matrix) {
    let matrix = SMatrix::<f64, MAX_JOINTS, MAX_JOINTS>::from_fn(|i, j| A[i][j]);
    match SymmetricEigen::try_new(matrix, f64::EPSILON, MAX_EIGEN_STEPS) {
        Some(SymmetricEigen { eigenvalues, eigenvectors }) => {
            (eigenvalues.into(), std::array::from_fn(|i| std::array::from_fn(|j| eigenvectors[(i, j)])))
        }
        None => (
            std::array::from_fn(|i| -A[i][..n].iter().map(|x| x.abs()).sum::<f64>()),
            std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 })),
        ),
    }
}

/// Share that goes of what a negative eigenpair takes away when a coordinate is halved.
const SECOND_GAIN: f64 = 0.375;
/// A cell is wide for a series if the fifth order is this share of what it takes away.
const WIDE_SHARE: f64 = 0.4;
/// Eigenvalues above the negative of this, metres, are left to the ε of N.
const SMALLEST_CONCAVE: f64 = 0.1 * CONCAVE_ABSOLUTE;
/// Steps after which the search for eigenvalues ends.
const MAX_EIGEN_STEPS: usize = 200;
