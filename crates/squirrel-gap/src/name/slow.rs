//! Names beside a force or moment that each flight has for itself and that changes slowly, as of a
//! pack that warms up: not whatever is left of a channel is another effect.
//!
//! ```text
//! y = X theta + Z zeta + e      Z: 1, s, (3 s^2 - 1) / 2 along each flight, s = -1 .. 1
//! ```
//! - In each channel that is left with something: a name stands if the flights ask for it beside
//!   `Z`, which takes from it whatever is as slow, and if the two together leave nothing.
//! - In the thrust of each flight, also where nothing is left: what acts at one time of a flight
//!   alone, as near the ground, can stand in for thrust that drifts, and is named if the flights
//!   ask for it beside such a drift, too.

use super::column::Column;
use super::evidence::{BETA, inner};
use super::linear::Linear;
use super::point::Member;
use super::refine::{Scored, extended};
use super::search::{Found, Search};
use super::{Held, Naming, judge, only};
use crate::GapError;
use crate::predictor::{DYNAMIC, FORCE_Z, Predictor, Segment};
use squirrel_core::effects::{BatterySag, Effect};
use std::rc::Rc;

/// Numbers of a flight and channel.
const TERMS: usize = 3;
/// How much larger than the rms of what is left each may be, one standard deviation.
const SIZE_TIMES: f64 = 2.0;
/// By how much thrust may drift from the middle of a flight to its ends, as a fraction, one
/// standard deviation: 2 % over the flight.
const DRIFT: f64 = 0.01;
/// Part of its evidence that a name must lose to such a drift to be doubted for it: what is at the
/// edge of its bar anyway falls for less.
const LOST: f64 = 0.5;

/// An explanation without those names that the flights ask for only as long as no thrust drifts:
/// all of them, where together they stand in for a drift, or else the one that loses most first,
/// since what falls may have stood in for another. Where the voltage is among the names, a drift has
/// a cause that was measured, and is no rival of it.
///
/// # Errors
/// What the predictor says.
pub(super) fn beside_drift(search: &Search<'_>, mut naming: Naming) -> Result<Naming, GapError> {
    let (drifts, sd) = drifts(search.predictor, &naming.found.linear);
    while !drifts.is_empty()
        && naming.gust_m_s.is_none()
        && let Some(kept) = kept_beside_drift(search, &naming.found, &drifts, &sd)
    {
        naming = only(search, &naming, &kept)?;
    }
    Ok(naming)
}

/// Fewer names, if flights do not ask for all of them beside drifts of thrust.
fn kept_beside_drift(
    search: &Search<'_>,
    found: &Found,
    drifts: &[Column],
    sd: &[f64],
) -> Option<Vec<Member>> {
    let members = &found.best.members;
    if members.iter().any(|member| search.effect(member) == BatterySag::<f64>::NAME) {
        return None;
    }
    let beside = |set: &Scored| log_evidence_beside(found, set, drifts, sd);
    let best = beside(&found.best)?;
    let falls = |now: f64, before: f64, needed: f64| now < needed && now < LOST * before;
    let needed: f64 = members.iter().map(|member| search.needed(member)).sum();
    let together = found.best.log_evidence - found.null.log_evidence;
    if members.len() > 1 && falls(best - beside(&found.null)?, together, needed) {
        return Some(Vec::new());
    }
    let doubted = found.without.iter().enumerate().filter_map(|(i, without)| {
        let (now, before) = (best - beside(without)?, found.worth(i));
        falls(now, before, search.needed(&members[i])).then_some((i, now - before))
    });
    let (worst, _) = doubted.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let mut kept = members.clone();
    kept.remove(worst);
    Some(kept)
}

/// Evidence of a set beside drifts of thrust, linearised where the set is, nats.
fn log_evidence_beside(found: &Found, set: &Scored, drifts: &[Column], sd: &[f64]) -> Option<f64> {
    let own = set.columns(&found.linear);
    let places: Vec<Option<usize>> =
        (0..own.len()).map(Some).chain(drifts.iter().map(|_| None)).collect();
    let all: Vec<&Column> = own.into_iter().chain(drifts).collect();
    let gram = extended(&set.gram.g, &places, &all, &set.y);
    let prior = [set.prior.as_slice(), sd].concat();
    Some(gram.posterior(&prior, BETA)?.log_evidence)
}

/// Whitened columns of thrust that drifts along each flight, as a line and as a parabola, and how
/// large each may be.
fn drifts(predictor: &Predictor<'_>, linear: &Linear) -> (Vec<Column>, Vec<f64>) {
    let mut all = Vec::new();
    for flight in 0..predictor.names.len() {
        for term in 1..TERMS {
            let thrust = |segment: &Segment, i: usize| {
                predictor.tracks[segment.piece]
                    .measured
                    .get(i * segment.mean_of)
                    .map_or(0.0, |m| m[FORCE_Z])
            };
            let column = Column::of(along(predictor, flight, FORCE_Z, term, thrust));
            all.push(linear.whitener.apply_to(&predictor.segments, &column));
        }
    }
    all.retain(|column| !column.span().is_empty());
    let sd = vec![DRIFT; all.len()];
    (all, sd)
}

/// Whether flights ask for every name of an explanation beside what is slow, and nothing else is
/// left.
///
/// * `holds` - what held-out flights say of each name
///
/// # Errors
/// What the predictor says.
pub(super) fn leaves_nothing_else(
    search: &Search<'_>,
    naming: &Naming,
    holds: Option<&[Held]>,
) -> Result<bool, GapError> {
    let linear = Rc::new(with_slow(search.predictor, naming));
    let best = search.score(&linear, &naming.found.best.members)?;
    let without = search.without(&linear, &best)?;
    let is_asked_for = |index: usize| {
        let unseen = holds.map_or(0.0, |holds| holds[index].nats);
        let worth = best.log_evidence - without[index].log_evidence + unseen;
        worth >= search.needed(&best.members[index])
    };
    if !((0..without.len()).all(is_asked_for) && search.is_off(&best)) {
        return Ok(false);
    }
    let null = Rc::clone(&naming.found.null);
    let beside = judge(search, Found { linear, null, best, without, beaten: None })?;
    Ok(!beside.leftover.is_real())
}

/// The linear model of an explanation with what is slow in the channels that are left with
/// something.
fn with_slow(predictor: &Predictor<'_>, naming: &Naming) -> Linear {
    let mut linear = (*naming.found.linear).clone();
    for (channel, _) in naming.leftover.excess.iter().filter(|(channel, _)| *channel < DYNAMIC) {
        for flight in 0..predictor.names.len() {
            for term in 0..TERMS {
                let (column, sd) = slow(predictor, flight, *channel, term, &naming.left);
                let column = Column::of(column);
                linear.columns.push(linear.whitener.apply_to(&predictor.segments, &column));
                linear.raw.push(column);
                linear.tolerance.push(sd);
                linear.point.base.push(0.0);
            }
        }
    }
    linear.gram = inner(&linear.columns.iter().collect::<Vec<_>>());
    linear
}

/// One slow term along one channel of one flight, and how large it may be, one standard deviation.
fn slow(
    predictor: &Predictor,
    flight: usize,
    channel: usize,
    term: usize,
    left: &[f64],
) -> (Vec<f64>, f64) {
    let own = predictor.segments.iter().filter(|s| s.flight == flight && s.channel == channel);
    let (sum, n) = own
        .flat_map(|segment| segment.rows.clone())
        .fold((0.0, 0.0_f64), |(sum, n), row| (sum + left[row] * left[row], n + 1.0));
    let column = along(predictor, flight, channel, term, |_, _| 1.0);
    (column, SIZE_TIMES * (sum / n.max(1.0)).sqrt())
}

/// Something along one channel of one flight that a slow term goes with.
///
/// * `of` - its size in a row of a segment
fn along(
    predictor: &Predictor<'_>,
    flight: usize,
    channel: usize,
    term: usize,
    of: impl Fn(&Segment, usize) -> f64,
) -> Vec<f64> {
    let mut column = vec![0.0; predictor.rows()];
    let own = || predictor.segments.iter().filter(|s| s.flight == flight && s.channel == channel);
    let end_s = |s: &Segment| s.t0_s + s.rows.len() as f64 * s.step_s;
    let from_s = own().map(|s| s.t0_s).fold(f64::INFINITY, f64::min);
    let until_s = own().map(end_s).fold(f64::NEG_INFINITY, f64::max);
    for segment in own() {
        for (i, row) in segment.rows.clone().enumerate() {
            let at_s = segment.t0_s + i as f64 * segment.step_s;
            let s = 2.0 * (at_s - from_s) / (until_s - from_s) - 1.0;
            let size = match term {
                0 => 1.0,
                1 => s,
                _ => 0.5 * (3.0 * s * s - 1.0),
            };
            column[row] = size * of(segment, i);
        }
    }
    column
}
