//! A pair of bodies, seen from each link between them.

use crate::cell::CellBox;
use crate::control_net::{ControlNet, sine_excess};
use crate::corner_bound::CornerPair;
use crate::separating_normal::{PlacedCore, gap_along, separating_normal};
use crate::side::Side;
use ipc_types::artefact::FrameChoice;
use kinematics::{PairChain, Support};
use nalgebra::Vector3;
use scene::{CollisionPair, CoordinateKind, Scene};

/// A pair of bodies with what the certifier needs of it; made once a scene.
#[derive(Debug, Clone)]
pub struct PairModel {
    /// The pair.
    pub pair: CollisionPair,
    /// Both bodies seen from each link between them.
    pub frames: Vec<PairFrame>,
    /// The pair seen so that one body rests and the other, which moves least, has corners.
    pub corners: Option<CornerPair>,
    /// Coordinates of the joints that matter, sorted.
    pub coordinates: Vec<usize>,
    /// Whether each of `coordinates` is an angle.
    pub is_angle: Vec<bool>,
    /// Displacement of the bodies for a unit of each of `coordinates`, metres a radian or 1.
    pub levers: Vec<f64>,
    /// Joints dropped next to A and next to B.
    pub n_dropped: [usize; 2],
    /// Sum of the bodies' radii and of what dropped rotations add.
    pub radius: f64,
    /// Distance to prove, metres.
    pub clearance: f64,
    /// κ + L must exceed the clearance by this, which is above the rounding of both.
    pub margin: f64,
}

/// Both bodies seen from a link.
#[derive(Debug, Clone)]
pub struct PairFrame {
    /// The link.
    pub link: usize,
    /// Bodies A and B.
    pub sides: [Side; 2],
}

/// The gap of a pair at a configuration, to first order.
#[derive(Debug, Clone)]
pub struct Tangent {
    /// Unit normal in the frame's link, from B to A.
    pub n: Vector3<f64>,
    /// Largest gap found, metres; negative if no plane separates the bodies.
    pub gap: f64,
    /// ∂ gap / ∂ q.
    pub g: Vec<f64>,
}

/// A normal, a row and their bounds on a cell.
#[derive(Debug, Clone)]
pub struct Plane {
    /// Unit normal in the frame's link, from B to A.
    pub n: Vector3<f64>,
    /// The row g, one coefficient a coordinate of the scene.
    pub g: Vec<f64>,
    /// κ for g = 0 and for g.
    pub kappa: [f64; 2],
    /// Control maps on which κ is reached, for g = 0 and for g, each for A and B.
    pub paths: [[Vec<u8>; 2]; 2],
}

/// Certificates keep at least this distance from the decision, metres. Larger: rejects more.
pub const MARGIN: f64 = 1e-9;

impl PairModel {
    /// The model of `pair`, to be proven apart by `clearance`.
    pub fn new(scene: &Scene, pair: CollisionPair, clearance: f64) -> Self {
        let chain = PairChain::new(scene, pair);
        let shapes = [&scene.bodies[pair.body_a].shape, &scene.bodies[pair.body_b].shape];
        let frames: Vec<PairFrame> = chain
            .frames
            .iter()
            .map(|frame| PairFrame {
                link: frame.link_idx,
                sides: [
                    Side::new(&frame.to_a, shapes[0], &scene.coordinates),
                    Side::new(&frame.to_b, shapes[1], &scene.coordinates),
                ],
            })
            .collect();
        let coordinates = chain.coordinates();
        let is_angle =
            coordinates.iter().map(|&j| scene.coordinates[j].kind == CoordinateKind::Revolute).collect();
        let levers = coordinates
            .iter()
            .map(|&j| {
                frames
                    .iter()
                    .flat_map(|frame| &frame.sides)
                    .flat_map(|side| &side.steps)
                    .filter(|step| step.coordinate == j)
                    .fold(f64::INFINITY, |least, step| least.min(step.lever))
            })
            .collect();
        let reach = frames
            .iter()
            .flat_map(|frame| &frame.sides)
            .map(|side| side.steps.iter().map(|step| step.p.norm()).sum::<f64>() + side.p_tail.norm())
            .fold(1.0, f64::max);
        Self {
            pair,
            corners: CornerPair::new(&frames),
            frames,
            coordinates,
            is_angle,
            levers,
            n_dropped: [chain.n_dropped_a, chain.n_dropped_b],
            radius: shapes[0].rounding_radius() + shapes[1].rounding_radius() + chain.inflation,
            clearance,
            margin: MARGIN * (0.1 * reach).max(1.0),
        }
    }

    /// The frames as the certificate names them.
    pub fn frame_choices(&self) -> Vec<FrameChoice> {
        self.frames
            .iter()
            .map(|frame| FrameChoice {
                link: frame.link as u32,
                n_dropped_a: self.n_dropped[0] as u32,
                n_dropped_b: self.n_dropped[1] as u32,
            })
            .collect()
    }

    /// What κ + L must exceed.
    pub fn demand(&self) -> f64 {
        self.clearance + self.margin
    }

    /// Largest gap found between the bodies at `q`, metres; negative if no plane separates them.
    pub fn gap(&self, q: &[f64]) -> f64 {
        self.gap_of(&self.placed_cores(0, q))
    }

    /// The cores in frame `frame_idx`.
    pub fn placed_cores(&self, frame_idx: usize, q: &[f64]) -> [PlacedCore; 2] {
        [0, 1].map(|k| {
            let side = &self.frames[frame_idx].sides[k];
            let (R, p) = side.pose(q);
            PlacedCore { core: side.core, R, p }
        })
    }

    /// Gap at `q` along `n`, fixed in frame `frame_idx`, metres.
    pub fn gap_along(&self, frame_idx: usize, q: &[f64], n: &Vector3<f64>) -> f64 {
        let [a, b] = self.placed_cores(frame_idx, q);
        gap_along(&a, &b, n) - self.radius
    }

    /// Whether the pair depends on the coordinate.
    pub fn depends_on(&self, j: usize) -> bool {
        self.coordinates.binary_search(&j).is_ok()
    }

    /// Gap and its gradient at `q`, the normal in frame `frame_idx`.
    pub fn tangent(&self, frame_idx: usize, q: &[f64]) -> Tangent {
        self.tangent_of(frame_idx, &self.placed_cores(frame_idx, q), q)
    }

    /// As [`PairModel::tangent`], where the cores lie so at `q`.
    pub fn tangent_of(&self, frame_idx: usize, cores: &[PlacedCore; 2], q: &[f64]) -> Tangent {
        let (n, gap) = separating_normal(&cores[0], &cores[1]);
        Tangent { n, gap: gap - self.radius, g: self.gradient_of(frame_idx, cores, q, &n) }
    }

    /// Gap of the cores that lie so.
    pub fn gap_of(&self, cores: &[PlacedCore; 2]) -> f64 {
        separating_normal(&cores[0], &cores[1]).1 - self.radius
    }

    /// Gradient at `q` of the gap along `n`, fixed in frame `frame_idx`.
    pub fn gradient(&self, frame_idx: usize, q: &[f64], n: &Vector3<f64>) -> Vec<f64> {
        self.gradient_of(frame_idx, &self.placed_cores(frame_idx, q), q, n)
    }

    fn gradient_of(
        &self,
        frame_idx: usize,
        cores: &[PlacedCore; 2],
        q: &[f64],
        n: &Vector3<f64>,
    ) -> Vec<f64> {
        let sides = &self.frames[frame_idx].sides;
        let mut g = vec![0.0; q.len()];
        for (k, factor) in [(0, 1.0), (1, -1.0)] {
            let PlacedCore { core, R, p } = &cores[k];
            // The witness of A lies against the normal, that of B along it.
            let w = R.tr_mul(n) * -factor;
            let x = p + R * core.soft_support_point(&w);
            sides[k].add_gradient(q, n, &x, factor, &mut g);
        }
        g
    }

    /// A plane for the cell, its normal fixed in frame `frame_idx`: the separating normal at the cell's centre and
    /// the gradient of the gap at the witnesses.
    pub fn plane(&self, net: &mut ControlNet, frame_idx: usize, cell: &CellBox) -> Plane {
        let Tangent { n, g, .. } = self.tangent(frame_idx, &cell.centers());
        self.kappa(net, frame_idx, cell, &n, &g)
    }

    /// κ on the cell for the normal `n`, fixed in frame `frame_idx`, with g = 0 and with the row `g`.
    pub fn kappa(
        &self,
        net: &mut ControlNet,
        frame_idx: usize,
        cell: &CellBox,
        n: &Vector3<f64>,
        g: &[f64],
    ) -> Plane {
        let sides = &self.frames[frame_idx].sides;
        let [a0, ag] = net.least(&sides[0], cell, n, g);
        let [b0, bg] = net.least(&sides[1], cell, &-n, g);
        let radius = self.radius * n.norm();
        let mut excess = 0.0;
        for step in sides.iter().flat_map(|side| &side.steps) {
            if step.kind == CoordinateKind::Revolute {
                excess += g[step.coordinate].abs() * sine_excess(cell.half(step.coordinate));
            }
        }
        let kappa = [a0.value + b0.value - radius, ag.value + bg.value - radius - excess];
        Plane { n: *n, g: g.to_vec(), kappa, paths: [[a0.path, b0.path], [ag.path, bg.path]] }
    }

    /// The coordinate of the pair whose halving gains most on the worst control path of `plane`, plus a little for
    /// its width; `None` if no coordinate has any width.
    pub fn split_coordinate(
        &self,
        frame_idx: usize,
        cell: &CellBox,
        plane: &Plane,
        with_row: bool,
    ) -> Option<usize> {
        let sides = &self.frames[frame_idx].sides;
        let zero = vec![0.0; plane.g.len()];
        let g = if with_row { &plane.g } else { &zero };
        let mut best: Option<(f64, usize)> = None;
        for side_idx in 0..2 {
            let r = if side_idx == 0 { plane.n } else { -plane.n };
            let side = &sides[side_idx];
            let value = |halved: usize| {
                crate::control_net::value_on_path(
                    side,
                    cell,
                    &r,
                    g,
                    &plane.paths[usize::from(with_row)][side_idx],
                    halved,
                )
            };
            let before = value(usize::MAX);
            for step in &side.steps {
                let (j, half) = (step.coordinate, cell.half(step.coordinate));
                let mut gain = value(j) - before + 1e-5 * step.lever * half;
                if step.kind == CoordinateKind::Revolute {
                    gain += g[j].abs() * (sine_excess(half) - sine_excess(0.5 * half));
                }
                if half > 0.0 && best.is_none_or(|(most, _)| gain > most) {
                    best = Some((gain, j));
                }
            }
        }
        best.map(|(_, j)| j)
    }

    /// Displacement of the bodies over the cell, metres: the largest over the joints.
    pub fn displacement(&self, cell: &CellBox) -> f64 {
        let widths = self.coordinates.iter().zip(&self.levers).map(|(&j, lever)| 2.0 * cell.half(j) * lever);
        widths.fold(0.0, f64::max)
    }

    /// Geometric mean of the displacements over the cell: cells are tried in its order, largest first.
    pub fn size(&self, cell: &CellBox) -> f64 {
        let k = self.coordinates.len().max(1) as f64;
        let logs = self.coordinates.iter().zip(&self.levers).map(|(&j, lever)| (cell.half(j) * lever).ln());
        (logs.sum::<f64>() / k).exp()
    }

    /// Positions of the frames, best first: by κ on the given cells, then by the number of control points.
    pub fn frame_order(&self, net: &mut ControlNet, cells: &[CellBox]) -> Vec<usize> {
        let rows = |idx: usize| {
            self.frames[idx].sides.iter().map(|side| 3_f64.powi(side.n_turns() as i32)).sum::<f64>()
        };
        let mut scored: Vec<(f64, usize)> = (0..self.frames.len())
            .filter(|&idx| self.is_usable(idx))
            .map(|idx| {
                let score: f64 = cells
                    .iter()
                    .map(|cell| {
                        let plane = self.plane(net, idx, cell);
                        plane.kappa[0].max(plane.kappa[1])
                    })
                    .sum();
                (score, idx)
            })
            .collect();
        // Scores that differ by rounding count as equal.
        let rounded = |score: f64| (score * 1e9).round();
        scored.sort_by(|a, b| {
            let by_score = rounded(b.0).total_cmp(&rounded(a.0));
            by_score.then(rows(a.1).total_cmp(&rows(b.1))).then(a.1.cmp(&b.1))
        });
        scored.into_iter().map(|(_, idx)| idx).collect()
    }

    /// Positions of the frames, those with the smallest control nets first; frames whose nets are too large left out.
    pub fn frames_by_rows(&self) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.frames.len()).filter(|&idx| self.is_usable(idx)).collect();
        order.sort_by_key(|&idx| (self.net_rows(idx), idx));
        order
    }

    fn is_usable(&self, frame_idx: usize) -> bool {
        self.frames[frame_idx].sides.iter().all(|side| side.n_turns() <= MAX_TURNS)
    }

    /// Number of rows of the control nets of frame `frame_idx`.
    pub fn net_rows(&self, frame_idx: usize) -> usize {
        self.frames[frame_idx].sides.iter().map(|side| 3_usize.pow(side.n_turns() as u32)).sum()
    }
}

/// Most rotations on one side of a frame: its control net has 3 to this power rows.
pub const MAX_TURNS: usize = 11;
