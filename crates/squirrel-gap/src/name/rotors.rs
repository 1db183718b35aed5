//! Weak rotors: several at once as one explanation, and how each is whatever has a name.

use super::evidence::BETA;
use super::linear::Linear;
use super::point::Member;
use super::refine::Scored;
use super::search::{FURTHER_NATS, Found, MEMBERS_MAX, NATS_MIN, Search, WEAK_ROTOR};
use super::{BEHIND_NATS, INTERVAL};
use crate::GapError;
use crate::verdict::{RotorHealth, Value};

impl Search<'_> {
    /// Tries two and more weak rotors at once: one after the other, each alone is less than what
    /// looks like all of them. What they were better than, if it was a set.
    pub(super) fn several_rotors(
        &self,
        linear: &Linear,
        best: &mut Scored,
    ) -> Result<Option<Vec<Member>>, GapError> {
        let Some(scored) = self.best_rotors(linear)? else { return Ok(None) };
        (self.progress)();
        let better = scored.log_evidence - self.needs(&scored.members)
            > best.log_evidence - self.needs(&best.members);
        if !better {
            return Ok(None);
        }
        let beaten = std::mem::replace(best, scored).members;
        self.extend(linear, best)?;
        Ok((!beaten.is_empty()).then_some(beaten))
    }

    /// A set with more weak rotors than were named, each of the others too little for a name and
    /// all of them twenty to one in the evidence: the flights leave open how many are weak.
    pub(super) fn more_rotors(&self, found: &Found) -> Result<Option<Scored>, GapError> {
        let own = &found.best.members;
        if own.is_empty() || own.iter().any(|member| self.effect(member) != WEAK_ROTOR) {
            return Ok(None);
        }
        let Some(scored) = self.best_rotors(&found.linear)? else { return Ok(None) };
        let has = |member: &Member| {
            scored.members.iter().any(|other| other.candidate == member.candidate)
        };
        let is_more = scored.members.len() > own.len() && own.iter().all(has);
        let is_better = scored.log_evidence >= found.best.log_evidence + BEHIND_NATS;
        Ok((is_more && is_better).then_some(scored))
    }

    /// What a set must be worth, nats. What happened to the rotors is one thing: how many of them
    /// are weak says the evidence.
    fn needs(&self, members: &[Member]) -> f64 {
        let others = members.iter().filter(|m| self.effect(m) != WEAK_ROTOR).count();
        let things = others + usize::from(others < members.len());
        NATS_MIN + FURTHER_NATS * (things.max(1) - 1) as f64
    }

    /// The best set of several weak rotors and nothing else, all of them off; `None` where the
    /// vehicle is no machine with good flights.
    fn best_rotors(&self, linear: &Linear) -> Result<Option<Scored>, GapError> {
        if !self.catalogue.is_of_one_machine {
            return Ok(None);
        }
        let none = self.score(linear, &[])?;
        let mut best: Option<Scored> = None;
        // What happened to the rotors is one thing, and so has one form.
        for floats in [true, false] {
            let weak = self.catalogue.each_of(WEAK_ROTOR, floats);
            let mut sets = Vec::new();
            for chosen in 0_u32..1 << weak.len() {
                let count = chosen.count_ones() as usize;
                if (2..=MEMBERS_MAX.min(weak.len().saturating_sub(1))).contains(&count) {
                    let own = weak.iter().enumerate().filter(|(i, _)| chosen >> i & 1 == 1);
                    let own: Vec<usize> = own.map(|(_, candidate)| *candidate).collect();
                    sets.extend(self.together(&none, &own));
                }
            }
            let Some((_, members)) = sets.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)) else {
                continue;
            };
            let scored = self.score(linear, &members)?;
            let leads = |b: &Scored| scored.log_evidence > b.log_evidence + BEHIND_NATS;
            if self.is_off(&scored) && best.as_ref().is_none_or(leads) {
                best = Some(scored);
            }
        }
        Ok(best)
    }

    /// Several candidates at once, with the linear evidence of all and their numbers; `None` where
    /// flights ask for some of one that is not there by less than nothing.
    fn together(&self, none: &Scored, candidates: &[usize]) -> Option<(f64, Vec<Member>)> {
        let numbers = |c: usize| self.catalogue.candidates[c].parameters.iter().copied();
        let mut prior = none.prior.clone();
        for p in candidates.iter().flat_map(|c| numbers(*c)) {
            prior[p] = self.catalogue.parameters[p].slab;
        }
        let posterior = none.gram.posterior(&prior, BETA)?;
        let may_be = |p: usize| self.catalogue.parameters[p].signed || posterior.mean[p] > 0.0;
        if !candidates.iter().flat_map(|c| numbers(*c)).all(may_be) {
            return None;
        }
        let member = |candidate: &usize| {
            let mut member = self.catalogue.absent(self.predictor, *candidate);
            for p in numbers(*candidate) {
                let parameter = &self.catalogue.parameters[p];
                let own = member.values[parameter.slot];
                member.values[parameter.slot] += parameter.bounded(own, posterior.mean[p]);
            }
            member
        };
        Some((posterior.log_evidence, candidates.iter().map(member).collect()))
    }

    /// How each rotor is against what the vehicle file has, if every one may be off; none where the
    /// flights do not show it.
    pub(crate) fn rotors(&self, null: &Scored) -> Vec<RotorHealth> {
        let catalogue = self.catalogue;
        let each = catalogue.each_of(WEAK_ROTOR, true).into_iter();
        let own: Vec<usize> =
            each.flat_map(|c| catalogue.candidates[c].parameters.iter().copied()).collect();
        let mut prior = null.prior.clone();
        for column in &own {
            prior[*column] = catalogue.parameters[*column].slab;
        }
        let Some(posterior) = null.gram.posterior(&prior, BETA) else { return Vec::new() };
        let health = |(i, column): (usize, usize)| {
            let (value, sd) = (posterior.mean[column], posterior.variance(column).sqrt());
            let (low, high) = (value - INTERVAL * sd, value + INTERVAL * sd);
            let usual = catalogue.parameters[column].tolerance;
            RotorHealth {
                rotor: i + 1,
                thrust_loss_fraction: Value::Number { value, low, high },
                usual,
            }
        };
        own.into_iter().enumerate().map(health).collect()
    }
}
