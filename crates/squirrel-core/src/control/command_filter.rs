//! Command filter: smooths the 10 Hz steps of the outer loop and supplies their derivatives.
//!
//! `x'' = w^2 (u - x) - 2 zeta w x'` per axis (docs/equations.md B.2): steps must not be
//! differentiated, and the backstepping law wants the first and second derivative of its reference.

use crate::lane::Lane;
use crate::lane::functions::wrap;
use nalgebra::Vector3;

pub use crate::command::EulerReference;

/// Where the filter is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Filter<L> {
    /// Roll, pitch, yaw, rad.
    pub angle: [L; 3],
    /// Their rates, rad/s.
    pub rate: [L; 3],
}

/// What the filter is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Poles<L> {
    /// Square of the frequency, rad^2/s^2.
    pub stiffness: L,
    /// Twice the damping times the frequency, rad/s.
    pub damping: L,
}

impl<L: Lane> Poles<L> {
    /// * `frequency_rad_s`, `damping` - of the filter
    #[inline(always)]
    pub fn new(frequency_rad_s: L, damping: L) -> Self {
        let twice = L::of(2.0) * damping;
        Self { stiffness: frequency_rad_s * frequency_rad_s, damping: twice * frequency_rad_s }
    }
}

impl<L: Lane> Filter<L> {
    /// One step towards `target`, semi-implicit; the acceleration that it took, rad/s^2.
    ///
    /// * `target` - roll, pitch, yaw command, rad; each is reached the short way round
    /// * `dt_s` - step
    #[inline(always)]
    pub fn step(&mut self, target: &[L; 3], poles: &Poles<L>, dt_s: L) -> [L; 3] {
        let mut acceleration = *target;
        for i in 0..3 {
            let gap = wrap(target[i] - self.angle[i]);
            acceleration[i] = gap * poles.stiffness - self.rate[i] * poles.damping;
            self.rate[i] = self.rate[i] + acceleration[i] * dt_s;
            self.angle[i] = wrap(self.angle[i] + self.rate[i] * dt_s);
        }
        acceleration
    }
}

/// [`Filter::step`] of one vehicle.
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
    let mut moved = Filter { angle: filter.angle.into(), rate: filter.rate.into() };
    let acceleration = moved.step(&(*target).into(), &Poles::new(frequency_rad_s, damping), dt_s);
    *filter = EulerReference {
        angle: moved.angle.into(),
        rate: moved.rate.into(),
        acceleration: acceleration.into(),
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settles_without_overshoot_and_the_short_way_round() {
        let mut filter =
            EulerReference { angle: Vector3::new(0.0, 0.0, 3.0), ..EulerReference::default() };
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
