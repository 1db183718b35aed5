//! Lesson 12, the drone that sank: what a flight log knows that the simulation does not.
//!
//! In the paper's flights the drone without wings sinks while it avoids an obstacle, and the
//! authors suspect the battery. Here that suspicion is the truth, hidden in a "measured" drone
//! whose rotors slow down as its voltage falls. The simulation does not know. The gap workflow
//! finds what is missing, names it, adds it to the vehicle file, and the simulated drone sinks like
//! the measured one, in flights that nobody has fitted.
//!
//! ```sh
//! cargo run --release -p squirrel-examples --example the_drone_that_sank
//! ```
#![allow(clippy::print_stdout, reason = "a lesson is told")]

use squirrel_examples::Outcome;
use squirrel_gap::{Finding, Verdict, add, diagnose, find};
use squirrel_log::FlightLog;
use squirrel_sim::arm::Arm;
use squirrel_sim::estimator::Estimator;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::{MissionTable, Scenario};
use squirrel_sim::vehicle_file::{SQUIRREL_TOML, VehicleFile};

/// What only the measured drone has: the hidden effect, and rotors that are off by half of their
/// tolerance.
const SECRETS: [(&str, &str); 3] = [
    ("[limits]", "[effects.battery_sag]\nvoltage_exponent = 0.9\n\n[limits]"),
    ("value = 6.0e-7", "value = 5.97e-7"),
    // Nor does its flight code know: it asks for no more thrust than with a full battery.
    ("[control]\n", "[control]\nvoltage_exponent = 0.0\n"),
];
/// Charge at take-off of a flight that sinks, 0 to 1.
const LOW: f64 = 0.25;
/// Seeds of the avoidance flights: a steering angle and a run of noise each.
const HELD_OUT: [u64; 4] = [11, 12, 13, 14];

/// What the lesson is about, in numbers.
struct Story {
    finding: Finding,
    verdict: Verdict,
    patch: String,
    /// One a held-out flight.
    flights: Vec<Sink>,
}

/// Heights of one avoidance flight, m.
struct Sink {
    seed: u64,
    /// How far the drone sank: measured, simulated, simulated with the effect added.
    lost_m: [f64; 3],
    /// Root mean square of simulated less measured height: without the effect, with it.
    error_m: [f64; 2],
}

/// The drone that flies in the lesson's reality; its sensors have noise of their own.
fn measured() -> Outcome<VehicleFile> {
    let text = SECRETS
        .iter()
        .fold(SQUIRREL_TOML.to_owned(), |text, (from, to)| text.replacen(from, to, 1));
    let mut vehicle = VehicleFile::parse(&text, "measured")?;
    // Attitude comes from another autopilot, as in most logs.
    vehicle.estimator = Estimator::External;
    let sensors = &mut vehicle.sensors;
    for timing in [&mut sensors.imu.timing, &mut sensors.attitude.timing, &mut sensors.gnss.timing]
    {
        timing.seed = Some(42);
    }
    Ok(vehicle)
}

/// A flight of the paper's conventional controller on a low battery.
fn fly(vehicle: &VehicleFile, scenario: &str, seed: u64, charge: f64) -> Outcome<(FlightLog, f64)> {
    let mut scenario = Scenario::find(scenario)?;
    (scenario.seed, scenario.battery_charge) = (seed, charge);
    if let MissionTable::Excite(table) = &mut scenario.mission {
        table.even_seed_charge = charge;
        // It sinks: no rung of the ladder near the ground.
        table.heights_m = vec![1.5, 1.2, 0.9];
    }
    let setup =
        Setup { vehicle: vehicle.clone(), arm: Arm::Pc, scenario, integrator: Integrator::Rk4 };
    let flight = setup.fly(true, |_| {})?;
    Ok((flight.log.ok_or("the flight has no log")?, flight.metrics.height_lost_m))
}

/// Root mean square of the difference in height of two flights, m.
fn height_error_m(a: &FlightLog, b: &FlightLog) -> Outcome<f64> {
    let heights = |log: &FlightLog| -> Outcome<Vec<f64>> {
        let (_, position) = log.channel("gnss.position_ned_m").ok_or("the log has no position")?;
        Ok(position
            .values
            .chunks_exact(3)
            .map(|p| -p[2])
            .filter(|height| height.is_finite())
            .collect())
    };
    let (a, b) = (heights(a)?, heights(b)?);
    let squares: Vec<f64> = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).collect();
    Ok((squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

fn story() -> Outcome<Story> {
    let simulated = VehicleFile { estimator: Estimator::External, ..VehicleFile::squirrel() };
    let measured = measured()?;

    // The sink: the same manoeuvre on the measured drone and in the simulation.
    let mut avoidance = Vec::new();
    for seed in HELD_OUT {
        avoidance.push((format!("avoid-{seed}"), fly(&measured, "avoid", seed, LOW)?));
    }
    let logs: Vec<_> =
        avoidance.iter().map(|(name, (log, _))| (name.clone(), log.clone())).collect();

    // Find: where do these flights disagree with the vehicle file?
    let finding = find(&simulated, &logs)?;

    // Name: two flights that show every effect, on a fuller and an emptier battery; the avoidance
    // flights prove it.
    let mut excitation = Vec::new();
    for (seed, charge) in [(1, 0.7), (2, LOW)] {
        excitation.push((format!("excite-{seed}"), fly(&measured, "excite_rich", seed, charge)?.0));
    }
    let diagnosis = diagnose(&simulated, &excitation, &logs, &|_| {})?;

    // Add: a new vehicle file.
    let names: Vec<String> = excitation.iter().map(|(name, _)| name.clone()).collect();
    let patch = add(&simulated, &diagnosis, &names)?;
    let mut patched =
        VehicleFile { estimator: Estimator::External, ..VehicleFile::parse(&patch, "patched")? };
    // The model knows more now; the flight code that flew does not.
    patched.control = simulated.control;

    // Shrink: fly the avoidance again in closed loop, without and with the effect.
    let mut flights = Vec::new();
    for (seed, (_, (log, lost_m))) in HELD_OUT.into_iter().zip(&avoidance) {
        let (before, lost_before_m) = fly(&simulated, "avoid", seed, LOW)?;
        let (after, lost_after_m) = fly(&patched, "avoid", seed, LOW)?;
        flights.push(Sink {
            seed,
            lost_m: [*lost_m, lost_before_m, lost_after_m],
            error_m: [height_error_m(&before, log)?, height_error_m(&after, log)?],
        });
    }
    Ok(Story { finding, verdict: diagnosis.verdict, patch, flights })
}

fn main() -> Outcome<()> {
    let Story { finding, verdict, patch, flights } = story()?;
    let [x, y, z] = finding.residual.force_body_rms_n;
    println!("find: residual force of the avoidance flights x {x:.3} N, y {y:.3} N, z {z:.3} N\n");
    println!("name: {}\n", verdict.words);
    println!("add:\n{}", squirrel_gap::difference(SQUIRREL_TOML, &patch));
    println!(
        "shrink:   sinks by, m                       height error against the measured flight, m"
    );
    println!("flight    measured  simulated  with effect  simulated  with effect");
    for Sink { seed, lost_m: [measured, before, after], error_m: [error, left] } in flights {
        println!(
            "avoid {seed:<3} {measured:>8.2}  {before:>9.2}  {after:>11.2}  {error:>9.3}  {left:>11.3}"
        );
    }
    Ok(())
}

#[test]
fn the_sink_is_found_named_added_and_gone() {
    let Ok(Story { finding, verdict, patch, flights }) = story() else {
        panic!("the story cannot be told")
    };
    let [x, y, z] = finding.residual.force_body_rms_n;
    assert!(z > 3.0 * x.max(y), "the gap is along z: {:?}", finding.residual.force_body_rms_n);
    let names: Vec<&str> = verdict.effects.iter().map(|effect| effect.name).collect();
    assert_eq!(
        (verdict.verdict, names),
        (squirrel_gap::Kind::Named, vec!["battery_sag"]),
        "{}",
        verdict.words
    );
    assert!(patch.contains("[effects.battery_sag]"));
    // Each flight has noise of its own, so that two flights of one vehicle differ, too.
    for Sink { seed, lost_m: [measured, before, _], error_m: [error, left] } in &flights {
        assert!(
            *measured > before + 1.0,
            "flight {seed} sinks {measured} m, {before} m in simulation"
        );
        assert!(
            *left < 0.5 * error,
            "flight {seed}: height error {error} m, with the effect {left} m"
        );
    }
    let mean =
        |which: usize| flights.iter().map(|f| f.lost_m[which]).sum::<f64>() / flights.len() as f64;
    assert!((mean(2) / mean(0) - 1.0).abs() < 0.15, "sinks {} m, measured {} m", mean(2), mean(0));
}
