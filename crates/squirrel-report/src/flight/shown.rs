//! What a report shows of a flight, kept while it is flown: of a flight of hours every so many
//! samples, which is more than its charts have pixels.

use squirrel_log::{Channel, FlightLog, Source};
use std::collections::BTreeMap;

/// Sources that charts and scenes look at.
const SOURCES: [&str; 9] = [
    "truth",
    "reference",
    "offboard.reference",
    "wing",
    "rotor",
    "control.outer",
    "control.inner",
    "estimate",
    "gnss",
];

/// Most samples of a source that are kept: of 300 a second those of three minutes.
const SAMPLES_MAX: usize = 60_000;

/// The part of a flight that is shown.
#[derive(Debug, Clone, Default)]
pub struct Shown {
    log: FlightLog,
    /// Which samples of a source are kept, and how many it had.
    every: BTreeMap<String, (usize, usize)>,
}

impl Shown {
    /// Takes what is said of the flight: obstacles, for one.
    pub fn begin(&mut self, metadata: &BTreeMap<String, String>) {
        self.log.metadata = metadata.clone();
    }

    /// Takes the samples that follow those before.
    pub fn push(&mut self, piece: &FlightLog) {
        let shown = piece.sources.iter().filter(|(name, _)| SOURCES.contains(&name.as_str()));
        for (name, source) in shown {
            let (every, seen) = self.every.entry(name.clone()).or_insert((1, 0));
            // The first of all samples is kept, and each `every`th after it.
            let first = (*every - *seen % *every) % *every;
            *seen += source.time_s.len();
            let kept = thinned(source, first, *every);
            let log = FlightLog { sources: [(name.clone(), kept)].into(), ..FlightLog::default() };
            self.log.append(log);
            let own = self.log.source_mut(name);
            while own.time_s.len() > SAMPLES_MAX {
                *own = thinned(own, 0, 2);
                *every *= 2;
            }
        }
    }

    /// The log as it is shown.
    pub fn log(&self) -> &FlightLog {
        &self.log
    }

    /// Of the source with most samples one in so many is kept.
    pub fn every(&self) -> usize {
        self.every.values().map(|(every, _)| *every).max().unwrap_or(1)
    }
}

/// Each so manyth sample of a source.
fn thinned(source: &Source, first: usize, every: usize) -> Source {
    let channel = |channel: &Channel| Channel {
        width: channel.width,
        values: channel
            .values
            .chunks_exact(channel.width)
            .skip(first)
            .step_by(every)
            .flatten()
            .copied()
            .collect(),
    };
    Source {
        time_s: source.time_s.iter().copied().skip(first).step_by(every).collect(),
        channels: source.channels.iter().map(|(name, c)| (name.clone(), channel(c))).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_flight_is_thinned_evenly_and_a_short_one_is_whole() {
        let samples = |begin: usize, end: usize| {
            let mut log = FlightLog::default();
            for i in begin..end {
                for name in ["truth", "frame"] {
                    let x = i as f64;
                    log.source_mut(name).push(x, &[("a", &[x]), ("b", &[x, -x])]);
                }
            }
            log
        };
        let mut shown = Shown::default();
        let mut whole = FlightLog::default();
        for begin in (0..50_000).step_by(1000) {
            let mut piece = samples(begin, begin + 1000);
            shown.push(&piece);
            piece.sources.remove("frame");
            whole.append(piece);
        }
        assert_eq!((shown.log(), shown.every()), (&whole, 1));
        for begin in (50_000..250_001).step_by(777) {
            shown.push(&samples(begin, begin + 777));
        }
        let (every, truth) = (shown.every(), &shown.log().sources["truth"]);
        assert_eq!(every, 8);
        assert!(truth.time_s.len() > SAMPLES_MAX / 2 - 1 && truth.time_s.len() <= SAMPLES_MAX);
        for (i, time_s) in truth.time_s.iter().enumerate() {
            assert_eq!(*time_s, (i * every) as f64);
            assert_eq!(truth.channels["b"].row(i), [*time_s, -*time_s]);
        }
    }
}
