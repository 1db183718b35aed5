//! Lesson 9, `squirrel study table2`: how well do models of the wing force predict flights that
//! they have not seen?
//!
//! Models learn from the specific force in random flights with spread wings and are judged on four
//! other sets: faster and in wind (t1), as in training (t2), in wind (t3), slowly (t4). Errors are
//! to the true force, which only a simulator knows, and to the labels, which is all that a flight
//! has. Five passes of one trial show who learns fast: look at the models that correct the flat
//! plate (`parnn`, `scaled_flat_plate`) beside those that learn a force from nothing. What 800
//! passes make of them is in docs/guide/learn.md.
//!
//! ```sh
//! cargo run --release -p squirrel-examples --example study_table2
//! squirrel study table2        # the whole of it
//! ```
#![allow(clippy::print_stdout, reason = "a lesson is told")]

use squirrel_examples::Outcome;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::journal::Keep;
use squirrel_study::table2::{self, Row, Table2};

/// Of flights learned from, s.
const TRAINING_S: u32 = 300;

fn study() -> Outcome<Table2> {
    let plan = Plan::calm(VehicleFile::squirrel(), Vec::new(), 1, 1);
    Ok(table2::run(&plan, 5, &Keep::default())?.ok_or("a part of a study")?)
}

/// Errors to the truth, N, of a model on the sets, training first.
fn errors_n(study: &Table2, model: &str) -> Vec<f64> {
    let is = |row: &&Row| row.training_s == TRAINING_S && row.model.name() == model;
    study.rows.iter().filter(is).map(|row| row.to_truth.rmse_n.mean).collect()
}

fn columns(numbers: impl IntoIterator<Item = f64>) -> String {
    numbers.into_iter().map(|number| format!("{number:>10.3}")).collect::<Vec<String>>().concat()
}

fn main() -> Outcome<()> {
    let study = study()?;
    println!(
        "error to the true force after {TRAINING_S} s of flights and {} passes, N",
        study.epochs
    );
    let sets: Vec<String> = study.sets.iter().map(|set| format!("{:>10}", set.set)).collect();
    println!("{:<18}{}", "model", sets.concat());
    let models = study.rows.iter().filter(|row| row.training_s == TRAINING_S && row.set == "t1");
    for model in models.map(|row| row.model.name()) {
        println!("{model:<18}{}", columns(errors_n(&study, model)));
    }
    let forces_n = study.sets.iter().map(|set| set.force_rms_n.mean);
    println!("{:<18}{}", "the force itself", columns(forces_n));
    Ok(())
}

#[test]
fn who_corrects_the_plate_learns_faster_than_who_starts_from_nothing() -> Outcome<()> {
    let study = study()?;
    let parnn = errors_n(&study, "parnn");
    assert_eq!(parnn.len(), study.sets.len());
    for model in ["vanilla", "vanilla_body", "vanilla_plane"] {
        for ((set, parnn), other) in study.sets.iter().zip(&parnn).zip(errors_n(&study, model)) {
            assert!(*parnn < other, "{}: {parnn} N, {model} {other} N", set.set);
        }
    }
    Ok(())
}
