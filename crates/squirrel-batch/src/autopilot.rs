//! The inner loop of the flight code on registers: set points to rotor speeds, between steps of the
//! batch.
//!
//! Yaw limit, command filter, quaternion backstepping (docs/equations.md B.3), lead and mixer are of
//! `squirrel_core::control`, and what rotors are told is what they make of the flight code's
//! commands: in `f32` a vehicle has the flight code's bits (`tests/batch_autopilot.rs`,
//! `tests/tasks.rs`).

use super::rows::Block;
use super::{Batch, BatchError, CHUNK, Call, Settings, Work, place, shape};
use nalgebra::convert;
use squirrel_core::control::backstepping::quaternion::{Law, Target};
use squirrel_core::control::backstepping::{AttitudeGains, integrated, yaw_target};
use squirrel_core::control::command_filter::{Filter, Poles};
use squirrel_core::control::lead::Lead;
use squirrel_core::control::mix::Table;
use squirrel_core::control::mixer::Mixer;
use squirrel_core::dynamics::State;
use squirrel_core::lane::functions::limit;
use squirrel_core::lane::vector::{cross, heading, times};
use squirrel_core::lane::{Row, load, put, store};
use squirrel_core::math::real;
use squirrel_core::numbers;
use squirrel_core::vehicle::{CommandKind, Vehicle};
use squirrel_sim::simd::{BLOCK, Kernel, Paths, Register};
use squirrel_sim::tape::{Tape, on_tape};
use std::slice;

/// What the numbers of a set point are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SetPoint {
    /// Roll, pitch, yaw, rad, and collective thrust, N. Yaw is turned to as in flight: by 20 deg
    /// ahead of the measured one at most.
    Attitude,
    /// Body rates, rad/s, and collective thrust, N.
    BodyRate,
}

numbers! {
    /// Set point and memory of the loop.
    Course {
        set_point [4],
        /// Filtered roll, pitch, yaw, and their rates.
        angle [3], rate [3],
        /// Of the vector part of the attitude error, s.
        integral [3],
        /// See [`Lead`], N m.
        followed [3],
        /// 1, or -1 where the long way round is taken.
        sign,
        /// 1, or 0 where the rotors could not do what was asked.
        free
    }
}

numbers! {
    /// What it knows of the vehicle, and its gains.
    Gains {
        c1 [3], c2 [3], lambda [3], k, integral_max,
        /// Square of the filter's frequency, and twice its damping times frequency.
        stiffness, damping,
        /// Of [`Lead`].
        lead, lead_lag,
        /// By columns.
        inertia [3] [3],
        thrust_coefficient,
        /// Speed at full command, rad/s, or 0 where a command is not a part of it.
        full_speed
    }
}

/// The loops of a block. Rows first, as in a [`Block`].
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Autopilots<S: Copy, const ROTORS: usize> {
    course: Course<Row<S>>,
    gains: Gains<Row<S>>,
    mixer: Table<Row<S>, ROTORS>,
    /// What the mixer gave last, N.
    thrust: [Row<S>; ROTORS],
    /// Of vehicles whose commands are pulses or voltages: these are rounded on the way from a
    /// thrust to a speed.
    rounding: [Option<Box<Vehicle<f32>>>; BLOCK],
    /// Steps until the loops act again.
    wait: usize,
}

impl<S: Paths, const ROTORS: usize> Autopilots<S, ROTORS> {
    fn empty() -> Self {
        let none = [real::<S>(0.0); BLOCK];
        let one = [real::<S>(1.0); BLOCK];
        Self {
            course: Course { sign: one, free: one, ..Course::all(none) },
            gains: Gains::all(none),
            mixer: Table::all(none),
            thrust: [none; ROTORS],
            rounding: [const { None }; BLOCK],
            wait: 0,
        }
    }

    /// The loop of another vehicle in column `lane`.
    fn fit(&mut self, lane: usize, vehicle: &Vehicle<f32>, gains: &AttitudeGains, mixer: &Mixer) {
        let p = vehicle.parameters();
        let [c1, c2, lambda] =
            [gains.c1_per_s, gains.c2_per_s, gains.lambda_per_s2].map(Into::into);
        let law = Law::<f32>::from_euler_gains(&c1, &c2, &lambda, &p.inertia_kg_m2.into());
        let poles = Poles::new(gains.filter_frequency_rad_s, gains.filter_damping);
        let lead = Lead::new(gains.rotor_lead, &p.propulsion);
        let is_part =
            matches!(p.propulsion.command, CommandKind::SpeedFraction | CommandKind::Duty);
        let rounds = p.propulsion.thrust_curve.is_some()
            || p.propulsion.command == CommandKind::PwmMicroseconds;
        self.rounding[lane] = rounds.then(|| Box::new(*vehicle));
        let numbers = Gains {
            c1: law.c1,
            c2: law.c2,
            lambda: law.lambda,
            k: law.k,
            // The core limits the integral of the angle, which is twice the vector part.
            integral_max: 0.5 * gains.integral_max_rad_s,
            stiffness: poles.stiffness,
            damping: poles.damping,
            lead: lead.gain,
            lead_lag: lead.lag_s,
            inertia: law.inertia,
            thrust_coefficient: p.propulsion.thrust_coefficient_n_s2,
            full_speed: if is_part { p.propulsion.speed_max_rad_s } else { 0.0 },
        };
        let numbers = numbers.map(|number: f32| real(f64::from(number)));
        self.gains.put(lane, &numbers);
        self.mixer.put(lane, &mixer.table().first());
    }

    /// Forgets what was; the filter starts at this attitude.
    ///
    /// * `angle` - roll, pitch, yaw, rad
    pub(super) fn rest(&mut self, lane: usize, angle: [f64; 3]) {
        let course = &mut self.course;
        put(&mut course.angle, lane, angle.map(real));
        put(&mut course.rate, lane, [real(0.0); 3]);
        put(&mut course.integral, lane, [real(0.0); 3]);
        put(&mut course.followed, lane, [real(0.0); 3]);
        course.sign[lane] = real(1.0);
        course.free[lane] = real(1.0);
    }

    /// Everything that changes between two steps.
    pub(super) fn keep(&mut self, tape: &mut Tape<'_>) -> Option<()> {
        on_tape!(tape, self.course)?;
        tape.rows(&mut self.thrust)?;
        self.wait = tape.count(self.wait)?;
        Some(())
    }

    /// Set points of the first vehicles.
    fn set(&mut self, rows: &[S]) {
        for (lane, row) in rows.chunks_exact(4).enumerate() {
            for (place, number) in self.course.set_point.iter_mut().zip(row) {
                place[lane] = *number;
            }
        }
    }
}

/// One act of the loops of a block.
struct Act<'a, S: Copy, const ROTORS: usize> {
    block: &'a mut Block<S, ROTORS>,
    set_point: SetPoint,
    period_s: S,
}

impl<S: Paths, const ROTORS: usize> Kernel<S> for Act<'_, S, ROTORS> {
    type Output = ();

    #[inline(always)]
    fn run<L: Register<Element = S>>(self) {
        let Self { block, set_point, period_s } = self;
        let starts = block.starts::<L>();
        let Block { motion, held, autopilots: Some(autopilots), .. } = block else { return };
        let dt = L::splat(period_s);
        for start in starts {
            let gains = Gains::<L>::load(&autopilots.gains, start);
            let mut course = Course::<L>::load(&autopilots.course, start);
            let omega = load::<L, 3>(&motion.omega, start);
            let torque = match set_point {
                SetPoint::Attitude => {
                    attitude(&gains, &mut course, &load(&motion.attitude, start), &omega, dt)
                }
                SetPoint::BodyRate => body_rate(&gains, &course, &omega),
            };
            let lead = Lead { gain: gains.lead, lag_s: gains.lead_lag };
            let torque = lead.step(&mut course.followed, &torque, dt);
            let mixer = Table::<L, ROTORS>::load(&autopilots.mixer, start);
            let mixed = mixer.mix(ROTORS, course.set_point[3], torque);
            course.free = L::of(1.0) - mixed.saturated;
            let mut speed = mixed.rotor_thrust_n;
            for i in 0..ROTORS {
                speed[i] = gains.target_speed(mixed.rotor_thrust_n[i]);
            }
            store(&mixed.rotor_thrust_n, &mut autopilots.thrust, start);
            store(&speed, &mut held.target_speed, start);
            course.store(&mut autopilots.course, start);
        }
    }
}

/// Torque for the attitude that is asked for, by way of the command filter.
#[inline(always)]
fn attitude<L: Register>(
    gains: &Gains<L>,
    course: &mut Course<L>,
    q: &[L; 4],
    omega: &[L; 3],
    dt: L,
) -> [L; 3] {
    let [roll, pitch, yaw, _] = course.set_point;
    let target = [roll, pitch, yaw_target(heading(q), yaw)];
    let mut filter = Filter { angle: course.angle, rate: course.rate };
    let poles = Poles { stiffness: gains.stiffness, damping: gains.damping };
    let acceleration = filter.step(&target, &poles, dt);
    Filter { angle: course.angle, rate: course.rate } = filter;
    let target = Target::from_euler(&filter.angle, &filter.rate, &acceleration);
    let answer = gains.law().torque(q, omega, &target, &course.integral, course.sign);
    course.sign = answer.sign;
    let next = integrated(&course.integral, &answer.z1, gains.integral_max, dt);
    for i in 0..3 {
        course.integral[i] = course.free.where_positive(next[i], course.integral[i]);
    }
    answer.torque
}

/// Torque for the body rates that are asked for: the innermost part of the attitude law.
#[inline(always)]
fn body_rate<L: Register>(gains: &Gains<L>, course: &Course<L>, omega: &[L; 3]) -> [L; 3] {
    let mut torque = cross(omega, &times(&gains.law().inertia, omega));
    for i in 0..3 {
        torque[i] = torque[i] + gains.c2[i] * (course.set_point[i] - omega[i]);
    }
    torque
}

impl<L: Register> Gains<L> {
    #[inline(always)]
    fn law(&self) -> Law<L> {
        let Self { c1, c2, lambda, k, inertia, .. } = *self;
        Law { c1, c2, lambda, k, inertia }
    }

    /// What a rotor makes of the command for a thrust, as `Propulsion` does with a part of the full
    /// speed or with the thrust itself.
    #[inline(always)]
    fn target_speed(&self, thrust_n: L) -> L {
        let (none, one) = (L::of(0.0), L::of(1.0));
        let speed = (thrust_n / self.thrust_coefficient).root();
        let part = limit(speed / self.full_speed, none, one) * self.full_speed;
        self.full_speed.where_positive(part, speed)
    }
}

impl<S: Paths, const ROTORS: usize> Block<S, ROTORS> {
    /// Speeds of rotors whose commands are rounded on the way to them.
    fn round_commands(&mut self) {
        let Some(autopilots) = &self.autopilots else { return };
        for (lane, vehicle) in autopilots.rounding.iter().enumerate() {
            let Some(vehicle) = vehicle else { continue };
            let (propulsion, rotors) = (&vehicle.parameters().propulsion, vehicle.rotors().len());
            for (speed, thrust) in
                self.held.target_speed.iter_mut().zip(&autopilots.thrust).take(rotors)
            {
                let thrust_n = nalgebra::try_convert(thrust[lane]).unwrap_or(f64::NAN) as f32;
                let command = propulsion.command_for_thrust(thrust_n);
                speed[lane] = real(f64::from(propulsion.target_speed_rad_s(command)));
            }
        }
    }
}

/// How the loops of a batch act.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Autopilot {
    /// What their set points are.
    pub set_point: SetPoint,
    /// Steps of the batch from one act to the next.
    pub period_steps: usize,
}

/// What the loop of one vehicle believes and how it reacts.
#[derive(Debug, Clone)]
pub struct Tuned {
    /// The vehicle as the flight code knows it.
    pub vehicle: Vehicle<f32>,
    /// Its gains; the quaternion law whatever their form.
    pub gains: AttitudeGains,
}

/// Takes the steps of a call, with the loops in between.
#[inline(never)]
pub(super) fn flown<T: Paths, const ROTORS: usize>(
    blocks: &mut [Block<T, ROTORS>],
    work: Work<T, ROTORS>,
    call: Call,
    autopilot: Autopilot,
) {
    let Settings { dt_s, path, .. } = call.settings;
    let period_s = convert(dt_s * autopilot.period_steps as f64);
    for block in blocks {
        let mut left = call.steps;
        while left > 0 {
            let Some(autopilots) = &mut block.autopilots else { return };
            if autopilots.wait == 0 {
                autopilots.wait = autopilot.period_steps;
                let before = block.held.target_speed;
                T::run(path, Act { block, set_point: autopilot.set_point, period_s });
                block.round_commands();
                block.delay(&before);
            }
            let Some(autopilots) = &mut block.autopilots else { return };
            let steps = left.min(autopilots.wait);
            autopilots.wait -= steps;
            left -= steps;
            work(slice::from_mut(block), Call { steps, ..call });
        }
    }
}

impl<T: Paths, const ROTORS: usize> Batch<T, ROTORS> {
    /// Puts an inner loop between the steps and [`Self::set_points`] in the place of
    /// [`Self::command`]. All of them hold what they have now, with no thrust, until they are told.
    ///
    /// * `tuned` - one for each vehicle
    ///
    /// # Errors
    /// A length that is not [`Self::len`], a period of no steps, gains or a layout that cannot be
    /// used.
    pub fn engage(&mut self, autopilot: Autopilot, tuned: &[Tuned]) -> Result<(), BatchError> {
        shape("vehicles of the autopilot", tuned.len(), self.len())?;
        if autopilot.period_steps == 0 {
            return Err(BatchError::Period);
        }
        let mixers = tuned.iter().enumerate().map(|(number, one)| one.mixer(number));
        let mixers: Vec<Mixer> = mixers.collect::<Result<_, _>>()?;
        for chunk in 0..self.len().div_ceil(BLOCK * CHUNK) {
            for block in &mut self.pool.chunk(chunk).blocks {
                block.autopilots = Some(Box::new(Autopilots::empty()));
            }
        }
        for (number, (one, mixer)) in tuned.iter().zip(&mixers).enumerate() {
            self.fit(number, one, mixer);
        }
        self.autopilot = Some((flown, autopilot));
        Ok(())
    }

    /// Another inner loop for one vehicle; it starts anew from where the vehicle is.
    ///
    /// # Errors
    /// As [`Self::engage`]; no such vehicle.
    pub fn retune(&mut self, number: usize, tuned: &Tuned) -> Result<(), BatchError> {
        self.check(number)?;
        self.fit(number, tuned, &tuned.mixer(number)?);
        Ok(())
    }

    fn fit(&mut self, number: usize, tuned: &Tuned, mixer: &Mixer) {
        let (chunk, block, lane) = place(number);
        let mut chunk = self.pool.chunk(chunk);
        let block = &mut chunk.blocks[block];
        let angle = euler(&block.state(lane));
        if let Some(autopilots) = &mut block.autopilots {
            autopilots.fit(lane, &tuned.vehicle, &tuned.gains, mixer);
            autopilots.rest(lane, angle);
        }
    }

    /// Tells the loops what to do from now on.
    ///
    /// * `rows` - four numbers for each vehicle, see [`SetPoint`]; NaN counts as some number
    ///
    /// # Errors
    /// A length that is not four times [`Self::len`]; no loops, see [`Self::engage`].
    pub fn set_points(&mut self, rows: &[T]) -> Result<(), BatchError> {
        shape("set points", rows.len(), self.len() * 4)?;
        for (chunk, rows) in rows.chunks(4 * BLOCK * CHUNK).enumerate() {
            let mut chunk = self.pool.chunk(chunk);
            for (block, rows) in chunk.blocks.iter_mut().zip(rows.chunks(4 * BLOCK)) {
                let Some(autopilots) = &mut block.autopilots else {
                    return Err(BatchError::NoAutopilot);
                };
                autopilots.set(rows);
            }
        }
        Ok(())
    }
}

impl Tuned {
    fn mixer(&self, vehicle: usize) -> Result<Mixer, BatchError> {
        let fail = |problem| BatchError::Airframe { vehicle, problem };
        self.gains.check().map_err(fail)?;
        Mixer::new(&self.vehicle).map_err(fail)
    }
}

/// Roll, pitch, yaw, rad.
pub(super) fn euler<T: Paths>(state: &State<T>) -> [f64; 3] {
    let (roll, pitch, yaw) = state.ned_from_body().euler();
    [roll, pitch, yaw].map(|x| nalgebra::try_convert(x).unwrap_or(f64::NAN))
}
