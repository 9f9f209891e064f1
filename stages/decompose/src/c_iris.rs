//! C-IRIS: grown in TC-space with sum-of-squares certificates (Dai et al. 2023), emitted in C-space inside the preimage.
//!
//! The alternation between multipliers and faces is the library's (`certificates::sums::grow`), and takes the place of
//! the one that other methods share: one separation is the whole of it. What comes out rests on a solver's word; the
//! certifier proves it.

use certificates::sums::grow::GrowSettings;
use convex_sets::{HPolyhedron, Hyperellipsoid};
use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;

use crate::domain::Domain;
use crate::grower::{Grower, Growth};
use crate::options::Options;
use crate::seed::Witness;

/// How long to alternate; see the options of the same names.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TangentBudget {
    max_iterations: usize,
    least_growth: f64,
    max_margin: f64,
}

impl TangentBudget {
    pub(crate) fn new(options: &Options) -> Self {
        Self {
            max_iterations: options.c_iris_iterations,
            least_growth: options.c_iris_growth,
            max_margin: options.c_iris_margin,
        }
    }
}

/// See the module's head.
pub(crate) struct CIrisGrower;

impl Grower for CIrisGrower {
    fn separate(
        &mut self,
        domain: &Domain<'_>,
        _: &Hyperellipsoid,
        witness: &Witness,
        start: HPolyhedron,
        growth: &Growth,
        _: &mut ChaCha8Rng,
    ) -> HPolyhedron {
        let TangentBudget { max_iterations, least_growth, max_margin } = growth.tangent;
        let solver = conic::Settings::default();
        let settings = GrowSettings { max_iterations, least_growth, max_margin, solver };
        let points: Vec<Vec<f64>> = witness.ends().into_iter().map(|u| domain.q_from_u(u)).collect();
        let grown = domain
            .bodies()
            .and_then(|bodies| bodies.tangent_polytope(&domain.bounds_of_all(), &points, settings).ok());
        match grown {
            Some(P) => start.intersection(&domain.faces_over_u(&P)),
            // Nothing is claimed: no region.
            None => start.intersection(&nowhere(domain.dim())),
        }
    }

    fn is_whole(&self) -> bool {
        true
    }
}

/// A row that nothing satisfies.
fn nowhere(k: usize) -> HPolyhedron {
    HPolyhedron { A: DMatrix::zeros(1, k), b: DVector::from_element(1, -1.0) }
}
