//! Held-out flights of our own flight code flown again in closed loop: as the vehicle file was, and
//! with the effects added.
//!
//! The open loop asks whether forces are right for a second. Here the controller answers to the
//! model for the whole flight, so that what shows is what a user sees: whether the simulated drone
//! goes where the measured one went. Scenario, arm, integrator and what the flight code knew of the
//! battery are taken from the log; the vehicle is the one under test.

use crate::GapError;
use crate::flight::series::Series;
use serde::Serialize;
use squirrel_log::FlightLog;
use squirrel_sim::flight::Setup;
use squirrel_sim::replay;
use squirrel_sim::vehicle_file::VehicleFile;

/// What is compared.
const CHANNEL: &str = "gnss.position_ned_m";

/// One flight that was flown again.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClosedLoop {
    /// Name of the flight.
    pub flight: String,
    /// Root mean square of simulated less measured position, north, east, down, m: with the vehicle
    /// as it was.
    pub before_ned_m: [f64; 3],
    /// The same with the effects added.
    pub after_ned_m: [f64; 3],
}

/// Flies held-out flights again under both vehicles; flights that another autopilot flew are left
/// out, and a note says so.
///
/// * `before`, `after` - the vehicle as it was, and with the effects added
///
/// # Errors
/// A vehicle that cannot fly the scenario, a flight without position.
pub fn closed_loop(
    before: &VehicleFile,
    after: &VehicleFile,
    held_out: &[(String, FlightLog)],
) -> Result<(Vec<ClosedLoop>, Vec<String>), GapError> {
    let (mut all, mut notes) = (Vec::new(), Vec::new());
    for (flight, log) in held_out {
        if let Some(policy) = log.metadata.get("policy") {
            notes.push(format!(
                "{flight}: not flown again in closed loop: commanded by the policy {policy}"
            ));
            continue;
        }
        let setup = match replay::setup(log) {
            Ok(setup) => setup,
            Err(problem) => {
                notes.push(format!("{flight}: not flown again in closed loop: {problem}"));
                continue;
            }
        };
        let measured = Series::need(flight, log, CHANNEL, 3)?;
        let error = |vehicle: &VehicleFile| error_ned_m(vehicle, &setup, &measured);
        all.push(ClosedLoop {
            flight: flight.clone(),
            before_ned_m: error(before)?,
            after_ned_m: error(after)?,
        });
    }
    Ok((all, notes))
}

/// Root mean square of simulated less measured position, m, over the time that both flew.
fn error_ned_m(
    vehicle: &VehicleFile,
    setup: &Setup,
    measured: &Series,
) -> Result<[f64; 3], GapError> {
    let refused = |problem: String| GapError::Vehicle { vehicle: vehicle.name.clone(), problem };
    let mut vehicle = vehicle.clone();
    if let (Some(control), Some(flown)) = (&mut vehicle.control, &setup.vehicle.control) {
        // A patched model does not make the flight code that flew know more.
        control.thrust = flown.thrust;
    }
    let setup = Setup { vehicle, ..setup.clone() };
    let log = setup.fly(true, |_| {}).map_err(|e| refused(e.to_string()))?.log;
    let log = log.ok_or_else(|| refused("its flight was not logged".to_owned()))?;
    let flown = Series::need("closed loop", &log, CHANNEL, 3)?;
    let spans = measured.spans();
    let is_measured = |t: f64| spans.iter().any(|(start, end)| (*start..=*end).contains(&t));
    let (mut squares, mut n) = ([0.0; 3], 0.0);
    for (time_s, place) in flown.samples().filter(|(t, _)| is_measured(*t)) {
        let there = measured.vector(time_s);
        for axis in 0..3 {
            squares[axis] += (place[axis] - there[axis]).powi(2);
        }
        n += 1.0;
    }
    Ok(squares.map(|sum| (sum / f64::max(n, 1.0)).sqrt()))
}
