//! Uniform samples of a polytope {x : A x ≤ b}: coordinate-wise hit-and-run, which thin directions do not slow down.

use ipc_types::artefact::Region;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A walk through a region; each step is a sample.
#[derive(Debug)]
pub struct Walk<'a> {
    region: &'a Region,
    x: Vec<f64>,
    rng: ChaCha8Rng,
}

impl<'a> Walk<'a> {
    /// Begins at the region's centre.
    pub fn new(region: &'a Region, seed: u64) -> Walk<'a> {
        Walk { region, x: region.center.clone(), rng: ChaCha8Rng::seed_from_u64(seed) }
    }

    /// Largest excess `a·x − b` of a row; negative inside.
    pub fn excess(region: &Region, x: &[f64]) -> f64 {
        let rows = region.A.iter().zip(&region.b);
        rows.map(|(row, b)| row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>() - b)
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// The next sample: every coordinate in turn is drawn anew from its chord.
    pub fn step(&mut self) -> &[f64] {
        for idx in 0..self.x.len() {
            let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
            for (row, b) in self.region.A.iter().zip(&self.region.b) {
                let others = row.iter().zip(&self.x).enumerate().filter(|(k, _)| *k != idx);
                let rest = b - others.map(|(_, (a, x))| a * x).sum::<f64>();
                if row[idx] > 0.0 {
                    high = high.min(rest / row[idx]);
                } else if row[idx] < 0.0 {
                    low = low.max(rest / row[idx]);
                }
            }
            if low < high {
                self.x[idx] = low + (high - low) * self.rng.random::<f64>();
            }
        }
        &self.x
    }
}

/// Samples a region: 20,000, or 1,000,000 with `SLOW=1`, or what `SAMPLES_PER_REGION` says.
pub fn samples_per_region() -> usize {
    let said = std::env::var("SAMPLES_PER_REGION").ok().and_then(|text| text.parse().ok());
    said.unwrap_or(if std::env::var_os("SLOW").is_some_and(|word| word == "1") { 1_000_000 } else { 20_000 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_of_a_thin_triangle_are_uniform_and_inside() {
        // x ≥ 0, y ≥ 0, x + 1000 y ≤ 1: a thousand times as long as wide. The mean of y is a third of its height.
        let region = Region {
            id: 0,
            parent: None,
            A: vec![vec![-1.0, 0.0], vec![0.0, -1.0], vec![1.0, 1000.0]],
            b: vec![0.0, 0.0, 1.0],
            center: vec![0.25, 0.00025],
            method: String::new(),
            certified: false,
            margin: 0.0,
        };
        let mut walk = Walk::new(&region, 1);
        let n = 20_000;
        let mut sum = 0.0;
        for _ in 0..n {
            let x = walk.step().to_vec();
            assert!(Walk::excess(&region, &x) <= 1e-12);
            sum += x[1];
        }
        assert!((sum / f64::from(n) * 1000.0 - 1.0 / 3.0).abs() < 0.02);
    }
}
