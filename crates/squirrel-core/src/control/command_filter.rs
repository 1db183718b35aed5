//! Command filter: smooths the 10 Hz steps of the outer loop and supplies their derivatives.
//!
//! `x'' = w^2 (u - x) - 2 zeta w x'` per axis (docs/equations.md B.2): steps must not be differentiated, and the backstepping law
//! wants the first and second derivative of its reference.

use crate::math::wrap_angle;
use nalgebra::Vector3;

pub use crate::command::EulerReference;

/// One step towards `target`, semi-implicit.
///
/// * `target` - roll, pitch, yaw command, rad
/// * `frequency_rad_s`, `damping` - of the filter
/// * `dt_s` - step
pub fn step(
    filter: &mut EulerReference,
    target: &Vector3<f32>,
    frequency_rad_s: f32,
    damping: f32,
    dt_s: f32,
) {
    let mut gap = target - filter.angle;
    // Pitch never comes near half a turn.
    (gap.x, gap.z) = (wrap_angle(gap.x), wrap_angle(gap.z));
    filter.acceleration =
        gap * (frequency_rad_s * frequency_rad_s) - filter.rate * (2.0 * damping * frequency_rad_s);
    filter.rate += filter.acceleration * dt_s;
    filter.angle += filter.rate * dt_s;
    (filter.angle.x, filter.angle.z) = (wrap_angle(filter.angle.x), wrap_angle(filter.angle.z));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settles_without_overshoot_and_the_short_way_round() {
        let mut filter = EulerReference { angle: Vector3::new(0.0, 0.0, 3.0), ..EulerReference::default() };
        let target = Vector3::new(0.5, -0.3, -3.0);
        let mut highest = 0.0_f32;
        for _ in 0..300 {
            step(&mut filter, &target, 20.0, 1.0, 1.0 / 300.0);
            highest = highest.max(filter.angle.x);
            assert!(filter.angle.z.abs() > 2.9, "yaw goes through pi, not through zero");
        }
        assert!((filter.angle - target).norm() < 1e-3 && highest < 0.5 + 1e-4);
    }

    #[test]
    fn the_rate_is_the_derivative_of_the_angle() {
        let mut filter = EulerReference::default();
        for _ in 0..60 {
            let before = filter.angle.x;
            step(&mut filter, &Vector3::new(0.4, 0.0, 0.0), 20.0, 1.0, 1e-3);
            assert!(((filter.angle.x - before) / 1e-3 - filter.rate.x).abs() < 1e-3);
        }
    }
}
