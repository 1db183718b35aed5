//! What a soft wing does beyond the flat plate: `N <- 1/2 rho S c_N (1 + g) V (w + a0 u) dep` on
//! each side.
//!
//! A gain and an offset of the angle of attack, the correction that the paper's network learns, in
//! two numbers; added to whatever wing the vehicle flies, as a difference to the flat plate. Form
//! `speed_dependent`: the gain grows with airspeed, `g min(V / V_full, 1)`, as the membrane fills.

use super::profile::WINGS_AT_SPEED;
use super::{Acts, Declared, Effect, EffectParameter, Forms, Mimic, Shown, Situation, Words, is};
use crate::aero::BodyWrench;
use crate::lane::Lane;
use crate::math::Real;
use crate::numbers;
use crate::vehicle::Vehicle;

const SPEED_DEPENDENT: usize = 1;

/// Gain and angle-of-attack offset of both wings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WingMembrane<T>(pub(super) [T; 4]);

impl<T: Real> Effect<T> for WingMembrane<T> {
    const NAME: &'static str = "wing_membrane";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("gain", 0.12, 0.45).declared(Declared::WingForce),
        EffectParameter::signed("angle_of_attack_offset_rad", 0.026, 0.105),
        EffectParameter::size("full_speed_m_s", 5.0, 15.0).only_in(&["speed_dependent"]),
        EffectParameter::form(&["constant", "speed_dependent"]),
    ];
    const WORDS: Words = Words {
        what: "force of the soft wings",
        more: "The wings give more force",
        less: "The wings give less force",
        fly: WINGS_AT_SPEED,
    };
    const SHOWN: Shown = Shown::NOTHING;
    const MIMIC: Mimic = Mimic::Gusts;
    const IS_OF_WINGS: bool = true;
}

numbers! {
    /// Gain and offset.
    Numbers {
        /// Once the membrane is full.
        gain,
        /// Of the angle of attack, rad.
        offset_rad,
        /// How full it is without airspeed, and over airspeed, s/m.
        filled [2]
    }
}

impl<T: Real> WingMembrane<T> {
    pub(super) fn prepare(&self, _vehicle: &Vehicle<T>) -> Numbers<T> {
        let [gain, offset_rad, full_speed_m_s, form] = self.0;
        let filled = if is(form, SPEED_DEPENDENT) && full_speed_m_s > T::zero() {
            [T::zero(), T::one() / full_speed_m_s]
        } else {
            [T::one(), T::zero()]
        };
        Numbers { gain, offset_rad, filled }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn wrench(&self, at: &Situation<'_, L>, _: Forms) -> BodyWrench<L> {
        let (wings, flow) = (at.wings, at.flow);
        let [empty, per_speed] = self.filled;
        let gain = self.gain * (empty + flow.speed * per_speed).lower(L::of(1.0));
        let [left, right] = wings.normal_forces(flow, &at.deployment);
        let turned = wings.per_square
            * flow.speed
            * flow.velocity[0]
            * self.offset_rad
            * (L::of(1.0) + gain);
        wings.wrench([
            left * gain + turned * at.deployment[0],
            right * gain + turned * at.deployment[1],
        ])
    }
}
