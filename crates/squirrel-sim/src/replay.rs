//! Replay: the log's inputs through the flight code again, and every output compared bit for bit.
//!
//! The log says which vehicle, arm and scenario flew; the flight code is rebuilt from that (or from
//! another vehicle file, to see what a changed gain would have done) and stepped with the recorded
//! frames.

mod pieces;

pub use pieces::replay_pieces;

use crate::arm::Arm;
use crate::estimator::Estimator;
use crate::flight::{self, Integrator, Setup};
use crate::scenario::Scenario;
use crate::vehicle_file::VehicleFile;
use crate::weights::ParnnWeights;
use squirrel_core::stack::StackState;
use squirrel_log::flight_code::{ESTIMATE, frames, record_output};
use squirrel_log::{Channel, FlightLog};
use std::collections::BTreeMap;

/// Sources that the flight code writes, causes before consequences: of two that differ at one time,
/// the first is named.
pub const OUTPUT_SOURCES: [&str; 10] = [
    "control.status",
    ESTIMATE,
    "control.failsafe",
    "reference",
    "control.excitation",
    "control.parnn",
    "control.outer",
    "control.inner",
    "wing",
    "rotor",
];

/// The first output that differs.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Difference {
    /// Channel: `control.outer.thrust_command_n`.
    pub channel: String,
    /// Time in the log, s.
    pub time_s: f64,
    /// Index within the sample.
    pub index: usize,
    /// Value in the log.
    pub logged: f64,
    /// Value of the replay.
    pub replayed: f64,
}

/// What a replay found.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Replay {
    /// Steps of the flight code.
    pub steps: usize,
    /// Output numbers compared.
    pub values: usize,
    /// The earliest difference; `None` where every bit is the same.
    pub first_difference: Option<Difference>,
}

/// The setup that a log was flown with.
///
/// # Errors
/// One line that names the metadata that is missing or cannot be used.
pub fn setup(log: &FlightLog) -> Result<Setup, String> {
    setup_of(&log.metadata)
}

/// As [`setup`], by a log's metadata alone.
///
/// # Errors
/// As [`setup`].
pub fn setup_of(metadata: &BTreeMap<String, String>) -> Result<Setup, String> {
    let text = |key: &str| {
        metadata.get(key).ok_or_else(|| {
            format!("metadata {key}: missing; the log was not recorded by squirrel fly")
        })
    };
    let weights = metadata.get(flight::PARNN_WEIGHTS).map(|hex| {
        ParnnWeights::from_hex(&format!("metadata {}", flight::PARNN_WEIGHTS), hex)
            .map_err(|e| e.to_string())
    });
    let mut vehicle = VehicleFile::parse_with(
        text("vehicle_toml")?,
        "metadata vehicle_toml",
        weights.transpose()?,
    )
    .map_err(|e| e.to_string())?;
    vehicle.estimator =
        metadata.get(flight::ESTIMATOR).map_or(Ok(Estimator::External), |n| Estimator::parse(n))?;
    let scenario = Scenario::parse(text("scenario_toml")?, "metadata scenario_toml")?;
    let integrator = Integrator::parse(text("integrator")?)?;
    Ok(Setup { vehicle, arm: Arm::parse(text("arm")?)?, scenario, integrator })
}

/// Flies the log's inputs through the flight code of `setup`.
///
/// # Errors
/// One line that names what the log lacks or what cannot be used.
pub fn replay(log: &FlightLog, setup: &Setup) -> Result<Replay, String> {
    let stack = setup.stack().map_err(|e| e.to_string())?;
    let frames = frames(log).map_err(|error| error.to_string())?;
    let mut state = StackState::default();
    let mut again = FlightLog::default();
    let rotors = stack.vehicle().rotors().len();
    for frame in &frames {
        let output = stack.step(&mut state, frame);
        let t = frame.time_us as f64 * 1e-6;
        record_output(&mut again, t, t, &output, rotors, None);
    }
    let mut replay = Replay { steps: frames.len(), values: 0, first_difference: None };
    for name in OUTPUT_SOURCES {
        compare(log, &again, name, &mut replay)?;
    }
    Ok(replay)
}

fn compare(
    log: &FlightLog,
    again: &FlightLog,
    name: &str,
    replay: &mut Replay,
) -> Result<(), String> {
    let (Some(logged), Some(replayed)) = (log.sources.get(name), again.sources.get(name)) else {
        return if log.sources.contains_key(name) == again.sources.contains_key(name) {
            Ok(())
        } else {
            Err(format!("{name}: in only one of log and replay"))
        };
    };
    if logged.time_s.len() != replayed.time_s.len() {
        let (a, b) = (logged.time_s.len(), replayed.time_s.len());
        return Err(format!("{name}: {a} samples in the log, {b} in the replay"));
    }
    for (channel, values) in &replayed.channels {
        let full = format!("{name}.{channel}");
        let Some(before) = logged.channels.get(channel) else {
            return Err(format!("{full}: missing in the log"));
        };
        if before.width != values.width {
            return Err(format!(
                "{full}: has {} numbers a sample, must have {}",
                before.width, values.width
            ));
        }
        replay.values += values.values.len();
        if let Some(found) = Difference::first(full, &logged.time_s, before, values)
            && replay.first_difference.as_ref().is_none_or(|d| found.time_s < d.time_s)
        {
            replay.first_difference = Some(found);
        }
    }
    Ok(())
}

impl Difference {
    /// The first of a channel whose numbers are as wide in the log as in the replay.
    fn first(name: String, time_s: &[f64], logged: &Channel, replayed: &Channel) -> Option<Self> {
        let differs = |(a, b): (&f64, &f64)| a.to_bits() != b.to_bits();
        let at = logged.values.iter().zip(&replayed.values).position(differs)?;
        Some(Self {
            channel: name,
            time_s: time_s[at / replayed.width],
            index: at % replayed.width,
            logged: logged.values[at],
            replayed: replayed.values[at],
        })
    }
}
