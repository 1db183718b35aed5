//! What an explanation is worth on flights that it never saw: the vehicle as it was, with the
//! names, with other names, and with each name left out.
//!
//! Every model may put the sensors and the thrust of these flights where it fits them best inside
//! their tolerances, so that what differs is the effect.

use crate::GapError;
use crate::name::{
    BETA, Held, Member, Naming, Point, Scored, Search, TURBULENCE_M_S, hypothesis, settle_flights,
};
use crate::predictor::{CHANNELS, Hypothesis, Predictor, TURNING};
use crate::shrink::{Errors12, Floor, Flown};
use crate::verdict::Gap;
use squirrel_core::effects::Declared;
use squirrel_log::FlightLog;

/// Errors on held-out flights.
#[derive(Debug)]
pub(crate) struct HeldOut {
    pub(crate) nominal: Errors12,
    /// Of the best other name and of all that the evidence hardly tells from the answer, the best
    /// first.
    pub(crate) rivals: Vec<Rival>,
    pub(crate) fitted: Errors12,
    /// What the explanation leaves if it is true, and what is left in air without gusts.
    pub(crate) floor: Floor,
    pub(crate) calm: Floor,
}

/// What held-out flights say of another name.
#[derive(Debug)]
pub(crate) struct Rival {
    pub(crate) errors: Errors12,
    /// Evidence against it, nats; below 0 where they speak for it.
    pub(crate) nats: f64,
}

/// Re-simulates the held-out flights as the vehicle was, with the explanation and with other names.
pub(crate) fn prove(
    unseen: &Predictor,
    search: &Search<'_>,
    naming: &Naming,
    others: &[Scored],
) -> Result<Option<HeldOut>, GapError> {
    let at = |members: &[Member], base: &[f64]| -> Result<_, GapError> {
        let point = settled_on(unseen, search, naming, members, base)?;
        hypothesis(unseen, search.catalogue, &point)
    };
    let whole = search.whole(&naming.found.best);
    let fitted_at = at(&whole.members, &whole.base)?;
    let flown = Flown::new(unseen, &fitted_at)?;
    let errors =
        |hypothesis: &Hypothesis| Ok::<_, GapError>(Flown::new(unseen, hypothesis)?.errors());
    let Some(fitted) = flown.errors() else { return Ok(None) };
    let Some(nominal) = errors(&at(&[], &whole.base)?)? else { return Ok(None) };
    let left = Left::of(unseen, naming, &unseen.residual(&fitted_at)?);
    let mut rivals = Vec::with_capacity(others.len());
    for rival in others {
        let hypothesis = at(&rival.members, &search.whole(rival).base)?;
        let nats = Left::of(unseen, naming, &unseen.residual(&hypothesis)?).behind(&left);
        rivals.extend(errors(&hypothesis)?.map(|errors| Rival { errors, nats }));
    }
    let calm = flown.floor(TURBULENCE_M_S);
    let floor = naming.gust_m_s.map_or_else(|| calm.clone(), |sigma| flown.floor(sigma));
    Ok(Some(HeldOut { nominal, rivals, fitted, floor, calm }))
}

/// The proof in numbers.
pub(crate) fn gap(held_out: &[(String, FlightLog)], proof: &HeldOut) -> Gap {
    // Gusts are no force that could be foreseen: with them, errors are as large as expected, and
    // without them larger.
    let before = proof.nominal.over(&proof.calm.of(&proof.fitted));
    let floor = proof.floor.of(&proof.fitted);
    let after = proof.fitted.over(&floor);
    let best_rival = proof.rivals.iter().map(|rival| rival.errors.over(&floor)).reduce(f64::min);
    let removed = |left: f64| if before > 1.0 { 1.0 - (left - 1.0) / (before - 1.0) } else { 0.0 };
    Gap {
        held_out_flights: held_out.iter().map(|(name, _)| name.clone()).collect(),
        before,
        after,
        best_rival,
        removed_fraction: removed(after),
        best_rival_removed_fraction: best_rival.map(removed),
    }
}

/// A point for flights that were not fitted. What floats inside its tolerance is shared; what
/// the sensors of other flights did is not, and is found from these.
fn settled_on(
    unseen: &Predictor,
    search: &Search<'_>,
    naming: &Naming,
    members: &[Member],
    base: &[f64],
) -> Result<Point, GapError> {
    let catalogue = search.catalogue;
    let mut base = base[..catalogue.shared_columns()].to_vec();
    base.resize(catalogue.columns(unseen), 0.0);
    let mut point = Point { members: members.to_vec(), base };
    let thrust = catalogue.tolerance_of(Declared::Thrust);
    settle_flights(unseen, catalogue, &naming.found.linear.whitener, thrust, &mut point)?;
    Ok(point)
}

/// By how much residuals must be smaller with a name for it to hold: mean over channels of the
/// logarithm of mean squares.
const HOLDS: f64 = 1e-3;

/// Part of a channel's mean square by which a name must change it by itself to be judged by it.
const ACTS: f64 = 1e-9;

/// Of each name, whether held-out flights are predicted better with it, every channel in units of
/// what the model leaves there: a model that misses a little everywhere is far above the noise of
/// some channels, and a name may act on others. Channels on which it does not act by itself have no
/// vote: sensors that are put where they fit best beside it move fixes, and say nothing of a force.
/// Not flown for a second: what is missed carries such a flight away from any name. `None` without
/// such flights.
///
/// # Errors
/// What the predictor says.
pub(crate) fn hold(
    unseen: Option<&Predictor>,
    search: &Search<'_>,
    naming: &Naming,
) -> Result<Option<Vec<Held>>, GapError> {
    let Some(unseen) = unseen else { return Ok(None) };
    // What floats is shared: without a name it would take its place.
    let whole = search.whole(&naming.found.best);
    let settled = |members: &[Member]| settled_on(unseen, search, naming, members, &whole.base);
    let residual = |point: &Point| unseen.residual(&hypothesis(unseen, search.catalogue, point)?);
    let point = settled(&whole.members)?;
    let rows = residual(&point)?;
    let left = Left::of(unseen, naming, &rows);
    let with = mean_squares(unseen, &rows);
    let mut all = Vec::with_capacity(whole.members.len());
    for out in 0..whole.members.len() {
        let mut rest = whole.members.clone();
        rest.remove(out);
        let others = residual(&settled(&rest)?)?;
        let nats = Left::of(unseen, naming, &others).behind(&left);
        let without = mean_squares(unseen, &others);
        let alone = residual(&Point { members: rest, base: point.base.clone() })?;
        let change: Vec<f64> = rows.iter().zip(&alone).map(|(with, out)| out - with).collect();
        let acts = mean_squares(unseen, &change);
        let gains: Vec<f64> = (0..CHANNELS.len())
            .filter(|channel| with[*channel] > 0.0 && acts[*channel] > ACTS * with[*channel])
            .map(|channel| (channel, (without[channel] / with[channel]).ln()))
            // A gyroscope against the attitude says nothing of most names, and is no vote against
            // them.
            .filter(|(channel, gain)| *channel < TURNING || gain.abs() > HOLDS)
            .map(|(_, gain)| gain)
            .collect();
        let better = gains.iter().sum::<f64>() > HOLDS * gains.len() as f64;
        all.push(Held { better, nats });
    }
    Ok(Some(all))
}

/// What is left of flights by channel, in units of the noise.
struct Left {
    squares: [f64; CHANNELS.len()],
    rows: [f64; CHANNELS.len()],
}

impl Left {
    fn of(unseen: &Predictor, naming: &Naming, rows: &[f64]) -> Self {
        let whitener = &naming.found.linear.whitener;
        let mut left = Self { squares: [0.0; CHANNELS.len()], rows: [0.0; CHANNELS.len()] };
        let white = whitener.apply(&unseen.segments, rows);
        for (x, (_, _, channel)) in white.iter().zip(whitener.places(&unseen.segments)) {
            left.squares[channel] += x * x;
            left.rows[channel] += 1.0;
        }
        left
    }

    /// Evidence for a better one, nats. What that leaves in a channel is the noise there: flights
    /// that no model predicts tell models apart that much less.
    fn behind(&self, better: &Self) -> f64 {
        let of = |channel: usize| {
            let noise = better.squares[channel] / better.rows[channel].max(1.0);
            (self.squares[channel] - better.squares[channel]) / noise.max(1.0)
        };
        0.5 * BETA * (0..CHANNELS.len()).map(of).sum::<f64>()
    }
}

/// Mean square of a residual by channel; 0 where it has none.
fn mean_squares(predictor: &Predictor, rows: &[f64]) -> Vec<f64> {
    let of = |channel: usize| {
        let own = predictor.segments.iter().filter(move |s| s.channel == channel);
        let own: Vec<f64> = own.flat_map(|s| &rows[s.rows.clone()]).copied().collect();
        own.iter().map(|x| x * x).sum::<f64>() / own.len().max(1) as f64
    };
    (0..CHANNELS.len()).map(of).collect()
}
