//! What running episodes are made of: the stream of random numbers that each began with, and what
//! has happened since. Flown again, they are where they were, bit for bit; so environments are put
//! aside, copied and sent.

use super::TaskError;
use super::part::Part;
use crate::BatchError;
use rand_pcg::Pcg64Mcg;
use squirrel_sim::tape::Tape;
use std::collections::VecDeque;

/// What happens to all environments of a part at once.
#[derive(Debug, Clone)]
pub(super) enum Event {
    /// They are made.
    Begin,
    /// They look, some after a reset.
    Look,
    /// Actions of all.
    Act(Box<[f32]>),
}

/// What has happened since the oldest running episode began.
#[derive(Debug, Clone)]
pub(super) struct Played {
    events: VecDeque<Event>,
    /// Number of the first event that is kept.
    first: u64,
    /// The event in which each running episode began, and the stream then.
    begun: Vec<(u64, Pcg64Mcg)>,
}

impl Played {
    pub(super) fn new(count: usize) -> Self {
        let begun = vec![(0, Pcg64Mcg::new(0)); count];
        Self { events: VecDeque::from([Event::Begin]), first: 0, begun }
    }

    pub(super) fn happens(&mut self, event: Event) {
        self.events.push_back(event);
    }

    /// An episode begins in the event that happens.
    pub(super) fn begins(&mut self, number: usize, rng: &Pcg64Mcg) {
        self.begun[number] = (self.first + self.events.len() as u64 - 1, rng.clone());
    }

    /// Forgets what no running episode has seen.
    pub(super) fn forget(&mut self) {
        let oldest = self.begun.iter().map(|(at, _)| *at).min().unwrap_or(self.first);
        while self.first < oldest && self.events.pop_front().is_some() {
            self.first += 1;
        }
    }

    /// * `numbers` - of the actions of all
    fn keep(&mut self, tape: &mut Tape<'_>, numbers: usize) -> Option<()> {
        tape.word(&mut self.first)?;
        let count = tape.count(self.events.len())?;
        for at in 0..count {
            if at >= self.events.len() {
                self.events.push_back(Event::Begin);
            }
            let kind = match &self.events[at] {
                Event::Begin => 0,
                Event::Look => 1,
                Event::Act(_) => 2,
            };
            self.events[at] = match (tape.count(kind)?, &mut self.events[at]) {
                (0, _) => Event::Begin,
                (1, _) => Event::Look,
                (2, Event::Act(actions)) => {
                    let mut actions = actions.clone();
                    tape.reals(&mut actions)?;
                    Event::Act(actions)
                }
                (2, _) => {
                    let mut actions = vec![0.0; numbers].into_boxed_slice();
                    tape.reals(&mut actions)?;
                    Event::Act(actions)
                }
                _ => return None,
            };
        }
        self.events.truncate(count);
        for (at, stream) in &mut self.begun {
            tape.word(at)?;
            keep_stream(tape, stream)?;
            let place = at.checked_sub(self.first)?;
            if place >= count as u64 {
                return None;
            }
        }
        Some(())
    }
}

fn keep_stream(tape: &mut Tape<'_>, stream: &mut Pcg64Mcg) -> Option<()> {
    let mut state = stream.state();
    tape.long(&mut state)?;
    *stream = Pcg64Mcg::new(state);
    Some(())
}

impl<const ROTORS: usize> Part<ROTORS> {
    pub(super) fn write(&mut self, bytes: &mut Vec<u8>) {
        let mut tape = Tape::Write(bytes);
        // Writing refuses nothing.
        let _ = self.played.keep(&mut tape, self.actions.len());
        for number in 0..self.len() {
            let _ = keep_stream(&mut tape, self.stream(number));
        }
    }

    /// Flies again what [`Self::write`] wrote.
    pub(super) fn read(
        &mut self,
        tape: &mut Tape<'_>,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<(), TaskError> {
        let broken = || TaskError::Batch(BatchError::Memory("too short, or damaged"));
        let mut played = Played::new(self.len());
        played.keep(tape, self.actions.len()).ok_or_else(broken)?;
        let mut streams = vec![Pcg64Mcg::new(0); self.len()];
        for stream in &mut streams {
            keep_stream(tape, stream).ok_or_else(broken)?;
        }
        for (event, at) in played.events.iter().zip(played.first..) {
            if !go_on() {
                return Err(BatchError::Interrupted.into());
            }
            match event {
                Event::Begin => {}
                Event::Look => (0..self.len()).try_for_each(|number| self.look(number))?,
                Event::Act(actions) => {
                    self.actions.copy_from_slice(actions);
                    self.fly()?;
                }
            }
            for number in 0..self.len() {
                let (begun, stream) = &played.begun[number];
                if *begun != at {
                    continue;
                }
                // What it flew before is of no episode.
                *self.stream(number) = stream.clone();
                self.begin(number)?;
                if !matches!(event, Event::Begin) {
                    self.look(number)?;
                }
            }
        }
        for (number, stream) in streams.into_iter().enumerate() {
            *self.stream(number) = stream;
        }
        self.played = played;
        Ok(())
    }
}
