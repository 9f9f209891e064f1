//! Paths of the reference scenes over regions made by hand.

mod bottle_cap;

use gcs::{Found, Options, PathsOutcome, Regions, Sink, plan_paths};
use ipc_types::artefact::{LeafCut, Mode, PlanFile, Segment, TrajectoryFile};
use manipulation::Manipulation;

struct NoSink;

impl Sink for NoSink {
    fn segment(&mut self, _: usize, _: &Segment, _: &Found) {}
    fn cut(&mut self, _: usize, _: &LeafCut) {}
}

fn paths(
    spaces: &Manipulation,
    plan: &PlanFile,
    options: &Options,
    coordinates: &[String],
) -> TrajectoryFile {
    let ids: Vec<u64> = (0..spaces.regions.len() as u64).collect();
    let certified = vec![true; ids.len()];
    let regions = Regions { manipulation: spaces, ids: &ids, certified: &certified, coordinates };
    match plan_paths(regions, plan, options, 7, &mut NoSink, &|| false).unwrap() {
        PathsOutcome::Found(trajectory) => trajectory,
        outcome => panic!("{outcome:?}"),
    }
}

/// All constraints at every control point, ends bit for bit, small gaps, and the same bytes again.
#[test]
fn eq_5_5_and_5_9_hold_along_the_whole_trajectory() {
    for dim in [3, 4] {
        let scene = bottle_cap::scene(dim);
        let spaces = bottle_cap::manipulation(&scene, &bottle_cap::regions(&scene, 3));
        let plan = bottle_cap::by_turns(&scene);
        let coordinates: Vec<String> = scene.coordinates.iter().map(|c| c.name.clone()).collect();
        for order in [1, 3] {
            let options = Options { order, ..Options::default() };
            let trajectory = paths(&spaces, &plan, &options, &coordinates);
            assert_eq!(trajectory, paths(&spaces, &plan, &options, &coordinates));
            check(&trajectory, &plan, &spaces, order);
        }
    }
}

fn check(trajectory: &TrajectoryFile, plan: &PlanFile, spaces: &Manipulation, order: usize) {
    let configurations = plan.configurations.as_ref().unwrap();
    assert_eq!(trajectory.segments.len() + 1, configurations.len());
    for (segment_idx, segment) in trajectory.segments.iter().enumerate() {
        let s = &configurations[segment_idx];
        assert_eq!(&segment.pieces[0][0], s);
        assert_eq!(segment.pieces.last().unwrap().last().unwrap(), &configurations[segment_idx + 1]);
        assert!(segment.pieces.windows(2).all(|pair| pair[0].last() == pair[1].first()));
        assert!(segment.lower_bound <= segment.length);
        let gap = segment.length - segment.lower_bound;
        assert!(gap <= 1e-3 * segment.length, "segment {segment_idx}: gap {gap} of {}", segment.length);
        for (piece, &region_id) in segment.pieces.iter().zip(&segment.regions) {
            assert_eq!(piece.len(), order + 1);
            let free = match segment.mode {
                Mode::Transit => &spaces.placement_free,
                Mode::Transfer => &spaces.grasp_free,
            };
            let P = free[region_id as usize].as_ref().unwrap();
            for q in piece {
                assert!(manipulation::contains_exactly(P, &nalgebra::DVector::from_column_slice(q)));
                match segment.mode {
                    Mode::Transit => assert_eq!(q[0], s[0]),
                    Mode::Transfer => {
                        assert_eq!(q[1] - q[0], s[1] - s[0]);
                        assert_eq!(q[2..], s[2..]);
                    }
                }
            }
        }
    }
}
