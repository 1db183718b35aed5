//! Delays and lags of commands beside a controller that feeds its gyroscope back: each must help to
//! foretell what the gyroscope reads next (`predictor/innovations.rs`), not only to explain what it
//! has read.

use super::Naming;
use super::search::{NATS_MIN, Search};
use crate::GapError;
use crate::predictor::DYNAMIC;
use squirrel_core::effects::{Response, Shown};

impl Search<'_> {
    /// The delay or lag of commands that foretells least, if that is too little to be told. Where
    /// moments take no part, none was named from them.
    ///
    /// # Errors
    /// What the predictor says.
    pub(super) fn least_foretold(&self, naming: &Naming) -> Result<Option<usize>, GapError> {
        let (predictor, found) = (self.predictor, &naming.found);
        let delays_commands = |i: &usize| {
            let profile = self.profile(&found.best.members[*i]);
            profile.response == Response::Bends && profile.shown == Shown::COMMANDS
        };
        let asked: Vec<usize> = (0..found.best.members.len()).filter(delays_commands).collect();
        if asked.is_empty() || !(3..DYNAMIC).any(|channel| predictor.has_all_of(channel)) {
            return Ok(None);
        }
        let of = |set| predictor.innovations(&self.hypothesis(&self.whole(set))?);
        let Some(with) = of(&found.best)? else { return Ok(None) };
        let mut least: Option<(f64, usize)> = None;
        for index in asked {
            let Some(without) = of(&found.without[index])? else { continue };
            let nats = without.behind(&with);
            if nats < NATS_MIN && least.is_none_or(|(worst, _)| nats < worst) {
                least = Some((nats, index));
            }
        }
        Ok(least.map(|(_, index)| index))
    }
}
