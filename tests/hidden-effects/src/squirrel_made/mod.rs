//! The first flight generator: squirrel itself, with the hidden effects in the vehicle file that
//! flies.
//!
//! The individual is a vehicle file too, so that all its rotors are alike. What is logged beyond
//! the sensors and the commands is taken out, and commands are put on the clock of the inertial
//! unit: their own stamps would give a skew away.

mod legs;
mod tables;

pub use tables::effect_table;

use crate::airframe::{Airframe, SensorErrors};
use crate::catalogue::HiddenEffect;
use crate::further::Further;
use crate::independent::{DURATION_S, Excitation};
use crate::recorder::TRUTH;
use squirrel_log::{Channel, FlightLog, Source};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{InProcess, Integrator, Setup};
use squirrel_sim::scenario::{MissionTable, Scenario};
use squirrel_sim::vehicle_file::VehicleFile;

/// One flight to be made.
#[derive(Debug, Clone)]
pub struct Order<'a> {
    /// The individual that flies.
    pub real: &'a Airframe,
    /// Its sensors.
    pub errors: SensorErrors,
    /// Resistance of its battery, ohm.
    pub resistance_ohm: f64,
    /// Hidden effects.
    pub effects: &'a [HiddenEffect],
    /// What is flown.
    pub excitation: Excitation,
    /// What is flown after that.
    pub further: Further,
    /// Factor on the white noise of all sensors.
    pub noise: f64,
    /// Charge at take-off, 0 to 1.
    pub charge: f64,
    /// Order of manoeuvres, turbulence and noise.
    pub seed: u64,
}

/// What a recorder on board has, and the truth, which stays with the bench.
const KEPT: [(&str, &[&str]); 8] = [
    (TRUTH, &["position_ned_m", "velocity_ned_m_s", "q_ned_from_body_wxyz"]),
    ("imu", &["omega_body_rad_s", "specific_force_body_m_s2"]),
    ("attitude", &["q_ned_from_body_wxyz"]),
    ("gnss", &["position_ned_m", "velocity_ned_m_s"]),
    ("baro", &["altitude_m"]),
    ("battery", &["voltage_v", "current_a"]),
    ("rotor", &["command"]),
    ("wing", &["command"]),
];

/// Turbulence of every flight, m/s an axis, and its correlation time, s.
const TURBULENCE: (f64, f64) = (0.12, 1.0);

/// Flies an order and logs it.
///
/// # Errors
/// The vehicle file or the flight is refused, or the vehicle fell or tumbled.
pub fn fly(order: &Order<'_>) -> Result<FlightLog, String> {
    let text = tables::vehicle(order);
    let mut vehicle = VehicleFile::parse(&text, "individual").map_err(|error| error.to_string())?;
    if let Some(control) = &mut vehicle.control {
        // What is hidden the flight code does not know either.
        control.thrust.exponent = 0.0;
    }
    let name = match order.excitation {
        Excitation::Rich => "excite_rich",
        Excitation::Normal => "excite_normal",
        Excitation::Calm => "excite_calm",
    };
    let mut scenario = Scenario::find(name)?;
    (scenario.seed, scenario.battery_charge) = (order.seed, order.charge);
    (scenario.wind.gust_sigma_m_s, scenario.wind.gust_time_constant_s) = TURBULENCE;
    scenario.duration_s = DURATION_S + order.further.duration_s();
    if let MissionTable::Excite(table) = &mut scenario.mission {
        table.even_seed_charge = order.charge;
    }
    let setup = Setup { vehicle, arm: Arm::Pc, scenario, integrator: Integrator::Rk4 };
    let flight = if order.further == Further::default() {
        setup.fly(true, |_| {})
    } else {
        let mut computer = InProcess::new(legs::stack(&setup, order.further)?);
        setup.fly_on(&mut computer, None, true, |_| {})
    };
    let flight = flight.map_err(|error| error.to_string())?;
    if let Some(time_s) = flight.metrics.contact_s {
        return Err(format!("touched the ground at {time_s:.2} s"));
    }
    let log = flight.log.ok_or("the flight has no log")?;
    stayed_up(&log)?;
    Ok(on_board(&log))
}

/// Refuses a flight that tumbles or goes below the ground.
fn stayed_up(log: &FlightLog) -> Result<(), String> {
    let (Some((time_s, position)), Some((_, omega))) =
        (log.channel("truth.position_ned_m"), log.channel("truth.omega_body_rad_s"))
    else {
        return Err("the flight has no truth".to_owned());
    };
    for (k, time_s) in time_s.iter().enumerate() {
        let (height_m, rate) =
            (-position.row(k)[2], omega.row(k).iter().map(|w| w * w).sum::<f64>().sqrt());
        if !(height_m > 0.0 && rate < 25.0) {
            return Err(format!(
                "lost at {time_s:.2} s: height {height_m:.2} m, rate {rate:.1} rad/s"
            ));
        }
    }
    Ok(())
}

fn on_board(log: &FlightLog) -> FlightLog {
    let mut kept = FlightLog::default();
    let clock = log.sources.get("imu").map(|imu| imu.time_s.clone()).unwrap_or_default();
    for (name, channels) in KEPT {
        let Some(source) = log.sources.get(name) else { continue };
        let mut own = Source { time_s: source.time_s.clone(), ..Source::default() };
        own.channels = source.channels.clone();
        own.channels.retain(|channel, _| channels.contains(&channel.as_str()));
        if matches!(name, "rotor" | "wing") {
            own = held(&own, &clock);
        }
        kept.sources.insert(name.to_owned(), own);
    }
    kept
}

/// A source on another clock: each sample is the last one before it, the first also before the
/// first.
fn held(source: &Source, clock: &[f64]) -> Source {
    let at = |t: &f64| source.time_s.partition_point(|stamp| *stamp <= t + 1e-9).saturating_sub(1);
    let channels = source.channels.iter().map(|(name, channel)| {
        let values = clock.iter().flat_map(|t| channel.row(at(t)).to_vec()).collect();
        (name.clone(), Channel { width: channel.width, values })
    });
    Source { time_s: clock.to_vec(), channels: channels.collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_held_on_the_other_clock() {
        let mut source = Source::default();
        for k in 0..5 {
            source.push(0.1 * f64::from(k) * 1.01 + 0.01, &[("command", &[f64::from(k)])]);
        }
        let on = held(&source, &[0.0, 0.1, 0.2, 0.4]);
        assert_eq!(on.channels["command"].values, [0.0, 0.0, 1.0, 3.0]);
    }
}
