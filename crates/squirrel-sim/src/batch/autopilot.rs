//! The inner loop of the flight code on registers: set points to rotor speeds, between steps of the batch.
//!
//! Command filter, quaternion backstepping and rates as in `squirrel_core::control` (docs/equations.md B.3), with sines by
//! polynomials instead of libm: torques agree to 1e-5 of their size, not to the bit. The mixer is the flight code's own
//! (`squirrel_core::control::mix`).

use super::rows::Block;
use super::simd::{BLOCK, Kernel, Paths, Register};
use super::{Batch, BatchError, CHUNK, Call, Settings, Work, place, shape};
use nalgebra::convert;
use squirrel_core::control::backstepping::quaternion::{self, Law, Wanted, attitude_of_halves};
use squirrel_core::control::backstepping::{AttitudeGains, Tilt};
use squirrel_core::control::mix::Table;
use squirrel_core::control::mixer::Mixer;
use squirrel_core::dynamics::State;
use squirrel_core::lane::functions::{half_turn_sine_and_cosine, limit, wrap};
use squirrel_core::lane::vector::{cross, times};
use squirrel_core::lane::{Row, load, put, store};
use squirrel_core::math::real;
use squirrel_core::numbers;
use squirrel_core::vehicle::Vehicle;
use std::slice;

/// What the numbers of a set point are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SetPoint {
    /// Roll, pitch, yaw, rad, and collective thrust, N.
    Attitude,
    /// Body rates, rad/s, and collective thrust, N.
    BodyRate,
}

numbers! {
    /// What the loop is told and remembers.
    Course {
        set_point [4],
        /// Filtered roll, pitch, yaw, and their rates.
        angle [3], rate [3],
        /// Of the vector part of the attitude error, s.
        integral [3],
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
        /// By columns.
        inertia [9],
        inverse_thrust_coefficient
    }
}

/// The loops of a block.
#[derive(Debug, Clone)]
pub(super) struct Autopilots<S: Copy, const ROTORS: usize> {
    course: Course<Row<S>>,
    gains: Gains<Row<S>>,
    mixer: Table<Row<S>, ROTORS>,
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
            wait: 0,
        }
    }

    /// The loop of another vehicle in column `lane`.
    fn fit(&mut self, lane: usize, vehicle: &Vehicle<f32>, gains: &AttitudeGains, mixer: &Mixer) {
        let p = vehicle.parameters();
        let law =
            Law::from_euler_gains(&gains.c1_per_s, &gains.c2_per_s, &gains.lambda_per_s2, &p.inertia_kg_m2);
        let frequency = f64::from(gains.filter_frequency_rad_s);
        let all3 = |v: nalgebra::Vector3<f32>| [v.x, v.y, v.z].map(f64::from);
        let mut inertia = [0.0; 9];
        for (place, number) in inertia.iter_mut().zip(p.inertia_kg_m2.iter()) {
            *place = f64::from(*number);
        }
        let numbers = Gains {
            c1: all3(law.c1),
            c2: all3(law.c2),
            lambda: all3(law.lambda),
            k: f64::from(law.k),
            // The core limits the integral of the angle, which is twice the vector part.
            integral_max: 0.5 * f64::from(gains.integral_max_rad_s),
            stiffness: frequency * frequency,
            damping: 2.0 * f64::from(gains.filter_damping) * frequency,
            inertia,
            inverse_thrust_coefficient: 1.0 / f64::from(p.propulsion.thrust_coefficient_n_s2),
        };
        self.gains.put(lane, &numbers.map(real));
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
        course.sign[lane] = real(1.0);
        course.free[lane] = real(1.0);
    }

    /// Set points of the first vehicles.
    fn tell(&mut self, rows: &[S]) {
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
            let mixer = Table::<L, ROTORS>::load(&autopilots.mixer, start);
            let mixed = mixer.mix(ROTORS, course.set_point[3], torque);
            course.free = L::of(1.0) - mixed.saturated;
            let mut speed = mixed.rotor_thrust_n;
            for i in 0..ROTORS {
                speed[i] = (speed[i] * gains.inverse_thrust_coefficient).root();
            }
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
    let none = L::of(0.0);
    let mut acceleration = [none; 3];
    for i in 0..3 {
        let gap = wrap(course.set_point[i] - course.angle[i]);
        acceleration[i] = gap * gains.stiffness - course.rate[i] * gains.damping;
        course.rate[i] = course.rate[i] + acceleration[i] * dt;
        course.angle[i] = wrap(course.angle[i] + course.rate[i] * dt);
    }
    let half = L::of(0.5);
    let [roll, pitch, yaw] = [
        half_turn_sine_and_cosine(course.angle[0] * half),
        half_turn_sine_and_cosine(course.angle[1] * half),
        half_turn_sine_and_cosine(course.angle[2] * half),
    ];
    let tilt = Tilt::of_halves(roll, pitch);
    let target = Wanted {
        attitude: attitude_of_halves([roll, pitch, yaw]),
        omega: tilt.body_rate(&course.rate),
        omega_dot: tilt.body_acceleration(&course.rate, &acceleration),
    };
    let law = gains.law();
    let answer = law.torque(q, omega, &target, &course.integral, course.sign);
    course.sign = answer.sign;
    for i in 0..3 {
        let next = course.integral[i] + answer.z1[i] * dt;
        let next = limit(next, none - gains.integral_max, gains.integral_max);
        course.integral[i] = course.free.where_positive(next, course.integral[i]);
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
    fn law(&self) -> quaternion::Gains<L> {
        let [a, b, c, d, e, f, g, h, i] = self.inertia;
        let inertia = [[a, b, c], [d, e, f], [g, h, i]];
        quaternion::Gains { c1: self.c1, c2: self.c2, lambda: self.lambda, k: self.k, inertia }
    }
}

/// How the loops of a batch act.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Autopilot {
    /// What they are told.
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
    /// Puts an inner loop between the steps and [`Self::set_points`] in the place of [`Self::command`]. All of them hold what they
    /// have now, with no thrust, until they are told.
    ///
    /// * `tuned` - one for each vehicle
    ///
    /// # Errors
    /// A length that is not [`Self::len`], a period of no steps, gains or a layout that cannot be used.
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
                let Some(autopilots) = &mut block.autopilots else { return Err(BatchError::NoAutopilot) };
                autopilots.tell(rows);
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
