//! Lesson 10, `squirrel study filters`: how far is the attitude off that a flight code believes in,
//! and what does that cost?
//!
//! Every filter hears the same agile flights in gusts, with a gyro that was calibrated and with one
//! whose bias of half a degree a second nobody took off. Then the avoidance manoeuvre is flown on
//! estimates beside the same flight on the truth. Look at the paper's filter (`rkf_mtf`) with the
//! two gyros, and at how little of the difference is left in the loop.
//!
//! ```sh
//! cargo run --release -p squirrel-examples --example study_filters
//! squirrel study filters       # the whole of it
//! ```
#![allow(clippy::print_stdout, reason = "a lesson is told")]

use squirrel_examples::Outcome;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::filters::{self, Filters};
use squirrel_study::journal::Keep;

fn study() -> Outcome<Filters> {
    let plan = Plan::calm(VehicleFile::squirrel(), Vec::new(), 3, 1);
    Ok(filters::run(&plan, &Keep::default())?.ok_or("a part of a study")?)
}

/// Inclination's error of a filter, RMS, deg.
fn error_deg(study: &Filters, filter: &str, calibrated: bool) -> Option<f64> {
    let row = study.rows.iter().find(|row| row.filter == filter && row.calibrated == calibrated);
    row.map(|row| row.inclination_rms_deg.value)
}

fn main() -> Outcome<()> {
    let study = study()?;
    println!("inclination's error, RMS of {} flights, deg", study.trials);
    println!("filter    calibrated  gyro off by {:?} deg/s", study.bias_deg_s);
    for row in study.rows.iter().filter(|row| row.calibrated) {
        let [good, off] = [true, false].map(|calibrated| error_deg(&study, row.filter, calibrated));
        println!(
            "{:<8} {:>11.2}  {:>11.2}",
            row.filter,
            good.unwrap_or(f64::NAN),
            off.unwrap_or(f64::NAN)
        );
    }
    println!("\nsensors   error on estimates m  on the truth m  ratio");
    for row in &study.in_loop {
        println!(
            "{:<9} {:>20.2}  {:>14.2}  {:>5.3}",
            row.suite, row.rmse_m, row.oracle_rmse_m, row.ratio.value
        );
    }
    Ok(())
}

#[test]
fn the_papers_filter_needs_a_calibrated_gyro_and_the_default_does_not() -> Outcome<()> {
    let study = study()?;
    let error_deg =
        |filter, calibrated| error_deg(&study, filter, calibrated).ok_or("no such filter");
    let (paper, paper_off) = (error_deg("rkf_mtf", true)?, error_deg("rkf_mtf", false)?);
    let (ours, ours_off) = (error_deg("eskf", true)?, error_deg("eskf", false)?);
    assert!(paper < 1.5 && paper_off > 3.0 * paper, "{paper} deg, {paper_off} deg");
    assert!(ours < paper && ours_off < 1.5 * ours, "{ours} deg, {ours_off} deg");
    for row in &study.in_loop {
        assert!(row.lost == 0 && row.ratio.value < 1.3, "{row:?}");
    }
    Ok(())
}
