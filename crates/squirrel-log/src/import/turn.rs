//! Vectors that an attitude of the log takes from the world into the body, or back.

use super::error::ImportError;
use super::map::{ImportMap, SourceMap, Turn};
use super::report::ImportReport;
use crate::FlightLog;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// How far from a vector's time the attitudes that turn it may be, s: a body that turns at 10 rad/s
/// is a radian further by then, and slower logs say little.
const ATTITUDE_APART_MAX_S: f64 = 0.1;

/// Turns the channels that the map says, which are in NED or FRD already.
///
/// Between two attitudes the nearer of the two ways round is taken, at constant speed. A vector
/// without an attitude within 0.1 s on either side is missing (NaN).
///
/// # Errors
/// [`ImportError::MapField`]: no attitude is near any vector of a channel.
pub(super) fn turn(
    log: &mut FlightLog,
    report: &mut ImportReport,
    map: &ImportMap,
    sources: &[SourceMap],
) -> Result<(), ImportError> {
    for (index, source) in sources.iter().enumerate() {
        for channel in &source.channels {
            let Some(turn) = &channel.turn else { continue };
            let field = format!("source {}, `{}`", index + 1, channel.name);
            let error = |problem| ImportError::MapField { map: map.name.clone(), field, problem };
            let Some((time_s, attitude)) = log.channel(&turn.by) else {
                return Err(error(format!("turned_by: the log has no `{}`", turn.by)));
            };
            let attitudes = Attitudes::new(time_s, &attitude.values);
            // The channel may be absent where it is optional.
            let Some((time_s, vectors)) = log.channel(&channel.name) else { continue };
            let mut values = vectors.values.clone();
            for (t, vector) in time_s.iter().zip(values.chunks_exact_mut(3)) {
                let turned = attitudes.at(*t).map(|q| turned(turn, q, vector));
                vector.copy_from_slice(&turned.unwrap_or([f64::NAN; 3]));
            }
            if values.iter().all(|x| x.is_nan()) {
                return Err(error(format!(
                    "turned_by: no `{}` within {ATTITUDE_APART_MAX_S} s of any sample",
                    turn.by
                )));
            }
            let missing = values.chunks_exact(3).filter(|v| v.iter().any(|x| x.is_nan())).count();
            let reports = report.channels.iter_mut();
            for report in reports.filter(|report| report.channel == channel.name) {
                // A source with times of all its channels has NaN at those of the others.
                report.samples_missing = (missing + report.samples).saturating_sub(time_s.len());
            }
            let (group, name) = channel.name.rsplit_once('.').unwrap_or(("", &channel.name));
            let own = log.sources.get_mut(group).and_then(|own| own.channels.get_mut(name));
            if let Some(own) = own {
                own.values = values;
            }
        }
    }
    Ok(())
}

/// * `q` - ned_from_body
fn turned(turn: &Turn, q: UnitQuaternion<f64>, vector: &[f64]) -> [f64; 3] {
    let vector = Vector3::new(vector[0], vector[1], vector[2]);
    let gravity_ned = Vector3::new(0.0, 0.0, turn.gravity_m_s2);
    if turn.into_body {
        // What an accelerometer feels is all but gravity.
        (q.inverse() * (vector - gravity_ned)).into()
    } else {
        (q * vector + gravity_ned).into()
    }
}

/// Attitudes that are known, in order of time.
struct Attitudes {
    time_s: Vec<f64>,
    q: Vec<UnitQuaternion<f64>>,
}

impl Attitudes {
    fn new(time_s: &[f64], values: &[f64]) -> Self {
        let known = time_s.iter().zip(values.chunks_exact(4)).filter(|(_, q)| !q[0].is_nan());
        let (time_s, q) = known
            .map(|(t, q)| {
                (*t, UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3])))
            })
            .unzip();
        Self { time_s, q }
    }

    fn at(&self, t: f64) -> Option<UnitQuaternion<f64>> {
        let after = self.time_s.partition_point(|own| *own < t);
        let near = |i: usize| (self.time_s[i] - t).abs() <= ATTITUDE_APART_MAX_S;
        if after < self.q.len() && self.time_s[after] == t {
            return Some(self.q[after]);
        }
        if after == 0 || after == self.q.len() || !near(after - 1) || !near(after) {
            return None;
        }
        let [from_s, to_s] = [self.time_s[after - 1], self.time_s[after]];
        let share = (t - from_s) / (to_s - from_s);
        let (from, to) = (self.q[after - 1], self.q[after]);
        // Half a turn apart, either way is as good.
        Some(from.try_slerp(&to, share, 1e-9).unwrap_or(from))
    }
}
