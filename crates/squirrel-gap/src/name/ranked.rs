//! What may be named beside a set, by the evidence that a linear model gives it.

use super::evidence::BETA;
use super::parameters::Candidate;
use super::point::Member;
use super::refine::Scored;
use super::search::{LEAST, Search, WEAK_ROTOR};
use squirrel_core::effects::{Profile, Ratio, Response};

/// How many times the largest plausible size a first step may lead to.
const FIRST_STEP: f64 = 1.5;

impl Search<'_> {
    /// Priors of a set with one candidate more, as large as is plausible.
    pub(super) fn widened(&self, set: &Scored, candidate: &Candidate) -> Vec<f64> {
        let offset = set.free.len();
        let mut prior = set.prior.clone();
        // A payload is one thing at several lengths.
        if swings(&candidate.profile) {
            for (p, parameter) in self.catalogue.parameters.iter().enumerate() {
                if self.catalogue.candidates[parameter.candidate].effect == candidate.effect {
                    prior[offset + p] = 0.0;
                }
            }
        }
        for p in &candidate.parameters {
            prior[offset + p] = self.catalogue.parameters[*p].slab;
        }
        prior
    }

    /// Candidates by the evidence that a linear model gives them beside a set, best first, with
    /// their linear numbers.
    pub(crate) fn ranked(&self, set: &Scored, except: &[&str]) -> Vec<(f64, Member)> {
        let offset = set.free.len();
        let mut all = Vec::new();
        for (index, candidate) in self.catalogue.candidates.iter().enumerate() {
            let in_set = set.members.iter().any(|m| self.excludes(m.candidate, index));
            let is_out = |names: &[&str]| names.contains(&candidate.effect);
            if in_set || is_out(except) || is_out(&self.catalogue.unforetold) {
                continue;
            }
            let Some(posterior) = set.gram.posterior(&self.widened(set, candidate), BETA) else {
                continue;
            };
            let mut member = self.catalogue.absent(self.predictor, index);
            let mut plausible = true;
            for p in &candidate.parameters {
                let parameter = &self.catalogue.parameters[*p];
                let value = &mut member.values[parameter.slot];
                let own = *value;
                *value += posterior.mean[offset + p];
                // Less than a file has may be as little as nothing; what it has not is not there by
                // less than nothing.
                if !parameter.signed && own > 0.0 {
                    *value = value.max(LEAST * parameter.smallest);
                }
                plausible &= parameter.signed || *value > 0.0;
                let (least, most) = parameter.bounds;
                *value = value.clamp(
                    least.max(-FIRST_STEP * parameter.largest),
                    most.min(FIRST_STEP * parameter.largest),
                );
                // What starts flat is not found from below.
                if self.catalogue.starts_flat(parameter.candidate) {
                    *value = value.max(parameter.smallest);
                }
            }
            if !plausible {
                continue;
            }
            all.extend(self.without_delay(&member).map(|other| (posterior.log_evidence, other)));
            all.push((posterior.log_evidence, member));
        }
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        // Of the several lines of a payload, the best two.
        let mut payloads = 0;
        all.retain(|(_, m)| {
            let is_payload = swings(self.profile(m));
            payloads += usize::from(is_payload);
            !is_payload || payloads <= 2
        });
        all
    }

    /// A lag or delay of the vehicle file started from nothing: far off, what is quick has no slope
    /// that leads there.
    fn without_delay(&self, member: &Member) -> Option<Member> {
        let stated = self.catalogue.absent(self.predictor, member.candidate);
        let own = self.catalogue.own(member).next()?;
        let is_stated = stated.values[own.slot] >= own.smallest;
        (self.catalogue.bends(member.candidate) && is_stated).then(|| {
            let mut other = stated;
            other.values[own.slot] = LEAST * own.smallest;
            other
        })
    }

    /// Whether a candidate leaves no room for another: the effect itself, and where flights show a
    /// ratio alone, what stands on its other side.
    fn excludes(&self, named: usize, other: usize) -> bool {
        let [one, two] = [named, other].map(|c| &self.catalogue.candidates[c]);
        let on_one_ratio = ratio(one).is_some() && ratio(one) == ratio(two);
        // Two rotors may be weak. What happened to them is one thing, and so has one form; several in
        // another than the usual make any moments, and only a machine's good flights tell them.
        let another_rotor = || {
            let in_usual_form = [one, two].iter().all(|candidate| candidate.floats);
            let in_another = self.catalogue.is_of_one_machine && one.floats == two.floats;
            one.effect == WEAK_ROTOR
                && (in_usual_form || in_another)
                && !self.catalogue.is_one_thing(named, other)
        };
        on_one_ratio || one.effect == two.effect && !another_rotor()
    }
}

/// The ratio of which a candidate, with the choices that it makes, changes one side.
pub(super) fn ratio(candidate: &Candidate) -> Option<Ratio> {
    let side = candidate.profile.side_of?;
    let makes = |choice: usize| candidate.fixed.iter().any(|(_, value)| *value as usize == choice);
    side.choice.is_none_or(makes).then_some(side.ratio)
}

fn swings(profile: &Profile) -> bool {
    matches!(profile.response, Response::Swings { .. })
}
