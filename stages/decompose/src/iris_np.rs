//! IRIS-NP: nearest collisions by nonlinear programming, pair by pair (Petersen & Tedrake 2023).
//!
//! For each pair, nearest to the center first, the programme
//!
//! min ‖A (u - y)‖²  s.t.  gap(u) ≤ 0,  u ∈ P
//!
//! is solved from the center and from random points of P; the collision that it ends in gives a face, tangent to the
//! ellipsoid's level set, and a smaller P. After `max_failures` starts in a row without a collision the pair is done.
//!
//! Local searches miss collisions: on an arm up to 3 % of P. So P is then tested by samples (`sampled`), and programmes
//! start from those that collide, until the test (ε, δ) passes. A P with faces of earlier programmes is only tested.

use convex_sets::{HPolyhedron, HitAndRun, Hyperellipsoid};
use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

use crate::domain::Domain;
use crate::grower::{Grower, Growth};
use crate::nearest_collision::nearest_closing;
use crate::pairs::Pairs;
use crate::placing::{Face, Placing, Search};
use crate::sampled::until_tested;
use crate::seed::Witness;

/// Steps of the walk between two starts, for each dimension.
const MIXING_STEPS: usize = 5;

/// See the module's head.
pub(crate) struct IrisNpGrower;

/// P in the making: the start and the faces so far.
struct Growing {
    A: DMatrix<f64>,
    b: DVector<f64>,
    walk: HitAndRun,
}

impl Grower for IrisNpGrower {
    fn separate(
        &mut self,
        domain: &Domain<'_>,
        ellipsoid: &Hyperellipsoid,
        witness: &Witness,
        start: HPolyhedron,
        growth: &Growth,
        rng: &mut ChaCha8Rng,
    ) -> HPolyhedron {
        let (Some(pairs), Some(inverse)) = (domain.pairs(), ellipsoid.image_of_ball()) else { return start };
        let k = domain.dim();
        let placing = Placing::new(domain, ellipsoid, witness, growth.margin, Search::Gradient);
        let y = match domain.is_free(&ellipsoid.center) {
            true => ellipsoid.center.clone(),
            false => witness.point(),
        };
        let walk = HitAndRun::new(&start, &witness.point(), DMatrix::identity(k, k));
        let mut P = Growing { A: start.A.clone(), b: start.b.clone(), walk };
        let mut faces = Vec::new();
        let is_parted = start.n_faces() > 2 * k;
        let unparted = if is_parted { Vec::new() } else { by_gap(domain, pairs, &y) };
        for pair_idx in unparted {
            let mut n_failures = 0;
            let mut from = Some(y.clone());
            while n_failures <= growth.max_failures && faces.len() < growth.max_faces {
                let u = from.take().unwrap_or_else(|| P.sample(&witness.point(), rng));
                let found = nearest_collision(domain, pairs, pair_idx, (&ellipsoid.A, &inverse), &y, &P, &u);
                let face = found.and_then(|u| {
                    let boundary = placing.walk(&u);
                    let face = placing.nearest_face(&boundary);
                    // Sliding along the boundary may have left P.
                    face.filter(|face| face.a.dot(&u) > face.b).or_else(|| placing.face(&boundary))
                });
                match face {
                    Some(face) => {
                        P.push(&face);
                        faces.push(face);
                        n_failures = 0;
                    }
                    None => n_failures += 1,
                }
            }
        }
        until_tested(domain, placing, witness, (start, faces), growth, rng)
    }

    fn is_tested(&self) -> bool {
        true
    }
}

impl Growing {
    fn push(&mut self, face: &Face) {
        let m = self.A.nrows();
        let A = std::mem::replace(&mut self.A, DMatrix::zeros(0, 0));
        self.A = A.insert_row(m, 0.0);
        self.A.set_row(m, &face.a.transpose());
        self.b = std::mem::replace(&mut self.b, DVector::zeros(0)).insert_row(m, face.b);
        self.walk.push_row(&face.a, face.b);
    }

    /// A random point of P.
    fn sample(&mut self, inside: &DVector<f64>, rng: &mut ChaCha8Rng) -> DVector<f64> {
        if !self.walk.is_inside() {
            self.walk.restart(inside.as_slice());
        }
        for _ in 0..MIXING_STEPS * inside.len() {
            self.walk.step(rng);
        }
        DVector::from_column_slice(self.walk.point())
    }
}

/// The pairs that may collide somewhere in the domain, nearest at `y` first.
fn by_gap(domain: &Domain<'_>, pairs: &dyn Pairs, y: &DVector<f64>) -> Vec<usize> {
    // From y to the farther side of the unit box, in each coordinate.
    let reach = domain.dq_from_du(&y.map(|y| 1.0 + y.abs()));
    let mut gaps: Vec<(f64, usize)> = (0..pairs.n_pairs())
        .map(|pair_idx| (domain.gap(pairs, pair_idx, y).0, pair_idx))
        .filter(|&(gap, pair_idx)| gap <= pairs.displacement(pair_idx, &reach))
        .collect();
    gaps.sort_by(|p, q| p.0.total_cmp(&q.0));
    gaps.into_iter().map(|(_, pair_idx)| pair_idx).collect()
}

/// A collision of the pair in P that is locally nearest to `y`, searched from `from`.
fn nearest_collision(
    domain: &Domain<'_>,
    pairs: &dyn Pairs,
    pair_idx: usize,
    (A, inverse): (&DMatrix<f64>, &DMatrix<f64>),
    y: &DVector<f64>,
    P: &Growing,
    from: &DVector<f64>,
) -> Option<DVector<f64>> {
    let G = &P.A * inverse;
    let h = &P.b - &P.A * y;
    let mut gap = |w: &DVector<f64>| {
        let (gap, gradient) = domain.gap(pairs, pair_idx, &(y + inverse * w));
        Some((gap, inverse.tr_mul(&gradient)))
    };
    let w = nearest_closing(&mut gap, &G, &h, A * (from - y))?;
    let u = y + inverse * w;
    (!pairs.pair_is_free(pair_idx, &domain.q_from_u(&u))).then_some(u)
}
