//! All sensors of a vehicle: reading `[sensors]`, checking it, and whole suites for studies.
//!
//! What is the device's comes from `devices.rs`; what is the airframe's is assumed here, of the
//! size that docs/equations.md, C gives and flight logs of small multirotors show. A vehicle file
//! may start from a suite, `suite = "hobby"`, and change numbers of it; noise per sample is for the
//! suite's rates, so a table with another rate names its `device` again.

use super::logged::Logged;
use super::parameters::{AttitudeSensor, BaroSensor, GnssSensor, ImuSensor, MagnetometerSensor};
use super::table::{OneOf, Reader, Said, Table};
use crate::setting::SettingError;
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use std::fmt;
use std::sync::LazyLock;

/// All sensors of a vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SensorParameters {
    /// Gyroscopes and accelerometers.
    pub imu: ImuSensor,
    /// Attitude estimate.
    pub attitude: AttitudeSensor,
    /// Satellite receiver.
    pub gnss: GnssSensor,
    /// Barometer.
    pub baro: BaroSensor,
    /// Magnetometer, where there is one.
    pub magnetometer: Option<MagnetometerSensor>,
    /// Those that the flight code does not hear.
    pub logged: Logged,
}

/// Names of suites for [`SensorParameters::suite`].
pub const SUITES: [&str; 4] = ["nominal", "hobby", "research", "rtk"];

const SUITE: &str = "suite";
/// Keys of `[sensors]`; all but the suite are tables.
static KEYS: LazyLock<Vec<&'static str>> = LazyLock::new(|| {
    [&["imu", "attitude", "gnss", "baro", "magnetometer", SUITE], Logged::NAMES].concat()
});

/// What the airframe of a suite does to its devices.
struct SuiteAirframe {
    devices: [&'static str; 4],
    /// One rotor at 1000 rad/s, behind the filter of the device: rate, rad/s, and specific force,
    /// m/s^2.
    vibration: [f64; 2],
    /// Random walk of the biases, rad/s and m/s^2 in a second.
    walk: [f64; 2],
    misalignment_sd_rad: f64,
    /// Outliers: share and size, m. Dropouts: rate, 1/s, and mean length, s.
    outliers: [f64; 2],
    dropouts: [f64; 2],
    pressure: [f64; 3],
    pressure_wing: f64,
    /// What a calibration left of the iron: hard, uT, and soft; field of a current, uT/A.
    iron: [f64; 2],
    current_ut_per_a: [f64; 3],
}

/// Speed of the rotors at which suites give their vibration: about hover of the shipped squirrel.
const HOVER_RAD_S: f64 = 1500.0;
/// Low-pass filter of the suites' inertial units, as such devices have one to choose (98 Hz in an
/// MPU-6000), Hz.
const BANDWIDTH_HZ: f64 = 98.0;

impl SensorParameters {
    /// No noise, no bias, no latency; rates as by default, no magnetometer.
    pub fn ideal() -> Self {
        let mut p = Self::default();
        p.imu.gyro_noise_rad_s = 0.0;
        p.imu.accel_noise_m_s2 = 0.0;
        p.attitude.noise_rad = 0.0;
        p.gnss.position_noise_m = 0.0;
        p.gnss.velocity_noise_m_s = 0.0;
        p.baro.noise_m = 0.0;
        if let Some(battery) = &mut p.logged.battery {
            (battery.voltage_noise_v, battery.current_noise_a) = (0.0, 0.0);
        }
        p
    }

    /// A complete set of sensors by its name in [`SUITES`]; `None` for another name. All have two
    /// inertial units and a magnetometer.
    ///
    /// - `nominal`: errors as by default.
    /// - `hobby`: cheap devices on an airframe that shakes, roughly calibrated.
    /// - `research`: good devices, damped and calibrated.
    /// - `rtk`: as `research`, with a receiver that has corrections, and a better barometer and
    ///   magnetometer.
    pub fn suite(name: &str) -> Option<Self> {
        let research = SuiteAirframe {
            devices: ["icm_42688_p", "neo_m9n", "bmp390", "ist8310"],
            vibration: [0.006, 1.0],
            walk: [5e-5, 5e-4],
            misalignment_sd_rad: 0.005,
            outliers: [0.001, 5.0],
            dropouts: [0.002, 1.0],
            pressure: [0.15, 0.15, -0.1],
            pressure_wing: -0.2,
            iron: [1.0, 0.01],
            current_ut_per_a: [0.03, -0.02, 0.04],
        };
        match name {
            "nominal" => {
                let mut p = Self::default();
                p.imu.units = 2;
                p.magnetometer =
                    Some(MagnetometerSensor { noise_ut: 0.5, ..MagnetometerSensor::default() });
                Some(p)
            }
            "hobby" => Some(Self::of(&SuiteAirframe {
                devices: ["mpu_6000", "neo_m9n", "ms5611", "qmc5883l"],
                vibration: [0.02, 4.0],
                walk: [2e-4, 2e-3],
                misalignment_sd_rad: 0.01,
                outliers: [0.002, 8.0],
                dropouts: [0.005, 2.0],
                pressure: [0.3, 0.3, -0.2],
                pressure_wing: -0.4,
                iron: [3.0, 0.03],
                current_ut_per_a: [0.1, -0.05, 0.15],
            })),
            "research" => Some(Self::of(&research)),
            "rtk" => Some(Self::of(&SuiteAirframe {
                devices: ["icm_42688_p", "zed_f9p_rtk", "dps310", "rm3100"],
                // A solution that is lost for a fix is off by a wavelength or two.
                outliers: [0.001, 0.4],
                ..research
            })),
            _ => None,
        }
    }

    fn of(airframe: &SuiteAirframe) -> Self {
        let mut p = Self::default();
        let mut compass = MagnetometerSensor::default();
        let [imu, gnss, baro, magnetometer] = airframe.devices;
        p.imu.fit(imu);
        p.gnss.fit(gnss);
        p.baro.fit(baro);
        compass.fit(magnetometer);
        p.imu.units = 2;
        p.imu.vibration_speed_rad_s = HOVER_RAD_S;
        p.imu.bandwidth_hz = BANDWIDTH_HZ;
        [p.imu.vibration_gyro_rad_s, p.imu.vibration_accel_m_s2] = airframe.vibration;
        [p.imu.gyro_walk_rad_s_root_s, p.imu.accel_walk_m_s2_root_s] = airframe.walk;
        p.imu.misalignment_sd_rad = airframe.misalignment_sd_rad;
        p.gnss.timing.latency_s = 0.12;
        [p.gnss.outlier_share, p.gnss.outlier_m] = airframe.outliers;
        [p.gnss.dropouts_per_s, p.gnss.dropout_s] = airframe.dropouts;
        p.baro.lag_s = 0.03;
        p.baro.pressure_coefficient = airframe.pressure;
        p.baro.pressure_coefficient_wing = airframe.pressure_wing;
        [compass.hard_iron_sd_ut, compass.soft_iron_sd] = airframe.iron;
        compass.current_ut_per_a = airframe.current_ut_per_a;
        p.magnetometer = Some(compass);
        p
    }

    /// A sensor by its table's name; one that is not there is added.
    fn table(&mut self, name: &str) -> Option<&mut dyn Table> {
        match name {
            "imu" => Some(&mut self.imu),
            "attitude" => Some(&mut self.attitude),
            "gnss" => Some(&mut self.gnss),
            "baro" => Some(&mut self.baro),
            "magnetometer" => Some(self.magnetometer.get_or_insert_default()),
            _ => self.logged.table(name),
        }
    }

    /// # Errors
    /// The first number that cannot be, with its field.
    pub(crate) fn check(&self) -> Result<(), SettingError> {
        let mut copy = *self;
        for name in KEYS.iter().copied() {
            if let Some(table) = copy.table(name) {
                table.fields().iter().try_for_each(|field| field.check(name))?;
            }
        }
        Ok(())
    }
}

impl<'de> Deserialize<'de> for SensorParameters {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Tables;
        impl<'de> Visitor<'de> for Tables {
            type Value = SensorParameters;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a table of sensors")
            }
            fn visit_map<A: MapAccess<'de>>(
                self,
                mut map: A,
            ) -> Result<SensorParameters, A::Error> {
                let mut like = SensorParameters::default();
                let mut suite = None;
                let mut said: Vec<(&str, Said)> = Vec::new();
                while let Some(key) =
                    map.next_key_seed(OneOf { names: KEYS.as_slice(), what: None })?
                {
                    if let Some(table) = like.table(key) {
                        said.push((key, map.next_value_seed(Reader::of(table))?));
                    } else {
                        suite =
                            Some(map.next_value_seed(OneOf { names: &SUITES, what: Some(SUITE) })?);
                    }
                }
                // The suite acts before the tables wherever it stands.
                let mut p = suite.and_then(SensorParameters::suite).unwrap_or_default();
                for (key, said) in &said {
                    if let Some(table) = p.table(key) {
                        table.apply(said);
                    }
                }
                Ok(p)
            }
        }
        deserializer.deserialize_map(Tables)
    }
}
