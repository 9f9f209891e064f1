//! CS_free of a scene with its bodies, for growers that certify.

use certificates::sums::grow::{GrowError, GrowSettings, Grower};
use certificates::{
    Candidate, CertifiedRegion, Certifier, CertifyError, CertifyOptions, CertifyOutcome, Purpose,
};
use collision::CollisionChecker;
use convex_sets::{HPolyhedron, Hyperrectangle};
use nalgebra::DVector;
use scene::{CollisionPair, Scene};
use std::collections::BTreeMap;

use crate::free_space::FreeSpace;
use crate::pairs::Pairs;

/// CS_free by a collision checker, and the scene behind it.
pub struct ProvableSpace<'a> {
    checker: &'a CollisionChecker,
    bodies: Bodies<'a>,
}

/// The bodies that must stay apart, and how far.
pub struct Bodies<'a> {
    scene: &'a Scene,
    clearances: BTreeMap<CollisionPair, f64>,
    certifier: Option<Certifier>,
    purpose: Purpose,
}

/// Sums of squares over more coordinates than this are out of reach: a Gram matrix of order 2^k for each face, point
/// and pair.
pub(crate) const MAX_TANGENT_COORDINATES: usize = 4;
/// Half-width of an angle's range beyond which tangents of half angles are useless; it is narrowed about the seed.
const MAX_HALF_ANGLE: f64 = 2.8;

impl<'a> ProvableSpace<'a> {
    /// `checker` was made for `scene`.
    pub fn new(scene: &'a Scene, checker: &'a CollisionChecker) -> Self {
        let pairs = scene.collision_pairs().into_iter().enumerate();
        let clearances = pairs.map(|(pair_idx, pair)| (pair, checker.clearance(pair_idx))).collect();
        let bodies = Bodies { scene, clearances, certifier: None, purpose: Purpose::default() };
        Self { checker, bodies }
    }

    /// With a certifier that guides growth, by its default options; `purpose` says what its cuts spare, `seed` is that
    /// of its samples.
    pub fn with_certifier(mut self, purpose: Purpose, seed: u64) -> Result<Self, CertifyError> {
        let clearance = |pair| self.bodies.clearance(pair);
        let options = CertifyOptions::default();
        self.bodies.certifier = Some(Certifier::new(self.bodies.scene, clearance, &options, seed)?);
        self.bodies.purpose = purpose;
        Ok(self)
    }
}

impl FreeSpace for ProvableSpace<'_> {
    fn is_free(&self, q: &[f64]) -> bool {
        FreeSpace::is_free(self.checker, q)
    }

    fn edge_is_free(&self, q_0: &[f64], q_1: &[f64]) -> bool {
        FreeSpace::edge_is_free(self.checker, q_0, q_1)
    }

    fn pairs(&self) -> Option<&dyn Pairs> {
        Some(self.checker)
    }

    fn bodies(&self) -> Option<&Bodies<'_>> {
        Some(&self.bodies)
    }
}

impl Bodies<'_> {
    fn clearance(&self, pair: CollisionPair) -> f64 {
        // Every pair that the scene names has one.
        self.clearances.get(&pair).copied().unwrap_or(0.0)
    }

    /// `region`, cut where it is not provably free, about its middle or, where that is not free, about the first of
    /// `inside`; cuts keep all of `inside`. `None` if it is not certified, or there is no certifier.
    pub(crate) fn certified(
        &self,
        region: &HPolyhedron,
        inside: &[DVector<f64>],
        is_stopped: &(dyn Fn() -> bool + Sync),
    ) -> Option<CertifiedRegion> {
        let certifier = self.certifier.as_ref()?;
        let purpose = Purpose {
            keep: self.purpose.keep.iter().chain(inside).cloned().collect(),
            spaces: self.purpose.spaces.clone(),
        };
        let middle = region.interior_point().ok().map(|ball| ball.center);
        middle.into_iter().chain(inside.first().cloned()).find_map(|center| {
            let candidate = Candidate { region_id: 0, polyhedron: region.clone(), center };
            match certifier.certify_region(&candidate, &purpose, is_stopped) {
                Ok(CertifyOutcome::Certified(certified)) => Some(*certified),
                // Also a point that is not strictly inside.
                Ok(_) | Err(_) => None,
            }
        })
    }

    /// A polytope about the hull of `points` inside `bounds`, grown by sums of squares.
    pub(crate) fn tangent_polytope(
        &self,
        bounds: &Hyperrectangle,
        points: &[Vec<f64>],
        settings: GrowSettings,
    ) -> Result<HPolyhedron, GrowError> {
        let n = self.scene.dim();
        let seed: Vec<f64> =
            (0..n).map(|j| points.iter().map(|q| q[j]).sum::<f64>() / points.len() as f64).collect();
        let mut bounds = bounds.clone();
        for (j, coordinate) in self.scene.coordinates.iter().enumerate() {
            if coordinate.kind == scene::CoordinateKind::Revolute {
                bounds.lower[j] = bounds.lower[j].max(seed[j] - MAX_HALF_ANGLE);
                bounds.upper[j] = bounds.upper[j].min(seed[j] + MAX_HALF_ANGLE);
            }
        }
        let clearance = |pair| self.clearance(pair);
        let points: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
        let grower = Grower::within(self.scene, clearance, &bounds, &seed, settings)?;
        Ok(grower.grow_about(&points)?.polyhedron)
    }
}
