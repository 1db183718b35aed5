//! Which effect is missing: evidence under declared tolerances, every hypothesis flown by the
//! simulator's own model.
//!
//! 1. The predictor is linearised in every number of the catalogue ([`linear`]), whitened
//!    ([`whiten`]), and everything floats inside its tolerance ([`parameters`], [`tolerance`],
//!    [`point`], [`evidence`]).
//! 2. Sets of effects grow, shrink and swap by evidence ([`search`]); each is refined through the
//!    simulator ([`refine`]), in each of its published forms ([`forms`]).
//! 3. What is left is held against what noise leaves ([`crate::leftover`]); intervals come from
//!    blocks ([`interval`]).

mod column;
mod day;
mod evidence;
mod factor;
mod forms;
mod interval;
mod linear;
mod load;
mod moved;
mod parameters;
mod payload;
mod point;
mod refine;
mod rivals;
mod rotors;
mod search;
mod showable;
mod slow;
mod step;
mod tolerance;
mod whiten;

pub(crate) use day::explain_flights;
pub(crate) use evidence::BETA;
pub(crate) use linear::settle_flights;
pub(crate) use parameters::Catalogue;
use payload::payload_lengths_m;
pub(crate) use point::{Member, Point, Scatter, hypothesis};
pub(crate) use refine::Scored;
pub(crate) use search::{Found, NATS_MIN, Search};
pub(crate) use showable::{Showable, air_hides_names, gust_sizes};
use step::clock_step_s;
use tolerance::unlogged_sag;
pub(crate) use tolerance::{notes as silent_tolerances, sds};

use crate::GapError;
use crate::leftover::{Leftover, Slack, gusts, leftover, noise};
pub(crate) use crate::predictor::TURBULENCE_M_S;
use crate::predictor::{Hypothesis, Motion, Predictor};
use crate::verdict::Left;
use squirrel_core::effects::Timing;
use std::rc::Rc;

pub(crate) const BEHIND_NATS: f64 = 3.0;
/// 95 % of a normal distribution lies within this many standard deviations.
pub(crate) const INTERVAL: f64 = 1.96;

/// What held-out flights say of a name.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Held {
    /// They are predicted better with it.
    pub(crate) better: bool,
    /// By so much in evidence, nats; below 0 where they speak against it.
    pub(crate) nats: f64,
}

/// The best explanation of a set of flights, and what it leaves.
pub(crate) struct Naming {
    pub(crate) found: Found,
    /// The hypothesis at which the explanation is best, everything else inside its tolerance.
    pub(crate) hypothesis: Hypothesis,
    /// Rows of the residual: of the vehicle as it is with everything else where it most likely is,
    /// and of the explanation.
    pub(crate) nominal: Vec<f64>,
    pub(crate) left: Vec<f64>,
    pub(crate) leftover: Leftover,
    /// Standard deviations of the free numbers.
    pub(crate) deviations: Vec<f64>,
    /// Deviation of gusts, m/s, where there are any.
    pub(crate) gust_m_s: Option<f64>,
    /// What they are worth, nats.
    pub(crate) gust_nats: f64,
    /// Whether its names stand although something is left: each leads by far, and held-out flights
    /// want it.
    pub(crate) stands: bool,
}

/// Everything that can be named on the vehicle of some flights.
///
/// * `nominal` - residual of the vehicle as it is
///
/// # Errors
/// The vehicle file lacks a tolerance that is needed; what the predictor says.
pub(crate) fn catalogue(predictor: &Predictor, nominal: &[f64]) -> Result<Catalogue, GapError> {
    let lengths_m = payload_lengths_m(predictor, nominal);
    Catalogue::new(predictor, &lengths_m, clock_step_s(predictor, nominal)?)
}

/// Finds the best explanation.
///
/// # Errors
/// What the predictor says.
fn explain(search: &Search<'_>) -> Result<Naming, GapError> {
    let naming = judge(search, search.run()?)?;
    if !naming.leftover.is_real() {
        return Ok(naming);
    }
    let (least, most) = GUST_M_S;
    // What is named in calm air takes a part of the gusts, or makes more of them: the first guess
    // may be out by twice.
    let Some(guess) =
        gust_of(search, &naming)?.filter(|sigma| (0.5 * least..=2.0 * most).contains(sigma))
    else {
        return Ok(naming);
    };
    let sigma = guess.clamp(least, most);
    // Gusts look like drag or wind for a while: what is named beside them must be worth it in their
    // noise.
    let windy = Search { gust_m_s: Some(sigma), ..*search };
    let again = judge(&windy, windy.run()?)?;
    // In louder noise, in which what is slow is no noise, the flights may show a way to a name that
    // was not seen in calm air.
    let start = (naming.found.best.members.is_empty() && !again.found.best.members.is_empty())
        .then(|| search.settled(&again.found.best));
    if let Some(windy) = with_gusts(search, &windy, again)? {
        return Ok(windy);
    }
    let Some(start) = start else { return Ok(naming) };
    let found = search.run_from(start)?;
    if found.best.members.is_empty() { Ok(naming) } else { judge(search, found) }
}

/// An explanation in gusts, if gusts they are that blow: in all that they act on and in nothing
/// else, as strong as is plausible.
///
/// * `windy` - the search that has found it
fn with_gusts(
    search: &Search<'_>,
    windy: &Search<'_>,
    mut again: Naming,
) -> Result<Option<Naming>, GapError> {
    let (least, most) = GUST_M_S;
    let Some(sigma) = gust_of(windy, &again)?.filter(|sigma| (least..=most).contains(sigma)) else {
        return Ok(None);
    };
    let calm = blown(search, &again, TURBULENCE_M_S, sigma)?;
    if calm.is_foreign() || calm.is_predicted() {
        return Ok(None);
    }
    let mut left = blown(search, &again, sigma, sigma)?;
    // A flight holds few gusts: their size scatters from one to the next.
    // Where they hardly act, a leftover is not theirs.
    let blown_on = |channel: usize| {
        let floors = calm.bands.iter().zip(&left.bands).filter(|(b, _)| b.channel == channel);
        floors.map(|(calm, windy)| windy.slow_floor / calm.slow_floor).fold(f64::INFINITY, f64::min)
            >= GUST_SHARE
    };
    if left.excess.iter().any(|(channel, ratio)| *ratio >= GUST_SCATTER || !blown_on(*channel)) {
        return Ok(None);
    }
    left.excess.clear();
    again.gust_m_s = Some(sigma);
    again.gust_nats = gust_nats(&calm);
    again.leftover = left;
    Ok(Some(again))
}

/// Standard deviations, from blocks of the flights, by which a number stands out from a model that
/// misses a little everywhere.
pub(crate) const STANDS: f64 = 5.0;
/// The same where nothing is left: with less the flights do not tell a number from what the file has.
pub(crate) const CLEAR: f64 = 3.0;

/// Part of what is above noise that names explain which leave something in forces alone, or in
/// moments.
const MOST: f64 = 0.5;

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
    let naming = held(search, clear(search, slow::beside_drift(search, naming)?)?, &hold)?;
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
        let stands = (0..naming.found.best.members.len())
            .all(|index| clearness(search, &naming, holds.as_deref(), index) >= STANDS)
            && holds.as_ref().is_none_or(|holds| holds.iter().all(|held| held.better))
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

/// By how many standard deviations a name stands out: by blocks of the flights, and by those that
/// were held out, which are evidence of the same thing.
fn clearness(
    search: &Search<'_>,
    naming: &Naming,
    holds: Option<&[Held]>,
    index: usize,
) -> f64 {
    let own = search.stands_out(&naming.found.best, index, &naming.deviations);
    let nats = holds.map_or(0.0, |holds| holds[index].nats);
    (own * own + 2.0 * nats).max(0.0).sqrt()
}

/// An explanation that leaves nothing without those names whose numbers blocks of the flights do
/// not tell from what the vehicle file has, the least clear first: evidence counts rows that a model
/// misses together as if each were another proof. Nor with those that others, once their numbers
/// are right, leave less for than they had to have to join them.
///
/// # Errors
/// What the predictor says.
fn clear(search: &Search<'_>, naming: Naming) -> Result<Naming, GapError> {
    let naming = dropping(search, naming, |naming| Ok(search.least_clear(naming)))?;
    dropping(search, naming, |naming| {
        // Rotors of one machine are one thing.
        let is_one = search.catalogue.is_of_one_machine || naming.found.best.members.len() < 2;
        let worth = |i: &usize| naming.found.worth(*i);
        let all = 0..naming.found.best.members.len();
        let least = all.min_by(|a, b| worth(a).total_cmp(&worth(b)));
        Ok(least.filter(|i| !is_one && worth(i) < search::FURTHER_NATS))
    })
}

/// An explanation that leaves nothing without those names that held-out flights are predicted
/// better without and speak against more than the others spoke for them, the one worth least first.
///
/// # Errors
/// What the predictor says.
fn held(
    search: &Search<'_>,
    naming: Naming,
    hold: &impl Fn(&Naming) -> Result<Option<Vec<Held>>, GapError>,
) -> Result<Naming, GapError> {
    dropping(search, naming, |naming| {
        let members = &naming.found.best.members;
        if members.is_empty() {
            return Ok(None);
        }
        let Some(holds) = hold(naming)? else { return Ok(None) };
        let worth = |i: &usize| naming.found.worth(*i);
        let falls = (0..members.len()).filter(|i| {
            // What is clear is told with the flights that lack it, and is no accident of some.
            worth(i) < search::FURTHER_NATS
                && !holds[*i].better
                && worth(i) + holds[*i].nats < search.needed(&members[*i])
        });
        Ok(falls.min_by(|a, b| worth(a).total_cmp(&worth(b))))
    })
}

/// An explanation without the names that are pointed at, one after the other, as long as nothing is
/// left for that.
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
    while !naming.leftover.is_real() && naming.gust_m_s.is_none() {
        let Some(weakest) = weakest(&naming)? else { break };
        let mut kept = naming.found.best.members.clone();
        kept.remove(weakest);
        let fewer = only(search, &naming, &kept)?;
        if fewer.leftover.is_real() {
            break;
        }
        naming = fewer;
    }
    Ok(naming)
}

/// The same explanation with these of its names alone.
///
/// # Errors
/// What the predictor says.
pub(crate) fn only(
    search: &Search<'_>,
    naming: &Naming,
    members: &[Member],
) -> Result<Naming, GapError> {
    judge(search, search.with(&naming.found, members)?)
}

/// What floats may be off by this many tolerances before a leftover is a leftover.
const LEFTOVER_TOLERANCES: f64 = 2.0;
/// Most tolerances that anything may be off by in it.
const LEFTOVER_MOST: f64 = 6.0;

fn judge(search: &Search<'_>, found: Found) -> Result<Naming, GapError> {
    let (predictor, catalogue) = (search.predictor, search.catalogue);
    let point = search.settled(&found.best);
    let about = hypothesis(predictor, catalogue, &point)?;
    let mut left = predictor.residual(&about)?;
    let without = Point { members: Vec::new(), base: point.base.clone() };
    let nominal = predictor.residual(&hypothesis(predictor, catalogue, &without)?)?;
    // What no hypothesis has is linear alone.
    let beyond = catalogue.columns(predictor)..point.base.len();
    for (column, x) in found.linear.raw[beyond.clone()].iter().zip(&point.base[beyond]) {
        column.take_scaled_from(&mut left, *x);
    }
    // Where little is known, a looser fit of what is seen well may be a worse one of the rest.
    let loose = loosened(&found, &point, left.clone());
    let seen = Surroundings::of(search, &about)?;
    let judged = |left: &[f64]| left_over(search, &found, &seen, left, &nominal);
    let (left, leftover) = match (judged(&left), judged(&loose)) {
        (as_it_is, looser) if as_it_is.worst() < looser.worst() => (left, as_it_is),
        (_, looser) => (loose, looser),
    };
    let deviations = interval::deviations(search, &found.linear, &found.best);
    Ok(Naming {
        found,
        hypothesis: about,
        nominal,
        left,
        leftover,
        deviations,
        gust_m_s: None,
        gust_nats: 0.0,
        stands: false,
    })
}

/// How flights move under a hypothesis, and what noise and turbulence leave of them.
struct Surroundings {
    motions: Vec<Rc<Motion>>,
    draws: Vec<Vec<f64>>,
}

impl Surroundings {
    fn of(search: &Search<'_>, about: &Hypothesis) -> Result<Self, GapError> {
        let predictor = search.predictor;
        let motions =
            (0..predictor.tracks.len()).map(|piece| predictor.motion(piece, about)).collect();
        let wind = predictor.wind_columns(about)?;
        let draws = noise(predictor, &wind, search.gust_m_s.unwrap_or(TURBULENCE_M_S));
        Ok(Self { motions, draws })
    }
}

/// What an explanation leaves, against noise and turbulence.
fn left_over(
    search: &Search<'_>,
    found: &Found,
    Surroundings { motions, draws }: &Surroundings,
    left: &[f64],
    nominal: &[f64],
) -> Leftover {
    leftover(search.predictor, motions, left, nominal, draws, None, slack(search, found))
}

/// Tolerances beside the catalogue's; a named clock means that commands were logged on it, a sample
/// more or less.
fn slack(search: &Search<'_>, found: &Found) -> Slack {
    let is_of_clock = |m: &Member| {
        matches!(search.profile(m).timing, Some(Timing::ClockRate | Timing::ClockJump))
    };
    let skewed = found.best.members.iter().any(is_of_clock);
    let period_s = search.predictor.tracks.first().map_or(0.0, |t| t.period_s);
    search.catalogue.slack(if skewed { period_s } else { 0.0 }, unlogged_sag(search.predictor))
}

/// The leftover with everything that floats where it fits best inside twice its tolerance: the
/// tempered fit that names holds back, and what it holds back is no missing effect.
fn loosened(found: &Found, point: &Point, mut left: Vec<f64>) -> Vec<f64> {
    let best = &found.best;
    let k = best.free.len();
    // A leftover that asks for more than that stays one; the tighter fit then says what is left.
    let loose = [LEFTOVER_TOLERANCES, 1.0].into_iter().find_map(|times| {
        let wide: Vec<f64> = best
            .prior
            .iter()
            .enumerate()
            .map(|(i, sd)| if i < k { *sd } else { times * sd })
            .collect();
        let loose = best.gram.posterior(&wide, 1.0)?;
        let inside = (k..wide.len()).all(|i| loose.mean[i].abs() <= LEFTOVER_MOST * best.prior[i]);
        (inside || times == 1.0).then_some(loose)
    });
    let Some(loose) = loose else { return left };
    let own = best.own_raw.iter().map(|column| &**column);
    for (i, column) in own.chain(&found.linear.raw).enumerate() {
        let now = match best.free.get(i) {
            Some((member, slot)) => best.members[*member].values[*slot],
            None => point.base[i - k],
        };
        let moved = if best.prior[i] > 0.0 { loose.mean[i] - now } else { 0.0 };
        if moved != 0.0 {
            column.take_scaled_from(&mut left, moved);
        }
    }
    left
}

/// Smallest and largest deviation that is called a gust, m/s; what asks for more is no gust.
const GUST_M_S: (f64, f64) = (0.4, 3.2);

/// How far above their mean the gusts of one flight may be.
const GUST_SCATTER: f64 = 2.0;

/// How many times the calm noise the noise of a channel must be for gusts to act on it.
const GUST_SHARE: f64 = 2.0;

/// What an explanation leaves if gusts of a deviation blow.
///
/// * `sizes` - deviation of the gusts in whose units it is looked at, m/s
fn blown(
    search: &Search<'_>,
    naming: &Naming,
    sigma: f64,
    sizes: f64,
) -> Result<Leftover, GapError> {
    let predictor = search.predictor;
    let wind = predictor.wind_columns(&naming.hypothesis)?;
    let motions: Vec<_> = (0..predictor.tracks.len())
        .map(|piece| predictor.motion(piece, &naming.hypothesis))
        .collect();
    let (draws, gusts) = (noise(predictor, &wind, sigma), gusts(predictor, &wind, sizes));
    let slack = slack(search, &naming.found);
    Ok(leftover(predictor, &motions, &naming.left, &naming.nominal, &draws, Some(&gusts), slack))
}

/// The deviation of gusts that would make the leftover of the horizontal force, m/s; `None` where
/// wind makes none.
fn gust_of(search: &Search<'_>, naming: &Naming) -> Result<Option<f64>, GapError> {
    // The floor is noise and wind, squared; two floors tell them apart.
    let assumed = search.gust_m_s.unwrap_or(TURBULENCE_M_S);
    let (now, windier) = (&naming.leftover, blown(search, naming, assumed + 1.0, assumed + 1.0)?);
    let span = (assumed + 1.0).powi(2) - assumed.powi(2);
    let (mut excess, mut unit) = (0.0, 0.0);
    for (now, windier) in now.bands.iter().zip(&windier.bands).filter(|(b, _)| b.channel < 2) {
        excess += now.slow.powi(2) - now.slow_floor.powi(2);
        unit += (windier.slow_floor.powi(2) - now.slow_floor.powi(2)) / span;
    }
    let sigma = (excess / unit + assumed.powi(2)).max(0.0).sqrt();
    Ok(sigma.is_finite().then_some(sigma))
}

/// Independent blocks that a flight counts for in the evidence of gusts: they last longer than a
/// block.
const SLOW_BLOCKS: f64 = 20.0;

/// What gusts are worth: evidence of the slow horizontal force having the deviation that it has,
/// over the noise's, nats.
fn gust_nats(calm: &Leftover) -> f64 {
    calm.bands
        .iter()
        .filter(|b| b.channel < 2)
        .map(|b| {
            let ratio = (b.slow / b.slow_floor).powi(2);
            0.5 * SLOW_BLOCKS * (ratio - 1.0 - ratio.ln())
        })
        .sum()
}
