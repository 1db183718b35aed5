//! Lesson 1, hover: the simplest flight.
//!
//! A [`Setup`] is all that a flight depends on: vehicle, arm (who flies), scenario (what, in which
//! air, from which seed), and what moves the body. Flying it gives metrics and, where asked for,
//! the log. Look at the two heights: where the vehicle is, which only a simulator knows, and where
//! the flight code believes it to be. It holds the place that it believes in.
//!
//! ```sh
//! cargo run --release -p squirrel-examples --example hover
//! ```
#![allow(clippy::print_stdout, reason = "a lesson is told")]

use squirrel_examples::Outcome;
use squirrel_log::FlightLog;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Flight, Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// The shipped vehicle holds its place for ten seconds, 30 m above the ground.
fn fly(seed: u64) -> Outcome<Flight> {
    let scenario = Scenario { seed, ..Scenario::find("hover")? };
    let vehicle = VehicleFile::squirrel();
    let setup = Setup { vehicle, arm: Arm::Pc, scenario, integrator: Integrator::Rk4 };
    Ok(setup.fly(true, |_| {})?)
}

/// Times, s, and heights, m, of a channel of positions; NED points down.
fn heights(log: &FlightLog, channel: &str) -> Outcome<Vec<[f64; 2]>> {
    let (time_s, positions) =
        log.channel(channel).ok_or_else(|| format!("the log lacks {channel}"))?;
    Ok(time_s.iter().enumerate().map(|(i, time_s)| [*time_s, -positions.row(i)[2]]).collect())
}

fn main() -> Outcome<()> {
    let Flight { metrics, log } = fly(1)?;
    let log = log.ok_or("no log was kept")?;
    println!(
        "error {:.3} m, tilt at most {:.1} deg",
        metrics.rmse_m,
        metrics.tilt_max_rad.to_degrees()
    );
    println!(
        "sank by {:.3} m, climbed by {:.3} m\n",
        metrics.height_lost_m, metrics.height_gained_m
    );

    println!("time s  height m  believed m");
    let believed = heights(&log, "estimate.position_ned_m")?;
    // Each source has its own times: what is believed is the last that was said by then.
    for [time_s, height_m] in heights(&log, "truth.position_ned_m")?.into_iter().step_by(300) {
        let said = believed.partition_point(|[at_s, _]| *at_s <= time_s);
        let believed_m = believed[..said].last().map_or(f64::NAN, |[_, height_m]| *height_m);
        println!("{time_s:>6.1}  {height_m:>8.2}  {believed_m:>10.2}");
    }

    println!("\nsources of the log:");
    for (name, source) in &log.sources {
        println!(
            "  {name:<16} {:>5} samples of {} channels",
            source.time_s.len(),
            source.channels.len()
        );
    }
    Ok(())
}

#[test]
fn it_holds_its_place_and_says_so_in_the_log() -> Outcome<()> {
    let Flight { metrics, log } = fly(1)?;
    assert!(metrics.rmse_m < 1.0, "error {} m", metrics.rmse_m);
    assert!(metrics.tilt_max_rad < 0.2 && metrics.contact_s.is_none() && !metrics.not_finite);
    let heights = heights(&log.ok_or("no log was kept")?, "truth.position_ned_m")?;
    let lowest = heights.iter().map(|[_, height_m]| *height_m).fold(f64::INFINITY, f64::min);
    assert!(
        (30.0 - lowest - metrics.height_lost_m).abs() < 1e-9,
        "{lowest} m, {}",
        metrics.height_lost_m
    );
    Ok(())
}

#[test]
fn the_same_seed_is_the_same_flight() -> Outcome<()> {
    let [first, again, other] = [fly(1)?, fly(1)?, fly(2)?];
    assert_eq!(first.metrics, again.metrics);
    assert_ne!(first.metrics, other.metrics);
    Ok(())
}
