//! The gap on flights that the fit never saw: the plant re-simulated in open loop under the logged
//! commands.
//!
//! Every half second the plant is put where the vehicle was measured to be and flown for a second,
//! and every fourth time for two, under the logged commands at the measured voltage. What the
//! sensors should then have read, under the hypothesis, is compared with what they read, in bins of
//! 0.1 s: velocity, attitude, angular rate and specific force, three channels each.
//!
//! ```text
//! J = mean over channels of MSE(model) / MSE(floor), over the first second      1: nothing but noise
//! removed = 1 - (J_after - 1) / (J_before - 1)
//! ```
//! The floor is the best model against itself, started and read with the noise of these sensors in
//! turbulent air of the declared tolerance. One flight's noise is not the mean flight's: where the
//! best model is inside two standard deviations of what noise leaves from flight to flight, the
//! floor of these flights is taken to be where it is. All models share the numbers that float
//! inside their tolerances, so that the gap is that of the effect. Where moments are left out of
//! what is explained, the attitude is the measured one and only velocity and specific force are
//! compared; what a log without an IMU does not measure is not compared either.

use crate::GapError;
use crate::leftover::floor::TURBULENCE_S;
use crate::predictor::{Clock, Hypothesis, Motion, Predictor, Track};
use nalgebra::{SVector, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use squirrel_core::frames::In;
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_sim::plant::{Plant, PlantState};
use std::rc::Rc;

/// Channels of the comparison.
pub(crate) const CHANNELS: [&str; 12] = [
    "velocity_north_m_s",
    "velocity_east_m_s",
    "velocity_down_m_s",
    "attitude_x_rad",
    "attitude_y_rad",
    "attitude_z_rad",
    "omega_body_x_rad_s",
    "omega_body_y_rad_s",
    "omega_body_z_rad_s",
    "specific_force_body_x_m_s2",
    "specific_force_body_y_m_s2",
    "specific_force_body_z_m_s2",
];
/// Bins of a segment, and how many of them count for the gap.
pub(crate) const BINS: usize = 20;
const COUNTED: usize = 10;
/// Of so many segments one is flown beyond what counts, to show how errors grow.
const LONG_EVERY: usize = 4;
/// Length of a bin and distance of segments, s.
pub(crate) const BIN_S: f64 = 0.1;
const RESTART_S: f64 = 0.5;
/// Weights of a parabola through nine samples at its middle (Savitzky and Golay, 1964), and the
/// noise that they pass.
const START_WEIGHTS: [f64; 9] = [-21.0, 14.0, 39.0, 54.0, 59.0, 54.0, 39.0, 14.0, -21.0];
const START_SUM: f64 = 231.0;
const START_NOISE: f64 = 0.505;

/// Shortest and longest step of the plant, s: commands are its means, and it is no longer than the
/// lag of the rotors that they move.
const STEP_S: (f64, f64) = (0.0001, 0.0036);

pub(crate) type Errors = SVector<f64, 12>;

/// Flights of noise that the floor is the mean of, each of every other segment: half of what one
/// says its neighbours say, too.
const DRAWS: usize = 3;
/// Standard deviations of the scatter of a flight's noise that still are noise, and the least part
/// of the mean that a lucky flight has.
const SCATTER: f64 = 2.0;
const LUCK: f64 = 0.5;

/// Mean squared errors by bin.
#[derive(Debug, Clone)]
pub(crate) struct Errors12 {
    pub(crate) squared: [Errors; BINS],
    pub(crate) count: [f64; BINS],
}

impl Errors12 {
    fn new() -> Self {
        Self { squared: [Errors::zeros(); BINS], count: [0.0; BINS] }
    }
    /// Adds one comparison, if it is one: a plant that has run away has none.
    fn add(&mut self, bin: usize, parts: [Vector3<f64>; 4]) {
        let error = Errors::from_iterator(parts.iter().flat_map(|part| part.iter().copied()));
        if error.iter().all(|x| x.is_finite()) {
            self.squared[bin] += error.component_mul(&error);
            self.count[bin] += 1.0;
        }
    }
    /// Root mean square error of a channel at a horizon.
    pub(crate) fn rms(&self, channel: usize, bin: usize) -> f64 {
        (self.squared[bin][channel] / self.count[bin].max(1.0)).sqrt()
    }
    /// Mean squared error by channel over the first second.
    pub(crate) fn mse(&self) -> Errors {
        let n: f64 = self.count[..COUNTED].iter().sum();
        self.squared[..COUNTED].iter().sum::<Errors>() / n.max(1.0)
    }
    /// Mean over channels of the error over a floor; 1 is nothing but noise, and less is no better.
    pub(crate) fn over(&self, floor: &Errors) -> f64 {
        let own = self.mse();
        let ratios: Vec<f64> =
            own.iter().zip(floor.iter()).filter(|(_, f)| **f > 0.0).map(|(m, f)| m / f).collect();
        (ratios.iter().sum::<f64>() / ratios.len().max(1) as f64).max(1.0)
    }
}

/// What noise leaves: errors of the mean flight, and by how much those of one flight scatter.
#[derive(Debug, Clone)]
pub(crate) struct Floor {
    pub(crate) mean: Errors12,
    /// Standard deviation of [`Errors12::mse`].
    deviation: Errors,
}

impl Floor {
    /// The floor of these very flights, by channel: a flight is lucky or not, and what a model
    /// leaves inside the scatter of noise is noise.
    pub(crate) fn of(&self, model: &Errors12) -> Errors {
        let reach = self.deviation * SCATTER;
        let mean = self.mean.mse();
        let lucky = mean * LUCK;
        model
            .mse()
            .zip_zip_map(&mean, &reach, |own, mean, reach| {
                own.clamp((mean - reach).max(0.0), mean + reach)
            })
            .sup(&lucky)
    }
}

/// What a plant reads in one bin.
struct Reading {
    velocity_ned: Vector3<f64>,
    attitude: UnitQuaternion<f64>,
    omega: Vector3<f64>,
    specific_force: Vector3<f64>,
}

/// A hypothesis on flights, flown without noise: its errors and its floor are both told from that.
pub(crate) struct Flown<'a> {
    pieces: Vec<(Segments<'a>, Vec<Bin>)>,
}

impl<'a> Flown<'a> {
    /// Flies the pieces that have attitude and velocity.
    ///
    /// # Errors
    /// A hypothesis that the plant cannot be stepped with.
    pub(crate) fn new(
        predictor: &'a Predictor<'a>,
        hypothesis: &'a Hypothesis,
    ) -> Result<Self, GapError> {
        let mut pieces = Vec::new();
        for (piece, track) in predictor.tracks.iter().enumerate() {
            if track.attitude().is_none() || track.velocity().is_empty() {
                continue;
            }
            let segments = Segments::new(predictor, hypothesis, piece)?;
            let mut bins = Vec::new();
            segments.fly(0..segments.starts.len(), None, |bin| bins.push(bin));
            pieces.push((segments, bins));
        }
        Ok(Self { pieces })
    }

    /// Errors of the hypothesis; `None` where no flight has attitude and velocity.
    pub(crate) fn errors(&self) -> Option<Errors12> {
        let mut all = Errors12::new();
        for (segments, bins) in &self.pieces {
            for bin in bins {
                segments.compare(bin, &mut all);
            }
        }
        (all.count[0] > 0.0).then_some(all)
    }

    /// Errors that the hypothesis would have if it were true: started, read and blown about with
    /// noise.
    pub(crate) fn floor(&self, turbulence_m_s: f64) -> Floor {
        let mut all = Errors12::new();
        // Mean errors of each segment over the first second.
        let mut segments: Vec<Errors> = Vec::new();
        for (own, clean) in &self.pieces {
            let (predictor, piece, track) = (own.predictor, own.piece as u64, own.track());
            let [force_noise, rate_noise] = track.imu_noise;
            let velocity_noise = track.velocity_noise();
            let attitude_noise = track.attitude_noise();
            let white = (BIN_S / track.period_s).max(1.0).sqrt();
            for draw in 0..DRAWS {
                let which = (draw % 2..own.starts.len()).step_by(2);
                let mut rng = Pcg64Mcg::seed_from_u64(1000 * draw as u64 + piece + 11);
                let mut noise = Pcg64Mcg::seed_from_u64(1000 * draw as u64 + piece + 29);
                let mut draw = || -> Vector3<f64> {
                    Vector3::from_fn(|_, _| StandardNormal.sample(&mut noise))
                };
                let noise = Noise {
                    starts: starts(which.len(), &mut rng).into_iter(),
                    turbulence_m_s,
                    velocity_m_s: velocity_noise * track.velocity_smoothing(),
                    attitude_rad: attitude_noise,
                    rng: &mut rng,
                };
                let mut still = clean.iter();
                own.fly(which, Some(noise), |blown| {
                    let Some(still) = still.find(|still| still.place() == blown.place()) else {
                        return;
                    };
                    let (own, other) = (&still.read, &blown.read);
                    let velocity = other.velocity_ned - own.velocity_ned
                        + draw().component_mul(&velocity_noise);
                    let rotation = (own.attitude.inverse() * other.attitude).scaled_axis()
                        + draw().component_mul(&attitude_noise);
                    let rate = other.omega - own.omega + draw().component_mul(&rate_noise) / white;
                    let force = other.specific_force - own.specific_force
                        + draw().component_mul(&force_noise) / white;
                    let parts = compared(predictor, [velocity, rotation, rate, force]);
                    if blown.number == 0 {
                        segments.push(Errors::zeros());
                    }
                    if let Some(segment) = segments.last_mut().filter(|_| blown.number < COUNTED) {
                        let error = Errors::from_iterator(
                            parts.iter().flat_map(|part| part.iter().copied()),
                        );
                        *segment += error.component_mul(&error) / COUNTED as f64;
                    }
                    all.add(blown.number, parts);
                });
            }
        }
        let n = segments.len().max(1) as f64;
        let mean = segments.iter().sum::<Errors>() / n;
        let square: Errors =
            segments.iter().map(|s| (s - mean).component_mul(&(s - mean))).sum::<Errors>() / n;
        // Segments overlap by half: each counts for half in the mean of one flight.
        let flown: usize = self.pieces.iter().map(|(own, _)| own.starts.len()).sum();
        let deviation = (square * (2.0 / flown.max(1) as f64)).map(f64::sqrt);
        Floor { mean: all, deviation }
    }
}

/// What a flight is blown about with, and what its start states are off by.
struct Noise<'a> {
    /// Of each segment: wind, velocity, attitude and rate, in units of their deviation.
    starts: std::vec::IntoIter<[Vector3<f64>; 4]>,
    turbulence_m_s: f64,
    velocity_m_s: Vector3<f64>,
    attitude_rad: Vector3<f64>,
    rng: &'a mut Pcg64Mcg,
}

/// What so many segments start with. Each number has the mean square of as many as one likes, so
/// that the mean error of a few is that of many.
fn starts(count: usize, rng: &mut Pcg64Mcg) -> Vec<[Vector3<f64>; 4]> {
    let mut all: Vec<[Vector3<f64>; 4]> = (0..count)
        .map(|_| [(); 4].map(|()| Vector3::from_fn(|_, _| StandardNormal.sample(rng))))
        .collect();
    for part in 0..4 {
        let square: Vector3<f64> = all.iter().map(|start| start[part].map(|x| x * x)).sum();
        let deviation = (square / count.max(1) as f64).map(f64::sqrt);
        for start in &mut all {
            start[part].component_div_assign(&deviation);
        }
    }
    all
}

/// Whether the attitude is the plant's own: it is the measured one where nothing is said of
/// moments, or where no gyroscope says how fast the vehicle turned at the start.
fn flies_freely(predictor: &Predictor) -> bool {
    predictor.has_all_of(3) && predictor.has_gyroscope()
}

/// The parts that are compared; the others are zero.
fn compared(
    predictor: &Predictor,
    [velocity, rotation, rate, force]: [Vector3<f64>; 4],
) -> [Vector3<f64>; 4] {
    // What was differentiated behind a filter is smoother than anything that a plant does.
    let measured = |is_measured: bool, value| if is_measured { value } else { Vector3::zeros() };
    let turns = flies_freely(predictor);
    [
        velocity,
        measured(turns, rotation),
        measured(turns, rate),
        measured(predictor.is_felt(), force),
    ]
}

/// One bin of one segment.
struct Bin {
    segment: usize,
    /// In its segment.
    number: usize,
    /// Samples of the grid.
    first: usize,
    last: usize,
    read: Reading,
    acceleration_ned: Vector3<f64>,
}

impl Bin {
    fn place(&self) -> (usize, usize) {
        (self.segment, self.number)
    }
}

/// The segments of a piece, ready to be flown again and again.
struct Segments<'a> {
    predictor: &'a Predictor<'a>,
    hypothesis: &'a Hypothesis,
    piece: usize,
    motion: Rc<Motion>,
    plant: Plant,
    /// Of it to a sample.
    steps: usize,
    /// Samples at which they start, and the plant there.
    starts: Vec<(usize, PlantState)>,
    per_bin: usize,
}

impl<'a> Segments<'a> {
    fn new(
        predictor: &'a Predictor<'a>,
        hypothesis: &'a Hypothesis,
        piece: usize,
    ) -> Result<Self, GapError> {
        let track = &predictor.tracks[piece];
        let n = track.time_s.len();
        let motion = predictor.motion(piece, hypothesis);
        let steps = substeps(track.period_s, hypothesis);
        let dt_s = track.period_s / steps as f64;
        let plant = predictor.plant_in(hypothesis, track.flight, dt_s)?;
        let per_bin = (BIN_S / track.period_s).round().max(1.0) as usize;
        let stride = (RESTART_S / track.period_s).round().max(1.0) as usize;
        let starts: Vec<usize> =
            (0..n).step_by(stride).skip(1).filter(|s| s + per_bin < n).collect();
        let states = predictor.led_states(&plant, piece, &motion, &starts);
        let starts = starts.into_iter().zip(states).collect();
        Ok(Self { predictor, hypothesis, piece, motion, plant, steps, starts, per_bin })
    }

    fn track(&self) -> &'a Track {
        &self.predictor.tracks[self.piece]
    }

    /// Flies segments in order and hands over what the sensors would read, bin by bin.
    fn fly(
        &self,
        segments: impl Iterator<Item = usize>,
        mut noise: Option<Noise<'_>>,
        mut each: impl FnMut(Bin),
    ) {
        let Some((first, _)) = self.starts.first() else { return };
        let (track, effects) = (self.track(), &self.hypothesis.effects);
        let mut clock = self.predictor.clock(track.flight, effects, track.time_s[*first]);
        for segment in segments {
            clock.advance_to(track.time_s[self.starts[segment].0]);
            self.segment(segment, clock.clone(), &mut noise, &mut each);
        }
    }

    fn segment(
        &self,
        segment: usize,
        mut clock: Clock<'_>,
        noise: &mut Option<Noise<'_>>,
        each: &mut impl FnMut(Bin),
    ) {
        let Self { predictor, plant, motion, per_bin, .. } = self;
        let (track, per_bin) = (self.track(), *per_bin);
        let (start, mut state) = self.starts[segment];
        let bins = if segment.is_multiple_of(LONG_EVERY) { BINS } else { COUNTED };
        let n = track.time_s.len();
        if start >= 4 && start + 4 < n {
            let weighted = START_WEIGHTS.iter().zip(&motion.body[start - 4..]);
            state.body.omega =
                In::new(weighted.map(|(w, body)| body.omega.vector * (w / START_SUM)).sum());
        }
        let mut wind = Vector3::zeros();
        let mut turbulence = 0.0;
        if let Some(noise) = noise {
            let [air, velocity, attitude, rate] =
                noise.starts.next().unwrap_or([Vector3::zeros(); 4]);
            turbulence = noise.turbulence_m_s;
            wind = air * turbulence;
            state.body.velocity =
                In::new(state.body.velocity.vector + velocity.component_mul(&noise.velocity_m_s));
            let turn =
                UnitQuaternion::from_scaled_axis(attitude.component_mul(&noise.attitude_rad));
            state.body.attitude = (state.body.ned_from_body().quaternion * turn).into_inner();
            let [_, rate_noise] = track.imu_noise;
            state.body.omega =
                In::new(state.body.omega.vector + rate.component_mul(&rate_noise) * START_NOISE);
        }
        let is_led = !flies_freely(predictor);
        let effects = &self.hypothesis.effects;
        let gravity = Vector3::new(0.0, 0.0, GRAVITY_M_S2);
        let keep = (-track.period_s / TURBULENCE_S).exp();
        let [rate_scale, force_scale] = track.scales(effects);
        for bin in 0..bins {
            let first = start + bin * per_bin;
            let (last, half) = (first + per_bin, first + per_bin / 2);
            if last >= n {
                break;
            }
            let (mut velocity, mut rate, mut force) =
                (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
            let mut middle = state.body.ned_from_body().quaternion;
            let began = state.body.velocity.vector;
            for sample in first..last {
                if sample == half {
                    middle = state.body.ned_from_body().quaternion;
                }
                if is_led {
                    state.body.attitude = motion.body[sample].attitude;
                    state.body.omega = motion.body[sample].omega;
                }
                let before = state.body;
                velocity += before.velocity.vector;
                rate += before.omega.vector;
                state.battery.voltage_v = track.voltage_v[sample];
                for step in 0..self.steps {
                    let from_s = track.time_s[sample] + step as f64 * plant.dt_s();
                    let (rotor, wing) = clock.mean(from_s, from_s + plant.dt_s());
                    plant.step(&mut state, &rotor, wing, In::new(wind));
                }
                let slope = (state.body.velocity.vector - before.velocity.vector) / track.period_s;
                force += before.ned_from_body().quaternion.inverse() * (slope - gravity);
                if let Some(noise) = noise {
                    let fresh: Vector3<f64> =
                        Vector3::from_fn(|_, _| StandardNormal.sample(noise.rng));
                    wind = wind * keep + fresh * (turbulence * (1.0 - keep * keep).sqrt());
                }
            }
            let samples = per_bin as f64;
            let time_s = track.time_s[half] - track.began_s;
            let heading = effects.heading_bias_rad(time_s, track.rotor_load[half]);
            let heading = UnitQuaternion::from_scaled_axis(Vector3::z() * heading);
            let read = Reading {
                velocity_ned: velocity / samples,
                attitude: heading * middle,
                omega: rate.component_mul(&rate_scale) / samples,
                specific_force: force.component_mul(&force_scale) / samples
                    + effects.specific_force_bias(time_s).vector,
            };
            let acceleration_ned =
                (state.body.velocity.vector - began) / (samples * track.period_s);
            each(Bin { segment, number: bin, first, last, read, acceleration_ned });
        }
    }

    /// Adds what the sensors read in a bin, minus what they should have read.
    fn compare(
        &self,
        Bin { number, first, last, read, acceleration_ned, .. }: &Bin,
        all: &mut Errors12,
    ) {
        let track = self.track();
        let (Some(measured_attitude), Some(end)) = (track.attitude(), last.checked_sub(1)) else {
            return;
        };
        let latency_s = self.hypothesis.effects.gnss_latency_s();
        let (a, b) = (track.time_s[*first], track.time_s[end]);
        // The fix that speaks of this bin has its stamp a latency later.
        let fixes = track.velocity();
        let from = fixes.partition_point(|(t, _)| *t - latency_s < a - 1e-6);
        // Up to the next bin: a fix between two samples belongs to one of them.
        let until = fixes.partition_point(|(t, _)| *t - latency_s < b + track.period_s - 1e-6);
        if from == until {
            return;
        }
        let n = (until - from) as f64;
        let velocity = fixes[from..until].iter().map(|(_, v)| v).sum::<Vector3<f64>>() / n;
        let at = fixes[from..until].iter().map(|(t, _)| t - latency_s).sum::<f64>() / n;
        let q = UnitQuaternion::new_unchecked(measured_attitude[usize::midpoint(*first, *last)]);
        let mean = |v: &[Vector3<f64>]| {
            v[*first..*last].iter().sum::<Vector3<f64>>() / (last - first) as f64
        };
        let velocity_then = read.velocity_ned + acceleration_ned * (at - 0.5 * (a + b));
        let rotation = (read.attitude.inverse() * q).scaled_axis();
        let rate = mean(track.omega()) - read.omega;
        let force = mean(track.specific_force()) - read.specific_force;
        all.add(
            *number,
            compared(self.predictor, [velocity - velocity_then, rotation, rate, force]),
        );
    }
}

/// Steps of the plant to a sample.
fn substeps(period_s: f64, hypothesis: &Hypothesis) -> usize {
    let propulsion = &hypothesis.vehicle.parameters().propulsion;
    let [up_s, down_s] = hypothesis.effects.rotor_extra_time_constant_s();
    let lags_s = [propulsion.time_constant_up_s + up_s, propulsion.time_constant_down_s + down_s];
    // Rotors without a lag follow at once, in steps of any length.
    let lag_s = lags_s.into_iter().filter(|lag_s| *lag_s > 0.0).fold(f64::INFINITY, f64::min);
    let (least_s, most_s) = STEP_S;
    (period_s / lag_s.clamp(least_s, most_s)).ceil().max(1.0) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flight(square: f64) -> Errors12 {
        let mut errors = Errors12::new();
        errors.squared[..COUNTED].fill(Errors::repeat(4.0 * square));
        errors.count[..COUNTED].fill(4.0);
        errors
    }

    #[test]
    fn a_lucky_or_unlucky_flight_is_at_the_floor_and_a_wrong_model_is_not() {
        let floor = Floor { mean: flight(1.0), deviation: Errors::repeat(0.1) };
        for inside in [0.85, 1.0, 1.15] {
            assert!((flight(inside).over(&floor.of(&flight(inside))) - 1.0).abs() < 1e-12);
        }
        let wrong = flight(3.0);
        assert!((wrong.over(&floor.of(&wrong)) - 3.0 / 1.2).abs() < 1e-12);
        // Another model is held against the floor of the best one, and nothing is below it.
        assert!((wrong.over(&floor.of(&flight(0.9))) - 3.0 / 0.9).abs() < 1e-12);
        assert_eq!(flight(0.1).over(&floor.of(&flight(1.0))), 1.0);
    }
}
