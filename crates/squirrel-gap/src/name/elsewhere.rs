//! Names beside a channel that the model misses: other channels tell them, and what is left there is
//! another thing.
//!
//! Models of real vehicles miss most in one place, as in moments of a frame that bends or in the
//! thrust of worn motors. A name that channels without a leftover ask for by themselves is no
//! stand-in for it, and takes its number from them alone.

use super::linear::Linear;
use super::search::{Found, Search};
use super::standing::{Held, all_stand};
use super::{Naming, judge};
use crate::GapError;
use crate::predictor::DYNAMIC;
use std::rc::Rc;

/// The explanation by the channels that are left with nothing, with those of its names that they
/// ask for; `None` where they ask for none, or more is left without the others, or held-out flights
/// do not want them.
///
/// * `hold` - of each name, whether held-out flights want it; `None` where there are none
///
/// # Errors
/// What the predictor says.
pub(super) fn told_elsewhere(
    search: &Search<'_>,
    naming: &Naming,
    hold: impl Fn(&Naming) -> Result<Option<Vec<Held>>, GapError>,
) -> Result<Option<Naming>, GapError> {
    let missed: Vec<usize> = naming.leftover.excess.iter().map(|(channel, _)| *channel).collect();
    if (0..DYNAMIC)
        .all(|channel| missed.contains(&channel) || !search.predictor.has_channel(channel))
    {
        return Ok(None);
    }
    let linear = Rc::new(Linear::without(search.predictor, &naming.found.linear, &missed));
    let mut best = search.score(&linear, &naming.found.best.members)?;
    let without = loop {
        let without = search.without(&linear, &best)?;
        let worth = |i: usize| best.log_evidence - without[i].log_evidence;
        let falls = (0..without.len()).filter(|i| worth(*i) < search.needed(&best.members[*i]));
        let Some(weakest) = falls.min_by(|a, b| worth(*a).total_cmp(&worth(*b))) else {
            break without;
        };
        let mut kept = best.members.clone();
        kept.remove(weakest);
        best = search.score(&linear, &kept)?;
    };
    if best.members.is_empty() || !search.is_off(&best) {
        return Ok(None);
    }
    search.finish(&mut best);
    let null = Rc::new(search.score(&linear, &[])?);
    let told = judge(search, Found { linear, null, best, without, beaten: None })?;
    let is_missed = |(channel, _): &(usize, f64)| missed.contains(channel);
    if !told.leftover.excess.iter().all(is_missed) {
        return Ok(None);
    }
    // Beside something that nobody knows, flights that were not fitted must want a name.
    let holds = hold(&told)?;
    let stands = holds.is_some() && all_stand(search, &told, holds.as_deref());
    Ok(stands.then_some(Naming { stands, ..told }))
}
