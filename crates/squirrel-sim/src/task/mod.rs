//! Tasks to learn: many vehicles that fly episodes of [`course`] and are told how well they do.
//!
//! ```text
//! action --level--> set points --[batch: autopilot, steps]--> state --[sensors]--> observation, reward, end of the episode
//! ```
//! The observation and the meaning of attitude actions are those of [`squirrel_core::policy`], so what was learned here flies there.
//! Each environment draws from a stream of its own: what happens in it does not depend on how many there are, nor on threads.
//! An episode that has ended is followed by a new one in the next step, whose action is not looked at (Gymnasium's next-step
//! autoreset). Domain randomisation: each episode takes one of the vehicles at hand, with whatever effects it has.

pub mod course;
mod level;

pub use level::{Level, RATE_MAX_RAD_S};

use crate::batch::simd::Path;
use crate::batch::{Autopilot, Batch, BatchError, Craft, Scheme, Settings, Tuned};
use crate::plant::WindParameters;
use crate::sensors::{SensorParameters, Sensors, Truth};
use crate::vehicle_file::VehicleFile;
use course::{Course, Kind};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use squirrel_core::control::Reference;
use squirrel_core::dynamics::State;
use squirrel_core::effects::Effects;
use squirrel_core::frames::{Body, In, Ned, Rotation};
use squirrel_core::guidance::sensing::Sensing;
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::policy::{Lookout, OBSERVATION, RATE_HZ, Sight, Span, observe};
use squirrel_core::stack::SensorFrame;

/// Steps of the batch from one action to the next.
pub const STEPS: usize = 10;
/// What the environments see of obstacles: paper, section V.B.
const SENSING: Sensing = Sensing { range_m: 5.0, half_view_rad: 0.261_799_4, speed_min_m_s: 0.5 };
/// What to learn, and how it runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaskSettings {
    /// What to do.
    pub kind: Kind,
    /// What actions are.
    pub level: Level,
    /// Length of an episode, s.
    pub episode_s: f64,
    /// Observations come from the vehicle's sensors, with their rates, delays and noise, instead of the true state.
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

/// A vehicle of which episodes may be flown.
#[derive(Debug, Clone)]
struct Candidate {
    craft: Craft,
    tuned: Tuned,
    sensors: SensorParameters,
    span: Span,
    hover_speed_rad_s: f32,
}

/// One environment.
#[derive(Debug, Clone)]
struct Episode {
    rng: Pcg64Mcg,
    candidate: usize,
    course: Course,
    lookout: Lookout,
    sensors: Option<Box<Measured>>,
    steps: usize,
    wing: f32,
    ended: bool,
}

/// Sensors of a vehicle and the last that they said.
#[derive(Debug, Clone)]
struct Measured {
    sensors: Sensors,
    sight: Sight,
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

/// Environments side by side, of vehicles with up to `ROTORS` rotors.
#[derive(Debug)]
pub struct Tasks<const ROTORS: usize = 4> {
    settings: TaskSettings,
    batch: Batch<f32, ROTORS>,
    candidates: Vec<Candidate>,
    episodes: Vec<Episode>,
    set_points: Vec<f32>,
    wings: Vec<f32>,
}

impl Candidate {
    fn new(number: usize, file: &VehicleFile) -> Result<Self, TaskError> {
        let control = file.control.ok_or(TaskError::NoGains(number))?;
        let fail = |problem| BatchError::Airframe { vehicle: number, problem };
        let vehicle = file.vehicle.cast::<f32>().map_err(fail)?;
        let span = Span::of(&vehicle);
        let each = span.weight_n / vehicle.rotors().len() as f32;
        let hover_speed_rad_s = (each / vehicle.parameters().propulsion.thrust_coefficient_n_s2).sqrt();
        let tuned = Tuned { vehicle, gains: control.attitude };
        Ok(Self { craft: Craft::from(file), tuned, sensors: file.sensors, span, hover_speed_rad_s })
    }
}

impl<const ROTORS: usize> Tasks<ROTORS> {
    /// Environments, each at the start of its first episode.
    ///
    /// * `vehicles` - each episode takes one of them
    /// * `count` - environments
    /// * `seed` - environment k draws from `seed + k`
    ///
    /// # Errors
    /// No environments, an episode without steps, a vehicle that a batch or an inner loop cannot take.
    pub fn new(
        vehicles: &[VehicleFile],
        count: usize,
        seed: u64,
        settings: TaskSettings,
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
        let candidates = vehicles.iter().enumerate().map(|(number, file)| Candidate::new(number, file));
        let candidates: Vec<Candidate> = candidates.collect::<Result<_, _>>()?;
        let crafts: Vec<Craft> = candidates.iter().map(|one| one.craft.clone()).collect();
        let batch = Settings {
            dt_s: 1.0 / (RATE_HZ as f64 * STEPS as f64),
            scheme: settings.scheme,
            threads: settings.threads,
            path: settings.path,
        };
        let mut batch = Batch::with_room(count, &crafts, batch)?;
        if let Some(set_point) = settings.level.set_point() {
            let tuned: Vec<Tuned> =
                (0..count).map(|k| candidates[k % candidates.len()].tuned.clone()).collect();
            batch.engage(Autopilot { set_point, period_steps: 1 }, &tuned)?;
        }
        let episode = Episode {
            rng: Pcg64Mcg::seed_from_u64(0),
            candidate: 0,
            course: Course::Track { sines: course::Sines::default(), at_rest: true },
            lookout: Lookout::new(SENSING),
            sensors: None,
            steps: 0,
            wing: 0.0,
            ended: false,
        };
        let mut tasks = Self {
            settings,
            batch,
            candidates,
            episodes: vec![episode; count],
            set_points: vec![0.0; count * settings.level.told_numbers(ROTORS)],
            wings: vec![0.0; count * 2],
        };
        for number in 0..count {
            tasks.seed(number, seed.wrapping_add(number as u64))?;
            tasks.begin(number)?;
        }
        Ok(tasks)
    }

    /// Environments.
    #[allow(clippy::len_without_is_empty, reason = "never empty")]
    pub fn len(&self) -> usize {
        self.episodes.len()
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
        let state = self.batch.state(number)?;
        Ok((state, self.episodes[number].reference()))
    }

    /// Obstacles of one environment: north, east, radius, m.
    ///
    /// # Errors
    /// No such environment.
    pub fn obstacles(&self, number: usize) -> Result<Vec<[f32; 3]>, TaskError> {
        self.batch.state(number)?;
        let obstacles = self.episodes[number].course.obstacles();
        Ok(obstacles.iter().map(|o| [o.north_m, o.east_m, course::TRUNK_RADIUS_M]).collect())
    }

    /// A new stream for one environment, from its next episode on.
    ///
    /// # Errors
    /// No such environment.
    pub fn seed(&mut self, number: usize, seed: u64) -> Result<(), TaskError> {
        self.batch.state(number)?;
        self.episodes[number].rng = Pcg64Mcg::seed_from_u64(seed);
        Ok(())
    }

    /// Starts a new episode in every environment that `which` says, and hands out what all of them see.
    ///
    /// * `observation` - [`OBSERVATION`] numbers for each environment
    ///
    /// # Errors
    /// Lengths that are not those of the environments.
    pub fn reset(&mut self, which: impl Fn(usize) -> bool, observation: &mut [f32]) -> Result<(), TaskError> {
        self.check("observation", observation.len(), OBSERVATION)?;
        for (number, seen) in observation.chunks_exact_mut(OBSERVATION).enumerate() {
            if which(number) {
                self.begin(number)?;
            }
            let state = self.batch.state(number)?;
            seen.copy_from_slice(&self.episodes[number].see(&state));
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
        let level = self.settings.level;
        self.check("actions", actions.len(), level.numbers(ROTORS))?;
        self.check("observation", outcome.observation.len(), OBSERVATION)?;
        for (what, length) in [
            ("reward", outcome.reward.len()),
            ("terminated", outcome.terminated.len()),
            ("truncated", outcome.truncated.len()),
        ] {
            self.check(what, length, 1)?;
        }
        let width = level.told_numbers(ROTORS);
        for (number, action) in actions.chunks_exact(level.numbers(ROTORS)).enumerate() {
            let episode = &mut self.episodes[number];
            let candidate = &self.candidates[episode.candidate];
            let told = level.told(action, &candidate.span, &candidate.tuned.vehicle);
            self.set_points[width * number..][..width].copy_from_slice(&told.rotors[..width]);
            self.wings[2 * number..][..2].fill(told.wing);
            episode.wing = told.wing;
        }
        if level.set_point().is_some() {
            self.batch.set_points(&self.set_points)?;
        } else {
            self.batch.command(&self.set_points)?;
        }
        self.batch.command_wings(&self.wings)?;
        self.batch.step(STEPS);

        let longest = (self.settings.episode_s * RATE_HZ as f64).round() as usize;
        let Outcome { observation, reward, terminated, truncated } = outcome;
        for (number, seen) in observation.chunks_exact_mut(OBSERVATION).enumerate() {
            if self.episodes[number].ended {
                self.begin(number)?;
                let state = self.batch.state(number)?;
                seen.copy_from_slice(&self.episodes[number].see(&state));
                (reward[number], terminated[number], truncated[number]) = (0.0, false, false);
                continue;
            }
            let state = self.batch.state(number)?;
            let episode = &mut self.episodes[number];
            episode.steps += 1;
            let verdict = episode.course.judge(&state, &episode.reference());
            reward[number] = verdict.reward;
            terminated[number] = verdict.lost;
            truncated[number] = !verdict.lost && episode.steps >= longest;
            episode.ended = verdict.lost || truncated[number];
            seen.copy_from_slice(&episode.see(&state));
        }
        Ok(())
    }

    /// Starts an episode.
    fn begin(&mut self, number: usize) -> Result<(), TaskError> {
        let episode = &mut self.episodes[number];
        let candidate = course::draw_below(&mut episode.rng, self.candidates.len());
        let chosen = &self.candidates[candidate];
        if candidate != episode.candidate || episode.steps == 0 {
            self.batch.refit(number, &chosen.craft)?;
            if self.settings.level.set_point().is_some() {
                self.batch.retune(number, &chosen.tuned)?;
            }
        }
        episode.candidate = candidate;
        episode.course = Course::draw(self.settings.kind, &mut episode.rng);
        episode.lookout = Lookout::new(SENSING);
        (episode.steps, episode.wing, episode.ended) = (0, 0.0, false);
        let start = episode.reference();
        let mut state = State::at_rest();
        (state.position, state.velocity) = (start.position, episode.course.start_velocity());
        for speed in state.rotor_speed_rad_s.iter_mut().take(ROTORS) {
            *speed = chosen.hover_speed_rad_s;
        }
        let seed = course::draw(&mut episode.rng);
        if chosen.craft.effects.gust().is_some() {
            self.batch.set_air(number, &chosen.craft, WindParameters::calm(), seed)?;
        } else {
            self.batch.set_wind(number, In::zero())?;
        }
        let sensors = self.settings.sensors.then(|| {
            let sensors = Sensors::new(chosen.sensors, &Effects::none(), seed);
            Box::new(Measured { sensors, sight: sight(&state, 0.0) })
        });
        episode.sensors = sensors;
        self.batch.reset(number, &state)?;
        Ok(())
    }

    fn check(&self, what: &'static str, given: usize, each: usize) -> Result<(), TaskError> {
        let needed = each * self.len();
        if given == needed { Ok(()) } else { Err(BatchError::Shape { what, given, needed }.into()) }
    }
}

impl Episode {
    fn time_s(&self) -> f32 {
        self.steps as f32 / RATE_HZ as f32
    }

    fn reference(&self) -> Reference {
        self.course.reference(self.time_s())
    }

    fn see(&mut self, state: &State<f32>) -> [f32; OBSERVATION] {
        let time_us = self.steps as u64 * 1_000_000 / RATE_HZ;
        let mut seen = match &mut self.sensors {
            None => sight(state, self.wing),
            Some(measured) => {
                let (frame, _) = measured.sensors.poll(time_us, &truth(state));
                measured.hear(&frame);
                Sight { wing: self.wing, ..measured.sight }
            }
        };
        seen.obstacle = self.lookout.look(seen.position, seen.velocity, self.course.obstacles());
        observe(&seen, &self.reference())
    }
}

impl Measured {
    fn hear(&mut self, frame: &SensorFrame) {
        let sight = &mut self.sight;
        if let Some(imu) = frame.imu {
            sight.omega = imu.omega;
        }
        if let Some(ned_from_body) = frame.attitude {
            sight.ned_from_body = ned_from_body;
        }
        if let Some(gnss) = frame.gnss {
            let height = sight.position.vector.z;
            (sight.position, sight.velocity) = (gnss.position, gnss.velocity);
            sight.position.vector.z = height;
        }
        if let Some(altitude_m) = frame.altitude_m {
            sight.position.vector.z = -altitude_m;
        }
    }
}

fn sight(state: &State<f32>, wing: f32) -> Sight {
    Sight {
        position: state.position,
        velocity: state.velocity,
        ned_from_body: state.ned_from_body(),
        omega: state.omega,
        obstacle: None,
        wing,
    }
}

fn truth(state: &State<f32>) -> Truth {
    let wide = |v: Vector3<f32>| v.map(f64::from);
    let q = state.ned_from_body().wxyz().map(f64::from);
    let ned_from_body = Rotation::<Ned, Body, f64>::from_wxyz(q).unwrap_or_else(Rotation::identity);
    let up = In::<Ned, f64>::new(Vector3::new(0.0, 0.0, -GRAVITY_M_S2));
    Truth {
        position: In::new(wide(state.position.vector)),
        velocity: In::new(wide(state.velocity.vector)),
        ned_from_body,
        omega: In::new(wide(state.omega.vector)),
        // Of a vehicle that does not accelerate; no observation has it.
        specific_force: ned_from_body.inverse() * up,
        voltage_v: 0.0,
        current_a: 0.0,
    }
}
