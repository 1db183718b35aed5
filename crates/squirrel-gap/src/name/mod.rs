//! Which effect is missing: evidence under declared tolerances, every hypothesis flown by the
//! simulator's own model.
//!
//! 1. The predictor is linearised in every number of the catalogue ([`linear`]), whitened
//!    ([`whiten`]), and everything floats inside its tolerance ([`parameters`], [`tolerance`],
//!    [`point`], [`evidence`]).
//! 2. Sets of effects grow, shrink and swap by evidence ([`search`]); each is refined through the
//!    simulator ([`refine`]), in each of its published forms ([`forms`]).
//!    What is left of calm air may be gusts ([`gusts`]); flights may differ in thrust ([`day`]), drag
//!    may act elsewhere ([`drag_centre`]), and what does not foretell what comes next is no longer
//!    looked for ([`ahead`]).
//! 3. What is left is held against what noise leaves ([`crate::leftover`]); intervals come from
//!    blocks ([`interval`]). Names stand or fall by both and by held-out flights ([`standing`]).

mod ahead;
mod column;
mod day;
mod drag_centre;
mod elsewhere;
mod evidence;
mod factor;
mod forms;
mod gusts;
mod interval;
mod linear;
mod load;
mod moved;
mod off;
mod parameters;
mod payload;
mod point;
mod ranked;
mod refine;
mod rivals;
mod rotors;
mod search;
mod showable;
mod slow;
mod standing;
mod step;
mod tolerance;
mod whiten;

pub(crate) use ahead::explain_flights;
pub(crate) use evidence::BETA;
pub(crate) use linear::settle_flights;
pub(crate) use parameters::Catalogue;
use payload::payload_lengths_m;
pub(crate) use point::{Member, Point, Scatter, hypothesis};
pub(crate) use refine::Scored;
pub(crate) use search::{Found, NATS_MIN, Search};
pub(crate) use showable::{Showable, air_hides_names, gust_sizes};
pub(crate) use standing::{CLEAR, Held, STANDS, standing, stands_beside_a_gap};
use step::clock_step_s;
use tolerance::unlogged_sag;
pub(crate) use tolerance::{notes as silent_tolerances, sds};

use crate::GapError;
use crate::leftover::{Leftover, Slack, leftover, noise};
pub(crate) use crate::predictor::TURBULENCE_M_S;
use crate::predictor::{FORCE_Z, Hypothesis, Predictor};
use squirrel_core::effects::Timing;

pub(crate) const BEHIND_NATS: f64 = 3.0;
/// 95 % of a normal distribution lies within this many standard deviations.
pub(crate) const INTERVAL: f64 = 1.96;

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
    let wind = predictor.wind_columns(&about)?;
    let draws = noise(predictor, &wind, search.gust_m_s.unwrap_or(TURBULENCE_M_S));
    let slack = slack(search, &found);
    let judged = |left: &[f64]| leftover(predictor, &about, left, &nominal, &draws, None, slack);
    // In gusts forces are theirs; what they hardly act on is held against an explanation.
    let from = if search.gust_m_s.is_some() { FORCE_Z + 1 } else { 0 };
    let (left, leftover) = match (judged(&left), judged(&loose)) {
        (as_it_is, looser) if as_it_is.worst_from(from) < looser.worst_from(from) => {
            (left, as_it_is)
        }
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
