//! Lesson 8, `squirrel study forest`: 400 m through trunks at 7 m/s.
//!
//! In the paper's forest 19 of 21 flights came through, and 4 and 2 of 21 with its rivals. Here
//! trunks are solid, and a flight counts only where it keeps its height too. An arm owes its
//! success to wings where it comes through more often than the same decisions without: than
//! `phantom`, and `twcc_plus` than `pc_plus`. Look at who comes through: the better law does, with
//! wings or without.
//!
//! ```sh
//! cargo run --release -p squirrel-examples --example study_forest
//! squirrel study forest        # the whole of it; examples/python/a_study_on_many_machines.py flies it in parts
//! ```
#![allow(clippy::print_stdout, reason = "a lesson is told")]

use squirrel_examples::Outcome;
use squirrel_sim::arm::Arm;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::forest::{self, Forest};
use squirrel_study::journal::Keep;

/// Thrust to spare, as the study has it unless told otherwise.
const THRUST_TO_WEIGHT: f64 = 2.0;

fn study() -> Outcome<Forest> {
    // `phantom` flies in any case.
    let arms = vec![Arm::Pc, Arm::TwccFlat, Arm::PcPlus, Arm::TwccPlus];
    let plan = Plan::calm(VehicleFile::squirrel(), arms, 12, 1);
    Ok(forest::run(&plan, THRUST_TO_WEIGHT, &Keep::default())?.ok_or("a part of a study")?)
}

fn main() -> Outcome<()> {
    let study = study()?;
    println!(
        "of {} flights      through  at its height  95 % interval  path m  trunks met",
        study.trials
    );
    for row in &study.rows {
        let (arm, through, in_band) = (row.arm, row.through.count, row.in_band);
        let [low, high] = [in_band.share.low, in_band.share.high].map(|share| 100.0 * share);
        println!(
            "{arm:<18} {through:>7}  {:>13}  {low:>4.0} to {high:>3.0} %  {:>6.0}  {:>10.1}",
            in_band.count, row.path_m, row.encounters
        );
    }
    println!();
    for words in forest::words(&study) {
        println!("{words}");
    }
    Ok(())
}

#[test]
fn the_best_law_comes_further_than_the_papers_rival() -> Outcome<()> {
    let study = study()?;
    let row = |arm: &str| study.rows.iter().find(|row| row.arm == arm).ok_or("the arm did not fly");
    let [pc, plus] = [row("pc")?, row("twcc_plus")?];
    assert!(plus.in_band.count > pc.in_band.count, "{:?}, {:?}", plus.in_band, pc.in_band);
    assert!(plus.path_m > pc.path_m, "{} m, {} m", plus.path_m, pc.path_m);
    // An interval says what so few flights can tell.
    assert!(plus.in_band.share.high - plus.in_band.share.low > 0.2);
    Ok(())
}
