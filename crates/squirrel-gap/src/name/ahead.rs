//! Delays, lags and clocks of commands beside a controller that feeds its gyroscope back: each must
//! help to foretell what the gyroscope reads next (`predictor/innovations.rs`), not only to explain
//! what it has read. One that does not is noise of the gyroscope in the commands, and hides what
//! else is missing: it is no longer looked for.

use super::drag_centre::explain_wherever;
use super::refine::Scored;
use super::search::{NATS_MIN, Search};
use super::{Catalogue, Naming};
use crate::GapError;
use crate::predictor::{DYNAMIC, Hypothesis, Predictor};
use squirrel_core::effects::Shown;

/// The best explanation, of effects that help to foretell what comes next.
///
/// * `progress` - called after each piece of work
///
/// # Errors
/// What the predictor says.
pub(crate) fn explain_flights(
    predictor: &Predictor<'_>,
    catalogue: &mut Catalogue,
    progress: &dyn Fn(),
) -> Result<Naming, GapError> {
    loop {
        let naming = explain_wherever(predictor, catalogue, progress)?;
        let search = Search { predictor, catalogue, gust_m_s: None, progress };
        let Some(worst) = search.least_foretold(&naming)? else { return Ok(naming) };
        catalogue.unforetold.push(worst);
    }
}

impl Search<'_> {
    /// The effect on commands that foretells least, if that is too little to be told.
    ///
    /// # Errors
    /// What the predictor says.
    fn least_foretold(&self, naming: &Naming) -> Result<Option<&'static str>, GapError> {
        if naming.gust_m_s.is_some() {
            return Ok(None);
        }
        let found = &naming.found;
        let mut least: Option<(f64, usize)> = None;
        for index in 0..found.best.members.len() {
            if let Some(nats) = self.foretells(&found.best, index, &found.without[index])?
                && nats < NATS_MIN
                && least.is_none_or(|(worst, _)| nats < worst)
            {
                least = Some((nats, index));
            }
        }
        Ok(least.map(|(_, index)| self.effect(&found.best.members[index])))
    }

    /// How much better the gyroscope's next reading is foretold with a member of a set, nats. `None`
    /// if it acts on more than commands, and where moments take no part: nothing was named from
    /// them then.
    ///
    /// * `without` - the set without it
    ///
    /// # Errors
    /// What the predictor says.
    pub(super) fn foretells(
        &self,
        set: &Scored,
        member: usize,
        without: &Scored,
    ) -> Result<Option<f64>, GapError> {
        let acts_on_commands = self.profile(&set.members[member]).shown == Shown::COMMANDS;
        let has_moments = (3..DYNAMIC).any(|channel| self.predictor.has_all_of(channel));
        if !acts_on_commands || !has_moments {
            return Ok(None);
        }
        let of = |hypothesis: &Hypothesis| self.predictor.innovations(hypothesis);
        // A gyroscope's delay goes after that noise, too: all are asked with sensors on time.
        let whole = |set| Ok::<_, GapError>(self.hypothesis(&self.whole(set))?.on_time());
        let Some(with) = of(&whole(set)?)? else { return Ok(None) };
        let mut least = f64::INFINITY;
        // What floats without it may have gone after the same noise: the file as it is has not.
        for other in [whole(without)?, self.predictor.nominal()] {
            if let Some(other) = of(&other)? {
                least = least.min(other.behind(&with));
            }
        }
        Ok(Some(least))
    }
}
