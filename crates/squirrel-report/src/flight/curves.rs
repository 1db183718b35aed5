//! From a flight log to the curves of the report. What the log lacks comes back as a sentence, not
//! as a failure.

use crate::chart::drawable;
use squirrel_log::flight_code::FOLLOWED;
use squirrel_log::{Channel, FlightLog};

/// A number over time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Curve {
    /// s.
    pub(super) time_s: Vec<f64>,
    /// One number for each time, NaN where the log has none.
    pub(super) values: Vec<f64>,
}

/// A path over time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Path {
    /// s.
    pub(super) time_s: Vec<f64>,
    /// North, east, height, m.
    pub(super) points: Vec<[f64; 3]>,
}

/// How far a flight was from its reference.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Errors {
    /// s.
    pub(super) time_s: Vec<f64>,
    /// Distance, m.
    pub(super) distance_m: Vec<f64>,
    /// Horizontal distance, m.
    pub(super) horizontal_m: Vec<f64>,
    /// Height above the reference, m.
    pub(super) height_m: Vec<f64>,
}

/// What keeps a curve from being drawn: `truth.position_ned_m`, or what is wrong with it.
pub(super) type Lack = String;

/// A channel and its time axis, checked to be of this width and complete.
fn channel<'a>(
    log: &'a FlightLog,
    name: &str,
    width: usize,
) -> Result<(&'a [f64], &'a Channel), Lack> {
    let (time, channel) = log.channel(name).ok_or_else(|| name.to_owned())?;
    if time.is_empty() {
        return Err(format!("samples of {name}"));
    }
    if channel.width != width {
        return Err(format!("{name} with {width} numbers a sample (it has {})", channel.width));
    }
    if channel.values.len() != time.len() * width {
        let (values, wanted) = (channel.values.len(), time.len() * width);
        return Err(format!("{name} with {wanted} numbers (it has {values})"));
    }
    Ok((time, channel))
}

/// A curve from each row of a channel.
fn curve(
    log: &FlightLog,
    name: &str,
    width: usize,
    value: impl Fn(&[f64]) -> f64,
) -> Result<Curve, Lack> {
    let (time, channel) = channel(log, name, width)?;
    let values = (0..time.len()).map(|i| value(channel.row(i))).collect();
    Ok(Curve { time_s: time.to_vec(), values })
}

fn path(log: &FlightLog, name: &str) -> Result<Path, Lack> {
    let (time, channel) = channel(log, name, 3)?;
    let points = (0..time.len()).map(|i| channel.row(i)).map(|p| [p[0], p[1], -p[2]]).collect();
    Ok(Path { time_s: time.to_vec(), points })
}

/// The flown path.
pub(super) fn flown(log: &FlightLog) -> Result<Path, Lack> {
    path(log, "truth.position_ned_m")
}

/// The path that should have been flown.
pub(super) fn reference(log: &FlightLog) -> Result<Path, Lack> {
    path(log, &format!("{}.position_ned_m", followed(log)))
}

/// Source of what was to be followed: that of an offboard computer where it does not follow the
/// mission.
pub(super) fn followed(log: &FlightLog) -> &'static str {
    if log.sources.contains_key(FOLLOWED) { FOLLOWED } else { "reference" }
}

/// Speed over ground and in height, m/s; `source` is `truth` or what [`followed`] says.
pub(super) fn speed(log: &FlightLog, source: &str) -> Result<Curve, Lack> {
    curve(log, &format!("{source}.velocity_ned_m_s"), 3, |v| v[0].hypot(v[1]).hypot(v[2]))
}

/// Angle between body z and world z, deg.
pub(super) fn tilt_deg(log: &FlightLog) -> Result<Curve, Lack> {
    curve(log, "truth.q_ned_from_body_wxyz", 4, |q| {
        // Half angle from both its sine and its cosine: exact near level, and the norm of q drops
        // out.
        let (sin, cos) = (q[1].hypot(q[2]), q[0].hypot(q[3]));
        if sin == 0.0 && cos == 0.0 { f64::NAN } else { (2.0 * sin.atan2(cos)).to_degrees() }
    })
}

/// A channel of one number a sample.
pub(super) fn scalar(log: &FlightLog, name: &str) -> Result<Curve, Lack> {
    curve(log, name, 1, |v| v[0])
}

/// Mean of the left and the right wing.
pub(super) fn wings(log: &FlightLog, name: &str) -> Result<Curve, Lack> {
    curve(log, name, 2, |w| f64::midpoint(w[0], w[1]))
}

/// Distances to the reference at the times of the flown path; NaN outside the reference.
pub(super) fn errors(log: &FlightLog) -> Result<Errors, Lack> {
    let (flown, reference) = (flown(log)?, reference(log)?);
    let mut errors = Errors {
        time_s: flown.time_s,
        distance_m: Vec::new(),
        horizontal_m: Vec::new(),
        height_m: Vec::new(),
    };
    for (&time, p) in errors.time_s.iter().zip(&flown.points) {
        let r = reference.at(time);
        let (north, east, height) = (p[0] - r[0], p[1] - r[1], p[2] - r[2]);
        errors.horizontal_m.push(north.hypot(east));
        errors.distance_m.push(north.hypot(east).hypot(height));
        errors.height_m.push(height);
    }
    Ok(errors)
}

impl Path {
    /// Linear between samples; NaN before the first and after the last.
    fn at(&self, time_s: f64) -> [f64; 3] {
        let after = self.time_s.partition_point(|t| *t <= time_s);
        if after == 0 {
            return [f64::NAN; 3];
        }
        let (t0, p0) = (self.time_s[after - 1], self.points[after - 1]);
        if t0 == time_s {
            return p0;
        }
        let Some((t1, p1)) = self.time_s.get(after).zip(self.points.get(after)) else {
            return [f64::NAN; 3];
        };
        let share = (time_s - t0) / (t1 - t0);
        [0, 1, 2].map(|axis| p0[axis] + share * (p1[axis] - p0[axis]))
    }

    /// Index of the first point at or after each multiple of `every_s`.
    pub(super) fn marks(&self, every_s: f64) -> Vec<usize> {
        let count = |i: usize| (self.time_s[i] / every_s + 1e-6).floor();
        (1..self.time_s.len()).filter(|&i| count(i) > count(i - 1)).collect()
    }

    /// Horizontal distance flown up to each point, m; a gap counts as a straight line.
    pub(super) fn distances(&self) -> Vec<f64> {
        let (mut sum, mut last) = (0.0, None::<[f64; 2]>);
        let step = |p: &[f64; 3]| {
            let here = [p[0], p[1]];
            if here.into_iter().all(drawable) {
                sum += last.map_or(0.0, |l| (here[0] - l[0]).hypot(here[1] - l[1]));
                last = Some(here);
            }
            sum
        };
        self.points.iter().map(step).collect()
    }

    /// Distance flown where the path is nearest to a point (north, east, m); `None` for a path
    /// without points.
    pub(super) fn nearest(&self, [north, east]: [f64; 2]) -> Option<f64> {
        let away = |p: &[f64; 3]| (p[0] - north).hypot(p[1] - east);
        let distances =
            self.points.iter().map(away).zip(self.distances()).filter(|(away, _)| drawable(*away));
        distances.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, flown)| flown)
    }
}

impl Curve {
    /// Stretches of constant value: begin, end, value. A sample holds until the next one.
    pub(super) fn stretches(&self) -> Vec<(f64, f64, f64)> {
        let mut stretches: Vec<(f64, f64, f64)> = Vec::new();
        for (w, &value) in self.time_s.windows(2).zip(&self.values) {
            match stretches.last_mut() {
                Some(last) if last.1 == w[0] && last.2 == value => last.1 = w[1],
                _ => stretches.push((w[0], w[1], value)),
            }
        }
        stretches
    }
}
