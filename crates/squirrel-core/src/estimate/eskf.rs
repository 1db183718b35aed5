//! Position, velocity, attitude and the inertial unit's biases by an error-state Kalman filter of
//! fifteen states: the default.
//!
//! Source: Sola, "Quaternion kinematics for the error-state Kalman filter", 2017, with the
//! attitude's error about body axes; docs/equations.md C.2. The inertial unit moves the state,
//! everything else corrects it:
//!
//! ```text
//! p' = v,  v' = R (f - b_a) + g e3,  q' = q (w - b_g) / 2
//! d_p' = d_v,  d_v' = -R [f - b_a]x d - R d_ba,  d' = -[w - b_g]x d - d_bg
//! ```
//! A satellite fix is late: it is compared with where the filter was then, which it remembers
//! (`Past`), and errors of velocity, turn and bias have carried the state along since. Measurements
//! are fused number by number, each with an innovation gate, so that an outlier costs nothing.
//! Fixes that are rejected for long are fused after all. A barometer that is rejected for long has
//! jumped: its zero is moved to where the filter is. A compass is never fused against the rest.
//! Where all fixes contradict the filter for seconds, the filter is wrong: it starts anew from the
//! accelerometer and the next fix.

use super::covariance::{ACCEL_BIAS, GYRO_BIAS, POSITION, StateVector, TURN, VELOCITY};
use super::covariance::{Carry, cross_covariance, on_diagonal, set, symmetrise};
pub use super::covariance::{Covariance, STATES};
use super::{
    Estimate, Estimator, STEP_MAX_S, Sensed, cross, down, heading_error, levelled, turned,
};
use crate::frames::{Body, In, Ned, Rotation};
use crate::math::{GRAVITY_M_S2, limit, lower, upper};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Moments that are remembered, and the time between them, s: a fix may be 0.3 s late.
const MOMENTS: usize = 32;
const MOMENT_S: f32 = 0.01;
/// Without a fix for so long, s, the accelerometer is all that says where down is.
const NO_FIX_S: f32 = 0.5;
/// Variance beyond which nothing is known, SI.
const VARIANCE_MAX: f32 = 1e8;
/// A compass errs by its vehicle's iron: so many times the deviation of a reading stands for many
/// that err alike.
const COMPASS_MEMORY: f32 = 10.0;
/// A fix's normalised innovation squared, over its numbers, counts for so much at most in the mean:
/// a few outliers are no fault of the filter.
const NIS_MAX: f32 = 30.0;
/// Share of a fix's normalised innovation squared (NIS) in the filtered one.
const NIS_FILTER_GAIN: f32 = 0.05;
/// Filtered NIS at which the filter starts anew: after two seconds of fixes beyond their gate.
const NIS_RESTART: f32 = 20.0;
/// Biases beyond these are errors of something else, m/s^2 and rad/s.
const ACCEL_BIAS_MAX_M_S2: f32 = 1.0;
const GYRO_BIAS_MAX_RAD_S: f32 = 0.3;
/// Standard deviation of the attitude after that, rad.
const RESTART_ATTITUDE_SD_RAD: f32 = 0.5;
/// Rejections in a row after which the sensor is right and the filter wrong.
const REJECTIONS_BEFORE_RESET: u8 = 20;
/// Rejections in a row after which the aid is reported as faulty.
const REJECTIONS_BEFORE_FAULT: u8 = 3;

/// Numbers of the filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EskfParameters {
    /// Of the gyro per sample, rad/s.
    pub gyro_noise_rad_s: f32,
    /// Of the accelerometer per sample, vibration included, m/s^2.
    pub accel_noise_m_s2: f32,
    /// Walk of the gyro's bias, rad/s per root second.
    pub gyro_walk_rad_s_root_s: f32,
    /// Walk of the accelerometer's bias, m/s^2 per root second.
    pub accel_walk_m_s2_root_s: f32,
    /// Standard deviations at the start: inclination, rad.
    pub start_turn_rad: f32,
    /// Heading, rad.
    pub start_heading_rad: f32,
    /// Of the gyro's bias, rad/s.
    pub start_gyro_bias_rad_s: f32,
    /// Of the accelerometer's bias, m/s^2.
    pub start_accel_bias_m_s2: f32,
    /// Of a fix's position, m.
    pub gnss_position_noise_m: f32,
    /// Of a fix's velocity, m/s.
    pub gnss_velocity_noise_m_s: f32,
    /// From a fix to its arrival, s; at most 0.3.
    pub gnss_latency_s: f32,
    /// Of the barometer per sample, m.
    pub baro_noise_m: f32,
    /// Of the compass's heading, rad: iron that nobody took off included.
    pub heading_noise_rad: f32,
    /// What the accelerometer may be off gravity where there are no fixes, m/s^2: of each sample as
    /// if they erred apart, though a turn of 3 m/s^2 lasts a second and a rotor's thrust always
    /// points along body z. Less than this lays the vehicle level in a turn without fixes.
    pub alone_noise_m_s2: f32,
    /// Deviations beyond which a measurement is rejected.
    pub gate: f32,
}

impl Default for EskfParameters {
    fn default() -> Self {
        Self {
            gyro_noise_rad_s: 0.0045,
            accel_noise_m_s2: 0.25,
            gyro_walk_rad_s_root_s: 1e-4,
            accel_walk_m_s2_root_s: 1e-3,
            start_turn_rad: 0.05,
            start_heading_rad: 0.05,
            start_gyro_bias_rad_s: 0.01,
            start_accel_bias_m_s2: 0.1,
            gnss_position_noise_m: 0.05,
            gnss_velocity_noise_m_s: 0.05,
            gnss_latency_s: 0.0,
            baro_noise_m: 0.1,
            heading_noise_rad: 0.05,
            alone_noise_m_s2: 40.0,
            gate: 5.0,
        }
    }
}

/// Where the filter was: position and velocity, the newest first.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Past {
    moments: [[Vector3<f32>; 2]; MOMENTS],
    newest: usize,
    known: usize,
    /// Since the newest, s.
    age_s: f32,
}

impl Past {
    fn remember(&mut self, now: [Vector3<f32>; 2], dt_s: f32) {
        self.age_s += dt_s;
        if self.age_s >= MOMENT_S {
            // Steps longer than a moment are moments: ages are then too small by what they are
            // longer, which no flight code's are.
            self.age_s = limit(self.age_s - MOMENT_S, 0.0, MOMENT_S);
            self.newest = (self.newest + MOMENTS - 1) % MOMENTS;
            self.moments[self.newest % MOMENTS] = now;
            self.known = (self.known + 1).min(MOMENTS);
        }
    }

    /// Where it was `late_s` ago, as far as it remembers.
    fn at(&self, now: [Vector3<f32>; 2], late_s: f32) -> [Vector3<f32>; 2] {
        if late_s <= self.age_s || self.known == 0 {
            let share = limit(late_s / (self.age_s + 1e-9), 0.0, 1.0);
            let then = if self.known == 0 { now } else { self.moments[self.newest % MOMENTS] };
            return [now[0].lerp(&then[0], share), now[1].lerp(&then[1], share)];
        }
        let back = (late_s - self.age_s) / MOMENT_S;
        let whole = (limit(back, 0.0, (MOMENTS - 1) as f32) as usize).min(self.known - 1);
        let (a, b) = (whole, (whole + 1).min(self.known - 1));
        let share = limit(back - whole as f32, 0.0, 1.0);
        let [a, b] = [a, b].map(|i| self.moments[(self.newest + i) % MOMENTS]);
        [a[0].lerp(&b[0], share), a[1].lerp(&b[1], share)]
    }

    /// An error that is put right now was another one then.
    ///
    /// * `acceleration` - that the rest of the error makes
    fn correct(
        &mut self,
        position: &Vector3<f32>,
        velocity: &Vector3<f32>,
        acceleration: &Vector3<f32>,
    ) {
        for back in 0..MOMENTS {
            let ago_s = self.age_s + back as f32 * MOMENT_S;
            let moment = &mut self.moments[(self.newest + back) % MOMENTS];
            moment[0] += position - (velocity - acceleration * (0.5 * ago_s)) * ago_s;
            moment[1] += velocity - acceleration * ago_s;
        }
    }
}

/// The filter of one vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eskf {
    parameters: EskfParameters,
    position: Vector3<f32>,
    velocity: Vector3<f32>,
    attitude: UnitQuaternion<f32>,
    accel_bias: Vector3<f32>,
    gyro_bias: Vector3<f32>,
    /// As it was calibrated.
    start_bias: Vector3<f32>,
    covariance: Covariance,
    past: Past,
    /// A fix has said where it is.
    placed: bool,
    /// Since the last fix, s.
    time_since_fix_s: f32,
    rejected: Rejected,
    /// What the barometer has jumped by, m.
    baro_offset_m: f32,
    /// Rejected since the start.
    rejections: u32,
    /// Low-passed NIS of fixes, over their numbers: 1 where the filter errs as it says.
    filtered_nis: f32,
    /// How often it started anew.
    restarts: u32,
    /// Sum of the last step's innovations squared over their variances, and how many there were.
    nis: (f32, u32),
}

/// In a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Rejected {
    fixes: u8,
    altitudes: u8,
    fields: u8,
}

/// Which of the filter's aids contradict it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AidFaults {
    /// Satellite fixes.
    pub gnss: bool,
    /// Barometer.
    pub baro: bool,
    /// Compass.
    pub compass: bool,
}

impl Eskf {
    /// Where the first fix will say.
    ///
    /// * `gyro_bias` - to begin with, rad/s
    pub fn new(
        parameters: EskfParameters,
        start: Rotation<Ned, Body, f32>,
        gyro_bias: In<Body, f32>,
    ) -> Self {
        let here = [Vector3::zeros(); 2];
        Self {
            parameters,
            position: Vector3::zeros(),
            velocity: Vector3::zeros(),
            attitude: start.quaternion,
            accel_bias: Vector3::zeros(),
            gyro_bias: gyro_bias.vector,
            start_bias: gyro_bias.vector,
            covariance: at_start(&parameters),
            past: Past { moments: [here; MOMENTS], newest: 0, known: 0, age_s: 0.0 },
            placed: false,
            time_since_fix_s: 0.0,
            rejected: Rejected::default(),
            baro_offset_m: 0.0,
            rejections: 0,
            filtered_nis: 1.0,
            restarts: 0,
            nis: (0.0, 0),
        }
    }

    /// Not where the first fix will say, but here, at rest.
    #[must_use]
    pub fn placed_at(mut self, position: In<Ned, f32>) -> Self {
        self.place(position.vector, Vector3::zeros());
        self
    }

    /// It is here, and came here in a straight line.
    fn place(&mut self, position: Vector3<f32>, velocity: Vector3<f32>) {
        (self.position, self.velocity, self.placed) = (position, velocity, true);
        for (back, moment) in self.past.moments.iter_mut().enumerate() {
            *moment = [position - velocity * (back as f32 * MOMENT_S), velocity];
        }
        (self.past.newest, self.past.known, self.past.age_s) = (0, MOMENTS, 0.0);
    }

    /// Covariance of the error, in the order of [`STATES`]: NED, but the turn about body axes; SI.
    pub fn covariance(&self) -> &Covariance {
        &self.covariance
    }

    /// Bias of the accelerometer, m/s^2.
    pub fn accel_bias(&self) -> In<Body, f32> {
        In::new(self.accel_bias)
    }

    /// Measurements that were too far off to be fused, so far.
    pub fn rejections(&self) -> u32 {
        self.rejections
    }

    /// Which aids contradict the filter now.
    pub fn aid_faults(&self) -> AidFaults {
        let Rejected { fixes, altitudes, fields } = self.rejected;
        AidFaults {
            gnss: fixes >= REJECTIONS_BEFORE_FAULT,
            baro: altitudes >= REJECTIONS_BEFORE_FAULT,
            compass: fields >= REJECTIONS_BEFORE_FAULT,
        }
    }

    /// How often everything contradicted the filter for so long that it started anew.
    pub fn restarts(&self) -> u32 {
        self.restarts
    }

    /// Time since the last fix that was fused, s.
    pub fn time_since_fix_s(&self) -> f32 {
        self.time_since_fix_s
    }

    /// Normalised innovation squared of the last step: the sum, and how many numbers were measured.
    pub fn nis(&self) -> (f32, u32) {
        self.nis
    }

    /// Low-passes the NIS of this step's fix, which is the first to be fused.
    fn filter_nis(&mut self) {
        let (squares, numbers) = self.nis;
        let mean = limit(squares / upper(numbers as f32, 1.0), 0.0, NIS_MAX);
        self.filtered_nis += (mean - self.filtered_nis) * NIS_FILTER_GAIN;
    }

    /// From where it is, level by the accelerometer; the next fix says the rest.
    fn restart(&mut self, specific_force: &Vector3<f32>) {
        if let Some(down) = (-specific_force).try_normalize(1.0) {
            self.attitude = levelled(&self.attitude, &down);
        }
        let turn = RESTART_ATTITUDE_SD_RAD;
        let p = EskfParameters { start_turn_rad: turn, start_heading_rad: turn, ..self.parameters };
        self.covariance = at_start(&p);
        (self.accel_bias, self.gyro_bias) = (Vector3::zeros(), self.start_bias);
        self.placed = false;
        self.rejected = Rejected { altitudes: REJECTIONS_BEFORE_RESET - 1, ..Rejected::default() };
        self.filtered_nis = 1.0;
        self.restarts = self.restarts.saturating_add(1);
    }

    fn predict(&mut self, omega: &Vector3<f32>, force: &Vector3<f32>, dt_s: f32) {
        let p = self.parameters;
        let ned_from_body = self.attitude.to_rotation_matrix().into_inner();
        let acceleration = ned_from_body * force + Vector3::new(0.0, 0.0, GRAVITY_M_S2 as f32);
        self.position += (self.velocity + acceleration * (0.5 * dt_s)) * dt_s;
        self.velocity += acceleration * dt_s;
        self.attitude = turned(&self.attitude, &(omega * dt_s));

        let of_turn = ned_from_body * cross(force) * -dt_s;
        let of_bias = ned_from_body * -dt_s;
        let turning = Matrix3::identity() - cross(omega) * dt_s;
        let carry = Carry { of_turn, of_bias, turning, dt_s };
        carry.on(&mut self.covariance);
        let c = &mut self.covariance;
        for (part, variance) in [
            (VELOCITY, square(p.accel_noise_m_s2 * dt_s)),
            (TURN, square(p.gyro_noise_rad_s * dt_s)),
            (ACCEL_BIAS, square(p.accel_walk_m_s2_root_s) * dt_s),
            (GYRO_BIAS, square(p.gyro_walk_rad_s_root_s) * dt_s),
        ] {
            on_diagonal(c, part, |x| x + variance);
        }
    }

    /// Fuses one measured number, `row` times the error plus noise, into the `correction` so far.
    ///
    /// * `residual` - measured less predicted, before any correction of this step
    /// * `is_gated` - reject it beyond the gate
    ///
    /// Whether it was fused.
    fn update(
        &mut self,
        correction: &mut StateVector,
        row: &StateVector,
        residual: f32,
        noise: f32,
        is_gated: bool,
    ) -> bool {
        let cross_covariance = cross_covariance(&self.covariance, row);
        let innovation_variance = row.dot(&cross_covariance) + square(noise);
        let innovation = residual - row.dot(correction);
        // NaN is rejected, too.
        let inside_gate = square(innovation) <= square(self.parameters.gate) * innovation_variance;
        self.nis.0 += square(innovation) / innovation_variance;
        self.nis.1 += 1;
        if !(inside_gate || (!is_gated && innovation.is_finite() && innovation_variance > 0.0)) {
            return false;
        }
        let gain = cross_covariance / innovation_variance;
        *correction += gain * innovation;
        self.covariance.ger(-1.0, &gain, &cross_covariance, 1.0);
        true
    }

    /// Puts an error into the state.
    fn inject(&mut self, correction: &StateVector, of_turn: &Matrix3<f32>, of_bias: &Matrix3<f32>) {
        let part = |at: usize| correction.fixed_rows::<3>(at).into_owned();
        self.position += part(POSITION);
        self.velocity += part(VELOCITY);
        self.attitude = turned(&self.attitude, &part(TURN));
        self.accel_bias += part(ACCEL_BIAS);
        self.gyro_bias += part(GYRO_BIAS);
        if part(POSITION) != Vector3::zeros() || part(VELOCITY) != Vector3::zeros() {
            let acceleration = of_turn * part(TURN) + of_bias * part(ACCEL_BIAS);
            self.past.correct(&part(POSITION), &part(VELOCITY), &acceleration);
        }
    }

    /// Counts a rejection; how many they are in a row now.
    fn count(&mut self, before: u8, fused: bool) -> u8 {
        self.rejections = self.rejections.saturating_add(u32::from(!fused));
        if fused { 0 } else { before.saturating_add(1) }
    }
}

impl Estimator for Eskf {
    fn step(&mut self, sensed: &Sensed) {
        let p = self.parameters;
        let dt_s = lower(sensed.dt_s, STEP_MAX_S);
        let omega = sensed.imu.omega.vector - self.gyro_bias;
        let force = sensed.imu.specific_force.vector - self.accel_bias;
        self.predict(&omega, &force, dt_s);
        self.past.remember([self.position, self.velocity], dt_s);
        self.time_since_fix_s = lower(self.time_since_fix_s + dt_s, 1e6);
        self.nis = (0.0, 0);

        // What a turn and a bias do to the acceleration.
        let ned_from_body = self.attitude.to_rotation_matrix().into_inner();
        let (of_turn, of_bias) = (-(ned_from_body * cross(&force)), -ned_from_body);
        let mut correction = StateVector::zeros();
        let unit = |at: usize| {
            let mut row = StateVector::zeros();
            set(&mut row, at, 1.0);
            row
        };
        if let Some(gnss) = &sensed.gnss {
            let late_s = p.gnss_latency_s;
            if !self.placed {
                self.place(
                    gnss.position.vector + gnss.velocity.vector * late_s,
                    gnss.velocity.vector,
                );
            }
            let then = self.past.at([self.position, self.velocity], late_s);
            let (position, velocity) =
                (gnss.position.vector - then[0], gnss.velocity.vector - then[1]);
            let is_gated = self.rejected.fixes < REJECTIONS_BEFORE_RESET;
            let mut fused = true;
            // The error was smaller then by what an acceleration makes that errs by turn and bias.
            let by_turn = of_turn * late_s;
            let by_bias = of_bias * late_s;
            for i in 0..3 {
                let mut row = unit(VELOCITY + i);
                for k in 0..3 {
                    set(&mut row, TURN + k, -by_turn[(i, k)]);
                    set(&mut row, ACCEL_BIAS + k, -by_bias[(i, k)]);
                }
                let noise = p.gnss_velocity_noise_m_s;
                fused &= self.update(&mut correction, &row, velocity[i], noise, is_gated);
            }
            for i in 0..3 {
                let mut row = unit(POSITION + i);
                set(&mut row, VELOCITY + i, -late_s);
                for k in 0..3 {
                    set(&mut row, TURN + k, 0.5 * late_s * by_turn[(i, k)]);
                    set(&mut row, ACCEL_BIAS + k, 0.5 * late_s * by_bias[(i, k)]);
                }
                let noise = p.gnss_position_noise_m;
                fused &= self.update(&mut correction, &row, position[i], noise, is_gated);
            }
            self.rejected.fixes = self.count(self.rejected.fixes, fused);
            self.filter_nis();
            if fused {
                self.time_since_fix_s = 0.0;
            }
        }
        if let Some(altitude_m) = sensed.altitude_m {
            let residual = self.baro_offset_m - altitude_m - self.position.z;
            let fused =
                self.update(&mut correction, &unit(POSITION + 2), residual, p.baro_noise_m, true);
            self.rejected.altitudes = self.count(self.rejected.altitudes, fused);
            if self.rejected.altitudes >= REJECTIONS_BEFORE_RESET && residual.is_finite() {
                self.baro_offset_m -= residual;
                self.rejected.altitudes = 0;
            }
        }
        if let Some(error) = sensed.magnetic.and_then(|m| heading_error(&self.attitude, &m.vector))
        {
            let mut row = StateVector::zeros();
            row.fixed_rows_mut::<3>(TURN).copy_from(&down(&self.attitude));
            let innovation_variance =
                row.dot(&cross_covariance(&self.covariance, &row)) + square(p.heading_noise_rad);
            let fused = square(error) <= square(p.gate) * innovation_variance
                && self.update(
                    &mut correction,
                    &row,
                    -error,
                    COMPASS_MEMORY * p.heading_noise_rad,
                    true,
                );
            self.rejected.fields = self.count(self.rejected.fields, fused);
        }
        if self.time_since_fix_s > NO_FIX_S {
            let expected = down(&self.attitude) * GRAVITY_M_S2 as f32;
            let slope = cross(&expected);
            for i in 0..3 {
                let mut row = StateVector::zeros();
                row.fixed_rows_mut::<3>(TURN).copy_from(&slope.row(i).transpose());
                self.update(
                    &mut correction,
                    &row,
                    -force[i] - expected[i],
                    p.alone_noise_m_s2,
                    true,
                );
            }
        }
        if self.nis.1 > 0 {
            self.inject(&correction, &of_turn, &of_bias);
        }
        symmetrise(&mut self.covariance);
        let specific_force = sensed.imu.specific_force.vector;
        // After what no vehicle does, the covariance may have lost its meaning.
        let is_covariance = self
            .covariance
            .diagonal()
            .iter()
            .all(|variance| *variance > 0.0 && *variance < VARIANCE_MAX);
        // Nor does any unit have such biases; at rest, one of the accelerometer hides a tilt from
        // every fix. (Alone the filter cannot tell, and nothing would lead it back.)
        let is_far = self.accel_bias.norm_squared() > square(ACCEL_BIAS_MAX_M_S2)
            || self.gyro_bias.norm_squared() > square(GYRO_BIAS_MAX_RAD_S);
        let is_biased = is_far && self.time_since_fix_s <= NO_FIX_S;
        if !is_covariance || is_biased || self.filtered_nis > NIS_RESTART {
            self.restart(&specific_force);
        }
    }

    fn estimate(&self) -> Estimate {
        Estimate {
            ned_from_body: Rotation::new(self.attitude),
            gyro_bias: In::new(self.gyro_bias),
            motion: Some((In::new(self.position), In::new(self.velocity))),
        }
    }
}

/// Covariance of a vehicle that stands where the origin is.
fn at_start(p: &EskfParameters) -> Covariance {
    let mut covariance = Covariance::zeros();
    for (part, deviation) in [
        (POSITION, 0.5),
        (VELOCITY, 0.2),
        (TURN, p.start_turn_rad),
        (ACCEL_BIAS, p.start_accel_bias_m_s2),
        (GYRO_BIAS, p.start_gyro_bias_rad_s),
    ] {
        on_diagonal(&mut covariance, part, |_| square(deviation));
    }
    // It stands level, so that a turn about its down is one of the heading.
    covariance[(TURN + 2, TURN + 2)] = square(p.start_heading_rad);
    covariance
}

fn square(x: f32) -> f32 {
    x * x
}
