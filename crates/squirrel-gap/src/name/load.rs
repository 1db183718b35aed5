//! What was taped to a machine or hung from it: one thing with two names, its mass and where it
//! pulls the centre of mass.
//!
//! ```text
//! r = d (1 + f) / f      f  added mass over the vehicle's, d  shift of the centre of mass, r  where the load is
//! ```
//! A rotor that lost thrust and a load near it ask the same of roll and pitch; the load lets yaw be
//! and adds weight. Each of its two numbers may be too small for a name by itself, so that no
//! search by single effects meets it.

use super::INTERVAL;
use super::evidence::BETA;
use super::point::Member;
use super::refine::Scored;
use super::search::{Found, Search};
use crate::GapError;
use squirrel_core::effects::{CgOffset, Effect, MassError};

const MASS: &str = MassError::<f64>::NAME;
const CENTRE: &str = CgOffset::<f64>::NAME;

impl Search<'_> {
    /// A load in place of what was found, if these flights allow one that is within the vehicle's
    /// outline.
    ///
    /// # Errors
    /// What the predictor says.
    pub(super) fn load(&self, found: &Found) -> Result<Option<Scored>, GapError> {
        let catalogue = self.catalogue;
        let one = |effect: &str| catalogue.candidates.iter().position(|c| c.effect == effect);
        let (true, Some(mass), Some(centre)) =
            (catalogue.is_of_one_machine, one(MASS), one(CENTRE))
        else {
            return Ok(None);
        };
        let offset = found.null.free.len();
        let own = || [mass, centre].into_iter();
        let mut prior = found.null.prior.clone();
        for p in own().flat_map(|c| &catalogue.candidates[c].parameters) {
            prior[offset + p] = catalogue.parameters[*p].slab;
        }
        let Some(posterior) = found.null.gram.posterior(&prior, BETA) else { return Ok(None) };
        let start = |candidate: usize| {
            let mut member = catalogue.absent(self.predictor, candidate);
            for p in &catalogue.candidates[candidate].parameters {
                let parameter = &catalogue.parameters[*p];
                let value = &mut member.values[parameter.slot];
                *value += parameter.bounded(*value, posterior.mean[offset + p]);
            }
            member
        };
        let scored = self.score(&found.linear, &own().map(start).collect::<Vec<Member>>())?;
        Ok(self.is_a_load(&scored).then_some(scored))
    }

    /// Whether more mass, as far as the flights tell it, sits inside the outline of the vehicle.
    fn is_a_load(&self, set: &Scored) -> bool {
        let (mut most, mut square) = (0.0, 0.0);
        for (column, (member, slot)) in set.free.iter().enumerate() {
            let before =
                self.catalogue.absent(self.predictor, set.members[*member].candidate).values[*slot];
            let change = set.members[*member].values[*slot] - before;
            if self.effect(&set.members[*member]) == MASS {
                most = change + INTERVAL * set.posterior.variance(column).sqrt();
            } else {
                square += change * change;
            }
        }
        let [x, y, _] = self.predictor.vehicle.size_body_m;
        let reach_m = 0.5 * f64::hypot(x, y);
        most > 0.0 && f64::sqrt(square) * (1.0 + most) <= reach_m * most
    }
}
