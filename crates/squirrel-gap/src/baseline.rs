//! A machine's own numbers: the vehicle file fitted to flights in which it flew well, and by how
//! much they differ from one such flight to the next. What has changed since is what such
//! differences do not explain.
//!
//! ```text
//! theta   the numbers of the file, all flights together, wide priors, a few damped steps of Gauss-Newton
//! k       maximises  sum_flights ln Z(flight | numbers off theta by sd k s0) - (ln k)^2 / (2 0.35^2)
//! t       = k s0 sqrt(1 + 1/n)              the tolerance of another flight, n flights in the baseline
//! ```
//! `s0` is half of the smallest size worth reporting, of each effect: one factor is all that a few
//! flights tell of scatter.

use crate::GapError;
use crate::compatibility::{self, Gyroscope, Known, Moments, Ready};
use crate::fitted;
use crate::leftover::usual;
use crate::name::{BETA, Catalogue, Scatter, Scored, Search, hypothesis};
use crate::predictor::Predictor;
use crate::verdict::SetAside;
use squirrel_core::effects::{Effects, Fitted};
use squirrel_core::vehicle::Vehicle;
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;
use std::collections::BTreeMap;

/// Steps of Gauss-Newton, each about what the last has found.
const STEPS: usize = 4;
/// Part of the smallest size worth reporting below which an effect of a machine is none.
const NEXT_TO_NOTHING: f64 = 0.1;
/// Part of the smallest size worth reporting by which a number differs from one flight to the next,
/// where nothing is known.
const USUAL_SHARE: f64 = 0.5;
/// How many times that it may be, and how sure that it is about once, as the deviation of its
/// logarithm.
const TIMES: [f64; 7] = [0.35, 0.5, 0.7, 0.85, 1.0, 1.4, 2.0];
const TIMES_SD: f64 = 0.35;

/// A machine as it flew when it flew well.
#[derive(Debug)]
pub struct Baseline {
    /// The vehicle file as it was given.
    pub declared: VehicleFile,
    /// The same with its numbers as these flights have them.
    pub vehicle: VehicleFile,
    /// Names of the flights.
    pub flights: Vec<String>,
    /// Flights that took no part.
    pub set_aside: Vec<SetAside>,
    pub(crate) moments: Moments,
    pub(crate) scatter: Scatter,
    /// A flight that is judged and one of these would show that nothing has changed.
    pub(crate) known: Vec<Known>,
}

impl Baseline {
    /// # Errors
    /// [`GapError::SameName`]: a flight that is one of the baseline.
    pub(crate) fn has_none_of<'f>(
        &self,
        mut flights: impl Iterator<Item = &'f (String, FlightLog)>,
    ) -> Result<(), GapError> {
        match flights.find(|(name, _)| self.flights.contains(name)) {
            Some((flight, _)) => Err(GapError::SameName { flight: flight.clone() }),
            None => Ok(()),
        }
    }

    /// Fits the numbers of a vehicle file to flights in which the machine flew well.
    ///
    /// # Errors
    /// [`GapError`]: a log or vehicle that nothing can be computed with, or no flight whose data
    /// agree with themselves.
    pub fn fit(
        vehicle: &VehicleFile,
        flights: &[(String, FlightLog)],
        progress: &dyn Fn(&str),
    ) -> Result<Self, GapError> {
        progress("reading the baseline");
        let (set_aside, moments) = match Ready::new(vehicle, flights, &[]) {
            Ok(ready) => {
                let is_known = ready.gyroscope() == Gyroscope::Follows;
                let moments = if is_known { Moments::All } else { Moments::Lasting };
                (compatibility::problems(&ready, &[], flights, &[])?, moments)
            }
            Err(error) => {
                (compatibility::unreadable(vehicle, flights, &[], error)?, Moments::IfKnown)
            }
        };
        let good = compatibility::kept(flights, &set_aside);
        if good.is_empty() {
            return Err(GapError::Baseline { words: set_aside[0].words.clone() });
        }
        if !set_aside.is_empty() {
            let mut fewer = Self::fit(vehicle, &good, progress)?;
            fewer.set_aside.splice(..0, set_aside);
            return Ok(fewer);
        }
        let mut own = vehicle.clone();
        for _ in 0..STEPS {
            progress("fitting the baseline");
            (own.vehicle, own.effects) = step(&own, moments, &good)?;
        }
        progress("fitting the baseline");
        own.effects = fitted::worth_a_line(&own, NEXT_TO_NOTHING);
        let scatter = scatter(&own, moments, &good)?;
        let known = compatibility::known(good.iter());
        let flights = good.into_iter().map(|(name, _)| name).collect();
        let declared = vehicle.clone();
        Ok(Self { declared, vehicle: own, flights, set_aside, moments, scatter, known })
    }
}

/// The vehicle and its effects, one step nearer to the flights.
fn step(
    vehicle: &VehicleFile,
    moments: Moments,
    flights: &[(String, FlightLog)],
) -> Result<(Vehicle<f64>, Effects<f64>), GapError> {
    let (predictor, mut catalogue) = prepared(vehicle, moments, flights)?;
    for parameter in &mut catalogue.parameters {
        let candidate = &catalogue.candidates[parameter.candidate];
        if candidate.floats && is_fitted(candidate.effect) {
            parameter.tolerance = parameter.tolerance.max(parameter.largest);
        }
    }
    let search =
        Search { predictor: &predictor, catalogue: &catalogue, gust_m_s: None, progress: &|| () };
    fitted::machine(&search, search.towards()?, is_fitted)
}

fn is_fitted(effect: &str) -> bool {
    Effects::<f64>::profile(effect).is_some_and(|profile| profile.fitted == Fitted::Always)
}

/// Flights, and what may be off in them.
fn prepared<'a>(
    vehicle: &'a VehicleFile,
    moments: Moments,
    flights: &'a [(String, FlightLog)],
) -> Result<(Predictor<'a>, Catalogue), GapError> {
    let mut predictor = Predictor::new(vehicle, flights)?;
    if let Some(parts) = predictor.in_parts(flights)? {
        predictor = parts;
    }
    let nominal = predictor.residual(&predictor.nominal())?;
    compatibility::leave_out(&mut predictor, &nominal, moments);
    let catalogue = Catalogue::new(&predictor, &[], None)?;
    Ok((predictor, catalogue))
}

/// How much another flight may differ.
fn scatter(
    vehicle: &VehicleFile,
    moments: Moments,
    flights: &[(String, FlightLog)],
) -> Result<Scatter, GapError> {
    let mut out = Scatter::default();
    let mut alone = Vec::with_capacity(flights.len());
    for flight in flights {
        let (predictor, mut catalogue) = prepared(vehicle, moments, std::slice::from_ref(flight))?;
        catalogue.take(&Scatter::default());
        let search = Search {
            predictor: &predictor,
            catalogue: &catalogue,
            gust_m_s: None,
            progress: &|| (),
        };
        let (point, set) = search.afloat()?;
        let left = predictor.residual(&hypothesis(&predictor, &catalogue, &point)?)?;
        for (most, own) in
            out.usual.iter_mut().flatten().zip(usual(&predictor, &left).iter().flatten())
        {
            *most = most.max(*own);
        }
        let effects =
            (0..catalogue.columns(&predictor)).map(|column| catalogue.group(column)).collect();
        alone.push(Alone { set, effects });
    }
    out.tolerances = among(&alone);
    Ok(out)
}

/// One flight by itself.
struct Alone {
    /// Its fit, nothing named.
    set: Scored,
    /// Of each column the effect that it changes a number of, and the smallest size of that.
    effects: Vec<Option<(&'static str, f64)>>,
}

impl Alone {
    /// Evidence of the flight if the numbers of flights differ by so many times what is usual.
    fn evidence(&self, times: f64) -> f64 {
        let of = |(effect, own): (&Option<(&str, f64)>, &f64)| {
            effect.map_or(*own, |(_, smallest)| times * USUAL_SHARE * smallest)
        };
        let sd: Vec<f64> = self.effects.iter().zip(&self.set.prior).map(of).collect();
        self.set
            .gram
            .posterior(&sd, BETA)
            .map_or(f64::NEG_INFINITY, |posterior| posterior.log_evidence)
    }
}

/// How much the numbers of a flight differ from those of others, by effect.
fn among(alone: &[Alone]) -> BTreeMap<&'static str, f64> {
    let evidence = |times: f64| {
        alone.iter().map(|flight| flight.evidence(times)).sum::<f64>()
            - 0.5 * (times.ln() / TIMES_SD).powi(2)
    };
    let best =
        TIMES.into_iter().max_by(|a, b| evidence(*a).total_cmp(&evidence(*b))).unwrap_or(1.0);
    // About their mean, which is not known better.
    let times = best * (1.0 + 1.0 / alone.len() as f64).sqrt();
    let effects = alone.iter().flat_map(|flight| flight.effects.iter().flatten());
    effects.map(|(effect, smallest)| (*effect, times * USUAL_SHARE * smallest)).collect()
}
