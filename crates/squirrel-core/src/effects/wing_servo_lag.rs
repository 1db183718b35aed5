//! Lag of the wing servos on top of the vehicle's own: `dep' = (command - dep) / (tau + extra)`.
//!
//! Form `asymmetric`: `extra (1 - e)` when opening and `extra (1 + e)` when closing.

use super::profile::WINGS_AT_SPEED;
use super::{Declared, Effect, EffectParameter, Response, Shown, Words, is, up_and_down};
use crate::math::Real;

const ASYMMETRIC: usize = 1;

/// Extra first-order lag of deployment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WingServoLag<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for WingServoLag<T> {
    const NAME: &'static str = "wing_servo_lag";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("extra_time_constant_s", 0.12, 0.5).declared(Declared::WingLag),
        EffectParameter::signed("asymmetry", 0.2, 0.8).only_in(&["asymmetric"]),
        EffectParameter::form(&["symmetric", "asymmetric"]),
    ];
    const WORDS: Words = Words {
        what: "lag of the wing servos",
        more: "Wings open and close more slowly",
        less: "Wings open and close faster",
        fly: WINGS_AT_SPEED,
    };
    const SHOWN: Shown = Shown::NOTHING;
    const RESPONSE: Response = Response::Bends;
    const IS_OF_WINGS: bool = true;

    #[inline(always)]
    fn wing_extra_time_constant_s(&self) -> [T; 2] {
        let [extra_s, asymmetry, form] = self.0;
        up_and_down(extra_s, if is(form, ASYMMETRIC) { asymmetry } else { T::zero() })
    }
}
