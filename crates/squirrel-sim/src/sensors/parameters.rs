//! Numbers of the sensors; the table `[sensors]` of a vehicle file.
//!
//! Defaults are of the size of docs/equations.md C: a consumer inertial unit, and a 10 Hz receiver over a flight of seconds, in which
//! its slow position error does not show. No sensor is late by default.

use crate::vehicle_file::plain;
use serde::Deserialize;

/// When a sensor speaks.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Timing {
    /// Samples per second.
    #[serde(deserialize_with = "plain")]
    pub rate_hz: f64,
    /// From sampling to arrival, s.
    #[serde(default)]
    #[serde(deserialize_with = "plain")]
    pub latency_s: f64,
    /// Seed of its noise; by default derived from the seed of the flight.
    pub seed: Option<u64>,
}

/// Gyroscope and accelerometer.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ImuSensor {
    /// When it speaks.
    pub timing: Timing,
    /// White noise per sample, rad/s.
    #[serde(deserialize_with = "plain")]
    pub gyro_noise_rad_s: f64,
    /// Constant bias, rad/s.
    #[serde(deserialize_with = "plain")]
    pub gyro_bias_rad_s: [f64; 3],
    /// White noise per sample, m/s^2.
    #[serde(deserialize_with = "plain")]
    pub accel_noise_m_s2: f64,
    /// Constant bias, m/s^2.
    #[serde(deserialize_with = "plain")]
    pub accel_bias_m_s2: [f64; 3],
}

/// An attitude estimate that somebody else makes.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AttitudeSensor {
    /// When it speaks.
    pub timing: Timing,
    /// White error about each body axis, rad.
    #[serde(deserialize_with = "plain")]
    pub noise_rad: f64,
    /// Constant error about the body axes, rad.
    #[serde(deserialize_with = "plain")]
    pub bias_rad: [f64; 3],
}

/// Satellite receiver.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct GnssSensor {
    /// When it speaks.
    pub timing: Timing,
    /// White noise of position per axis, m.
    #[serde(deserialize_with = "plain")]
    pub position_noise_m: f64,
    /// Constant error of position, m.
    #[serde(deserialize_with = "plain")]
    pub position_bias_m: [f64; 3],
    /// White noise of velocity per axis, m/s.
    #[serde(deserialize_with = "plain")]
    pub velocity_noise_m_s: f64,
    /// Constant error of velocity, m/s.
    #[serde(deserialize_with = "plain")]
    pub velocity_bias_m_s: [f64; 3],
}

/// Barometer.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BaroSensor {
    /// When it speaks.
    pub timing: Timing,
    /// White noise, m.
    #[serde(deserialize_with = "plain")]
    pub noise_m: f64,
    /// Constant error, m.
    #[serde(deserialize_with = "plain")]
    pub bias_m: f64,
}

/// Battery monitor.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BatterySensor {
    /// When it speaks.
    pub timing: Timing,
    /// White noise of voltage, V.
    #[serde(deserialize_with = "plain")]
    pub voltage_noise_v: f64,
    /// Constant error of voltage, V.
    #[serde(deserialize_with = "plain")]
    pub voltage_bias_v: f64,
    /// White noise of current, A.
    #[serde(deserialize_with = "plain")]
    pub current_noise_a: f64,
    /// Constant error of current, A.
    #[serde(deserialize_with = "plain")]
    pub current_bias_a: f64,
}

/// All sensors of a vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SensorParameters {
    /// Gyroscope and accelerometer.
    pub imu: ImuSensor,
    /// Attitude estimate.
    pub attitude: AttitudeSensor,
    /// Satellite receiver.
    pub gnss: GnssSensor,
    /// Barometer.
    pub baro: BaroSensor,
    /// Battery monitor.
    pub battery: BatterySensor,
}

const fn every(rate_hz: f64) -> Timing {
    Timing { rate_hz, latency_s: 0.0, seed: None }
}

impl Default for Timing {
    fn default() -> Self {
        every(300.0)
    }
}
impl Default for ImuSensor {
    fn default() -> Self {
        Self {
            timing: every(300.0),
            gyro_noise_rad_s: 0.0045,
            gyro_bias_rad_s: [0.0; 3],
            accel_noise_m_s2: 0.25,
            accel_bias_m_s2: [0.0; 3],
        }
    }
}
impl Default for AttitudeSensor {
    fn default() -> Self {
        Self { timing: every(300.0), noise_rad: 0.002, bias_rad: [0.0; 3] }
    }
}
impl Default for GnssSensor {
    fn default() -> Self {
        Self {
            timing: every(10.0),
            position_noise_m: 0.05,
            position_bias_m: [0.0; 3],
            velocity_noise_m_s: 0.05,
            velocity_bias_m_s: [0.0; 3],
        }
    }
}
impl Default for BaroSensor {
    fn default() -> Self {
        Self { timing: every(50.0), noise_m: 0.1, bias_m: 0.0 }
    }
}
impl Default for BatterySensor {
    fn default() -> Self {
        Self {
            timing: every(50.0),
            voltage_noise_v: 0.01,
            voltage_bias_v: 0.0,
            current_noise_a: 0.1,
            current_bias_a: 0.0,
        }
    }
}

impl SensorParameters {
    /// No noise, no bias, no latency; rates as by default.
    pub fn ideal() -> Self {
        let mut p = Self::default();
        p.imu.gyro_noise_rad_s = 0.0;
        p.imu.accel_noise_m_s2 = 0.0;
        p.attitude.noise_rad = 0.0;
        p.gnss.position_noise_m = 0.0;
        p.gnss.velocity_noise_m_s = 0.0;
        p.baro.noise_m = 0.0;
        p.battery.voltage_noise_v = 0.0;
        p.battery.current_noise_a = 0.0;
        p
    }

    pub(crate) fn check(&self) -> Result<(), String> {
        let timings = [
            ("imu", self.imu.timing),
            ("attitude", self.attitude.timing),
            ("gnss", self.gnss.timing),
            ("baro", self.baro.timing),
            ("battery", self.battery.timing),
        ];
        for (sensor, timing) in timings {
            if !(timing.rate_hz > 0.0 && timing.rate_hz <= 1e5) {
                return Err(format!(
                    "sensors.{sensor}.timing.rate_hz = {}: must be > 0 and <= 1e5",
                    timing.rate_hz
                ));
            }
            if !(0.0..=10.0).contains(&timing.latency_s) {
                return Err(format!(
                    "sensors.{sensor}.timing.latency_s = {}: must be 0 to 10",
                    timing.latency_s
                ));
            }
        }
        let noises = [
            ("imu.gyro_noise_rad_s", self.imu.gyro_noise_rad_s),
            ("imu.accel_noise_m_s2", self.imu.accel_noise_m_s2),
            ("attitude.noise_rad", self.attitude.noise_rad),
            ("gnss.position_noise_m", self.gnss.position_noise_m),
            ("gnss.velocity_noise_m_s", self.gnss.velocity_noise_m_s),
            ("baro.noise_m", self.baro.noise_m),
            ("battery.voltage_noise_v", self.battery.voltage_noise_v),
            ("battery.current_noise_a", self.battery.current_noise_a),
        ];
        for (key, sd) in noises {
            if !(sd.is_finite() && sd >= 0.0) {
                return Err(format!("sensors.{key} = {sd}: must be finite and >= 0"));
            }
        }
        let biases = [
            ("imu.gyro_bias_rad_s", self.imu.gyro_bias_rad_s),
            ("imu.accel_bias_m_s2", self.imu.accel_bias_m_s2),
            ("attitude.bias_rad", self.attitude.bias_rad),
            ("gnss.position_bias_m", self.gnss.position_bias_m),
            ("gnss.velocity_bias_m_s", self.gnss.velocity_bias_m_s),
            ("baro.bias_m", [self.baro.bias_m, 0.0, 0.0]),
            ("battery.voltage_bias_v", [self.battery.voltage_bias_v, 0.0, 0.0]),
            ("battery.current_bias_a", [self.battery.current_bias_a, 0.0, 0.0]),
        ];
        for (key, list) in biases {
            if let Some(x) = list.iter().find(|x| !x.is_finite()) {
                return Err(format!("sensors.{key} = {x}: must be finite"));
            }
        }
        Ok(())
    }
}
