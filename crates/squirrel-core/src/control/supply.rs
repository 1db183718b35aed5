//! What the battery leaves of the rotors' thrust.
//!
//! ```text
//! T(u, V) = T(u, V_ref) s        s = (V / V_ref)^(2 kappa)
//! ```
//! Rotor speed follows the voltage with the exponent `kappa` (the effect `battery_sag`,
//! docs/equations.md E.7), thrust its square. The propulsion numbers hold at `V_ref`: a thrust that
//! shall be `T` is asked for as `T / s` there, and rotors give `s` times what they give there at
//! most. Noise of the monitor and dips of a hundredth of a second are smoothed.

use crate::lane::functions::{exp, ln};
use crate::math::limit;
use crate::vehicle::{ParameterError, positive};

/// What of a new sample counts.
const NEW_SHARE: f32 = 0.2;
/// Between a battery that is gone and one of twice the cells.
const SHARE_MIN: f32 = 0.2;
const SHARE_MAX: f32 = 2.0;

/// How thrust follows the voltage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThrustByVoltage {
    /// `kappa`; 0 where thrust does not follow, or nobody knows how.
    pub exponent: f32,
    /// Voltage at which the vehicle's propulsion numbers hold, V.
    pub reference_v: f32,
}

/// What is remembered: `s`, and nothing before the first voltage.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Supply(Option<f32>);

impl ThrustByVoltage {
    /// Thrust that takes no notice of the voltage.
    pub const CONSTANT: Self = Self { exponent: 0.0, reference_v: 1.0 };

    /// # Errors
    /// The number out of range, by its name in a vehicle file.
    pub fn check(&self) -> Result<(), ParameterError> {
        if !(0.0..=2.0).contains(&self.exponent) {
            let field = "effects.battery_sag.voltage_exponent";
            return Err(ParameterError::of(field, self.exponent, "must be 0 to 2"));
        }
        positive("propulsion.reference_voltage_v", self.reference_v)
    }
}

impl Supply {
    /// Hears a voltage, V, above 0.
    pub fn hear(&mut self, voltage_v: f32, map: &ThrustByVoltage) {
        if map.exponent == 0.0 {
            return;
        }
        let share = exp(2.0 * map.exponent * ln(voltage_v / map.reference_v));
        let share = limit(share, SHARE_MIN, SHARE_MAX);
        let before = self.0.unwrap_or(share);
        self.0 = Some(before + (share - before) * NEW_SHARE);
    }

    /// `s`; 1 before the first voltage.
    pub fn share(&self) -> f32 {
        self.0.unwrap_or(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAP: ThrustByVoltage = ThrustByVoltage { exponent: 0.9, reference_v: 14.8 };

    #[test]
    fn thrust_goes_with_the_voltage_to_twice_the_exponent() {
        for (voltage_v, share) in [(14.8, 1.0), (16.8, 1.256_4), (11.1, 0.595_8), (1.0, 0.2)] {
            let mut supply = Supply::default();
            assert_eq!(supply.share(), 1.0);
            supply.hear(voltage_v, &MAP);
            assert!((supply.share() - share).abs() < 1e-3, "{voltage_v}: {supply:?}");
        }
    }

    #[test]
    fn one_bad_sample_does_not_jerk_and_a_lasting_one_is_believed() {
        let mut supply = Supply::default();
        supply.hear(14.8, &MAP);
        supply.hear(11.1, &MAP);
        assert!(supply.share() > 0.9, "{supply:?}");
        for _ in 0..30 {
            supply.hear(11.1, &MAP);
        }
        assert!((supply.share() - 0.596).abs() < 2e-3, "{supply:?}");
    }

    #[test]
    fn who_does_not_know_how_thrust_follows_does_not_guess() {
        let mut supply = Supply::default();
        supply.hear(9.0, &ThrustByVoltage::CONSTANT);
        assert_eq!(supply, Supply::default());
    }
}
