//! Planned motion in memory and in a log: what to be where, how the rotors shall push, and how far
//! the wings shall be spread.
//!
//! In a log it is the source `plan`. Any log with `reference.position_ned_m`,
//! `reference.velocity_ned_m_s` and `reference.acceleration_ned_m_s2` will do too: then the rotors
//! give all of the acceleration, and wings stay folded.

use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::nalgebra::Vector3;
use squirrel_log::FlightLog;

/// Source of a plan in a log.
const PLAN: &str = "plan";
/// Source of what a flight was asked to follow.
const REFERENCE: &str = "reference";
/// Shortest motion to follow, s.
const SHORTEST_S: f64 = 0.1;
/// Largest number of any kind that a plan may hold.
const LARGEST: f64 = 1e5;

/// Why a log is no motion to follow; one line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrackError {
    /// No source of a motion.
    #[error("has neither a `plan` nor a `reference` to follow")]
    Nothing,
    /// Not even a beginning and an end.
    #[error("{from}: has {samples} samples, must have at least 2")]
    Samples {
        /// Source in the log.
        from: &'static str,
        /// How many there are.
        samples: usize,
    },
    /// Over at once.
    #[error("{from}: lasts {duration_s} s, must last {SHORTEST_S} s or more")]
    Short {
        /// Source in the log.
        from: &'static str,
        /// From the first to the last sample, s.
        duration_s: f64,
    },
    /// A channel is missing.
    #[error("lacks {0}")]
    Lacks(String),
    /// A channel of another width.
    #[error("{channel}: has {given} numbers a sample, must have {needed}")]
    Width {
        /// Its name.
        channel: String,
        /// Numbers a sample.
        given: usize,
        /// What it must have.
        needed: usize,
    },
    /// A number that cannot be flown.
    #[error("{channel} = {value} at {time_s} s: must be finite and within {largest}")]
    Value {
        /// Its channel.
        channel: String,
        /// The number.
        value: f64,
        /// When, s.
        time_s: f64,
        /// The limit.
        largest: f64,
    },
}

/// A planned motion at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackPoint {
    /// NED, m.
    pub position: Vector3<f64>,
    /// NED, m/s.
    pub velocity: Vector3<f64>,
    /// NED, m/s^2.
    pub acceleration: Vector3<f64>,
    /// Force of the rotors, NED, N.
    pub thrust: Vector3<f64>,
    /// Deployment of the wings, 0 folded to 1 spread.
    pub wing: f64,
}

/// A planned motion: points in time, accelerations, forces and wings linear between them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Track {
    time_s: Vec<f64>,
    points: Vec<TrackPoint>,
}

impl Track {
    /// Points at equal steps, the first at time 0.
    pub fn even(step_s: f64, points: Vec<TrackPoint>) -> Self {
        Self { time_s: (0..points.len()).map(|k| k as f64 * step_s).collect(), points }
    }

    /// Times of the points, s.
    pub fn time_s(&self) -> &[f64] {
        &self.time_s
    }

    /// The points.
    pub fn points(&self) -> &[TrackPoint] {
        &self.points
    }

    /// Time of the last point, s; 0 without points.
    pub fn end_s(&self) -> f64 {
        self.time_s.last().copied().unwrap_or(0.0)
    }

    /// The motion at a time; the first point before it begins, the last after its end. `None`
    /// without points.
    pub fn at(&self, time_s: f64) -> Option<TrackPoint> {
        let next = self.time_s.partition_point(|t| *t <= time_s);
        let (Some(k), true) = (next.checked_sub(1), next < self.points.len()) else {
            return self.points.get(next.saturating_sub(1)).copied();
        };
        let (a, b) = (&self.points[k], &self.points[next]);
        let (h, s) = (self.time_s[next] - self.time_s[k], time_s - self.time_s[k]);
        let jerk = (b.acceleration - a.acceleration) / h;
        Some(TrackPoint {
            position: a.position
                + a.velocity * s
                + a.acceleration * (s * s / 2.0)
                + jerk * (s * s * s / 6.0),
            velocity: a.velocity + a.acceleration * s + jerk * (s * s / 2.0),
            acceleration: a.acceleration + jerk * s,
            thrust: a.thrust + (b.thrust - a.thrust) * (s / h),
            wing: a.wing + (b.wing - a.wing) * (s / h),
        })
    }

    /// As the source `plan` of a log.
    pub fn record(&self, log: &mut FlightLog) {
        for (time_s, point) in self.time_s.iter().zip(&self.points) {
            log.source_mut(PLAN).push(
                *time_s,
                &[
                    ("position_ned_m", point.position.as_slice()),
                    ("velocity_ned_m_s", point.velocity.as_slice()),
                    ("acceleration_ned_m_s2", point.acceleration.as_slice()),
                    ("thrust_ned_n", point.thrust.as_slice()),
                    ("wing", &[point.wing]),
                ],
            );
        }
    }

    /// Of a log: its plan, or its reference.
    ///
    /// * `mass_kg` - of what shall fly it
    ///
    /// # Errors
    /// One line that names the channel, the sample and its value.
    pub fn of(log: &FlightLog, mass_kg: f64) -> Result<Self, TrackError> {
        let is_plan = log.sources.contains_key(PLAN);
        let source = if is_plan { PLAN } else { REFERENCE };
        let time_s = match log.sources.get(source) {
            Some(source) => source.time_s.clone(),
            None => return Err(TrackError::Nothing),
        };
        let (Some(first), Some(last), true) = (time_s.first(), time_s.last(), time_s.len() > 1)
        else {
            return Err(TrackError::Samples { from: source, samples: time_s.len() });
        };
        let first = *first;
        if !(last - first >= SHORTEST_S) {
            return Err(TrackError::Short { from: source, duration_s: last - first });
        }
        let column = |channel: &str, width: usize, largest: f64| {
            let name = format!("{source}.{channel}");
            let Some((_, found)) = log.channel(&name) else { return Err(TrackError::Lacks(name)) };
            if found.width != width {
                return Err(TrackError::Width { channel: name, given: found.width, needed: width });
            }
            match found.values.iter().position(|x| !(x.abs() <= largest)) {
                Some(i) => {
                    let (time_s, value) = (time_s[i / width], found.values[i]);
                    Err(TrackError::Value { channel: name, value, time_s, largest })
                }
                None => Ok(found),
            }
        };
        let vector = |channel: &str| {
            let found = column(channel, 3, LARGEST)?;
            Ok::<_, TrackError>(
                found.values.chunks_exact(3).map(Vector3::from_column_slice).collect::<Vec<_>>(),
            )
        };
        let (position, velocity) = (vector("position_ned_m")?, vector("velocity_ned_m_s")?);
        let acceleration = vector("acceleration_ned_m_s2")?;
        let thrust = if is_plan {
            vector("thrust_ned_n")?
        } else {
            acceleration.iter().map(|a| (a - Vector3::z() * GRAVITY_M_S2) * mass_kg).collect()
        };
        let wing =
            if is_plan { column("wing", 1, 1.0)?.values.clone() } else { vec![0.0; time_s.len()] };
        let points = (0..time_s.len()).map(|k| TrackPoint {
            position: position[k],
            velocity: velocity[k],
            acceleration: acceleration[k],
            thrust: thrust[k],
            wing: wing[k].max(0.0),
        });
        // A piece of a longer log begins when it is flown.
        Ok(Self { points: points.collect(), time_s: time_s.iter().map(|t| t - first).collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quarter turn at changing speed, every tenth of a second.
    fn track() -> Track {
        let point = |k: u32| {
            let t = f64::from(k) * 0.1;
            let v = Vector3::new(t * t, 1.0, -0.1);
            TrackPoint {
                position: Vector3::new(t * t * t / 3.0, t, -30.0 - 0.1 * t),
                velocity: v,
                acceleration: Vector3::new(2.0 * t, 0.0, 0.0),
                thrust: Vector3::new(t, 0.0, -5.0),
                wing: (0.5 * t).min(1.0),
            }
        };
        Track::even(0.1, (0..=20).map(point).collect())
    }

    /// Between points the motion is the one whose acceleration is linear, and its own derivative.
    #[test]
    fn between_points_the_motion_goes_on() {
        let track = track();
        for k in 0..200 {
            let t = f64::from(k) * 0.01;
            let at = track.at(t).unwrap();
            assert!(
                (at.position.x - t * t * t / 3.0).abs() < 1e-12
                    && (at.velocity.x - t * t).abs() < 1e-12
            );
            assert!((at.thrust.x - t).abs() < 1e-12 && (at.wing - 0.5 * t).abs() < 1e-12);
        }
        assert_eq!(track.at(99.0).unwrap(), *track.points().last().unwrap());
        assert_eq!(track.at(-1.0).unwrap(), track.points()[0]);
        assert_eq!(Track::default().at(0.0), None);
    }

    #[test]
    fn a_log_keeps_every_bit_and_a_reference_will_do() {
        let mut log = FlightLog::default();
        track().record(&mut log);
        assert_eq!(Track::of(&log, 0.5).unwrap(), track());
        let mut log = FlightLog::default();
        for (t, p) in track().time_s().iter().zip(track().points()) {
            let rows: [(&str, &[f64]); 3] = [
                ("position_ned_m", p.position.as_slice()),
                ("velocity_ned_m_s", p.velocity.as_slice()),
                ("acceleration_ned_m_s2", p.acceleration.as_slice()),
            ];
            log.source_mut("reference").push(*t, &rows);
        }
        let read = Track::of(&log, 0.5).unwrap();
        let push = read.points()[10].thrust;
        assert!((push - Vector3::new(1.0, 0.0, -0.5 * GRAVITY_M_S2)).norm() < 1e-12, "{push}");
        assert_eq!(read.points()[10].wing, 0.0);
    }

    #[test]
    fn what_cannot_be_followed_is_named() {
        let broken = |change: &dyn Fn(&mut FlightLog)| {
            let mut log = FlightLog::default();
            track().record(&mut log);
            change(&mut log);
            Track::of(&log, 0.5).unwrap_err().to_string()
        };
        let channel = |log: &mut FlightLog, name: &str, i: usize, x: f64| {
            log.source_mut("plan").channels.get_mut(name).unwrap().values[i] = x;
        };
        let error = broken(&|log| channel(log, "thrust_ned_n", 31, f64::NAN));
        assert!(error.starts_with("plan.thrust_ned_n = NaN at 1 s"), "{error}");
        let error = broken(&|log| channel(log, "wing", 3, 1.5));
        assert!(error.starts_with("plan.wing = 1.5"), "{error}");
        let error = broken(&|log| {
            log.source_mut("plan").channels.remove("velocity_ned_m_s");
        });
        assert_eq!(error, "lacks plan.velocity_ned_m_s");
        let error = broken(&|log| log.sources.clear());
        assert!(error.contains("neither"), "{error}");
    }
}
