//! The vehicle file with its own numbers where flights have them: what floated inside its
//! tolerance, as a point of the search has it.
//!
//! Where the file explains next to nothing of the moments, nothing is named from them, and no
//! tolerance holds. Its numbers of moments are then fitted to them afterwards, under wide priors
//! and by themselves: they predict, and are no finding.

use crate::GapError;
use crate::name::{Catalogue, Point, Scored, Search, hypothesis};
use crate::predictor::Predictor;
use squirrel_core::effects::{EffectParameter, Effects, Fitted, Kind};
use squirrel_core::vehicle::{ParameterError, Vehicle};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;

/// Least part of its thrust or torque that a rotor gives.
const LEAST_FACTOR: f64 = 0.01;
/// Largest principal moment of a body over the sum of the others.
const LARGEST_MOMENT: f64 = 0.999;
/// Part of the smallest size worth reporting below which an effect changes no prediction.
const NEXT_TO_NOTHING: f64 = 0.01;

/// Steps of their fit, each about what the last has found.
const STEPS: usize = 3;

/// The vehicle file as an explanation has it, with what it names, and with the moments of the
/// flights.
///
/// # Errors
/// Numbers that no vehicle has, or what the predictor says.
pub(crate) fn with_moments(
    search: &Search<'_>,
    set: &Scored,
    flights: &[(String, FlightLog)],
) -> Result<VehicleFile, GapError> {
    let mut own = search.predictor.vehicle.clone();
    let named = |effect: &str| set.members.iter().any(|member| search.effect(member) == effect);
    let is_its_own = |effect: &str| named(effect) || lasts(effect);
    (own.vehicle, own.effects) = machine(search, search.whole(set), is_its_own)?;
    for _ in 0..STEPS {
        let mut predictor = Predictor::new(&own, flights)?;
        if let Some(parts) = predictor.in_parts(flights)? {
            predictor = parts;
        }
        predictor.keep_moments();
        let mut catalogue = Catalogue::new(&predictor, &[], None)?;
        catalogue.free_moments_alone();
        let moments = Search {
            predictor: &predictor,
            catalogue: &catalogue,
            gust_m_s: None,
            progress: search.progress,
        };
        let (vehicle, effects) = machine(&moments, moments.towards()?, |_| true)?;
        (own.vehicle, own.effects) = (vehicle, effects);
    }
    own.effects = worth_a_line(&own, NEXT_TO_NOTHING);
    Ok(own)
}

/// The vehicle file as an explanation has it, beside what is named.
///
/// # Errors
/// Numbers that no vehicle has.
pub(crate) fn of(search: &Search<'_>, set: &Scored) -> Result<VehicleFile, GapError> {
    let mut own = search.predictor.vehicle.clone();
    let point = Point { members: Vec::new(), ..search.whole(set) };
    (own.vehicle, own.effects) = machine(search, point, lasts)?;
    own.effects = worth_a_line(&own, NEXT_TO_NOTHING);
    Ok(own)
}

/// Whether a fit to flights may move the numbers of an effect.
fn lasts(effect: &str) -> bool {
    Effects::<f64>::profile(effect).is_some_and(|profile| profile.fitted != Fitted::Never)
}

/// The vehicle and its effects at a point, without what the sensors of these flights did.
///
/// * `is_its_own` - whether an effect changes a number of the vehicle
///
/// # Errors
/// Numbers that no vehicle has.
pub(crate) fn machine(
    search: &Search<'_>,
    mut point: Point,
    is_its_own: impl Fn(&str) -> bool,
) -> Result<(Vehicle<f64>, Effects<f64>), GapError> {
    let (predictor, catalogue) = (search.predictor, search.catalogue);
    for (x, parameter) in point.base.iter_mut().zip(&catalogue.parameters) {
        if !is_its_own(catalogue.candidates[parameter.candidate].effect) {
            *x = 0.0;
        }
    }
    point.base[catalogue.shared_columns()..].fill(0.0);
    let at = hypothesis(predictor, catalogue, &point)?;
    let possible =
        possible(&at.vehicle).map_err(|problem| predictor.refused(problem.to_string()))?;
    Ok((possible, at.effects))
}

/// A vehicle whose numbers a file may have: a drag or a torque of less than nothing and an inertia
/// of no body are hypotheses at best.
fn possible(fitted: &Vehicle<f64>) -> Result<Vehicle<f64>, ParameterError> {
    let mut p = *fitted.parameters();
    p.drag.linear_n_s_per_m = p.drag.linear_n_s_per_m.map(|x| x.max(0.0));
    let moments = p.inertia_kg_m2.diagonal();
    let largest = moments.imax();
    let others = moments.sum() - moments[largest];
    if moments[largest] > others {
        p.inertia_kg_m2[(largest, largest)] = LARGEST_MOMENT * others;
    }
    let factors = fitted.rotor_factors().map(|all| all.map(|x| x.max(LEAST_FACTOR)));
    Vehicle::new(p)?.with_rotor_factors(factors)
}

/// The effects of a machine without what is next to nothing, unless its file has it.
///
/// * `share` - of the smallest size worth reporting, which is not nothing
pub(crate) fn worth_a_line(own: &VehicleFile, share: f64) -> Effects<f64> {
    let mut kept = Effects::none();
    for name in Effects::<f64>::NAMES {
        let mut all = own.effects;
        let Some(found) = all.has(name).then(|| all.insert(name)).flatten() else { continue };
        for (p, value) in found.parameters.iter().zip(found.values.iter_mut()) {
            // What floats may be a little less than nothing, and no file can say so.
            if matches!(p.kind, Kind::Size { signed: false, .. }) {
                *value = value.max(0.0);
            }
        }
        let is_worth = |(p, value): (&EffectParameter, &f64)| {
            p.range(&own.vehicle).is_some_and(|range| value.abs() >= share * range.smallest)
        };
        let declared =
            own.provenance.iter().any(|(field, _)| field.starts_with(&format!("effects.{name}.")));
        if (declared || found.parameters.iter().zip(found.values.iter()).any(is_worth))
            && let Some(place) = kept.insert(name)
        {
            place.values.copy_from_slice(found.values);
        }
    }
    kept
}
