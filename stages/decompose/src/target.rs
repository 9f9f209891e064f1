//! The sets that are to be covered, and samples of their free parts.

use convex_sets::{HPolyhedron, HitAndRun, Hyperrectangle};
use nalgebra::DMatrix;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::coverage::contains;
use crate::free_space::FreeSpace;

/// Which set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum TargetKind {
    /// CS_free.
    Total,
    /// CG_free.
    Grasp,
    /// CP_free.
    Placement,
    /// CG_free ∩ CP_free.
    GraspPlacement,
}

impl TargetKind {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Total => "CS_free",
            Self::Grasp => "CG_free",
            Self::Placement => "CP_free",
            Self::GraspPlacement => "CG_free and CP_free",
        }
    }
}

/// A polytope whose free part is to be covered.
#[derive(Debug, Clone)]
pub(crate) struct Target {
    pub(crate) kind: TargetKind,
    /// The polytope in all coordinates.
    pub(crate) polyhedron: HPolyhedron,
    /// Its bounding box.
    pub(crate) bounds: Hyperrectangle,
    /// Whether the bounding box says all.
    is_box: bool,
}

/// Free samples of a set.
#[derive(Debug, Clone)]
pub(crate) struct Samples {
    pub(crate) free: Vec<Vec<f64>>,
    /// Samples drawn, free or not.
    pub(crate) n_drawn: usize,
}

/// Samples drawn before a set counts as nowhere free.
const MAX_DRAWS_WITHOUT_FREE: usize = 200_000;
/// Steps of the walk between two samples of a set that is no box.
const WALK_STEPS: usize = 12;

impl Target {
    /// `None` if the polytope is empty.
    pub(crate) fn new(kind: TargetKind, polyhedron: &HPolyhedron) -> Option<Self> {
        let bounds = polyhedron.bounding_box().ok()?;
        let explicit = polyhedron.explicit_bounds();
        let single = |i: usize| polyhedron.A.row(i).iter().filter(|v| **v != 0.0).count() <= 1;
        let is_box = (0..polyhedron.n_faces()).all(single);
        let bounds = if is_box { explicit } else { bounds };
        Some(Self { kind, polyhedron: polyhedron.clone(), bounds, is_box })
    }

    /// Uniform free samples: up to `n_free`, fewer if the free part is so small that far more draws would be needed.
    pub(crate) fn sample_free(&self, free: &dyn FreeSpace, n_free: usize, rng: &mut ChaCha8Rng) -> Samples {
        let mut samples = Samples { free: Vec::with_capacity(n_free), n_drawn: 0 };
        let mut walk = self.walk();
        let extent = &self.bounds.upper - &self.bounds.lower;
        let n = extent.len();
        let mut q = vec![0.0; n];
        let max_drawn = MAX_DRAWS_WITHOUT_FREE.max(20 * n_free);
        while samples.free.len() < n_free && samples.n_drawn < max_drawn {
            samples.n_drawn += 1;
            match &mut walk {
                Some(walk) => {
                    for _ in 0..WALK_STEPS {
                        walk.step(rng);
                    }
                    q.copy_from_slice(walk.point());
                }
                None => {
                    for j in 0..n {
                        q[j] = (self.bounds.lower[j] + extent[j] * rng.random::<f64>())
                            .min(self.bounds.upper[j]);
                    }
                    if !self.is_box && !contains(&self.polyhedron, &q) {
                        continue;
                    }
                }
            }
            if free.is_free(&q) {
                samples.free.push(q.clone());
            }
        }
        samples
    }

    /// A walk for a set with faces that are no bounds; `None` if the box can be sampled instead.
    fn walk(&self) -> Option<HitAndRun> {
        if self.is_box {
            return None;
        }
        let start = self.polyhedron.interior_point().ok()?.center;
        let shape = DMatrix::from_diagonal(&self.bounds.half_widths());
        Some(HitAndRun::new(&self.polyhedron, &start, shape))
    }

    /// Whether the set contains the whole box.
    pub(crate) fn contains_box(&self, other: &Hyperrectangle) -> bool {
        (0..self.polyhedron.n_faces()).all(|i| {
            let reach: f64 = (0..other.lower.len())
                .map(|j| {
                    let a = self.polyhedron.A[(i, j)];
                    (a * other.lower[j]).max(a * other.upper[j])
                })
                .sum();
            reach <= self.polyhedron.b[i]
        })
    }
}
