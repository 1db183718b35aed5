//! Lesson 11, `squirrel study faults`: one thing fails in flight; what becomes of it?
//!
//! Each trial draws a fault, its size and time, sensors, scenario and thrust. A flight is lost
//! where it turns over or hits the ground; a fault is flagged where the flight code reports
//! anything. A loss that nobody was told of is the worst outcome, so it has a column of its own.
//! Look at which fault is survived unnoticed: a wing that is stuck where that costs nothing.
//!
//! ```sh
//! cargo run --release -p squirrel-examples --example study_faults
//! squirrel study faults        # the whole of it
//! ```
#![allow(clippy::print_stdout, reason = "a lesson is told")]

use squirrel_examples::Outcome;
use squirrel_sim::arm::Arm;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::faults::{self, Faults};
use squirrel_study::journal::Keep;
use squirrel_study::statistics::Share;

fn study() -> Outcome<Faults> {
    let plan = Plan::calm(VehicleFile::squirrel(), vec![Arm::TwccPlus], 100, 1);
    Ok(faults::run(&plan, 1, &Keep::default())?.ok_or("a part of a study")?)
}

/// Of faults that can be survived, those that were.
fn survived(study: &Faults) -> Share {
    Share::of(study.flights.iter().filter(|flight| flight.survivable).map(|flight| flight.survived))
}

fn main() -> Outcome<()> {
    let study = study()?;
    println!("fault            flights  survivable  survived  reported  lost  lost, not reported");
    for row in &study.rows {
        let (fault, flights, lost) = (row.fault, row.flights, row.lost);
        println!(
            "{fault:<16} {flights:>7}  {:>10}  {:>8}  {:>8}  {lost:>4}  {:>18}",
            row.survivable, row.survived, row.flagged, row.lost_unflagged
        );
    }
    let share = survived(&study);
    let [low, high] = [share.share.low, share.share.high].map(|share| 100.0 * share);
    println!(
        "\nsurvived, of those that can be: {} of {} ({low:.1} to {high:.1} %)",
        share.count, share.of
    );
    Ok(())
}

#[test]
fn no_flight_is_lost_in_silence() -> Outcome<()> {
    let study = study()?;
    assert_eq!(study.flights.len(), 100);
    for row in &study.rows {
        assert_eq!((row.lost_unflagged, row.not_finite), (0, 0), "{row:?}");
    }
    let share = survived(&study);
    assert!(share.share.value > 0.95 && share.share.low < share.share.value, "{share:?}");
    Ok(())
}
