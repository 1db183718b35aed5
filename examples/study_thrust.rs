//! Lesson 5, `squirrel study thrust`: what wings are worth as thrust gets scarce.
//!
//! A study is a [`Plan`] (vehicle, arms, trials, seed) and a [`Keep`] (a folder from which it goes
//! on after a stop, or nothing, as here). The avoidance manoeuvre is flown at several effective
//! thrust-to-weight ratios, set by a limit or by an emptier battery. The fair comparison is
//! `twcc_plus`, the best controller here, with `pc_plus`, the same with its wings folded. Look at
//! how the gain of wings shrinks from a fifth to a fiftieth as thrust grows.
//!
//! ```sh
//! cargo run --release -p squirrel-examples --example study_thrust
//! squirrel study thrust        # the whole of it
//! ```
#![allow(clippy::print_stdout, reason = "a lesson is told")]

use squirrel_examples::{Outcome, percent};
use squirrel_sim::arm::Arm;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::journal::Keep;
use squirrel_study::thrust::{self, Thrust};

fn study() -> Outcome<Thrust> {
    // `pc` flies in any case: gains are over it.
    let arms = vec![Arm::TwccPlus, Arm::PcPlus];
    let plan = Plan::calm(VehicleFile::squirrel(), arms, 3, 1);
    Ok(thrust::run(&plan, &Keep::default())?.ok_or("a part of a study")?)
}

fn main() -> Outcome<()> {
    let study = study()?;
    println!("series         ratio  arm        error m  sinks by m  over pc_plus");
    for point in &study.points {
        for row in &point.rows {
            let over = row.gain_over_pc_plus.map(percent).unwrap_or_default();
            let (series, ratio, arm) = (point.series, point.thrust_to_weight, row.arm);
            println!(
                "{series:<13} {ratio:>6.2}  {arm:<9} {:>8.2}  {:>10.2}  {over}",
                row.rmse_m, row.height_lost_m
            );
        }
    }
    println!();
    for words in thrust::words(&study) {
        println!("{words}");
    }
    Ok(())
}

#[test]
fn wings_are_worth_most_where_thrust_is_scarce() -> Outcome<()> {
    let study = study()?;
    let gain = |ratio: f64| {
        let point =
            study.points.iter().find(|p| p.series == "limit" && p.thrust_to_weight == ratio);
        let row = point.and_then(|point| point.rows.iter().find(|row| row.arm == "twcc_plus"));
        row.and_then(|row| row.gain_over_pc_plus).ok_or("the point was not flown")
    };
    let [scarce, plenty] = [gain(1.2)?, gain(3.0)?];
    assert!(scarce.low > 0.0, "twcc_plus over pc_plus at 1.2: {}", percent(scarce));
    assert!(scarce.value > plenty.value, "at 3: {}", percent(plenty));
    assert!(study.headline.iter().any(|(ratio, _)| *ratio == 1.2));
    Ok(())
}
