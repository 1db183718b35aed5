//! Rotor (induced, H-force) drag: `F_xy -= D (u, v)`, proportional to airspeed in the rotor plane.

use super::{Effect, EffectParameter};
use crate::aero::Air;
use crate::frames::{Body, In, Wrench};
use crate::math::Real;
use nalgebra::Vector3;

/// Drag in the rotor plane on top of the vehicle's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearDrag<T>([T; 1]);

impl<T: Real> Effect<T> for LinearDrag<T> {
    const NAME: &'static str = "linear_drag";
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter { key: "extra_drag_n_s_per_m", smallest: 0.04, largest: 0.25, signed: false }];
    fn absent() -> Self {
        Self([T::zero()])
    }
    fn values(&mut self) -> &mut [T] {
        &mut self.0
    }
    #[inline(always)]
    fn wrench(&self, air: &Air<T>) -> Wrench<Body, T> {
        let v = air.velocity.vector;
        Wrench::from_force(In::new(Vector3::new(v.x, v.y, T::zero()) * -self.0[0]))
    }
}
