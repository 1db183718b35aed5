//! The residual of one piece of a flight: measured minus model, sample by sample.
//!
//! The model is the simulator's own plant, led along the measured motion: it propagates rotors,
//! servos and membranes under the logged commands and gives force and moment, while velocity,
//! attitude and rates are what was measured.

use super::{CHANNELS, GapError};
use crate::flight::filter::{DERIVATIVE_REACH, derivative};
use crate::flight::recording::{Recording, Sample};
use crate::flight::series::{Span, between};
use crate::predictor::{Commands, SensorErrors, Track};
use nalgebra::{UnitQuaternion, Vector3, Vector6};
use squirrel_core::dynamics::State;
use squirrel_core::frames::{Body, In, Wrench};
use squirrel_sim::flight::PLANT_STEP_US;
use squirrel_sim::plant::{Plant, PlantState};
use squirrel_sim::vehicle_file::VehicleFile;
use std::convert::Infallible;

/// How long the first sample of a piece is held before it, so that rotors, servos and membranes
/// start settled, s.
const SETTLE_S: f64 = 1.0;
/// Far beyond any vehicle, and its square still sums up, N or N m.
const RESIDUAL_MAX: f64 = 1e100;

/// Residual force, N, and moment, N m, body frame, of one piece, without the edges.
///
/// # Errors
/// A vehicle that the plant cannot step, or a residual that is not finite.
pub(super) fn residuals(
    vehicle: &VehicleFile,
    recording: &Recording,
    piece: Span,
) -> Result<Vec<Vector6<f64>>, GapError> {
    let samples = samples(vehicle, recording, piece);
    let model = model(vehicle, recording, &samples)?;
    // Effects on mass and inertia change what the measured motion is worth in newtons.
    let airframe = vehicle.effects.alter(&vehicle.vehicle).map_err(|problem| {
        GapError::Vehicle { vehicle: vehicle.name.clone(), problem: problem.to_string() }
    })?;
    let parameters = airframe.parameters();
    let is_felt = recording.derived.force.is_none();
    let lever =
        if is_felt { vehicle.effects.accelerometer_position().vector } else { Vector3::zeros() };
    let (measured, predicted): (Vec<Vector6<f64>>, Vec<Vector6<f64>>) = (DERIVATIVE_REACH
        ..samples.len() - DERIVATIVE_REACH)
        .map(|k| {
            let omega = samples[k].body.omega.vector;
            let omega_dot = derivative(|k| samples[k].body.omega.vector, k, recording.period_s);
            // An accelerometer beside the centre of mass feels the vehicle turn about it.
            let turning = omega_dot.cross(&lever) + omega.cross(&omega.cross(&lever));
            let force = (samples[k].specific_force - turning) * parameters.mass_kg;
            let moment = parameters.inertia_kg_m2 * omega_dot
                + omega.cross(&(parameters.inertia_kg_m2 * omega));
            let wrench = &model[k];
            (stack(force, moment), stack(wrench.force.vector, wrench.moment.vector))
        })
        .unzip();
    let (first, reach) = (recording.edge(), recording.filter.reach());
    let passed = [&measured, &predicted].map(|rows| recording.filter.apply(rows, reach, 1));
    let [filtered, predicted] = passed;
    // What was differentiated has passed the filter.
    let is_derived = |channel: usize| {
        let from = [&recording.derived.force, &recording.derived.rates];
        from[channel / 3].is_some()
    };
    let left = (0..predicted.len()).map(|i| {
        Vector6::from_fn(|channel, _| {
            let rows = if is_derived(channel) { &measured[reach + i] } else { &filtered[i] };
            rows[channel] - predicted[i][channel]
        })
    });
    left.zip(&samples[first..])
        .map(|(value, sample)| {
            if let Some(i) = value.iter().position(|x| x.is_nan() || x.abs() >= RESIDUAL_MAX) {
                let (flight, time_s) = (recording.flight.to_owned(), sample.time_s);
                let (channel, value) = (CHANNELS[i], value[i]);
                return Err(GapError::TooLarge {
                    flight,
                    channel,
                    time_s,
                    value,
                    most: RESIDUAL_MAX,
                });
            }
            Ok(value)
        })
        .collect()
}

/// The measured samples of a piece with what the vehicle file says of the sensors taken off, at the
/// heights that `name` has: strapdown, held by barometer or GNSS.
fn samples(vehicle: &VehicleFile, recording: &Recording, piece: Span) -> Vec<Sample> {
    let effects = &vehicle.effects;
    let mut samples = recording.grid(piece);
    let track = Track::new(0, vehicle, recording, piece);
    let motion = track.motion(effects, &SensorErrors::default());
    let [rate_scale, force_scale] = track.scales(effects);
    for ((sample, known), load) in samples.iter_mut().zip(&motion.body).zip(&track.rotor_load) {
        let since_s = sample.time_s - track.began_s;
        sample.body.position = known.position;
        // Late fixes are put where they belong by the accelerometer.
        if effects.gnss_latency_s() != 0.0 {
            sample.body.velocity = known.velocity;
        }
        let heading_rad = effects.heading_bias_rad(since_s, *load);
        if heading_rad != 0.0 {
            let back = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, -heading_rad));
            sample.body.attitude = back.into_inner() * sample.body.attitude;
        }
        sample.body.omega.vector.component_div_assign(&rate_scale);
        sample.specific_force =
            (sample.specific_force - track.bias(effects, since_s)).component_div(&force_scale);
    }
    samples
}

fn stack(force: Vector3<f64>, moment: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(force.x, force.y, force.z, moment.x, moment.y, moment.z)
}

/// Force and moment of the model without gravity, body frame, at each sample.
fn model(
    vehicle: &VehicleFile,
    recording: &Recording,
    samples: &[Sample],
) -> Result<Vec<Wrench<Body, f64>>, GapError> {
    // No coarser than the simulator, and a whole number of steps to a sample.
    let step_max_s = PLANT_STEP_US as f64 * 1e-6;
    let steps = (recording.period_s / step_max_s - 1e-6).ceil().max(1.0) as usize;
    let dt_s = recording.period_s / steps as f64;
    // Without a battery, whose voltage is measured.
    let plant = Plant::new(vehicle.vehicle, vehicle.effects, vehicle.wing.clone(), None, dt_s)
        .map(|plant| if recording.speed.is_some() { plant.told_rotor_speeds() } else { plant })
        .map_err(|problem| GapError::Vehicle { vehicle: vehicle.name.clone(), problem })?;
    let commands = Commands::new(recording);
    let first = &samples[0];
    let mut clock = commands.clock(&vehicle.effects, first.time_s);
    let mut follow = |state: &mut PlantState, at_s: f64, voltage_v: f64, next: State<f64>| {
        // A command acts from the step that is nearest to its time.
        clock.advance_to(at_s + 0.5 * dt_s);
        let (rotor, wing) = clock.now();
        let mut now = Wrench::zero();
        state.battery.voltage_v = voltage_v;
        let Ok(()) = plant.step_with::<Infallible>(state, &rotor, wing, In::zero(), |_, wrench| {
            now = *wrench;
            Ok(next)
        });
        now
    };

    let mut state = plant.initial_state(first.body, 1.0);
    for _ in 0..(SETTLE_S / dt_s) as usize {
        follow(&mut state, first.time_s, first.voltage_v, first.body);
    }
    Ok(samples
        .iter()
        .zip(samples.iter().skip(1).chain(samples.last()))
        .map(|(sample, next)| {
            let mut wrench = Wrench::zero();
            for step in 0..steps {
                let at_s = sample.time_s + step as f64 * dt_s;
                let body = led(&sample.body, &next.body, (step + 1) as f64 / steps as f64);
                let now = follow(&mut state, at_s, sample.voltage_v, body);
                if step == 0 {
                    wrench = now;
                }
            }
            wrench
        })
        .collect())
}

/// The measured motion between two samples.
fn led(a: &State<f64>, b: &State<f64>, share: f64) -> State<f64> {
    let line = |a: Vector3<f64>, b: Vector3<f64>| a + (b - a) * share;
    State {
        position: In::new(line(a.position.vector, b.position.vector)),
        velocity: In::new(line(a.velocity.vector, b.velocity.vector)),
        attitude: between(a.attitude, b.attitude, share),
        omega: In::new(line(a.omega.vector, b.omega.vector)),
        ..State::at_rest()
    }
}
