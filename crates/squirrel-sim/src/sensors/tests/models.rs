//! Receiver, barometer and magnetometer: sizes, times and signs of their errors.

use super::*;
use squirrel_core::math::GRAVITY_M_S2;

/// Standard deviation over seeds, the same at the start and later, and a correlation that falls to
/// 1/e in the time constant.
#[test]
fn the_receiver_wanders() {
    let mut p = SensorParameters::ideal();
    (p.gnss.position_wander_m, p.gnss.wander_time_s) = (1.5, 20.0);
    let [mut start, mut later] = [Vec::new(), Vec::new()];
    for seed in 0..600 {
        let sampled = frames(&p, seed, 10, 21);
        for (list, k) in [(&mut start, 0), (&mut later, 200)] {
            let error =
                sampled[k].gnss.unwrap().position.vector.cast::<f64>() - truth().position.vector;
            list.extend_from_slice(error.as_slice());
        }
        let step =
            sampled[1].gnss.unwrap().position.vector - sampled[0].gnss.unwrap().position.vector;
        // sd of a step: 1.5 sqrt(2 * 0.1 / 20) = 0.15.
        assert!(step.norm() < 1.0, "it wanders, it does not jump");
    }
    // 1800 numbers: 1.7 % and 0.02.
    assert!((sd(&start) / 1.5 - 1.0).abs() < 0.07 && (sd(&later) / 1.5 - 1.0).abs() < 0.07);
    let kept = correlation(&start, &later);
    assert!((kept - (-1.0_f64).exp()).abs() < 0.08, "{kept}");
}

#[test]
fn outliers_have_their_share_and_size() {
    let mut p = SensorParameters::ideal();
    (p.gnss.outlier_share, p.gnss.outlier_m) = (0.05, 8.0);
    let mut sides = Vector3::zeros();
    let mut outliers = 0;
    for frame in frames(&p, 4, 10, 1000) {
        let fix = frame.gnss.unwrap();
        let jump = fix.position.vector.cast() - truth().position.vector;
        assert_eq!((jump.z, fix.velocity.vector.x), (0.0, 4.0), "sideways, and not the velocity");
        if jump.norm() > 1e-5 {
            assert!((jump.norm() - 8.0).abs() < 1e-5);
            outliers += 1;
            sides += jump / 8.0;
        }
    }
    // 10000 fixes: 500 +- 22.
    assert!((430..570).contains(&outliers), "{outliers}");
    assert!(sides.norm() < 0.2 * f64::from(outliers), "to all sides");
}

#[test]
fn dropouts_have_their_rate_and_length() {
    let mut p = SensorParameters::ideal();
    (p.gnss.dropouts_per_s, p.gnss.dropout_s) = (0.05, 3.0);
    let sampled: Vec<bool> = frames(&p, 4, 10, 20_000).iter().map(|f| f.gnss.is_some()).collect();
    let gaps = sampled.windows(2).filter(|pair| pair[0] && !pair[1]).count();
    let missing = sampled.iter().filter(|heard| !**heard).count();
    // One every 20 + 3 s: 870, each 30 fixes long, give or take 1/sqrt(870); those shorter than a
    // fix may go unseen.
    assert!((740..960).contains(&gaps), "{gaps}");
    assert!((missing as f64 / 200_000.0 / (3.0 / 23.0) - 1.0).abs() < 0.15, "{missing}");
}

#[test]
fn static_pressure_errs_with_the_square_of_airspeed_and_with_the_wings() {
    let mut p = SensorParameters::ideal();
    p.baro.pressure_coefficient = [0.3, 0.1, -0.2];
    p.baro.pressure_coefficient_wing = -0.4;
    let error = |air: Vector3<f64>, deployment| {
        let now = Truth { through_air: In::new(air), deployment, ..truth() };
        f64::from(sensors(&p, 1).poll(0, &now).0.altitude_m.unwrap()) - 3.0
    };
    let q = |v: f64| v * v / (2.0 * GRAVITY_M_S2);
    let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} {b}");
    let ahead = Vector3::x() * 7.0;
    // docs: 0.75 m at 7 m/s.
    assert!((error(ahead, [0.0; 2]) - 0.75).abs() < 0.01, "suction reads too high");
    close(error(-ahead, [0.0; 2]), 0.3 * q(7.0));
    close(error(Vector3::z() * 3.0, [0.0; 2]), -0.2 * q(3.0));
    close(error(Vector3::y() * 3.0, [0.0; 2]), 0.1 * q(3.0));
    // Wings turn the sign: 0.3 - 0.4, and with one of them half of it.
    close(error(ahead, [1.0; 2]), -0.1 * q(7.0));
    close(error(ahead, [0.0, 1.0]), 0.1 * q(7.0));
}

/// A ramp is read as late as the lag, at any rate of polling; a jump is followed to 1 - 1/e in it.
#[test]
fn a_barometer_lags() {
    let mut p = SensorParameters::ideal();
    (p.baro.lag_s, p.baro.timing.rate_hz) = (0.2, 100.0);
    for rate_hz in [100_u64, 300] {
        let last = |height: fn(f64) -> f64, duration_s: f64| {
            let mut sensors = sensors(&p, 1);
            let mut read = 0.0;
            for k in 0..=(duration_s * rate_hz as f64) as u64 {
                let time_us = (k * 1_000_000).div_ceil(rate_hz);
                let up = height(time_us as f64 * 1e-6);
                let now = Truth { position: In::new(Vector3::z() * -up), ..truth() };
                read = sensors.poll(time_us, &now).0.altitude_m.map_or(read, f64::from);
            }
            read
        };
        assert!((last(|t| 3.0 * t, 4.0) - 3.0 * (4.0 - 0.2)).abs() < 1e-4);
        // From the middle of the poll in which it jumps.
        let step = last(|t| f64::from(u8::from(t > 0.0)), 0.2 + 0.5 / rate_hz as f64);
        assert!((step - (1.0 - (-1.0_f64).exp())).abs() < 0.012, "{step}");
    }
}

#[test]
fn a_barometer_drifts_and_has_steps() {
    let mut p = SensorParameters::ideal();
    (p.baro.drift_m_root_s, p.baro.resolution_m) = (0.1, 0.0625);
    let mut ends = Vec::new();
    for seed in 0..500 {
        let sampled = frames(&p, seed, 50, 9);
        assert_eq!(sampled[0].altitude_m, Some(3.0));
        assert!(sampled.iter().filter_map(|f| f.altitude_m).all(|h| (h * 16.0).fract() == 0.0));
        ends.push(f64::from(sampled.last().unwrap().altitude_m.unwrap()) - 3.0);
    }
    assert!((sd(&ends) / 0.3 - 1.0).abs() < 0.13, "{}", sd(&ends));
}

#[test]
fn a_magnetometer_points_north_and_down_and_sees_the_current() {
    let compass =
        MagnetometerSensor { current_ut_per_a: [0.1, 0.0, -0.2], ..MagnetometerSensor::default() };
    let p = SensorParameters { magnetometer: Some(compass), ..SensorParameters::ideal() };
    let mut effects = Effects::none();
    effects.insert("heading_bias").unwrap().values[0] = 0.2;
    for (effects, bias) in [(Effects::none(), 0.0), (effects, 0.2)] {
        // To the east: north is to the left.
        let mut now = Truth::at_rest(In::zero(), std::f64::consts::FRAC_PI_2);
        let mut sensors = Sensors::new(p, &effects, 1);
        let frame = sensors.poll(0, &now).0;
        let field = frame.magnetic.unwrap().vector;
        assert!(
            (field.norm() - 48.0).abs() < 1e-4 && ((field.z / 48.0).asin() - 1.13).abs() < 1e-5
        );
        let heading = (-field.y).atan2(field.x);
        assert!((f64::from(heading) - std::f64::consts::FRAC_PI_2 - bias).abs() < 1e-6);
        let sampled = frame.attitude.unwrap().euler().2;
        assert!((sampled - heading).abs() < 0.01, "as the attitude is told");
        now.current_a = 20.0;
        let more = sensors.poll(20_000, &now).0.magnetic.unwrap().vector - field;
        assert!((more - Vector3::new(2.0, 0.0, -4.0)).norm() < 1e-4);
    }
}

#[test]
fn iron_is_drawn_for_each_flight() {
    let field = |hard, soft, seed| {
        let compass = MagnetometerSensor {
            hard_iron_sd_ut: hard,
            soft_iron_sd: soft,
            ..MagnetometerSensor::default()
        };
        let p = SensorParameters { magnetometer: Some(compass), ..SensorParameters::ideal() };
        frames(&p, seed, 50, 1)[0].magnetic.unwrap().vector.cast::<f64>()
    };
    let errors = |hard, soft| -> Vec<f64> {
        (0..500)
            .flat_map(|seed| (field(hard, soft, seed) - field(0.0, 0.0, seed)).data.0[0])
            .collect()
    };
    assert!((sd(&errors(2.0, 0.0)) / 2.0 - 1.0).abs() < 0.08);
    // A row of independent entries times the field: its strength counts.
    assert!((sd(&errors(0.0, 0.02)) / (0.02 * 48.0) - 1.0).abs() < 0.08);
}
