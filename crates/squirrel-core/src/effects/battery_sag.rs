//! Battery sag: steady rotor speed follows the voltage, `Omega = u Omega_max (V / V_ref)^kappa`.
//!
//! The simulator always computes the voltage; thrust feels it only through this effect. Form `linear`: the factor is
//! `1 + kappa (V / V_ref - 1)`. Form `load_dependent`: the exponent of each rotor is `kappa (1 + g (x - 0.5))`, with `x` its
//! target over the top speed: a loaded motor loses more.

use super::{Effect, EffectParameter, Supply, is};
use crate::math::{Real, real, upper};
use crate::vehicle::PerRotor;

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

    #[inline(always)]
    fn rotor_target(&self, target_rad_s: &mut PerRotor<T>, supply: &Supply<T>) {
        let [exponent, load_gain, form] = self.0;
        let ratio = upper(supply.voltage_v / supply.reference_voltage_v, T::zero());
        if is(form, LOAD_DEPENDENT) {
            for target in target_rad_s.iter_mut().filter(|target| **target > T::zero()) {
                let load = *target / supply.speed_max_rad_s;
                *target *= ratio.powf(exponent * (T::one() + load_gain * (load - real(0.5))));
            }
            return;
        }
        let factor = if is(form, LINEAR) {
            upper(T::one() + exponent * (ratio - T::one()), T::zero())
        } else {
            ratio.powf(exponent)
        };
        for target in target_rad_s {
            *target *= factor;
        }
    }
}
