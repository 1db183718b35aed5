//! Models of the wing force as the command line shows them.

use super::report::{self, head};
use super::{ERRORS, Error, Row, Spread, Table2, render, run, scenarios};
use crate::campaign::Plan;
use crate::journal::Keep;
use crate::study::{Choice, Found, Shown, Study};
use crate::wing_flights::Kind;
use squirrel_nn::model::Model;
use squirrel_nn::train::EPOCHS;
use squirrel_sim::flight::FlightError;
use squirrel_sim::scenario::Scenario;
use std::fmt::Write as _;

/// On the command line.
pub const STUDY: Study = Study {
    options: &[Choice {
        name: "epochs",
        help: "Passes over the training windows",
        default: EPOCHS as f64,
        whole: true,
    }],
    unit: "flights and trainings",
    others: |_| Kind::ALL.map(|kind| format!("{}.toml", kind.name())).to_vec(),
    ..Study::new(
        "table2",
        "What models of the wing force predict, the paper's Table II: to labels and to truth, 30 to 300 s of training",
        (5, "Trials, each with its own flights and first weights"),
        fly,
    )
};

fn fly(plan: &Plan, options: &[f64], keep: &Keep<'_>) -> Result<Option<Found>, FlightError> {
    let epochs = options[0] as usize;
    let Some(study) = run(plan, epochs, keep)? else { return Ok(None) };
    let mut found = Found::of(&study)?;
    show(&mut found, &study);
    found.csv = csv(&study);
    let named = |s: Scenario| (format!("{}.toml", s.name), s.to_toml());
    found.others = scenarios(plan)?.into_iter().map(named).collect();
    found.page = Some(render(&study));
    Ok(Some(found))
}

fn show(found: &mut Found, study: &Table2) {
    found.say(format!(
        "Models of the wing force of {}, {} trials from seed {}, {} epochs; mean and standard deviation over the trials.\n",
        study.vehicle, study.trials, study.seed, study.epochs
    ));
    found.shown.push(Shown::Table(sets(study)));
    let lengths: Vec<u32> =
        study.rows.chunk_by(|a, b| a.training_s == b.training_s).map(length).collect();
    for rows in study.rows.chunk_by(|a, b| a.training_s == b.training_s && a.set == b.set) {
        found.say(format!(
            "\n{} s of training, {}: RMSE in N, over paRNN in %",
            length(rows),
            rows[0].set
        ));
        let columns = ["to labels", "x", "y", "z", "over", "to truth", "x", "y", "z", "over"];
        let mut table = vec![head(&[&["model"][..], &columns].concat())];
        for row in rows {
            let mut cells = vec![row.model.name().to_owned()];
            for error in [&row.to_labels, &row.to_truth] {
                cells.push(newtons(error.rmse_n));
                cells.extend(error.axis_rmse_n.map(newtons));
                cells.push(over(error));
            }
            table.push(cells);
        }
        found.shown.push(Shown::Table(table));
    }
    for (words, error) in ERRORS {
        found.say(format!("\nRMSE {words} over that of paRNN, minus 1, in %"));
        let names: Vec<&str> = study.sets.iter().map(|set| set.set).collect();
        let mut table = vec![head(&[&["training s", "model"][..], &names].concat())];
        for training_s in &lengths {
            for model in Model::ALL.into_iter().skip(1) {
                let mut cells = vec![training_s.to_string(), model.name().to_owned()];
                let of_model = |row: &&Row| row.training_s == *training_s && row.model == model;
                cells.extend(study.rows.iter().filter(of_model).map(|row| over(error(row))));
                table.push(cells);
            }
        }
        found.shown.push(Shown::Table(table));
    }
}

fn sets(study: &Table2) -> Vec<Vec<String>> {
    let mut table = vec![head(&[
        "set",
        "flown",
        "flights",
        "from m/s",
        "to m/s",
        "force N",
        "label noise N",
        "|alpha_est| > |alpha| %",
        "beyond 10 deg %",
        "median gamma",
    ])];
    for set in &study.sets {
        // The last of a set is that of the longest training.
        let word = study.words.iter().rfind(|word| word.set == set.set);
        let [slow, fast] = set.speed_m_s.map(|v| format!("{v:.1}"));
        table.push(vec![
            set.set.to_owned(),
            set.about.to_owned(),
            set.flights.to_string(),
            slow,
            fast,
            newtons(set.force_rms_n),
            newtons(set.label_noise_n),
            word.map(|w| plus_minus(w.alpha_larger_share, 100.0, 1)).unwrap_or_default(),
            word.map(|w| plus_minus(w.alpha_larger_share_beyond_10_deg, 100.0, 1))
                .unwrap_or_default(),
            word.map(|w| plus_minus(w.gamma_median, 1.0, 2)).unwrap_or_default(),
        ]);
    }
    table
}

fn length(rows: &[Row]) -> u32 {
    rows.first().map_or(0, |row| row.training_s)
}

fn plus_minus(x: Spread, scale: f64, digits: usize) -> String {
    report::plus_minus(x, scale, digits).replace(' ', "")
}

fn newtons(x: Spread) -> String {
    plus_minus(x, 1.0, 3)
}

fn over(error: &Error) -> String {
    let text = plus_minus(error.over_parnn, 100.0, 1);
    if text.starts_with('-') { text } else { format!("+{text}") }
}

/// A line a model, set and length of training; an absent deviation is an empty cell.
fn csv(study: &Table2) -> String {
    let mut csv = String::from("training_s,set,model");
    for to in ["to_labels", "to_truth"] {
        for figure in ["rmse", "x_rmse", "y_rmse", "z_rmse"] {
            let _ = write!(csv, ",{figure}_{to}_n,{figure}_{to}_sd_n");
        }
        let _ = write!(csv, ",{to}_over_parnn,{to}_over_parnn_sd");
    }
    csv.push('\n');
    for row in &study.rows {
        let _ = write!(csv, "{},{},{}", row.training_s, row.set, row.model.name());
        for error in [&row.to_labels, &row.to_truth] {
            let [x, y, z] = error.axis_rmse_n;
            for Spread { mean, sd } in [error.rmse_n, x, y, z, error.over_parnn] {
                let _ = write!(csv, ",{mean},{}", sd.map_or_else(String::new, |sd| sd.to_string()));
            }
        }
        csv.push('\n');
    }
    csv
}
