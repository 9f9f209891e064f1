//! A Bézier curve on a stretch of its parameter, enclosed by intervals.

use crate::interval::Interval;

/// All coordinates at one parameter.
pub struct Values {
    /// The coordinates.
    pub q: Vec<Interval>,
    /// Their sines and cosines.
    pub sin_cos: Vec<(Interval, Interval)>,
}

/// The curve on [t_0, t_1], its own parameter running over [0, 1].
pub struct Stretch {
    /// At t_0, in the middle, at t_1.
    pub values: [Values; 3],
    /// Upper bounds of |q_j'|.
    pub speed: Vec<f64>,
    /// Upper bounds of |q_j''|.
    pub acceleration: Vec<f64>,
    /// Upper bound of the longer part that the middle leaves: one half but for rounding.
    pub half: Interval,
}

impl Stretch {
    /// Of the curve with these control points (at least 2), 0 ≤ t_0 < t_1 ≤ 1.
    pub fn new(control_points: &[Vec<f64>], t_0: f64, t_1: f64) -> Self {
        let dim = control_points[0].len();
        let order = control_points.len() - 1;
        let m = 0.5 * t_0 + 0.5 * t_1;
        let at = |t: f64| {
            let q: Vec<Interval> = (0..dim).map(|j| blossom(control_points, j, &vec![t; order])).collect();
            let sin_cos = q.iter().map(|q| q.sin_cos()).collect();
            Values { q, sin_cos }
        };
        let (mut speed, mut acceleration) = (vec![0.0; dim], vec![0.0; dim]);
        let scale = order as f64;
        for j in 0..dim {
            // Control point k of the stretch is the blossom at order − k times t_0 and k times t_1.
            let net: Vec<Interval> = (0..=order)
                .map(|k| {
                    let arguments: Vec<f64> = (0..order).map(|i| if i < k { t_1 } else { t_0 }).collect();
                    blossom(control_points, j, &arguments)
                })
                .collect();
            let first: Vec<Interval> = net.windows(2).map(|pair| pair[1] - pair[0]).collect();
            let second: Vec<Interval> = first.windows(2).map(|pair| pair[1] - pair[0]).collect();
            speed[j] = largest(&first, Interval::point(scale));
            acceleration[j] = largest(&second, Interval::point(scale) * Interval::point(scale - 1.0));
        }
        let point = Interval::point;
        let longer = (point(m) - point(t_0)).hi().max((point(t_1) - point(m)).hi());
        let half = point(longer) * (point(t_1) - point(t_0)).recip();
        Self { values: [at(t_0), at(m), at(t_1)], speed, acceleration, half }
    }
}

/// Upper bound of `scale` times the largest magnitude.
fn largest(differences: &[Interval], scale: Interval) -> f64 {
    let magnitude = differences.iter().map(|d| d.magnitude()).fold(0.0, f64::max);
    (Interval::point(magnitude) * scale).hi()
}

/// Coordinate j of the curve's blossom: de Casteljau's rule with one argument a level. Constant coordinates stay exact.
fn blossom(control_points: &[Vec<f64>], j: usize, arguments: &[f64]) -> Interval {
    if control_points.iter().all(|point| point[j] == control_points[0][j]) {
        return Interval::point(control_points[0][j]);
    }
    let mut points: Vec<Interval> = control_points.iter().map(|point| Interval::point(point[j])).collect();
    for &t in arguments {
        let t = Interval::point(t);
        let rest = Interval::ONE - t;
        for k in 0..points.len() - 1 {
            points[k] = rest * points[k] + t * points[k + 1];
        }
        points.pop();
    }
    points[0]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_on_a_stretch() {
        // 2 t − 2 t² on [1/4, 3/4]: 3/8, 1/2, 3/8; slope at most 1 · 1/2, second derivative 4 · 1/4.
        let stretch = Stretch::new(&[vec![0.0], vec![1.0], vec![0.0]], 0.25, 0.75);
        for (values, expected) in stretch.values.iter().zip([0.375, 0.5, 0.375]) {
            assert!(values.q[0].lo() <= expected && expected <= values.q[0].hi());
            assert!(values.q[0].hi() - values.q[0].lo() < 1e-14);
        }
        assert!((0.5..0.5 + 1e-14).contains(&stretch.speed[0]));
        assert!((1.0..1.0 + 1e-13).contains(&stretch.acceleration[0]));
        assert!(stretch.half.hi() >= 0.5 && stretch.half.hi() < 0.5 + 1e-15);
    }
}
