//! What the report shows, as plain data: whoever found it fills this in, and the same struct
//! serialises beside the page.
//!
//! Numbers that are unknown are NaN; they are drawn as gaps and written as null. Lists that are
//! empty say so on the page.

use crate::ClosedLoop;
use crate::checked::Check;
use serde::Serialize;

/// Everything on one page.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ReportData {
    /// Title of the page.
    pub title: String,
    /// The first screen: what is missing, how sure, how much better it predicts, what remains, what
    /// to fly next.
    pub screen: Vec<Answer>,
    /// Flights that were set aside, each with what to change; a line each.
    pub set_aside: Vec<String>,
    /// What the flights are worth before any verdict; none where nobody asked.
    pub check: Option<Check>,
    /// The verdict as one paragraph in plain words.
    pub verdict: String,
    /// Why nothing could be computed and the panels are empty; empty where they are not.
    pub stopped: String,
    /// How each rotor is against good flights of the same machine; empty where there are none.
    pub rotors: Vec<RotorRow>,
    /// Where the answer holds: what the flights covered.
    pub domain: Vec<DomainRow>,
    /// What changes in the vehicle file, as lines with `+` and `-`.
    pub patch_diff: String,
    /// Names of the residual's channels with units, in the order of [`FlightPanel::before`].
    pub channels: Vec<String>,
    /// Flights that were looked at.
    pub flights: Vec<FlightPanel>,
    /// Evidence of every hypothesis.
    pub evidence: Vec<Evidence>,
    /// Residual against what explains it.
    pub conditional: Vec<Conditional>,
    /// Errors on flights that were not used.
    pub held_out: Option<HeldOut>,
    /// Held-out flights that were flown again in closed loop.
    pub closed_loop: Vec<ClosedLoop>,
    /// Whether what is left is noise.
    pub whiteness: Vec<Whiteness>,
    /// Parameters of the answer.
    pub parameters: Vec<ParameterRow>,
    /// Which effects these flights can tell apart.
    pub confusability: Option<Confusability>,
    /// What to fly to know more.
    pub fly_next: Vec<FlyNext>,
}

/// A question of the first screen and what the verdict says to it.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Answer {
    /// The question, two to four words.
    pub question: String,
    /// The answer in a few words.
    pub answer: String,
    /// The number that matters, with its unit; empty where there is none.
    pub figure: String,
    /// What the number is, and its interval.
    pub figure_note: String,
    /// Plain sentences.
    pub sentences: Vec<String>,
}

/// One rotor against good flights of the same machine.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RotorRow {
    /// Number, from 1.
    pub rotor: usize,
    /// Part of its thrust that it lacks, with its 95 % interval.
    pub loss: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// By how much it differs from one good flight to another, one standard deviation.
    pub usual: f64,
}

/// A range that the flights covered.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DomainRow {
    /// What.
    pub name: String,
    /// Lowest.
    pub low: f64,
    /// Highest.
    pub high: f64,
    /// Unit of both.
    pub unit: String,
}

/// The residual of one flight over time. All lists have one number a window.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FlightPanel {
    /// Name of the flight.
    pub name: String,
    /// Begin of the first window, s.
    pub start_s: f64,
    /// Length of a window, s, > 0.
    pub window_s: f64,
    /// Root mean square of each channel in units of its predicted noise, under the vehicle as
    /// declared: `[channel][window]`.
    pub before: Vec<Vec<f64>>,
    /// The same under the vehicle with the answer; empty where there is none.
    pub after: Vec<Vec<f64>>,
    /// Speed over ground, m/s.
    pub speed_m_s: Vec<f64>,
    /// Height above the ground, m.
    pub height_m: Vec<f64>,
    /// Deployment of the wings, 0 to 1; empty without wings.
    pub wings: Vec<f64>,
}

/// The evidence of one hypothesis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Evidence {
    /// Effect, or effects joined by ` + `.
    pub name: String,
    /// Log evidence over the vehicle as declared, nats.
    pub nats: f64,
    /// Whether this is what the verdict names, be it as the nearest name.
    pub is_answer: bool,
}

/// The residual of a channel against the quantity that explains it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Conditional {
    /// Channel.
    pub channel: String,
    /// Unit of the channel.
    pub unit: String,
    /// What explains it.
    pub regressor: String,
    /// Unit of that.
    pub regressor_unit: String,
    /// Rising in the regressor.
    pub bins: Vec<Bin>,
}

/// Residuals at one value of a regressor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bin {
    /// Mean of the regressor.
    pub at: f64,
    /// Samples.
    pub count: usize,
    /// Mean before.
    pub before_mean: f64,
    /// Standard deviation before.
    pub before_sd: f64,
    /// Mean after; NaN where there is no answer.
    pub after_mean: f64,
    /// Standard deviation after; NaN where there is no answer.
    pub after_sd: f64,
}

/// Errors of re-simulation on flights that were not used to find the answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeldOut {
    /// Names of the flights.
    pub flights: Vec<String>,
    /// The best rival's name; empty without one.
    pub rival: String,
    /// One row a channel; empty where the flights cannot be re-simulated.
    pub channels: Vec<HeldOutChannel>,
    /// All channels together, over the length of the re-simulation: each over its noise floor, mean
    /// over channels.
    pub horizons: Vec<Horizon>,
}

/// Root mean square errors of one channel, in its unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeldOutChannel {
    /// Channel.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Errors at the longest horizon.
    pub errors: Errors,
    /// Errors over the first second, which the gap counts.
    pub second: Errors,
    /// Errors over the length of the re-simulation, in the unit of the channel.
    pub horizons: Vec<Horizon>,
}

/// Errors after re-simulating for some time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Horizon {
    /// Length of the re-simulation, s.
    pub horizon_s: f64,
    /// Errors.
    pub errors: Errors,
}

/// The same error of four models.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Errors {
    /// The vehicle as declared.
    pub nominal: f64,
    /// The best rival.
    pub rival: f64,
    /// The answer.
    pub fitted: f64,
    /// What sensor noise alone gives.
    pub floor: f64,
}

/// What is left of one channel under the answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Whiteness {
    /// Channel.
    pub channel: String,
    /// Distance between two lags, s, > 0.
    pub lag_s: f64,
    /// Autocorrelation at lags 1, 2, ...
    pub autocorrelation: Vec<f64>,
    /// Correlation with inputs at lags 0, 1, ... of the input.
    pub inputs: Vec<InputCorrelation>,
    /// Half width of the band that holds 99 % of the correlations of white noise.
    pub band_99: f64,
    /// Ljung-Box statistic.
    pub ljung_box: f64,
    /// Lags in it.
    pub ljung_box_lags: usize,
    /// Its p-value.
    pub ljung_box_p: f64,
}

/// Correlation of a residual with one input.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InputCorrelation {
    /// Input.
    pub input: String,
    /// At lags 0, 1, ...
    pub values: Vec<f64>,
}

/// One number of the answer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ParameterRow {
    /// Effect.
    pub effect: String,
    /// Key in the vehicle file.
    pub key: String,
    /// Unit; empty for a plain number.
    pub unit: String,
    /// Estimate.
    pub value: f64,
    /// Low end of its 95 % interval.
    pub low: f64,
    /// High end.
    pub high: f64,
    /// Smallest size worth reporting.
    pub smallest: f64,
    /// Largest plausible size, > 0.
    pub largest: f64,
    /// Declared tolerance of the vehicle, one standard deviation.
    pub tolerance: f64,
}

/// Chi-square by which the smallest reportable size of one effect stands out while another floats
/// freely.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Confusability {
    /// Effects.
    pub names: Vec<String>,
    /// One row an effect, one column what floats; the diagonal is NaN.
    pub chi_square: Vec<Vec<f64>>,
}

/// What to fly next.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FlyNext {
    /// What it would decide.
    pub why: String,
    /// A built-in scenario, whose pilot's card is shown; or a manoeuvre in words.
    pub what: String,
}
