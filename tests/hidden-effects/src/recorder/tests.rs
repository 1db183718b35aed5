use super::*;
use crate::case::Case;
use crate::set::Set;

/// The flight of a case with its truth, and as it is written down.
fn both(set: Set, index: usize) -> (FlightLog, FlightLog) {
    let case = Case::draw(set, index, 1);
    (case.flown(0).unwrap(), case.flight(0).unwrap())
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64).sqrt()
}

/// The delay at which velocities at 50 Hz fit best, s: the bottom of their mean squared difference,
/// on a parabola.
fn delay_s(truth: &[Vector3<f64>], late: &[Vector3<f64>]) -> f64 {
    let at = |shift: usize| -> f64 {
        (10..truth.len()).map(|k| (truth[k - shift] - late[k]).xy().norm_squared()).sum()
    };
    let curve: Vec<f64> = (0..10).map(at).collect();
    let bottom = (1..9).min_by(|a, b| curve[*a].total_cmp(&curve[*b])).unwrap();
    let (before, here, after) = (curve[bottom - 1], curve[bottom], curve[bottom + 1]);
    (bottom as f64 + 0.5 * (before - after) / (before - 2.0 * here + after)) / 50.0
}

#[test]
fn estimates_lean_by_their_size_and_are_fifty_milliseconds_late() {
    // Cases 1 and 3 hide nothing; each generator flies one.
    for index in [1, 3] {
        let (flown, log) = both(Set::Estimates, index);
        let Recorder::Estimator(filter) = Case::draw(Set::Estimates, index, 1).answer.recorder
        else {
            panic!("an estimator records")
        };
        assert!((0.5..1.5).contains(&filter.tilt_rad.to_degrees()));
        let truth = &flown.sources[TRUTH];
        let errors: Vec<_> = (0..3900)
            .map(|k| estimator::tilt_and_heading(&log, truth, 0.01 * f64::from(k) + 0.5))
            .collect();
        let [tilt, heading] = [0, 1].map(|which| {
            rms(&errors.iter().map(|e| if which == 0 { e.0 } else { e.1 }).collect::<Vec<_>>())
                .to_degrees()
        });
        // What the sensors' own attitude wanders by comes on top.
        assert!((tilt / filter.tilt_rad.to_degrees() - 1.0).abs() < 0.25, "{index}: {tilt} deg");
        assert!((1.0..3.5).contains(&heading), "{index}: {heading} deg");

        let estimate = &log.sources["gnss"];
        let series = |source: &Source| -> Vec<_> {
            (50..1950).map(|k| vector(source, "velocity_ned_m_s", 0.02 * f64::from(k))).collect()
        };
        let delay = delay_s(&series(truth), &series(estimate));
        assert!((delay - estimator::DELAY_S).abs() < 0.005, "{index}: {delay} s");
        assert!(!log.sources.contains_key(TRUTH));
    }
}

#[test]
fn tilt_errors_follow_the_acceleration() {
    let (flown, log) = both(Set::Estimates, 1);
    let (truth, estimates) = (&flown.sources[TRUTH], &log.sources["attitude"]);
    let channel = "q_ned_from_body_wxyz";
    let (mut product, mut squares) = (0.0, [0.0; 2]);
    let mut slow = Vector3::zeros();
    for k in 0..3900 {
        let time_s = 0.01 * f64::from(k);
        let rate = (vector(truth, "velocity_ned_m_s", time_s + 0.01)
            - vector(truth, "velocity_ned_m_s", time_s))
            / 0.01;
        slow += (Vector3::z().cross(&rate) - slow) * 0.005;
        let error =
            attitude(estimates, channel, time_s) * attitude(truth, channel, time_s).inverse();
        let error = error.scaled_axis();
        product += slow.xy().dot(&error.xy());
        squares[0] += slow.xy().norm_squared();
        squares[1] += error.xy().norm_squared();
    }
    let correlation = product / (squares[0] * squares[1]).sqrt();
    assert!(correlation > 0.8, "{correlation}");
}

#[test]
fn captures_hold_poses_commands_and_voltage_only() {
    for index in 0..8 {
        let (flown, log) = both(Set::Capture, index);
        let Recorder::Capture(capture) = Case::draw(Set::Capture, index, 1).answer.recorder else {
            panic!("a motion capture records")
        };
        let names: Vec<_> = log.sources.keys().map(String::as_str).collect();
        assert_eq!(names, ["attitude", "battery", "gnss", "rotor", "wing"]);
        assert!(
            log.channel("battery.current_a").is_none()
                && log.channel("battery.voltage_v").is_some()
        );
        assert_eq!(log.channel("gnss.velocity_ned_m_s").is_some(), capture.has_velocity);
        let (times, positions) = log.channel("gnss.position_ned_m").unwrap();
        assert!((3950..4001).contains(&times.len()));
        let off = |k: usize| {
            Vector3::from_column_slice(positions.row(k))
                - vector(&flown.sources[TRUTH], "position_ned_m", times[k])
        };
        let all: Vec<f64> = (0..times.len()).flat_map(|k| off(k).as_slice().to_vec()).collect();
        assert!((5e-4..1e-3).contains(&capture.position_m));
        assert!(
            (rms(&all) / capture.position_m - 1.0).abs() < 0.1,
            "{} for {}",
            rms(&all),
            capture.position_m
        );
    }
}

#[test]
fn faults_have_their_size() {
    for index in 0..10 {
        let case = Case::draw(Set::Sensors, index, 1);
        let Recorder::Faulty(fault) = case.answer.recorder else { panic!("a sensor errs") };
        let (flown, log) = (case.flown(0).unwrap(), case.flight(0).unwrap());
        let row =
            |log: &FlightLog, name: &str, k: usize| log.channel(name).unwrap().1.row(k).to_vec();
        let (gyro, accel) = ("imu.omega_body_rad_s", "imu.specific_force_body_m_s2");
        match fault {
            SensorFault::GyroScale { scale_fraction } => {
                assert!(scale_fraction.iter().all(|s| (0.02..0.06).contains(&s.abs())));
                let ratio = row(&log, gyro, 999)[1] / row(&flown, gyro, 999)[1];
                assert!((ratio - 1.0 - scale_fraction[1]).abs() < 1e-9);
            }
            SensorFault::AccelScale { scale_fraction } => {
                assert!(scale_fraction.iter().all(|s| (0.01..0.04).contains(&s.abs())));
                let ratio = row(&log, accel, 999)[2] / row(&flown, accel, 999)[2];
                assert!((ratio - 1.0 - scale_fraction[2]).abs() < 1e-9);
            }
            SensorFault::CompassCurrent { heading_rad_per_a } => {
                let [current_a] = at::<1>(&flown.sources["battery"], "current_a", 3.0);
                let q = |log: &FlightLog| {
                    attitude(&log.sources["attitude"], "q_ned_from_body_wxyz", 3.0)
                };
                let turned = (q(&log) * q(&flown).inverse()).scaled_axis().z;
                assert!((turned / (heading_rad_per_a * current_a) - 1.0).abs() < 0.02, "{turned}");
            }
            SensorFault::ClockStep { step_s, at_s } => {
                let late = |k: usize| {
                    let time_s = k as f64 / 300.0;
                    let source = &flown.sources["rotor"];
                    let before =
                        source.time_s.partition_point(|t| *t <= time_s - step_s + 1e-9) - 1;
                    row(&log, "rotor.command", k) == row(&flown, "rotor.command", before)
                };
                assert!((0.02..0.1).contains(&step_s.abs()));
                assert!(at_s < 30.0 && (300 * 32..300 * 38).step_by(97).all(late));
                let early = 300 * 9;
                assert_eq!(row(&log, "rotor.command", early), row(&flown, "rotor.command", early));
            }
            SensorFault::GyroDrift { drift_rad_s2 } => {
                let off = row(&log, gyro, 6000)[0] - row(&flown, gyro, 6000)[0];
                let time_s = log.sources["imu"].time_s[6000];
                assert!((off - drift_rad_s2[0] * time_s).abs() < 1e-9);
            }
        }
    }
}
