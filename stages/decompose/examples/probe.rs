//! Scratch.
use collision::CollisionChecker;
use decompose::*;
struct Printing(std::time::Instant);
impl Sink for Printing {
    type Error = std::convert::Infallible;
    fn region(&mut self, r: &wire::Region) -> Result<(), Self::Error> {
        let b = r.polyhedron.bounding_box().unwrap();
        println!(
            "{:?} region {} {} {} faces {:.4?} {:.4?}",
            self.0.elapsed(),
            r.id,
            r.method,
            r.polyhedron.n_faces(),
            b.lower.as_slice(),
            b.upper.as_slice()
        );
        Ok(())
    }
    fn progress(&mut self, n: usize, c: f64, m: &str) {
        println!("{:?} {n} {c} {m}", self.0.elapsed());
    }
    fn certified(&mut self, _: &[u64]) -> Result<Option<Vec<wire::Region>>, Self::Error> {
        println!("{:?} certified asked", self.0.elapsed());
        Ok(None)
    }
}
fn main() {
    let mut args = std::env::args().skip(1);
    let name = args.next().unwrap();
    let seed = args.next().unwrap().parse().unwrap();
    let scene = scene::Scene::load(&std::path::Path::new("scenes").join(&name)).unwrap();
    let task = scene.task(None).ok();
    let checker =
        task.map_or_else(|| CollisionChecker::new(&scene), |t| CollisionChecker::for_task(&scene, t));
    let problem = problem_of_scene(&scene, task, &checker);
    println!("{:?}", problem.displacement);
    let t = std::time::Instant::now();
    let found = decompose(&problem, &Options::default(), seed, &mut Printing(t), &|| false).unwrap();
    println!(
        "{:?} {} regions total {:?} grasp {:?} chord {:?} {:?}",
        t.elapsed(),
        found.regions.len(),
        found.total,
        found.grasp,
        found.chord.as_ref().map(|c| c.share()),
        found.ending
    );
    if let Some(task) = task {
        use rand::{RngExt, SeedableRng};
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let (l, u) = (&task.grasp.lower, &task.grasp.upper);
        let polys: Vec<_> = found.regions.iter().map(|r| r.polyhedron.clone()).collect();
        let mut k = 0;
        for _ in 0..20000 {
            let q: Vec<f64> = (0..l.len()).map(|j| l[j] + (u[j] - l[j]) * rng.random::<f64>()).collect();
            if checker.is_free(&q) && !covered(&polys, &q) && k < 15 {
                k += 1;
                println!("uncovered in CG {:.6?}", &q[1..]);
            }
        }
    }
}
