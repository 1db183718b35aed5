//! Which answer it is: evidence ranks names, held-out flights say whether one stands, and what is
//! left is told beside it.
//!
//! | what is left | names | answer |
//! |---|---|---|
//! | nothing above noise and tolerances | lead | `named`, `ambiguous` |
//! | a little of what they explain | another form would do | `named_form_differs` |
//! | a little everywhere, as models do, or what is slow in each flight | lead and hold on held-out flights | `named_incomplete` |
//! | nothing, but a gap on held-out flights that names hardly shrink | the same | `named_incomplete` |
//! | something of its own, beside names that other channels tell | the same | `named_incomplete` |
//! | something of its own otherwise | - | `outside_catalogue` |

use crate::find::Place;
use crate::name::{BEHIND_NATS, INTERVAL, Member, NATS_MIN, Naming, STANDS, Scored, Search};
use crate::proof::HeldOut;
use crate::verdict::{Alternative, Gap, Kind, Left, Moved, NamedEffect, Since, Value, Verdict};
use crate::words;
use squirrel_core::effects::{BatterySag, Effect, Effects, Gust, Kind as ParameterKind, forms};
use std::collections::BTreeMap;

/// Part of what the nominal model leaves that a form which differs may leave; more is outside the
/// catalogue.
const FORM_SHARE: f64 = 0.1;
/// Part of the held-out gap that a name in another form must remove.
const FORM_REMOVED: f64 = 0.6;
/// Part of a held-out gap, where there is one, times the floor, that names must remove beside which
/// nothing is said to be left: real batteries of the wrong sag remove a fifth at least.
const HARDLY_REMOVED: f64 = 0.1;
const IS_GAP: f64 = 2.0;
/// Part of a held-out gap that another explanation removes beyond a name that removes hardly any.
const RIVAL_REMOVES: f64 = 0.2;
/// Tolerances from which on a number that moved is told where nothing has a name.
const UNNAMED: f64 = 3.0;
/// How much more of the held-out gap another name must leave to be worse by that alone, and how
/// much if the evidence is against it, too, by so many nats: twenty to one.
const RIVAL_GAP: f64 = 3.0;
const RIVAL_GAP_BEHIND: f64 = 1.5;
/// Part of an error on held-out flights by which another one may be larger and no worse: the floor
/// takes what noise is beyond it.
const HELD_OUT_NOISE: f64 = 0.05;
/// More alternatives than this within the evidence of a name are no answer.
const ALTERNATIVES_MAX: usize = 3;
/// Alternatives that are shown.
const SHOWN: usize = 5;

/// Other names that are as good: the evidence hardly tells them apart, and held-out flights do not
/// either.
pub(crate) fn close<'a>(
    search: &Search<'_>,
    naming: &Naming,
    rivals: &'a [Scored],
    proof: Option<&HeldOut>,
    gap: Option<&Gap>,
) -> Vec<&'a Scored> {
    let named = search.weighed(&naming.found.best);
    // A set that was not named may have more evidence than what was: too little for each of its
    // names.
    let best = rivals.iter().map(|rival| search.weighed(rival)).fold(named, f64::max);
    let clearly_worse = |rival: usize| {
        let (Some(proof), Some(gap)) = (proof, gap) else { return false };
        let Some(held_out) = proof.rivals.get(rival) else { return false };
        // Flights that were fitted and those that were not are evidence of the same things.
        let behind = named - search.weighed(&rivals[rival]) + held_out.nats;
        let left = held_out.errors.over(&proof.floor.of(&proof.fitted));
        let times = if behind > BEHIND_NATS { RIVAL_GAP_BEHIND } else { RIVAL_GAP };
        behind > NATS_MIN || left - 1.0 >= times * (gap.after - 1.0).max(HELD_OUT_NOISE)
    };
    // What is in the place of a name must be worth something itself: what flights hardly ask for is
    // no other explanation, but none at all, which a name has left behind already.
    let is_worth = |rival: &Scored| {
        naming.found.without.iter().all(|without| {
            !is_one_more(rival, without) || rival.log_evidence >= without.log_evidence + BEHIND_NATS
        })
    };
    let is_close = |(i, rival): &(usize, &Scored)| {
        search.weighed(rival) > best - NATS_MIN && is_worth(rival) && !clearly_worse(*i)
    };
    rivals.iter().enumerate().filter(is_close).map(|(_, rival)| rival).collect()
}

/// Whether a set is another one with one member more.
fn is_one_more(set: &Scored, than: &Scored) -> bool {
    let has = |member: &Member| set.members.iter().any(|own| own.candidate == member.candidate);
    set.members.len() == than.members.len() + 1 && than.members.iter().all(has)
}

/// The names that an answer shares with all that are as good, if that is a part of it: they stand
/// whichever is right.
pub(crate) fn shared(
    search: &Search<'_>,
    naming: &Naming,
    close: &[&Scored],
) -> Option<Vec<Member>> {
    let own = &naming.found.best.members;
    let has = |set: &Scored, member: &Member| {
        set.members.iter().any(|other| other.candidate == member.candidate)
    };
    let kept: Vec<usize> =
        (0..own.len()).filter(|i| close.iter().all(|set| has(set, &own[*i]))).collect();
    let stands = |i: usize| search.stands_out(&naming.found.best, i, &naming.deviations) >= STANDS;
    let some = !kept.is_empty() && kept.len() < own.len();
    // Which rotors are weak is one answer, and a part of it is another one.
    let is_one = search.catalogue.is_of_one_machine;
    (some && !is_one && kept.iter().all(|i| stands(*i)))
        .then(|| kept.iter().map(|i| own[*i].clone()).collect())
}

/// The one answer.
///
/// * `close` - other names that are as good, of [`close`]
/// * `open` - sets that the flights do not tell apart, of which the answer is what they share
#[allow(clippy::too_many_arguments, reason = "everything that was found out comes together here")]
pub(crate) fn decide(
    search: &Search<'_>,
    naming: &Naming,
    rivals: &[Scored],
    close: &[&Scored],
    gap: Option<Gap>,
    places: Vec<Place>,
    open: Vec<Alternative>,
    curve_hides_sag: bool,
) -> Verdict {
    let found = &naming.found;
    let effects = named(search, naming);
    let leftover = &naming.leftover;
    let mut blind = search.blind(&found.best);
    if curve_hides_sag
        && !blind.contains(&BatterySag::<f64>::NAME)
        && effects.iter().all(|e| e.name != BatterySag::<f64>::NAME)
    {
        blind.push(BatterySag::<f64>::NAME);
    }
    let share = left_share(naming);
    // What explains some flights and makes others worse is no name for what the vehicle lacks.
    let fails = gap.as_ref().is_some_and(|gap| gap.after > (1.0 + HELD_OUT_NOISE) * gap.before);
    let is_named_alone = close.is_empty() && !effects.is_empty();
    let is_refuted = fails || is_named_alone && gap.as_ref().is_some_and(stays);
    // Air whose speed nobody measured leaves something, and it is no other form of a name.
    let has_motion = search.predictor.has_motion();
    let kind = if effects.is_empty() {
        match (leftover.is_real(), blind.is_empty()) {
            (true, _) if has_motion || blind.is_empty() => Kind::OutsideCatalogue,
            (false, true) => Kind::None,
            _ => Kind::NotIdentifiable,
        }
    } else if !open.is_empty() {
        if fails { Kind::OutsideCatalogue } else { Kind::NamedIncomplete }
    } else if leftover.is_real() {
        let shrinks = gap.as_ref().is_none_or(|gap| gap.removed_fraction > FORM_REMOVED);
        if naming.stands && close.is_empty() {
            let is_other = gap.as_ref().is_some_and(another_shrinks_it);
            if is_other { Kind::OutsideCatalogue } else { Kind::NamedIncomplete }
        } else if share < FORM_SHARE
            && !leftover.is_foreign()
            && search.is_plausible(&found.best)
            && shrinks
        {
            match (has_motion, close.is_empty()) {
                (true, _) => Kind::NamedFormDiffers,
                (false, true) => Kind::NamedIncomplete,
                (false, false) => Kind::Ambiguous,
            }
        } else if naming.stands {
            Kind::Ambiguous
        } else {
            Kind::OutsideCatalogue
        }
    } else if close.len() > ALTERNATIVES_MAX {
        Kind::NotIdentifiable
    } else if close.is_empty() && is_refuted {
        // Held-out flights want the names, and lack something else beside them.
        if naming.stands && !fails { Kind::NamedIncomplete } else { Kind::OutsideCatalogue }
    } else if close.is_empty() {
        Kind::Named
    } else {
        Kind::Ambiguous
    };
    let is_named = matches!(kind, Kind::Named | Kind::NamedIncomplete | Kind::NamedFormDiffers);
    let mut moved = search.moved(&found.best);
    moved.retain(|number| !effects.is_empty() || number.far() >= UNNAMED);
    let kind = match (is_named && is_doubtful(search, naming, &moved), rivals.is_empty()) {
        (false, _) => kind,
        (true, true) => Kind::OutsideCatalogue,
        (true, false) => Kind::Ambiguous,
    };
    let is_open = !open.is_empty();
    let mut alternatives =
        if is_open { open } else { alternatives(search, naming, rivals.iter().take(SHOWN)) };
    if curve_hides_sag && effects.is_empty() {
        let single = search
            .single_evidence(found)
            .into_iter()
            .find(|(name, _)| *name == BatterySag::<f64>::NAME);
        let evidence_nats = single.map_or(0.0, |(_, nats)| nats);
        alternatives.push(Alternative {
            effects: vec![BatterySag::<f64>::NAME],
            evidence_nats,
            numbers: Vec::new(),
        });
    }
    // Of what lasts nothing is said beyond the names.
    let left = (!leftover.bands.is_empty()).then(|| Left::of(leftover));
    let goes_with = if leftover.is_real() {
        Some(leftover.goes_with().unwrap_or_else(|| leftover.channels()))
    } else {
        is_refuted.then(|| "the flight, since the held-out ones lack something else".to_owned())
    };
    let goes_with = goes_with.filter(|_| kind != Kind::Named);
    let fly_next = match kind {
        Kind::NamedIncomplete if is_open => {
            Some(words::fly_for(&names_beside(&effects, &alternatives)))
        }
        Kind::NotIdentifiable if effects.is_empty() && leftover.is_real() => {
            Some("the same with attitude and velocity in the log".to_owned())
        }
        Kind::NotIdentifiable if effects.is_empty() => Some(words::fly_for(&blind)),
        Kind::Ambiguous | Kind::NotIdentifiable => {
            let mut all: Vec<&str> = effects.iter().map(|e| e.name).collect();
            all.extend(close.iter().flat_map(|set| names(search, set)));
            Some(words::fly_for(&all))
        }
        _ => None,
    };
    let mut verdict = Verdict {
        verdict: kind,
        effects,
        moved,
        alternatives,
        places,
        goes_with,
        fly_next,
        gap,
        leftover: left,
        closed_loop: Vec::new(),
        model_patch: None,
        baseline: search
            .catalogue
            .is_of_one_machine
            .then(|| Since { flights: Vec::new(), rotors: search.rotors(&naming.found.null) }),
        words: String::new(),
        set_aside: Vec::new(),
        notes: search.predictor.notes.clone(),
    };
    verdict.words = words::paragraph(&verdict, &blind, curve_hides_sag);
    verdict
}

/// Whether names change next to nothing of a gap on held-out flights, which then lack something
/// else.
pub(crate) fn stays(gap: &Gap) -> bool {
    gap.before > IS_GAP && gap.removed_fraction < HARDLY_REMOVED
}

/// Whether names change next to nothing of a gap on held-out flights, of which another explanation
/// removes far more: what holds on the flights that it was fitted to alone is no answer.
fn another_shrinks_it(gap: &Gap) -> bool {
    let rival = gap.best_rival_removed_fraction.unwrap_or(0.0);
    stays(gap) && rival > gap.removed_fraction.max(0.0) + RIVAL_REMOVES
}

/// Tolerances by which a number of the file cannot be off: what moves it so far is something else.
/// In 64 generated cases, 63 of them answered rightly, it is 4.5 at most; beside wrong names in flights
/// of another simulator 8 to 18.
const TOO_FAR: f64 = 6.0;

/// Whether a name is forced into the end of its range or past what is plausible of one side of a
/// ratio, or its number is hardly another one than the vehicle file has it, or a number of the file
/// would be where it cannot be: no answer without a doubt.
///
/// * `moved` - of [`Search::moved`], the farthest first
fn is_doubtful(search: &Search<'_>, naming: &Naming, moved: &[Moved]) -> bool {
    let is_forced = |member| search.is_at_its_end(member) || search.is_far_side(member);
    naming.found.best.members.iter().any(is_forced)
        || search.least_clear(naming).is_some()
        || moved.first().is_some_and(|number| number.far() > TOO_FAR)
}

/// Part of what the vehicle as it was leaves, above noise, that the explanation leaves, too, in the
/// channels that it explains; 1 where it explains none. What stands out in other channels is
/// another thing.
fn left_share(naming: &Naming) -> f64 {
    let excess = |slow: f64, floor: f64| (slow.powi(2) / floor.powi(2) - 1.0).max(0.0);
    let (mut before, mut after) = (0.0, 0.0);
    for band in &naming.leftover.bands {
        let was = excess(band.slow_nominal, band.slow_floor);
        let is = excess(band.slow, band.slow_floor);
        if is < EXPLAINED * was && was > 1.0 {
            before += was;
            after += is;
        }
    }
    if before > 0.0 { after / before } else { 1.0 }
}

/// Part of its excess that a channel may keep and still be explained.
const EXPLAINED: f64 = 0.5;

/// The members of the explanation as the verdict writes them, the most certain first.
fn named(search: &Search<'_>, naming: &Naming) -> Vec<NamedEffect> {
    let found = &naming.found;
    let mut all: Vec<NamedEffect> = found
        .best
        .members
        .iter()
        .enumerate()
        .map(|(index, member)| NamedEffect {
            name: search.effect(member),
            form: search.form(member),
            evidence_nats: found.worth(index),
            parameters: parameters(search, &found.best, &naming.deviations, index, member),
        })
        .collect();
    if let Some(sigma) = naming.gust_m_s {
        let number = Value::Number { value: sigma, low: 0.8 * sigma, high: 1.25 * sigma };
        all.push(NamedEffect {
            name: Gust::<f64>::NAME,
            form: forms(Gust::<f64>::PARAMETERS)[0],
            evidence_nats: naming.gust_nats,
            parameters: BTreeMap::from([(Gust::<f64>::PARAMETERS[0].key, number)]),
        });
    }
    all.sort_by(|a, b| b.evidence_nats.total_cmp(&a.evidence_nats));
    all
}

fn parameters(
    search: &Search<'_>,
    set: &Scored,
    deviations: &[f64],
    index: usize,
    member: &Member,
) -> BTreeMap<&'static str, Value> {
    let list = Effects::<f64>::parameters(search.effect(member)).unwrap_or_default();
    let form = search.form(member);
    let free = &set.free;
    list.iter()
        .enumerate()
        .filter(|(_, p)| p.key != squirrel_core::effects::FORM && p.exists_in(form))
        .map(|(slot, parameter)| {
            let value = member.values[slot];
            let value = match parameter.kind {
                ParameterKind::OneOf(names) => {
                    let value = names[value as usize];
                    Value::Choice { value, low: value, high: value }
                }
                ParameterKind::Rotor => Value::Number { value, low: value, high: value },
                ParameterKind::Size { .. } => {
                    let column = free.iter().position(|f| *f == (index, slot));
                    let sd = column.map_or(0.0, |column| deviations[column]);
                    Value::Number { value, low: value - INTERVAL * sd, high: value + INTERVAL * sd }
                }
            };
            (parameter.key, value)
        })
        .collect()
}

/// The members of another set, as a vehicle file would take them.
fn numbers(search: &Search<'_>, set: &Scored) -> Vec<NamedEffect> {
    let offset = set.free.len();
    let deviations: Vec<f64> =
        (0..offset).map(|column| set.posterior.variance(column).sqrt()).collect();
    let members = set.members.iter().enumerate();
    members
        .map(|(index, member)| NamedEffect {
            name: search.effect(member),
            form: search.form(member),
            evidence_nats: f64::NAN,
            parameters: parameters(search, set, &deviations, index, member),
        })
        .collect()
}

fn names(search: &Search<'_>, set: &Scored) -> Vec<&'static str> {
    set.members.iter().map(|member| search.effect(member)).collect()
}

/// Sets as the verdict writes them.
pub(crate) fn alternatives<'a>(
    search: &Search<'_>,
    naming: &Naming,
    sets: impl Iterator<Item = &'a Scored>,
) -> Vec<Alternative> {
    let nats = |set: &Scored| set.log_evidence - naming.found.null.log_evidence;
    sets.map(|set| Alternative {
        effects: names(search, set),
        evidence_nats: nats(set),
        numbers: numbers(search, set),
    })
    .collect()
}

/// Names of alternatives that an answer does not have.
fn names_beside(effects: &[NamedEffect], alternatives: &[Alternative]) -> Vec<&'static str> {
    let mut all: Vec<&'static str> = Vec::new();
    for name in alternatives.iter().flat_map(|set| set.effects.iter().copied()) {
        if !all.contains(&name) && effects.iter().all(|effect| effect.name != name) {
            all.push(name);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_held_out_flights_want_no_more_than_others_are_no_answer() {
        let other = |before: f64, removed_fraction: f64, rival: Option<f64>| {
            another_shrinks_it(&Gap {
                held_out_flights: Vec::new(),
                before,
                after: before,
                best_rival: None,
                removed_fraction,
                best_rival_removed_fraction: rival,
            })
        };
        // An arm that flexes, and thrust that is lost in descent.
        assert!(other(13_693.0, -0.001, Some(0.66)) && other(651.0, 0.028, Some(0.66)));
        assert!(
            !other(651.0, 0.028, Some(0.1)) && !other(651.0, 0.028, None),
            "nobody does better"
        );
        assert!(!other(651.0, 0.4, Some(0.9)), "it shrinks");
        assert!(!other(1.5, 0.0, Some(1.0)), "there is hardly a gap");
    }
}
