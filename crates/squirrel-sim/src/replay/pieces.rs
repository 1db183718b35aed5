//! Replay of a log that is read piece by piece, as `fly` writes one: of a flight of hours a few
//! seconds are in memory.

use super::{Difference, OUTPUT_SOURCES, Replay};
use crate::flight::Setup;
use squirrel_core::stack::{Stack, StackState};
use squirrel_log::flight_code::{ESTIMATE, Frames, INPUT_SOURCES, record_output};
use squirrel_log::{FlightLog, LogReader};
use std::collections::BTreeMap;

/// Samples of a source that log or replay may be ahead of each other: seconds of the fastest.
const AHEAD_MAX: usize = 10_000;

/// As [`replay`](super::replay), of a log that is still in its file. `None` where it is not one that
/// `fly` writes, in the order of time and with the outputs that `setup` gives: [`replay`](super::replay)
/// of the whole log takes it, or says what is wrong.
///
/// # Errors
/// One line that names what cannot be used.
pub fn replay_pieces(log: &mut LogReader, setup: &Setup) -> Result<Option<Replay>, String> {
    let mut again = Again::new(&setup.stack().map_err(|e| e.to_string())?);
    loop {
        // What is wrong with the file is said by who reads all of it.
        let Ok(piece) = log.next_piece() else { return Ok(None) };
        let Some(piece) = piece else { return Ok(again.finish()) };
        if again.take(piece).is_none() {
            return Ok(None);
        }
    }
}

/// The flight code on its way through a log.
struct Again {
    stack: Stack,
    state: StackState,
    /// Known from the first piece on.
    frames: Option<Frames>,
    estimates: bool,
    inputs: FlightLog,
    /// Up to here inputs have become frames, s.
    settled_s: f64,
    last_us: Option<u64>,
    logged: FlightLog,
    replayed: FlightLog,
    steps: usize,
    values: usize,
    /// The first difference of each channel, by the place of its source and by its name.
    differences: BTreeMap<(usize, String), Difference>,
}

impl Again {
    fn new(stack: &Stack) -> Self {
        Self {
            stack: *stack,
            state: StackState::default(),
            frames: None,
            estimates: false,
            inputs: FlightLog::default(),
            settled_s: f64::NEG_INFINITY,
            last_us: None,
            logged: FlightLog::default(),
            replayed: FlightLog::default(),
            steps: 0,
            values: 0,
            differences: BTreeMap::new(),
        }
    }

    /// `None` where the log has to be looked at as a whole, here and below.
    fn take(&mut self, piece: FlightLog) -> Option<()> {
        let estimates = piece.sources.contains_key(ESTIMATE);
        if self.frames.is_none() {
            (self.estimates, self.frames) = (estimates, Some(Frames::new(estimates)));
        } else if estimates && !self.estimates {
            return None;
        }
        let mut settled_s = self.settled_s;
        let (mut inputs, mut outputs) = (FlightLog::default(), FlightLog::default());
        for (name, source) in piece.sources {
            if name == "frame" {
                settled_s = *source.time_s.last()?;
            }
            if INPUT_SOURCES.contains(&&*name) {
                if *source.time_s.first()? < self.settled_s {
                    return None;
                }
                inputs.sources.insert(name, source);
            } else if OUTPUT_SOURCES.contains(&&*name) {
                outputs.sources.insert(name, source);
            }
        }
        self.inputs.append(inputs);
        self.logged.append(outputs);
        self.settled_s = settled_s;
        let settled = self.inputs.split_before(settled_s);
        self.step(&settled)
    }

    /// Steps through inputs that are complete.
    fn step(&mut self, inputs: &FlightLog) -> Option<()> {
        if !inputs.sources.is_empty() {
            let rotors = self.stack.vehicle().rotors().len();
            for frame in self.frames.as_mut()?.of(inputs).ok()? {
                if self.last_us.is_some_and(|last_us| frame.time_us <= last_us) {
                    return None;
                }
                self.last_us = Some(frame.time_us);
                let output = self.stack.step(&mut self.state, &frame);
                let t = frame.time_us as f64 * 1e-6;
                record_output(&mut self.replayed, t, t, &output, rotors, None);
                self.steps += 1;
            }
            // What is shown of an estimate besides is no output.
            self.replayed.sources.retain(|name, _| OUTPUT_SOURCES.contains(&&**name));
        }
        (0..OUTPUT_SOURCES.len()).try_for_each(|place| self.compare(place))
    }

    /// Compares what both have of a source, and drops it.
    fn compare(&mut self, place: usize) -> Option<()> {
        let name = OUTPUT_SOURCES[place];
        let (logged, replayed) = (self.logged.source_mut(name), self.replayed.source_mut(name));
        let counts = [logged.time_s.len(), replayed.time_s.len()];
        let both = counts[0].min(counts[1]);
        if counts[0].max(counts[1]) - both > AHEAD_MAX {
            return None;
        }
        if both == 0 {
            return Some(());
        }
        let (logged, replayed) = (logged.take(both), replayed.take(both));
        for (channel, values) in &replayed.channels {
            let before = logged.channels.get(channel).filter(|c| c.width == values.width)?;
            self.values += values.values.len();
            let full = format!("{name}.{channel}");
            if let Some(found) = Difference::first(full, &logged.time_s, before, values) {
                self.differences.entry((place, channel.clone())).or_insert(found);
            }
        }
        Some(())
    }

    fn finish(mut self) -> Option<Replay> {
        let rest = std::mem::take(&mut self.inputs);
        self.step(&FlightLog {
            sources: rest.sources.into_iter().filter(|(_, s)| !s.time_s.is_empty()).collect(),
            ..FlightLog::default()
        })?;
        let all = self.logged.sources.values().chain(self.replayed.sources.values());
        if self.steps == 0 || all.into_iter().any(|source| !source.time_s.is_empty()) {
            return None;
        }
        let earliest = |first: Option<Difference>, next: Difference| match first {
            Some(first) if first.time_s <= next.time_s => Some(first),
            _ => Some(next),
        };
        let first_difference = self.differences.into_values().fold(None, earliest);
        Some(Replay { steps: self.steps, values: self.values, first_difference })
    }
}
