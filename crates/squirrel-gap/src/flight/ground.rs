//! When a flight touches the ground: forces of the ground are nothing that a model of the air could
//! explain.
//!
//! No log says it. A touch is a jolt, a step from one IMU sample to the next, that is larger than
//! any of the same flight well above the ground, at a time when the lowest corner of the vehicle's
//! box could be at the ground. What slides or rolls on the ground before and after need not jolt,
//! so the whole approach with a jolt in it is left out. Without height or attitude nothing is
//! found.

use super::recording::Recording;
use super::series::Span;
use nalgebra::{UnitQuaternion, Vector3};
use std::fmt::Write as _;

/// Below this clearance the vehicle may touch, m: a barometer's drift, and its lag in a fast
/// descent.
const NEAR_M: f64 = 0.4;
/// A touch is this many times the largest jolt away from the ground.
const JOLT_RATIO: f64 = 1.5;
/// Time away from the ground that shows what jolts are usual, s.
const USUAL_MIN_S: f64 = 3.0;
/// Approaches closer than this are one: a barometer is noisy, s.
const JOINED_S: f64 = 0.3;

/// The touches of a flight, in order.
///
/// * `size_body_m` - of the vehicle's box about its centre of mass
pub(super) fn touches(recording: &Recording, size_body_m: Vector3<f64>) -> Vec<Span> {
    let clearance_m = |t: f64| {
        let q = UnitQuaternion::new_normalize(recording.attitude.as_ref()?.rotation(t));
        let down = q.inverse_transform_vector(&Vector3::z());
        Some(recording.height_m(t)? - 0.5 * size_body_m.dot(&down.abs()))
    };
    let near = |t: &f64| clearance_m(*t).is_some_and(|clearance| clearance < NEAR_M);
    let mut approaches: Vec<Span> = Vec::new();
    for t in recording.specific_force.samples().map(|(t, _)| t).filter(near) {
        match approaches.last_mut() {
            Some(span) if t - span.1 < JOINED_S => span.1 = t,
            _ => approaches.push((t, t)),
        }
    }
    let mut touches = vec![false; approaches.len()];
    for series in [&recording.specific_force, &recording.omega] {
        let longest_s = 2.0 * series.median_period_s();
        let (mut usual, mut usual_s) = (0.0_f64, 0.0);
        let mut worst = vec![0.0_f64; approaches.len()];
        let mut before: Option<(f64, Vector3<f64>)> = None;
        for (t, row) in series.samples() {
            let now = Vector3::from_column_slice(row);
            if let Some((before_s, value)) = before.replace((t, now))
                && t - before_s <= longest_s
            {
                let jolt = (now - value).norm();
                let next = approaches.partition_point(|span| span.1 < t);
                if approaches.get(next).is_some_and(|span| span.0 <= t) {
                    worst[next] = worst[next].max(jolt);
                } else {
                    usual = usual.max(jolt);
                    usual_s += t - before_s;
                }
            }
        }
        for (touch, worst) in touches.iter_mut().zip(worst) {
            *touch |= usual_s >= USUAL_MIN_S && worst > JOLT_RATIO * usual;
        }
    }
    let found = approaches.into_iter().zip(touches).filter(|(_, touch)| *touch);
    found.map(|(span, _)| span).collect()
}

/// The times outside of spans that are in order.
pub(super) fn outside(spans: &[Span]) -> Vec<Span> {
    let starts = std::iter::once(f64::NEG_INFINITY).chain(spans.iter().map(|s| s.1));
    let ends = spans.iter().map(|s| s.0).chain(std::iter::once(f64::INFINITY));
    starts.zip(ends).collect()
}

/// The touches, in words.
pub(super) fn note(flight: &str, spans: &[Span]) -> String {
    let mut text = format!("{flight}: touches the ground; left out:");
    for (i, (from_s, to_s)) in spans.iter().enumerate() {
        let comma = if i == 0 { "" } else { "," };
        // Writing into a string cannot fail.
        let _ = write!(text, "{comma} {from_s:.2} to {to_s:.2} s");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::filter::CUTOFF_HZ;
    use crate::flight::inertial::Common;
    use squirrel_log::FlightLog;
    use squirrel_sim::vehicle_file::VehicleFile;

    /// Ten seconds, low from 6 to 8 s; a jolt at a time, of a size.
    fn flight(jolt: f64, at_s: f64) -> FlightLog {
        let mut log = FlightLog::default();
        for k in 0..3000 {
            let t = f64::from(k) / 300.0;
            let wiggle = 0.1 * (37.0 * t).sin();
            let up = if (t - at_s).abs() < 1e-3 { -9.8 - jolt } else { -9.8 };
            log.source_mut("imu").push(
                t,
                &[
                    ("omega_body_rad_s", &[wiggle, 0.0, 0.0]),
                    ("specific_force_body_m_s2", &[0.0, 0.0, up + wiggle]),
                ],
            );
            log.source_mut("attitude").push(t, &[("q_ned_from_body_wxyz", &[1.0, 0.0, 0.0, 0.0])]);
            log.source_mut("rotor").push(t, &[("command", &[0.6; 4])]);
            if k % 10 == 0 {
                log.source_mut("baro")
                    .push(t, &[("altitude_m", &[if (6.0..8.0).contains(&t) { 0.2 } else { 3.0 }])]);
            }
        }
        log
    }

    fn pieces(log: &FlightLog) -> (Vec<Span>, Vec<String>) {
        let vehicle = VehicleFile::squirrel();
        let common = Common { cutoff_hz: CUTOFF_HZ, rotor_speeds: false };
        let recording = Recording::new(&vehicle, "f", log, common).unwrap();
        (recording.pieces, recording.notes)
    }

    #[test]
    fn an_approach_with_a_jolt_is_a_touch_and_is_left_out() {
        let (pieces, notes) = pieces(&flight(5.0, 7.0));
        assert_eq!(pieces.len(), 2, "{pieces:?}");
        assert!((pieces[0].1 - 6.0).abs() < 0.05 && (pieces[1].0 - 8.0).abs() < 0.05, "{pieces:?}");
        assert!(
            notes.iter().any(|n| n.starts_with("f: touches the ground; left out: 6.00 to 7.97 s")),
            "{notes:?}"
        );
    }

    #[test]
    fn jolts_high_up_and_small_ones_are_flight() {
        for log in [flight(5.0, 3.0), flight(0.0, 7.0)] {
            let (pieces, notes) = pieces(&log);
            assert_eq!(pieces.len(), 1, "{pieces:?}");
            assert!(!notes.iter().any(|n| n.contains("touches")), "{notes:?}");
        }
    }

    #[test]
    fn outside_of_touches_is_flight() {
        assert_eq!(outside(&[]), [(f64::NEG_INFINITY, f64::INFINITY)]);
        assert_eq!(
            outside(&[(1.0, 2.0), (3.0, 4.0)]),
            [(f64::NEG_INFINITY, 1.0), (2.0, 3.0), (4.0, f64::INFINITY)]
        );
    }
}
