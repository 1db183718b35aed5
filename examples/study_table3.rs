//! Lesson 7, `squirrel study table3`: the paper's real flights.
//!
//! The paper flew three trials an arm, measured errors by satellite fix and barometer, and found a
//! gain of 13.1 %; it does not say how much thrust there was. So the study flies several ratios and
//! gives both errors, the true one and the one that such a log has. Look for the ratio at which
//! `pc` sinks and the gain is the paper's. Three trials are too few: an interval that is resampled
//! from three pairs holds no more than those three saw.
//!
//! ```sh
//! cargo run --release -p squirrel-examples --example study_table3
//! squirrel study table3        # the whole of it
//! ```
#![allow(clippy::print_stdout, reason = "a lesson is told")]

use squirrel_examples::{Outcome, percent};
use squirrel_sim::arm::Arm;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::journal::Keep;
use squirrel_study::table3::{self, Table3};
use squirrel_study::thrust::PAPER_GAIN;
use squirrel_study::tracking::Row;

fn study() -> Outcome<Table3> {
    let arms = vec![Arm::TwccFlat, Arm::TwccParnn];
    let plan = Plan::calm(VehicleFile::squirrel(), arms, 3, 1);
    Ok(table3::run(&plan, &Keep::default())?.ok_or("a part of a study")?)
}

fn main() -> Outcome<()> {
    println!("the paper's gain: {:.1} %\n", 100.0 * PAPER_GAIN);
    println!("ratio  arm         error m  measured m  sinks by m  gain, measured");
    for point in study()?.points {
        for row in point.rows {
            let Row { arm, rmse_m, rmse_measured_m, height_lost_m, gain_measured, .. } = row;
            let (ratio, gain) = (point.thrust_to_weight, percent(gain_measured));
            println!(
                "{ratio:>5.2}  {arm:<10} {rmse_m:>8.2}  {rmse_measured_m:>10.2}  {height_lost_m:>10.2}  {gain}"
            );
        }
    }
    Ok(())
}

#[test]
fn the_papers_gain_and_its_sinking_drone_are_those_of_scarce_thrust() -> Outcome<()> {
    let study = study()?;
    let row = |ratio: f64, arm: &str| {
        let point = study.points.iter().find(|point| point.thrust_to_weight == ratio);
        point
            .and_then(|point| point.rows.iter().find(|row| row.arm == arm))
            .ok_or("the arm did not fly")
    };
    let gain = |ratio| row(ratio, "twcc_flat").map(|row| row.gain.value);
    assert!(
        gain(1.2)? > PAPER_GAIN && PAPER_GAIN > gain(1.3)?,
        "{} and {}",
        gain(1.2)?,
        gain(1.3)?
    );
    assert!(row(1.2, "pc")?.height_lost_m > 2.0 && row(2.0, "pc")?.height_lost_m < 1.0);
    // A log errs, but not by what is to be shown.
    let pc = row(1.2, "pc")?;
    assert!((pc.rmse_measured_m / pc.rmse_m - 1.0).abs() < 0.1, "{pc:?}");
    Ok(())
}
