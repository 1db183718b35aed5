//! The inner loop of the flight code on registers: set points to rotor speeds, between steps of the batch.
//!
//! Command filter, quaternion backstepping and rates as in `squirrel_core::control` (docs/equations.md B.3), with sines by
//! polynomials instead of libm: torques agree to 1e-5 of their size, not to the bit. The mixer is the flight code's own
//! (`squirrel_core::control::mix`).

use super::rows::Block;
use super::simd::{BLOCK, Kernel, Paths, Register};
use super::{Batch, BatchError, CHUNK, Call, Settings, Work, place, shape};
use nalgebra::convert;
use squirrel_core::control::backstepping::AttitudeGains;
use squirrel_core::control::backstepping::quaternion::Law;
use squirrel_core::control::mix::Table;
use squirrel_core::control::mixer::Mixer;
use squirrel_core::dynamics::State;
use squirrel_core::lane::functions::{all, half_turn_sine_and_cosine, limit, size, wrap};
use squirrel_core::lane::vector::cross;
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
        self.mixer.put(lane, mixer.table());
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
    let half = all::<L>(0.5);
    let (sr, cr) = half_turn_sine_and_cosine(course.angle[0] * half);
    let (sp, cp) = half_turn_sine_and_cosine(course.angle[1] * half);
    let (sy, cy) = half_turn_sine_and_cosine(course.angle[2] * half);
    let wanted = [
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    ];
    let two = all::<L>(2.0);
    let (sin_roll, cos_roll) = (two * sr * cr, cr * cr - sr * sr);
    let (sin_pitch, cos_pitch) = (two * sp * cp, cp * cp - sp * sp);
    let kinematics = Kinematics { sin_roll, cos_roll, sin_pitch, cos_pitch };
    let omega_d = kinematics.body_rate(&course.rate);
    let omega_d_dot = kinematics.body_acceleration(&course.rate, &acceleration);

    // q_e = q_d^-1 q
    let [w, x, y, z] = wanted;
    let [qw, qx, qy, qz] = *q;
    let eta = w * qw + x * qx + y * qy + z * qz;
    let error = [
        w * qx - x * qw - y * qz + z * qy,
        w * qy + x * qz - y * qw - z * qx,
        w * qz - x * qy + y * qx - z * qw,
    ];
    let near = all::<L>(0.1) - size(eta);
    let sign = eta.where_positive(all(1.0), all(-1.0));
    course.sign = near.where_positive(course.sign, sign);
    let sign = course.sign;

    let omega_d = back(&error, eta, &omega_d);
    let omega_d_dot = back(&error, eta, &omega_d_dot);
    let (mut z1, mut omega_e) = (error, *omega);
    for i in 0..3 {
        z1[i] = error[i] * sign;
        omega_e[i] = omega[i] - omega_d[i];
    }
    let turning = cross(&z1, &omega_e);
    let carried = cross(&omega_e, &omega_d);
    let mut omega_dot = [none; 3];
    let mut damping = [none; 3];
    for i in 0..3 {
        let z1_dot = (omega_e[i] * (eta * sign) + turning[i]) * half;
        let z2 = omega_e[i] + gains.c1[i] * z1[i] + gains.lambda[i] * course.integral[i];
        omega_dot[i] = omega_d_dot[i] - carried[i] - gains.c1[i] * z1_dot - gains.lambda[i] * z1[i];
        damping[i] = z1[i] * gains.k + gains.c2[i] * z2;
    }
    for i in 0..3 {
        let next = limit(course.integral[i] + z1[i] * dt, none - gains.integral_max, gains.integral_max);
        course.integral[i] = course.free.where_positive(next, course.integral[i]);
    }
    let gyroscopic = cross(omega, &gains.momentum(omega));
    let wanted = gains.momentum(&omega_dot);
    let mut torque = gyroscopic;
    for i in 0..3 {
        torque[i] = gyroscopic[i] + wanted[i] - damping[i];
    }
    torque
}

/// Torque for the body rates that are asked for: the innermost part of the attitude law.
#[inline(always)]
fn body_rate<L: Register>(gains: &Gains<L>, course: &Course<L>, omega: &[L; 3]) -> [L; 3] {
    let mut torque = cross(omega, &gains.momentum(omega));
    for i in 0..3 {
        torque[i] = torque[i] + gains.c2[i] * (course.set_point[i] - omega[i]);
    }
    torque
}

impl<L: Register> Gains<L> {
    /// Inertia times a vector.
    #[inline(always)]
    fn momentum(&self, v: &[L; 3]) -> [L; 3] {
        let mut product = *v;
        for row in 0..3 {
            product[row] =
                self.inertia[row] * v[0] + self.inertia[3 + row] * v[1] + self.inertia[6 + row] * v[2];
        }
        product
    }
}

/// Of Euler angles, see `squirrel_core::control::backstepping`.
struct Kinematics<L> {
    sin_roll: L,
    cos_roll: L,
    sin_pitch: L,
    cos_pitch: L,
}

impl<L: Register> Kinematics<L> {
    #[inline(always)]
    fn body_rate(&self, rate: &[L; 3]) -> [L; 3] {
        let Self { sin_roll: sr, cos_roll: cr, sin_pitch: sp, cos_pitch: cp } = *self;
        let [roll, pitch, yaw] = *rate;
        [roll - sp * yaw, cr * pitch + sr * cp * yaw, cr * cp * yaw - sr * pitch]
    }

    #[inline(always)]
    fn body_acceleration(&self, rate: &[L; 3], acceleration: &[L; 3]) -> [L; 3] {
        let Self { sin_roll: sr, cos_roll: cr, sin_pitch: sp, cos_pitch: cp } = *self;
        let [roll, pitch, yaw] = *rate;
        let [p, q, r] = self.body_rate(acceleration);
        [
            p - cp * pitch * yaw,
            q - sr * roll * pitch + (cr * cp * roll - sr * sp * pitch) * yaw,
            r - cr * roll * pitch - (sr * cp * roll + cr * sp * pitch) * yaw,
        ]
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

/// A vector in the frame that a rotation leads to: its inverse, applied.
#[inline(always)]
fn back<L: Register>(imaginary: &[L; 3], real_part: L, v: &[L; 3]) -> [L; 3] {
    let once = cross(v, imaginary);
    let two = all::<L>(2.0);
    let t = [once[0] * two, once[1] * two, once[2] * two];
    let twice = cross(&t, imaginary);
    let mut out = *v;
    for i in 0..3 {
        out[i] = v[i] + t[i] * real_part + twice[i];
    }
    out
}
