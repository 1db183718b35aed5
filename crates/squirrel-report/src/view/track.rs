//! Channels of a log on the even clock of the scene, as whole numbers of a stated step.

use serde::Serialize;
use squirrel_log::FlightLog;

/// Further apart, two samples say nothing of what was between them, s.
const GAP_S: f64 = 1.5;
/// Beyond this a number of steps is none.
const LARGEST_COUNT: f64 = 1e9;

/// What becomes of a channel between its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Between {
    /// A straight line.
    Line,
    /// The last one stays, as a command does.
    Hold,
    /// The shorter turn; rows are quaternions, of length one afterwards.
    Turn,
}

/// Where a track comes from and how fine it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kind {
    /// Numbers a sample.
    pub(super) width: Option<usize>,
    /// What one count means, in the unit of the channel.
    pub(super) step: f64,
    pub(super) between: Between,
}

/// Instants of the scene: `count` of them at a rate, from `begin_s` on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Clock {
    /// First instant, s of the log.
    pub begin_s: f64,
    /// Instants a second.
    pub rate_hz: f64,
    /// Instants.
    pub count: usize,
}

impl Clock {
    /// The k-th instant, s of the log.
    pub fn time_s(&self, k: usize) -> f64 {
        self.begin_s + k as f64 / self.rate_hz
    }
}

/// A channel on a clock.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Track {
    /// The channel of the log.
    pub from: String,
    /// Numbers at an instant.
    pub width: usize,
    /// What a count means, in the unit of the channel.
    pub step: f64,
    /// Counts, instant after instant, each less the last one of its column; `None` where the log
    /// says nothing.
    pub deltas: Vec<Option<i64>>,
}

impl Track {
    /// Reads a channel; `None` where the log lacks it or has it in another shape.
    pub(super) fn of(log: &FlightLog, name: &str, kind: Kind, clock: Clock) -> Option<Self> {
        let (times, channel) = log.channel(name)?;
        let width = channel.width;
        let whole = !times.is_empty() && width > 0 && channel.values.len() == times.len() * width;
        if !whole || kind.width.is_some_and(|wanted| wanted != width) {
            return None;
        }
        Self::from_rows(name, times, |i| channel.row(i).to_vec(), width, (kind, clock))
    }

    /// Of rows that are not a channel as it stands.
    ///
    /// * `row` - of the i-th sample, `width` numbers
    pub(super) fn from_rows(
        from: &str,
        times: &[f64],
        row: impl Fn(usize) -> Vec<f64>,
        width: usize,
        (kind, clock): (Kind, Clock),
    ) -> Option<Self> {
        // A source that has channels of several rates has NaN where one has no sample.
        let sound: Vec<usize> =
            (0..times.len()).filter(|i| row(*i).iter().all(|x| x.is_finite())).collect();
        let times: Vec<f64> = sound.iter().map(|i| times[*i]).collect();
        let row = |i: usize| row(sound[i]);
        let mut last = vec![0_i64; width];
        let mut deltas = Vec::with_capacity(clock.count * width);
        let mut some = false;
        for k in 0..clock.count {
            let sample = at(&times, row, clock.time_s(k), clock.rate_hz, kind.between);
            let counts = sample.and_then(|numbers| {
                let counts = numbers.iter().map(|x| (x / kind.step).round());
                counts
                    .map(|x| (x.abs() < LARGEST_COUNT).then_some(x as i64))
                    .collect::<Option<Vec<_>>>()
            });
            let Some(counts) = counts else {
                deltas.extend(std::iter::repeat_n(None, width));
                continue;
            };
            some = true;
            for (last, count) in last.iter_mut().zip(counts) {
                deltas.push(Some(count - *last));
                *last = count;
            }
        }
        let from = from.to_owned();
        some.then_some(Self { from, width, step: kind.step, deltas })
    }

    /// The numbers again: one row an instant, NaN where there is none.
    pub fn rows(&self) -> Vec<Vec<f64>> {
        let mut sums = vec![0_i64; self.width];
        let rows = self.deltas.chunks_exact(self.width).map(|row| {
            let number = |(sum, delta): (&mut i64, &Option<i64>)| {
                delta.map_or(f64::NAN, |delta| {
                    *sum += delta;
                    *sum as f64 * self.step
                })
            };
            sums.iter_mut().zip(row).map(number).collect()
        });
        rows.collect()
    }
}

/// What a channel of which every row is finite says at an instant.
fn at(
    times: &[f64],
    row: impl Fn(usize) -> Vec<f64>,
    time_s: f64,
    rate_hz: f64,
    between: Between,
) -> Option<Vec<f64>> {
    // The clock's own arithmetic is off by less.
    let slack = 1e-6 + 1e-12 * time_s.abs();
    let after = times.partition_point(|t| *t <= time_s + slack);
    if after == 0 {
        let near = times.first().is_some_and(|t| t - time_s <= 1.0 / rate_hz);
        return if near { turned(row(0), between) } else { None };
    }
    let (i, begin) = (after - 1, times[after - 1]);
    let since = (time_s - begin).max(0.0);
    let Some(end) = times.get(after).filter(|_| since > slack) else {
        // The last sample, or one that has the time.
        return if since <= GAP_S.max(1.0 / rate_hz) { turned(row(i), between) } else { None };
    };
    let gap = end - begin;
    if between == Between::Hold {
        // Commands stay until there is another.
        return Some(row(i));
    }
    if gap > GAP_S {
        return None;
    }
    let (from, mut to) = (turned(row(i), between)?, turned(row(after), between)?);
    if between == Between::Turn && from.iter().zip(&to).map(|(a, b)| a * b).sum::<f64>() < 0.0 {
        for x in &mut to {
            *x = -*x;
        }
    }
    let share = since / gap;
    turned(from.iter().zip(&to).map(|(a, b)| a + share * (b - a)).collect(), between)
}

/// A quaternion of length one; other rows as they are.
fn turned(row: Vec<f64>, between: Between) -> Option<Vec<f64>> {
    if between != Between::Turn {
        return Some(row);
    }
    let length = row.iter().map(|x| x * x).sum::<f64>().sqrt();
    (length > 0.1 && length.is_finite()).then(|| row.iter().map(|x| x / length).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLOCK: Clock = Clock { begin_s: 0.0, rate_hz: 10.0, count: 31 };

    fn track(times: &[f64], rows: &[&[f64]], step: f64, between: Between) -> Option<Track> {
        let kind = Kind { width: None, step, between };
        Track::from_rows("a.b", times, |i| rows[i].to_vec(), rows[0].len(), (kind, CLOCK))
    }

    #[test]
    fn numbers_come_back_within_half_a_step() {
        let rows: [&[f64]; 4] = [&[1.0, -2.0], &[1.5, 7.0], &[-3.25, 0.0], &[0.123_456, 1e5]];
        let times = [0.0, 0.5, 1.5, 2.5];
        let track = track(&times, &rows, 0.001, Between::Line).unwrap().rows();
        assert_eq!(track.len(), 31);
        for (t, row) in times.iter().zip(rows) {
            for (a, b) in track[(t * 10.0) as usize].iter().zip(row) {
                assert!((a - b).abs() <= 0.000_500_1, "{a} {b}");
            }
        }
        assert!((track[10][0] - f64::midpoint(1.5, -3.25)).abs() < 6e-4, "{:?}", track[10]);
    }

    #[test]
    fn commands_stay_and_gaps_stay_gaps() {
        let rows: [&[f64]; 3] = [&[0.0], &[1.0], &[2.0]];
        let held = track(&[0.0, 2.0, 2.5], &rows, 0.1, Between::Hold).unwrap().rows();
        assert_eq!([held[19][0], held[20][0], held[24][0]], [0.0, 1.0, 1.0]);
        let line = track(&[0.0, 2.0, 2.5], &rows, 0.1, Between::Line).unwrap().rows();
        let known: Vec<_> = (0..31).filter(|k| !line[*k][0].is_nan()).collect();
        assert_eq!(known[..2], [0, 20], "nothing is said of a gap of 2 s");
        assert_eq!(known.len(), 12, "the last sample stays for a while");
    }

    /// Channels of several rates share an axis: one has NaN where another has its sample.
    #[test]
    fn samples_that_a_source_did_not_give_are_passed_over() {
        let rows: [&[f64]; 4] = [&[1.0, 0.0], &[f64::NAN, 5.0], &[f64::NAN; 2], &[4.0, 0.0]];
        let line = track(&[0.0, 0.1, 0.2, 0.3], &rows, 0.01, Between::Line).unwrap().rows();
        assert!((line[1][0] - 2.0).abs() < 1e-9 && (line[2][0] - 3.0).abs() < 1e-9, "{line:?}");
        assert_eq!(line[2][1], 0.0);
    }

    #[test]
    fn attitudes_turn_the_shorter_way_and_have_length_one() {
        let rows: [&[f64]; 2] = [&[2.0, 0.0, 0.0, 0.0], &[-0.6, -0.8, 0.0, 0.0]];
        let turned = track(&[0.0, 1.0], &rows, 1e-4, Between::Turn).unwrap().rows();
        for row in &turned[..=10] {
            assert!((row.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-3, "{row:?}");
        }
        assert!(turned[5][0] > 0.8 && turned[5][1] > 0.3, "{:?}", turned[5]);
        assert_eq!(track(&[0.0], &[&[0.0; 4]], 1e-4, Between::Turn), None);
    }

    #[test]
    fn what_is_no_number_of_steps_is_absent() {
        for x in [f64::NAN, f64::INFINITY, 1e300] {
            assert_eq!(track(&[0.0], &[&[x]], 0.001, Between::Line), None, "{x}");
        }
    }
}
