//! Numbers of the sensors; the table `[sensors]` of a vehicle file.
//!
//! Defaults are of the size of docs/equations.md C: a consumer inertial unit, and a 10 Hz receiver
//! over a flight of seconds, in which its slow position error does not show. No sensor is late by
//! default, and what is drawn for each flight is off.

use super::devices;
use super::table::Limit::{AboveZero, Signed, Size, Within};
use crate::quantity::plain;
use crate::setting::SettingError;
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

impl Timing {
    pub(super) const fn every(rate_hz: f64) -> Self {
        Self { rate_hz, latency_s: 0.0, seed: None }
    }

    /// * `sensor` - name of the table, for the error
    pub(super) fn check(&self, sensor: &str) -> Result<(), SettingError> {
        let Self { rate_hz, latency_s, .. } = self;
        if !(*rate_hz > 0.0 && *rate_hz <= 1e5) {
            return Err(SettingError::value(
                format!("sensors.{sensor}.timing.rate_hz"),
                rate_hz,
                "must be > 0 and <= 1e5",
            ));
        }
        if !(0.0..=10.0).contains(latency_s) {
            return Err(SettingError::value(
                format!("sensors.{sensor}.timing.latency_s"),
                latency_s,
                "must be 0 to 10",
            ));
        }
        Ok(())
    }
}

impl Default for Timing {
    fn default() -> Self {
        Self::every(300.0)
    }
}

/// A sensor: its rate by default, its keys with defaults and limits, and where its devices are.
macro_rules! sensor {
    (
        $(#[$doc:meta])*
        $name:ident at $rate_hz:literal Hz $(, $devices:path, $fit:path)?;
        $($(#[$field_doc:meta])* $key:ident: $kind:ty = $default:expr, $limit:expr;)*
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $name {
            /// When it speaks.
            pub timing: $crate::sensors::Timing,
            $($(#[$field_doc])* pub $key: $kind,)*
        }
        impl Default for $name {
            fn default() -> Self {
                Self { timing: $crate::sensors::Timing::every($rate_hz), $($key: $default,)* }
            }
        }
        impl $crate::sensors::table::Table for $name {
            fn keys(&self) -> &'static [&'static str] {
                const KEYS: &[&str] = &[$({ let _ = $devices; $crate::sensors::table::DEVICE },)? "timing", $(stringify!($key)),*];
                KEYS
            }
            fn fields(&mut self) -> Vec<$crate::sensors::table::Field<'_>> {
                use $crate::sensors::table::{Field, Limit, Slot};
                vec![
                    Field { key: "timing", slot: Slot::Timing(&mut self.timing), limit: Limit::Signed },
                    $(Field { key: stringify!($key), slot: Slot::from(&mut self.$key), limit: $limit },)*
                ]
            }
            $(
                fn devices(&self) -> &'static [&'static str] {
                    &$devices
                }
                fn fit(&mut self, device: &str) {
                    $fit(self, device);
                }
            )?
        }
    };
}
pub(super) use sensor;

sensor! {
    /// Gyroscopes and accelerometers.
    ImuSensor at 300.0 Hz, devices::IMUS, devices::fit_imu;
    /// Inertial units, 1 or 2; both have these numbers, and errors of their own.
    units: u32 = 1, Within(1.0, 2.0);
    /// White noise per sample, rad/s.
    gyro_noise_rad_s: f64 = 0.0045, Size;
    /// Constant bias, rad/s.
    gyro_bias_rad_s: [f64; 3] = [0.0; 3], Signed;
    /// Bias that each flight draws for each axis, standard deviation, rad/s.
    gyro_bias_sd_rad_s: f64 = 0.0, Size;
    /// Random walk of the bias, rad/s in a second.
    gyro_walk_rad_s_root_s: f64 = 0.0, Size;
    /// Error of scale that each flight draws for each axis, standard deviation.
    gyro_scale_sd: f64 = 0.0, Size;
    /// Largest rate that it can read, rad/s.
    gyro_range_rad_s: f64 = f64::INFINITY, AboveZero;
    /// Step of its converter, rad/s; 0: none.
    gyro_resolution_rad_s: f64 = 0.0, Size;
    /// White noise per sample, m/s^2.
    accel_noise_m_s2: f64 = 0.25, Size;
    /// Constant bias, m/s^2.
    accel_bias_m_s2: [f64; 3] = [0.0; 3], Signed;
    /// Bias that each flight draws for each axis, standard deviation, m/s^2.
    accel_bias_sd_m_s2: f64 = 0.0, Size;
    /// Random walk of the bias, m/s^2 in a second.
    accel_walk_m_s2_root_s: f64 = 0.0, Size;
    /// Error of scale that each flight draws for each axis, standard deviation.
    accel_scale_sd: f64 = 0.0, Size;
    /// Largest specific force that it can read, m/s^2.
    accel_range_m_s2: f64 = f64::INFINITY, AboveZero;
    /// Step of its converter, m/s^2; 0: none.
    accel_resolution_m_s2: f64 = 0.0, Size;
    /// Angle about each body axis by which a unit sits askew, standard deviation, rad.
    misalignment_sd_rad: f64 = 0.0, Within(0.0, 0.5);
    /// Amplitude on each axis of the rate that one rotor shakes up at `vibration_speed_rad_s`,
    /// rad/s.
    vibration_gyro_rad_s: f64 = 0.0, Size;
    /// Amplitude on each axis of the specific force that one rotor shakes up at
    /// `vibration_speed_rad_s`, m/s^2.
    vibration_accel_m_s2: f64 = 0.0, Size;
    /// Speed of a rotor at which vibration has the given size, rad/s; it grows with the square of
    /// the speed.
    vibration_speed_rad_s: f64 = 1000.0, Within(1.0, 1e5);
    /// Corner frequency of the device's low-pass filter, which weakens vibration, Hz.
    bandwidth_hz: f64 = f64::INFINITY, AboveZero;
}

sensor! {
    /// An attitude estimate that somebody else makes.
    AttitudeSensor at 300.0 Hz;
    /// White error about each body axis, rad.
    noise_rad: f64 = 0.002, Size;
    /// Constant error about the body axes, rad.
    bias_rad: [f64; 3] = [0.0; 3], Signed;
}

sensor! {
    /// Satellite receiver.
    GnssSensor at 10.0 Hz, devices::RECEIVERS, devices::fit_gnss;
    /// White noise of position per axis, m.
    position_noise_m: f64 = 0.05, Size;
    /// Constant error of position, m.
    position_bias_m: [f64; 3] = [0.0; 3], Signed;
    /// Slow error of position per axis, standard deviation, m.
    position_wander_m: f64 = 0.0, Size;
    /// Time constant of the slow error, s.
    wander_time_s: f64 = 60.0, Within(0.01, 1e6);
    /// White noise of velocity per axis, m/s.
    velocity_noise_m_s: f64 = 0.05, Size;
    /// Constant error of velocity, m/s.
    velocity_bias_m_s: [f64; 3] = [0.0; 3], Signed;
    /// Share of the fixes whose position jumps.
    outlier_share: f64 = 0.0, Within(0.0, 1.0);
    /// How far such a fix jumps, to some side, m.
    outlier_m: f64 = 0.0, Size;
    /// Dropouts that begin in a second of fixes.
    dropouts_per_s: f64 = 0.0, Within(0.0, 10.0);
    /// Mean length of a dropout, s.
    dropout_s: f64 = 0.0, Size;
}

sensor! {
    /// Barometer.
    BaroSensor at 50.0 Hz, devices::BAROMETERS, devices::fit_baro;
    /// White noise, m.
    noise_m: f64 = 0.1, Size;
    /// Constant error, m.
    bias_m: f64 = 0.0, Signed;
    /// Random walk of the error, m in a second.
    drift_m_root_s: f64 = 0.0, Size;
    /// Time constant with which it follows the height, s.
    lag_s: f64 = 0.0, Within(0.0, 10.0);
    /// Error of static pressure over dynamic pressure for air along the body's x, y and z; positive
    /// reads too high.
    pressure_coefficient: [f64; 3] = [0.0; 3], Within(-2.0, 2.0);
    /// What fully spread wings add to each of them.
    pressure_coefficient_wing: f64 = 0.0, Within(-2.0, 2.0);
    /// Step of its converter, m; 0: none.
    resolution_m: f64 = 0.0, Size;
}

sensor! {
    /// Magnetometer; without errors unless told.
    MagnetometerSensor at 50.0 Hz, devices::MAGNETOMETERS, devices::fit_magnetometer;
    /// Strength of the earth's field, uT.
    field_ut: f64 = 48.0, Within(1.0, 100.0);
    /// How far the field points down, rad.
    inclination_rad: f64 = 1.13, Within(-1.6, 1.6);
    /// White noise per axis, uT.
    noise_ut: f64 = 0.0, Size;
    /// Field of the vehicle's own iron that each flight draws for each axis, standard deviation,
    /// uT.
    hard_iron_sd_ut: f64 = 0.0, Size;
    /// Error that each flight draws for each entry of the symmetric matrix of soft iron, standard
    /// deviation.
    soft_iron_sd: f64 = 0.0, Within(0.0, 0.3);
    /// Field of the battery's current along the body axes, uT/A.
    current_ut_per_a: [f64; 3] = [0.0; 3], Signed;
    /// Largest field that it can read on an axis, uT.
    range_ut: f64 = f64::INFINITY, AboveZero;
    /// Step of its converter, uT; 0: none.
    resolution_ut: f64 = 0.0, Size;
}
