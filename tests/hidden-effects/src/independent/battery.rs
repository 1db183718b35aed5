//! Battery: the current that carries the rotors' power through resistance and one slow RC pair.

/// Numbers of a pack of four cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pack {
    /// Resistance, ohm.
    pub resistance_ohm: f64,
    /// Resistance of the slow part, ohm.
    pub slow_ohm: f64,
    /// Capacity, Ah.
    pub capacity_ah: f64,
}

const CELLS: f64 = 4.0;
const SLOW_S: f64 = 4.0;
const EFFICIENCY: f64 = 0.85;
const IDLE_W: f64 = 6.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Battery {
    pack: Pack,
    charge: f64,
    slow_v: f64,
    pub(super) voltage_v: f64,
    pub(super) current_a: f64,
}

impl Battery {
    /// Settled under a load.
    pub(super) fn new(pack: Pack, charge: f64, power_w: f64) -> Self {
        let mut battery = Self { pack, charge, slow_v: 0.0, voltage_v: 0.0, current_a: 0.0 };
        // Half of the slow drop has built up by the time a log starts: the vehicle has just taken
        // off.
        battery.step(power_w, 0.0);
        battery.slow_v = 0.5 * battery.current_a * pack.slow_ohm;
        battery.step(power_w, 0.0);
        battery
    }

    fn open_circuit_v(&self) -> f64 {
        let c = self.charge;
        CELLS * (3.68 + 0.35 * c + 0.25 * c.powi(4) - 0.4 * (-20.0 * c).exp())
    }

    /// One step under the rotors' mechanical power.
    pub(super) fn step(&mut self, power_w: f64, dt_s: f64) {
        let (resistance, source) = (self.pack.resistance_ohm, self.open_circuit_v() - self.slow_v);
        let power = power_w / EFFICIENCY + IDLE_W;
        // V I = P with V = E - R I; at the least, half of the source voltage remains.
        let root = (source * source - 4.0 * resistance * power).max(0.0).sqrt();
        self.voltage_v = 0.5 * (source + root);
        self.current_a = (source - self.voltage_v) / resistance;
        self.slow_v += (self.current_a * self.pack.slow_ohm - self.slow_v) * dt_s / SLOW_S;
        self.charge -= self.current_a * dt_s / (3600.0 * self.pack.capacity_ah);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_is_carried_and_voltage_sags() {
        let pack = Pack { resistance_ohm: 0.05, slow_ohm: 0.02, capacity_ah: 1.3 };
        let mut battery = Battery::new(pack, 0.9, 90.0);
        let before = battery;
        assert!((before.voltage_v * before.current_a - 90.0 / EFFICIENCY - IDLE_W).abs() < 1e-9);
        battery.step(200.0, 0.0);
        assert!(battery.voltage_v < before.voltage_v - 0.2, "at once");
        (0..10_000).for_each(|_| battery.step(90.0, 0.004));
        assert!(battery.voltage_v < before.voltage_v - 0.1, "and with the charge");
        let used = 90.0 / EFFICIENCY / 16.0 * 40.0 / 3600.0 / 1.3;
        assert!(((0.9 - battery.charge) / used - 1.0).abs() < 0.15);
    }
}
