//! One pair of bodies in TC-space: the polynomials of a plane and of the points on its two sides.

use crate::pair_model::PairModel;
use crate::sums::bodies::{Points, choose_enclosure, points};
use crate::sums::tangent_space::variable;
use ipc_types::artefact::{CoreEnclosure, FrameChoice, SosJoint};
use kinematics::{PairChain, PairFrame, RationalPose};
use nalgebra::Vector3;
use scene::{CollisionPair, CoordinateKind, Scene, Shape};
use sos::{GramBasis, Monomial, Polynomial};

/// A pair with what sums of squares need of it; made once a scene.
#[derive(Debug, Clone)]
pub struct PairSums {
    /// For gaps and normals at configurations.
    pub model: PairModel,
    /// The joints between the bodies.
    pub chain: PairChain,
    /// Coordinates, sorted.
    pub coordinates: Vec<usize>,
    /// Kind of each of `coordinates`.
    pub kinds: Vec<CoordinateKind>,
    shapes: [Shape; 2],
    /// What dropped rotations add to the radii of both bodies together; each side counts all of it.
    pub inflation: f64,
}

/// One side of the plane: a body's points as polynomials over a denominator.
#[derive(Debug, Clone)]
pub struct SidePolynomials {
    /// Numerators of each point.
    pub points: Vec<[Polynomial; 3]>,
    /// D.
    pub denominator: Polynomial,
    /// Radius, with what dropped rotations add.
    pub radius: f64,
    /// Positions of the variables that move the body as seen from the frame.
    pub variables: Vec<usize>,
}

impl PairSums {
    /// The pair, to be proven apart by `clearance`.
    pub fn new(scene: &Scene, pair: CollisionPair, clearance: f64) -> Self {
        let chain = PairChain::new(scene, pair);
        let coordinates = chain.coordinates();
        Self {
            model: PairModel::new(scene, pair, clearance),
            kinds: coordinates.iter().map(|&j| scene.coordinates[j].kind).collect(),
            shapes: [pair.body_a, pair.body_b].map(|body| scene.bodies[body].shape.clone()),
            inflation: chain.inflation,
            coordinates,
            chain,
        }
    }

    /// The same pair over these coordinates, which include its own: for planes that move with all of them.
    pub fn over(self, coordinates: &[usize], kinds: &[CoordinateKind]) -> Self {
        Self { coordinates: coordinates.to_vec(), kinds: kinds.to_vec(), ..self }
    }

    /// Positions of the frames in `chain.frames`, those with the smallest programmes first: the middle of the chain.
    pub fn frame_order(&self) -> Vec<usize> {
        let cost = |frame: &PairFrame| {
            4_u64.pow(frame.to_a.joints.len() as u32) + 4_u64.pow(frame.to_b.joints.len() as u32)
        };
        let mut order: Vec<usize> = (0..self.chain.frames.len()).collect();
        order.sort_by_key(|&idx| (cost(&self.chain.frames[idx]), idx));
        order
    }

    /// The frame as certificates name it.
    pub fn frame_choice(&self, frame_idx: usize) -> FrameChoice {
        FrameChoice {
            link: self.chain.frames[frame_idx].link_idx as u32,
            n_dropped_a: self.chain.n_dropped_a as u32,
            n_dropped_b: self.chain.n_dropped_b as u32,
        }
    }

    /// Enclosures that fit the separating normal at `q`.
    pub fn enclosures(&self, frame_idx: usize, q: &[f64]) -> [CoreEnclosure; 2] {
        let n = self.model.tangent(frame_idx, q).n;
        let frame = &self.chain.frames[frame_idx];
        // The normal points from B to A; each body faces the other one.
        [(&frame.to_a, -1.0, 0), (&frame.to_b, 1.0, 1)].map(|(chain, sign, side)| {
            let n_S = chain.pose(q).rotation.inverse() * (n * sign);
            choose_enclosure(&self.shapes[side], &n_S)
        })
    }

    /// Both sides in frame `frame_idx`; `None` if an enclosure does not fit its shape or a coordinate is missing.
    pub fn sides(
        &self,
        frame_idx: usize,
        enclosures: &[CoreEnclosure; 2],
        joints: &[SosJoint],
    ) -> Option<[SidePolynomials; 2]> {
        if joints.len() != self.kinds.len() {
            return None;
        }
        let variables: Vec<_> = joints.iter().zip(&self.kinds).map(|(j, kind)| variable(j, *kind)).collect();
        let frame = self.chain.frames.get(frame_idx)?;
        let side = |chain: &kinematics::Chain, idx: usize| {
            let Points { points, radius } = points(&self.shapes[idx], enclosures[idx])?;
            let pose = RationalPose::new(chain, &variables)?;
            let moved_by = |v: &kinematics::TcVariable| {
                chain.joints.iter().any(|joint| joint.coordinate_idx == v.coordinate_idx)
            };
            Some(SidePolynomials {
                points: points.iter().map(|x: &Vector3<f64>| pose.point(x)).collect(),
                denominator: pose.denominator,
                radius: radius + self.inflation,
                variables: (0..variables.len()).filter(|&i| moved_by(&variables[i])).collect(),
            })
        };
        Some([side(&frame.to_a, 0)?, side(&frame.to_b, 1)?])
    }
}

impl SidePolynomials {
    /// The basis of the side's Gram forms: the plane is affine, the kinematics has degree 2, and a multiplier times a
    /// row has degree 3 in each variable of the side, so products of powers 0 and 1 are enough.
    pub fn basis(&self) -> GramBasis {
        GramBasis::multilinear(&self.variables)
    }

    /// Polynomial that the plane's coefficient number `at` multiplies at point `point_idx`: for i = 0…k the
    /// components of a_i at 3 i + component, then b_i at 3 (k + 1) + i. `k` is the number of variables.
    pub fn plane_slope(&self, point_idx: usize, at: usize, k: usize) -> Polynomial {
        let monomial = |i: usize| if i == 0 { Monomial::ONE } else { Monomial::variable(i - 1) };
        let (p, i) = if at < 3 * (k + 1) {
            (&self.points[point_idx][at % 3], at / 3)
        } else {
            (&self.denominator, at - 3 * (k + 1))
        };
        p.times(&Polynomial::term(monomial(i), 1.0))
    }
}
