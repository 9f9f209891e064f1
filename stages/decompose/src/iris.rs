//! IRIS: exact separating planes, where what collides is convex in C-space (Deits & Tedrake 2015).
//!
//! If the bodies of a pair only translate, the pair collides exactly where D q ∈ M, M convex (`collision::translation`).
//! The point of this obstacle nearest to the ellipsoid's center c is a convex programme:
//!
//! min ‖A (u - c)‖²  s.t.  D q(u) = x_B - x_A + e,  x_A ∈ core of A,  x_B ∈ core of B,  ‖e‖ ≤ radii + clearance.
//!
//! The multipliers λ ∈ R³ of its equation are a direction in task space, and *every* λ gives a plane that holds:
//! λ·D q > σ_M(λ) is free for the pair. So planes rest on the support functions of the bodies, not on the solver.
//! Planes are placed nearest first; an obstacle that provably misses what is left of P (Farkas, rounded outward) needs
//! none. There is at most one plane a pair, so the budget of faces does not apply.
//!
//! To keep a witness inside, the hull of c and the witness takes the place of c, then the witness alone.

use collision::TranslatingPair;
use conic::{Affine, ConicProgram, Settings, safe_farkas, solve};
use convex_sets::{HPolyhedron, Hyperellipsoid};
use nalgebra::{DMatrix, DVector, Matrix3xX, Vector3};
use rand_chacha::ChaCha8Rng;
use scene::Shape;

use crate::domain::Domain;
use crate::grower::{Grower, Growth};
use crate::seed::Witness;

/// What one pair blocks, over u: D q(u) = D_u u + d.
struct Obstacle {
    pair: TranslatingPair,
    D_u: Matrix3xX<f64>,
    d: Vector3<f64>,
}

/// A plane a·u = b, free below it for its pair, and its distance from the center in the metric.
struct Plane {
    a: DVector<f64>,
    b: f64,
    distance: f64,
}

/// See the module's head.
pub(crate) struct IrisGrower {
    obstacles: Vec<Obstacle>,
}

impl IrisGrower {
    /// `None` if what collides is not known, or not convex.
    pub(crate) fn new(domain: &Domain<'_>) -> Option<Self> {
        let pairs = domain.pairs()?;
        let obstacle = |pair_idx| {
            let pair = pairs.convex_obstacle(pair_idx).ok()?;
            let mut D_u = Matrix3xX::zeros(domain.dim());
            let mut d = Vector3::zeros();
            for i in 0..3 {
                let row: Vec<f64> = pair.D.row(i).iter().copied().collect();
                let (over_u, constant) = domain.row_over_u(&row);
                D_u.set_row(i, &over_u.transpose());
                d[i] = constant;
            }
            Some(Obstacle { pair, D_u, d })
        };
        Some(Self { obstacles: (0..pairs.n_pairs()).map(obstacle).collect::<Option<_>>()? })
    }
}

impl Grower for IrisGrower {
    fn separate(
        &mut self,
        domain: &Domain<'_>,
        ellipsoid: &Hyperellipsoid,
        witness: &Witness,
        start: HPolyhedron,
        growth: &Growth,
        _: &mut ChaCha8Rng,
    ) -> HPolyhedron {
        let k = domain.dim();
        let mut planes: Vec<(usize, Plane)> = Vec::new();
        for (idx, obstacle) in self.obstacles.iter().enumerate() {
            match plane(obstacle, ellipsoid, witness, growth.margin) {
                Some(plane) => planes.push((idx, plane)),
                // A pair that comes nowhere near needs no plane. Otherwise nothing is claimed: no region.
                None if misses(obstacle, &start) => {}
                None => return with_row(&start, &DVector::zeros(k), -1.0),
            }
        }
        planes.sort_by(|(_, p), (_, q)| p.distance.total_cmp(&q.distance));
        let mut P = start;
        for (idx, plane) in planes {
            if !misses(&self.obstacles[idx], &P) {
                P = with_row(&P, &plane.a, plane.b);
            }
        }
        P
    }
}

fn with_row(P: &HPolyhedron, a: &DVector<f64>, b: f64) -> HPolyhedron {
    P.intersection(&HPolyhedron {
        A: DMatrix::from_row_slice(1, a.len(), a.as_slice()),
        b: DVector::from_element(1, b),
    })
}

/// The plane where the obstacle is nearest to the center, or to what must stay inside if that plane cuts it off.
fn plane(obstacle: &Obstacle, ellipsoid: &Hyperellipsoid, witness: &Witness, margin: f64) -> Option<Plane> {
    let ends: Vec<DVector<f64>> = witness.ends().into_iter().cloned().collect();
    let center = vec![ellipsoid.center.clone()];
    let hull = [center.clone(), ends.clone()].concat();
    for points in [&center, &hull, &ends] {
        let direction = nearest_direction(obstacle, &ellipsoid.A, points);
        if let Some(plane) =
            direction.and_then(|lambda| plane_along(obstacle, &lambda, ellipsoid, &ends, margin))
        {
            return Some(plane);
        }
    }
    // Closer to the obstacle than the solver is accurate: the direction between the bodies.
    let at = witness.point();
    let lambda = obstacle.pair.separation(&(&obstacle.D_u * &at + obstacle.d)).normal;
    plane_along(obstacle, &lambda, ellipsoid, &ends, margin)
}

/// The plane of direction λ, `margin` metres before the obstacle, or halfway to what must stay inside; `None` if that
/// is not strictly before it.
fn plane_along(
    obstacle: &Obstacle,
    lambda: &Vector3<f64>,
    ellipsoid: &Hyperellipsoid,
    kept: &[DVector<f64>],
    margin: f64,
) -> Option<Plane> {
    let lambda = lambda.try_normalize(0.0)?;
    let slope = obstacle.D_u.tr_mul(&lambda);
    let reach = obstacle.pair.support_value(&lambda) - lambda.dot(&obstacle.d);
    let room = kept.iter().map(|u| slope.dot(u) - reach).fold(f64::INFINITY, f64::min);
    let norm = slope.norm();
    if !(room > 0.0 && norm > 0.0) {
        return None;
    }
    let (a, b) = (-&slope / norm, -(reach + margin.min(0.5 * room)) / norm);
    let across = ellipsoid.image_of_ball()?.tr_mul(&a).norm();
    let distance = (b - a.dot(&ellipsoid.center)) / across;
    Some(Plane { a, b, distance })
}

/// Variables of the programmes: u [k], x_A, x_B, e [3 each], then weights of points.
struct Layout {
    k: usize,
}

impl Layout {
    const N_BODY: usize = 9;

    fn x_a(&self) -> usize {
        self.k
    }

    fn x_b(&self) -> usize {
        self.k + 3
    }

    fn e(&self) -> usize {
        self.k + 6
    }
}

/// The rows D_u u + d = (p_B + R_B x_B) - (p_A + R_A x_A) + e with x_A, x_B, e in their sets: the first three rows.
/// Also bounds of |variable|, for proofs.
fn obstacle_rows(obstacle: &Obstacle) -> (ConicProgram, Vec<f64>) {
    let layout = Layout { k: obstacle.D_u.ncols() };
    let mut program = ConicProgram::new(layout.k + Layout::N_BODY);
    let TranslatingPair { body_a: (shape_a, X_a), body_b: (shape_b, X_b), clearance, .. } = &obstacle.pair;
    for i in 0..3 {
        let mut terms: Vec<(usize, f64)> = (0..layout.k).map(|j| (j, obstacle.D_u[(i, j)])).collect();
        terms.extend((0..3).map(|j| (layout.x_a() + j, X_a.R[(i, j)])));
        terms.extend((0..3).map(|j| (layout.x_b() + j, -X_b.R[(i, j)])));
        terms.push((layout.e() + i, -1.0));
        program.add_equality(terms, X_b.p[i] - X_a.p[i] - obstacle.d[i]);
    }
    let mut reach = vec![1.0; layout.k];
    reach.extend(core_rows(&mut program, layout.x_a(), shape_a));
    reach.extend(core_rows(&mut program, layout.x_b(), shape_b));
    let radius = rounding_radius(shape_a) + rounding_radius(shape_b) + clearance;
    let e = (0..3).map(|j| Affine::variable(layout.e() + j)).collect();
    program.add_second_order_cone(Affine::new(Vec::new(), radius), e);
    reach.extend([radius; 3]);
    (program, reach)
}

/// Rows that hold three variables in the core of `shape`, and how far they reach.
fn core_rows(program: &mut ConicProgram, first: usize, shape: &Shape) -> [f64; 3] {
    let half = match shape {
        Shape::Box { half_extents } => [half_extents.x, half_extents.y, half_extents.z],
        Shape::Cylinder { radius, half_length } => [*radius, *radius, *half_length],
        Shape::Sphere { .. } => [0.0; 3],
        Shape::Capsule { half_length, .. } => [0.0, 0.0, *half_length],
    };
    program.add_bounds(first, &half.map(|h| -h), &half);
    if let Shape::Cylinder { radius, .. } = shape {
        let across = (0..2).map(|j| Affine::variable(first + j)).collect();
        program.add_second_order_cone(Affine::new(Vec::new(), *radius), across);
    }
    half
}

fn rounding_radius(shape: &Shape) -> f64 {
    match shape {
        Shape::Box { .. } | Shape::Cylinder { .. } => 0.0,
        Shape::Sphere { radius } | Shape::Capsule { radius, .. } => *radius,
    }
}

/// The direction in task space in which the obstacle is parted best from the hull of `points`, in the metric of `A`.
fn nearest_direction(obstacle: &Obstacle, A: &DMatrix<f64>, points: &[DVector<f64>]) -> Option<Vector3<f64>> {
    let k = A.ncols();
    let (mut program, _) = obstacle_rows(obstacle);
    // Weights of the points but the first: u - p_0 - Σ weight_i (p_i - p_0).
    let first = program.add_variables(points.len() - 1);
    let others = 1..points.len();
    for i in 0..k {
        let mut terms: Vec<(usize, f64)> = (0..k).map(|j| (j, A[(i, j)])).collect();
        let along = |p: &DVector<f64>| (0..k).map(|j| A[(i, j)] * p[j]).sum::<f64>();
        terms.extend(others.clone().map(|p| (first + p - 1, along(&points[0]) - along(&points[p]))));
        program.add_square_cost(1.0, Affine::new(terms, -along(&points[0])));
    }
    let n = points.len() - 1;
    program.add_bounds(first, &vec![0.0; n], &vec![f64::INFINITY; n]);
    if n > 0 {
        program.add_less_equal((0..n).map(|p| (first + p, 1.0)).collect(), 1.0);
    }
    let solution = solve(&program, &Settings::default()).ok()?;
    let lambda = Vector3::from_column_slice(solution.y.get(..3)?);
    lambda.iter().all(|v| v.is_finite()).then_some(lambda)
}

/// Whether the obstacle provably misses `P`, which lies in the unit box.
fn misses(obstacle: &Obstacle, P: &HPolyhedron) -> bool {
    let (mut program, reach) = obstacle_rows(obstacle);
    for i in 0..P.n_faces() {
        let row = (0..P.ambient_dimension()).map(|j| (j, P.A[(i, j)])).collect();
        program.add_less_equal(row, P.b[i]);
    }
    let lower: Vec<f64> = reach.iter().map(|r| -r).collect();
    solve(&program, &Settings::default())
        .is_ok_and(|solution| safe_farkas(&program, &solution.y, &lower, &reach))
}
