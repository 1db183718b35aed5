//! Blade flapping: `M_x -= k v`, `M_y += k u`: the rotor disc tilts back in forward flight.

use super::{Effect, EffectParameter, Situation};
use crate::frames::{Body, In, Wrench};
use crate::math::Real;
use nalgebra::Vector3;

/// Moment per speed across the rotors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlappingMoment<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for FlappingMoment<T> {
    const NAME: &'static str = "flapping_moment";
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::size("gain_n_m_s_per_m", 1e-3, 6e-3)];

    #[inline(always)]
    fn wrench(&self, situation: &Situation<'_, T>) -> Wrench<Body, T> {
        let v = situation.air.velocity.vector;
        Wrench { force: In::zero(), moment: In::new(Vector3::new(-v.y, v.x, T::zero()) * self.0[0]) }
    }
}
