//! Rates, latencies, streams, and that the readings of old flights stay what they were.

mod files;
mod inertial;
mod models;

use super::*;

fn truth() -> Truth {
    Truth {
        velocity: In::new(Vector3::new(4.0, 5.0, 6.0)),
        omega: In::new(Vector3::new(0.1, 0.2, 0.3)),
        specific_force: In::new(Vector3::new(0.0, 0.0, -9.8)),
        voltage_v: 15.0,
        current_a: 10.0,
        ..Truth::at_rest(In::new(Vector3::new(1.0, 2.0, -3.0)), 0.0)
    }
}

fn sensors(p: &SensorParameters, seed: u64) -> Sensors {
    p.check().unwrap();
    Sensors::new(*p, &Effects::none(), seed)
}

/// Everything that is said in a time of the same truth, polled at a rate.
fn frames(p: &SensorParameters, seed: u64, rate_hz: u64, duration_s: u64) -> Vec<SensorFrame> {
    let mut sensors = sensors(p, seed);
    (0..rate_hz * duration_s).map(|k| sensors.poll(k * 1_000_000 / rate_hz, &truth()).0).collect()
}

fn mean(list: &[f64]) -> f64 {
    list.iter().sum::<f64>() / list.len() as f64
}

fn sd(list: &[f64]) -> f64 {
    let middle = mean(list);
    mean(&list.iter().map(|x| (x - middle).powi(2)).collect::<Vec<_>>()).sqrt()
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let (of_a, of_b) = (mean(a), mean(b));
    mean(&a.iter().zip(b).map(|(x, y)| (x - of_a) * (y - of_b)).collect::<Vec<_>>())
        / (sd(a) * sd(b))
}

#[test]
fn each_sensor_speaks_at_its_rate_and_after_its_latency() {
    let mut p = SensorParameters::ideal();
    p.gnss.timing = Timing { rate_hz: 10.0, latency_s: 0.15, seed: None };
    let mut sensors = sensors(&p, 1);
    let (mut imu, mut fixes) = (0_i32, Vec::new());
    for k in 0..3000u64 {
        let time_us = k * 1000 / 3;
        let mut now = truth();
        now.position = In::new(Vector3::new(time_us as f64 * 1e-6, 0.0, 0.0));
        let (frame, _) = sensors.poll(time_us, &now);
        imu += i32::from(frame.imu.is_some());
        if let Some(gnss) = frame.gnss {
            fixes.push((time_us, gnss.position.vector.x));
        }
    }
    assert!((imu - 300).abs() <= 1, "{imu} samples in a second at 300 Hz");
    assert_eq!(fixes.len(), 9);
    for (time_us, north) in fixes {
        let age = time_us as f64 * 1e-6 - f64::from(north);
        assert!((age - 0.15).abs() < 1e-3, "a fix is as old as its latency");
    }
}

#[test]
fn ideal_sensors_tell_the_truth() {
    let (frame, logged) = sensors(&SensorParameters::ideal(), 1).poll(0, &truth());
    assert_eq!(frame.gnss.unwrap().velocity.vector, Vector3::new(4.0, 5.0, 6.0));
    assert_eq!(frame.altitude_m, Some(3.0));
    assert_eq!(frame.imu.unwrap().omega.vector, Vector3::new(0.1, 0.2, 0.3));
    assert_eq!((logged[0].0, logged[0].1[0]), ("battery", ("voltage_v", 15.0)));
    assert_eq!((frame.imu_2, frame.magnetic), (None, None), "not there unless asked for");
}

#[test]
fn noise_has_its_size_and_bias_its_place() {
    let mut p = SensorParameters::ideal();
    p.baro.noise_m = 0.2;
    p.baro.bias_m = 1.0;
    p.baro.timing.rate_hz = 1000.0;
    let read: Vec<f64> = frames(&p, 3, 1000, 20)
        .iter()
        .filter_map(|f| f.altitude_m)
        .map(|a| f64::from(a) - 3.0)
        .collect();
    assert!((mean(&read) - 1.0).abs() < 0.01 && (sd(&read) - 0.2).abs() < 0.005);
}

/// One sensor's errors do not shift another's stream, nor does one error another of the same
/// sensor.
#[test]
fn streams_are_independent() {
    let base = || SensorParameters::suite("nominal").unwrap();
    let sampled = |p: &SensorParameters| frames(p, 5, 300, 2);
    let quiet = sampled(&base());
    let (mut baro, mut all) = (base(), SensorParameters::suite("hobby").unwrap());
    (baro.baro.noise_m, baro.baro.drift_m_root_s, baro.baro.lag_s) = (1.0, 0.1, 0.1);
    (all.attitude, all.logged, all.imu) = (base().attitude, base().logged, base().imu);
    (all.gnss.dropouts_per_s, all.gnss.dropout_s) = (10.0, 0.1);
    for (a, b) in quiet.iter().zip(sampled(&baro)) {
        assert_eq!((a.imu, a.imu_2, a.gnss, a.magnetic), (b.imu, b.imu_2, b.gnss, b.magnetic));
    }
    for (a, b) in quiet.iter().zip(sampled(&all)) {
        assert_eq!((a.imu, a.imu_2, a.attitude), (b.imu, b.imu_2, b.attitude));
    }
    let mut dropping = base();
    (dropping.gnss.dropouts_per_s, dropping.gnss.dropout_s) = (2.0, 0.2);
    let heard: Vec<_> = sampled(&dropping)
        .iter()
        .zip(&quiet)
        .filter_map(|(b, a)| b.gnss.map(|b| (Some(b), a.gnss)))
        .collect();
    assert!(
        heard.len() < 20 && heard.iter().all(|(b, a)| a == b),
        "what is left of the fixes is the same"
    );
}

#[test]
fn same_seed_same_bits_and_another_seed_others() {
    for name in SUITES {
        let sampled = |seed| frames(&SensorParameters::suite(name).unwrap(), seed, 300, 2);
        assert_eq!(sampled(8), sampled(8), "{name}");
        assert!(sampled(8)[0] != sampled(9)[0], "{name}");
    }
}

/// Hashes of what the sensors said before there were second units, wander and the rest: old seeds
/// fly old flights.
#[test]
fn readings_of_old_flights_keep_their_bits() {
    let mut p = SensorParameters::default();
    p.imu.timing.seed = Some(9);
    p.imu.gyro_bias_rad_s = [0.01, -0.02, 0.03];
    p.baro.bias_m = 0.4;
    p.gnss.timing.latency_s = 0.15;
    let mut effects = Effects::none();
    effects.insert("heading_bias").unwrap().values[0] = 0.1;
    effects.insert("accel_bias").unwrap().values[..3].copy_from_slice(&[0.1, 0.2, 0.3]);
    let cases = [
        (SensorParameters::default(), Effects::none(), 42, 0xcceb_c0b3_0a7d_8b53),
        (p, effects, 7, 0x648e_2c35_8725_251a),
    ];
    for (p, effects, seed, before) in cases {
        let mut sensors = Sensors::new(p, &effects, seed);
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        let mut eat = |bits: u64| hash = (hash ^ bits).wrapping_mul(0x0100_0000_01b3);
        for k in 0..900_u64 {
            let (frame, logged) = sensors.poll(k * 10_000 / 3, &truth());
            let mut single = Vec::new();
            if let Some(imu) = frame.imu {
                single.extend(imu.omega.vector.iter().chain(&imu.specific_force.vector));
            }
            if let Some(q) = frame.attitude {
                single.extend(q.wxyz());
            }
            if let Some(fix) = frame.gnss {
                single.extend(fix.position.vector.iter().chain(&fix.velocity.vector));
            }
            single.extend(frame.altitude_m);
            for x in single {
                eat(x.to_bits().into());
            }
            for (_, number) in logged.into_iter().flat_map(|(_, row)| row) {
                eat(number.to_bits());
            }
        }
        assert_eq!(hash, before, "seed {seed}");
    }
}

/// The second at rest has the flight's biases and other noise, and costs the flight nothing.
#[test]
fn a_second_at_rest_tells_of_the_flight_and_leaves_it_alone() {
    let mut p = SensorParameters::suite("research").unwrap();
    p.gnss.timing.latency_s = 0.0;
    let mut flown = sensors(&p, 4);
    let untouched = flown.clone();
    let at = In::new(Vector3::new(7.0, -2.0, 0.0));
    let rest = flown.at_rest(at, 0.5);
    assert_eq!(rest.len(), 300);
    assert_eq!(rest, flown.at_rest(at, 0.5));
    let still = Truth::at_rest(at, 0.5);
    let mut copy = untouched;
    let flight: Vec<_> = (0..300).map(|k: u64| flown.poll(k * 10_000 / 3, &still).0).collect();
    assert!((0..300).all(|k: u64| copy.poll(k * 10_000 / 3, &still).0 == flight[k as usize]));
    let rate = |list: &[SensorFrame]| -> Vec<f64> {
        list.iter().filter_map(|f| f.imu).map(|i| f64::from(i.omega.vector.x)).collect()
    };
    let (before, later) = (rate(&rest), rate(&flight));
    // White noise of 8e-4 rad/s a sample, and a walk of 5e-5 rad/s in the second.
    assert!((mean(&before) - mean(&later)).abs() < 3e-4, "the bias is the same");
    assert!(correlation(&before, &later).abs() < 0.2, "the noise is not");
    let fix = |list: &[SensorFrame]| list.iter().find_map(|f| f.gnss).unwrap().position.vector;
    assert!(
        (fix(&rest) - fix(&flight)).norm() < 0.4 && (fix(&rest) - at.vector.cast()).norm() > 0.2
    );
    let heading = rest[0].attitude.unwrap().euler().2;
    assert!((heading - 0.5).abs() < 0.02);
}
