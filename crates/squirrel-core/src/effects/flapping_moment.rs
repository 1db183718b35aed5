//! Blade flapping: `M_x -= k v`, `M_y += k u`: the rotor disc tilts back in forward flight.
//!
//! Form `saturating`: the velocity is divided by `1 + V_h / scale`, `V_h` the airspeed in the rotor plane.

use super::{Effect, EffectParameter, Scale, Situation, is};
use crate::frames::{Body, In, Wrench};
use crate::math::Real;
use nalgebra::Vector3;

const SATURATING: usize = 1;

/// Moment per speed across the rotors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlappingMoment<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for FlappingMoment<T> {
    const NAME: &'static str = "flapping_moment";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("gain_n_m_s_per_m", 1e-3, 6e-3).growing_with(Scale::MassTimesArm),
        EffectParameter::size("speed_scale_m_s", 3.0, 20.0).only_in(&["saturating"]),
        EffectParameter::form(&["linear", "saturating"]),
    ];

    #[inline(always)]
    fn wrench(&self, situation: &Situation<'_, T>) -> Wrench<Body, T> {
        let [gain, scale, form] = self.0;
        let v = situation.air.velocity.vector;
        let mut slope = gain;
        if is(form, SATURATING) {
            // A scale of 0 saturates at once.
            let across = v.xy().norm();
            slope = if scale > T::zero() { gain * scale / (scale + across) } else { T::zero() };
        }
        Wrench { force: In::zero(), moment: In::new(Vector3::new(-v.y, v.x, T::zero()) * slope) }
    }
}
