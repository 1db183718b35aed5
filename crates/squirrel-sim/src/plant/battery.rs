//! The numbers of a battery; its equations are [`squirrel_core::dynamics::battery`].
//!
//! The simulator always computes the voltage; thrust feels it only through the `battery_sag`
//! effect.

use crate::setting::SettingError;
use squirrel_core::dynamics::battery::{self, Pack, Stretch};

/// Numbers of a battery pack.
#[derive(Debug, Clone, PartialEq)]
pub struct BatteryParameters {
    /// Cells in series.
    pub cells: u32,
    /// Capacity, Ah.
    pub capacity_ah: f64,
    /// Resistance of the pack with its leads, ohm.
    pub r0_ohm: f64,
    /// Resistance of the RC pair, ohm.
    pub r1_ohm: f64,
    /// Time constant of the RC pair, s.
    pub tau1_s: f64,
    /// Open-circuit voltage of one cell, V, over charge 0..1, as rising pairs `[charge, volt]`.
    pub ocv_v_of_charge: Vec<[f64; 2]>,
    /// Shaft power over electric power.
    pub efficiency: f64,
    /// Current of everything but the rotors, A.
    pub idle_current_a: f64,
}

/// What a battery remembers.
pub type BatteryState = battery::Charge<f64>;

impl BatteryParameters {
    pub(crate) fn check(&self) -> Result<(), SettingError> {
        let positive = [
            ("cells", f64::from(self.cells)),
            ("capacity_ah", self.capacity_ah),
            ("r0_ohm", self.r0_ohm),
            ("r1_ohm", self.r1_ohm),
            ("tau1_s", self.tau1_s),
            ("efficiency", self.efficiency),
        ];
        for (key, x) in positive {
            if !(x.is_finite() && x > 0.0) {
                return Err(SettingError::value(
                    format!("battery.{key}"),
                    x,
                    "must be finite and > 0",
                ));
            }
        }
        if self.efficiency > 1.0 {
            return Err(SettingError::value("battery.efficiency", self.efficiency, "must be <= 1"));
        }
        if !(0.0..=100.0).contains(&self.idle_current_a) {
            return Err(SettingError::value(
                "battery.idle_current_a",
                self.idle_current_a,
                "must be 0 to 100",
            ));
        }
        let table = &self.ocv_v_of_charge;
        let rising = table.windows(2).all(|w| w[0][0] < w[1][0] && w[0][1] <= w[1][1]);
        let plausible =
            |[charge, volt]: &[f64; 2]| (0.0..=1.0).contains(charge) && (0.5..=6.0).contains(volt);
        if table.len() < 2 || !rising || !table.iter().all(plausible) {
            let reason = "must be at least two rising pairs [charge 0..1, cell volt 0.5..6]";
            return Err(SettingError::value(
                "battery.ocv_v_of_charge",
                format!("{table:?}"),
                reason,
            ));
        }
        Ok(())
    }

    /// A rested battery.
    ///
    /// * `charge` - 0..1
    pub fn rested(&self, charge: f64) -> BatteryState {
        BatteryState {
            charge,
            rc_voltage_v: 0.0,
            voltage_v: self.open_circuit_v(charge),
            current_a: 0.0,
        }
    }

    /// What does not change in steps of a length, s.
    pub fn pack(&self, dt_s: f64) -> Pack<f64> {
        let cells = f64::from(self.cells);
        Pack {
            efficiency: self.efficiency,
            floor_v: 0.5 * cells * self.ocv_v_of_charge[0][1],
            idle_a: self.idle_current_a,
            r0_ohm: self.r0_ohm,
            r1_ohm: self.r1_ohm,
            decay: 1.0 - (-dt_s / self.tau1_s).exp(),
            capacity_as: 3600.0 * self.capacity_ah,
            cells,
        }
    }

    /// The table of voltages, stretch by stretch.
    pub fn stretches(&self) -> impl Iterator<Item = Stretch<f64>> + '_ {
        self.ocv_v_of_charge.windows(2).map(|ends| Stretch {
            from: ends[0][0],
            width: ends[1][0] - ends[0][0],
            volt: ends[0][1],
            rise: ends[1][1] - ends[0][1],
        })
    }

    /// Open-circuit voltage of the pack, V; held beyond the ends of the table.
    pub fn open_circuit_v(&self, charge: f64) -> f64 {
        f64::from(self.cells) * self.stretch(charge).volt_at(charge)
    }

    fn stretch(&self, charge: f64) -> Stretch<f64> {
        let nowhere = Stretch { from: 0.0, width: 1.0, volt: 0.0, rise: 0.0 };
        self.stretches().reduce(|on, next| on.or_next(&next, charge)).unwrap_or(nowhere)
    }

    /// One step.
    ///
    /// * `pack` - see [`Self::pack`]
    /// * `shaft_power_w` - of all rotors
    pub fn step(&self, pack: &Pack<f64>, state: &mut BatteryState, shaft_power_w: f64, dt_s: f64) {
        pack.discharge(state, shaft_power_w, dt_s);
        pack.settle(state, &self.stretch(state.charge));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn battery() -> BatteryParameters {
        BatteryParameters {
            cells: 4,
            capacity_ah: 1.0,
            r0_ohm: 0.03,
            r1_ohm: 0.01,
            tau1_s: 4.0,
            ocv_v_of_charge: vec![[0.0, 3.3], [0.1, 3.6], [0.5, 3.8], [1.0, 4.2]],
            efficiency: 0.7,
            idle_current_a: 0.0,
        }
    }

    #[test]
    fn sags_at_once_by_r0_then_slowly_by_r1() {
        let b = battery();
        let mut s = b.rested(1.0);
        assert!((s.voltage_v - 16.8).abs() < 1e-12);
        let pack = b.pack(1e-3);
        b.step(&pack, &mut s, 200.0, 1e-3);
        let first = s.voltage_v;
        assert!((16.8 - first - s.current_a * 0.03).abs() < 1e-3, "first drop is ohmic");
        for _ in 0..20_000 {
            b.step(&pack, &mut s, 200.0, 1e-3);
        }
        let slow = b.open_circuit_v(s.charge) - s.current_a * (0.03 + 0.01);
        assert!((s.voltage_v - slow).abs() < 0.01 && s.voltage_v < first);
    }

    #[test]
    fn charge_counts_ampere_hours() {
        let b = battery();
        let mut s = b.rested(1.0);
        let mut ampere_seconds = 0.0;
        for _ in 0..10_000 {
            b.step(&b.pack(1e-2), &mut s, 150.0, 1e-2);
            ampere_seconds += s.current_a * 1e-2;
        }
        assert!((1.0 - s.charge - ampere_seconds / 3600.0).abs() < 1e-9);
    }

    #[test]
    fn an_empty_battery_stays_finite() {
        let b = battery();
        let mut s = b.rested(0.0);
        for _ in 0..1000 {
            b.step(&b.pack(1e-2), &mut s, 1e4, 1e-2);
        }
        assert!(s.voltage_v >= 0.0 && s.current_a.is_finite() && s.charge == 0.0);
    }

    #[test]
    fn a_falling_table_is_refused_by_name() {
        let bad = BatteryParameters { ocv_v_of_charge: vec![[0.0, 4.0], [1.0, 3.0]], ..battery() };
        assert!(bad.check().unwrap_err().to_string().starts_with("battery.ocv_v_of_charge"));
    }
}
