//! Centre of mass off the geometric centre: `M -= r x F`, with `r = (x, y, 0)` and all forces of rotors, drag and wings.
//!
//! The accelerometer stays at the geometric centre, at `-r` from the centre of mass, and feels the rotation there.

use super::{Effect, EffectParameter, Situation};
use crate::frames::{Body, In, Wrench};
use crate::math::Real;
use nalgebra::Vector3;

/// Where the centre of mass lies, from the point that the vehicle file's positions refer to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CgOffset<T>(pub(super) [T; 2]);

impl<T: Real> Effect<T> for CgOffset<T> {
    const NAME: &'static str = "cg_offset";
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::signed("cg_x_m", 0.003, 0.012), EffectParameter::signed("cg_y_m", 0.003, 0.012)];

    #[inline(always)]
    fn accelerometer_position(&self) -> In<Body, T> {
        In::new(Vector3::new(-self.0[0], -self.0[1], T::zero()))
    }
    #[inline(always)]
    fn wrench(&self, situation: &Situation<'_, T>) -> Wrench<Body, T> {
        let r = Vector3::new(self.0[0], self.0[1], T::zero());
        Wrench { force: In::zero(), moment: In::new(-r.cross(&situation.force.vector)) }
    }
}
