//! Inertial units: walk, scale, mounting, range, steps, vibration, and that two of them err each
//! for itself.

use super::*;

/// A perfect unit at a rate of its own, with something wrong.
fn with(rate_hz: f64, wrong: impl FnOnce(&mut ImuSensor)) -> SensorParameters {
    let mut p = SensorParameters::ideal();
    p.imu.timing.rate_hz = rate_hz;
    wrong(&mut p.imu);
    p
}

fn rates(frames: &[SensorFrame]) -> Vec<Vector3<f64>> {
    frames
        .iter()
        .filter_map(|f| f.imu)
        .map(|i| i.omega.vector.cast() - truth().omega.vector)
        .collect()
}

/// Variance of the bias after T is K^2 T, at any rate.
#[test]
fn the_bias_walks() {
    for rate_hz in [50, 200] {
        let mut ends = Vec::new();
        for seed in 0..400 {
            let p = with(rate_hz as f64, |imu| imu.gyro_walk_rad_s_root_s = 0.01);
            let walk = rates(&frames(&p, seed, rate_hz, 4));
            assert!(walk[0].norm() < 1e-7, "it starts where it was drawn");
            ends.extend_from_slice(walk.last().unwrap().as_slice());
        }
        // 1200 ends: 2 % of a standard deviation; four of these.
        assert!((sd(&ends) / (0.01 * 2.0) - 1.0).abs() < 0.08, "{}", sd(&ends));
        assert!(mean(&ends).abs() < 4.0 * 0.02 / 1200f64.sqrt());
    }
}

/// What a flight draws has its size over flights and stays in one.
#[test]
fn bias_and_scale_are_drawn_for_each_flight_axis_and_unit() {
    let (mut first, mut second, mut scales) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..500 {
        let p = with(100.0, |imu| {
            (imu.units, imu.gyro_bias_sd_rad_s, imu.accel_scale_sd) = (2, 0.02, 0.01);
        });
        let sampled = frames(&p, seed, 100, 1);
        assert_eq!(sampled[0].imu, sampled[99].imu);
        for (list, imu) in [(&mut first, sampled[0].imu), (&mut second, sampled[0].imu_2)] {
            let error = imu.unwrap().omega.vector.cast() - truth().omega.vector;
            list.extend_from_slice(error.as_slice());
            scales.push(f64::from(imu.unwrap().specific_force.vector.z) / -9.8 - 1.0);
        }
    }
    assert!((sd(&first) / 0.02 - 1.0).abs() < 0.08 && (sd(&second) / 0.02 - 1.0).abs() < 0.08);
    assert!((sd(&scales) / 0.01 - 1.0).abs() < 0.1, "{}", sd(&scales));
    // 1500 pairs: 0.026 of a standard deviation.
    assert!(correlation(&first, &second).abs() < 0.1, "units err each for itself");
}

#[test]
fn a_unit_that_sits_askew_turns_the_vector_and_keeps_its_length() {
    let mut turned = Vec::new();
    for seed in 0..500 {
        let force = frames(&with(1.0, |imu| imu.misalignment_sd_rad = 0.02), seed, 1, 1)[0]
            .imu
            .unwrap()
            .specific_force;
        assert!((f64::from(force.vector.norm()) - 9.8).abs() < 1e-5);
        turned.push(f64::from(force.vector.x) / 9.8);
    }
    assert!((sd(&turned) / 0.02 - 1.0).abs() < 0.13, "{}", sd(&turned));
}

#[test]
fn two_units_have_noise_of_their_own() {
    let sampled = frames(&SensorParameters::suite("nominal").unwrap(), 6, 300, 20);
    let of = |unit: fn(&SensorFrame) -> Option<squirrel_core::stack::Imu>| -> Vec<f64> {
        sampled.iter().filter_map(unit).map(|i| i.omega.vector.x.into()).collect()
    };
    let (first, second) = (of(|f| f.imu), of(|f| f.imu_2));
    assert_eq!(first.len(), second.len());
    // 6000 samples: 0.013 of a standard deviation.
    assert!(correlation(&first, &second).abs() < 0.05);
    assert!((sd(&second) / 0.0045 - 1.0).abs() < 0.05);
}

#[test]
fn readings_end_at_the_range_and_are_whole_steps() {
    let p = with(100.0, |imu| {
        (imu.accel_range_m_s2, imu.gyro_range_rad_s) = (5.0, 0.25);
        (imu.gyro_noise_rad_s, imu.gyro_resolution_rad_s) = (0.05, 1.0 / 128.0);
    });
    let sampled = frames(&p, 2, 100, 10);
    let mut clipped = 0;
    for imu in sampled.iter().filter_map(|f| f.imu) {
        assert_eq!(imu.specific_force.vector.z, -5.0);
        clipped += i32::from(imu.omega.vector.z == 0.25);
        assert!(imu.omega.vector.iter().all(|x| x.abs() <= 0.25 && (x * 128.0).fract() == 0.0));
    }
    // Truth is 0.3 with noise of 0.05: a sample in six is inside.
    assert!((800..880).contains(&clipped), "{clipped} of 1000");
}

/// Power of a line at a frequency, as the amplitude of its sine.
fn amplitude(samples: &[f64], rate_hz: f64, frequency_hz: f64) -> f64 {
    let (mut sin, mut cos) = (0.0, 0.0);
    for (k, x) in samples.iter().enumerate() {
        let phase = std::f64::consts::TAU * frequency_hz * k as f64 / rate_hz;
        (sin, cos) = (sin + x * phase.sin(), cos + x * phase.cos());
    }
    2.0 * sin.hypot(cos) / samples.len() as f64
}

/// A rotor at 220 Hz, sampled at 300 Hz, shows at 80 Hz; its size goes with the square of its
/// speed.
#[test]
fn vibration_shows_at_its_alias() {
    let p = with(300.0, |imu| {
        imu.vibration_accel_m_s2 = 2.0;
        imu.vibration_gyro_rad_s = 0.1;
        imu.vibration_speed_rad_s = 110.0 * std::f64::consts::TAU;
    });
    let mut sensors = sensors(&p, 3);
    let mut now = truth();
    (now.rotor_count, now.rotor_speed_rad_s[0]) = (1, 220.0 * std::f64::consts::TAU);
    let (mut force, mut rate) = (Vec::new(), Vec::new());
    for k in 0..3000_u64 {
        let imu = sensors.poll((k * 1_000_000).div_ceil(300), &now).0.imu.unwrap();
        force.push(f64::from(imu.specific_force.vector.x));
        rate.push(f64::from(imu.omega.vector.z) - 0.3);
    }
    // Stamps are whole microseconds, 1e-3 rad of the rotor's phase.
    assert!(
        (amplitude(&force, 300.0, 80.0) - 8.0).abs() < 0.02,
        "{}",
        amplitude(&force, 300.0, 80.0)
    );
    assert!((amplitude(&rate, 300.0, 80.0) - 0.4).abs() < 1e-3);
    assert!(amplitude(&force, 300.0, 60.0) < 0.02 && amplitude(&force, 300.0, 140.0) < 0.02);
    now.rotor_count = 0;
    let still = sensors.poll(10_000_000, &now).0.imu.unwrap();
    assert_eq!(still.specific_force.vector.x, 0.0);
}
