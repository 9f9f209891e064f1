//! Collision verdicts for configurations from standard input, to compare with those of another engine.
//!
//! `verdicts SCENE < CONFIGURATIONS`: a line of coordinates, separated by spaces, for each configuration; out comes a
//! line for each, 1 for free and 0 for in collision, without any clearance.

use collision::CollisionChecker;
use scene::Scene;
use std::io::{BufRead, Write};
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args_os().nth(1).ok_or("usage: verdicts SCENE < CONFIGURATIONS")?;
    let scene = Scene::load(Path::new(&path))?;
    let checker = CollisionChecker::new(&scene);
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    for (line_idx, line) in std::io::stdin().lock().lines().enumerate() {
        let q: Vec<f64> = line?.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
        if q.len() != scene.dim() {
            let (found, n) = (q.len(), scene.dim());
            return Err(format!("line {}: {found} numbers, {n} coordinates", line_idx + 1).into());
        }
        writeln!(out, "{}", u8::from(checker.is_free(&q)))?;
    }
    Ok(out.flush()?)
}
