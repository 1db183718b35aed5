//! What a log without a map gives: channels with their own times, put together to a flight log.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::rc::Rc;

use super::super::report::{ChannelReport, Pace};
use super::super::rows::Rows;
use crate::{Channel, FlightLog, Source};

/// How far the norm of a quaternion may be from 1 before it is no rotation.
const QUATERNION_NORM_TOLERANCE: f64 = 0.05;

/// A step beyond which a time must have the next behind it, us.
const LEAP_US: f64 = 10e6;

/// Thirty years: no clock of an autopilot says more.
const CLOCK_MAX_US: f64 = 1e15;

/// A time in us, as whole as a clock's is. In a file whose types are damaged, times may lie so close
/// together that in seconds they are one.
fn to_a_nanosecond(t: f64) -> f64 {
    if t.fract() == 0.0 { t } else { (t * 1e3).round() / 1e3 }
}

/// Messages of one topic with their times in order.
pub(super) struct Topic<'a> {
    /// As the report calls it.
    pub(super) name: String,
    rows: &'a dyn Rows,
    /// Rows whose time is after that of all before.
    kept: Vec<usize>,
    /// Of the kept rows.
    time_us: Rc<[f64]>,
    /// Rows whose time is none, repeats or runs backwards.
    pub(super) dropped: usize,
}

impl<'a> Topic<'a> {
    /// * `clock` - the columns that may have the time, the best first, and the microseconds of
    ///   their unit
    pub(super) fn new(name: &str, rows: &'a dyn Rows, clock: &[(&str, f64)]) -> Option<Self> {
        // PX4 leaves `timestamp_sample` zero where it does not know it.
        let known = |&(column, us): &(&str, f64)| {
            let time = rows.column(column)?;
            time.iter().any(|&t| t > 0.0).then_some((time, us))
        };
        let (time, us) = clock.iter().find_map(known)?;
        let (mut kept, mut time_us, mut last) = (Vec::new(), Vec::new(), f64::NEG_INFINITY);
        for (row, t) in time.iter().map(|t| to_a_nanosecond(t * us)).enumerate() {
            // A flipped bit makes a time far ahead, after which all others would run backwards.
            let ahead = t - last > LEAP_US && time.get(row + 1).is_some_and(|next| next * us < t);
            if t > last && (0.0..CLOCK_MAX_US).contains(&t) && !ahead {
                last = t;
                kept.push(row);
                time_us.push(t);
            }
        }
        let dropped = rows.len() - kept.len();
        Some(Self { name: name.to_owned(), rows, kept, time_us: time_us.into(), dropped })
    }

    /// The kept numbers of some columns; `None` if one of them is missing.
    pub(super) fn columns(&self, names: &[&str]) -> Option<Vec<Cow<'_, [f64]>>> {
        let own = |name: &&str| match self.rows.column(name)? {
            all if self.dropped == 0 => Some(all),
            all => Some(self.kept.iter().map(|&row| all[row]).collect()),
        };
        names.iter().map(own).collect()
    }

    pub(super) fn time_us(&self) -> &Rc<[f64]> {
        &self.time_us
    }
}

/// One channel of the log to be.
struct Taken {
    name: &'static str,
    columns: Vec<String>,
    origin: &'static str,
    /// Channels of one topic share it.
    time_us: Rc<[f64]>,
    width: usize,
    values: Vec<f64>,
}

/// Channels in the order in which the report has them.
#[derive(Default)]
pub(super) struct Collected {
    all: Vec<Taken>,
}

impl Collected {
    /// Adds a channel whose samples are functions of columns of a topic; false if the topic lacks
    /// one of them or has no number in them.
    ///
    /// * `origin` - unit and frame of the columns, for the report
    /// * `sample` - appends the numbers of a sample, of the numbers of a row
    pub(super) fn add(
        &mut self,
        name: &'static str,
        topic: &Topic,
        columns: &[&str],
        origin: &'static str,
        mut sample: impl FnMut(&[f64], &mut Vec<f64>),
    ) -> bool {
        let Some(numbers) = topic.columns(columns) else { return false };
        let mut values = Vec::with_capacity(topic.time_us.len() * columns.len());
        let mut row = vec![0.0; columns.len()];
        for i in 0..topic.time_us.len() {
            for (number, column) in row.iter_mut().zip(&numbers) {
                *number = column[i];
            }
            sample(&row, &mut values);
        }
        let columns = columns.iter().map(|column| format!("{}.{column}", topic.name)).collect();
        self.add_values(name, columns, origin, Rc::clone(&topic.time_us), values)
    }

    /// Adds a channel as it is; false if it has no number.
    pub(super) fn add_values(
        &mut self,
        name: &'static str,
        columns: Vec<String>,
        origin: &'static str,
        time_us: Rc<[f64]>,
        mut values: Vec<f64>,
    ) -> bool {
        for value in values.iter_mut().filter(|value| !value.is_finite()) {
            *value = f64::NAN; // one bit pattern, and nothing infinite
        }
        if name.ends_with("q_ned_from_body_wxyz") {
            normalise(&mut values);
        }
        if time_us.is_empty() || values.iter().all(|x| x.is_nan()) {
            return false;
        }
        let width = values.len() / time_us.len();
        self.all.push(Taken { name, columns, origin, time_us, width, values });
        true
    }

    /// The flight log, its channels as the report has them, and its time zero, us.
    ///
    /// Channels of one source of the log that have other times each get all times of the source
    /// and NaN at those of the others, so that no number is made up.
    pub(super) fn finish(self) -> (FlightLog, Vec<ChannelReport>, f64) {
        let first = self.all.iter().filter_map(|taken| taken.time_us.first());
        let zero_us = first.copied().fold(f64::INFINITY, f64::min);
        let reports = reports(&self.all, zero_us);
        let mut groups: BTreeMap<&str, Vec<Taken>> = BTreeMap::new();
        for taken in self.all {
            let group = taken.name.rsplit_once('.').map_or("", |(group, _)| group);
            groups.entry(group).or_default().push(taken);
        }
        let mut log = FlightLog::default();
        for (group, channels) in groups {
            let axis = union(&channels);
            let mut source = Source::default();
            for taken in channels {
                let name = taken.name.rsplit_once('.').map_or(taken.name, |(_, name)| name);
                let width = taken.width;
                let values = spread(taken, &axis);
                source.channels.insert(name.to_owned(), Channel { width, values });
            }
            source.time_s = axis.iter().map(|t| (t - zero_us) / 1e6).collect();
            log.sources.insert(group.to_owned(), source);
        }
        (log, reports, zero_us)
    }
}

/// The channels as the report has them.
fn reports(all: &[Taken], zero_us: f64) -> Vec<ChannelReport> {
    // Channels that share an axis share its pace; axes are told apart by where they stand.
    let mut paces: BTreeMap<*const f64, Pace> = BTreeMap::new();
    let report = |taken: &Taken| {
        let pace = paces.entry(taken.time_us.as_ptr()).or_insert_with(|| {
            let seconds = taken.time_us.iter().map(|t| (t - zero_us) / 1e6);
            Pace::of(&seconds.collect::<Vec<_>>())
        });
        let &mut Pace { rate_hz, mean_rate_hz, gaps } = pace;
        let rows = taken.values.chunks_exact(taken.width);
        ChannelReport {
            channel: taken.name.to_owned(),
            columns: taken.columns.clone(),
            origin: Some(taken.origin.to_owned()),
            samples: taken.time_us.len(),
            rate_hz,
            mean_rate_hz,
            gaps,
            samples_missing: rows.filter(|row| row.iter().any(|x| x.is_nan())).count(),
            repeats_dropped: 0,
        }
    };
    all.iter().map(report).collect()
}

/// All times of the channels, in order, each once.
fn union(channels: &[Taken]) -> Vec<f64> {
    let mut axis: Vec<f64> = Vec::new();
    for taken in channels {
        if *axis != *taken.time_us {
            axis.extend(&*taken.time_us);
            axis.sort_unstable_by(f64::total_cmp);
            axis.dedup();
        }
    }
    axis
}

/// The samples of a channel at all times of an axis that has its own.
fn spread(taken: Taken, axis: &[f64]) -> Vec<f64> {
    if axis.len() == taken.time_us.len() {
        return taken.values;
    }
    let mut values = vec![f64::NAN; axis.len() * taken.width];
    let mut at = 0;
    for (t, sample) in taken.time_us.iter().zip(taken.values.chunks_exact(taken.width)) {
        while axis[at] < *t {
            at += 1;
        }
        values[at * taken.width..(at + 1) * taken.width].copy_from_slice(sample);
    }
    values
}

/// Quaternions of norm 1, of `q` and `-q` the one nearer to the last; NaN for what is no rotation.
fn normalise(values: &mut [f64]) {
    let mut last = [1.0, 0.0, 0.0, 0.0];
    for q in values.chunks_exact_mut(4) {
        let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !((norm - 1.0).abs() <= QUATERNION_NORM_TOLERANCE) {
            q.fill(f64::NAN);
            continue;
        }
        let along: f64 = q.iter().zip(last).map(|(a, b)| a * b).sum();
        for (x, last) in q.iter_mut().zip(&mut last) {
            *x /= norm.copysign(along);
            *last = *x;
        }
    }
}

/// Appends a vector as it is, for columns that are in FRD or NED already.
pub(super) fn same(row: &[f64], sample: &mut Vec<f64>) {
    sample.extend(row);
}

/// Appends numbers times a factor.
pub(super) fn scaled(factor: f64) -> impl Fn(&[f64], &mut Vec<f64>) {
    move |row, sample| sample.extend(row.iter().map(|x| x * factor))
}

/// `q_ned_from_body` (w x y z) of roll, pitch and yaw of FRD in NED, rad, turned in the order yaw,
/// pitch, roll.
pub(super) fn q_of_angles([roll, pitch, yaw]: [f64; 3]) -> [f64; 4] {
    let q = nalgebra::UnitQuaternion::from_euler_angles(roll, pitch, yaw);
    [q.w, q.i, q.j, q.k]
}
