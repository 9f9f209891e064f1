//! The decomposition that a scene and its task ask for.

use collision::CollisionChecker;
use convex_sets::Hyperrectangle;
use manipulation::polytope_of_space;
use nalgebra::{DMatrix, DVector};
use scene::{Scene, Task};

use crate::problem::{Anchor, Problem};

/// CS_free of `checker`, which was made for `scene` (and `task`); without a task only CS_free is to be covered.
pub fn problem_of_scene<'a>(
    scene: &Scene,
    task: Option<&Task>,
    checker: &'a CollisionChecker,
) -> Problem<'a> {
    let n = scene.dim();
    let displacement = DVector::from_fn(n, |j, _| {
        let mut unit = vec![0.0; n];
        unit[j] = 1.0;
        checker.displacement_bound(&unit)
    });
    Problem {
        limits: Hyperrectangle { lower: scene.lower(), upper: scene.upper() },
        relevant: checker.relevant_coordinates().to_vec(),
        displacement,
        free: checker,
        grasp: task.map(|task| polytope_of_space(&task.grasp)),
        placement: task.map(|task| polytope_of_space(&task.placement)),
        transfer_keep: task
            .map(|task| DMatrix::from_fn(task.transfer_keep.len(), n, |i, j| task.transfer_keep[i][j])),
        anchors: task.map_or_else(Vec::new, |task| {
            [("start", &task.start), ("goal", &task.goal)]
                .map(|(name, q)| Anchor { name: name.to_owned(), q: q.clone() })
                .to_vec()
        }),
    }
}
