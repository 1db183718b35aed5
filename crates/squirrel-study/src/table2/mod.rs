//! Table II of the paper, with what it leaves out: how well models of the wing force predict
//! flights that they have not seen.
//!
//! In each trial every model learns from the same random flights, of 30, 120 and 300 s, the shorter
//! ones a part of the longer, and is judged on its own training flights and on four sets of others
//! ([`Kind`]). Errors are to the labels, which is all that a flight has, and to the true force,
//! which only a simulator has. There is no validation set: the paper has none, so all epochs are
//! trained and the last weights count.

mod report;
mod table;

pub use report::render;
pub use table::STUDY;

use crate::campaign::Plan;
use crate::journal::{Journal, Keep, check_trials, identity};
use crate::statistics::mean;
use crate::wing_flights::{FLIGHT_S, Kind, WingFlightError};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use squirrel_core::frames::In;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::rnn::parnn::{SPEED_SCALE_M_S, WINDOW};
use squirrel_nn::model::Model;
use squirrel_nn::train::{Settings, Trainer};
use squirrel_nn::trained::{ForceError, Trained};
use squirrel_nn::windows::{Window, Windows};
use squirrel_nn::{NnError, labels};
use squirrel_sim::flight::FlightError;
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;
use std::sync::atomic::{AtomicU64, Ordering};

/// Flights to learn from: 30, 120 and 300 s.
const TRAINING_FLIGHTS: [u32; 3] = [1, 4, 10];
/// Flights of each test set.
const TEST_FLIGHTS: u32 = 4;
/// Slower than this, m/s, angles of attack are not compared.
const ALPHA_FROM_M_S: f32 = 3.0;
/// 10 deg.
const LARGE_ALPHA_RAD: f32 = 0.174_532_93;

/// A figure over the trials.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Standard deviation of a single trial; absent where there is but one.
    pub sd: Option<f64>,
}

/// Root mean square of force errors.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Error {
    /// Of the length of the difference, N.
    pub rmse_n: Spread,
    /// Of each body axis, N.
    pub axis_rmse_n: [Spread; 3],
    /// `rmse_n` over that of paRNN in the same trial, minus 1.
    pub over_parnn: Spread,
}

/// A model after some training on one set.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Row {
    /// Length of the flights learned from, s.
    pub training_s: u32,
    /// [`Kind::name`].
    pub set: &'static str,
    /// The model.
    pub model: Model,
    /// To the force by the flight log.
    pub to_labels: Error,
    /// To the force that the simulator knows.
    pub to_truth: Error,
}

/// An error of a row.
pub type ErrorOf = fn(&Row) -> &Error;
/// The errors of a row with their words in tables.
pub const ERRORS: [(&str, ErrorOf); 2] =
    [("to labels", |row| &row.to_labels), ("to truth", |row| &row.to_truth)];

/// What the flights of a set are like.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Set {
    /// [`Kind::name`].
    pub set: &'static str,
    /// What is different from training.
    pub about: &'static str,
    /// Flights of each trial.
    pub flights: u32,
    /// Lowest and highest ground speed of all trials, m/s.
    pub speed_m_s: [f64; 2],
    /// The true force, root mean square, N.
    pub force_rms_n: Spread,
    /// Labels against truth, root mean square, N: what the true force would have on labels. In wind
    /// it holds the drag of the airframe, which a log without airspeed cannot tell from the wings'.
    pub label_noise_n: Spread,
}

/// What paRNN says about the flow, over windows faster than 3 m/s.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Word {
    /// Length of the flights learned from, s.
    pub training_s: u32,
    /// [`Kind::name`].
    pub set: &'static str,
    /// Share of them in which the angle of attack that the wing seems to have is larger than the
    /// one it has.
    pub alpha_larger_share: Spread,
    /// The same where it is beyond 10 deg: below, the wing may still be bulged by the flow of a
    /// moment before.
    pub alpha_larger_share_beyond_10_deg: Spread,
    /// Median of how much stronger the flow seems to act.
    pub gamma_median: Spread,
}

/// The study's result.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Table2 {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Trials.
    pub trials: u32,
    /// Seed.
    pub seed: u64,
    /// Passes over the windows.
    pub epochs: usize,
    /// Training first, then the tests.
    pub sets: Vec<Set>,
    /// By length of training, set, model.
    pub rows: Vec<Row>,
    /// By length of training, set.
    pub words: Vec<Word>,
}

/// The flights of one trial.
struct Flights {
    /// [`TRAINING_FLIGHTS`]' last number of them.
    training: Vec<Vec<Window>>,
    /// In the order of [`Kind::TESTS`].
    tests: Vec<Vec<Window>>,
}

/// What became of one trial.
#[derive(Serialize, Deserialize)]
struct Trial {
    /// By length of training, model.
    judged: Vec<Judged>,
    /// In the order of [`Kind::ALL`].
    sets: Vec<Flown>,
}

/// A trained model on the sets, in the order of [`Kind::ALL`].
#[derive(Serialize, Deserialize)]
struct Judged {
    to_labels: Vec<ForceError>,
    to_truth: Vec<ForceError>,
    /// Shares and median of [`Word`]; empty where the model is not paRNN.
    words: Vec<[f64; 3]>,
}

/// What the flights of a set were like.
#[derive(Serialize, Deserialize)]
struct Flown {
    speed_m_s: [f64; 2],
    force_rms_n: f64,
    label_noise_n: f64,
}

/// Flights and trainings.
fn steps_of_a_trial() -> usize {
    let flights = TRAINING_FLIGHTS[2] as usize + TEST_FLIGHTS as usize * Kind::TESTS.len();
    flights + TRAINING_FLIGHTS.len() * Model::ALL.len()
}

/// Flies and trains on all cores; the result depends neither on how many there are nor on how often
/// the study was stopped. `None` where only a part of it is done here.
///
/// * `plan` - whose arms do not matter
/// * `epochs` - passes over the windows; 800 in the paper
/// * `keep` - keeps the trials
///
/// # Errors
/// A vehicle that cannot fly or has no wings, no trials, no epochs, or a folder that cannot be
/// written.
pub fn run(plan: &Plan, epochs: usize, keep: &Keep<'_>) -> Result<Option<Table2>, FlightError> {
    check_trials(plan.trials)?;
    let identity = identity("table2", &plan.vehicle, plan.seed);
    // A trial is many steps, which are told of one by one.
    let silent = Keep { progress: None, ..*keep };
    let journal = Journal::open(&silent, "table2", &format!("{identity}, {epochs} epochs"))?;
    let (steps, counted) = (keep.mine(plan.trials).len() * steps_of_a_trial(), AtomicU64::new(0));
    keep.ahead(steps);
    let one = |trial: u32| {
        let count = || {
            counted.fetch_add(1, Ordering::Relaxed);
            keep.done(1);
        };
        self::trial(plan, epochs, trial, &count).map_err(|e| FlightError(e.to_string()))
    };
    // What a trial that was kept would have counted is counted in the end.
    let Some(trials) = journal.run(plan.trials, one)? else { return Ok(None) };
    keep.done((steps as u64).saturating_sub(counted.into_inner()));

    let (mut rows, mut words) = (Vec::new(), Vec::new());
    let models = Model::ALL.len();
    for (length, flights) in TRAINING_FLIGHTS.into_iter().enumerate() {
        let training_s = flights * FLIGHT_S;
        let of =
            |model: usize| trials.iter().map(move |trial| &trial.judged[length * models + model]);
        for (set, kind) in Kind::ALL.iter().enumerate() {
            for (m, model) in Model::ALL.into_iter().enumerate() {
                let error = |errors: fn(&Judged) -> &[ForceError]| {
                    let all: Vec<ForceError> = of(m).map(|j| errors(j)[set]).collect();
                    let parnn: Vec<f64> = of(0).map(|j| errors(j)[set].rms_n).collect();
                    summary(&all, &parnn)
                };
                let (to_labels, to_truth) = (error(|j| &j.to_labels), error(|j| &j.to_truth));
                rows.push(Row { training_s, set: kind.name(), model, to_labels, to_truth });
            }
            let word = |n: usize| spread(&of(0).map(|j| j.words[set][n]).collect::<Vec<f64>>());
            words.push(Word {
                training_s,
                set: kind.name(),
                alpha_larger_share: word(0),
                alpha_larger_share_beyond_10_deg: word(1),
                gamma_median: word(2),
            });
        }
    }
    Ok(Some(Table2 {
        vehicle: plan.vehicle.name.clone(),
        trials: plan.trials,
        seed: plan.seed,
        epochs,
        sets: Kind::ALL
            .into_iter()
            .enumerate()
            .map(|(i, kind)| describe(kind, i, &trials))
            .collect(),
        rows,
        words,
    }))
}

/// Mean and standard deviation.
fn spread(x: &[f64]) -> Spread {
    let centre = mean(x);
    let squares: f64 = x.iter().map(|x| (x - centre).powi(2)).sum();
    Spread { mean: centre, sd: (x.len() > 1).then(|| (squares / (x.len() - 1) as f64).sqrt()) }
}

fn summary(errors: &[ForceError], parnn: &[f64]) -> Error {
    let over: Vec<f64> = errors.iter().zip(parnn).map(|(e, parnn)| e.rms_n / parnn - 1.0).collect();
    let of = |figure: &dyn Fn(&ForceError) -> f64| {
        spread(&errors.iter().map(figure).collect::<Vec<f64>>())
    };
    Error {
        rmse_n: of(&|e| e.rms_n),
        axis_rmse_n: [0, 1, 2].map(|axis| of(&|e| e.axis_rms_n[axis])),
        over_parnn: spread(&over),
    }
}

/// The scenario of the first flight of each kind, to fly it or its kin by hand; with another seed
/// the wind keeps its direction.
///
/// # Errors
/// As [`Kind::scenario`].
pub fn scenarios(plan: &Plan) -> Result<Vec<Scenario>, FlightError> {
    let named = |kind: Kind| {
        let scenario = kind.scenario(first_seed(plan, 0, kind))?;
        Ok(Scenario { name: kind.name().to_owned(), ..scenario })
    };
    Kind::ALL.into_iter().map(named).collect()
}

/// Of the flights of a kind in a trial, which count up from it: a hundred a kind, a thousand a
/// trial.
fn first_seed(plan: &Plan, trial: u32, kind: Kind) -> u64 {
    let place = Kind::ALL.iter().position(|other| *other == kind).unwrap_or_default() as u64;
    plan.trial_seed(trial).wrapping_mul(1000).wrapping_add(100 * place)
}

/// Flies one trial, and trains and judges every model on it.
fn trial(
    plan: &Plan,
    epochs: usize,
    number: u32,
    progress: &(impl Fn() + Sync),
) -> Result<Trial, WingFlightError> {
    let flights = fly(plan, number, progress)?;
    let seed = plan.trial_seed(number);
    let tasks: Vec<(u32, Model)> = TRAINING_FLIGHTS
        .into_iter()
        .flat_map(|flights| Model::ALL.map(|model| (flights, model)))
        .collect();
    let judged = tasks
        .par_iter()
        .map(|(number, model)| {
            let judged = train(
                &plan.vehicle,
                *model,
                &flights,
                *number as usize,
                Settings { epochs, seed, ..Settings::default() },
            );
            progress();
            judged
        })
        .collect::<Result<_, _>>()?;
    let training = flights.training.concat();
    let sets = std::iter::once(&training).chain(&flights.tests);
    Ok(Trial { judged, sets: sets.map(|windows| flown(windows)).collect() })
}

/// All flights of a trial.
fn fly(plan: &Plan, trial: u32, progress: &(impl Fn() + Sync)) -> Result<Flights, WingFlightError> {
    let mut tasks = Vec::new();
    for kind in Kind::ALL {
        let flights = if kind == Kind::Training { TRAINING_FLIGHTS[2] } else { TEST_FLIGHTS };
        let first = first_seed(plan, trial, kind);
        tasks.extend((0..u64::from(flights)).map(|flight| (kind, first.wrapping_add(flight))));
    }
    let flown: Vec<Vec<Window>> = tasks
        .par_iter()
        .map(|(kind, seed)| {
            let windows = kind.fly(&plan.vehicle, *seed);
            progress();
            windows
        })
        .collect::<Result<_, _>>()?;
    let mut flown = flown.into_iter();
    let mut take = |flights: u32| flown.by_ref().take(flights as usize).collect::<Vec<_>>();
    Ok(Flights {
        training: take(TRAINING_FLIGHTS[2]),
        tests: Kind::TESTS.iter().map(|_| take(TEST_FLIGHTS).concat()).collect(),
    })
}

fn train(
    vehicle: &VehicleFile,
    model: Model,
    trial: &Flights,
    flights: usize,
    settings: Settings,
) -> Result<Judged, NnError> {
    let mut training = Windows::new();
    for (flight, windows) in trial.training[..flights].iter().enumerate() {
        training.push(&format!("training {flight}"), windows)?;
    }
    let area_m2 = labels::plate_area_m2(vehicle);
    let mut trainer =
        Trainer::new(model, &vehicle.name, area_m2, &training, &Windows::new(), settings)?;
    while trainer.epoch()?.is_some() {}
    let trained = trainer.best();

    let sets = std::iter::once(training.all()).chain(trial.tests.iter().map(Vec::as_slice));
    let mut judged = Judged { to_labels: Vec::new(), to_truth: Vec::new(), words: Vec::new() };
    for windows in sets {
        let forces = trained.forces_body_n(windows);
        judged.to_labels.push(ForceError::of(&forces, &labels_of(windows)));
        judged.to_truth.push(ForceError::of(&forces, &truths_of(windows)));
        if model == Model::Parnn {
            judged.words.push(words(&trained, windows));
        }
    }
    Ok(judged)
}

fn labels_of(windows: &[Window]) -> Vec<[f32; 3]> {
    windows.iter().map(|w| w.label_body_n).collect()
}

/// The simulator's flights all have a truth.
fn truths_of(windows: &[Window]) -> Vec<[f32; 3]> {
    windows.iter().filter_map(|w| w.truth_body_n).collect()
}

/// Shares of larger angles of attack, of all and of the large ones, and median gamma; zero where
/// nothing is fast enough.
fn words(trained: &Trained, windows: &[Window]) -> [f64; 3] {
    let Some(parnn) = trained.parnn() else { return [0.0; 3] };
    let (mut all, mut large, mut gammas) = (Vec::new(), Vec::new(), Vec::new());
    for window in windows {
        let [speed, alpha_rad] = window.rows[WINDOW - 1];
        if speed * SPEED_SCALE_M_S <= ALPHA_FROM_M_S {
            continue;
        }
        let estimate =
            parnn.estimate(&window.rows, In::new(Vector3::from(window.velocity_body_m_s)));
        let is_larger = f64::from(u8::from(estimate.alpha_est_rad.abs() > alpha_rad.abs()));
        all.push(is_larger);
        if alpha_rad.abs() > LARGE_ALPHA_RAD {
            large.push(is_larger);
        }
        gammas.push(f64::from(estimate.correction.gamma));
    }
    gammas.sort_unstable_by(f64::total_cmp);
    let share = |of: &[f64]| if of.is_empty() { 0.0 } else { mean(of) };
    [share(&all), share(&large), gammas.get(gammas.len() / 2).copied().unwrap_or(0.0)]
}

fn flown(windows: &[Window]) -> Flown {
    let speeds = windows.iter().map(|w| f64::from(w.rows[WINDOW - 1][0] * SPEED_SCALE_M_S));
    let (slowest, fastest) =
        speeds.fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
    Flown {
        speed_m_s: [slowest, fastest],
        force_rms_n: ForceError::of(&truths_of(windows), &vec![[0.0; 3]; windows.len()]).rms_n,
        label_noise_n: ForceError::of(&labels_of(windows), &truths_of(windows)).rms_n,
    }
}

fn describe(kind: Kind, place: usize, trials: &[Trial]) -> Set {
    let of = || trials.iter().map(|trial| &trial.sets[place]);
    Set {
        set: kind.name(),
        about: kind.about(),
        flights: if kind == Kind::Training { TRAINING_FLIGHTS[2] } else { TEST_FLIGHTS },
        speed_m_s: [
            of().fold(f64::INFINITY, |low, set| low.min(set.speed_m_s[0])),
            of().fold(0.0, |high: f64, set| high.max(set.speed_m_s[1])),
        ],
        force_rms_n: spread(&of().map(|set| set.force_rms_n).collect::<Vec<f64>>()),
        label_noise_n: spread(&of().map(|set| set.label_noise_n).collect::<Vec<f64>>()),
    }
}
