//! Rotor (induced, H-force) drag: `F_xy -= D (u, v)`, proportional to airspeed in the rotor plane.

use super::{Effect, EffectParameter, Situation};
use crate::frames::{Body, In, Wrench};
use crate::math::Real;
use nalgebra::Vector3;

/// Drag in the rotor plane on top of the vehicle's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearDrag<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for LinearDrag<T> {
    const NAME: &'static str = "linear_drag";
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::size("extra_drag_n_s_per_m", 0.04, 0.25)];

    #[inline(always)]
    fn wrench(&self, situation: &Situation<'_, T>) -> Wrench<Body, T> {
        let v = situation.air.velocity.vector;
        Wrench::from_force(In::new(Vector3::new(v.x, v.y, T::zero()) * -self.0[0]))
    }
}
