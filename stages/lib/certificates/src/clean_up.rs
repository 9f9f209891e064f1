//! Cuts collisions off a region before its cells are tried: few good cuts in place of many small ones.
//!
//! From samples with a small gap the gap of each pair is followed downhill inside the region (successive linear
//! programmes in a shrinking box). Where it ends in a collision, the region gets a face: of a few candidates the one
//! that loses the fewest samples. Nothing here is a proof; what it misses the search for cells finds.

use crate::cell::CellBox;
use crate::guide::Guide;
use crate::lanes::in_lanes;
use crate::pair_model::{PairModel, Tangent};
use crate::row_program::RowProgram;
use crate::rows::Rows;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What a clean-up needs of a region.
pub struct CleanUp<'a> {
    /// Joint limits.
    pub limits: &'a CellBox,
    /// A point that stays inside.
    pub center: &'a [f64],
    /// Whether the cut a·q ≤ b is allowed.
    pub may_cut: &'a dyn Fn(&[f64], f64) -> bool,
    /// Share of the samples that one cut may lose, where few of them collide; between many joints a part of it, which
    /// grows from round to round.
    pub max_loss: f64,
    /// For pairs whose corners are followed, a face is placed this far off contact, metres of gap, where that loses no
    /// more than it may; else at twice the gap that is cut off, or at [`ROOM`] if that is more.
    pub room: f64,
}

/// Seed of the directions in which vertices are sought.
const VERTEX_SEED: u64 = 7;
/// Samples of a pair whose gaps are compared.
const N_LOOKED_AT: usize = 3000;
/// Of these so many, with the least gaps, are followed downhill.
const N_DESCENTS: usize = 40;
/// First half-width of the box of a step, as a share of the joint range.
const FIRST_TRUST: f64 = 0.05;
/// Steps of a descent.
const MAX_STEPS: usize = 12;
/// A face is placed at least this far off contact, metres of gap.
pub const ROOM: f64 = 1e-4;
/// What comes nearer than this share of the room is cut off.
pub const NEAR_SHARE: f64 = 0.5;
/// From vertices with larger gaps, metres, nothing is followed downhill.
const MAX_VERTEX_GAP: f64 = 0.1;
/// Vertices of the region from which gaps are followed downhill as well, in each round: between many joints few samples
/// are near contact.
const N_VERTICES: usize = 40;
/// Rounds over all pairs.
const N_ROUNDS: usize = 4;
/// The same, where vertices are followed.
const N_ROUNDS_LARGE: usize = 6;
/// Share of the loss of a cut that is allowed in the last of them; half of it in the round before, and so on.
const LAST_SHARE: f64 = 0.25;
/// Where more of the samples collide, a cut may lose so many times their share, in the last of the rounds that allow more
/// and more: it has to.
const LOSS_FOR_SHARE: f64 = 8.0;
/// Steps from a collision to contact.
const N_NEWTON: usize = 4;
/// Rows with less slack than this count as active.
const TOL_ACTIVE: f64 = 1e-6;
/// Halvings on the way to the centre.
const N_BISECTIONS: usize = 20;
/// Samples on the way to which a collision between many joints is left.
const N_WAYS: usize = 24;
/// Halvings on the way to a sample.
const N_WAY_BISECTIONS: usize = 12;

/// Adds cuts to `rows` and takes what they lose out of `guide`; returns how many.
pub fn clean_up(
    models: &[&PairModel],
    rows: &mut Rows,
    guide: &mut Guide,
    task: &CleanUp<'_>,
    on_threads: bool,
) -> usize {
    let mut program = RowProgram::default();
    let mut n_cuts = 0;
    let mut is_done = vec![false; models.len()];
    let mut rng = ChaCha8Rng::seed_from_u64(VERTEX_SEED);
    let many_joints = models.iter().any(|model| model.corners.is_some());
    let (n_rounds, n_vertices) = if many_joints { (N_ROUNDS_LARGE, N_VERTICES) } else { (N_ROUNDS, 0) };
    for round in 0..n_rounds {
        let (max_loss, for_share) = if many_joints {
            let share = share_of_loss(round);
            (task.max_loss * share, LOSS_FOR_SHARE * share / LAST_SHARE)
        } else {
            (task.max_loss, LOSS_FOR_SHARE)
        };
        let (n_before, n_rows_before) = (n_cuts, rows.len());
        let n = task.center.len();
        let vertices: Vec<Vec<f64>> = (0..n_vertices)
            .map(|_| {
                let towards: Vec<f64> = (0..n).map(|_| rng.random::<f64>() - 0.5).collect();
                program.minimize(rows, rows.active(), task.limits, &towards, f64::INFINITY);
                program.point(task.limits)
            })
            .collect();
        let left: Vec<usize> = (0..models.len()).filter(|&idx| !is_done[idx]).collect();
        // Between few joints descents are quick, and each sees all cuts.
        let mut found = Vec::new();
        if many_joints {
            let (rows_now, samples): (&Rows, &Guide) = (rows, guide);
            found = in_lanes(&left, on_threads, |&idx, program| {
                least_gaps(models[idx], rows_now, samples, &vertices, task.limits, program)
            });
        }
        let mut found = found.into_iter();
        for idx in left {
            let LeastGaps { share, ends } = found.next().unwrap_or_else(|| {
                least_gaps(models[idx], rows, guide, &vertices, task.limits, &mut program)
            });
            let n_rows_seen = if many_joints { n_rows_before } else { rows.len() };
            let model = models[idx];
            let for_share = if model.corners.is_some() { for_share } else { LOSS_FOR_SHARE };
            let task = CleanUp { max_loss: max_loss.max(for_share * share).min(1.0), ..*task };
            let mut n_here = 0;
            for (start, mut gap, mut q) in ends {
                let is_left = |q: &[f64]| (n_rows_seen..rows.len()).all(|row| rows.slack(row, q) >= 0.0);
                if !is_left(&q) || (!many_joints && n_rows_seen < rows.len()) {
                    // Something was cut since; descents from what it took away are not worth their time between many
                    // joints.
                    if many_joints && !is_left(&start) {
                        continue;
                    }
                    (gap, q) = descend(model, rows, task.limits, &start, &mut program);
                }
                if gap <= task.nearest(model) && cut(model, rows, guide, &task, &q) {
                    n_here += 1;
                }
            }
            is_done[idx] = n_here == 0 && n_vertices == 0;
            n_cuts += n_here;
        }
        rows.prune(&mut program, task.limits);
        if n_cuts == n_before && !many_joints {
            break;
        }
    }
    n_cuts
}

/// Where descents of a pair's gap end.
struct LeastGaps {
    /// Share of the samples in collision.
    share: f64,
    /// Where they began, gaps less clearance, metres, and configurations.
    ends: Vec<(Vec<f64>, f64, Vec<f64>)>,
}

/// Descents from the samples with the least gaps, and from the `vertices` with small ones.
fn least_gaps(
    model: &PairModel,
    rows: &Rows,
    samples: &Guide,
    vertices: &[Vec<f64>],
    limits: &CellBox,
    program: &mut RowProgram,
) -> LeastGaps {
    let mut starts: Vec<(f64, Vec<f64>)> =
        samples.samples().take(N_LOOKED_AT).map(|q| (model.gap(&q) - model.clearance, q)).collect();
    starts.sort_by(|x, y| x.0.total_cmp(&y.0));
    let n_colliding = starts.iter().take_while(|(gap, _)| *gap <= model.demand()).count();
    let share = n_colliding as f64 / starts.len().max(1) as f64;
    let from_samples = starts.into_iter().take(N_DESCENTS).map(|(_, start)| start);
    let near = vertices.iter().filter(|q| model.gap(q) < model.clearance + MAX_VERTEX_GAP);
    let ends = from_samples
        .chain(near.cloned())
        .map(|start| {
            let (gap, q) = descend(model, rows, limits, &start, program);
            (start, gap, q)
        })
        .collect();
    LeastGaps { share, ends }
}

/// Share of [`CleanUp::max_loss`] that a cut may lose in a round between many joints. What cheap cuts take away makes
/// the dear ones cheaper; the dearest are left to the search, which makes them only where its cells come near contact.
fn share_of_loss(round: usize) -> f64 {
    LAST_SHARE * 0.5_f64.powi(N_ROUNDS_LARGE.saturating_sub(round + 1) as i32)
}

impl CleanUp<'_> {
    /// Gaps less clearance up to this are cut off.
    fn nearest(&self, model: &PairModel) -> f64 {
        if model.corners.is_some() { NEAR_SHARE * self.room.max(ROOM) } else { model.margin }
    }
}

/// A configuration of the region with a small gap, by steps downhill from `start`, and the gap less clearance.
fn descend(
    model: &PairModel,
    rows: &Rows,
    limits: &CellBox,
    start: &[f64],
    program: &mut RowProgram,
) -> (f64, Vec<f64>) {
    let mut q = start.to_vec();
    let mut tangent = model.tangent(0, &q);
    let mut trust = FIRST_TRUST;
    for _ in 0..MAX_STEPS {
        let mut cell = limits.clone();
        for &j in &model.coordinates {
            let half = trust * 2.0 * limits.half(j);
            cell.lower[j] = (q[j] - half).max(limits.lower[j]);
            cell.upper[j] = (q[j] + half).min(limits.upper[j]);
        }
        program.minimize(rows, rows.active(), &cell, &tangent.g, f64::INFINITY);
        let next = program.point(&cell);
        let next_tangent = model.tangent(0, &next);
        if next_tangent.gap < tangent.gap {
            (q, tangent) = (next, next_tangent);
        } else {
            trust *= 0.3;
            if trust < 1e-3 {
                break;
            }
        }
    }
    (tangent.gap - model.clearance, q)
}

/// Cuts the collision at `x` off; whether that was allowed.
pub fn cut(model: &PairModel, rows: &mut Rows, guide: &mut Guide, task: &CleanUp<'_>, x: &[f64]) -> bool {
    // A face with little room costs less, but must leave clearly more than there is at x, or it is made again and again.
    let enough = ROOM.max((model.gap(x) - model.clearance) / NEAR_SHARE);
    let with_room =
        model.corners.is_some() && task.room > enough && cut_with(model, rows, guide, task, x, task.room);
    with_room || (enough <= task.room.max(ROOM) && cut_with(model, rows, guide, task, x, enough))
}

fn cut_with(
    model: &PairModel,
    rows: &mut Rows,
    guide: &mut Guide,
    task: &CleanUp<'_>,
    x: &[f64],
    room: f64,
) -> bool {
    let mut candidates: Vec<(Vec<f64>, f64)> = Vec::new();
    // The half-space of the gap to first order, at the contact that lies straight uphill.
    let mut contact = x.to_vec();
    for _ in 0..N_NEWTON {
        let Tangent { gap, g, .. } = model.tangent(0, &contact);
        let g2 = dot(&g, &g);
        if !(g2 > 0.0) {
            break;
        }
        let step = (model.clearance + room - gap) / g2;
        contact.iter_mut().zip(&g).for_each(|(q, g)| *q += step * g);
    }
    let enough = model.clearance + room;
    candidates.extend([&contact[..], x].into_iter().filter_map(|at| tangent_face(model, at, enough)));
    // Where the way to the centre leaves the collision: the faces that meet at x moved there, and their mean.
    let free = way_out(model, x, task.center, enough, N_BISECTIONS);
    let mut mean = vec![0.0; x.len()];
    for &row in rows.active() {
        if rows.slack(row as usize, x) < TOL_ACTIVE {
            let a = rows.a(row as usize);
            mean.iter_mut().zip(a).for_each(|(mean, a)| *mean += a);
            candidates.push((a.to_vec(), dot(a, &free)));
        }
    }
    let norm = dot(&mean, &mean).sqrt();
    if norm > 1e-3 {
        mean.iter_mut().for_each(|mean| *mean /= norm);
        let b = dot(&mean, &free);
        candidates.push((mean, b));
    }
    if model.corners.is_some() {
        candidates.extend(tangents_towards_samples(model, guide, x, enough));
    }
    // The loss is known to a sample: of cuts that lose the same, between many joints the one that cuts deepest.
    let mut best: Option<(f64, f64, usize)> = None;
    for (position, (a, b)) in candidates.iter().enumerate() {
        let most = best.map_or(task.max_loss, |(loss, ..)| loss);
        let depth = dot(a, x) - b;
        if depth > 0.0
            && (task.may_cut)(a, *b)
            && let Some(loss) = guide.loss(a, *b, most)
            && best.is_none_or(|(least, deepest, _)| {
                loss < least || (loss == least && depth > deepest && model.corners.is_some())
            })
        {
            best = Some((loss, depth, position));
        }
    }
    let Some((.., position)) = best else { return false };
    let (a, b) = candidates.swap_remove(position);
    guide.cut(&a, b);
    rows.push(&a, b, None);
    true
}

/// The faces tangent to the obstacle where the ways from the collision `x` to samples of the region reach the gap
/// `enough`, metres: along a curved obstacle they differ much in what they lose.
fn tangents_towards_samples(
    model: &PairModel,
    guide: &Guide,
    x: &[f64],
    enough: f64,
) -> Vec<(Vec<f64>, f64)> {
    guide
        .spread(N_WAYS)
        .filter(|target| model.gap(target) > enough)
        .filter_map(|target| {
            tangent_face(model, &way_out(model, x, &target, enough, N_WAY_BISECTIONS), enough)
        })
        .collect()
}

/// The half-space a·q ≤ b, of unit normal, on which the gap linearised at `at` is `enough`, metres, or more; `None` where
/// the gap has no slope.
fn tangent_face(model: &PairModel, at: &[f64], enough: f64) -> Option<(Vec<f64>, f64)> {
    let Tangent { gap, g, .. } = model.tangent(0, at);
    let norm = dot(&g, &g).sqrt();
    (norm > 0.0).then(|| {
        // 0 − 0 is 0, not −0.
        let a: Vec<f64> = g.iter().map(|g| 0.0 - g / norm).collect();
        let b = dot(&a, at) + (gap - enough) / norm;
        (a, b)
    })
}

/// On the way from `x`, where the gap is less, to the free configuration `target` a point where the gap is `enough`,
/// metres, found by bisection to 2^−`n_halvings` of the way.
fn way_out(model: &PairModel, x: &[f64], target: &[f64], enough: f64, n_halvings: usize) -> Vec<f64> {
    let at = |t: f64| -> Vec<f64> { target.iter().zip(x).map(|(s, x)| s + t * (x - s)).collect() };
    let (mut free, mut colliding) = (0.0, 1.0);
    for _ in 0..n_halvings {
        let t = 0.5 * (free + colliding);
        if model.gap(&at(t)) > enough { free = t } else { colliding = t }
    }
    at(free)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use convex_sets::HPolyhedron;
    use nalgebra::DVector;
    use std::path::Path;

    #[test]
    fn dear_cuts_come_last() {
        let shares: Vec<f64> = (0..N_ROUNDS_LARGE).map(share_of_loss).collect();
        assert!(shares.windows(2).all(|pair| pair[1] == 2.0 * pair[0]));
        assert_eq!(shares.last(), Some(&LAST_SHARE));
    }

    /// Much of a box that was not grown collides: what is left after the clean-up hardly does, and descents in it find
    /// next to nothing that does. (Half of them did where those that led to what had just been cut off did not begin again.)
    #[test]
    fn a_box_with_many_collisions_is_cleaned() {
        let (scene, center) = above_top_shelf();
        let region = HPolyhedron::from_box(&center.add_scalar(-0.1), &center.add_scalar(0.1));
        let mut guide = Guide::new(&region, &center, &[], 3000, &mut ChaCha8Rng::seed_from_u64(1));
        let limits = CellBox {
            lower: scene.lower().iter().copied().collect(),
            upper: scene.upper().iter().copied().collect(),
        };
        let models: Vec<PairModel> = scene
            .collision_pairs()
            .into_iter()
            .map(|pair| PairModel::new(&scene, pair, 0.0))
            .filter(|model| model.gap(center.as_slice()) > 0.0)
            .filter(|model| guide.samples().any(|q| model.gap(&q) < 0.0))
            .collect();
        let models: Vec<&PairModel> = models.iter().collect();
        let n_colliding = |guide: &Guide| {
            guide.samples().filter(|q| models.iter().any(|model| model.gap(&q[..]) < 0.0)).count()
        };
        let before = n_colliding(&guide);
        let task = CleanUp {
            limits: &limits,
            center: center.as_slice(),
            may_cut: &|a, b| dot(a, center.as_slice()) < b - 1e-3,
            max_loss: 0.01,
            room: 2e-3,
        };
        let mut rows = Rows::new(&region);
        let n_cuts = clean_up(&models, &mut rows, &mut guide, &task, true);
        let after = n_colliding(&guide);
        assert!(before > 300 && n_cuts > 0, "{before} collide, {n_cuts} cuts");
        assert!(50 * after < before, "{after} of {before} collisions are left");
        let mut program = RowProgram::default();
        let ends: Vec<f64> = models
            .iter()
            .flat_map(|model| least_gaps(model, &rows, &guide, &[], &limits, &mut program).ends)
            .map(|(_, gap, _)| gap)
            .collect();
        let n_found = ends.iter().filter(|gap| **gap < 0.0).count();
        assert!(20 * n_found < ends.len(), "{n_found} of {} descents end in a collision", ends.len());
        assert!(guide.kept() > 0.3, "{} is left", guide.kept());
    }

    /// A configuration with more room than half of what a face leaves is left alone, one with less is cut off.
    #[test]
    fn what_has_room_enough_is_not_cut_again_and_again() {
        let (scene, center) = above_top_shelf();
        let region = HPolyhedron::from_box(&center.add_scalar(-0.3), &center.add_scalar(0.3));
        let mut guide = Guide::new(&region, &center, &[], 400, &mut ChaCha8Rng::seed_from_u64(1));
        let limits = CellBox {
            lower: scene.lower().iter().copied().collect(),
            upper: scene.upper().iter().copied().collect(),
        };
        let task = CleanUp {
            limits: &limits,
            center: center.as_slice(),
            may_cut: &|_, _| true,
            max_loss: 1.0,
            room: 2e-3,
        };
        let (mut n_cut, mut n_left) = (0, 0);
        for pair in scene.collision_pairs() {
            let model = PairModel::new(&scene, pair, 0.0);
            let Some(x) = guide.samples().find(|q| model.gap(q) < -0.01) else {
                continue;
            };
            if model.corners.is_none() || model.gap(center.as_slice()) < 0.01 {
                continue;
            }
            let mut rows = Rows::new(&region);
            for (share, is_cut) in [(0.9, false), (0.3, true)] {
                let near = way_out(&model, &x, center.as_slice(), share * task.room, 40);
                let n_rows = rows.len();
                assert_eq!(cut(&model, &mut rows, &mut guide, &task, &near), is_cut);
                assert_eq!(rows.len() > n_rows, is_cut);
                if is_cut {
                    assert!(rows.slack(n_rows, &near) < 0.0);
                    n_cut += 1;
                } else {
                    n_left += 1;
                }
            }
        }
        assert!(n_cut > 0 && n_left > 0);
    }

    fn above_top_shelf() -> (scene::Scene, DVector<f64>) {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenes/iiwa14-shelf");
        let scene = scene::Scene::load(&folder).expect("the scene of this project loads");
        (scene, DVector::from_vec(vec![0.0, 0.472, 0.0, -0.672, 0.0, 0.426, 1.571]))
    }

    /// The gripper above the top shelf: it meets the board where the arm is lowered.
    #[test]
    fn most_faces_towards_samples_cut_the_collision_off() {
        let (scene, center) = above_top_shelf();
        let region = HPolyhedron::from_box(&center.add_scalar(-0.3), &center.add_scalar(0.3));
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let guide = Guide::new(&region, &center, &[], 400, &mut rng);
        let (mut n_faces, mut n_collisions) = (0, 0);
        for pair in scene.collision_pairs() {
            let model = PairModel::new(&scene, pair, 0.0);
            if model.corners.is_none() {
                continue;
            }
            for x in guide.samples().filter(|q| model.gap(q) < -0.01).take(3) {
                n_collisions += 1;
                for (a, b) in tangents_towards_samples(&model, &guide, &x, 2e-3) {
                    assert!((dot(&a, &a) - 1.0).abs() < 1e-9 && b.is_finite());
                    n_faces += usize::from(dot(&a, &x) > b);
                }
            }
        }
        assert!(n_collisions > 10, "{n_collisions}");
        assert!(n_faces > 10 * n_collisions, "{n_faces} faces cut {n_collisions} collisions off");
    }
}
