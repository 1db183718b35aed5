//! What a soft wing does beyond the flat plate: `N <- 1/2 rho S c_N (1 + g) V (w + a0 u) dep` on each side.
//!
//! A gain and an offset of the angle of attack, the correction that the paper's network learns, in two numbers; added to
//! whatever wing the vehicle flies, as a difference to the flat plate. Form `speed_dependent`: the gain grows with airspeed,
//! `g min(V / V_full, 1)`, as the membrane fills.

use super::{Effect, EffectParameter, Situation, is};
use crate::aero::flat_plate;
use crate::frames::{Body, Wrench};
use crate::math::Real;

const SPEED_DEPENDENT: usize = 1;

/// Gain and angle-of-attack offset of both wings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WingMembrane<T>(pub(super) [T; 4]);

impl<T: Real> Effect<T> for WingMembrane<T> {
    const NAME: &'static str = "wing_membrane";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("gain", 0.12, 0.45),
        EffectParameter::signed("angle_of_attack_offset_rad", 0.026, 0.105),
        EffectParameter::size("full_speed_m_s", 5.0, 15.0).only_in(&["speed_dependent"]),
        EffectParameter::form(&["constant", "speed_dependent"]),
    ];

    #[inline(always)]
    fn wrench(&self, situation: &Situation<'_, T>) -> Wrench<Body, T> {
        let Some(wing) = situation.wing else { return Wrench::zero() };
        let [mut gain, offset, full_speed_m_s, form] = self.0;
        let speed = situation.air.speed;
        if is(form, SPEED_DEPENDENT) && speed < full_speed_m_s {
            gain *= speed / full_speed_m_s;
        }
        let flat = flat_plate::normal_forces(wing, situation.air, situation.deployment);
        let per_w = flat_plate::normal_slope(wing, situation.air);
        let turned = per_w * situation.air.velocity.vector.x * offset * (T::one() + gain);
        let more = [0, 1].map(|side| flat[side] * gain + turned * situation.deployment[side]);
        flat_plate::pair_wrench(wing, more)
    }
}
