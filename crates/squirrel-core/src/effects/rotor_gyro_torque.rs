//! Gyroscopic and reaction torque of spinning rotors: `M -= I_r (H (w x e3) + H' e3)`,
//! `H = -sum(s_i Omega_i)`.
//!
//! `s_i` is the rotor's `yaw_sign`, the sign of its reaction torque about +z, so it spins the other
//! way: `I_r H e3` is the angular momentum of all rotors in the body frame, and its rate there is
//! taken from the airframe.

use super::{Acts, Effect, EffectParameter, Forms, Scale, Shown, Situation, Words, absent};
use crate::aero::BodyWrench;
use crate::lane::Lane;
use crate::math::Real;
use crate::numbers;
use crate::vehicle::Vehicle;

/// Inertia of one rotor with its motor's bell about the spin axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RotorGyroTorque<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for RotorGyroTorque<T> {
    const NAME: &'static str = "rotor_gyro_torque";
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::size("rotor_inertia_kg_m2", 4e-6, 2e-5).growing_with(Scale::Inertia)];
    const WORDS: Words = Words {
        what: "gyroscopic torque of rotors",
        more: "Rotors act as gyroscopes",
        less: "Rotors act less as gyroscopes",
        fly: "yaw steps",
    };
    const SHOWN: Shown = Shown::MOMENTS;
    const IS_OF_MOMENTS: bool = true;
}

numbers! {
    /// Inertia of one rotor.
    Numbers {
        /// About the spin axis, kg m^2.
        inertia
    }
}

impl<T: Real> RotorGyroTorque<T> {
    pub(super) fn prepare(&self, _vehicle: &Vehicle<T>) -> Numbers<T> {
        Numbers { inertia: self.0[0] }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    const FEELS_ROTOR_SPIN: bool = true;

    #[inline(always)]
    fn wrench(&self, at: &Situation<'_, L>, _: Forms) -> BodyWrench<L> {
        let (&[p, q, _], [spin, rate]) = (at.omega, at.rotor_spin);
        BodyWrench::from_moment([
            absent::<L>() - q * spin * self.inertia,
            p * spin * self.inertia,
            absent::<L>() - rate * self.inertia,
        ])
    }
}
