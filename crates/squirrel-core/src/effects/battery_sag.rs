//! Battery sag: steady rotor speed follows the voltage, `Omega = u Omega_max (V / V_ref)^kappa`.
//!
//! The simulator always computes the voltage; thrust feels it only through this effect. Form
//! `linear`: the factor is `1 + kappa (V / V_ref - 1)`. Form `load_dependent`: the exponent of each
//! rotor is `kappa (1 + g (x - 0.5))`, with `x` its target over the top speed: a loaded motor loses
//! more.

use super::{Acts, Effect, EffectParameter, Forms, Shown, Words, is};
use crate::lane::Lane;
use crate::lane::functions::{exp, ln};
use crate::math::Real;
use crate::numbers;
use crate::vehicle::Vehicle;

const LINEAR: usize = 1;
const LOAD_DEPENDENT: usize = 2;

/// How strongly rotor speed follows the battery voltage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BatterySag<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for BatterySag<T> {
    const NAME: &'static str = "battery_sag";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::size("voltage_exponent", 0.4, 1.0),
        EffectParameter::signed("load_gain", 0.3, 1.5).only_in(&["load_dependent"]),
        EffectParameter::form(&["power", "linear", "load_dependent"]),
    ];
    const WORDS: Words = Words {
        what: "thrust that sags with the battery",
        more: "Thrust sags with the battery",
        less: "Thrust sags less with the battery",
        fly: "climbs at full thrust with a full and with a half empty battery, voltage logged",
    };
    const SHOWN: Shown = Shown::LASTING.and(Shown::COMMANDS);
}

numbers! {
    /// Of any form; those of the others make no difference.
    Numbers {
        /// `kappa` of a power of the voltage.
        exponent,
        /// `g`.
        load_gain,
        /// `kappa` of the linear form.
        slope,
        /// Voltage at which the vehicle's propulsion numbers hold, V.
        reference_voltage_v,
        /// Top rotor speed at that voltage, rad/s.
        speed_max_rad_s
    }
}

impl<T: Real> BatterySag<T> {
    pub(super) fn prepare(&self, vehicle: &Vehicle<T>) -> Numbers<T> {
        let [exponent, load_gain, form] = self.0;
        let propulsion = &vehicle.parameters().propulsion;
        let none = T::zero();
        Numbers {
            exponent: if is(form, LINEAR) { none } else { exponent },
            load_gain: if is(form, LOAD_DEPENDENT) { load_gain } else { none },
            slope: if is(form, LINEAR) { exponent } else { none },
            reference_voltage_v: propulsion.reference_voltage_v,
            speed_max_rad_s: propulsion.speed_max_rad_s,
        }
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn rotor_targets<const ROTORS: usize>(
        &self,
        targets: &mut [L; ROTORS],
        voltage_v: L,
        forms: Forms,
    ) {
        let one = L::of(1.0);
        let ratio = (voltage_v / self.reference_voltage_v).upper(L::of(0.0));
        let logarithm = ln(ratio);
        let mut factor = one;
        if forms.has(LINEAR) {
            factor = (one + self.slope * (ratio - one)).upper(L::of(0.0));
        }
        if forms.has(LOAD_DEPENDENT) {
            for target in &mut *targets {
                let load = *target / self.speed_max_rad_s;
                let exponent = self.exponent * (one + self.load_gain * (load - L::of(0.5)));
                *target = *target * exp(exponent * logarithm);
            }
        } else {
            factor = factor * exp(self.exponent * logarithm);
        }
        for target in targets {
            *target = *target * factor;
        }
    }
}
