//! The tree of cells that certifies one pair of bodies on a region.
//!
//! Cells are tried largest first, but for those in which a near collision was seen, which come before. A cell that has
//! no plane costs the region a face where that is cheap (the half-space on which its plane separates, or a face of the
//! region moved inwards), and is split otherwise.
//! Between many joints a cell is first tried by the series of a body's corners (`corner_search.rs`), and by control nets
//! only where it is too wide for them. Source: mathematics.md 2.1, certificates.md section 4.

mod corner_cells;
mod cuts;

use crate::cell::{CellBox, CellTree};
use crate::control_net::{ControlNet, MAX_HALF_ANGLE};
use crate::corner_bound::CornerPair;
use crate::corner_search::Seen;
use crate::guide::Guide;
use crate::normals::{better_normal, difference};
use crate::options::CertifyOptions;
use crate::pair_model::{PairModel, Plane, Tangent};
use crate::region_data::RegionData;
use crate::row_program::{Active, RowProgram};
use crate::rows::{Multipliers, RowBound, Rows};
use crate::waiting::Waiting;
use ipc_types::artefact::Cell;
use nalgebra::Vector3;
use std::collections::BinaryHeap;
use std::rc::Rc;

/// A pair certified on what its cuts leave of the region.
#[derive(Debug, Clone)]
pub struct PairProof {
    /// The tree in preorder; multipliers index the region's rows, then `cuts`.
    pub cells: Vec<Cell>,
    /// Rows (a, b) to add to the region.
    pub cuts: Vec<(Vec<f64>, f64)>,
    /// Cells that were tried.
    pub n_tried: u64,
    /// The proof is of an earlier run: its rows are implied by the region and cut nothing.
    pub is_reused: bool,
}

/// How the search for one pair ended.
#[derive(Debug, Clone)]
pub enum PairOutcome {
    /// Certified.
    Proof(PairProof),
    /// Not certified: the cell around `configuration` has no plane and may not be cut away.
    Failed {
        /// Centre of the cell.
        configuration: Vec<f64>,
        /// Why, in words.
        reason: String,
    },
    /// The budget of cells is used up.
    Limit {
        /// Cells tried.
        n_cells: u64,
    },
    /// The caller asked to stop.
    Stopped,
}

/// A half-width of an angle from which a cell is split untested: its control net is too wide to be of use.
const SPLIT_HALF_ANGLE: f64 = 0.7;
const NO_SPLIT: &str = "no plane separates the bodies around it, and the cell cannot be split";
/// Nets up to this many rows are cheap: all frames are tried, not only the best.
const CHEAP_NET: usize = 100;
/// Frames that are tried on all of the region's box at first, those with the smallest nets.
const N_CHEAP_FRAMES: usize = 2;
/// A cell is contracted by a row if that takes away this share of a width.
const MIN_CONTRACTION: f64 = 0.2;
/// Cells in which the bodies are seen this close, metres, come before all others.
const URGENT_GAP: f64 = 5e-3;
/// After so many cuts rows that others imply are taken out of use.
const CUTS_BETWEEN_PRUNINGS: usize = 64;

/// What a frame says of a cell.
enum Answer {
    Empty(Multipliers),
    /// Frame, plane, and the multipliers if the row is used.
    Apart(usize, Plane, Option<Multipliers>),
    Open(Attempt),
}

/// A plane that does not separate the pair on a cell.
struct Attempt {
    frame_idx: usize,
    /// What it proves instead, metres, or an upper bound of that.
    gap: f64,
    n: Vector3<f64>,
    g: Vec<f64>,
    /// If it was worth evaluating.
    plane: Option<Plane>,
    /// Whether the row helps.
    with_row: bool,
    multipliers: Multipliers,
    /// L.
    bound: f64,
    /// Configurations in cell ∩ region at which normals failed.
    witnesses: Vec<(Vec<f64>, Tangent)>,
}

struct Search<'a> {
    model: &'a PairModel,
    region: &'a RegionData<'a>,
    options: &'a CertifyOptions,
    rows: Rows,
    guide: Option<Guide>,
    program: RowProgram,
    /// Rows that the present cell may violate.
    relevant: Vec<u32>,
    frame_order: Vec<usize>,
    tree: CellTree,
    queue: BinaryHeap<Waiting>,
    n_tried: u64,
    /// The pair seen so that one body rests, if its control nets are large.
    corners: Option<&'a CornerPair>,
    /// Where the programme of the cell around the present one ended.
    start: Rc<[Active]>,
    /// What was seen in it.
    seen: Rc<[Rc<Seen>]>,
}

/// Certifies the pair of `model` on the region, cutting where needed.
pub fn search(
    model: &PairModel,
    region: &RegionData<'_>,
    options: &CertifyOptions,
    net: &mut ControlNet,
    is_stopped: &(dyn Fn() -> bool + Sync),
) -> PairOutcome {
    let mut search = Search {
        model,
        region,
        options,
        rows: region.rows.clone(),
        guide: None,
        program: RowProgram::default(),
        relevant: Vec::new(),
        frame_order: Vec::new(),
        tree: CellTree::new(),
        queue: BinaryHeap::new(),
        n_tried: 0,
        corners: model.corners.as_ref(),
        start: [].into(),
        seen: [].into(),
    };
    if model.gap(region.center) <= model.clearance {
        let reason = "no plane separates the bodies at the centre of the region".to_owned();
        return PairOutcome::Failed { configuration: region.center.to_vec(), reason };
    }
    search.begin(net);
    if search.frame_order.is_empty() && !search.queue.is_empty() {
        let reason = format!("more than {} joints turn between the bodies", 2 * crate::pair_model::MAX_TURNS);
        return PairOutcome::Failed { configuration: region.center.to_vec(), reason };
    }
    while let Some(Waiting { node, cell, rows, start, seen, n_rows_seen, .. }) = search.queue.pop() {
        search.n_tried += 1;
        if search.n_tried > options.max_cells {
            return PairOutcome::Limit { n_cells: options.max_cells };
        }
        if search.n_tried.is_multiple_of(256) && is_stopped() {
            return PairOutcome::Stopped;
        }
        search.relevant.clear();
        search.relevant.extend_from_slice(&rows);
        search.start = start;
        search.seen = seen;
        search.note_new_rows(n_rows_seen);
        if let Err(reason) = search.treat(net, node, cell.clone()) {
            return PairOutcome::Failed { configuration: cell.centers(), reason };
        }
    }
    let n_base = region.rows.len();
    let cuts = (n_base..search.rows.len()).map(|i| (search.rows.a(i).to_vec(), search.rows.b[i])).collect();
    match search.tree.preorder() {
        Some(cells) => {
            PairOutcome::Proof(PairProof { cells, cuts, n_tried: search.n_tried, is_reused: false })
        }
        // The queue is empty only when every cell is closed.
        None => PairOutcome::Limit { n_cells: search.n_tried },
    }
}

impl Search<'_> {
    /// The box of joint limits, shrunk to the region's bounding box. If no cheap net separates the pair on all of it,
    /// the order of the frames.
    fn begin(&mut self, net: &mut ControlNet) {
        let mut cell = self.region.limits.clone();
        let mut node = 0;
        for &j in &self.model.coordinates {
            for side in 0..2 {
                let Some((at, multipliers)) = &self.region.bounds[j][side] else { continue };
                (node, cell) = self.trim(node, cell, j, *at, side == 0, multipliers);
            }
        }
        if self.too_wide(&cell).is_none() {
            for frame_idx in self.model.frames_by_rows().into_iter().take(N_CHEAP_FRAMES) {
                let plane = self.model.plane(net, frame_idx, &cell);
                if plane.kappa[0] > self.model.demand() {
                    self.n_tried = 1;
                    self.close(node, frame_idx, &plane, false, Vec::new());
                    return;
                }
            }
        }
        let samples: Vec<CellBox> =
            [0.05, 0.25].iter().map(|share| self.around_center(&cell, *share)).collect();
        self.frame_order = self.model.frame_order(net, &samples);
        self.relevant = self.rows.active().to_vec();
        self.queue.push(self.waiting(node, cell));
    }

    /// Adds the rows made since there were `n_rows_seen` to the relevant ones, and takes superseded ones out.
    fn note_new_rows(&mut self, n_rows_seen: usize) {
        if n_rows_seen < self.rows.len() {
            let rows = &self.rows;
            self.relevant.retain(|&row| rows.is_active(row));
            let new = n_rows_seen as u32..self.rows.len() as u32;
            self.relevant.extend(new.filter(|&row| rows.is_active(row)));
        }
    }

    /// A cell about the region's centre with the given share of the widths of `cell`.
    fn around_center(&self, cell: &CellBox, share: f64) -> CellBox {
        let mut around = cell.clone();
        for &j in &self.model.coordinates {
            let half = (share * cell.half(j)).min(MAX_HALF_ANGLE);
            around.lower[j] = self.region.center[j] - half;
            around.upper[j] = self.region.center[j] + half;
        }
        around
    }

    /// Cuts the part of `cell` below (or above) `q_j = at` off as empty, if the multipliers prove that it is.
    fn trim(
        &mut self,
        node: usize,
        cell: CellBox,
        j: usize,
        at: f64,
        below: bool,
        multipliers: &Multipliers,
    ) -> (usize, CellBox) {
        if !(cell.lower[j] < at && at < cell.upper[j]) {
            return (node, cell);
        }
        let (mut empty, mut rest) = (cell.clone(), cell.clone());
        if below {
            (empty.upper[j], rest.lower[j]) = (at, at);
        } else {
            (empty.lower[j], rest.upper[j]) = (at, at);
        }
        if !self.rows.excludes(&empty, multipliers) {
            return (node, cell);
        }
        let [lower, upper] = self.tree.split(node, j, at);
        let (empty_node, rest_node) = if below { (lower, upper) } else { (upper, lower) };
        self.tree.close(empty_node, Cell::Empty { multipliers: multipliers.clone() });
        (rest_node, rest)
    }

    /// Closes the cell by a leaf, with or without a cut, or splits it.
    fn treat(&mut self, net: &mut ControlNet, node: usize, cell: CellBox) -> Result<(), String> {
        let Some((node, cell)) = self.contract(node, cell) else { return Ok(()) };
        if let Some(j) = self.too_wide(&cell) {
            self.split(node, cell, j, None);
            return Ok(());
        }
        if let Some(pair) = self.corners {
            return self.treat_corners(net, node, &cell, pair);
        }
        let n_frames = match self.model.net_rows(self.frame_order[0]) <= CHEAP_NET {
            true => self.frame_order.len(),
            false => 1,
        };
        let mut best: Option<Attempt> = None;
        for position in 0..n_frames {
            match self.attempt(net, self.frame_order[position], &cell) {
                Answer::Empty(multipliers) => {
                    self.tree.close(node, Cell::Empty { multipliers });
                    return Ok(());
                }
                Answer::Apart(frame_idx, plane, multipliers) => {
                    self.close(
                        node,
                        frame_idx,
                        &plane,
                        multipliers.is_some(),
                        multipliers.unwrap_or_default(),
                    );
                    return Ok(());
                }
                Answer::Open(attempt) => {
                    if best.as_ref().is_none_or(|best| attempt.gap > best.gap) {
                        best = Some(attempt);
                    }
                }
            }
        }
        // At least one frame was tried.
        let Some(attempt) = best else { return Err("no frame".to_owned()) };
        let displacement = self.model.displacement(&cell);
        if self.options.cuts_allowed() {
            let loss = self.allowed_loss(displacement);
            if let Some((plane, multipliers)) = self.cut(net, &cell, &attempt, loss) {
                self.close(node, attempt.frame_idx, &plane, true, multipliers);
                return Ok(());
            }
        }
        if displacement < self.options.give_up {
            return Err(self.given_up());
        }
        match self.split_coordinate(&cell, &attempt) {
            Some(j) if cell.lower[j] < cell.center(j) && cell.center(j) < cell.upper[j] => {
                self.split(node, cell, j, None);
                Ok(())
            }
            _ => Err(NO_SPLIT.to_owned()),
        }
    }

    fn given_up(&self) -> String {
        let what = if self.options.cuts_allowed() { "no cut keeps the centre" } else { "cuts are forbidden" };
        format!("no plane separates the bodies around it, and {what}")
    }

    fn waiting(&self, node: usize, cell: CellBox) -> Waiting {
        let (rows, start, seen) = (self.relevant.as_slice().into(), self.start.clone(), self.seen.clone());
        Waiting { size: self.model.size(&cell), node, cell, rows, start, seen, n_rows_seen: self.rows.len() }
    }

    /// Looks for a plane in frame `frame_idx`. The normal at the cell's centre comes first, which may lie outside the
    /// region; where it fails on the region, normals that hold there are tried.
    fn attempt(&mut self, net: &mut ControlNet, frame_idx: usize, cell: &CellBox) -> Answer {
        let model = self.model;
        let (demand, center) = (model.demand(), cell.centers());
        let Tangent { mut n, mut gap, mut g } = model.tangent(frame_idx, &center);
        let spread: f64 = model.coordinates.iter().map(|&j| g[j].abs() * cell.half(j)).sum();
        if gap > spread {
            let plane = model.kappa(net, frame_idx, cell, &n, &g);
            if plane.kappa[0] > demand {
                return Answer::Apart(frame_idx, plane, None);
            }
        }
        let mut witnesses: Vec<(Vec<f64>, Tangent)> = Vec::new();
        loop {
            let (bound, multipliers) =
                match self.rows.minimize_over(&mut self.program, &self.relevant, cell, &g, f64::INFINITY) {
                    RowBound::Empty(multipliers) => return Answer::Empty(multipliers),
                    RowBound::Bound { value, multipliers } => (value, multipliers),
                };
            let worst = self.program.point(cell);
            if gap + bound > demand {
                let plane = model.kappa(net, frame_idx, cell, &n, &g);
                if plane.kappa[0] > demand {
                    return Answer::Apart(frame_idx, plane, None);
                }
                if plane.kappa[1] + bound > demand {
                    return Answer::Apart(frame_idx, plane, Some(multipliers));
                }
                let at_worst = plane.kappa[1] + bound;
                let with_row = at_worst > plane.kappa[0];
                return Answer::Open(Attempt {
                    frame_idx,
                    gap: at_worst,
                    n,
                    g,
                    plane: Some(plane),
                    with_row,
                    multipliers,
                    bound,
                    witnesses: vec![],
                });
            }
            // No plane along n: the first-order gap at `worst`, in the region, is too small.
            let tangent = model.tangent(frame_idx, &worst);
            witnesses.push((worst, tangent));
            match better_normal(model, frame_idx, &witnesses) {
                Some(normal) if (normal - n).norm() > 1e-6 => {
                    n = normal;
                    gap = model.gap_along(frame_idx, &center, &n);
                    g = model.gradient(frame_idx, &center, &n);
                }
                _ => {
                    return Answer::Open(Attempt {
                        frame_idx,
                        gap: gap + bound,
                        n,
                        g,
                        plane: None,
                        with_row: true,
                        multipliers,
                        bound,
                        witnesses,
                    });
                }
            }
        }
    }

    /// The coordinate to halve: where a plane along the normal failed by its remainder, the one that gains most on the
    /// worst control path; where normals failed, the one that tells most between the points that they failed at.
    fn split_coordinate(&self, cell: &CellBox, attempt: &Attempt) -> Option<usize> {
        let model = self.model;
        if let Some(plane) = &attempt.plane {
            return model.split_coordinate(attempt.frame_idx, cell, plane, attempt.with_row);
        }
        let center = cell.centers();
        let mut best: Option<(f64, usize)> = None;
        for (k, &j) in model.coordinates.iter().enumerate() {
            let mut score = 1e-4 * model.levers[k] * cell.half(j);
            score += difference(&attempt.witnesses, &attempt.g, &center, j);
            if cell.half(j) > 0.0 && best.is_none_or(|(most, _)| score > most) {
                best = Some((score, j));
            }
        }
        best.map(|(_, j)| j)
    }

    /// The widest angle of the pair, measured by displacement, among those too wide for a control net.
    fn too_wide(&self, cell: &CellBox) -> Option<usize> {
        let model = self.model;
        let mut widest: Option<(f64, usize)> = None;
        for (k, &j) in model.coordinates.iter().enumerate() {
            let width = cell.half(j) * model.levers[k];
            if model.is_angle[k]
                && cell.half(j) > SPLIT_HALF_ANGLE
                && widest.is_none_or(|(most, _)| width > most)
            {
                widest = Some((width, j));
            }
        }
        widest.map(|(_, j)| j)
    }

    /// Halves the cell. Of the halves the one with `nearest`, if the bodies come as close there as cuts leave them, is next:
    /// what is cut for it makes the other cells easier.
    fn split(&mut self, node: usize, cell: CellBox, j: usize, nearest: Option<&(Vec<f64>, f64)>) {
        let at = cell.center(j);
        let nodes = self.tree.split(node, j, at);
        let (mut lower, mut upper) = (cell.clone(), cell);
        lower.upper[j] = at;
        upper.lower[j] = at;
        let (rows, n_rows_seen): (Rc<[u32]>, usize) = (self.relevant.as_slice().into(), self.rows.len());
        for (node, cell) in nodes.into_iter().zip([lower, upper]) {
            let (rows, start, seen) = (rows.clone(), self.start.clone(), self.seen.clone());
            let mut waiting =
                Waiting { size: self.model.size(&cell), node, cell, rows, start, seen, n_rows_seen };
            if let Some((q, gap)) = nearest
                && gap - self.model.clearance < URGENT_GAP
                && (waiting.cell.lower[j]..=waiting.cell.upper[j]).contains(&q[j])
            {
                waiting.size = f64::MAX;
            }
            self.queue.push(waiting);
        }
    }

    fn close(
        &mut self,
        node: usize,
        frame_idx: usize,
        plane: &Plane,
        with_row: bool,
        multipliers: Multipliers,
    ) {
        let entries = plane.g.iter().enumerate().filter(|(_, g)| with_row && **g != 0.0);
        let g = entries.map(|(j, &g)| (j as u16, g)).collect();
        let normal = plane.n.into();
        self.tree.close(node, Cell::Separated { frame: frame_idx as u16, normal, g, multipliers });
    }

    /// Contracts the cell by single rows, where that takes much away, and keeps the rows that it may violate; `None`
    /// if a row excludes it all.
    fn contract(&mut self, mut node: usize, mut cell: CellBox) -> Option<(usize, CellBox)> {
        let n = cell.lower.len();
        let mut n_relevant = 0;
        let (mut center, mut half) = centers_and_halves(&cell);
        for position in 0..self.relevant.len() {
            let row = self.relevant[position];
            let (mut middle, mut spread) = (0.0, 0.0);
            for ((a, m), h) in self.rows.a(row as usize).iter().zip(&center).zip(&half) {
                middle += a * m;
                spread += a.abs() * h;
            }
            let (least, most) = (middle - spread, middle + spread);
            let b = self.rows.b[row as usize];
            if most <= b {
                continue;
            }
            self.relevant[n_relevant] = row;
            n_relevant += 1;
            let room = b - least;
            if room < 0.0 && self.rows.excludes(&cell, &[(row, 1.0)]) {
                self.tree.close(node, Cell::Empty { multipliers: vec![(row, 1.0)] });
                return None;
            }
            if !(room >= 0.0) {
                continue;
            }
            for j in 0..n {
                let a = self.rows.a(row as usize)[j];
                let width = cell.upper[j] - cell.lower[j];
                // Along coordinate j the row leaves `room / |a_j|` of the width.
                if !(a.abs() * width * (1.0 - MIN_CONTRACTION) > room) || !self.model.depends_on(j) {
                    continue;
                }
                let left = (room / a.abs()) + 1e-7 * width;
                let (at, below) =
                    if a > 0.0 { (cell.lower[j] + left, false) } else { (cell.upper[j] - left, true) };
                (node, cell) = self.trim(node, cell, j, at, below, &vec![(row, 1.0)]);
                (center, half) = centers_and_halves(&cell);
            }
        }
        self.relevant.truncate(n_relevant);
        Some((node, cell))
    }
}

fn centers_and_halves(cell: &CellBox) -> (Vec<f64>, Vec<f64>) {
    (cell.centers(), (0..cell.lower.len()).map(|j| cell.half(j)).collect())
}
