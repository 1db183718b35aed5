//! Other explanations of the same flights, and what these flights cannot show at all.

use super::evidence::BETA;
use super::parameters::Candidate;
use super::point::Member;
use super::refine::Scored;
use super::search::{Found, NATS_MIN, Search};
use crate::GapError;
use squirrel_core::effects::Effects;
use std::collections::BTreeSet;

/// Rivals that are refined for each named effect.
const RIVALS: usize = 3;
/// Squared size over variance from which an effect shows.
const VISIBLE: f64 = 9.0;

impl Search<'_> {
    /// Sets in which one of the named effects is replaced by another, the best first.
    ///
    /// # Errors
    /// What the predictor says.
    pub(crate) fn rivals(&self, found: &Found) -> Result<Vec<Scored>, GapError> {
        let mut all: Vec<Scored> = Vec::new();
        for i in 0..found.best.members.len() {
            let (out, without) = (&found.best.members[i], &found.without[i]);
            let mut names: Vec<&str> = Vec::new();
            for (_, member) in self.ranked(without, &[self.effect(out)]) {
                if names.contains(&self.effect(&member)) {
                    continue;
                }
                names.push(self.effect(&member));
                let members = [without.members.as_slice(), &[member]].concat();
                let (last, least) = (without.members.len(), f64::NEG_INFINITY);
                let rival = self.score_towards(&found.linear, &members, Some(without), least)?;
                // Noise of the gyroscope in the commands is no other explanation.
                if self.foretells(&rival, last, without)?.is_none_or(|nats| nats >= NATS_MIN) {
                    all.push(rival);
                }
                (self.progress)();
                if names.len() == RIVALS {
                    break;
                }
            }
        }
        all.extend(self.more_rotors(found)?);
        if let Some(beaten) = &found.beaten {
            all.push(self.score(&found.linear, beaten)?);
        }
        let candidates =
            |members: &[Member]| members.iter().map(|m| m.candidate).collect::<BTreeSet<_>>();
        let own = candidates(&found.best.members);
        all.retain(|rival| self.is_off(rival) && candidates(&rival.members) != own);
        if !own.is_empty()
            && let Some(load) = self.load(found)?
        {
            let both = candidates(&load.members);
            // A part of it is the same answer, and the shorter one where it was found.
            if !own.is_subset(&both) {
                all.retain(|rival| !candidates(&rival.members).is_subset(&both));
                all.push(load);
            }
        }
        all.sort_by(|a, b| self.weighed(b).total_cmp(&self.weighed(a)));
        Ok(all)
    }

    /// Evidence that one effect alone has over none, by name, nats; linear.
    pub(crate) fn single_evidence(&self, found: &Found) -> Vec<(&'static str, f64)> {
        let mut all: Vec<(&'static str, f64)> = Vec::new();
        for (log_evidence, member) in self.ranked(&found.null, &[]) {
            let name = self.effect(&member);
            let nats = log_evidence - found.null.log_evidence;
            match all.iter_mut().find(|(other, _)| *other == name) {
                Some((_, best)) => *best = best.max(nats),
                None => all.push((name, nats)),
            }
        }
        all
    }

    /// Effects that these flights do not show even at their largest plausible size, everything else
    /// floating.
    pub(crate) fn blind(&self, set: &Scored) -> Vec<&'static str> {
        let offset = set.free.len();
        let shows = |candidate: &Candidate| {
            let mut prior = set.prior.clone();
            for p in &candidate.parameters {
                prior[offset + p] = self.catalogue.parameters[*p].slab;
            }
            let Some(posterior) = set.gram.posterior(&prior, BETA) else { return true };
            candidate.parameters.iter().any(|p| {
                let largest = self.catalogue.parameters[*p].largest;
                largest * largest > VISIBLE * posterior.variance(offset + p)
            })
        };
        let candidates = &self.catalogue.candidates;
        let shown: Vec<bool> = candidates.iter().map(shows).collect();
        let mut all = self.catalogue.unseen.clone();
        for (index, candidate) in candidates.iter().enumerate() {
            let profile = Effects::<f64>::profile(candidate.effect);
            // One of its forms is enough.
            let is_shown = (0..candidates.len())
                .any(|other| shown[other] && self.catalogue.is_one_thing(index, other));
            if !all.contains(&candidate.effect)
                && !is_shown
                && !profile.is_some_and(|profile| profile.is_of_a_state)
                && !set.members.iter().any(|m| self.effect(m) == candidate.effect)
            {
                all.push(candidate.effect);
            }
        }
        all
    }

    /// How far the smallest size of one effect stands out while another floats freely: chi squared
    /// by row and column.
    pub(crate) fn confusability(&self, set: &Scored) -> (Vec<&'static str>, Vec<Vec<f64>>) {
        let offset = set.free.len();
        let mut names: Vec<&'static str> = Vec::new();
        let mut first = Vec::new();
        for candidate in &self.catalogue.candidates {
            if !names.contains(&candidate.effect) && !candidate.parameters.is_empty() {
                names.push(candidate.effect);
                first.push(candidate);
            }
        }
        let mut rows = vec![vec![0.0; first.len()]; first.len()];
        // Two effects that both float are one posterior, whichever is asked for.
        for i in 0..first.len() {
            for j in 0..=i {
                let mut prior = set.prior.clone();
                for q in first[i].parameters.iter().chain(&first[j].parameters) {
                    prior[offset + q] = self.catalogue.parameters[*q].slab;
                }
                let Some(posterior) = set.gram.posterior(&prior, BETA) else { continue };
                let stands_out = |candidate: &Candidate| {
                    let p = candidate.parameters[0];
                    self.catalogue.parameters[p].smallest.powi(2) / posterior.variance(offset + p)
                };
                rows[i][j] = stands_out(first[i]);
                rows[j][i] = stands_out(first[j]);
            }
        }
        (names, rows)
    }
}
