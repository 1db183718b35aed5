//! Translational lift: `T <- T (1 + k V_h^2 / (1 + 0.004 V_h^2))`, `V_h` the airspeed in the rotor
//! plane.
//!
//! Form `linear`: `T (1 + k V_h)`. Form `quadratic`: `T (1 + k V_h^2)`, without saturation. Form
//! `at_rotors`: `T + k V_h^2 m g` whatever the thrust, of each rotor its part by the air at its hub;
//! see [`at_rotors`](super::at_rotors).

use super::{Acts, Declared, Effect, EffectParameter, Forms, Scale, Shown, Slopes, Words, is};
use crate::aero::Airflow;
use crate::lane::Lane;
use crate::math::Real;
use crate::numbers;
use crate::vehicle::Vehicle;

const LINEAR: usize = 1;
const QUADRATIC: usize = 2;
/// Where the standard form saturates, s^2/m^2.
const SATURATION: f64 = 0.004;

/// Gain of thrust with speed across the rotors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TranslationalLift<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for TranslationalLift<T> {
    const NAME: &'static str = "translational_lift";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("gain_s2_per_m2", 6e-4, 3e-3)
            .growing_with(Scale::PerTipSpeedSquared)
            .declared(Declared::TranslationalLift)
            .only_in(&["saturating", "quadratic", "at_rotors"]),
        EffectParameter::signed("gain_s_per_m", 3e-3, 0.02)
            .growing_with(Scale::PerTipSpeed)
            .only_in(&["linear"]),
        // A factor on thrust is one on its moments, which a force beside it leaves alone.
        EffectParameter::form(&["saturating", "linear", "quadratic", "at_rotors"])
            .seeking(&["at_rotors"]),
    ];
    const WORDS: Words = Words {
        what: "lift in forward flight",
        more: "Rotors lift more in forward flight",
        less: "Rotors lift less in forward flight",
        fly: "dashes to 9 m/s at constant height with the wings folded",
    };
    const SHOWN: Shown = Shown::HORIZONTAL;
    const AT_ROTORS: Option<usize> = Some(3);

    fn at_rotors(&self, vehicle: &Vehicle<T>) -> Slopes<T> {
        Slopes { lift: self.0[0] * vehicle.weight_n(), ..Slopes::none() }
    }

    fn is_declared(vehicle: &Vehicle<T>) -> bool {
        vehicle.parameters().propulsion.air.translational_lift_s2_per_m2 != T::zero()
    }
}

numbers! {
    /// Gain of thrust.
    Numbers {
        /// Over speed squared, where it saturates, s^2/m^2.
        gain,
        /// The same without an end.
        endless,
        /// Over speed, s/m.
        linear
    }
}

impl<T: Real> TranslationalLift<T> {
    pub(super) fn prepare(&self, vehicle: &Vehicle<T>) -> Numbers<T> {
        let [extra, linear, form] = self.0;
        let (gain, none) =
            (vehicle.parameters().propulsion.air.translational_lift_s2_per_m2, T::zero());
        if is(form, LINEAR) {
            Numbers { gain, endless: none, linear }
        } else if is(form, QUADRATIC) {
            Numbers { gain, endless: extra, linear: none }
        } else {
            Numbers { gain: gain + extra, endless: none, linear: none }
        }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn thrust_factor(&self, flow: &Airflow<L>, _height_m: L, forms: Forms) -> L {
        let ([u, v, _], one) = (flow.velocity, L::of(1.0));
        let across = u * u + v * v;
        let mut factor = one + self.gain * across / (one + across * L::of(SATURATION));
        if forms.has(QUADRATIC) {
            factor = factor + self.endless * across;
        }
        if forms.has(LINEAR) {
            factor = factor + self.linear * across.root();
        }
        factor
    }
}
