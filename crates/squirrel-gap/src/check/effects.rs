//! What flights could show of each effect of the catalogue.

use crate::GapError;
use crate::checked::{Choice, EffectCheck, NO_WINGS, NumberCheck, Shows};
use crate::compatibility::Ready;
use crate::diagnose::curve_hides_sag;
use crate::name::{Catalogue, Scatter, Search, Showable, air_hides_names, catalogue, gust_sizes};
use crate::predictor::{Predictor, TURNING};
use squirrel_core::effects::{
    BatterySag, Effect, Effects, FORM, Gust, Kind, Profile, Response, Shown,
};
use squirrel_sim::plant::WingPlant;
use std::collections::BTreeMap;

/// Why nothing can be shown where the air pushes in a way that nobody knows.
const UNKNOWN_AIR: &str = "gnss.velocity_ned_m_s, attitude: without both the air pushes these flights by more than their noise, and nobody knows how much";

/// Why a sag cannot.
const THRUST_CURVE: &str = "propulsion.pwm_to_thrust_n: its sd does what a sag does";

/// * `scatter` - how much a machine differs from one flight to the next, against a baseline
/// * `command_hz` - how often commands change
pub(super) fn effects(
    Ready { predictor, nominal, .. }: &Ready<'_>,
    scatter: Option<&Scatter>,
    command_hz: Option<f64>,
) -> Result<Vec<EffectCheck>, GapError> {
    let mut catalogue = catalogue(predictor, nominal)?;
    if let Some(scatter) = scatter {
        catalogue.take(scatter);
    }
    let search = Search { predictor, catalogue: &catalogue, gust_m_s: None, progress: &|| () };
    let showable = search.showable()?;
    let air_hides = air_hides_names(predictor)?;
    let hides_sag = curve_hides_sag(predictor, nominal)?;
    let mut all = Vec::new();
    for name in Effects::<f64>::NAMES {
        let Some(profile) = Effects::<f64>::profile(name) else { continue };
        let own = |found: &&Showable| catalogue.candidates[found.candidate].effect == *name;
        let own: Vec<&Showable> = showable.iter().filter(own).collect();
        let mut effect = EffectCheck {
            name,
            shown: Shows::Cannot,
            numbers: Vec::new(),
            not_told_from: Vec::new(),
            lacks: None,
            fly: None,
        };
        if profile.response == Response::Random {
            effect.numbers.push(gust(predictor)?);
        } else if own.is_empty() {
            effect.lacks = Some(lacks(predictor, &profile).to_owned());
        }
        for found in own {
            add(&mut effect, &catalogue, found);
        }
        if profile.shown.has(Shown::COMMANDS)
            && let Some(hz) = command_hz
        {
            hold_for(&mut effect, hz);
        }
        if hides_sag && *name == BatterySag::<f64>::NAME {
            hide(&mut effect, THRUST_CURVE);
        }
        if air_hides {
            hide(&mut effect, UNKNOWN_AIR);
        }
        let can =
            effect.lacks.is_none() && effect.decisive().is_some_and(NumberCheck::can_be_shown);
        if can {
            effect.shown = Shows::Can;
        } else if effect.lacks.is_none() {
            effect.fly = Some(profile.words.fly);
        }
        all.push(effect);
    }
    Ok(all)
}

/// Takes a number; of one that is looked for from several starts, what all of them show.
fn add(effect: &mut EffectCheck, catalogue: &Catalogue, found: &Showable) {
    let parameter = &catalogue.parameters[found.parameter];
    let candidate = &catalogue.candidates[found.candidate];
    let list = Effects::<f64>::parameters(candidate.effect).unwrap_or_default();
    let chosen = candidate.fixed.iter().filter_map(|(slot, value)| {
        let made = &list[*slot];
        let choice = match made.kind {
            Kind::Rotor => Choice::Number(*value as usize),
            Kind::OneOf(_) if made.key == FORM && made.sought.is_empty() => return None,
            Kind::OneOf(names) => Choice::Name(names[*value as usize]),
            Kind::Size { .. } => return None,
        };
        Some((made.key, choice))
    });
    let choices: BTreeMap<&'static str, Choice> = chosen.collect();
    for rival in &found.rivals {
        if !effect.not_told_from.contains(rival) {
            effect.not_told_from.push(rival);
        }
    }
    let sizes = (parameter.smallest, parameter.largest);
    let new = number(parameter.key, choices, sizes, (found.from, found.never_below));
    match effect.numbers.iter_mut().find(|n| n.key == new.key && n.choices == new.choices) {
        Some(other) if other.smallest_shown.is_some_and(|size| size < found.from) => *other = new,
        Some(_) => {}
        None => effect.numbers.push(new),
    }
}

fn number(
    key: &'static str,
    choices: BTreeMap<&'static str, Choice>,
    (smallest, largest): (f64, f64),
    (from, never_below): (f64, f64),
) -> NumberCheck {
    let known = |size: f64| size.is_finite().then_some(size);
    NumberCheck {
        key,
        choices,
        smallest_shown: known(from),
        smallest_shown_of_typical: known(from / (smallest * largest).sqrt()),
        not_shown_below: known(never_below),
        smallest,
        largest,
    }
}

fn gust(predictor: &Predictor<'_>) -> Result<NumberCheck, GapError> {
    let parameter = &Gust::<f64>::PARAMETERS[0];
    let range = parameter.range(&predictor.vehicle.vehicle);
    let sizes = range.map_or((0.0, 0.0), |range| (range.smallest, range.largest));
    let shown = if predictor.has_channel(0) {
        gust_sizes(predictor)?
    } else {
        (f64::INFINITY, f64::INFINITY)
    };
    Ok(number(parameter.key, BTreeMap::new(), sizes, shown))
}

/// No size is shown, for a reason that may be another one already.
fn hide(effect: &mut EffectCheck, why: &str) {
    for number in &mut effect.numbers {
        *number = number_of_no_size(number);
    }
    effect.lacks.get_or_insert_with(|| why.to_owned());
}

fn number_of_no_size(of: &NumberCheck) -> NumberCheck {
    let sizes = (of.smallest, of.largest);
    number(of.key, of.choices.clone(), sizes, (f64::INFINITY, f64::INFINITY))
}

/// A time below that for which commands are held may be anything.
fn hold_for(effect: &mut EffectCheck, hz: f64) {
    let period_s = 1.0 / hz;
    let mut is_short = false;
    for number in effect.numbers.iter_mut().filter(|number| number.key.ends_with("_s")) {
        let Some(size) = number.smallest_shown else { continue };
        let could = number.can_be_shown();
        let longer = size.max(period_s);
        number.smallest_shown = Some(longer);
        number.smallest_shown_of_typical = Some(longer / (number.smallest * number.largest).sqrt());
        is_short |= could && !number.can_be_shown();
    }
    if is_short {
        effect.lacks =
            Some(format!("rotor.command changes at {hz:.0} Hz: log commands at a higher rate"));
    }
}

/// Why an effect is not looked for in these flights.
fn lacks(predictor: &Predictor<'_>, profile: &Profile) -> &'static str {
    let shown = profile.shown;
    if profile.is_of_wings && predictor.vehicle.wing == WingPlant::None {
        NO_WINGS
    } else if shown.has(Shown::ACCELEROMETER) && !predictor.has_accelerometer() {
        "imu.specific_force_body_m_s2: the logs have no accelerometer"
    } else if shown.has(Shown::TURNS) && !predictor.has_channel(TURNING) {
        "the logs have no gyroscope beside an attitude"
    } else if shown.has(Shown::COMMANDS) && predictor.has_rotor_speeds() {
        "rotor.speed_rad_s: rotors turn as they were measured, whatever they were told"
    } else if shown.has(Shown::MOMENTS) && !predictor.has_channel(3) {
        "the moments of these flights have too little to do with those of the vehicle file, or are not known"
    } else if shown.has(Shown::HORIZONTAL) && !predictor.has_channel(0) {
        "the logs do not say how the vehicle moves through the air: velocity, attitude and heading"
    } else if shown.has(Shown::HEIGHT) && !predictor.has_height() {
        "the logs have no height: baro.altitude_m or gnss.position_ned_m"
    } else {
        "these logs show what lasts alone"
    }
}
