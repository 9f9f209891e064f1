//! The tree of cells of one pair: every leaf proves its part, and the leaves cover the box of joint limits.
//!
//! The root is the whole box and a split divides its cell into two that cover it, so no cell can be missing: a tree
//! that ends early, or goes on after its end, is refused.

use crate::chain::Side;
use crate::corners;
use crate::interval::{self, Interval};
use crate::net::Net;
use crate::swept::Extent;
use ipc_types::artefact::{Cell, FrameChoice, NearCorners, PairCertificate, SweptProof, SweptRow};
use scene::{Scene, Shape};

/// Why the certificate of a pair does not prove what it claims.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CellError {
    /// The tree has fewer nodes than its splits ask for.
    #[error("the tree of cells ends after {n_cells} nodes, although cells are still open")]
    TreeEnds {
        /// Nodes read.
        n_cells: usize,
    },
    /// The tree goes on after its last leaf.
    #[error("{n_left} cells follow after the tree of cells is complete")]
    TreeGoesOn {
        /// Nodes left.
        n_left: usize,
    },
    /// A split outside its cell or on no coordinate.
    #[error("cell {cell_idx}: it is split at {at} along coordinate {coordinate}, which is not inside it")]
    Split {
        /// Position of the node.
        cell_idx: usize,
        /// Where.
        at: f64,
        /// Along which coordinate.
        coordinate: usize,
    },
    /// A multiplier that is negative or not a number, or on a row that does not exist.
    #[error(
        "cell {cell_idx}: multiplier {value} on row {row} is not usable (rows 0 to {n_rows}, multipliers ≥ 0)"
    )]
    Multiplier {
        /// Position of the node.
        cell_idx: usize,
        /// Row.
        row: usize,
        /// Multiplier.
        value: f64,
        /// Number of rows.
        n_rows: usize,
    },
    /// The rows do not exclude an empty cell.
    #[error(
        "cell {cell_idx}: it is said to miss the region, but its rows are only proven to exceed {bound:e}"
    )]
    NotEmpty {
        /// Position of the node.
        cell_idx: usize,
        /// Proven lower bound, which is not positive.
        bound: f64,
    },
    /// A frame that does not exist or does not see the pair as it says.
    #[error(
        "cell {cell_idx}: frame {frame} does not exist, or its dropped joints are no rotations about an axis of symmetry"
    )]
    Frame {
        /// Position of the node.
        cell_idx: usize,
        /// Position of the frame.
        frame: usize,
    },
    /// A row g on a coordinate that does not move the pair as seen from the frame.
    #[error("cell {cell_idx}: g has the value {value} on coordinate {coordinate}, which must not carry one")]
    Row {
        /// Position of the node.
        cell_idx: usize,
        /// Coordinate.
        coordinate: usize,
        /// Value.
        value: f64,
    },
    /// A proof by corners that can not be read.
    #[error("cell {cell_idx}: its proof by corners is not usable: {problem}")]
    Corners {
        /// Position of the node.
        cell_idx: usize,
        /// What is wrong.
        problem: &'static str,
    },
    /// The plane does not separate.
    #[error("cell {cell_idx}: the proven gap is {gap:e} m, which does not exceed {clearance:e} m")]
    NotSeparated {
        /// Position of the node.
        cell_idx: usize,
        /// Proven gap, scaled to a unit normal.
        gap: f64,
        /// Demanded clearance.
        clearance: f64,
    },
}

struct Frame {
    sides: [Side; 2],
    nets: [Net; 2],
    /// Coordinates that may carry a row.
    coordinates: Vec<usize>,
}

/// Verifies the tree `proof` of one pair. `rows` hold on the region, `lower` and `upper` are the joint limits.
///
/// Returns the number of cells.
pub fn verify(
    scene: &Scene,
    pair: &PairCertificate,
    proof: &SweptProof,
    rows: &[SweptRow],
    lower: &[f64],
    upper: &[f64],
) -> Result<usize, CellError> {
    let mut frames: Vec<Option<Frame>> =
        proof.frames.iter().map(|choice| build_frame(scene, pair, choice)).collect();
    let mut open = vec![(lower.to_vec(), upper.to_vec())];
    for (cell_idx, cell) in proof.cells.iter().enumerate() {
        let Some((lower, upper)) = open.pop() else {
            return Err(CellError::TreeGoesOn { n_left: proof.cells.len() - cell_idx });
        };
        match cell {
            Cell::Split { coordinate, at } => {
                let j = usize::from(*coordinate);
                if !(j < lower.len() && lower[j] < *at && *at < upper[j]) {
                    return Err(CellError::Split { cell_idx, at: *at, coordinate: j });
                }
                let (mut lower_above, mut upper_below) = (lower.clone(), upper.clone());
                upper_below[j] = *at;
                lower_above[j] = *at;
                open.push((lower_above, upper));
                open.push((lower, upper_below));
            }
            Cell::Empty { multipliers } => {
                let zero = vec![0.0; lower.len()];
                let extent = Extent::new(&lower, &upper);
                let bound = row_bound(cell_idx, &zero, multipliers, rows, &lower, &upper, &extent)?;
                if !(bound > 0.0) {
                    return Err(CellError::NotEmpty { cell_idx, bound });
                }
            }
            Cell::Separated { frame, normal, g, multipliers } => {
                let frame_idx = usize::from(*frame);
                let frame = frames
                    .get_mut(frame_idx)
                    .and_then(Option::as_mut)
                    .ok_or(CellError::Frame { cell_idx, frame: frame_idx })?;
                let extent = Extent::new(&lower, &upper);
                let mut g_full = vec![0.0; lower.len()];
                for &(coordinate, value) in g {
                    let coordinate = usize::from(coordinate);
                    let usable = frame.coordinates.contains(&coordinate) && value.is_finite();
                    if !usable || g_full[coordinate] != 0.0 {
                        return Err(CellError::Row { cell_idx, coordinate, value });
                    }
                    g_full[coordinate] = value;
                }
                let bound = if multipliers.is_empty() && g.is_empty() {
                    0.0
                } else {
                    row_bound(cell_idx, &g_full, multipliers, rows, &lower, &upper, &extent)?
                };
                let needed = interval::norm(&normal.map(Interval::point)) * Interval::point(pair.clearance);
                let minus_n = normal.map(|x| -x);
                let a = frame.nets[0].least(&lower, &upper, *normal, &g_full);
                let b = frame.nets[1].least(&lower, &upper, minus_n, &g_full);
                let kappa = a.zip(b).map_or(f64::NEG_INFINITY, |(a, b)| (a + b).lo());
                let gap = (Interval::point(kappa) + Interval::point(bound)).lo();
                if !(gap > needed.hi().max(0.0)) {
                    return Err(CellError::NotSeparated { cell_idx, gap, clearance: pair.clearance });
                }
            }
            Cell::Corners { frame, normal, near, multipliers } => {
                let frame_idx = usize::from(*frame);
                let frame = frames
                    .get_mut(frame_idx)
                    .and_then(Option::as_mut)
                    .ok_or(CellError::Frame { cell_idx, frame: frame_idx })?;
                let shapes =
                    [&scene.bodies[pair.body_a as usize].shape, &scene.bodies[pair.body_b as usize].shape];
                let leaf = CornerLeaf { cell_idx, frame_idx, normal, near, multipliers };
                corners_apart(&leaf, frame, shapes, pair.clearance, rows, &lower, &upper)?;
            }
        }
    }
    if open.is_empty() {
        Ok(proof.cells.len())
    } else {
        Err(CellError::TreeEnds { n_cells: proof.cells.len() })
    }
}

struct CornerLeaf<'a> {
    cell_idx: usize,
    frame_idx: usize,
    normal: &'a [f64; 3],
    near: &'a [NearCorners],
    multipliers: &'a [(u32, f64)],
}

/// What a leaf says of a corner.
#[derive(Clone, Copy, Default)]
struct CornerProof<'a> {
    /// τ and w; `None`: the corner is bounded by sizes.
    tangent: Option<(&'a [f32], &'a [f32])>,
    multipliers: &'a [(u32, f64)],
}

/// Verifies that each corner of the moving body stays beyond the plane of the leaf.
fn corners_apart(
    leaf: &CornerLeaf<'_>,
    frame: &mut Frame,
    shapes: [&Shape; 2],
    clearance: f64,
    rows: &[SweptRow],
    lower: &[f64],
    upper: &[f64],
) -> Result<(), CellError> {
    let cell_idx = leaf.cell_idx;
    let refuse = |problem: &'static str| CellError::Corners { cell_idx, problem };
    let moving = usize::from(frame.sides[0].coordinates().is_empty());
    if !frame.sides[1 - moving].coordinates().is_empty() {
        return Err(CellError::Frame { cell_idx, frame: leaf.frame_idx });
    }
    let norm = interval::norm(&leaf.normal.map(Interval::point));
    if !(norm.hi() <= corners::MAX_NORMAL) {
        return Err(refuse("its normal is longer than a unit"));
    }
    let r = if moving == 0 { *leaf.normal } else { leaf.normal.map(|x| -x) };
    let extent = Extent::new(lower, upper);
    let side = &frame.sides[moving];
    let at = corners::Moving::new(side, shapes[moving], &extent, &r)
        .ok_or_else(|| refuse("it has too many joints or too wide an angle"))?;
    let n_corners =
        corners::n_corners(shapes[moving]).ok_or_else(|| refuse("the body that moves has no corners"))?;
    let radius = corners::radius(shapes[moving], side);
    let nothing = vec![0.0; lower.len()];
    let against = frame.nets[1 - moving].least(lower, upper, r.map(|x| -x), &nothing);
    let against = against.ok_or_else(|| refuse("the body at rest is not bounded"))?;
    let offset = Interval::point(against.lo()) - norm * radius;
    let needed = (norm * Interval::point(clearance)).hi().max(0.0);
    let mut proofs = vec![CornerProof::default(); n_corners];
    let mut left = leaf.multipliers;
    for near in leaf.near {
        let (own, others) = left
            .split_at_checked(usize::from(near.n_multipliers))
            .ok_or_else(|| refuse("it has too few multipliers"))?;
        left = others;
        for bound in &near.bounds {
            let tangent = bound.concave.as_deref().map(|concave| (&near.tangent[..], concave));
            for corner in bound.numbers() {
                let place = proofs
                    .get_mut(corner)
                    .ok_or_else(|| refuse("it names a corner that the body does not have"))?;
                *place = CornerProof { tangent, multipliers: own };
            }
        }
    }
    for (corner_idx, CornerProof { tangent, multipliers }) in proofs.into_iter().enumerate() {
        let series = at.series(corner_idx).ok_or_else(|| refuse("the body that moves has no corners"))?;
        let folded = series.fold(tangent.map_or(&[], |(tau, _)| tau));
        let mut g = vec![0.0; lower.len()];
        at.coordinates.iter().zip(folded.slopes_by_joints()).for_each(|(&j, value)| g[j] = value);
        let beyond = match tangent {
            Some((tau, concave)) => {
                let (slopes, constant) =
                    row_slopes(cell_idx, &g, multipliers, rows, &at.coordinates, lower, upper, &extent)?;
                let bound = folded.by_tangent(tau, concave, &slopes);
                let bound = bound.ok_or_else(|| refuse("N does not make the second order convex"))?;
                Interval::point(bound) + Interval::point(constant)
            }
            None => {
                let bound = row_bound(cell_idx, &g, multipliers, rows, lower, upper, &extent)?;
                Interval::point(bound) - Interval::point(folded.by_sizes()) - Interval::point(series.rounding)
            }
        };
        let gap = Interval::point(folded.value()) + offset + beyond;
        if !(gap.lo() > needed) {
            return Err(CellError::NotSeparated { cell_idx, gap: gap.lo(), clearance });
        }
    }
    Ok(())
}

/// g·δ + Σ μ_r (a_r·q − b_r) as slopes by σ, for `coordinates`, and a lower bound of the rest over the box.
#[allow(clippy::too_many_arguments)]
fn row_slopes(
    cell_idx: usize,
    g: &[f64],
    multipliers: &[(u32, f64)],
    rows: &[SweptRow],
    coordinates: &[usize],
    lower: &[f64],
    upper: &[f64],
    extent: &Extent,
) -> Result<(Vec<f64>, f64), CellError> {
    let mut slope: Vec<Interval> = g.iter().map(|&g| Interval::point(g)).collect();
    let mut sum = Interval::ZERO;
    for &(row_idx, value) in multipliers {
        let row = usable_row(cell_idx, row_idx, value, rows, g.len())?;
        let mu = Interval::point(value);
        for (j, &a) in row.a.iter().enumerate() {
            slope[j] = slope[j] + mu * Interval::point(a);
            sum = sum + mu * Interval::point(a) * Interval::point(extent.center[j]);
        }
        sum = sum - mu * Interval::point(row.b);
    }
    for j in (0..g.len()).filter(|j| !coordinates.contains(j)) {
        sum = sum + slope[j] * (Interval::hull(lower[j], upper[j]) - Interval::point(extent.center[j]));
    }
    let mut slopes = Vec::with_capacity(coordinates.len());
    for &j in coordinates {
        let scaled = slope[j] * Interval::point(extent.half[j]);
        let middle = 0.5 * scaled.lo() + 0.5 * scaled.hi();
        slopes.push(middle);
        let off = scaled - Interval::point(middle);
        sum = sum - Interval::point(off.magnitude());
    }
    Ok((slopes, sum.lo()))
}

/// The row of a multiplier that may be used.
fn usable_row(
    cell_idx: usize,
    row_idx: u32,
    value: f64,
    rows: &[SweptRow],
    n: usize,
) -> Result<&SweptRow, CellError> {
    let row = rows.get(row_idx as usize).filter(|row| row.a.len() == n);
    row.filter(|_| value >= 0.0 && value.is_finite()).ok_or(CellError::Multiplier {
        cell_idx,
        row: row_idx as usize,
        value,
        n_rows: rows.len(),
    })
}

fn build_frame(scene: &Scene, pair: &PairCertificate, choice: &FrameChoice) -> Option<Frame> {
    let side = |body: u32, n_dropped: u32| {
        Side::new(scene, choice.link as usize, body as usize)?.drop_rotations(
            scene,
            body as usize,
            n_dropped as usize,
        )
    };
    let sides = [side(pair.body_a, choice.n_dropped_a)?, side(pair.body_b, choice.n_dropped_b)?];
    let (a, b) = (sides[0].coordinates(), sides[1].coordinates());
    // A coordinate on both sides would be counted twice: the frame is not on the chain between the bodies.
    if a.iter().any(|coordinate| b.contains(coordinate)) {
        return None;
    }
    let net = |side: &Side, body: u32| Net::new(side, &scene.bodies[body as usize].shape);
    let nets = [net(&sides[0], pair.body_a), net(&sides[1], pair.body_b)];
    Some(Frame { coordinates: a.into_iter().chain(b).collect(), sides, nets })
}

/// Lower bound of `g·δ + Σ μ_r (a_r·q − b_r)` over the box.
fn row_bound(
    cell_idx: usize,
    g: &[f64],
    multipliers: &[(u32, f64)],
    rows: &[SweptRow],
    lower: &[f64],
    upper: &[f64],
    extent: &Extent,
) -> Result<f64, CellError> {
    let mut slope: Vec<Interval> = g.iter().map(|&g| Interval::point(g)).collect();
    let mut sum = Interval::ZERO;
    for &(row_idx, value) in multipliers {
        let row = usable_row(cell_idx, row_idx, value, rows, g.len())?;
        let mu = Interval::point(value);
        for (slope, &a) in slope.iter_mut().zip(&row.a) {
            if a != 0.0 {
                *slope = *slope + mu * Interval::point(a);
            }
        }
        sum = sum - mu * Interval::point(row.b);
    }
    for j in 0..g.len() {
        let q = Interval::hull(lower[j], upper[j]);
        sum = sum + slope[j] * q;
        if g[j] != 0.0 {
            sum = sum - Interval::point(g[j]) * Interval::point(extent.center[j]);
        }
    }
    Ok(sum.lo())
}
