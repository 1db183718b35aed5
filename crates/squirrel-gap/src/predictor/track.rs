//! The motion of one piece of a flight from its sensors: strapdown integration, held by GNSS and
//! barometer.
//!
//! ```text
//! v_s' = R (f - b) / (1 + s) + g   b, s, heading, GNSS latency, tilt: what a hypothesis says of the path of the sensors
//! v    = v_s + S[v_GNSS - v_s]  S  local linear smoother, Gaussian weights of 0.5 s
//! h    = h_s + S[h_baro - h_s]  h_s' = -v_z
//! ```
//! What the smoother takes away is the second family of residuals, `v_GNSS - v_s`: sensors that lie
//! show there, forces that the model lacks do not. The third is what a gyroscope says of turns
//! against the attitude ([`turning`](super::turning)).

use super::late::{ACCELEROMETER, GYROSCOPE, LateS, later};
use super::leaning::Leaning;
use super::turning::Turning;
use crate::flight::filter::{CUTOFF_HZ, DERIVATIVE_REACH, LowPass, derivative, model_stride};
use crate::flight::inertial::Derived;
use crate::flight::recording::Recording;
use crate::flight::series::{Series, Span};
use nalgebra::{Quaternion, UnitQuaternion, Vector3, Vector6};
use squirrel_core::dynamics::{RotorDrive, State};
use squirrel_core::effects::{Acting, Effects};
use squirrel_core::frames::In;
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_sim::vehicle_file::VehicleFile;
use std::f64::consts::PI;

/// Fixes and barometer readings are averaged over this time, s.
const BIN_S: f64 = 0.1;
/// Width of the smoother's weights, s.
const SMOOTHER_S: f64 = 0.5;
/// Over which the gyroscope tells the noise of attitudes, s.
const ATTITUDE_LAG_S: f64 = 0.5;
/// Rate of the residual of the dynamics over the corner of the filter: 30 Hz with an IMU.
const RATE_OF_CUTOFF: f64 = 30.0 / CUTOFF_HZ;

/// Times of a flight at which a hypothesis says how far the barometer is off: its zero wanders.
pub(crate) const HEIGHT_KNOTS: usize = 8;
/// Below this height it may matter, m.
const LOW_M: f64 = 2.0;

/// What a hypothesis says of the sensors of one flight, beside its effects.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct SensorErrors {
    /// Tilt of the attitude estimate about north and east, rad.
    pub(crate) tilt_rad: [f64; 2],
    /// By how much an attitude estimate leans into an acceleration that lasts, rad per m/s^2: a
    /// filter that takes the accelerometer for the vertical.
    pub(crate) levelling_rad_s2_per_m: [f64; 2],
    /// What the barometer reads too high, m, on lines between the knots of the flight.
    pub(crate) height_m: [f64; HEIGHT_KNOTS],
    /// How late the sensors read, s.
    pub(crate) late_s: LateS,
    /// By how much the velocity through the air is less than that over ground, m/s: moving air, or
    /// an error of velocity.
    pub(crate) air_ned_m_s: [f64; 3],
}

/// One piece of a flight on a uniform grid, as measured.
pub(crate) struct Track {
    /// Number of the flight.
    pub(crate) flight: usize,
    pub(crate) period_s: f64,
    /// When the flight began, on the clock of its log, s.
    pub(crate) began_s: f64,
    pub(crate) time_s: Vec<f64>,
    pub(crate) voltage_v: Vec<f64>,
    pub(crate) has_voltage: bool,
    /// White noise of accelerometer, m/s^2, and gyroscope, rad/s, one standard deviation.
    pub(crate) imu_noise: [Vector3<f64>; 2],
    /// What forces and rates come from where there is no IMU, and the corner of the filter, Hz.
    pub(super) derived: Derived,
    pub(super) cutoff_hz: f64,
    /// Samples of the grid to one of the residual.
    pub(crate) every: usize,
    /// Samples of the grid from one prediction to the next, and the filter of predictions.
    pub(crate) stride: usize,
    pub(crate) model_filter: LowPass,
    pub(crate) filter: LowPass,
    /// Specific force and angular acceleration, filtered, at the times of the residual.
    pub(crate) measured: Vec<Vector6<f64>>,
    specific_force: Vec<Vector3<f64>>,
    omega: Vec<Vector3<f64>>,
    attitude: Option<Vec<UnitQuaternion<f64>>>,
    velocity: Vec<(f64, Vector3<f64>)>,
    position: Vec<(f64, Vector3<f64>)>,
    altitude_m: Vec<(f64, f64)>,
    /// Times of the height errors, s.
    knots_s: [f64; HEIGHT_KNOTS],
    /// Power of the rotors over that in hover, on the grid.
    pub(crate) rotor_load: Vec<f64>,
    /// Turns by the gyroscope, where there is one beside an attitude.
    turning: Option<Turning>,
}

/// The motion under one hypothesis about the sensors.
pub(crate) struct Motion {
    /// On the grid; rotors are not measured.
    pub(crate) body: Vec<State<f64>>,
    /// Time, s, and GNSS velocity minus strapdown velocity, m/s, whose mean over the piece is
    /// removed.
    pub(crate) kinematic: Vec<(f64, Vector3<f64>)>,
    /// Rate by the attitude minus rate by the gyroscope, rad/s, about its mean.
    pub(crate) turning: Vec<Vector3<f64>>,
    /// How late the sensors read, s.
    pub(crate) late_s: LateS,
}

impl Track {
    pub(crate) fn new(
        flight: usize,
        vehicle: &VehicleFile,
        recording: &Recording,
        piece: Span,
    ) -> Self {
        let samples = recording.grid(piece);
        let period_s = recording.period_s;
        let cutoff_hz = recording.cutoff_hz;
        let every = (1.0 / (RATE_OF_CUTOFF * cutoff_hz * period_s)).round().max(1.0) as usize;
        let stride = model_stride(period_s);
        let filter = recording.filter.clone();
        let raw: Vec<Vector6<f64>> = (DERIVATIVE_REACH..samples.len() - DERIVATIVE_REACH)
            .map(|k| {
                let f = samples[k].specific_force;
                let a = derivative(|k| samples[k].body.omega.vector, k, period_s);
                Vector6::new(f.x, f.y, f.z, a.x, a.y, a.z)
            })
            .collect();
        // What was differentiated has passed the filter.
        let filtered = filter.apply(&raw, filter.reach(), every);
        let as_it_is = || raw[filter.reach()..].iter().copied().step_by(every);
        let parts = |force: Vector6<f64>, moment: Vector6<f64>| {
            Vector6::new(force.x, force.y, force.z, moment.w, moment.a, moment.b)
        };
        let derived = recording.derived.clone();
        let measured = filtered
            .into_iter()
            .zip(as_it_is())
            .map(|(filtered, own)| {
                let force = if derived.force.is_some() { own } else { filtered };
                parts(force, if derived.rates.is_some() { own } else { filtered })
            })
            .collect();
        let inside = |t: &f64| (piece.0..=piece.1).contains(t);
        let vectors = |series: Option<&Series>| {
            let all = series.into_iter().flat_map(Series::samples);
            all.filter(|(t, _)| inside(t))
                .map(|(t, v)| (t, Vector3::from_column_slice(v)))
                .collect()
        };
        let position: Vec<(f64, Vector3<f64>)> = vectors(recording.position.as_ref());
        let altitude_m = match &recording.baro {
            Some(baro) => {
                baro.samples().filter(|(t, _)| inside(t)).map(|(t, h)| (t, h[0])).collect()
            }
            None => position.iter().map(|(t, p)| (*t, -p.z)).collect(),
        };
        let omega: Vec<_> = samples.iter().map(|s| s.body.omega.vector).collect();
        let turns = recording.has_attitude() && derived.rates.is_none();
        Self {
            turning: turns.then(|| Turning::new(&omega, period_s)),
            rotor_load: rotor_load(
                vehicle,
                recording,
                piece.0,
                samples.iter().map(|s| s.voltage_v),
            ),
            flight,
            period_s,
            began_s: recording.pieces[0].0,
            has_voltage: recording.has_voltage(),
            imu_noise: recording.imu_noise,
            every,
            derived,
            cutoff_hz,
            measured,
            stride,
            model_filter: filter.thinned(stride),
            filter,
            time_s: samples.iter().map(|s| s.time_s).collect(),
            voltage_v: samples.iter().map(|s| s.voltage_v).collect(),
            specific_force: samples.iter().map(|s| s.specific_force).collect(),
            omega,
            attitude: recording
                .has_attitude()
                .then(|| samples.iter().map(|s| s.body.ned_from_body().quaternion).collect()),
            velocity: vectors(recording.velocity.as_ref()),
            position,
            altitude_m,
            knots_s: knots_s(recording),
        }
    }

    /// The part of a height knot at a time: 1 at its own, 0 at its neighbours, constant beyond the
    /// ends.
    pub(crate) fn height_share(&self, knot: usize, time_s: f64) -> f64 {
        let at = |i: usize| self.knots_s[i];
        let line = |from: f64, to: f64| ((time_s - from) / (to - from)).clamp(0.0, 1.0);
        let after = if knot == 0 { 1.0 } else { line(at(knot - 1), at(knot)) };
        let before = if knot + 1 == HEIGHT_KNOTS { 0.0 } else { line(at(knot), at(knot + 1)) };
        after - before
    }

    fn height_error_m(&self, errors: &SensorErrors, time_s: f64) -> f64 {
        errors
            .height_m
            .iter()
            .enumerate()
            .map(|(knot, x)| x * self.height_share(knot, time_s))
            .sum()
    }

    /// First sample of the grid that has a residual.
    pub(crate) fn edge(&self) -> usize {
        self.filter.reach() + DERIVATIVE_REACH
    }
    /// Time of a sample of the residual of the dynamics, s.
    pub(crate) fn residual_time_s(&self, i: usize) -> f64 {
        self.time_s[self.edge() + i * self.every]
    }
    /// Measured angular rates on the grid, rad/s.
    pub(crate) fn omega(&self) -> &[Vector3<f64>] {
        &self.omega
    }
    /// Specific force on the grid, m/s^2.
    pub(crate) fn specific_force(&self) -> &[Vector3<f64>] {
        &self.specific_force
    }
    /// GNSS velocities, m/s.
    pub(crate) fn velocity(&self) -> &[(f64, Vector3<f64>)] {
        &self.velocity
    }
    /// White noise of the GNSS velocity, m/s, one standard deviation, from differences of strapdown
    /// and fixes.
    pub(crate) fn velocity_noise(&self) -> Vector3<f64> {
        if let Some(from) = &self.derived.force {
            return Vector3::repeat(from.passed_rate(self.cutoff_hz));
        }
        let plain = self.motion(&Effects::none(), &SensorErrors::default()).kinematic;
        let n = plain.len().saturating_sub(3).max(1) as f64;
        let sum: Vector3<f64> = plain
            .windows(4)
            .map(|w| w[3].1 - w[2].1 * 3.0 + w[1].1 * 3.0 - w[0].1)
            .map(|d| d.component_mul(&d))
            .sum();
        (sum / (20.0 * n)).map(f64::sqrt)
    }
    /// What smoothing leaves of it: a local linear fit with Gaussian weights, over fixes at their
    /// rate.
    pub(crate) fn velocity_smoothing(&self) -> f64 {
        if !self.is_felt() {
            return 1.0;
        }
        let n = self.velocity.len();
        let (Some(first), Some(last)) = (self.velocity.first(), self.velocity.last()) else {
            return 1.0;
        };
        let step_s = ((last.0 - first.0) / (n - 1).max(1) as f64).max(BIN_S);
        (step_s / (2.0 * PI.sqrt() * SMOOTHER_S)).sqrt().min(1.0)
    }
    /// By how much attitudes are off against each other over half a second, rad, one standard
    /// deviation of each: what the gyroscope does not say of their change.
    pub(crate) fn attitude_noise(&self) -> Vector3<f64> {
        let Some(attitude) = &self.attitude else { return Vector3::zeros() };
        let lag = (ATTITUDE_LAG_S / self.period_s).round().max(1.0) as usize;
        let (mut square, mut n) = (Vector3::zeros(), 0.0);
        for start in (0..attitude.len().saturating_sub(lag)).step_by(lag) {
            let [from, to] = [start, start + lag].map(|k| attitude[k]);
            let turned = (start..start + lag).fold(UnitQuaternion::identity(), |q, k| {
                // The mean of two samples is the rate between them.
                q * UnitQuaternion::from_scaled_axis(
                    (self.omega[k] + self.omega[k + 1]) * (0.5 * self.period_s),
                )
            });
            let error = ((from * turned).inverse() * to).scaled_axis();
            square += error.component_mul(&error);
            n += 1.0;
        }
        let [_, rate] = self.imu_noise;
        let gyroscope = rate.component_mul(&rate) * (self.period_s * self.period_s * lag as f64);
        ((square / f64::max(n, 1.0) - gyroscope) * 0.5).map(|x| x.max(0.0).sqrt())
    }
    /// GNSS positions, m.
    pub(crate) fn position(&self) -> &[(f64, Vector3<f64>)] {
        &self.position
    }
    /// Altitudes of the barometer, or of GNSS where there is none, m.
    pub(crate) fn altitude_m(&self) -> &[(f64, f64)] {
        &self.altitude_m
    }
    /// Measured attitudes on the grid, body to NED, if logged.
    pub(crate) fn attitude(&self) -> Option<&[UnitQuaternion<f64>]> {
        self.attitude.as_deref()
    }

    /// The motion, with what a hypothesis says of the sensors taken off.
    pub(crate) fn motion(&self, effects: &Effects<f64>, errors: &SensorErrors) -> Motion {
        let n = self.time_s.len();
        let [rate_scale, force_scale] = self.scales(effects);
        // How many samples on each sensor reads what is true now.
        let late_s = errors.late_s;
        let late = late_s.map(|late_s| late_s / self.period_s);
        let force = |k: usize| later(&self.specific_force, k, late[ACCELEROMETER]);
        let at = |k: usize, velocity, position, attitude| State {
            position: In::new(position),
            velocity: In::new(velocity),
            attitude,
            omega: In::new(later(&self.omega, k, late[GYROSCOPE]).component_div(&rate_scale)),
            ..State::at_rest()
        };
        let Some(attitude) = &self.attitude else {
            let still = |k| at(k, Vector3::zeros(), Vector3::zeros(), Quaternion::identity());
            return Motion {
                body: (0..n).map(still).collect(),
                kinematic: Vec::new(),
                turning: Vec::new(),
                late_s,
            };
        };
        let [north, east] = errors.tilt_rad;
        let tilt = UnitQuaternion::from_scaled_axis(Vector3::new(-north, -east, 0.0));
        let mut leaning = Leaning::new(errors.levelling_rad_s2_per_m, self.period_s);
        let attitude: Vec<UnitQuaternion<f64>> = (0..n)
            .map(|k| {
                let since_s = self.time_s[k] - self.began_s;
                let heading = effects.heading_bias_rad(since_s, self.rotor_load[k]);
                let turned = leaning.upright(attitude[k], &force(k));
                if heading == 0.0 && errors.tilt_rad == [0.0; 2] {
                    turned
                } else {
                    UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, -heading))
                        * tilt
                        * turned
                }
            })
            .collect();
        let gravity = Vector3::new(0.0, 0.0, GRAVITY_M_S2);
        let acceleration = |k: usize| {
            let bias = self.bias(effects, self.time_s[k] - self.began_s);
            attitude[k] * (force(k) - bias).component_div(&force_scale) + gravity
        };
        let mut strapdown = Vec::with_capacity(n);
        let (mut velocity, mut before) = (Vector3::zeros(), acceleration(0));
        strapdown.push(velocity);
        for k in 1..n {
            let now = acceleration(k);
            velocity += (before + now) * (0.5 * self.period_s);
            before = now;
            strapdown.push(velocity);
        }
        let latency_s = effects.gnss_latency_s();
        let mut kinematic = binned(self.velocity.iter().map(|(stamp_s, v)| {
            let (k, share) = self.place(stamp_s - latency_s);
            (stamp_s - latency_s, v - (strapdown[k] + (strapdown[k + 1] - strapdown[k]) * share))
        }));
        if kinematic.is_empty() {
            strapdown.fill(Vector3::zeros());
        } else {
            self.add(&mut strapdown, &smoothed(&kinematic));
        }
        let mut height_m = Vec::with_capacity(n);
        let mut h = 0.0;
        for k in 0..n {
            height_m.push(Vector3::new(0.0, 0.0, h));
            h -= strapdown[k].z * self.period_s;
        }
        let off = errors.height_m != [0.0; HEIGHT_KNOTS];
        let correction = binned(self.altitude_m.iter().map(|(t, altitude)| {
            let (k, _) = self.place(*t);
            let error_m = if off { self.height_error_m(errors, *t) } else { 0.0 };
            (*t, Vector3::new(0.0, 0.0, altitude - error_m - height_m[k].z))
        }));
        if !correction.is_empty() {
            self.add(&mut height_m, &smoothed(&correction));
        }
        let air = Vector3::from(errors.air_ned_m_s);
        let body = (0..n)
            .map(|k| at(k, strapdown[k] - air, -height_m[k], attitude[k].into_inner()))
            .collect();
        let mean =
            kinematic.iter().map(|(_, e)| e).sum::<Vector3<f64>>() / kinematic.len().max(1) as f64;
        for (_, e) in &mut kinematic {
            *e -= mean;
        }
        let turning = self
            .turning
            .as_ref()
            .map_or_else(Vec::new, |turning| turning.rows(&attitude, &rate_scale));
        Motion { body, kinematic, turning, late_s }
    }

    /// What gyroscope and accelerometer read of the truth, by axis; 1 where there is none.
    pub(crate) fn scales(&self, effects: &Effects<f64>) -> [Vector3<f64>; 2] {
        let scale = |is_measured: bool, error: Vector3<f64>| {
            if is_measured { error.add_scalar(1.0) } else { Vector3::repeat(1.0) }
        };
        [
            scale(self.derived.rates.is_none(), effects.gyro_scale().vector),
            scale(self.has_accelerometer(), effects.accel_scale().vector),
        ]
    }
    /// Time between the rows of the gyroscope against the attitude, s.
    pub(super) fn turning_step_s(&self) -> Option<f64> {
        self.turning.as_ref().map(Turning::step_s)
    }

    /// What the accelerometer is off by, m/s^2; nothing where there is none.
    pub(crate) fn bias(&self, effects: &Effects<f64>, time_s: f64) -> Vector3<f64> {
        if self.has_accelerometer() {
            effects.specific_force_bias(time_s).vector
        } else {
            Vector3::zeros()
        }
    }

    /// A force that the model predicts, as this flight shows it: where it comes from what the
    /// vehicle did in the world, the axes are those of the measured attitude, whatever a hypothesis
    /// says of it, and no accelerometer adds its scale and bias.
    pub(super) fn as_shown(
        &self,
        k: usize,
        force: Vector3<f64>,
        motion: &Motion,
        effects: &Effects<f64>,
    ) -> Vector3<f64> {
        match &self.attitude {
            Some(measured) if !self.is_felt() => {
                let (measured, own) = (measured[k], motion.body[k].ned_from_body().quaternion);
                let bias = effects.specific_force_bias(self.time_s[k] - self.began_s).vector;
                let scale = effects.accel_scale().vector.add_scalar(1.0);
                (measured.inverse() * own) * (force - bias).component_div(&scale)
            }
            _ => force,
        }
    }

    /// Whether forces were measured as such.
    pub(crate) fn has_accelerometer(&self) -> bool {
        self.is_felt() && !self.derived.turned
    }
    /// Whether an accelerometer felt the forces, whoever turned them.
    pub(crate) fn is_felt(&self) -> bool {
        self.derived.force.is_none()
    }

    /// The sample of the grid at or before a time, and the share of the way to the next; the ends
    /// beyond them.
    fn place(&self, time_s: f64) -> (usize, f64) {
        let last = self.time_s.len() - 2;
        let steps = ((time_s - self.time_s[0]) / self.period_s).max(0.0);
        let k = (steps as usize).min(last);
        (k, (steps - k as f64).min(1.0))
    }

    /// Adds lines between points to a series on the grid, held beyond the ends.
    fn add(&self, series: &mut [Vector3<f64>], points: &[(f64, Vector3<f64>)]) {
        let mut i = 0;
        for (value, t) in series.iter_mut().zip(&self.time_s) {
            while i + 1 < points.len() && points[i + 1].0 <= *t {
                i += 1;
            }
            let (t0, p0) = points[i];
            let (t1, p1) = points[(i + 1).min(points.len() - 1)];
            let share = if t1 > t0 { ((t - t0) / (t1 - t0)).clamp(0.0, 1.0) } else { 0.0 };
            *value += p0 + (p1 - p0) * share;
        }
    }
}

/// Power of the rotors over that in hover along a piece, by commands and their lag, or as fast as
/// they turned.
fn rotor_load(
    vehicle: &VehicleFile,
    recording: &Recording,
    start_s: f64,
    voltage_v: impl Iterator<Item = f64>,
) -> Vec<f64> {
    let mut speed = None;
    let acting = Acting::new(&vehicle.effects, &vehicle.vehicle);
    let along = voltage_v.enumerate().map(|(k, voltage_v)| {
        let command = recording.rotor_command(start_s + k as f64 * recording.period_s);
        if recording.speed.is_some() {
            return vehicle.vehicle.rotor_load(&command);
        }
        let drive = RotorDrive::new(&vehicle.vehicle, &acting, &command, voltage_v);
        let speed = speed.get_or_insert(drive.target_rad_s);
        drive.lead(speed, recording.period_s);
        vehicle.vehicle.rotor_load(speed)
    });
    along.collect()
}

/// Where the barometer's error is asked for: spread over the time that a flight is low, or over all
/// of it.
fn knots_s(recording: &Recording) -> [f64; HEIGHT_KNOTS] {
    let (start_s, end_s) = (recording.pieces[0].0, recording.pieces[recording.pieces.len() - 1].1);
    let heights: Vec<(f64, f64)> = match (&recording.baro, &recording.position) {
        (Some(baro), _) => baro.samples().map(|(t, h)| (t, h[0])).collect(),
        (None, Some(position)) => position.samples().map(|(t, p)| (t, -p[2])).collect(),
        (None, None) => Vec::new(),
    };
    let low: Vec<f64> = heights
        .iter()
        .filter(|(t, h)| *h < LOW_M && (start_s..=end_s).contains(t))
        .map(|(t, _)| *t)
        .collect();
    let mut before = f64::NEG_INFINITY;
    std::array::from_fn(|knot| {
        let share = knot as f64 / (HEIGHT_KNOTS - 1) as f64;
        let at = match low[..] {
            [] => start_s + share * (end_s - start_s),
            _ => low[(share * (low.len() - 1) as f64) as usize],
        };
        // Knots never coincide, however short the time.
        before = at.max(before + 1e-3);
        before
    })
}

/// Means over bins of [`BIN_S`], at the mean of their times.
fn binned(points: impl Iterator<Item = (f64, Vector3<f64>)>) -> Vec<(f64, Vector3<f64>)> {
    let mut bins: Vec<(f64, f64, Vector3<f64>, f64)> = Vec::new();
    for (t, value) in points {
        // The slack keeps fixes every 0.1 s apart whatever the rounding of their stamps.
        match bins.last_mut() {
            Some((start, time, sum, n)) if t - *start < BIN_S - 1e-3 => {
                *time += t;
                *sum += value;
                *n += 1.0;
            }
            _ => bins.push((t, t, value, 1.0)),
        }
    }
    bins.into_iter().map(|(_, time, sum, n)| (time / n, sum / n)).collect()
}

/// Local linear smoother at the points themselves.
fn smoothed(points: &[(f64, Vector3<f64>)]) -> Vec<(f64, Vector3<f64>)> {
    let reach = 3.0 * SMOOTHER_S;
    let mut first = 0;
    points
        .iter()
        .map(|(t, own)| {
            while points[first].0 < t - reach {
                first += 1;
            }
            let (mut w, mut wt, mut wtt) = (0.0, 0.0, 0.0);
            let (mut wy, mut wty) = (Vector3::zeros(), Vector3::zeros());
            for (u, y) in points[first..].iter().take_while(|(u, _)| *u <= t + reach) {
                let d = u - t;
                let weight = (-0.5 * (d / SMOOTHER_S).powi(2)).exp();
                w += weight;
                wt += weight * d;
                wtt += weight * d * d;
                wy += y * weight;
                wty += y * (weight * d);
            }
            let determinant = w * wtt - wt * wt;
            let value =
                if determinant > 1e-12 { (wy * wtt - wty * wt) / determinant } else { *own };
            (*t, value)
        })
        .collect()
}
