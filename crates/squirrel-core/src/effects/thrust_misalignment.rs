//! Thrust that is not along body z: `F_xy -= T (e_x, e_y)`.

use super::{Effect, EffectParameter, Situation};
use crate::frames::{Body, In, Wrench};
use crate::math::Real;
use nalgebra::Vector3;

/// Tilt of the thrust.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThrustMisalignment<T>(pub(super) [T; 2]);

impl<T: Real> Effect<T> for ThrustMisalignment<T> {
    const NAME: &'static str = "thrust_misalignment";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("tilt_x_rad", 0.017, 0.07),
        EffectParameter::signed("tilt_y_rad", 0.017, 0.07),
    ];

    #[inline(always)]
    fn wrench(&self, situation: &Situation<'_, T>) -> Wrench<Body, T> {
        let t = situation.thrust_n;
        Wrench::from_force(In::new(Vector3::new(-t * self.0[0], -t * self.0[1], T::zero())))
    }
}
