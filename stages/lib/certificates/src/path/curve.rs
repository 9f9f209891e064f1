//! Bézier curves as flat control nets, cut in half by de Casteljau's rule.

/// Writes the control nets of the two halves of `net` (order + 1 points of `dim` coordinates) into `left` and `right`,
/// each as long as `net`. Control points that agree in a coordinate agree in it afterwards, exactly.
pub fn halve(net: &[f64], dim: usize, left: &mut [f64], right: &mut [f64]) {
    let n_points = net.len() / dim;
    right.copy_from_slice(net);
    left[..dim].copy_from_slice(&net[..dim]);
    // `right` holds the points of each level of the triangle at its end; the first of each level goes to `left`.
    for level in 1..n_points {
        for point_idx in 0..n_points - level {
            for j in 0..dim {
                let (a, b) = (right[point_idx * dim + j], right[(point_idx + 1) * dim + j]);
                right[point_idx * dim + j] = if a == b { a } else { 0.5 * a + 0.5 * b };
            }
        }
        left[level * dim..(level + 1) * dim].copy_from_slice(&right[..dim]);
    }
}

/// Bounds of |q_j'| and |q_j''| over the curve, its own parameter running over [0, 1], from first and second
/// differences of the control points.
pub fn derivative_bounds(net: &[f64], dim: usize, speed: &mut [f64], acceleration: &mut [f64]) {
    let order = net.len() / dim - 1;
    speed.fill(0.0);
    acceleration.fill(0.0);
    for point_idx in 0..order {
        for j in 0..dim {
            let difference = net[(point_idx + 1) * dim + j] - net[point_idx * dim + j];
            speed[j] = speed[j].max(difference.abs());
            if point_idx + 1 < order {
                let next = net[(point_idx + 2) * dim + j] - net[(point_idx + 1) * dim + j];
                acceleration[j] = acceleration[j].max((next - difference).abs());
            }
        }
    }
    let order = order as f64;
    for j in 0..dim {
        speed[j] *= order;
        acceleration[j] *= order * (order - 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Bernstein sum.
    fn at(net: &[f64], t: f64) -> f64 {
        let order = net.len() as i32 - 1;
        let mut binomial = 1.0;
        let mut sum = 0.0;
        for (k, c) in (0..).zip(net) {
            sum += binomial * t.powi(k) * (1.0 - t).powi(order - k) * c;
            binomial *= f64::from(order - k) / f64::from(k + 1);
        }
        sum
    }

    #[test]
    fn a_parabola_has_its_second_derivative() {
        // (1 - t)² 0 + 2 t (1 - t) 1 + t² 0 = 2 t - 2 t²
        let (mut speed, mut acceleration) = ([0.0], [0.0]);
        derivative_bounds(&[0.0, 1.0, 0.0], 1, &mut speed, &mut acceleration);
        assert_eq!((speed, acceleration), ([2.0], [4.0]));
        derivative_bounds(&[0.25, 1.0], 1, &mut speed, &mut acceleration);
        assert_eq!((speed, acceleration), ([0.75], [0.0]));
    }

    proptest! {
        #[test]
        fn halves_are_the_curve_and_bounds_hold(
            net in prop::collection::vec(-2.0..2.0_f64, 2..7),
            t in 0.0..1.0_f64,
        ) {
            let (mut left, mut right) = (net.clone(), net.clone());
            halve(&net, 1, &mut left, &mut right);
            prop_assert!((at(&left, t) - at(&net, 0.5 * t)).abs() < 1e-12);
            prop_assert!((at(&right, t) - at(&net, 0.5 + 0.5 * t)).abs() < 1e-12);
            let (mut speed, mut acceleration) = ([0.0], [0.0]);
            derivative_bounds(&net, 1, &mut speed, &mut acceleration);
            let (h, t) = (1e-3, t.clamp(0.01, 0.99));
            let first = (at(&net, t + h) - at(&net, t - h)) / (2.0 * h);
            let second = (at(&net, t + h) - 2.0 * at(&net, t) + at(&net, t - h)) / (h * h);
            prop_assert!(first.abs() <= speed[0] + 1e-6);
            prop_assert!(second.abs() <= acceleration[0] + 1e-6);
        }
    }
}
