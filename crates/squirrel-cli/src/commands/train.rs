//! `squirrel train`: from flight logs to the weights of a wing-force model.

use super::vehicle;
use crate::output::{self, Table, say, talk};
use crate::paths::Paths;
use crate::paths::log_files;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde::Serialize;
use squirrel_log::FlightLog;
use squirrel_log::files::FileId;
use squirrel_nn::NnError;
use squirrel_nn::labels;
use squirrel_nn::model::Model;
use squirrel_nn::train::{Epoch, Settings, Trainer};
use squirrel_nn::trained::{ForceError, Trained};
use squirrel_nn::windows::Windows;
use squirrel_report::chart::{Axis, Ink, LineChart, Range, Series};
use squirrel_report::page::{Columns, Figure, Page, Row};
use squirrel_sim::vehicle_file::VehicleFile;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Epochs between checkpoints: a second or so of work.
const CHECKPOINT_EPOCHS: usize = 50;

/// Options of a training.
#[derive(Debug, clap::Args)]
pub(crate) struct Train {
    /// What to train.
    #[arg(value_parser = PossibleValuesParser::new(Model::ALL.map(Model::name)).try_map(|name| name.parse::<Model>()))]
    model: Model,
    /// Flight logs, or folders of them. A flight's name is that of its file.
    #[arg(long, required = true, num_args = 1..)]
    flights: Vec<PathBuf>,
    /// Weights to write (.safetensors).
    #[arg(long)]
    out: PathBuf,
    /// Vehicle that flew, a file or the name of a bundled one; squirrel if left out.
    #[arg(long)]
    vehicle: Option<PathBuf>,
    /// Seed of first weights and order of windows.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Passes over the windows at most.
    #[arg(long, default_value_t = Settings::default().epochs)]
    epochs: usize,
    /// Flights to validate on, by name, separated by commas: the weights of the epoch that is best
    /// on them are kept, and training stops when they get no better.
    #[arg(long, value_delimiter = ',')]
    validation: Vec<String>,
    /// Go on from the checkpoint that a training which was broken off has left beside the weights.
    #[arg(long)]
    resume: bool,
    /// HTML report with the loss curve to write.
    #[arg(long)]
    report: Option<PathBuf>,
    /// Write the figures here as JSON.
    #[arg(long)]
    json: Option<PathBuf>,
}

/// A model on some flights.
#[derive(Debug, Serialize)]
struct Judged {
    set: &'static str,
    flights: Vec<String>,
    windows: usize,
    rmse_to_labels_n: f64,
    axis_rmse_to_labels_n: [f64; 3],
    rmse_to_truth_n: Option<f64>,
    flat_plate_rmse_to_labels_n: f64,
}

#[derive(Serialize)]
struct Outcome<'a> {
    model: Model,
    vehicle: &'a str,
    seed: u64,
    data_hash: &'a str,
    sets: &'a [Judged],
    history: &'a [Epoch],
}

impl Train {
    pub(crate) fn run(&self) -> Result<(), String> {
        let fail = |e: NnError| e.to_string();
        let checkpoint = self.checkpoint();
        self.paths(checkpoint.as_ref())?.check()?;
        if let Some(there) = checkpoint.as_ref().filter(|path| !self.resume && path.exists()) {
            return Err(format!(
                "{}: is there already; --resume goes on from it, or delete it",
                there.display()
            ));
        }
        let vehicle = vehicle(self.vehicle.as_deref())?;
        let windows = self.windows(&vehicle)?;
        let held_out: Vec<&str> = self.validation.iter().map(String::as_str).collect();
        let (training, validation) =
            windows.split(&held_out).map_err(|e| format!("--validation: {e}"))?;
        if training.all().is_empty() {
            return Err(format!(
                "--validation: {}: none is left to train on",
                self.validation.join(",")
            ));
        }
        let settings = Settings { epochs: self.epochs, seed: self.seed, ..Settings::default() };
        let area_m2 = labels::plate_area_m2(&vehicle);
        let new =
            |model| Trainer::new(model, &vehicle.name, area_m2, &training, &validation, settings);
        let mut trainer = if self.resume {
            let nothing = || format!("--resume: {} keeps no checkpoint", self.out.display());
            self.resumed(
                checkpoint.as_ref().ok_or_else(nothing)?,
                settings,
                &training,
                &validation,
            )?
        } else {
            new(self.model).map_err(fail)?
        };
        train(&mut trainer, checkpoint.as_deref())?;

        let plate = new(Model::FlatPlate).map_err(fail)?.best();
        let mut best = trainer.best();
        let mut sets = vec![judge("training", &best, &plate, &training)];
        if !validation.all().is_empty() {
            sets.push(judge("validation", &best, &plate, &validation));
        }
        best.card.figures = figures(&sets);
        best.save(&self.out).map_err(fail)?;
        // What is left of the way is no longer needed. None was there before but what this resumed.
        let _ = checkpoint.map(std::fs::remove_file);

        say(&format!("{} of {}, seed {}\n", self.model.name(), vehicle.name, self.seed));
        let table = table(&sets);
        print(&table);
        if !trainer.history().is_empty() {
            say("");
            print(&curve(trainer.history()));
        }
        talk(&format!("wrote {}", self.out.display()));
        if let Some(path) = &self.report {
            let page = page(&best, trainer.history(), &table);
            output::write_file(path, page.as_bytes())?;
            talk(&format!("wrote {}", path.display()));
        }
        let outcome = Outcome {
            model: self.model,
            vehicle: &vehicle.name,
            seed: self.seed,
            data_hash: &best.card.data_hash,
            sets: &sets,
            history: trainer.history(),
        };
        output::write_json(self.json.as_deref(), &outcome)
    }

    /// The checkpoint beside the weights; none where these go into a device or a pipe.
    fn checkpoint(&self) -> Option<PathBuf> {
        let is_file = FileId::written(&self.out).is_some();
        is_file.then(|| self.out.with_extension("checkpoint.safetensors"))
    }

    /// What is read and what is written.
    fn paths(&self, checkpoint: Option<&PathBuf>) -> Result<Paths, String> {
        let reads = Paths::default()
            .flights("--flights", &self.flights)?
            .vehicle("--vehicle", &self.vehicle);
        let writes = reads.writes("--out", [&self.out]).writes("checkpoint of --out", checkpoint);
        Ok(writes.writes("--report", &self.report).writes("--json", &self.json))
    }

    /// Windows of all flights in the order of their files; a flight whose wings stay folded is left
    /// out and said.
    fn windows(&self, vehicle: &VehicleFile) -> Result<Windows, String> {
        let files = log_files(&self.flights)?;
        let bar = output::progress(files.len() as u64, "flights");
        let (mut windows, mut folded) = (Windows::new(), Vec::new());
        for file in &files {
            let log = FlightLog::read(file).map_err(|e| e.to_string())?;
            match labels::windows(vehicle, &file.display().to_string(), &log) {
                Ok(found) => {
                    let name = file.file_stem().unwrap_or_default().to_string_lossy();
                    windows.push(&name, &found).map_err(|e| format!("--flights: {e}"))?;
                }
                Err(e @ NnError::Folded { .. }) => folded.push(e.to_string()),
                Err(e) => return Err(e.to_string()),
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        if let (true, Some(first)) = (windows.all().is_empty(), folded.first()) {
            return Err(match folded.len() {
                1 => first.clone(),
                flights => format!("{first}; nor from the other flights ({flights} in all)"),
            });
        }
        for problem in folded {
            talk(&format!("left out: {problem}"));
        }
        Ok(windows)
    }

    fn resumed(
        &self,
        checkpoint: &Path,
        settings: Settings,
        training: &Windows,
        validation: &Windows,
    ) -> Result<Trainer, String> {
        let trainer =
            Trainer::resume(checkpoint, training, validation).map_err(|e| e.to_string())?;
        let then = (trainer.best().card.model, *trainer.settings());
        if then != (self.model, settings) {
            let (model, Settings { seed, epochs, .. }) = then;
            return Err(format!(
                "{}: is of {}, seed {seed}, {epochs} epochs; --resume goes on with the same ones only",
                checkpoint.display(),
                model.name()
            ));
        }
        Ok(trainer)
    }
}

/// All epochs that are left, with a checkpoint every now and then.
fn train(trainer: &mut Trainer, checkpoint: Option<&Path>) -> Result<(), String> {
    let fail = |e: NnError| e.to_string();
    let bar = output::progress(trainer.settings().epochs as u64, "epochs");
    bar.set_position(trainer.history().len() as u64);
    while let Some(epoch) = trainer.epoch().map_err(fail)? {
        bar.set_message(format!("{:.4} N", epoch.validation.unwrap_or(epoch.training).sqrt()));
        bar.inc(1);
        if trainer.history().len().is_multiple_of(CHECKPOINT_EPOCHS)
            && !trainer.is_done()
            && let Some(checkpoint) = checkpoint
        {
            trainer.save(checkpoint).map_err(fail)?;
        }
    }
    bar.finish_and_clear();
    Ok(())
}

fn judge(set: &'static str, trained: &Trained, plate: &Trained, windows: &Windows) -> Judged {
    let all = windows.all();
    let labels: Vec<[f32; 3]> = all.iter().map(|w| w.label_body_n).collect();
    let truths: Vec<[f32; 3]> = all.iter().filter_map(|w| w.truth_body_n).collect();
    let forces = trained.forces_body_n(all);
    let to_labels = ForceError::of(&forces, &labels);
    Judged {
        set,
        flights: windows.flights().map(|(name, _)| name.to_owned()).collect(),
        windows: all.len(),
        rmse_to_labels_n: to_labels.rms_n,
        axis_rmse_to_labels_n: to_labels.axis_rms_n,
        // Only a simulator knows it.
        rmse_to_truth_n: (truths.len() == all.len())
            .then(|| ForceError::of(&forces, &truths).rms_n),
        flat_plate_rmse_to_labels_n: ForceError::of(&plate.forces_body_n(all), &labels).rms_n,
    }
}

/// For the card of the weights.
fn figures(sets: &[Judged]) -> BTreeMap<String, f64> {
    let mut figures = BTreeMap::new();
    for judged in sets {
        let set = judged.set;
        figures.insert(format!("{set}_windows"), judged.windows as f64);
        figures.insert(format!("{set}_rmse_to_labels_n"), judged.rmse_to_labels_n);
        if let Some(truth) = judged.rmse_to_truth_n {
            figures.insert(format!("{set}_rmse_to_truth_n"), truth);
        }
    }
    figures
}

/// Rows of text, the first of them the head.
type Rows = Vec<Vec<String>>;

fn table(sets: &[Judged]) -> Rows {
    let head = [
        "set",
        "flights",
        "windows",
        "RMSE to labels N",
        "x",
        "y",
        "z",
        "to truth N",
        "flat plate N",
    ];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for judged in sets {
        let mut row = vec![
            judged.set.to_owned(),
            judged.flights.len().to_string(),
            judged.windows.to_string(),
        ];
        let [x, y, z] = judged.axis_rmse_to_labels_n;
        row.extend([judged.rmse_to_labels_n, x, y, z].map(|n| format!("{n:.4}")));
        row.push(judged.rmse_to_truth_n.map_or_else(|| "-".to_owned(), |n| format!("{n:.4}")));
        row.push(format!("{:.4}", judged.flat_plate_rmse_to_labels_n));
        rows.push(row);
    }
    rows
}

/// The loss at epochs 1, 2, 5, 10, 20, ... and the last.
fn curve(history: &[Epoch]) -> Rows {
    let decades = (0..9).flat_map(|n| [1, 2, 5].map(|digit| digit * 10_usize.pow(n)));
    let shown = decades.take_while(|epoch| *epoch < history.len()).chain([history.len()]);
    let mut rows = vec![["epoch", "training N", "validation N"].map(str::to_owned).to_vec()];
    for number in shown {
        let epoch = history[number - 1];
        let validation =
            epoch.validation.map_or_else(|| "-".to_owned(), |loss| format!("{:.4}", loss.sqrt()));
        rows.push(vec![number.to_string(), format!("{:.4}", epoch.training.sqrt()), validation]);
    }
    rows
}

fn print(rows: &Rows) {
    let Some((head, rows)) = rows.split_first() else { return };
    let mut table = Table::new(&head.iter().map(String::as_str).collect::<Vec<_>>());
    for row in rows {
        table.row(row.clone());
    }
    table.print();
}

fn page(best: &Trained, history: &[Epoch], table: &Rows) -> String {
    let card = &best.card;
    let fact = |name: &str, value: String| (name.to_owned(), value);
    let [slow, fast] = card.domain.speed_m_s;
    let [low, high] = card.domain.alpha_rad.map(f32::to_degrees);
    let mut page = Page::new(&format!("{} of {}", card.model.name(), card.vehicle), "");
    page.facts(&[
        fact("seed", card.seed.to_string()),
        fact("data", card.data_hash.clone()),
        fact("speed", format!("{slow:.1} to {fast:.1} m/s")),
        fact("angle of attack", format!("{low:.0} to {high:.0} deg")),
        fact("version", env!("CARGO_PKG_VERSION").to_owned()),
    ]);
    page.section("Errors of the force", "Root mean square over the windows of a set, N.");
    if let Some((head, rows)) = table.split_first() {
        let rows: Vec<Row> =
            rows.iter().map(|cells| Row { ink: None, cells: cells.clone() }).collect();
        page.table(head, &rows);
    }
    page.section("Loss", "");
    if history.is_empty() {
        page.missing("This model has no network: there was nothing to descend.");
        return page.html();
    }
    let y = Axis::new("RMSE", "N").with_range(Range::Including(0.0, 0.0));
    let mut chart = LineChart::new("error over epochs", Axis::new("epoch", ""), y);
    chart.width = Columns::One.width();
    let epochs: Vec<f64> = (1..=history.len()).map(|epoch| epoch as f64).collect();
    let training = history.iter().map(|epoch| epoch.training.sqrt()).collect();
    chart.series.push(Series::line("training", Ink::Series(0), epochs.clone(), training));
    if history.iter().any(|epoch| epoch.validation.is_some()) {
        let validation =
            history.iter().map(|epoch| epoch.validation.map_or(f64::NAN, f64::sqrt)).collect();
        chart.series.push(Series::line("validation", Ink::Series(1), epochs, validation));
    }
    let caption =
        "Training is the mean over an epoch while the weights moved, validation is after it."
            .to_owned();
    let figure = Figure {
        title: "Over epochs".to_owned(),
        caption,
        drawings: vec![chart.svg()],
        notes: Vec::new(),
    };
    page.figures(Columns::One, &[figure]);
    page.html()
}
