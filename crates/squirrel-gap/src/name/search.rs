//! The search for the set of effects with the most evidence: forward, drop, swap, each step refined
//! through the simulator.

use super::evidence::BETA;
use super::linear::Linear;
use super::parameters::{Candidate, Catalogue};
use super::point::{Member, Point, hypothesis};
use super::refine::Scored;
use super::{CLEAR, Naming};
use crate::GapError;
use crate::predictor::{Hypothesis, Predictor};
use squirrel_core::effects::{Effect, Mimic, Profile, Ratio, Response, WeakRotor};
use std::rc::Rc;

/// What an effect must be worth to be named, nats.
pub(crate) const NATS_MIN: f64 = 6.0;
/// What each further effect must be worth: a wrong first number leaves a little to explain.
pub(super) const FURTHER_NATS: f64 = 10.0;
/// What an effect must be worth beside gusts, which blow harder at times than at others; and per
/// squared m/s of their deviation, if it acts through moving air, as gusts on average do.
const BESIDE_GUSTS_NATS: f64 = 12.0;
const BLOWN_NATS: f64 = 40.0;
/// The effect of which a vehicle may have several.
pub(super) const WEAK_ROTOR: &str = WeakRotor::<f64>::NAME;
/// What a clock that jumps must be worth for each flight that it jumps in, which are all: by chance
/// something changes at one of the hundreds of times at which it may.
const JUMP_NATS: f64 = 40.0;
/// What a scale of the accelerometer must be worth: an attitude that leans into accelerations makes
/// one, too.
const LEANS_NATS: f64 = 12.0;
/// Tolerances beyond which a number is off: what is inside them the vehicle file allows.
pub(super) const TOLERANCES_MIN: f64 = 3.0;
/// Part of its smallest size that a number without a sign has at least.
pub(super) const LEAST: f64 = 0.02;
/// Part of its bounds at which a number is at its end.
const AT_ITS_END: f64 = 0.98;
/// How much larger than the largest plausible size a number may be.
const PLAUSIBLE: f64 = 1.3;
/// How many times the largest plausible size a first step may lead to.
const FIRST_STEP: f64 = 1.5;
/// Candidates that are refined after each linear ranking.
const REFINED: usize = 4;
/// A candidate is given up if its first step leaves more than this part of what must be explained,
/// and this much, nats.
const GIVEN_UP: f64 = 0.5;
const GIVEN_UP_NATS: f64 = 30.0;
/// Part of its tolerance by which a number must be off to act in the simulator's own model.
pub(super) const ACTS: f64 = 0.7;
/// Most effects in a set.
pub(super) const MEMBERS_MAX: usize = 4;
/// Most times that the predictor is linearised anew.
const ROUNDS_MAX: usize = 4;

/// The predictor and what can be named in it.
pub(crate) struct Search<'a> {
    pub(crate) predictor: &'a Predictor<'a>,
    pub(crate) catalogue: &'a Catalogue,
    /// Deviation of gusts that are taken for noise, m/s, if any blow.
    pub(crate) gust_m_s: Option<f64>,
    /// Called after each piece of work.
    pub(crate) progress: &'a dyn Fn(),
}

/// What a search found.
pub(crate) struct Found {
    pub(crate) linear: Rc<Linear>,
    pub(crate) null: Rc<Scored>,
    pub(crate) best: Scored,
    /// The best without each of its members.
    pub(crate) without: Vec<Scored>,
    /// A set that several weak rotors were better than.
    pub(crate) beaten: Option<Vec<Member>>,
}

impl Found {
    /// What a member is worth: evidence of the set over the set without it, nats.
    pub(crate) fn worth(&self, member: usize) -> f64 {
        self.best.log_evidence - self.without[member].log_evidence
    }
}

impl Search<'_> {
    /// The best set, from the vehicle file as it is.
    ///
    /// # Errors
    /// What the predictor says.
    pub(crate) fn run(&self) -> Result<Found, GapError> {
        self.run_from(self.nothing())
    }

    /// The best set, from where an explanation has everything.
    ///
    /// # Errors
    /// What the predictor says.
    pub(crate) fn run_from(&self, mut point: Point) -> Result<Found, GapError> {
        let mut linear = self.linear(&point, None)?;
        let mut round = 1;
        loop {
            let mut best = self.score(&linear, &point.members)?;
            if !self.has_settled(&best, &point.members) {
                // Numbers first: about others, columns are others, and all that is asked now would
                // be asked again.
                point = self.settled(&best);
                linear = self.linear(&point, Some(linear))?;
                best = self.score(&linear, &point.members)?;
            }
            self.extend(&linear, &mut best)?;
            let beaten = self.several_rotors(&linear, &mut best)?;
            let mut without = self.drop_and_swap(&linear, &mut best)?;
            let settled = round > 1 && self.has_settled(&best, &point.members);
            if settled || round == ROUNDS_MAX {
                if self.prune(&linear, &mut best)? || without.len() < best.members.len() {
                    without = self.without(&linear, &best)?;
                }
                self.finish(&mut best);
                let null = self.score(&linear, &[])?;
                return Ok(Found {
                    linear: Rc::new(linear),
                    null: Rc::new(null),
                    best,
                    without,
                    beaten,
                });
            }
            point = self.settled(&best);
            linear = self.linear(&point, Some(linear))?;
            round += 1;
        }
    }

    /// Where everything floats to if nothing has a name, from nothing.
    ///
    /// # Errors
    /// What the predictor says.
    pub(crate) fn afloat(&self) -> Result<(Point, Scored), GapError> {
        let (_, set) = self.about_nothing()?;
        Ok((self.whole(&set), set))
    }

    /// The predictor linearised about the vehicle file, and what it says if nothing has a name.
    pub(super) fn about_nothing(&self) -> Result<(Linear, Scored), GapError> {
        let linear = self.linear(&self.nothing(), None)?;
        let set = self.score(&linear, &[])?;
        Ok((linear, set))
    }

    /// The vehicle file as it is.
    fn nothing(&self) -> Point {
        Point { members: Vec::new(), base: vec![0.0; self.catalogue.columns(self.predictor)] }
    }

    /// As [`Self::afloat`], no farther than the simulator's own model follows.
    ///
    /// # Errors
    /// What the predictor says.
    pub(crate) fn towards(&self) -> Result<Point, GapError> {
        let (linear, set) = self.about_nothing()?;
        let whole = self.whole(&set);
        let cost = |point: &Point| -> Result<f64, GapError> {
            let rows = self.predictor.residual(&self.hypothesis(point)?)?;
            let white = linear.whitener.apply(&self.predictor.segments, &rows);
            let far = point.base.iter().zip(&linear.tolerance).filter(|(_, sd)| **sd > 0.0);
            Ok(BETA * white.iter().map(|x| x * x).sum::<f64>()
                + far.map(|(x, sd)| (x / sd).powi(2)).sum::<f64>())
        };
        let part = |share: f64| Point {
            base: whole.base.iter().map(|x| share * x).collect(),
            ..whole.clone()
        };
        let mut best = (cost(&part(0.0))?, part(0.0));
        for share in [1.0, 0.5, 0.25, 0.1] {
            let point = part(share);
            let cost = cost(&point)?;
            if cost < best.0 {
                best = (cost, point);
            }
        }
        Ok(best.1)
    }

    /// The predictor linearised about a point.
    fn linear(&self, point: &Point, before: Option<Linear>) -> Result<Linear, GapError> {
        let linear = Linear::about(self.predictor, self.catalogue, point, before, self.gust_m_s)?;
        (self.progress)();
        Ok(linear)
    }

    /// The point at which a set explains most: its members, and everything else where it most
    /// likely is, as far as a vehicle can be there. What is linear knows no end: where something
    /// else is wrong, it asks for a mass below zero.
    pub(crate) fn whole(&self, set: &Scored) -> Point {
        let mut base: Vec<f64> = set.posterior.mean.iter().skip(set.free.len()).copied().collect();
        for (x, parameter) in base.iter_mut().zip(&self.catalogue.parameters) {
            let own =
                self.catalogue.absent(self.predictor, parameter.candidate).values[parameter.slot];
            let flat = self.catalogue.starts_flat(parameter.candidate);
            *x = if flat { 0.0 } else { parameter.bounded(own, *x) };
        }
        Point { members: set.members.clone(), base }
    }

    /// The same without what is hardly off, which is left to the linear part: every effect that
    /// acts costs time.
    pub(crate) fn settled(&self, set: &Scored) -> Point {
        let mut point = self.whole(set);
        for (x, parameter) in point.base.iter_mut().zip(&self.catalogue.parameters) {
            if x.abs() < ACTS * parameter.tolerance {
                *x = 0.0;
            }
        }
        point
    }

    /// What a member must be worth, nats.
    pub(super) fn needed(&self, member: &Member) -> f64 {
        let profile = self.profile(member);
        match self.gust_m_s {
            _ if matches!(profile.response, Response::Jumps { .. }) => {
                JUMP_NATS * self.predictor.names.len() as f64
            }
            None if profile.mimic == Mimic::LeaningAttitude => LEANS_NATS,
            None => NATS_MIN,
            Some(sigma) if profile.mimic == Mimic::Gusts => BLOWN_NATS * (sigma * sigma).max(1.0),
            Some(_) => BESIDE_GUSTS_NATS,
        }
    }

    /// Evidence of a set, less what its names must be worth beyond others', nats.
    pub(crate) fn weighed(&self, set: &Scored) -> f64 {
        let beyond = set.members.iter().map(|member| self.needed(member) - NATS_MIN);
        set.log_evidence - beyond.sum::<f64>()
    }

    /// A set without each of its members in turn.
    pub(super) fn without(&self, linear: &Linear, set: &Scored) -> Result<Vec<Scored>, GapError> {
        (0..set.members.len())
            .map(|i| {
                let mut rest = set.members.clone();
                rest.remove(i);
                self.score(linear, &rest)
            })
            .collect()
    }

    /// Whether a set is the one that the predictor was linearised about, with numbers within a
    /// tenth of what they are.
    fn has_settled(&self, set: &Scored, about: &[Member]) -> bool {
        set.members.len() == about.len()
            && set.members.iter().all(|member| {
                let effect = self.effect(member);
                about.iter().any(|other| {
                    self.effect(other) == effect
                        && self.catalogue.candidates[other.candidate].fixed
                            == self.catalogue.candidates[member.candidate].fixed
                        && self.form(other) == self.form(member)
                        && self.free_slots(member).into_iter().all(|slot| {
                            let moved = (member.values[slot] - other.values[slot]).abs();
                            moved < 0.1 * self.range(member, slot).smallest
                        })
                })
            })
    }

    /// Adds effects as long as the evidence asks for them.
    pub(super) fn extend(&self, linear: &Linear, best: &mut Scored) -> Result<(), GapError> {
        while best.members.len() < MEMBERS_MAX {
            let Some(next) = self.best_addition(linear, best, &[], f64::NEG_INFINITY)? else {
                break;
            };
            let least = if best.members.is_empty() { NATS_MIN } else { FURTHER_NATS };
            let needed = next.members.last().map_or(least, |member| self.needed(member).max(least));
            if next.log_evidence < best.log_evidence + needed {
                break;
            }
            *best = next;
            // Before a second effect explains what the first leaves, the first may have another
            // form.
            self.choose_forms(linear, best)?;
        }
        Ok(())
    }

    /// The best set with one more effect.
    ///
    /// * `beats` - evidence that it must have to matter, nats
    fn best_addition(
        &self,
        linear: &Linear,
        set: &Scored,
        except: &[&str],
        mut beats: f64,
    ) -> Result<Option<Scored>, GapError> {
        let mut best: Option<Scored> = None;
        for (log_evidence, member) in self.ranked(set, except).into_iter().take(REFINED) {
            // What explains nothing along its slope is worth a flight only where the slope may be
            // another one.
            let profile = self.profile(&member);
            let straight = !profile.bends() && profile.response != Response::StartsFlat;
            if log_evidence <= set.log_evidence && (straight || linear.knows(&set.members)) {
                continue;
            }
            let members = [set.members.as_slice(), &[member]].concat();
            let near = beats - GIVEN_UP * (beats - set.log_evidence).max(0.0) - GIVEN_UP_NATS;
            let scored = self.score_towards(linear, &members, Some(set), near)?;
            (self.progress)();
            if self.is_off(&scored)
                && best.as_ref().is_none_or(|b| scored.log_evidence > b.log_evidence)
            {
                beats = beats.max(scored.log_evidence);
                best = Some(scored);
            }
        }
        Ok(best)
    }

    /// Whether each member is beyond what the vehicle file allows it, and none at the end of what
    /// is plausible: what is forced into a name goes there.
    pub(crate) fn is_off(&self, scored: &Scored) -> bool {
        scored
            .members
            .iter()
            .all(|member| self.is_beyond_tolerance(member) && !self.is_at_its_end(member))
    }

    pub(crate) fn is_at_its_end(&self, member: &Member) -> bool {
        self.catalogue.own(member).any(|p| {
            let (least, most) = p.bounds;
            let value = member.values[p.slot];
            // What takes away all that the vehicle file has is no end of anything.
            value >= AT_ITS_END * most || (least == -most && value <= AT_ITS_END * least)
        }) || self.free_slots(member).into_iter().any(|slot| {
            // A number that gives an effect its form, and does not want to be there.
            let range = self.range(member, slot);
            let is_own = self.catalogue.own(member).any(|p| p.slot == slot);
            !is_own && !range.signed && member.values[slot] * AT_ITS_END <= LEAST * range.smallest
        })
    }

    /// By the numbers of the standard form, unless this form has others.
    fn is_beyond_tolerance(&self, member: &Member) -> bool {
        let before = self.catalogue.absent(self.predictor, member.candidate).values;
        let free = self.free_slots(member);
        let mut standard = self.catalogue.own(member).filter(|p| free.contains(&p.slot)).peekable();
        // What starts flat grows with the square of its number, from what the file has as from
        // nothing.
        let is_flat = self.profile(member).response == Response::StartsFlat;
        let off = |was: f64, is: f64| {
            if is_flat { (is * is - was * was).abs().sqrt() } else { (is - was).abs() }
        };
        standard.peek().is_none()
            || standard
                .any(|p| off(before[p.slot], member.values[p.slot]) >= TOLERANCES_MIN * p.least())
    }

    /// Drops members that refinement has made too small to be off; whether there were any.
    fn prune(&self, linear: &Linear, best: &mut Scored) -> Result<bool, GapError> {
        let before = best.members.len();
        while let Some(small) =
            best.members.iter().position(|member| !self.is_beyond_tolerance(member))
        {
            let mut rest = best.members.clone();
            rest.remove(small);
            *best = self.score(linear, &rest)?;
        }
        Ok(best.members.len() < before)
    }

    /// What was found, with other members.
    ///
    /// # Errors
    /// What the predictor says.
    pub(crate) fn with(&self, found: &Found, members: &[Member]) -> Result<Found, GapError> {
        let linear = Rc::clone(&found.linear);
        let mut best = self.score(&linear, members)?;
        let without = self.without(&linear, &best)?;
        self.finish(&mut best);
        Ok(Found { linear, null: Rc::clone(&found.null), best, without, beaten: None })
    }

    /// By how many standard deviations a member's number differs from what the vehicle file has,
    /// the clearest of them.
    ///
    /// * `deviations` - of the free numbers
    pub(crate) fn stands_out(&self, set: &Scored, index: usize, deviations: &[f64]) -> f64 {
        let before = self.catalogue.absent(self.predictor, set.members[index].candidate).values;
        let own = set.free.iter().zip(deviations).filter(|((member, _), _)| *member == index);
        own.map(|((_, slot), sd)| (set.members[index].values[*slot] - before[*slot]).abs() / sd)
            .fold(0.0, f64::max)
    }

    /// Whether a member is one side of a ratio and farther off than is plausible. Flights show the
    /// ratio; how far off each side may be chose this one, and says nothing of that far out.
    pub(crate) fn is_far_side(&self, member: &Member) -> bool {
        let before = self.catalogue.absent(self.predictor, member.candidate).values;
        ratio(&self.catalogue.candidates[member.candidate]).is_some()
            && self
                .catalogue
                .own(member)
                .any(|p| (member.values[p.slot] - before[p.slot]).abs() > p.largest)
    }

    /// The member that stands out least, if that is too little to be told.
    pub(crate) fn least_clear(&self, naming: &Naming) -> Option<usize> {
        let best = &naming.found.best;
        let clear = |i: &usize| self.stands_out(best, *i, &naming.deviations);
        let unclear = (0..best.members.len()).filter(|i| clear(i) < CLEAR);
        unclear.min_by(|a, b| clear(a).total_cmp(&clear(b)))
    }

    /// Whether no member is larger than anything plausible: what is forced into a name goes to its
    /// limit.
    pub(crate) fn is_plausible(&self, scored: &Scored) -> bool {
        scored.members.iter().all(|member| {
            self.free_slots(member).into_iter().all(|slot| {
                member.values[slot].abs() <= PLAUSIBLE * self.range(member, slot).largest
            })
        })
    }

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
            let in_set = set
                .members
                .iter()
                .any(|m| excludes(&self.catalogue.candidates[m.candidate], candidate));
            if in_set || except.contains(&candidate.effect) {
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

    pub(crate) fn effect(&self, member: &Member) -> &'static str {
        self.catalogue.candidates[member.candidate].effect
    }

    pub(super) fn profile(&self, member: &Member) -> &Profile {
        &self.catalogue.candidates[member.candidate].profile
    }

    pub(super) fn hypothesis(&self, point: &Point) -> Result<Hypothesis, GapError> {
        hypothesis(self.predictor, self.catalogue, point)
    }

    /// Drops and replaces members as long as the evidence asks for it; the set without each of its
    /// members, unless it was changed to the last.
    fn drop_and_swap(&self, linear: &Linear, best: &mut Scored) -> Result<Vec<Scored>, GapError> {
        // Later members may have taken over what an early one was named for.
        let mut all = Vec::new();
        let mut changed = true;
        let mut passes = 0;
        while changed && passes < 3 {
            changed = false;
            passes += 1;
            all.clear();
            for i in (0..best.members.len()).rev() {
                let mut rest = best.members.clone();
                let out = rest.remove(i);
                let without = self.score(linear, &rest)?;
                if without.log_evidence > best.log_evidence - self.needed(&out) {
                    *best = without;
                    changed = true;
                    break;
                }
                if best.members.len() > 1
                    && let Some(other) = self.best_addition(
                        linear,
                        &without,
                        &[self.effect(&out)],
                        best.log_evidence,
                    )?
                    && other.log_evidence > best.log_evidence
                {
                    *best = other;
                    self.extend(linear, best)?;
                    changed = true;
                    break;
                }
                all.insert(0, without);
            }
        }
        Ok(if changed { Vec::new() } else { all })
    }
}

/// Whether an effect leaves no room for another: itself, and where flights show a ratio alone, what
/// stands on its other side.
fn excludes(named: &Candidate, other: &Candidate) -> bool {
    let on_one_ratio = ratio(named).is_some() && ratio(named) == ratio(other);
    // Two rotors may be weak.
    let rotors = |c: &Candidate| c.effect == WEAK_ROTOR;
    let same = named.effect == other.effect && !(rotors(named) && named.fixed != other.fixed);
    same || on_one_ratio
}

/// The ratio of which a candidate, with the choices that it makes, changes one side.
fn ratio(candidate: &Candidate) -> Option<Ratio> {
    let side = candidate.profile.side_of?;
    let makes = |choice: usize| candidate.fixed.iter().any(|(_, value)| *value as usize == choice);
    side.choice.is_none_or(makes).then_some(side.ratio)
}

fn swings(profile: &Profile) -> bool {
    matches!(profile.response, Response::Swings { .. })
}
