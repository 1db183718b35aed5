//! Aerodynamics: motion through the air, and the flat plate.

pub mod flat_plate;

use crate::frames::{Body, In};
use crate::math::{Real, limit};

/// Motion of the airframe through the air, expressed in the body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air<T: Real> {
    /// Velocity relative to the air, m/s.
    pub velocity: In<Body, T>,
    /// Its norm, m/s.
    pub speed: T,
    /// Angular rate of the airframe, rad/s.
    pub omega: In<Body, T>,
}

impl<T: Real> Air<T> {
    /// From the velocity relative to the air, m/s, and the angular rate, rad/s.
    #[inline(always)]
    pub fn new(velocity: In<Body, T>, omega: In<Body, T>) -> Self {
        Self { velocity, speed: velocity.vector.norm(), omega }
    }
}

/// Angle of attack of the wing plane, rad, in [-pi/2, pi/2]: `sin(alpha) = n . v / |v|`, positive where the air hits the
/// belly. 0 below 0.3 m/s, where the direction of the air means nothing (docs/equations.md T5).
///
/// * `velocity` - velocity relative to the air, m/s
pub fn angle_of_attack(velocity: In<Body, f32>) -> f32 {
    let speed = velocity.vector.norm();
    if !(speed >= 0.3) {
        return 0.0;
    }
    libm::asinf(limit(velocity.vector.z / speed, -1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn air_on_the_belly_is_a_positive_angle() {
        let falling = In::new(Vector3::new(0.0, 0.0, 5.0));
        assert!((angle_of_attack(falling) - core::f32::consts::FRAC_PI_2).abs() < 1e-3);
        let nose_up_glide = In::new(Vector3::new(7.0 * 0.866, 0.0, 3.5));
        assert!((angle_of_attack(nose_up_glide) - core::f32::consts::FRAC_PI_6).abs() < 1e-3);
        assert!(angle_of_attack(In::new(Vector3::new(7.0, 0.0, -1.0))) < 0.0);
        assert_eq!(angle_of_attack(In::zero()), 0.0);
    }
}
