//! Many points, stored so that half-spaces are tested on several at a time.

/// Points that are tested side by side.
const LANES: usize = 8;

/// Points of n coordinates each.
#[derive(Debug, Clone)]
pub struct Samples {
    /// Blocks of [`LANES`] points, in each one lane after the other for each coordinate; places without a point are NaN,
    /// which is beyond no half-space.
    blocks: Vec<f64>,
    n: usize,
    len: usize,
}

impl Samples {
    /// From `points`, one after the other [n each].
    pub fn new(points: &[f64], n: usize) -> Self {
        let mut samples = Self { blocks: Vec::new(), n, len: points.len() / n.max(1) };
        samples.blocks.resize(samples.len.next_multiple_of(LANES) * n, f64::NAN);
        for (i, point) in points.chunks_exact(n.max(1)).enumerate() {
            let at = samples.position(i);
            point.iter().enumerate().for_each(|(j, x)| samples.blocks[at + j * LANES] = *x);
        }
        samples
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Where point `i` begins; the coordinates follow at distances of [`LANES`].
    fn position(&self, i: usize) -> usize {
        i / LANES * LANES * self.n + i % LANES
    }

    /// Point `i` [n].
    pub fn point(&self, i: usize) -> Vec<f64> {
        self.blocks[self.position(i)..].iter().step_by(LANES).take(self.n).copied().collect()
    }

    /// All points.
    pub fn iter(&self) -> impl Iterator<Item = Vec<f64>> + '_ {
        (0..self.len).map(|i| self.point(i))
    }

    /// How many points are beyond a·q ≤ b; or one of them, once they are more than `most`.
    pub fn n_beyond(&self, a: &[f64], b: f64, most: usize) -> Result<usize, Vec<f64>> {
        let mut n_beyond = 0;
        for (block, points) in self.blocks.chunks_exact((self.n * LANES).max(1)).enumerate() {
            let along = along(points, a);
            n_beyond += along.iter().filter(|along| **along > b).count();
            if n_beyond > most
                && let Some(lane) = along.iter().position(|along| *along > b)
            {
                return Err(self.point(block * LANES + lane));
            }
        }
        Ok(n_beyond)
    }

    /// Removes the points beyond a·q ≤ b; the others keep their order.
    pub fn cut(&mut self, a: &[f64], b: f64) {
        let (n, mut n_kept) = (self.n, 0);
        for first in (0..self.len).step_by(LANES) {
            let along = along(&self.blocks[first * n..(first + LANES) * n], a);
            for i in (first..self.len.min(first + LANES)).filter(|&i| along[i - first] <= b) {
                let (from, to) = (self.position(i), self.position(n_kept));
                if to < from {
                    (0..n * LANES).step_by(LANES).for_each(|j| self.blocks[to + j] = self.blocks[from + j]);
                }
                n_kept += 1;
            }
        }
        self.len = n_kept;
        self.blocks.truncate(n_kept.next_multiple_of(LANES) * n);
        for i in n_kept..n_kept.next_multiple_of(LANES) {
            let at = self.position(i);
            (0..n * LANES).step_by(LANES).for_each(|j| self.blocks[at + j] = f64::NAN);
        }
    }
}

/// a·q of the points of a block.
fn along(points: &[f64], a: &[f64]) -> [f64; LANES] {
    let mut along = [0.0; LANES];
    for (points, a) in points.chunks_exact(LANES).zip(a) {
        for (along, x) in along.iter_mut().zip(points) {
            *along += a * x;
        }
    }
    along
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn they_are_those_of_a_list(
            points in prop::collection::vec([-1.0..1.0_f64, -1.0..1.0, -1.0..1.0], 0..40),
            faces in prop::collection::vec(([-1.0..1.0_f64, -1.0..1.0, -1.0..1.0], -0.5..1.0_f64), 1..5),
            most in 0_usize..10,
        ) {
            let mut list = points.clone();
            let mut samples = Samples::new(&points.concat(), 3);
            for (a, b) in faces {
                let is_beyond = |q: &[f64]| a[0] * q[0] + a[1] * q[1] + a[2] * q[2] > b;
                let n_beyond = list.iter().filter(|q| is_beyond(&q[..])).count();
                match samples.n_beyond(&a, b, most) {
                    Ok(n) => prop_assert!(n == n_beyond && n <= most),
                    Err(q) => prop_assert!(n_beyond > most && is_beyond(&q)),
                }
                samples.cut(&a, b);
                list.retain(|q| !is_beyond(&q[..]));
                prop_assert_eq!(samples.len(), list.len());
                prop_assert!(samples.iter().zip(&list).all(|(x, y)| x == y));
            }
        }
    }
}
