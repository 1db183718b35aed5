//! The gyroscope against the attitude: how much faster the vehicle turned than the gyroscope says.
//!
//! ```text
//! e_i = log(B_i^-1 A_i)     A_i: turn of the attitude from one knot to the next, B_i: of the gyroscope     every 20 ms
//! C_i = sum e_j, j < i      row: (mean of C over a window - mean over the window before) / T                T = 0.2 s
//! ```
//! Rows are rates about the axes of the body, so that a gyroscope's scale makes them proportional
//! to its rates. Means over windows keep the noise of single attitudes out of them. Small angles
//! add up.

use nalgebra::{UnitQuaternion, Vector3};

/// Time between knots, and of a window, s.
const KNOT_S: f64 = 0.02;
const WINDOW_S: f64 = 0.2;

/// What the gyroscope of one piece says of its turns.
pub(super) struct Turning {
    /// Samples of the grid from knot to knot, and knots of a window.
    every: usize,
    window: usize,
    period_s: f64,
    /// Turn from each knot to the next, as a rotation vector, rad.
    turns: Vec<Vector3<f64>>,
}

impl Turning {
    /// * `omega` - measured rates on a grid, rad/s
    pub(super) fn new(omega: &[Vector3<f64>], period_s: f64) -> Self {
        let every = (KNOT_S / period_s).round().max(1.0) as usize;
        let window = (WINDOW_S / (every as f64 * period_s)).round().max(1.0) as usize;
        let turn = |k: usize| {
            let between = omega[k..=k + every].windows(2);
            // The mean of two samples is the rate between them.
            let steps =
                between.map(|w| UnitQuaternion::from_scaled_axis((w[0] + w[1]) * (0.5 * period_s)));
            steps.fold(UnitQuaternion::identity(), |q, step| q * step).scaled_axis()
        };
        let knots = (0..omega.len().saturating_sub(every)).step_by(every);
        Self { every, window, period_s, turns: knots.map(turn).collect() }
    }

    /// Time between rows, and of the first, from the start of the piece, s.
    pub(super) fn step_s(&self) -> f64 {
        (self.window * self.every) as f64 * self.period_s
    }

    /// The rows of a hypothesis about both, rad/s; the mean of the piece, which is the gyroscope's
    /// bias, is removed.
    ///
    /// * `attitude` - on the grid
    /// * `scale` - what the gyroscope reads of a rate, by axis
    pub(super) fn rows(
        &self,
        attitude: &[UnitQuaternion<f64>],
        scale: &Vector3<f64>,
    ) -> Vec<Vector3<f64>> {
        let mut sum = Vector3::zeros();
        let mut means = Vec::with_capacity(self.turns.len() / self.window);
        for window in self
            .turns
            .chunks_exact(self.window)
            .enumerate()
            .map(|(w, turns)| (w * self.window, turns))
        {
            let (first, turns) = window;
            let mut mean = Vector3::zeros();
            for (i, turn) in turns.iter().enumerate() {
                mean += sum;
                let from = (first + i) * self.every;
                let gyroscope = UnitQuaternion::from_scaled_axis(turn.component_div(scale));
                let error =
                    gyroscope.inverse() * (attitude[from].inverse() * attitude[from + self.every]);
                // Of a small rotation, twice the vector part is the angle.
                sum += error.imag() * (2.0 * error.w.signum());
            }
            means.push(mean / turns.len() as f64);
        }
        let mut rows: Vec<Vector3<f64>> =
            means.windows(2).map(|pair| (pair[1] - pair[0]) / self.step_s()).collect();
        let mean = rows.iter().sum::<Vector3<f64>>() / rows.len().max(1) as f64;
        for row in &mut rows {
            *row -= mean;
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 0.004;

    /// A vehicle that turns about all axes, and what a gyroscope with a scale and a bias says.
    fn flown(scale: Vector3<f64>) -> (Vec<UnitQuaternion<f64>>, Vec<Vector3<f64>>) {
        let rate =
            |t: f64| Vector3::new((5.0 * t).sin(), 0.7 * (3.0 * t).cos(), 0.5 * (1.1 * t).sin());
        let mut q = UnitQuaternion::from_euler_angles(0.1, -0.2, 2.0);
        let (mut attitude, mut omega) = (Vec::new(), Vec::new());
        for k in 0..5000 {
            let t = f64::from(k) * PERIOD_S;
            attitude.push(q);
            omega.push(rate(t).component_mul(&scale) + Vector3::new(0.01, 0.0, -0.02));
            q *= UnitQuaternion::from_scaled_axis(rate(t + 0.5 * PERIOD_S) * PERIOD_S);
        }
        (attitude, omega)
    }
    fn largest(rows: &[Vector3<f64>]) -> f64 {
        rows.iter().map(Vector3::amax).fold(0.0, f64::max)
    }

    #[test]
    fn a_right_gyroscope_with_a_bias_leaves_nothing_and_a_known_scale_is_taken_off() {
        let one = Vector3::repeat(1.0);
        let (attitude, omega) = flown(one);
        let rows = Turning::new(&omega, PERIOD_S).rows(&attitude, &one);
        assert!(rows.len() > 95 && largest(&rows) < 1e-3, "{}", largest(&rows));
        let scale = Vector3::new(1.05, 0.96, 1.08);
        let (attitude, omega) = flown(scale);
        let turning = Turning::new(&omega, PERIOD_S);
        // Of a bias, the scale is taken off, too; it is constant.
        assert!(largest(&turning.rows(&attitude, &scale)) < 2e-3);
    }

    #[test]
    fn a_scale_shows_in_proportion_to_the_rate() {
        let (attitude, omega) = flown(Vector3::new(1.05, 1.0, 1.0));
        let turning = Turning::new(&omega, PERIOD_S);
        let rows = turning.rows(&attitude, &Vector3::repeat(1.0));
        let step_s = turning.step_s();
        let (mut product, mut square) = (0.0, 0.0);
        for (i, row) in rows.iter().enumerate() {
            let t = (i as f64 + 1.0) * step_s;
            product += row.x * (5.0 * t).sin();
            square += (5.0 * t).sin().powi(2);
        }
        // The windows pass sinc^2 of it.
        let passed = (2.5 * step_s).sin() / (2.5 * step_s);
        assert!((product / square + 0.05 * passed * passed).abs() < 3e-3, "{}", product / square);
    }
}
