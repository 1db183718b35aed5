//! Who tells the flight code how the vehicle stands and where it is: `[estimation]` of a vehicle
//! file.
//!
//! A filter's numbers are those of the file's `[sensors]`: it expects the noise that their
//! datasheets state. `oracle` is no filter but the truth, to see what estimation costs.

use crate::sensors::SensorParameters;
use crate::setting::SettingError;
use squirrel_core::estimate::altitude::AltitudeParameters;
use squirrel_core::estimate::eskf::EskfParameters;
use squirrel_core::estimate::mahony::MahonyParameters;
use squirrel_core::estimate::mekf::MekfParameters;
use squirrel_core::estimate::navigator::Filter;
use squirrel_core::estimate::rkf::{Fading, RkfParameters};
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::nalgebra::Vector3;

/// A way to know attitude, velocity and position.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Estimator {
    /// Fifteen states, aided by satellite fixes, barometer and compass.
    #[default]
    Eskf,
    /// Attitude and gyro bias, aided by velocities of fixes.
    Mekf,
    /// Gated complementary filter.
    Mahony,
    /// The paper's filter of the direction of gravity, multiple factors.
    RkfMtf,
    /// With a single factor.
    RkfStf,
    /// With none: a plain Kalman filter.
    Kalman,
    /// What `[sensors.attitude]` and the fixes say, as they are.
    External,
    /// The truth: sensors without error, attitude from outside.
    Oracle,
}

impl Estimator {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Eskf,
        Self::Mekf,
        Self::Mahony,
        Self::RkfMtf,
        Self::RkfStf,
        Self::Kalman,
        Self::External,
        Self::Oracle,
    ];

    /// Name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Eskf => "eskf",
            Self::Mekf => "mekf",
            Self::Mahony => "mahony",
            Self::RkfMtf => "rkf_mtf",
            Self::RkfStf => "rkf_stf",
            Self::Kalman => "kalman",
            Self::External => "external",
            Self::Oracle => "oracle",
        }
    }

    /// Whether the flight code estimates, and nobody outside.
    pub fn is_filter(self) -> bool {
        !matches!(self, Self::External | Self::Oracle)
    }

    /// The estimator of a name.
    ///
    /// # Errors
    /// One line that lists the names.
    pub fn parse(name: &str) -> Result<Self, SettingError> {
        Self::ALL.into_iter().find(|estimator| estimator.name() == name).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            SettingError::Name {
                field: "estimation.filter",
                name: name.to_owned(),
                what: "filter",
                known,
            }
        })
    }

    /// The filter, with what a vehicle's sensors are said to be.
    pub fn filter(self, sensors: &SensorParameters) -> Filter {
        let (imu, gnss) = (&sensors.imu, &sensors.gnss);
        // Two units are averaged; and no filter may be told that there is no noise at all.
        let units = f64::from(imu.units).sqrt();
        let [gyro, accel] = [(imu.gyro_noise_rad_s, 1e-4), (imu.accel_noise_m_s2, 1e-2)]
            .map(|(noise, least)| f64::max(noise / units, least));
        // Vibration is the same in both units.
        let [gyro, accel] = [gyro, accel.hypot(imu.shaken_m_s2())].map(|noise| noise as f32);
        let rkf = |fading| {
            let external_memory = RkfParameters::default().external_memory;
            Filter::Rkf(RkfParameters {
                gyro_noise_rad_s: gyro,
                accel_noise_m_s2: accel,
                external_memory,
                fading,
            })
        };
        match self {
            Self::External | Self::Oracle => Filter::External,
            Self::Kalman => rkf(Fading::None),
            Self::RkfStf => rkf(Fading::Single),
            Self::RkfMtf => rkf(Fading::Multiple),
            Self::Mahony => Filter::Mahony(MahonyParameters::default()),
            Self::Mekf => {
                Filter::Mekf(MekfParameters { gyro_noise_rad_s: gyro, ..MekfParameters::default() })
            }
            Self::Eskf => {
                let position_m = gnss.position_noise_m.hypot(gnss.position_wander_m);
                Filter::Eskf(EskfParameters {
                    gyro_noise_rad_s: gyro,
                    accel_noise_m_s2: accel,
                    gyro_walk_rad_s_root_s: f64::max(imu.gyro_walk_rad_s_root_s, 1e-4) as f32,
                    accel_walk_m_s2_root_s: f64::max(imu.accel_walk_m_s2_root_s, 1e-3) as f32,
                    gnss_position_noise_m: f64::max(position_m, 0.01) as f32,
                    gnss_velocity_noise_m_s: f64::max(gnss.velocity_noise_m_s, 0.01) as f32,
                    gnss_latency_s: f64::min(gnss.timing.latency_s, 0.3) as f32,
                    baro_noise_m: f64::max(baro_error_m(sensors), 0.02) as f32,
                    start_heading_rad: f64::max(heading_error_rad(sensors), 0.02) as f32,
                    heading_noise_rad: f64::max(heading_error_rad(sensors), 0.02) as f32,
                    ..EskfParameters::default()
                })
            }
        }
    }

    /// The height filter's numbers.
    pub(crate) fn altitude(sensors: &SensorParameters) -> AltitudeParameters {
        let by_default = AltitudeParameters::default();
        AltitudeParameters {
            baro_noise_m: f64::max(sensors.baro.noise_m, 0.02) as f32,
            ..by_default
        }
    }
}

/// Deviation of a height by the barometer, m: noise, and three times what flow at [`FAST_M_S`]
/// makes of static pressure, which stays for many samples.
fn baro_error_m(sensors: &SensorParameters) -> f64 {
    let baro = &sensors.baro;
    let largest = baro.pressure_coefficient.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
    baro.noise_m.hypot(3.0 * largest * FAST_M_S * FAST_M_S / (2.0 * GRAVITY_M_S2))
}

/// Deviation of a heading by the compass, rad: of its noise, its iron and [`DRAWN_A`] beside the
/// field's horizontal part.
fn heading_error_rad(sensors: &SensorParameters) -> f64 {
    let Some(compass) = &sensors.magnetometer else { return 0.0 };
    let current = Vector3::from(compass.current_ut_per_a).norm() * DRAWN_A;
    let error_ut = compass.noise_ut.hypot(compass.hard_iron_sd_ut).hypot(current);
    let horizontal_ut = compass.field_ut * compass.inclination_rad.cos().abs();
    // Soft iron turns the whole field, a deviation of it for one of the field's.
    (error_ut.hypot(compass.soft_iron_sd * compass.field_ut) / f64::max(horizontal_ut, 1.0))
        .min(1.0)
}

/// A speed of agile flight, m/s.
const FAST_M_S: f64 = 7.0;
/// A current of agile flight, A.
const DRAWN_A: f64 = 15.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_estimators_are_one_to_one() {
        for estimator in Estimator::ALL {
            assert_eq!(Estimator::parse(estimator.name()), Ok(estimator));
        }
        assert!(Estimator::parse("ekf").unwrap_err().to_string().contains("rkf_mtf"));
    }
}
