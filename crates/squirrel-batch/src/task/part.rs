//! Environments that a thread takes at once, and what happens in one of them.

use super::course::{self, Course, Terms};
use super::memory::{Event, Played};
use super::{STEPS, TaskError, TaskSettings};
use crate::{Autopilot, Batch, BatchError, BatchVehicle, Settings, Tuned};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use squirrel_core::control::Reference;
use squirrel_core::control::twcc::OuterAirframe;
use squirrel_core::control::wiic::Envelope;
use squirrel_core::dynamics::State;
use squirrel_core::effects::Effects;
use squirrel_core::frames::{Body, In, Ned, Rotation};
use squirrel_core::guidance::sensing::Sensing;
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::policy::{Lookout, OBSERVATION, RATE_HZ, Sight, Span, observe};
use squirrel_core::stack::SensorFrame;
use squirrel_sim::plant::WindParameters;
use squirrel_sim::sensors::{SensorParameters, Sensors, Truth};
use squirrel_sim::vehicle_file::VehicleFile;
use std::sync::Arc;

/// What the environments see of obstacles: paper, section V.B.
const SENSING: Sensing = Sensing { range_m: 5.0, half_view_rad: 0.261_799_4, speed_min_m_s: 0.5 };

/// A vehicle of which episodes may be flown.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    member: BatchVehicle,
    tuned: Tuned,
    sensors: SensorParameters,
    span: Span,
    envelope: Envelope,
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

/// See the module. What goes in and out is its own, so that a thread has all that it needs.
#[derive(Debug)]
pub(super) struct Part<const ROTORS: usize> {
    settings: TaskSettings,
    batch: Batch<f32, ROTORS>,
    candidates: Arc<[Candidate]>,
    episodes: Vec<Episode>,
    set_points: Vec<f32>,
    wings: Vec<f32>,
    /// In: [`super::Level::numbers`] for each environment.
    pub(super) actions: Vec<f32>,
    /// Out: [`OBSERVATION`] numbers for each environment.
    pub(super) observation: Vec<f32>,
    pub(super) reward: Vec<f32>,
    /// What rewards are made of.
    pub(super) terms: Vec<Terms>,
    pub(super) terminated: Vec<bool>,
    pub(super) truncated: Vec<bool>,
    /// What running episodes are made of.
    pub(super) played: Played,
    /// How the last step went.
    pub(super) went: Result<(), TaskError>,
}

impl Candidate {
    pub(super) fn new(number: usize, file: &VehicleFile) -> Result<Self, TaskError> {
        let control = file.control.ok_or(TaskError::NoGains(number))?;
        let fail = |problem| BatchError::Airframe { vehicle: number, problem };
        let vehicle = file.vehicle.cast::<f32>().map_err(fail)?;
        let span = Span::of(&vehicle);
        let tilt_max_rad = vehicle.parameters().limits.tilt_max_rad;
        let envelope =
            OuterAirframe::new(&vehicle, control.twcc.thrust_min_n, tilt_max_rad).envelope;
        let each = span.weight_n / vehicle.rotors().len() as f32;
        let hover_speed_rad_s =
            (each / vehicle.parameters().propulsion.thrust_coefficient_n_s2).sqrt();
        let tuned = Tuned { vehicle, gains: control.attitude };
        Ok(Self {
            member: BatchVehicle::from(file),
            tuned,
            sensors: file.sensors,
            span,
            envelope,
            hover_speed_rad_s,
        })
    }
}

impl<const ROTORS: usize> Part<ROTORS> {
    /// Environments, each at the start of its first episode.
    ///
    /// * `seed` - environment k of these draws from `seed + k`
    pub(super) fn new(
        candidates: &Arc<[Candidate]>,
        count: usize,
        seed: u64,
        settings: TaskSettings,
    ) -> Result<Self, TaskError> {
        let candidates = Arc::clone(candidates);
        let members: Vec<BatchVehicle> = candidates.iter().map(|one| one.member.clone()).collect();
        let batch = Settings {
            dt_s: 1.0 / (RATE_HZ as f64 * STEPS as f64),
            scheme: settings.scheme,
            threads: 1,
            path: settings.path,
        };
        let mut batch = Batch::with_room(count, &members, batch)?;
        let level = settings.level;
        if let Some(set_point) = level.set_point() {
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
        let mut part = Self {
            settings,
            batch,
            candidates,
            episodes: vec![episode; count],
            set_points: vec![0.0; count * level.command_numbers(ROTORS)],
            wings: vec![0.0; count * 2],
            actions: vec![0.0; count * level.numbers(ROTORS)],
            observation: vec![0.0; count * OBSERVATION],
            reward: vec![0.0; count],
            terms: vec![Terms::default(); count],
            terminated: vec![false; count],
            truncated: vec![false; count],
            played: Played::new(count),
            went: Ok(()),
        };
        for number in 0..count {
            part.seed(number, seed.wrapping_add(number as u64));
            part.begin(number)?;
        }
        Ok(part)
    }

    /// Environments.
    pub(super) fn len(&self) -> usize {
        self.episodes.len()
    }

    /// The stream of one environment.
    pub(super) fn stream(&mut self, number: usize) -> &mut Pcg64Mcg {
        &mut self.episodes[number].rng
    }

    pub(super) fn state(&self, number: usize) -> Result<(State<f32>, Reference), TaskError> {
        Ok((self.batch.state(number)?, self.episodes[number].reference()))
    }

    pub(super) fn obstacles(&self, number: usize) -> Vec<[f32; 3]> {
        let obstacles = self.episodes[number].course.obstacles();
        obstacles.iter().map(|o| [o.north_m, o.east_m, course::TRUNK_RADIUS_M]).collect()
    }

    /// A new stream for one environment, from its next episode on.
    pub(super) fn seed(&mut self, number: usize, seed: u64) {
        self.episodes[number].rng = Pcg64Mcg::seed_from_u64(seed);
    }

    /// Starts a new episode in every environment that `which` says; all of them look.
    pub(super) fn reset(&mut self, which: impl Fn(usize) -> bool) -> Result<(), TaskError> {
        self.played.happens(Event::Look);
        for number in 0..self.episodes.len() {
            if which(number) {
                self.begin(number)?;
            }
            self.look(number)?;
        }
        self.played.forget();
        Ok(())
    }

    /// One action of each.
    pub(super) fn step(&mut self) -> Result<(), TaskError> {
        self.played.happens(Event::Act(self.actions.clone().into_boxed_slice()));
        self.fly()?;
        self.played.forget();
        Ok(())
    }

    /// The same, of which nobody takes note.
    pub(super) fn fly(&mut self) -> Result<(), TaskError> {
        let level = self.settings.level;
        let width = level.command_numbers(ROTORS);
        for (number, action) in self.actions.chunks_exact(level.numbers(ROTORS)).enumerate() {
            let episode = &mut self.episodes[number];
            let candidate = &self.candidates[episode.candidate];
            let command = level.command(
                action,
                &candidate.span,
                &candidate.envelope,
                &candidate.tuned.vehicle,
            );
            self.set_points[width * number..][..width].copy_from_slice(&command.rotors[..width]);
            self.wings[2 * number..][..2].fill(command.wing);
            episode.wing = command.wing;
        }
        if level.set_point().is_some() {
            self.batch.set_points(&self.set_points)?;
        } else {
            self.batch.command(&self.set_points)?;
        }
        self.batch.command_wings(&self.wings)?;
        self.batch.step(STEPS);

        let longest = (self.settings.episode_s * RATE_HZ as f64).round() as usize;
        for number in 0..self.episodes.len() {
            if self.episodes[number].ended {
                self.begin(number)?;
                self.look(number)?;
                (self.reward[number], self.terminated[number], self.truncated[number]) =
                    (0.0, false, false);
                self.terms[number] = Terms::default();
                continue;
            }
            let state = self.batch.state(number)?;
            let episode = &mut self.episodes[number];
            episode.steps += 1;
            let reference = episode.reference();
            let verdict = episode.course.judge(&state, &reference);
            let truncated = !verdict.lost && episode.steps >= longest;
            episode.ended = verdict.lost || truncated;
            let seen = episode.see(&state, &reference);
            self.observation[OBSERVATION * number..][..OBSERVATION].copy_from_slice(&seen);
            (self.reward[number], self.terminated[number], self.truncated[number]) =
                (verdict.reward, verdict.lost, truncated);
            self.terms[number] = verdict.terms;
        }
        Ok(())
    }

    pub(super) fn look(&mut self, number: usize) -> Result<(), TaskError> {
        let state = self.batch.state(number)?;
        let episode = &mut self.episodes[number];
        let seen = episode.see(&state, &episode.reference());
        self.observation[OBSERVATION * number..][..OBSERVATION].copy_from_slice(&seen);
        Ok(())
    }

    /// Starts an episode.
    pub(super) fn begin(&mut self, number: usize) -> Result<(), TaskError> {
        let episode = &mut self.episodes[number];
        self.played.begins(number, &episode.rng);
        let candidate = course::draw_below(&mut episode.rng, self.candidates.len());
        let chosen = &self.candidates[candidate];
        if candidate != episode.candidate || episode.steps == 0 {
            self.batch.refit(number, &chosen.member)?;
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
        if chosen.member.effects.gust().is_some() {
            self.batch.set_air(number, &chosen.member, WindParameters::calm(), seed)?;
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
}

impl Episode {
    fn time_s(&self) -> f32 {
        self.steps as f32 / RATE_HZ as f32
    }

    fn reference(&self) -> Reference {
        self.course.reference(self.time_s())
    }

    fn see(&mut self, state: &State<f32>, reference: &Reference) -> [f32; OBSERVATION] {
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
        observe(&seen, reference)
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
    let velocity = In::new(wide(state.velocity.vector));
    Truth {
        position: In::new(wide(state.position.vector)),
        velocity,
        // As in still air, wings folded: the batch keeps air and wings to itself.
        through_air: ned_from_body.inverse() * velocity,
        ned_from_body,
        omega: In::new(wide(state.omega.vector)),
        // Of a vehicle that does not accelerate; no observation has it.
        specific_force: ned_from_body.inverse() * up,
        rotor_speed_rad_s: state.rotor_speed_rad_s.map(f64::from),
        // Those that are not there stand still.
        rotor_count: state.rotor_speed_rad_s.len(),
        rotor_load: 0.0,
        deployment: [0.0; 2],
        voltage_v: 0.0,
        current_a: 0.0,
    }
}
