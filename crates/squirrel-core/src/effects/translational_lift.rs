//! Translational lift: `T <- T (1 + k V_h^2 / (1 + 0.004 V_h^2))`, `V_h` the airspeed in the rotor
//! plane.
//!
//! Form `linear`: `T (1 + k V_h)`. Form `quadratic`: `T (1 + k V_h^2)`, without saturation.

use super::{Acts, Effect, EffectParameter, Forms, Shown, Words, is};
use crate::aero::Airflow;
use crate::lane::Lane;
use crate::math::{Real, real};
use crate::numbers;
use crate::vehicle::Vehicle;

const LINEAR: usize = 1;
const QUADRATIC: usize = 2;

/// Gain of thrust with speed across the rotors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TranslationalLift<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for TranslationalLift<T> {
    const NAME: &'static str = "translational_lift";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("gain_s2_per_m2", 6e-4, 3e-3).only_in(&["saturating", "quadratic"]),
        EffectParameter::signed("gain_s_per_m", 3e-3, 0.02).only_in(&["linear"]),
        EffectParameter::form(&["saturating", "linear", "quadratic"]),
    ];
    const WORDS: Words = Words {
        what: "lift in forward flight",
        more: "Rotors lift more in forward flight",
        less: "Rotors lift less in forward flight",
        fly: "dashes to 9 m/s at constant height with the wings folded",
    };
    const SHOWN: Shown = Shown::HORIZONTAL;
}

numbers! {
    /// Gain of thrust.
    Numbers {
        /// Over speed squared, s^2/m^2.
        gain,
        /// Where that saturates, s^2/m^2; 0 for a gain that stays.
        limit,
        /// Over speed, s/m.
        linear
    }
}

impl<T: Real> TranslationalLift<T> {
    pub(super) fn prepare(&self, _vehicle: &Vehicle<T>) -> Numbers<T> {
        let [gain, linear, form] = self.0;
        if is(form, LINEAR) {
            return Numbers { linear, ..Numbers::all(T::zero()) };
        }
        let limit = if is(form, QUADRATIC) { T::zero() } else { real(0.004) };
        Numbers { gain, limit, linear: T::zero() }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn thrust_factor(&self, flow: &Airflow<L>, _height_m: L, forms: Forms) -> L {
        let ([u, v, _], one) = (flow.velocity, L::of(1.0));
        let across = u * u + v * v;
        let mut factor = one + self.gain * across / (one + across * self.limit);
        if forms.has(LINEAR) {
            factor = factor + self.linear * across.root();
        }
        factor
    }
}
