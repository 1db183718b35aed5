//! Motor lag on top of the vehicle's own: `Omega' = (Omega_target - Omega) / (tau + extra)`.
//!
//! Form `asymmetric`: `extra (1 - e)` when speeding up and `extra (1 + e)` when slowing down: a
//! rotor is braked by its drag alone.

use super::{Declared, Effect, EffectParameter, Response, Shown, Words, is, up_and_down};
use crate::math::Real;

const ASYMMETRIC: usize = 1;

/// Extra first-order lag of every rotor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MotorLag<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for MotorLag<T> {
    const NAME: &'static str = "motor_lag";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("extra_time_constant_s", 0.015, 0.06).declared(Declared::RotorLag),
        EffectParameter::signed("asymmetry", 0.2, 0.8).only_in(&["asymmetric"]),
        EffectParameter::form(&["symmetric", "asymmetric"]),
    ];
    const WORDS: Words = Words {
        what: "motor lag",
        more: "Motors respond more slowly",
        less: "Motors respond faster",
        fly: "a multisine from 0.3 to 6 Hz in roll and pitch",
    };
    const SHOWN: Shown = Shown::COMMANDS;
    const RESPONSE: Response = Response::Bends;
    const IS_OF_MOMENTS: bool = true;

    #[inline(always)]
    fn rotor_extra_time_constant_s(&self) -> [T; 2] {
        let [extra_s, asymmetry, form] = self.0;
        up_and_down(extra_s, if is(form, ASYMMETRIC) { asymmetry } else { T::zero() })
    }
}
