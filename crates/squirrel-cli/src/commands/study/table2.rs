//! `squirrel study table2`: models of the wing force on flights that they have not seen.

use super::{Common, write_page};
use crate::output::{self, Table, say};
use squirrel_nn::model::Model;
use squirrel_nn::train::Settings;
use squirrel_study::table2::{self, ERRORS, Error, Plan, Row, Spread, Table2};
use squirrel_study::wing_flights::Kind;
use std::fmt::Write as _;

/// Options of the study.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Trials, each with its own flights and first weights.
    #[arg(long, default_value_t = 5)]
    trials: u32,
    /// Passes over the training windows.
    #[arg(long, default_value_t = Settings::default().epochs)]
    epochs: usize,
    #[command(flatten)]
    pub(super) common: Common,
}

impl Options {
    pub(super) fn run(&self) -> Result<(), String> {
        let (trials, seed) = (self.trials, self.common.seed);
        let others = Kind::ALL.map(|kind| format!("{}.toml", kind.name()));
        let plan =
            Plan { vehicle: self.common.begin("table2", trials, others)?, trials, seed, epochs: self.epochs };
        let own = [("trials", trials.to_string()), ("epochs", self.epochs.to_string())];
        let command = self.common.command("table2", &own);
        let keep = self.common.keep(&command);
        let bar = output::progress(table2::steps(&plan, &keep), "flights and trainings");
        let study = table2::run(&plan, &keep, |steps| bar.inc(steps));
        let Some(study) = self.common.ended(&bar, study)? else { return Ok(()) };

        show(&study);
        let Some(folder) = self.common.end("table2", &csv(&study), &study)? else { return Ok(()) };
        for scenario in table2::scenarios(&plan).map_err(|e| e.to_string())? {
            let file = folder.join(format!("{}.toml", scenario.name));
            output::write_file(&file, scenario.to_toml().as_bytes())?;
        }
        write_page(folder, "table2", &table2::render(&study))
    }
}

fn show(study: &Table2) {
    say(&format!(
        "Models of the wing force of {}, {} trials from seed {}, {} epochs; mean and standard deviation over the trials.\n",
        study.vehicle, study.trials, study.seed, study.epochs
    ));
    sets(study);
    let lengths: Vec<u32> = study.rows.chunk_by(|a, b| a.training_s == b.training_s).map(length).collect();
    for rows in study.rows.chunk_by(|a, b| a.training_s == b.training_s && a.set == b.set) {
        say(&format!("\n{} s of training, {}: RMSE in N, over paRNN in %", length(rows), rows[0].set));
        let columns = ["to labels", "x", "y", "z", "over", "to truth", "x", "y", "z", "over"];
        let mut table = Table::new(&[&["model"][..], &columns].concat());
        for row in rows {
            let mut cells = vec![row.model.name().to_owned()];
            for error in [&row.to_labels, &row.to_truth] {
                cells.push(newtons(error.rmse_n));
                cells.extend(error.axis_rmse_n.map(newtons));
                cells.push(over(error));
            }
            table.row(cells);
        }
        table.print();
    }
    for (words, error) in ERRORS {
        say(&format!("\nRMSE {words} over that of paRNN, minus 1, in %"));
        let names: Vec<&str> = study.sets.iter().map(|set| set.set).collect();
        let mut table = Table::new(&[&["training s", "model"][..], &names].concat());
        for training_s in &lengths {
            for model in Model::ALL.into_iter().skip(1) {
                let mut cells = vec![training_s.to_string(), model.name().to_owned()];
                let of_model = |row: &&Row| row.training_s == *training_s && row.model == model;
                cells.extend(study.rows.iter().filter(of_model).map(|row| over(error(row))));
                table.row(cells);
            }
        }
        table.print();
    }
}

fn sets(study: &Table2) {
    let mut table = Table::new(&[
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
    ]);
    for set in &study.sets {
        // The last of a set is that of the longest training.
        let word = study.words.iter().rfind(|word| word.set == set.set);
        let [slow, fast] = set.speed_m_s.map(|v| format!("{v:.1}"));
        table.row(vec![
            set.set.to_owned(),
            set.about.to_owned(),
            set.flights.to_string(),
            slow,
            fast,
            newtons(set.force_rms_n),
            newtons(set.label_noise_n),
            word.map(|w| plus_minus(w.alpha_larger_share, 100.0, 1)).unwrap_or_default(),
            word.map(|w| plus_minus(w.alpha_larger_share_beyond_10_deg, 100.0, 1)).unwrap_or_default(),
            word.map(|w| plus_minus(w.gamma_median, 1.0, 2)).unwrap_or_default(),
        ]);
    }
    table.print();
}

fn length(rows: &[Row]) -> u32 {
    rows.first().map_or(0, |row| row.training_s)
}

fn plus_minus(x: Spread, scale: f64, digits: usize) -> String {
    let mean = format!("{:.digits$}", scale * x.mean);
    x.sd.map_or_else(|| mean.clone(), |sd| format!("{mean}\u{b1}{:.digits$}", scale * sd))
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
