//! The plant put where the vehicle was measured to be, flown under the logged commands, and what the
//! sensors should then read.

use super::errors::{BINS, COUNTED, Errors12};
use crate::GapError;
use crate::leftover::floor::TURBULENCE_S;
use crate::predictor::{
    ACCELEROMETER, Clock, DragCentre, GYROSCOPE, Hypothesis, Motion, Predictor, Track,
};
use nalgebra::{UnitQuaternion, Vector3};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use squirrel_core::frames::In;
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_sim::plant::{Plant, PlantState};
use std::rc::Rc;

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

/// What a flight is blown about with, and what its start states are off by.
pub(super) struct Noise<'a> {
    /// Of each segment: wind, velocity, attitude and rate, in units of their deviation.
    pub(super) starts: std::vec::IntoIter<[Vector3<f64>; 4]>,
    pub(super) turbulence_m_s: f64,
    pub(super) velocity_m_s: Vector3<f64>,
    pub(super) attitude_rad: Vector3<f64>,
    pub(super) rng: &'a mut Pcg64Mcg,
}

/// What a plant reads in one bin.
pub(super) struct Reading {
    pub(super) velocity_ned: Vector3<f64>,
    pub(super) attitude: UnitQuaternion<f64>,
    pub(super) omega: Vector3<f64>,
    pub(super) specific_force: Vector3<f64>,
}

/// Whether the attitude is the plant's own: it is the measured one where nothing is said of
/// moments, or where no gyroscope says how fast the vehicle turned at the start.
fn flies_freely(predictor: &Predictor) -> bool {
    predictor.has_all_of(3) && predictor.has_gyroscope()
}

/// The parts that are compared; the others are zero.
pub(super) fn compared(
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
pub(super) struct Bin {
    segment: usize,
    /// In its segment.
    pub(super) number: usize,
    /// Samples of the grid.
    first: usize,
    last: usize,
    pub(super) read: Reading,
    acceleration_ned: Vector3<f64>,
}

impl Bin {
    pub(super) fn place(&self) -> (usize, usize) {
        (self.segment, self.number)
    }
}

/// The segments of a piece, ready to be flown again and again.
pub(super) struct Segments<'a> {
    pub(super) predictor: &'a Predictor<'a>,
    hypothesis: &'a Hypothesis,
    pub(super) piece: usize,
    motion: Rc<Motion>,
    plant: Plant,
    /// Where the frame's drag acts, if elsewhere.
    drag: Option<DragCentre>,
    /// Of it to a sample.
    steps: usize,
    /// Samples at which they start, and the plant there.
    pub(super) starts: Vec<(usize, PlantState)>,
    per_bin: usize,
}

impl<'a> Segments<'a> {
    pub(super) fn new(
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
        // Where the attitude is the measured one, nothing turns the plant.
        let drag = if flies_freely(predictor) {
            DragCentre::of(predictor, hypothesis, dt_s)?
        } else {
            None
        };
        let per_bin = (BIN_S / track.period_s).round().max(1.0) as usize;
        let stride = (RESTART_S / track.period_s).round().max(1.0) as usize;
        let starts: Vec<usize> =
            (0..n).step_by(stride).skip(1).filter(|s| s + per_bin < n).collect();
        let states = predictor.led_states(&plant, piece, &motion, &starts);
        let starts = starts.into_iter().zip(states).collect();
        Ok(Self { predictor, hypothesis, piece, motion, plant, drag, steps, starts, per_bin })
    }

    pub(super) fn track(&self) -> &'a Track {
        &self.predictor.tracks[self.piece]
    }

    /// Flies segments in order and hands over what the sensors would read, bin by bin.
    pub(super) fn fly(
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
        let Self { predictor, plant, drag, motion, per_bin, .. } = self;
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
        let late_s = motion.late_s;
        for bin in 0..bins {
            let first = start + bin * per_bin;
            let (last, half) = (first + per_bin, first + per_bin / 2);
            if last >= n {
                break;
            }
            let (mut velocity, mut rate, mut force) =
                (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
            let mut middle = state.body.ned_from_body().quaternion;
            let (began, began_rate) = (state.body.velocity.vector, state.body.omega.vector);
            let (mut force_now, mut began_force) = (Vector3::zeros(), Vector3::zeros());
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
                    if let Some(drag) = drag {
                        drag.turn(plant, &mut state, In::new(wind), plant.dt_s());
                    }
                    plant.step(&mut state, &rotor, wing, In::new(wind));
                }
                let slope = (state.body.velocity.vector - before.velocity.vector) / track.period_s;
                force_now = before.ned_from_body().quaternion.inverse() * (slope - gravity);
                if sample == first {
                    began_force = force_now;
                }
                force += force_now;
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
            // What a late sensor says was true before: a share of the bin's change.
            let late = late_s.map(|late_s| late_s / (samples * track.period_s));
            rate -= (state.body.omega.vector - began_rate) * (samples * late[GYROSCOPE]);
            force -= (force_now - began_force) * (samples * late[ACCELEROMETER]);
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
    pub(super) fn compare(
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
        let q = measured_attitude[usize::midpoint(*first, *last)];
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
