//! Devices that can be bought: `device = "..."` in a sensor's table.
//!
//! Figures are the datasheets' typical ones, in the datasheets' units; "assumed" stands where a
//! datasheet says nothing. Those of the MPU-6000 were read against the datasheet's text; the others
//! were not yet, so read your part's before you rely on one. What depends on the airframe
//! (vibration, iron, mounting, air flow) and on the settings (rate, latency) is not the device's.
//! White noise per sample is the density times the root of the rate, as if the device's filter let
//! all of the noise through. Offsets at first power-up are calibrated away by whoever builds the
//! vehicle; a flight draws what ten degrees of temperature since then do (assumed). Tolerances of
//! scale are taken for three standard deviations (assumed).

use super::parameters::{BaroSensor, GnssSensor, ImuSensor, MagnetometerSensor};
use squirrel_core::math::GRAVITY_M_S2;
use std::f64::consts::PI;

/// Inertial units.
pub(super) const IMUS: [&str; 3] = ["icm_42688_p", "bmi270", "mpu_6000"];
/// Satellite receivers.
pub(super) const RECEIVERS: [&str; 2] = ["neo_m9n", "zed_f9p_rtk"];
/// Barometers.
pub(super) const BAROMETERS: [&str; 3] = ["bmp390", "ms5611", "dps310"];
/// Magnetometers.
pub(super) const MAGNETOMETERS: [&str; 3] = ["ist8310", "qmc5883l", "rm3100"];

const RAD_PER_DEG: f64 = PI / 180.0;
/// One thousandth of standard gravity, m/s^2.
const MILLI_G_M_S2: f64 = GRAVITY_M_S2 * 1e-3;
/// Change of temperature since the last calibration, K (assumed).
const WARMING_K: f64 = 10.0;
/// Steps of a converter of 16 bits over a range of both signs.
const STEPS_PER_RANGE: f64 = 32768.0;
/// Height of a pascal near the ground, m/Pa: 1 / (1.225 kg/m^3 g).
const M_PER_PA: f64 = 1.0 / (1.225 * GRAVITY_M_S2);
/// Radius that holds half of the fixes over the standard deviation of an axis: sqrt(2 ln 2).
const CEP_PER_SD: f64 = 1.177_4;

/// An inertial unit of 16 bits at +-2000 deg/s and +-16 g.
struct Imu {
    gyro_deg_s_root_hz: f64,
    accel_micro_g_root_hz: f64,
    /// Change of the offsets with temperature.
    gyro_deg_s_k: f64,
    accel_milli_g_k: f64,
    /// Tolerance of the scales, %.
    gyro_scale: f64,
    accel_scale: f64,
}

pub(super) fn fit_imu(p: &mut ImuSensor, device: &str) {
    let imu = match device {
        // TDK DS-000347: 2.8 mdps/rtHz, 65 (x, y) and 70 (z) ug/rtHz, 5 mdps/K, 0.15 mg/K, 0.5 %,
        // 0.5 %.
        "icm_42688_p" => Imu {
            gyro_deg_s_root_hz: 0.0028,
            accel_micro_g_root_hz: 70.0,
            gyro_deg_s_k: 0.005,
            accel_milli_g_k: 0.15,
            gyro_scale: 0.5,
            accel_scale: 0.5,
        },
        // Bosch BST-BMI270-DS000: 7 mdps/rtHz, 160 ug/rtHz, 20 mdps/K, 0.25 mg/K, 0.4 % after its
        // retrimming, 0.4 %.
        "bmi270" => Imu {
            gyro_deg_s_root_hz: 0.007,
            accel_micro_g_root_hz: 160.0,
            gyro_deg_s_k: 0.02,
            accel_milli_g_k: 0.25,
            gyro_scale: 0.4,
            accel_scale: 0.4,
        },
        // InvenSense PS-MPU-6000A-00 rev. 3.4: 5 mdps/rtHz, 400 ug/rtHz, +-20 deg/s over 125 K,
        // +-35 mg over 70 K, 3 %, 3 %.
        "mpu_6000" => Imu {
            gyro_deg_s_root_hz: 0.005,
            accel_micro_g_root_hz: 400.0,
            gyro_deg_s_k: 20.0 / 125.0,
            accel_milli_g_k: 35.0 / 70.0,
            gyro_scale: 3.0,
            accel_scale: 3.0,
        },
        _ => return,
    };
    let root_hz = p.timing.rate_hz.sqrt();
    p.gyro_noise_rad_s = imu.gyro_deg_s_root_hz * RAD_PER_DEG * root_hz;
    p.accel_noise_m_s2 = imu.accel_micro_g_root_hz * 1e-3 * MILLI_G_M_S2 * root_hz;
    p.gyro_bias_sd_rad_s = imu.gyro_deg_s_k * WARMING_K * RAD_PER_DEG;
    p.accel_bias_sd_m_s2 = imu.accel_milli_g_k * WARMING_K * MILLI_G_M_S2;
    p.gyro_scale_sd = imu.gyro_scale * 0.01 / 3.0;
    p.accel_scale_sd = imu.accel_scale * 0.01 / 3.0;
    p.gyro_range_rad_s = 2000.0 * RAD_PER_DEG;
    p.accel_range_m_s2 = 16.0 * GRAVITY_M_S2;
    p.gyro_resolution_rad_s = p.gyro_range_rad_s / STEPS_PER_RANGE;
    p.accel_resolution_m_s2 = p.accel_range_m_s2 / STEPS_PER_RANGE;
}

pub(super) fn fit_gnss(p: &mut GnssSensor, device: &str) {
    let (cep_m, noise_m) = match device {
        // u-blox UBX-19014285: position 2.0 m CEP. Noise from fix to fix assumed
        // (docs/equations.md, C.4).
        "neo_m9n" => (2.0, 0.05),
        // u-blox UBX-17051259: position 0.01 m CEP with a fixed RTK solution, base near. Noise from
        // fix to fix assumed.
        "zed_f9p_rtk" => (0.01, 0.005),
        _ => return,
    };
    p.position_wander_m = cep_m / CEP_PER_SD;
    p.position_noise_m = noise_m;
    // Assumed: multipath and geometry change in a minute.
    p.wander_time_s = 60.0;
    // Both datasheets: 0.05 m/s, half of the fixes at 30 m/s.
    p.velocity_noise_m_s = 0.05;
}

pub(super) fn fit_baro(p: &mut BaroSensor, device: &str) {
    let (noise_pa, step_pa, offset_pa_k) = match device {
        // Bosch BST-BMP390-DS002: steps 0.016 Pa, 0.6 Pa/K; noise 0.02 Pa with oversampling 32 and
        // a filter, at 50 Hz and 8 assumed 0.9.
        "bmp390" => (0.9, 0.016, 0.6),
        // TE MS5611-01BA03: 0.012 mbar RMS at oversampling 4096, output in 0.01 mbar; 2 Pa/K
        // assumed from its error band.
        "ms5611" => (1.2, 1.0, 2.0),
        // Infineon DPS310: 0.4 Pa RMS at oversampling 8, steps 0.06 Pa, 0.5 Pa/K.
        "dps310" => (0.4, 0.06, 0.5),
        _ => return,
    };
    p.noise_m = noise_pa * M_PER_PA;
    p.resolution_m = step_pa * M_PER_PA;
    // Assumed: a degree in a minute.
    p.drift_m_root_s = offset_pa_k * M_PER_PA / 60.0_f64.sqrt();
}

pub(super) fn fit_magnetometer(p: &mut MagnetometerSensor, device: &str) {
    let (noise_ut, range_ut, step_ut) = match device {
        // iSentek IST8310: +-1600 uT in x and y (z more), 0.3 uT a step; noise of about a step with
        // 16 averages assumed.
        "ist8310" => (0.3, 1600.0, 0.3),
        // QST QMC5883L: +-8 G, 3000 steps a gauss, noise 2 mG.
        "qmc5883l" => (0.2, 800.0, 100.0 / 3000.0),
        // PNI RM3100: +-800 uT, 75 steps a uT and noise 15 nT at 200 cycles.
        "rm3100" => (0.015, 800.0, 1.0 / 75.0),
        _ => return,
    };
    p.noise_ut = noise_ut;
    p.range_ut = range_ut;
    p.resolution_ut = step_ut;
}
