//! Shares of a set that regions cover, estimated from samples.

use convex_sets::HPolyhedron;

/// A share in [0, 1] with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Share of the samples.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

/// The Wilson score interval at 95 % for `n_hits` of `n_samples` independent trials (Wilson 1927). Without samples
/// nothing is known: (0, 0, 1).
pub fn wilson_interval(n_hits: usize, n_samples: usize) -> Estimate {
    if n_samples == 0 {
        return Estimate { value: 0.0, low: 0.0, high: 1.0 };
    }
    const Z: f64 = 1.959_963_984_540_054;
    let n = n_samples as f64;
    let share = n_hits as f64 / n;
    let center = (share + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
    let half = Z / (1.0 + Z * Z / n) * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
    Estimate { value: share, low: (center - half).max(0.0), high: (center + half).min(1.0) }
}

/// Whether one of `regions` contains `q`.
pub fn covered(regions: &[HPolyhedron], q: &[f64]) -> bool {
    regions.iter().any(|region| contains(region, q))
}

/// Whether `region` contains `q`, faces included.
pub(crate) fn contains(region: &HPolyhedron, q: &[f64]) -> bool {
    (0..region.n_faces()).all(|face_idx| {
        (0..q.len()).map(|j| region.A[(face_idx, j)] * q[j]).sum::<f64>() <= region.b[face_idx]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wilson_1927() {
        let close = |a: f64, b: f64| (a - b).abs() < 5e-5;
        let e = wilson_interval(8, 10);
        assert!(close(e.low, 0.4902) && close(e.high, 0.9433), "{e:?}");
        let all = wilson_interval(4000, 4000);
        assert!(close(all.low, 0.99904) && all.high == 1.0, "{all:?}");
        let none = wilson_interval(0, 10);
        assert!(none.low == 0.0 && close(none.high, 0.2775), "{none:?}");
    }

    #[test]
    fn no_samples_say_nothing() {
        assert_eq!(wilson_interval(0, 0), Estimate { value: 0.0, low: 0.0, high: 1.0 });
    }
}
