//! Recording: what a flight of the simulator adds to the channels of its flight code, and the log's
//! metadata.

use super::{FlightError, Offboard, Setup};
use crate::plant::PlantState;
use crate::sensors::logged::Row;
use squirrel_core::control::Reference;
use squirrel_core::effects::Effects;
use squirrel_core::frames::{Body, In, Ned};
use squirrel_core::stack::{SensorFrame, StackOutput};
use squirrel_log::FlightLog;
use squirrel_log::flight_code::{FOLLOWED, FORMAT, Inputs, Moved, record_output, record_reference};
use std::collections::{BTreeMap, BTreeSet};

/// Metadata: the weights that the vehicle's text names, so that a log replays without them at hand.
pub(crate) const PARNN_WEIGHTS: &str = "parnn_weights_hex";
/// Source of what it believes besides.
const BELIEVED: &str = "offboard.believed";
/// Metadata: who estimated. A log without it is of somebody outside.
pub(crate) const ESTIMATOR: &str = "estimator";

/// Length of the pieces in which a flight is given away, s.
const PIECE_S: f64 = 5.0;

/// What becomes of what a flight records.
pub enum Recording<'a> {
    /// Nothing is recorded.
    None,
    /// All of it comes back with the flight.
    Whole,
    /// It is given away while it is flown, so that a long flight takes no memory.
    Given(&'a mut dyn Recipient),
}

/// Who is given what a flight records.
pub trait Recipient {
    /// The flight begins.
    ///
    /// # Errors
    /// Why it must not go on.
    fn begin(&mut self, metadata: &BTreeMap<String, String>) -> Result<(), FlightError>;

    /// The samples since the last piece, up to a time of the flight, s.
    ///
    /// # Errors
    /// Why it must not go on.
    fn take(&mut self, piece: FlightLog, now_s: f64) -> Result<(), FlightError>;
}

pub(super) struct Recorder<'a> {
    log: FlightLog,
    recording: Recording<'a>,
    /// Sources of which the first sample in the log is given away: each keeps its last one, which
    /// says what it holds and when it was.
    given: BTreeSet<String>,
    /// When the next piece is due, s.
    next_s: f64,
    rotors: usize,
    effects: Effects<f64>,
    inputs: Inputs,
}

impl std::fmt::Debug for Recording<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::None => "None",
            Self::Whole => "Whole",
            Self::Given(_) => "Given",
        })
    }
}

impl<'a> Recorder<'a> {
    /// `None` where nothing is recorded.
    pub(super) fn new(
        setup: &Setup,
        pilot: Option<&dyn Offboard>,
        rotors: usize,
        mut recording: Recording<'a>,
    ) -> Result<Option<Self>, FlightError> {
        if matches!(recording, Recording::None) {
            return Ok(None);
        }
        let mut log = FlightLog::default();
        let scenario = &setup.scenario;
        let vehicle = setup.vehicle.vehicle.parameters();
        let obstacles: Vec<String> =
            scenario.all_obstacles().iter().map(|o| format!("{o:?}")).collect();
        let thrust_max_n = setup.thrust_to_weight() * setup.vehicle.vehicle.weight_n();
        for (key, value) in [
            ("format", FORMAT.to_owned()),
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("vehicle", setup.vehicle.name.clone()),
            ("vehicle_toml", setup.vehicle.text.clone()),
            ("scenario_toml", scenario.to_toml()),
            ("arm", setup.arm.name().to_owned()),
            (ESTIMATOR, setup.vehicle.estimator.name().to_owned()),
            ("integrator", setup.integrator.name().to_owned()),
            ("seed", scenario.seed.to_string()),
            ("tilt_max_rad", vehicle.limits.tilt_max_rad.to_string()),
            ("thrust_max_n", thrust_max_n.to_string()),
            ("obstacles_json", format!("[{}]", obstacles.join(","))),
        ] {
            log.metadata.insert(key.to_owned(), value);
        }
        if let Some(weights) = &setup.vehicle.weights {
            log.metadata.insert(PARNN_WEIGHTS.to_owned(), weights.to_hex());
        }
        if let Some(pilot) = pilot {
            log.metadata
                .extend(pilot.facts().into_iter().map(|(key, value)| (key.to_owned(), value)));
        }
        if let Recording::Given(recipient) = &mut recording {
            recipient.begin(&log.metadata)?;
        }
        let inputs = Inputs::new(setup.vehicle.estimator.is_filter());
        let (effects, given) = (setup.vehicle.effects, BTreeSet::new());
        Ok(Some(Self { log, recording, given, next_s: PIECE_S, rotors, effects, inputs }))
    }

    pub(super) fn tick(
        &mut self,
        frame: &SensorFrame,
        logged: &[(&str, Row)],
        output: &StackOutput,
        state: &PlantState,
        air: In<Ned, f64>,
        wing_force: In<Body, f64>,
    ) -> Result<(), FlightError> {
        let t = frame.time_us as f64 * 1e-6;
        self.inputs.record(&mut self.log, t, frame);
        for (source, row) in logged {
            let row = row.iter().map(|(channel, x)| (*channel, std::slice::from_ref(x)));
            self.log.source_mut(source).push(t, &row.collect::<Vec<_>>());
        }
        let stamp = self.effects.command_clock().stamp_s(t);
        let moved = Moved {
            rotor_speed_rad_s: &state.body.rotor_speed_rad_s[..self.rotors],
            deployment: state.deployment(),
        };
        record_output(&mut self.log, t, stamp, output, self.rotors, Some(moved));
        self.plant(t, state, air, wing_force);
        if t >= self.next_s {
            self.next_s = t + PIECE_S;
            self.give(t)?;
        }
        Ok(())
    }

    /// Gives away what is new, where somebody wants it.
    fn give(&mut self, now_s: f64) -> Result<(), FlightError> {
        let Recording::Given(recipient) = &mut self.recording else { return Ok(()) };
        let mut piece = FlightLog::default();
        for (name, source) in &mut self.log.sources {
            let (samples, first) = (source.time_s.len(), usize::from(self.given.contains(name)));
            if samples > first {
                piece.sources.insert(name.clone(), source.from_sample(first));
                self.given.insert(name.clone());
                drop(source.take(samples - 1));
            }
        }
        recipient.take(piece, now_s)
    }

    /// What an offboard computer follows, where that is not the mission, and what it believes
    /// besides.
    pub(super) fn followed(
        &mut self,
        time_us: u64,
        reference: Option<&Reference>,
        pilot: Option<&dyn Offboard>,
    ) {
        let t = time_us as f64 * 1e-6;
        if let Some(reference) = reference {
            record_reference(&mut self.log, FOLLOWED, t, reference);
        }
        let vectors = pilot.map(Offboard::believed).unwrap_or_default();
        let rows: Vec<(&str, &[f64])> =
            vectors.iter().map(|(name, v)| (*name, v.as_slice())).collect();
        if !rows.is_empty() {
            self.log.source_mut(BELIEVED).push(t, &rows);
        }
    }

    fn plant(&mut self, t: f64, state: &PlantState, air: In<Ned, f64>, wing_force: In<Body, f64>) {
        let body = &state.body;
        let log = &mut self.log;
        log.source_mut("truth").push(
            t,
            &[
                ("position_ned_m", body.position.vector.as_slice()),
                ("velocity_ned_m_s", body.velocity.vector.as_slice()),
                ("q_ned_from_body_wxyz", &body.ned_from_body().wxyz()),
                ("omega_body_rad_s", body.omega.vector.as_slice()),
                ("wing_force_body_n", wing_force.vector.as_slice()),
                ("wind_ned_m_s", air.vector.as_slice()),
                ("battery_charge", &[state.battery.charge]),
            ],
        );
    }

    /// The log, where all of it is kept.
    pub(super) fn finish(mut self) -> Result<Option<FlightLog>, FlightError> {
        self.give(f64::INFINITY)?;
        Ok(matches!(self.recording, Recording::Whole).then_some(self.log))
    }
}
