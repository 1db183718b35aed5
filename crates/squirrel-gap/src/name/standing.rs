//! Which names stand: beside a model that misses a little everywhere, in flights that were held out,
//! and clear of what the vehicle file has.

use super::elsewhere::told_elsewhere;
use super::point::Member;
use super::search::{FURTHER_NATS, Search};
use super::{Naming, only, slow};
use crate::GapError;
use crate::leftover::Leftover;
use crate::verdict::Left;
use squirrel_core::effects::Shown;

/// What held-out flights say of a name.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Held {
    /// They are predicted better with it.
    pub(crate) better: bool,
    /// By so much in evidence, nats; below 0 where they speak against it.
    pub(crate) nats: f64,
}

/// Standard deviations, from blocks of the flights, by which a number stands out from a model that
/// misses a little everywhere.
pub(crate) const STANDS: f64 = 5.0;
/// The same where nothing is left: with less the flights do not tell a number from what the file has.
pub(crate) const CLEAR: f64 = 3.0;
/// The same beside other names, whose numbers leave a little to explain where they are wrong.
pub(super) const CLEAR_BESIDE: f64 = 4.0;

/// Part of what is above noise that names explain which leave something in forces alone, or in
/// moments.
const MOST: f64 = 0.5;
/// The same of names of which none may fall for what they leave in one place.
const NEARLY_ALL: f64 = 0.9;

/// The explanation with those names alone that stand beside what the model misses everywhere, or
/// with all of them where they stand beside what is slow in each flight; as it was where what is
/// left is another thing, or nothing.
///
/// * `hold` - of each name, whether held-out flights want it; `None` where there are none
///
/// # Errors
/// What the predictor says.
pub(crate) fn standing(
    search: &Search<'_>,
    naming: Naming,
    hold: impl Fn(&Naming) -> Result<Option<Vec<Held>>, GapError>,
) -> Result<Naming, GapError> {
    let naming = clear(search, slow::beside_drift(search, naming)?)?;
    let naming = beside_leftover(search, held(search, naming, &hold)?, &hold)?;
    let is_refused = naming.leftover.is_real() && naming.gust_m_s.is_none() && !naming.stands;
    // What goes with the time of a flight or with a place is another effect, for which names stand
    // in elsewhere, too: thrust that falls as motors warm up is a smaller one to moments.
    if !is_refused || naming.leftover.is_foreign() || naming.found.best.members.is_empty() {
        return Ok(naming);
    }
    let nearly_all = Left::of(&naming.leftover).share_removed >= NEARLY_ALL;
    let keeps = |told: &Naming| told.found.best.members.len() == naming.found.best.members.len();
    let told = told_elsewhere(search, &naming, hold)?.filter(|told| !nearly_all || keeps(told));
    Ok(told.unwrap_or(naming))
}

/// As [`standing`], by the channels that are left with something.
fn beside_leftover(
    search: &Search<'_>,
    naming: Naming,
    hold: &impl Fn(&Naming) -> Result<Option<Vec<Held>>, GapError>,
) -> Result<Naming, GapError> {
    // What is left of forces alone, or of moments, may be one missing effect: names must explain
    // most of what is there.
    let most = |leftover: &Leftover| leftover.is_in_all || Left::of(leftover).share_removed >= MOST;
    let is_candidate = |naming: &Naming| {
        naming.leftover.is_everywhere
            && most(&naming.leftover)
            && !naming.leftover.is_foreign()
            && naming.gust_m_s.is_none()
            && !naming.found.best.members.is_empty()
    };
    if !is_candidate(&naming) {
        let is_refused = naming.leftover.is_real() && naming.gust_m_s.is_none();
        if !is_refused || naming.found.best.members.is_empty() {
            return Ok(naming);
        }
        let holds = hold(&naming)?;
        let stands = all_stand(search, &naming, holds.as_deref())
            && slow::leaves_nothing_else(search, &naming, holds.as_deref())?;
        return Ok(Naming { stands, ..naming });
    }
    let mut kept: Vec<Member> = naming.found.best.members.clone();
    let mut now = None;
    loop {
        let at = now.as_ref().unwrap_or(&naming);
        let holds = hold(at)?;
        let clear = |index: usize| clearness(search, at, holds.as_deref(), index);
        let falls = |index: &usize| {
            holds.as_ref().is_some_and(|holds| !holds[*index].better) || clear(*index) < STANDS
        };
        // One at a time, the least clear first: what falls may have stood in for what stands.
        let weakest = (0..kept.len()).filter(falls).min_by(|a, b| clear(*a).total_cmp(&clear(*b)));
        let Some(weakest) = weakest else { break };
        kept.remove(weakest);
        if kept.is_empty() {
            return Ok(naming);
        }
        let fewer = only(search, at, &kept)?;
        kept.clone_from(&fewer.found.best.members);
        if !is_candidate(&fewer) {
            return Ok(naming);
        }
        now = Some(fewer);
    }
    Ok(Naming { stands: true, ..now.unwrap_or(naming) })
}

/// Whether names stand that explain what they were fitted to and hardly shrink a gap on held-out
/// flights, which lack something else then: those flights are predicted better with each of them.
///
/// * `hold` - of [`standing`]; asked only of names that may stand
///
/// # Errors
/// What the predictor says.
pub(crate) fn stands_beside_a_gap(
    search: &Search<'_>,
    naming: &Naming,
    hold: impl Fn(&Naming) -> Result<Option<Vec<Held>>, GapError>,
) -> Result<bool, GapError> {
    // What is quick may be noise that a controller fed back, in every flight.
    let lasts = |member| search.profile(member).shown.has(Shown::LASTING);
    let members = &naming.found.best.members;
    let may_stand = naming.gust_m_s.is_none() && !members.is_empty() && members.iter().all(lasts);
    Ok(may_stand && all_stand(search, naming, hold(naming)?.as_deref()))
}

/// Whether every name is clear, and held-out flights, where there are any, want it.
pub(super) fn all_stand(search: &Search<'_>, naming: &Naming, holds: Option<&[Held]>) -> bool {
    holds.is_none_or(|holds| holds.iter().all(|held| held.better))
        && (0..naming.found.best.members.len())
            .all(|index| clearness(search, naming, holds, index) >= STANDS)
}

/// By how many standard deviations a name stands out: by blocks of the flights, and by those that
/// were held out, which are evidence of the same thing.
fn clearness(search: &Search<'_>, naming: &Naming, holds: Option<&[Held]>, index: usize) -> f64 {
    let own = search.stands_out(&naming.found.best, index, &naming.deviations);
    let nats = holds.map_or(0.0, |holds| holds[index].nats);
    (own * own + 2.0 * nats).max(0.0).sqrt()
}

/// An explanation that leaves nothing without those names whose numbers blocks of the flights do
/// not tell from what the vehicle file has, the least clear first: evidence counts rows that a model
/// misses together as if each were another proof.
///
/// # Errors
/// What the predictor says.
fn clear(search: &Search<'_>, naming: Naming) -> Result<Naming, GapError> {
    dropping(search, naming, |naming| {
        if naming.leftover.is_real() {
            return Ok(None);
        }
        Ok(search.least_clear(naming))
    })
}

/// An explanation without those names that held-out flights are predicted better without and speak
/// against more than the others spoke for them, the one worth least first. Where something is left,
/// the last one stays.
///
/// # Errors
/// What the predictor and `hold` say.
fn held(
    search: &Search<'_>,
    naming: Naming,
    hold: &impl Fn(&Naming) -> Result<Option<Vec<Held>>, GapError>,
) -> Result<Naming, GapError> {
    dropping(search, naming, |naming| {
        let members = &naming.found.best.members;
        let is_left = naming.leftover.is_real();
        if members.len() <= usize::from(is_left) {
            return Ok(None);
        }
        let Some(holds) = hold(naming)? else { return Ok(None) };
        let worth = |i: &usize| naming.found.worth(*i);
        let falls = (0..members.len()).filter(|i| {
            // What is clear is told with the flights that lack it, and is no accident of some; but
            // beside something that nobody knows nothing is.
            (is_left || worth(i) < FURTHER_NATS)
                && !holds[*i].better
                && worth(i) + holds[*i].nats < search.needed(&members[*i])
        });
        Ok(falls.min_by(|a, b| worth(a).total_cmp(&worth(b))))
    })
}

/// An explanation without the names that are pointed at, one after the other, as long as no other
/// channel is left with something, or what is left most shrinks.
///
/// * `weakest` - which of the members falls next, if any
///
/// # Errors
/// What the predictor and `weakest` say.
fn dropping(
    search: &Search<'_>,
    mut naming: Naming,
    weakest: impl Fn(&Naming) -> Result<Option<usize>, GapError>,
) -> Result<Naming, GapError> {
    while naming.gust_m_s.is_none() {
        let Some(weakest) = weakest(&naming)? else { break };
        let mut kept = naming.found.best.members.clone();
        kept.remove(weakest);
        let fewer = only(search, &naming, &kept)?;
        let stood_out = |(channel, _): &(usize, f64)| {
            naming.leftover.excess.iter().any(|(other, _)| other == channel)
        };
        let is_less = fewer.leftover.worst() < naming.leftover.worst();
        if !is_less && !fewer.leftover.excess.iter().all(stood_out) {
            break;
        }
        naming = fewer;
    }
    Ok(naming)
}
