//! Explanations of flights in gusts: what is left of the horizontal force is the wind's where gusts
//! of a plausible strength would leave it, in all that they act on and in nothing else.

use super::search::Search;
use super::{Naming, judge, slack};
use crate::GapError;
use crate::leftover::{Leftover, gusts, leftover, noise};
use crate::predictor::TURBULENCE_M_S;

/// Smallest and largest deviation that is called a gust, m/s; what asks for more is no gust.
pub(super) const GUST_M_S: (f64, f64) = (0.4, 3.2);

/// How far above their mean the gusts of one flight may be.
const GUST_SCATTER: f64 = 2.0;

/// Part of the power of gusts, in a force that they act on, that those of one flight leave at least:
/// of 24 flights one eighth.
const LULL: f64 = 0.08;

/// How many times the calm noise the noise of a channel must be for gusts to act on it.
pub(super) const GUST_SHARE: f64 = 2.0;

/// Independent blocks that a flight counts for in the evidence of gusts: they last longer than a
/// block.
const SLOW_BLOCKS: f64 = 20.0;

/// Finds the best explanation.
///
/// # Errors
/// What the predictor says.
pub(super) fn explain(search: &Search<'_>) -> Result<Naming, GapError> {
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
    // Folded wings hardly feel a gust: what is as large with them as with spread ones is none. And
    // where gusts act, something is left: spread wings feel one that blows up or down.
    let is_still = |channel: usize| {
        let noise = calm.power(channel, |band| band.slow_floor);
        let of_gusts = left.power(channel, |band| band.slow_floor) - noise;
        left.power(channel, |band| band.slow) - noise < LULL * of_gusts
    };
    if left.between_gusts >= GUST_SCATTER || (0..3).any(|c| blown_on(c) && is_still(c)) {
        return Ok(None);
    }
    left.excess.clear();
    again.gust_m_s = Some(sigma);
    again.gust_nats = gust_nats(&calm);
    again.leftover = left;
    Ok(Some(again))
}

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
    let about = &naming.hypothesis;
    let wind = predictor.wind_columns(about)?;
    let (draws, gusts) = (noise(predictor, &wind, sigma), gusts(predictor, &wind, sizes));
    let slack = slack(search, &naming.found);
    Ok(leftover(predictor, about, &naming.left, &naming.nominal, &draws, Some(&gusts), slack))
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
