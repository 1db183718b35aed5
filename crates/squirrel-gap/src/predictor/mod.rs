//! What the simulator's own model predicts of the measurements of a set of flights, for any
//! hypothesis about the vehicle.
//!
//! ```text
//! dynamics     LP[f - f(plant)]  m/s^2      LP[D[w] - w'(plant)]  rad/s^2     12 Hz zero phase, every 1/30 s
//! kinematics   v_GNSS - v_strapdown  m/s                                      every 0.1 s, mean of a piece removed
//!              w(attitude) - w(gyroscope)  rad/s                              every 0.2 s, likewise
//! ```
//! The plant is led along the measured motion: rotors, servos and payload run under the logged
//! commands at the measured voltage, while velocity, attitude and rates are what was measured. A
//! hypothesis changes nothing but the vehicle's effects and what its sensors do, so that every
//! effect that the simulator can fly can be tested against a log; no regressor is written twice.
//! Forces show in the first family, sensors that lie in the second. Without an IMU the corner is
//! lower, as [`smoother`](crate::flight::smoother) has it, and there is no second family; with
//! measured rotor speeds these stand in for commands, lag and sag.

mod actuators;
mod commands;
mod drag_centre;
mod hypothesis;
mod innovations;
mod kept;
mod late;
mod leaning;
mod led;
mod noise;
mod slope;
mod spread;
mod track;
mod trim;
mod turning;

pub(crate) use commands::{Clock, Commands};
pub(crate) use drag_centre::DragCentre;
pub(crate) use hypothesis::Hypothesis;
pub(crate) use late::{ACCELEROMETER, GYROSCOPE, LATE};
pub(crate) use noise::TURBULENCE_M_S;
pub(crate) use track::{HEIGHT_KNOTS, Motion, SensorErrors, Track};

use crate::GapError;
use crate::flight::inertial::Common;
use crate::flight::recording::Recording;
use actuators::{KeptPaths, stride};
use hypothesis::Asked;
use kept::Kept;
use led::{States, StatesKey};
use nalgebra::{Vector3, Vector6};
use squirrel_core::effects::Effects;
use squirrel_core::vehicle::PerRotor;
use squirrel_log::FlightLog;
use squirrel_sim::plant::{Plant, WingPlant};
use squirrel_sim::vehicle_file::VehicleFile;
use std::ops::Range;
use std::rc::Rc;

/// The channels of a residual, in order: specific force, angular acceleration, velocity, rate.
pub(crate) const CHANNELS: [&str; 12] = [
    "force_body_x_n",
    "force_body_y_n",
    "force_body_z_n",
    "moment_body_x_n_m",
    "moment_body_y_n_m",
    "moment_body_z_n_m",
    "gnss.velocity_north_m_s",
    "gnss.velocity_east_m_s",
    "gnss.velocity_down_m_s",
    "imu.omega_body_x_rad_s",
    "imu.omega_body_y_rad_s",
    "imu.omega_body_z_rad_s",
];
/// Channels of the dynamics; the rest are kinematic.
pub(crate) const DYNAMIC: usize = 6;
/// The channel that shows thrust.
pub(crate) const FORCE_Z: usize = 2;
/// The first channel of the gyroscope against the attitude, which tells of nothing but these two.
pub(crate) const TURNING: usize = 9;

/// One channel of one piece of a flight within the list of rows.
#[derive(Debug, Clone)]
pub(crate) struct Segment {
    pub(crate) flight: usize,
    pub(crate) channel: usize,
    pub(crate) rows: Range<usize>,
    /// Piece and first time, s, and time between rows, s.
    pub(crate) piece: usize,
    pub(crate) t0_s: f64,
    pub(crate) step_s: f64,
    /// Samples of the residual that a row is the mean of.
    pub(crate) mean_of: usize,
}

/// A set of flights of one vehicle, ready to be predicted again and again.
pub(crate) struct Predictor<'a> {
    pub(crate) vehicle: &'a VehicleFile,
    pub(crate) names: Vec<&'a str>,
    pub(crate) tracks: Vec<Track>,
    pub(crate) segments: Vec<Segment>,
    pub(crate) notes: Vec<String>,
    /// Rotors turn as fast as was measured.
    rotor_speeds: bool,
    commands: Vec<Commands>,
    /// The motion of each track for the effects of the vehicle file and errorless sensors, which
    /// most hypotheses share.
    plain: Vec<Rc<Motion>>,
    /// Of each track, the last motions under other errors.
    motions: Vec<Kept<(SensorPath, SensorErrors), Motion>>,
    paths: KeptPaths,
    /// Of each track, the last states that a plant was led to.
    states: Vec<Kept<StatesKey, States>>,
    /// Of each track, the last residuals of its dynamics.
    dynamics: Vec<Kept<Asked, Vec<Vector6<f64>>, ANSWERS>>,
}

/// Residuals of a track that are kept: a search comes back to where it was. With eight a case takes
/// 5 % less of the processor; 32 save no more.
const ANSWERS: usize = 8;

impl<'a> Predictor<'a> {
    /// # Errors
    /// What [`Recording::new`] says of a flight.
    pub(crate) fn new(
        vehicle: &'a VehicleFile,
        flights: &'a [(String, FlightLog)],
    ) -> Result<Self, GapError> {
        Self::build(vehicle, flights, |_| f64::INFINITY)
    }

    /// The same flights by parts of them, if all would take long.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(crate) fn in_parts(
        &self,
        flights: &'a [(String, FlightLog)],
    ) -> Result<Option<Self>, GapError> {
        let mut duration_s = vec![0.0; flights.len()];
        for track in &self.tracks {
            duration_s[track.flight] += track.time_s.len() as f64 * track.period_s;
        }
        let total_s: f64 = duration_s.iter().sum();
        if total_s <= LOOKED_AT_S {
            return Ok(None);
        }
        let mut parts = Self::build(self.vehicle, flights, |flight| {
            LOOKED_AT_S * duration_s[flight] / total_s
        })?;
        parts.notes.push(format!(
            "of {total_s:.0} s of flight, names come from {LOOKED_AT_S:.0} s: parts spread evenly, and parts with much movement"
        ));
        Ok(Some(parts))
    }

    /// * `limit_s` - about how much of each flight is looked at
    fn build(
        vehicle: &'a VehicleFile,
        flights: &'a [(String, FlightLog)],
        limit_s: impl Fn(usize) -> f64,
    ) -> Result<Self, GapError> {
        if flights.is_empty() {
            return Err(GapError::NoFlights);
        }
        let (mut tracks, mut commands, mut notes, mut names) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let common = Common::of(flights, vehicle.vehicle.rotors().len())?;
        for (index, (flight, log)) in flights.iter().enumerate() {
            if names.contains(&flight.as_str()) {
                return Err(GapError::SameName { flight: flight.clone() });
            }
            let recording = Recording::new(vehicle, flight, log, common)?;
            let spans = spread::spread(&recording, limit_s(index));
            tracks
                .extend(spans.into_iter().map(|span| Track::new(index, vehicle, &recording, span)));
            commands.push(Commands::new(&recording));
            notes.extend(recording.notes);
            names.push(flight.as_str());
        }
        let plain: Vec<Rc<Motion>> = tracks
            .iter()
            .map(|track| Rc::new(track.motion(&vehicle.effects, &SensorErrors::default())))
            .collect();
        let mut segments = Vec::new();
        let mut start = 0;
        for (piece, (track, motion)) in tracks.iter().zip(&plain).enumerate() {
            let mut push = |channel, n: usize, t0_s, step_s| {
                let rows = start..start + n;
                start += n;
                let flight = track.flight;
                segments.push(Segment { flight, channel, rows, piece, t0_s, step_s, mean_of: 1 });
            };
            let step_s = track.every as f64 * track.period_s;
            for channel in 0..DYNAMIC {
                push(channel, track.measured.len(), track.residual_time_s(0), step_s);
            }
            // Where forces are those of the velocity, it agrees with itself.
            let kinematic = motion.kinematic.first().filter(|_| track.has_accelerometer());
            if let Some((t0_s, _)) = kinematic {
                let n = motion.kinematic.len();
                let step_s = (motion.kinematic[n - 1].0 - t0_s) / (n - 1).max(1) as f64;
                for channel in DYNAMIC..TURNING {
                    push(channel, n, *t0_s, step_s);
                }
            }
            if let Some(step_s) = track.turning_step_s() {
                for channel in TURNING..CHANNELS.len() {
                    push(channel, motion.turning.len(), track.time_s[0] + step_s, step_s);
                }
            }
        }
        let motions = tracks.iter().map(|_| Kept::default()).collect();
        let states = tracks.iter().map(|_| Kept::default()).collect();
        let dynamics = tracks.iter().map(|_| Kept::default()).collect();
        let paths = KeptPaths::default();
        let rotor_speeds = common.rotor_speeds;
        Ok(Self {
            vehicle,
            names,
            tracks,
            segments,
            notes,
            rotor_speeds,
            commands,
            plain,
            motions,
            paths,
            states,
            dynamics,
        })
    }

    /// Number of rows of a residual.
    pub(crate) fn rows(&self) -> usize {
        self.segments.last().map_or(0, |s| s.rows.end)
    }

    /// Leaves the moments out of everything that follows.
    pub(crate) fn leave_out_moments(&mut self) {
        self.segments.retain(|s| !(3..DYNAMIC).contains(&s.channel));
        let why = if !self.has_pitch() {
            "pitch was not measured"
        } else if !self.has_heading() {
            "the heading was not measured"
        } else if !self.has_motion() {
            "air at an unknown velocity may turn the vehicle"
        } else {
            "the vehicle file explains next to nothing of the measured ones"
        };
        self.notes.push(format!("moments: {why}; effects are named from forces alone"));
    }

    /// Leaves everything but the moments out of everything that follows.
    pub(crate) fn keep_moments(&mut self) {
        self.segments.retain(|s| (3..DYNAMIC).contains(&s.channel));
    }

    /// Leaves the horizontal force out of everything that follows: without velocity and attitude
    /// nothing is known of drag.
    pub(crate) fn leave_out_drag(&mut self) {
        self.segments.retain(|s| !(0..2).contains(&s.channel));
        self.notes.push(
            "force_body_x_n, force_body_y_n: left out; drag needs velocity and attitude".to_owned(),
        );
    }
    /// Whether a channel takes part.
    pub(crate) fn has_channel(&self, channel: usize) -> bool {
        self.segments.iter().any(|s| s.channel == channel)
    }
    /// Whether a channel takes part with all that it holds, and not with what lasts alone.
    pub(crate) fn has_all_of(&self, channel: usize) -> bool {
        self.segments.iter().any(|s| s.channel == channel && !s.is_trim())
    }

    /// What was measured, row by row, about its mean; 0 for the kinematics.
    pub(crate) fn measured(&self) -> Vec<f64> {
        let mut rows = vec![0.0; self.rows()];
        for segment in self.segments.iter().filter(|s| s.channel < DYNAMIC) {
            let measured = &self.tracks[segment.piece].measured;
            let mean =
                measured.iter().map(|m| m[segment.channel]).sum::<f64>() / measured.len() as f64;
            for (row, m) in rows[segment.rows.clone()].iter_mut().zip(segment.rows_of(measured)) {
                *row = m - mean;
            }
        }
        rows
    }

    /// The hypothesis that the vehicle file is right.
    pub(crate) fn nominal(&self) -> Hypothesis {
        Hypothesis {
            vehicle: self.vehicle.vehicle,
            effects: self.vehicle.effects,
            errors: vec![SensorErrors::default(); self.names.len()],
            thrust: vec![0.0; self.names.len()],
            drag_centre_m: Vector3::zeros(),
        }
    }

    /// The motion of a piece under a hypothesis.
    pub(crate) fn motion(&self, piece: usize, hypothesis: &Hypothesis) -> Rc<Motion> {
        let track = &self.tracks[piece];
        let (effects, errors) = (&hypothesis.effects, &hypothesis.errors[track.flight]);
        let path = sensors(effects);
        if *errors == SensorErrors::default() && path == sensors(&self.vehicle.effects) {
            return Rc::clone(&self.plain[piece]);
        }
        self.motions[piece].get((path, *errors), || track.motion(effects, errors))
    }

    /// Measured minus predicted, row by row.
    ///
    /// # Errors
    /// Effects that leave a vehicle which cannot be.
    pub(crate) fn residual(&self, hypothesis: &Hypothesis) -> Result<Vec<f64>, GapError> {
        let mut rows = vec![0.0; self.rows()];
        self.residual_of(hypothesis, None, &mut rows)?;
        Ok(rows)
    }

    /// As [`Self::residual`] for the pieces of one flight alone; the rows of the others stay as
    /// they are.
    pub(crate) fn residual_of(
        &self,
        hypothesis: &Hypothesis,
        flight: Option<usize>,
        rows: &mut [f64],
    ) -> Result<(), GapError> {
        let plant = self.plant_at(hypothesis, LED_STEP_S)?;
        let drag = DragCentre::of(self, hypothesis, LED_STEP_S)?;
        let is_asked = |own: usize| flight.is_none_or(|flight| flight == own);
        let days: Vec<Option<Plant>> = (0..self.names.len())
            .map(|flight| hypothesis.in_flight(flight).filter(|_| is_asked(flight)))
            .map(|own| own.map(|own| self.plant_at(&own, LED_STEP_S)).transpose())
            .collect::<Result<_, _>>()?;
        let paths =
            self.paths.of(&plant, &self.tracks, &self.commands, |t| stride(plant.effects(), t));
        let mut segments = self.segments.iter().peekable();
        for (piece, track) in self.tracks.iter().enumerate() {
            if !is_asked(track.flight) {
                while segments.next_if(|s| s.piece == piece).is_some() {}
                continue;
            }
            let motion = self.motion(piece, hypothesis);
            let own = days[track.flight].as_ref().unwrap_or(&plant);
            let dynamics = self.dynamics[piece].get(hypothesis.asked_of(track.flight), || {
                let model = self.predicted(own, drag.as_ref(), piece, &motion, &paths);
                led::dynamics(track, paths.piece(piece, track), &model)
            });
            while let Some(segment) = segments.next_if(|s| s.piece == piece) {
                let out = &mut rows[segment.rows.clone()];
                if segment.channel < DYNAMIC {
                    for (row, value) in out.iter_mut().zip(segment.rows_of(&dynamics)) {
                        *row = value;
                    }
                } else if segment.channel >= TURNING {
                    for (row, value) in out.iter_mut().zip(&motion.turning) {
                        *row = value[segment.channel - TURNING];
                    }
                } else {
                    // A hypothesis that moves the fixes in time may lose one at an end.
                    for (row, (_, value)) in out.iter_mut().zip(&motion.kinematic) {
                        *row = value[segment.channel - DYNAMIC];
                    }
                }
            }
        }
        Ok(())
    }

    /// Mean commanded rotor speed over top speed, and mean wing command, 0 to 1, at a time of a
    /// flight.
    pub(crate) fn commanded(&self, flight: usize, time_s: f64) -> (f64, f64) {
        let p = self.vehicle.vehicle.parameters();
        let (rotor, wing) = self.commands[flight].at(time_s);
        let turns =
            |u: &f64| if self.rotor_speeds { *u } else { p.propulsion.target_speed_rad_s(*u) };
        let speed: f64 = rotor[..p.rotor_count].iter().map(turns).sum();
        (speed / (p.rotor_count as f64 * p.propulsion.speed_max_rad_s), 0.5 * (wing[0] + wing[1]))
    }

    /// The rotor commands of a flight with their stamps, s.
    pub(crate) fn rotor_commands(&self, flight: usize) -> &[(f64, PerRotor<f64>)] {
        self.commands[flight].rotor()
    }

    /// From one rotor command of the logs to the next, s: of the slowest log.
    pub(crate) fn command_period_s(&self) -> f64 {
        self.commands.iter().map(Commands::period_s).fold(0.0, f64::max)
    }

    /// A hypothesis that the plant cannot be stepped with.
    pub(crate) fn refused(&self, problem: String) -> GapError {
        GapError::Vehicle { vehicle: self.vehicle.name.clone(), problem }
    }

    /// The motion of each piece for the effects of the vehicle file and errorless sensors.
    pub(crate) fn plain(&self) -> &[Rc<Motion>] {
        &self.plain
    }
    /// Whether every flight has attitude and velocity.
    pub(crate) fn has_motion(&self) -> bool {
        self.tracks.iter().all(|t| t.attitude().is_some() && !t.velocity().is_empty())
    }
    /// Whether every flight has forces that were measured as such.
    pub(crate) fn has_accelerometer(&self) -> bool {
        self.tracks.iter().all(Track::has_accelerometer)
    }
    /// Whether an accelerometer felt the forces of every flight, whoever turned them.
    pub(crate) fn is_felt(&self) -> bool {
        self.tracks.iter().all(Track::is_felt)
    }
    /// Whether every flight has rates that were measured as such.
    pub(crate) fn has_gyroscope(&self) -> bool {
        self.tracks.iter().all(|t| t.derived.rates.is_none())
    }
    /// Whether the heading of every flight was measured, and not taken as held.
    pub(crate) fn has_heading(&self) -> bool {
        self.tracks.iter().all(|t| t.derived.heading.is_none())
    }
    /// Whether the pitch of every flight was measured, and not taken for where thrust points.
    pub(crate) fn has_pitch(&self) -> bool {
        self.tracks.iter().all(|t| t.derived.pitch.is_none())
    }
    /// Whether every flight has a height.
    pub(crate) fn has_height(&self) -> bool {
        self.tracks.iter().all(|t| t.attitude().is_some() && !t.altitude_m().is_empty())
    }
    /// Whether rotors turn as fast as was measured, whatever they were told.
    pub(crate) fn has_rotor_speeds(&self) -> bool {
        self.rotor_speeds
    }
    /// Whether every flight has a battery voltage.
    pub(crate) fn has_voltage(&self) -> bool {
        self.tracks.iter().all(|t| t.has_voltage)
    }
    /// Whether the vehicle has wings and every flight their command.
    pub(crate) fn has_wings(&self) -> bool {
        self.commands.iter().all(Commands::has_wing)
    }

    /// What a metre per second of wind towards north, east and down changes in the rows, under a
    /// hypothesis.
    ///
    /// # Errors
    /// As [`Self::residual`].
    pub(crate) fn wind_columns(&self, hypothesis: &Hypothesis) -> Result<[Vec<f64>; 3], GapError> {
        let still = self.residual(hypothesis)?;
        let column = |axis: usize| {
            let mut moved = hypothesis.clone();
            for errors in &mut moved.errors {
                errors.air_ned_m_s[axis] += 1.0;
            }
            let after = self.residual(&moved)?;
            Ok(still.iter().zip(&after).map(|(b, a)| b - a).collect())
        };
        Ok([column(0)?, column(1)?, column(2)?])
    }

    /// The plant of a hypothesis as it was in one flight.
    ///
    /// # Errors
    /// As [`Self::plant_at`].
    pub(crate) fn plant_in(
        &self,
        hypothesis: &Hypothesis,
        flight: usize,
        dt_s: f64,
    ) -> Result<Plant, GapError> {
        match hypothesis.in_flight(flight) {
            Some(own) => self.plant_at(&own, dt_s),
            None => self.plant_at(hypothesis, dt_s),
        }
    }

    /// The plant of a hypothesis, without a battery, whose voltage is measured.
    ///
    /// # Errors
    /// [`GapError::Vehicle`]: the plant cannot be stepped with these numbers.
    pub(crate) fn plant_at(&self, hypothesis: &Hypothesis, dt_s: f64) -> Result<Plant, GapError> {
        let mut wing = self.vehicle.wing.clone();
        if let (WingPlant::Flat { wing, .. }, Some(own)) =
            (&mut wing, hypothesis.vehicle.parameters().wing)
        {
            *wing = own;
        }
        Plant::new(hypothesis.vehicle, hypothesis.effects, wing, None, dt_s)
            .map(|plant| if self.rotor_speeds { plant.told_rotor_speeds() } else { plant })
            .map_err(|problem| self.refused(problem))
    }

    /// The commands of a flight as the vehicle got them, from a time on.
    pub(crate) fn clock(&self, flight: usize, effects: &Effects<f64>, time_s: f64) -> Clock<'_> {
        self.commands[flight].clock(effects, time_s)
    }
}

/// What effects do to the path of the sensors.
type SensorPath = ([Vector3<f64>; 4], [f64; 4]);

/// What effects do to the sensors, in numbers; each is a line in time, the heading's in the rotors'
/// load, too.
fn sensors(effects: &Effects<f64>) -> SensorPath {
    let bias = |t| effects.specific_force_bias(t).vector;
    let heading = |t, load| effects.heading_bias_rad(t, load);
    (
        [bias(0.0), bias(1.0), effects.accel_scale().vector, effects.gyro_scale().vector],
        [heading(0.0, 0.0), heading(1.0, 0.0), heading(0.0, 1.0), effects.gnss_latency_s()],
    )
}

/// Flight time from which on only parts are looked at, s.
const LOOKED_AT_S: f64 = 480.0;
/// The step of a plant that is only led matters to nothing; it is shorter than any lag.
const LED_STEP_S: f64 = 1e-9;
