//! Tasks to learn: many vehicles that fly episodes of [`course`] and are told how well they do.
//!
//! ```text
//! action --level--> set points --[batch: autopilot, steps]--> state --[sensors]--> observation, reward, end of the episode
//! ```
//! The observation and the meaning of attitude actions are those of [`squirrel_core::policy`], so
//! what was learned here flies there. Each environment draws from a stream of its own: what happens
//! in it does not depend on how many there are, nor on threads. An episode that has ended is
//! followed by a new one in the next step, whose action is not looked at (Gymnasium's next-step
//! autoreset). Domain randomisation: each episode takes one of the vehicles at hand, with whatever
//! effects it has.

pub mod course;
mod level;
mod memory;
mod part;

pub use level::{Level, RATE_MAX_RAD_S};

use crate::pool::Pool;
use crate::{BatchError, Scheme};
use course::{CourseKind, Terms};
use part::{Candidate, Part};
use squirrel_core::control::Reference;
use squirrel_core::dynamics::State;
use squirrel_core::policy::{OBSERVATION, RATE_HZ};
use squirrel_sim::simd::Path;
use squirrel_sim::tape::Tape;
use squirrel_sim::vehicle_file::VehicleFile;
use std::sync::Arc;

/// Steps of the batch from one action to the next.
pub const STEPS: usize = 10;
/// What to learn, and how it runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaskSettings {
    /// What to do.
    pub kind: CourseKind,
    /// What actions are.
    pub level: Level,
    /// Length of an episode, s.
    pub episode_s: f64,
    /// Observations come from the vehicle's sensors, with their rates, delays and noise, instead of
    /// the true state.
    pub sensors: bool,
    /// How steps of 2 ms are taken.
    pub scheme: Scheme,
    /// Threads that work, the caller among them.
    pub threads: usize,
    /// Registers; all give the same bits.
    pub path: Path,
}

/// Why there are no environments; one line.
#[derive(Debug, thiserror::Error)]
pub enum TaskError {
    /// No environment, or an episode without a step.
    #[error("{what} = {given}: must be {needed}")]
    Number {
        /// Which.
        what: &'static str,
        /// What it is.
        given: f64,
        /// What it must be.
        needed: &'static str,
    },
    /// A vehicle without gains.
    #[error("vehicles[{0}]: [control] is missing; the inner loop needs gains")]
    NoGains(usize),
    /// A vehicle that cannot be used.
    #[error(transparent)]
    Batch(#[from] BatchError),
}

/// What a step hands out, a row for each environment.
#[derive(Debug)]
pub struct Outcome<'a> {
    /// [`OBSERVATION`] numbers each.
    pub observation: &'a mut [f32],
    /// Reward.
    pub reward: &'a mut [f32],
    /// The vehicle is lost.
    pub terminated: &'a mut [bool],
    /// The time is over.
    pub truncated: &'a mut [bool],
}

/// Environments that a thread takes at once: enough to be worth claiming.
const PART: usize = 128;

/// Environments side by side, of vehicles with up to `ROTORS` rotors.
#[derive(Debug)]
pub struct Tasks<const ROTORS: usize = 4> {
    settings: TaskSettings,
    count: usize,
    parts: Pool<Part<ROTORS>, ()>,
}

impl<const ROTORS: usize> Tasks<ROTORS> {
    /// Environments, each at the start of its first episode.
    ///
    /// * `vehicles` - each episode takes one of them
    /// * `count` - environments
    /// * `seed` - environment k draws from `seed + k`
    ///
    /// # Errors
    /// No environments, an episode without steps, a vehicle that a batch or an inner loop cannot
    /// take.
    pub fn new(
        vehicles: &[VehicleFile],
        count: usize,
        seed: u64,
        settings: TaskSettings,
    ) -> Result<Self, TaskError> {
        Self::new_while(vehicles, count, seed, settings, &mut || true)
    }

    /// As [`Self::new`].
    ///
    /// * `go_on` - asked now and then
    ///
    /// # Errors
    /// As [`Self::new`]; `go_on` says no.
    pub fn new_while(
        vehicles: &[VehicleFile],
        count: usize,
        seed: u64,
        settings: TaskSettings,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Self, TaskError> {
        if count == 0 {
            return Err(TaskError::Number { what: "num_envs", given: 0.0, needed: "at least 1" });
        }
        let episode_s = settings.episode_s;
        if !(episode_s.is_finite() && episode_s * RATE_HZ as f64 >= 1.0) {
            return Err(TaskError::Number {
                what: "episode_s",
                given: episode_s,
                needed: "at least 0.02 and finite",
            });
        }
        if settings.threads == 0 {
            return Err(BatchError::NoThreads.into());
        }
        let candidates =
            vehicles.iter().enumerate().map(|(number, file)| Candidate::new(number, file));
        let candidates: Arc<[Candidate]> = candidates.collect::<Result<_, _>>()?;
        let parts = (0..count).step_by(PART).map(|first| {
            if !go_on() {
                return Err(BatchError::Interrupted.into());
            }
            Part::new(
                &candidates,
                PART.min(count - first),
                seed.wrapping_add(first as u64),
                settings,
            )
        });
        let parts = parts.collect::<Result<_, _>>()?;
        let parts = Pool::new(parts, settings.threads, |part: &mut Part<ROTORS>, ()| {
            part.went = part.step();
        });
        Ok(Self { settings, count, parts: parts.map_err(BatchError::from)? })
    }

    /// Environments.
    #[allow(clippy::len_without_is_empty, reason = "never empty")]
    pub fn len(&self) -> usize {
        self.count
    }

    /// How they run.
    pub fn settings(&self) -> &TaskSettings {
        &self.settings
    }

    /// Motion of one vehicle, and what it should follow.
    ///
    /// # Errors
    /// No such environment.
    pub fn state(&self, number: usize) -> Result<(State<f32>, Reference), TaskError> {
        self.is_there(number)?;
        self.parts.chunk(number / PART).state(number % PART)
    }

    /// Obstacles of one environment: north, east, radius, m.
    ///
    /// # Errors
    /// No such environment.
    pub fn obstacles(&self, number: usize) -> Result<Vec<[f32; 3]>, TaskError> {
        self.is_there(number)?;
        Ok(self.parts.chunk(number / PART).obstacles(number % PART))
    }

    /// A new stream for one environment, from its next episode on.
    ///
    /// # Errors
    /// No such environment.
    pub fn seed(&mut self, number: usize, seed: u64) -> Result<(), TaskError> {
        self.is_there(number)?;
        self.parts.chunk(number / PART).seed(number % PART, seed);
        Ok(())
    }

    /// Starts a new episode in every environment that `which` says, and hands out what all of them
    /// see.
    ///
    /// * `observation` - [`OBSERVATION`] numbers for each environment
    ///
    /// # Errors
    /// Lengths that are not those of the environments.
    pub fn reset(
        &mut self,
        which: impl Fn(usize) -> bool,
        observation: &mut [f32],
    ) -> Result<(), TaskError> {
        self.reset_while(which, observation, &mut || true)
    }

    /// As [`Self::reset`].
    ///
    /// * `go_on` - asked now and then
    ///
    /// # Errors
    /// As [`Self::reset`]; `go_on` says no, and some have begun anew then.
    pub fn reset_while(
        &mut self,
        which: impl Fn(usize) -> bool,
        observation: &mut [f32],
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<(), TaskError> {
        self.check("observation", observation.len(), OBSERVATION)?;
        for (number, seen) in observation.chunks_mut(PART * OBSERVATION).enumerate() {
            if !go_on() {
                return Err(BatchError::Interrupted.into());
            }
            let mut part = self.parts.chunk(number);
            part.reset(|local| which(number * PART + local))?;
            seen.copy_from_slice(&part.observation);
        }
        Ok(())
    }

    /// One action: 20 ms of flight.
    ///
    /// * `actions` - [`Level::numbers`] for each environment, see [`Level`]
    ///
    /// # Errors
    /// Lengths that are not those of the environments.
    pub fn step(&mut self, actions: &[f32], outcome: Outcome<'_>) -> Result<(), TaskError> {
        let numbers = self.settings.level.numbers(ROTORS);
        let Outcome { observation, reward, terminated, truncated } = outcome;
        self.check("actions", actions.len(), numbers)?;
        self.check("observation", observation.len(), OBSERVATION)?;
        self.check("reward", reward.len(), 1)?;
        self.check("terminated", terminated.len(), 1)?;
        self.check("truncated", truncated.len(), 1)?;
        for (number, actions) in actions.chunks(PART * numbers).enumerate() {
            self.parts.chunk(number).actions.copy_from_slice(actions);
        }
        self.parts.run(());
        for (number, seen) in observation.chunks_mut(PART * OBSERVATION).enumerate() {
            let mut part = self.parts.chunk(number);
            std::mem::replace(&mut part.went, Ok(()))?;
            let all = number * PART..number * PART + part.reward.len();
            seen.copy_from_slice(&part.observation);
            reward[all.clone()].copy_from_slice(&part.reward);
            terminated[all.clone()].copy_from_slice(&part.terminated);
            truncated[all].copy_from_slice(&part.truncated);
        }
        Ok(())
    }

    /// What the rewards of the last step are made of, a row for each environment; zero before it
    /// and where an episode began in it.
    pub fn reward_terms(&self) -> Vec<Terms> {
        let parts = 0..self.count.div_ceil(PART);
        parts.flat_map(|part| self.parts.chunk(part).terms.clone()).collect()
    }

    /// What running episodes are made of, as bytes: what began them, and the actions since.
    ///
    /// * `go_on` - asked now and then
    ///
    /// # Errors
    /// `go_on` says no.
    pub fn memory(&self, go_on: &mut dyn FnMut() -> bool) -> Result<Vec<u8>, TaskError> {
        let mut bytes = Vec::new();
        // Writing refuses nothing.
        let _ = self.head(&mut Tape::Write(&mut bytes));
        for part in 0..self.count.div_ceil(PART) {
            self.parts.chunk(part).write(&mut bytes);
            if !go_on() {
                return Err(BatchError::Interrupted.into());
            }
        }
        Ok(bytes)
    }

    /// Flies again what [`Self::memory`] wrote of as many environments with the same vehicles and
    /// settings: they are where those were, bit for bit.
    ///
    /// * `go_on` - asked now and then
    ///
    /// # Errors
    /// Bytes of others, or too few or too many; `go_on` says no. Environments are anywhere then.
    pub fn restore(
        &mut self,
        memory: &[u8],
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<(), TaskError> {
        let mut tape = Tape::Read(memory);
        self.head(&mut tape).ok_or(BatchError::Memory("of other environments"))?;
        for part in 0..self.count.div_ceil(PART) {
            self.parts.chunk(part).read(&mut tape, go_on)?;
        }
        let rest = BatchError::Memory("longer than these environments'");
        if tape.is_over() { Ok(()) } else { Err(rest.into()) }
    }

    /// What both sides must have.
    fn head(&self, tape: &mut Tape<'_>) -> Option<()> {
        tape.same(self.count)?;
        tape.same(ROTORS)?;
        tape.same(self.settings.level.numbers(ROTORS))
    }

    fn is_there(&self, number: usize) -> Result<(), TaskError> {
        let vehicles = self.count;
        let missing = BatchError::NoVehicle { vehicle: number, vehicles };
        if number < vehicles { Ok(()) } else { Err(missing.into()) }
    }

    fn check(&self, what: &'static str, given: usize, each: usize) -> Result<(), TaskError> {
        let needed = each * self.len();
        if given == needed { Ok(()) } else { Err(BatchError::Shape { what, given, needed }.into()) }
    }
}
