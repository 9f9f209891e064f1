//! Samples by which the loss of a cut is judged.
//!
//! Uniform samples of the region and of its intersections with the spaces of the task: the grasp band is a thin slab,
//! and a cut that costs little of the region can cost all of the band. They guide, they prove nothing.

use crate::samples::Samples;
use convex_sets::HPolyhedron;
use nalgebra::DVector;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Samples of one set.
#[derive(Debug, Clone)]
pub struct Stratum {
    /// Samples that are left.
    points: Samples,
    n: usize,
    n_initial: usize,
    /// Those of them that refused a cut of late, and the place of the next one: looked at first, since most cuts lose what
    /// others would have lost.
    refusing: Vec<f64>,
    next: usize,
}

/// The samples of all sets.
#[derive(Debug, Clone)]
pub struct Guide {
    strata: Vec<Stratum>,
}

impl Guide {
    /// `n_samples` of `region` from its inner point `center`, and as many of its intersection with each of `spaces`.
    pub fn new(
        region: &HPolyhedron,
        center: &DVector<f64>,
        spaces: &[HPolyhedron],
        n_samples: usize,
        rng: &mut ChaCha8Rng,
    ) -> Self {
        let mut strata = vec![Stratum::sample(region, center, n_samples, rng)];
        for space in spaces {
            let both = region.intersection(space);
            if let Ok(ball) = both.interior_point() {
                strata.push(Stratum::sample(&both, &ball.center, n_samples, rng));
            }
        }
        Self { strata }
    }

    /// The largest share of samples, of all that a stratum began with, that the cut a·q ≤ b loses; `None` if it is
    /// more than `most`.
    pub fn loss(&mut self, a: &[f64], b: f64, most: f64) -> Option<f64> {
        let mut largest = 0.0_f64;
        for stratum in &mut self.strata {
            let n_initial = stratum.n_initial as f64;
            let n_lost = stratum.n_lost(a, b, (most * n_initial) as usize)?;
            largest = largest.max(n_lost as f64 / n_initial.max(1.0));
        }
        Some(largest)
    }

    /// The samples that are left.
    pub fn samples(&self) -> impl Iterator<Item = Vec<f64>> + '_ {
        self.strata.iter().flat_map(|stratum| stratum.points.iter())
    }

    /// At most `n` of the region's own samples that are left, evenly spaced in their order.
    pub fn spread(&self, n: usize) -> impl Iterator<Item = Vec<f64>> + '_ {
        self.strata.iter().take(1).flat_map(move |stratum| {
            let n_left = stratum.points.len();
            (0..n_left).step_by(n_left.div_ceil(n.max(1)).max(1)).map(|i| stratum.points.point(i))
        })
    }

    /// Removes the samples that the cut loses.
    pub fn cut(&mut self, a: &[f64], b: f64) {
        for stratum in &mut self.strata {
            stratum.points.cut(a, b);
            let left = stratum.refusing.chunks_exact(stratum.n.max(1)).filter(|q| dot(a, q) <= b);
            stratum.refusing = left.flatten().copied().collect();
        }
    }

    /// The least share of the initial samples that is left, over the strata.
    pub fn least_kept(&self) -> f64 {
        self.strata.iter().map(Stratum::kept).fold(1.0, f64::min)
    }

    /// The share that is left of the region's own samples.
    pub fn kept(&self) -> f64 {
        self.strata.first().map_or(1.0, Stratum::kept)
    }
}

impl Stratum {
    fn sample(set: &HPolyhedron, from: &DVector<f64>, n_samples: usize, rng: &mut ChaCha8Rng) -> Self {
        let (m, n) = (set.n_faces(), set.ambient_dimension());
        let rows: Vec<f64> = (0..m).flat_map(|i| set.A.row(i).iter().copied().collect::<Vec<_>>()).collect();
        let mut q: Vec<f64> = from.iter().copied().collect();
        let mut slack: Vec<f64> = (0..m).map(|i| set.b[i] - dot(&rows[i * n..(i + 1) * n], &q)).collect();
        let mut points = Vec::with_capacity(n_samples * n);
        let half = set.bounding_box().map_or_else(|_| DVector::from_element(n, 1.0), |b| b.half_widths());
        let mut direction = vec![0.0; n];
        let mut speeds = vec![0.0; m];
        for step in 0..(n_samples + N_BURN_IN) * N_THINNING {
            for (d, h) in direction.iter_mut().zip(&half) {
                *d = h * (rng.random::<f64>() + rng.random::<f64>() + rng.random::<f64>() - 1.5);
            }
            let (mut least, mut most) = (f64::NEG_INFINITY, f64::INFINITY);
            for i in 0..m {
                speeds[i] = dot(&rows[i * n..(i + 1) * n], &direction);
                let t = slack[i].max(0.0) / speeds[i];
                if speeds[i] > 0.0 {
                    most = most.min(t);
                } else if speeds[i] < 0.0 {
                    least = least.max(t);
                }
            }
            if !(least <= most && least.is_finite() && most.is_finite()) {
                continue;
            }
            let t = least + (most - least) * rng.random::<f64>();
            for (q, d) in q.iter_mut().zip(&direction) {
                *q += t * d;
            }
            for (slack, speed) in slack.iter_mut().zip(&speeds) {
                *slack -= t * speed;
            }
            if step % N_THINNING == 0 && step >= N_BURN_IN * N_THINNING {
                points.extend_from_slice(&q);
            }
        }
        let n_initial = points.len() / n.max(1);
        Self { points: Samples::new(&points, n), n, n_initial, refusing: Vec::new(), next: 0 }
    }

    /// How many samples the cut loses; `None` if more than `most`.
    fn n_lost(&mut self, a: &[f64], b: f64, most: usize) -> Option<usize> {
        let n = self.n;
        if self.refusing.chunks_exact(n).filter(|q| dot(a, q) > b).count() > most {
            return None;
        }
        let refusing = match self.points.n_beyond(a, b, most) {
            Ok(n_lost) => return Some(n_lost),
            Err(q) => q,
        };
        // Each at most once, so that none is counted twice.
        if self.refusing.chunks_exact(n).all(|other| other != refusing) {
            self.next %= N_REFUSING;
            let place = (self.next * n).min(self.refusing.len());
            let end = (place + n).min(self.refusing.len());
            self.refusing.splice(place..end, refusing);
            self.next += 1;
        }
        None
    }

    fn kept(&self) -> f64 {
        if self.n_initial == 0 { 1.0 } else { self.points.len() as f64 / self.n_initial as f64 }
    }
}

/// Steps of hit-and-run between two samples.
const N_THINNING: usize = 4;
/// Samples that are thrown away at first.
const N_BURN_IN: usize = 50;
/// Samples that are looked at first.
const N_REFUSING: usize = 64;

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn a_spread_is_of_samples_that_are_left() {
        let center = DVector::from_vec(vec![0.0, 0.0]);
        let square = HPolyhedron::from_box(&center.add_scalar(-1.0), &center.add_scalar(1.0));
        let mut guide = Guide::new(&square, &center, &[], 1000, &mut ChaCha8Rng::seed_from_u64(1));
        guide.cut(&[1.0, 0.0], 0.2);
        for n in [1, 7, 24, 5000] {
            let spread: Vec<Vec<f64>> = guide.spread(n).collect();
            assert!(!spread.is_empty() && spread.len() <= n, "{} of {n}", spread.len());
            assert!(spread.iter().all(|q| q[0] <= 0.2 && guide.samples().any(|sample| sample == *q)));
        }
        guide.cut(&[1.0, 0.0], -2.0);
        assert_eq!(guide.spread(5).count(), 0);
    }

    #[test]
    fn losses_are_those_of_a_count_whatever_was_refused_before() {
        let center = DVector::from_vec(vec![0.0, 0.0]);
        let square = HPolyhedron::from_box(&center.add_scalar(-1.0), &center.add_scalar(1.0));
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut guide = Guide::new(&square, &center, &[], 1000, &mut rng);
        let (mut n_refused, mut n_allowed) = (0, 0);
        for step in 0..3000 {
            let angle = std::f64::consts::TAU * rng.random::<f64>();
            let (a, b) = ([angle.cos(), angle.sin()], 1.4 * rng.random::<f64>());
            let n_lost = guide.samples().filter(|q| dot(&a, q) > b).count();
            let most = rng.random_range(0..100_usize);
            // Half a sample more: a share of so many samples is rounded.
            let loss = guide.loss(&a, b, (most as f64 + 0.5) / 1000.0);
            assert_eq!(loss, (n_lost <= most).then_some(n_lost as f64 / 1000.0), "step {step}");
            n_refused += usize::from(loss.is_none());
            n_allowed += usize::from(loss.is_some());
            if step % 100 == 0 {
                guide.cut(&a, b.max(1.0));
            }
        }
        // More than are looked at first, so that some made room for others.
        assert!(n_refused > 10 * N_REFUSING && n_allowed > 100, "{n_refused}, {n_allowed}");
    }
}
