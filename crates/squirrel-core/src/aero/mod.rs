//! Aerodynamics: motion through the air, drag of the airframe, flat plate and membrane.

pub mod flat_plate;
pub mod induced;
pub mod membrane;

use crate::frames::{Body, In, Wrench};
use crate::lane::Lane;
use crate::lane::vector::plus;
use crate::math::{Real, limit};
use nalgebra::Vector3;

/// Motion of the airframe through the air, expressed in the body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air<T: Real> {
    /// Velocity relative to the air, m/s.
    pub velocity: In<Body, T>,
    /// Its norm, m/s.
    pub speed: T,
    /// Angular rate of the airframe relative to the air, rad/s.
    pub omega: In<Body, T>,
}

impl<T: Real> Air<T> {
    /// From the velocity relative to the air, m/s, and the angular rate
    /// relative to it, rad/s.
    #[inline(always)]
    pub fn new(velocity: In<Body, T>, omega: In<Body, T>) -> Self {
        Self { velocity, speed: velocity.vector.norm(), omega }
    }
}

/// [`Air`] as formulas on lanes take it: plain arrays, body frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Airflow<L> {
    /// Velocity relative to the air, m/s.
    pub velocity: [L; 3],
    /// Its norm, m/s.
    pub speed: L,
    /// Angular rate of the airframe relative to the air, rad/s.
    pub omega: [L; 3],
}

impl<T: Real> From<&Air<T>> for Airflow<T> {
    #[inline(always)]
    fn from(air: &Air<T>) -> Self {
        Self {
            velocity: air.velocity.vector.into(),
            speed: air.speed,
            omega: air.omega.vector.into(),
        }
    }
}

/// Force and moment as formulas on lanes take them: plain arrays, body frame, N and N m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyWrench<L> {
    /// Force.
    pub force: [L; 3],
    /// Moment about the centre of mass.
    pub moment: [L; 3],
}

impl<L: Lane> BodyWrench<L> {
    /// Nothing.
    #[inline(always)]
    pub fn zero() -> Self {
        Self { force: [L::of(0.0); 3], moment: [L::of(0.0); 3] }
    }
    /// A force through the centre of mass.
    #[inline(always)]
    pub fn from_force(force: [L; 3]) -> Self {
        Self { force, moment: [L::of(-0.0); 3] }
    }
    /// A moment alone.
    #[inline(always)]
    pub fn from_moment(moment: [L; 3]) -> Self {
        Self { force: [L::of(-0.0); 3], moment }
    }
    /// Both together.
    #[inline(always)]
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self { force: plus(&self.force, &other.force), moment: plus(&self.moment, &other.moment) }
    }
}

impl<T: Real> From<BodyWrench<T>> for Wrench<Body, T> {
    #[inline(always)]
    fn from(wrench: BodyWrench<T>) -> Self {
        Self {
            force: In::new(Vector3::from(wrench.force)),
            moment: In::new(Vector3::from(wrench.moment)),
        }
    }
}

impl<T: Real> From<Wrench<Body, T>> for BodyWrench<T> {
    #[inline(always)]
    fn from(wrench: Wrench<Body, T>) -> Self {
        Self { force: wrench.force.vector.into(), moment: wrench.moment.vector.into() }
    }
}

/// Drag of the airframe against the motion, N: `D v + 1/2 rho C_d A |v| v`.
///
/// * `linear` - `D` along each axis, N s/m
/// * `per_square` - `1/2 rho C_d A`, N s^2/m^2
#[inline(always)]
pub fn drag<L: Lane>(linear: &[L; 3], per_square: L, flow: &Airflow<L>) -> [L; 3] {
    let quadratic = per_square * flow.speed;
    let mut drag = flow.velocity;
    for i in 0..3 {
        drag[i] = linear[i] * flow.velocity[i] + flow.velocity[i] * quadratic;
    }
    drag
}

/// Angle of attack of the wing plane, rad, in [-pi/2, pi/2]: `sin(alpha) = n . v / |v|`, positive
/// where the air hits the belly. 0 below 0.3 m/s, where the direction of the air means nothing
/// (docs/equations.md T5).
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
