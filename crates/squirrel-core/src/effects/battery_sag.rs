//! Battery sag: steady rotor speed follows the voltage, `Omega = u Omega_max (V / V_ref)^kappa`.
//!
//! The simulator always computes the voltage; thrust feels it only through this effect.

use super::{Effect, EffectParameter};
use crate::math::{Real, upper};

/// How strongly rotor speed follows the battery voltage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BatterySag<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for BatterySag<T> {
    const NAME: &'static str = "battery_sag";
    const PARAMETERS: &'static [EffectParameter] = &[EffectParameter::size("voltage_exponent", 0.4, 1.0)];

    #[inline(always)]
    fn rotor_speed_ratio(&self, battery_voltage_v: T, reference_voltage_v: T) -> T {
        upper(battery_voltage_v / reference_voltage_v, T::zero()).powf(self.0[0])
    }
}
