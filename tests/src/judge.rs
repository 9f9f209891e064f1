//! Whether a finished run is what it claims, by the collision library and by arithmetic, without the certifier.

use crate::polytope_samples::{Walk, samples_per_region};
use crate::programs::json;
use collision::CollisionChecker;
use ipc_types::artefact::{Mode, PlanFile, RegionsFile, Segment, TrajectoryFile};
use scene::{LinearForm, Scene, Space, Task};
use std::collections::BTreeMap;
use std::path::Path;

/// Rounding that is forgiven in sums of a few numbers below 10.
const ROUNDING: f64 = 1e-9;

/// The outputs of a run beside the scene they are about.
#[derive(Debug)]
pub struct Judge {
    scene: Scene,
    task: Task,
    /// Certified regions.
    pub regions: RegionsFile,
    /// Grasp plan.
    pub plan: PlanFile,
    /// Paths.
    pub trajectory: TrajectoryFile,
}

impl Judge {
    /// Reads a run of a scene with one task.
    ///
    /// # Panics
    /// If something is missing or cannot be read.
    pub fn new(scene: &Path, run: &Path) -> Judge {
        let scene = Scene::load(scene).expect("the scene was planned");
        let task = scene.task(None).expect("one task").clone();
        Judge {
            scene,
            task,
            regions: json(run, "certify/regions.json"),
            plan: json(run, "miqp/plan.json"),
            trajectory: json(run, "gcs/trajectory.json"),
        }
    }

    /// Counts samples of certified regions that collide, over all regions.
    pub fn colliding_samples(&self) -> usize {
        let checker = CollisionChecker::for_task(&self.scene, &self.task);
        let mut colliding = 0;
        for region in self.regions.regions.iter().filter(|region| region.certified) {
            let mut walk = Walk::new(region, region.id);
            for _ in 0..samples_per_region() {
                colliding += usize::from(!checker.is_free(walk.step()));
            }
        }
        colliding
    }

    /// Everything that must hold of the motion: it is continuous from start to goal, keeps what each mode keeps, stays
    /// in joint limits and in certified regions, is free of collision at dense samples, and grasps and releases
    /// where the task allows it.
    ///
    /// # Panics
    /// If something does not hold.
    pub fn judge_motion(&self) {
        let segments = &self.trajectory.segments;
        let n_grasps = self.plan.n_grasps.expect("a plan");
        assert_eq!(segments.len(), 2 * n_grasps + 1);
        let mut here = self.task.start.as_slice().to_vec();
        for (idx, segment) in segments.iter().enumerate() {
            let mode = if idx % 2 == 0 { Mode::Transit } else { Mode::Transfer };
            assert_eq!(segment.mode, mode, "segment {idx}");
            here = self.judge_segment(idx, segment, here);
            if idx + 1 < segments.len() {
                for space in [&self.task.grasp, &self.task.placement] {
                    assert!(is_in(space, &here), "segment {idx} ends outside CG ∩ CP at {here:?}");
                }
            }
        }
        assert_eq!(here, self.task.goal.as_slice(), "the motion ends elsewhere");
        let length: f64 = segments.iter().map(|segment| segment.length).sum();
        assert!((length - self.trajectory.length).abs() <= ROUNDING * (1.0 + length));
    }

    /// Checks one segment and answers where it ends.
    fn judge_segment(&self, idx: usize, segment: &Segment, start: Vec<f64>) -> Vec<f64> {
        let checker = CollisionChecker::for_task(&self.scene, &self.task);
        let regions: BTreeMap<u64, _> =
            self.regions.regions.iter().map(|region| (region.id, region)).collect();
        let kept = match segment.mode {
            Mode::Transit => &self.task.transit_keep,
            Mode::Transfer => &self.task.transfer_keep,
        };
        let values: Vec<f64> = kept.iter().map(|form| value(form, &start)).collect();
        assert_eq!(segment.pieces.len(), segment.regions.len(), "segment {idx}");
        let mut here = start;
        for (piece, region) in segment.pieces.iter().zip(&segment.regions) {
            assert_eq!(piece.first(), Some(&here), "segment {idx} jumps");
            let region = regions.get(region).unwrap_or_else(|| panic!("segment {idx}: no region {region}"));
            assert!(region.certified || !segment.certified, "segment {idx} claims region {}", region.id);
            for q in piece {
                assert!(Walk::excess(region, q) <= ROUNDING, "segment {idx} leaves region {}", region.id);
                for (form, kept) in kept.iter().zip(&values) {
                    assert!((value(form, q) - kept).abs() <= ROUNDING, "segment {idx} lets {form} slip");
                }
                let limits = self.scene.coordinates.iter().zip(q);
                limits.for_each(|(c, q)| assert!(c.lower <= *q && *q <= c.upper, "{} = {q}", c.name));
            }
            for step in 0..=200 {
                let q = at(piece, f64::from(step) / 200.0);
                assert!(checker.is_free(&q), "segment {idx} collides at {q:?}");
            }
            here.clone_from(piece.last().expect("a piece has points"));
        }
        here
    }
}

fn is_in(space: &Space, q: &[f64]) -> bool {
    let in_bounds = q.iter().enumerate().all(|(k, q)| space.lower[k] <= *q && *q <= space.upper[k]);
    let rows = &space.rows;
    in_bounds
        && rows.iter().all(|row| {
            let value = value(&row.form, q);
            row.lower - ROUNDING <= value && value <= row.upper + ROUNDING
        })
}

fn value(form: &LinearForm, q: &[f64]) -> f64 {
    form.iter().zip(q).map(|(a, q)| a * q).sum()
}

/// Point of a Bézier curve.
fn at(piece: &[Vec<f64>], s: f64) -> Vec<f64> {
    let mut points = piece.to_vec();
    while points.len() > 1 {
        points = points
            .windows(2)
            .map(|pair| pair[0].iter().zip(&pair[1]).map(|(a, b)| (1.0 - s) * a + s * b).collect())
            .collect();
    }
    points.swap_remove(0)
}
