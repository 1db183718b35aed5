//! Whether the logs agree with themselves, before anything is said about forces.
//!
//! Each pair of sources that measure one motion is compared: gyroscope and attitude, accelerometer
//! and fixes, velocity and position, commands and what the vehicle did. An axis that fits better
//! under another name, a slope that no noise of either source explains, a time shift that no
//! latency explains, a clock that jumps, values that are held, or a flight given twice is a problem
//! of the data; its words say what to change in the import map. Bounds lie far outside what any
//! effect of the catalogue does. A flight with a problem is set aside, and the others go on.

mod attitude;
mod channels;
mod clock;
mod drift;
mod fixes;
mod flight;
mod held;
mod pairs;
mod repeated;
mod rotors;
mod units;

use crate::GapError;
use crate::predictor::Predictor;
use crate::verdict::{Kind, SetAside, Verdict};
pub(crate) use channels::{channels, saturation};
use flight::Flight;
use pairs::{Pairs, Products};
pub(crate) use repeated::{Known, known};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;

type Flights = Vec<(String, FlightLog)>;
/// A channel and what is wrong with it.
type Found = Option<(&'static str, String)>;

/// Flights that can be read, and what the vehicle as it is leaves of them.
pub(crate) struct Ready<'a> {
    pub(crate) predictor: Predictor<'a>,
    pub(crate) nominal: Vec<f64>,
    pub(crate) unseen: Option<Predictor<'a>>,
}

impl<'a> Ready<'a> {
    /// # Errors
    /// What [`Predictor::new`] says of the first flight that cannot be read.
    pub(crate) fn new(
        vehicle: &'a VehicleFile,
        flights: &'a [(String, FlightLog)],
        held_out: &'a [(String, FlightLog)],
    ) -> Result<Self, GapError> {
        let predictor = Predictor::new(vehicle, flights)?;
        let unseen =
            if held_out.is_empty() { None } else { Some(Predictor::new(vehicle, held_out)?) };
        let nominal = predictor.residual(&predictor.nominal())?;
        Ok(Self { predictor, nominal, unseen })
    }

    /// The same with what names come from alone: parts of long flights, without what is not known
    /// of them.
    ///
    /// # Errors
    /// What the predictor says.
    pub(crate) fn narrowed(
        mut self,
        flights: &'a [(String, FlightLog)],
        moments: Moments,
    ) -> Result<Self, GapError> {
        if let Some(parts) = self.predictor.in_parts(flights)? {
            self.nominal = parts.residual(&parts.nominal())?;
            self.predictor = parts;
        }
        leave_out(&mut self.predictor, &self.nominal, moments);
        Ok(self)
    }

    /// Whether moments go with the file's although nobody knows how the air moves past the vehicle,
    /// which may turn it, too.
    pub(crate) fn turns_in_unknown_air(&self) -> bool {
        !self.predictor.has_motion() && self.gyroscope() == Gyroscope::Follows
    }

    /// What the moments that a gyroscope gives have to do with the file's.
    pub(crate) fn gyroscope(&self) -> Gyroscope {
        if !self.predictor.has_gyroscope() {
            Gyroscope::Missing
        } else if moments_fit(&self.predictor, &self.nominal) {
            Gyroscope::Follows
        } else {
            Gyroscope::Strays
        }
    }
}

/// What measured moments have to do with those of the vehicle file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Gyroscope {
    /// No rates were measured as such.
    Missing,
    /// They go with them.
    Follows,
    /// They do not: the file lacks a large moment, or knows little of this machine.
    Strays,
}

/// Flights whose data contradict themselves or repeat another flight, in order.
///
/// # Errors
/// [`GapError`]: a flight that cannot be read.
pub fn contradictions(
    vehicle: &VehicleFile,
    flights: &[(String, FlightLog)],
) -> Result<Vec<SetAside>, GapError> {
    problems(&Ready::new(vehicle, flights, &[])?, &[], flights, &[])
}

/// The flights of both lists with a problem, each with its first.
///
/// * `before` - those of a baseline, which none of them may be
///
/// # Errors
/// What the predictor says.
pub(crate) fn problems(
    ready: &Ready<'_>,
    before: &[Known],
    flights: &[(String, FlightLog)],
    held_out: &[(String, FlightLog)],
) -> Result<Vec<SetAside>, GapError> {
    let repeated = repeated::repeated(before, flights.iter().chain(held_out));
    let mut found = problems_of(&ready.predictor, &ready.nominal, flights);
    if let Some(unseen) = &ready.unseen {
        found.extend(problems_of(unseen, &unseen.residual(&unseen.nominal())?, held_out));
    }
    found.extend(repeated);
    // One line a flight.
    let mut told: Vec<SetAside> = Vec::new();
    for (name, _) in flights.iter().chain(held_out) {
        let new = told.iter().all(|aside| aside.flight != *name);
        told.extend(found.iter().find(|aside| aside.flight == *name).filter(|_| new).cloned());
    }
    Ok(told)
}

fn problems_of(
    predictor: &Predictor<'_>,
    residual: &[f64],
    logs: &[(String, FlightLog)],
) -> Vec<SetAside> {
    let first = |(index, (_, log)): (usize, &(String, FlightLog))| {
        let flight = Flight::new(predictor, index);
        // Without an accelerometer forces come from the fixes themselves, and agree with them.
        let felt = predictor.has_accelerometer();
        let (channel, words) = units::voltage(&flight)
            // Measured speeds of rotors are taken for commands then.
            .or_else(|| (!predictor.has_rotor_speeds()).then(|| units::commands(&flight)).flatten())
            .or_else(|| held::held(log, &flight.spans()))
            .or_else(|| units::force(&flight))
            .or_else(|| attitude::rates(&flight))
            .or_else(|| felt.then(|| fixes::frames(&flight)).flatten())
            .or_else(|| clock::steps(&flight, residual))
            .or_else(|| drift::bias(&flight))
            .or_else(|| felt.then(|| fixes::velocities(&flight)).flatten())
            .or_else(|| fixes::positions(&flight))
            .or_else(|| rotors::model(&flight, residual))?;
        let flight = flight.name().to_owned();
        Some(SetAside { words: format!("{flight}: {channel}: {words}"), flight, channel })
    };
    logs.iter().enumerate().filter_map(first).collect()
}

/// The flights of both lists that cannot be read by themselves, each with why.
///
/// # Errors
/// `error`, the first that was met, if no flight to fit is left or no single flight is to blame.
pub(crate) fn unreadable(
    vehicle: &VehicleFile,
    flights: &[(String, FlightLog)],
    held_out: &[(String, FlightLog)],
    error: GapError,
) -> Result<Vec<SetAside>, GapError> {
    let why = |flight: &(String, FlightLog)| {
        let error = Predictor::new(vehicle, std::slice::from_ref(flight)).err()?;
        let channel = error.channel()?;
        Some(SetAside { flight: flight.0.clone(), channel, words: error.to_string() })
    };
    let of_flights: Vec<SetAside> = flights.iter().filter_map(why).collect();
    let of_held_out: Vec<SetAside> = held_out.iter().filter_map(why).collect();
    if of_flights.len() == flights.len() || of_flights.len() + of_held_out.len() == 0 {
        return Err(error);
    }
    Ok([of_flights, of_held_out].concat())
}

/// The flights that are not set aside.
pub(crate) fn kept(flights: &[(String, FlightLog)], aside: &[SetAside]) -> Flights {
    let stays = |flight: &&(String, FlightLog)| aside.iter().all(|a| a.flight != flight.0);
    flights.iter().filter(stays).cloned().collect()
}

/// Says in a verdict which flights took no part.
///
/// * `given` - number of flights in all
pub(crate) fn tell(verdict: &mut Verdict, given: usize) {
    let aside = &verdict.set_aside;
    if aside.is_empty() {
        return;
    }
    verdict.notes.extend(aside.iter().map(|a| format!("set aside: {}", a.words)));
    let told = if verdict.verdict == Kind::DataProblem { 1 } else { TOLD };
    let lines: Vec<&str> = aside.iter().take(told).map(|a| a.words.as_str()).collect();
    let more = aside.len() - lines.len();
    let and = if more > 0 { format!("; {more} more: see the notes") } else { String::new() };
    let words =
        format!("{} of {given} flights were set aside: {}{and}.", aside.len(), lines.join("; "));
    verdict.words = match verdict.verdict {
        Kind::DataProblem if given == 1 => return,
        Kind::DataProblem => words,
        _ => format!("{} {words}", verdict.words),
    };
}

/// Flights set aside that a verdict tells by themselves.
const TOLD: usize = 3;

/// Correlation of roll and pitch with their commands, however late, below which the model says
/// nothing about moments.
const MOMENT_FIT: f64 = 0.75;
/// The same of their changes from row to row: 0.95 to 0.98 where a large moment is missing, 0.7 to
/// 0.9 in measured flights of brushed motors whose moments the file does not know.
const QUICK_FIT: f64 = 0.93;

/// Measured moments over predicted ones between which noise alone lowers their correlations, and
/// the least correlation that tells. Where a quiet flight is seen through a noisy gyroscope, the
/// correlation is low and the slope is 0.97 to 1.05; of brushed motors whose moments the file does
/// not know it is 0.1 to 0.2.
const WHOLE: [f64; 2] = [0.7, 1.4];
const TELLS: f64 = 0.25;

/// What takes part of the moments of some flights.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Moments {
    /// All of them, where they have to do with those of the vehicle file.
    IfKnown,
    /// All of them.
    All,
    /// What lasts of them: the vehicle's numbers are those of this machine.
    Lasting,
}

/// Leaves out what is not known of some flights: drag without the motion through the air, and
/// moments that have nothing to do with those of the vehicle file.
pub(crate) fn leave_out(predictor: &mut Predictor<'_>, residual: &[f64], moments: Moments) {
    let lasting = moments == Moments::Lasting;
    // A heading that is taken as held does for what lasts.
    let has_heading = predictor.has_heading() || lasting;
    if !predictor.has_motion() || !has_heading {
        predictor.leave_out_drag();
    }
    let are_known = || predictor.has_motion() && moments_fit(predictor, residual);
    if lasting {
        predictor.keep_trim();
    } else if !has_heading
        || !predictor.has_pitch()
        || (moments == Moments::IfKnown && !are_known())
    {
        // What turned a vehicle is not known where its pitch is what its force would have it be.
        predictor.leave_out_moments();
    }
}

/// Whether the vehicle file's moments have to do with the measured ones; where they do not, nothing
/// is named from them by itself. A large moment that the file lacks is slow, as velocity is, and
/// what is quick still follows the commands. What a gyroscope adds does not change how much of a
/// moment is in the measured one.
fn moments_fit(predictor: &Predictor<'_>, residual: &[f64]) -> bool {
    let (mut fits, mut roll_and_pitch) = (Vec::new(), Products::default());
    for piece in 0..predictor.tracks.len() {
        if predictor.tracks[piece].measured.len() <= 100 {
            continue;
        }
        let flight = Flight::piece(predictor, piece);
        let moments: Pairs = flight.predicted(residual, 3);
        let undamped = moments.with_damping(&flight.omega());
        let fit = |pairs: &Pairs| pairs.best_shift(flight.step_s(), 0.2);
        let (shift_s, own) = fit(&moments);
        fits.push([own.max(fit(&undamped).1), fit(&moments.changes()).1]);
        roll_and_pitch += moments.products((shift_s / flight.step_s()).round() as i64);
    }
    let mean = |of: usize| fits.iter().map(|fit| fit[of]).sum::<f64>() / fits.len() as f64;
    fits.is_empty()
        || mean(0) >= MOMENT_FIT
        || mean(1) >= QUICK_FIT
        || (roll_and_pitch.correlation() >= TELLS
            && (WHOLE[0]..=WHOLE[1]).contains(&roll_and_pitch.slope()))
}
