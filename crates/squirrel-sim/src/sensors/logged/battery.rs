//! Battery monitor: truth, bias and white noise, in steps of its converter.

use super::super::line::{noise, quantised};
use super::super::parameters::sensor;
use super::super::table::Limit::{Signed, Size};
use super::{Reads, Row, Truth};
use rand_pcg::Pcg64Mcg;

/// Channel that the flight code hears, too.
pub(in super::super) const VOLTAGE: &str = "voltage_v";

sensor! {
    /// Battery monitor.
    BatterySensor at 50.0 Hz;
    /// White noise of voltage, V.
    voltage_noise_v: f64 = 0.01, Size;
    /// Constant error of voltage, V.
    voltage_bias_v: f64 = 0.0, Signed;
    /// Step of its converter for the voltage, V; 0: none.
    voltage_resolution_v: f64 = 0.0, Size;
    /// White noise of current, A.
    current_noise_a: f64 = 0.1, Size;
    /// Constant error of current, A.
    current_bias_a: f64 = 0.0, Signed;
    /// Step of its converter for the current, A; 0: none.
    current_resolution_a: f64 = 0.0, Size;
}

impl Reads for BatterySensor {
    fn read(&self, truth: &Truth, rng: &mut Pcg64Mcg) -> Option<Row> {
        let voltage_v = truth.voltage_v + self.voltage_bias_v + noise(rng, self.voltage_noise_v).x;
        let current_a = truth.current_a + self.current_bias_a + noise(rng, self.current_noise_a).x;
        Some(vec![
            (VOLTAGE, quantised(voltage_v, self.voltage_resolution_v)),
            ("current_a", quantised(current_a, self.current_resolution_a)),
        ])
    }
}
