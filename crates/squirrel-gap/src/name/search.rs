//! The search for the set of effects with the most evidence: forward, drop, swap, each step refined
//! through the simulator.

use super::BEHIND_NATS;
use super::evidence::BETA;
use super::interval::deviations;
use super::linear::Linear;
use super::off::TOLERANCES_MIN;
use super::parameters::Catalogue;
use super::point::{Member, Point, hypothesis};
use super::refine::Scored;
use crate::GapError;
use crate::predictor::{Hypothesis, Predictor};
use squirrel_core::effects::{Effect, Mimic, Profile, Response, WeakRotor};
use std::rc::Rc;

/// What an effect must be worth to be named, nats.
pub(crate) const NATS_MIN: f64 = 6.0;
/// What each further effect must be worth, as a wrong first number leaves a little to explain; and
/// the deviations by which a number stands out of which that is not said: the flights alone would be
/// worth far more, and all that speaks against it is what the vehicle file allows.
pub(super) const FURTHER_NATS: f64 = 10.0;
const SHARP: f64 = 8.0;
/// What an effect must be worth beside gusts, which blow harder at times than at others; and per
/// squared m/s of their deviation, if it acts through moving air, as gusts on average do.
const BESIDE_GUSTS_NATS: f64 = 12.0;
const BLOWN_NATS: f64 = 40.0;
/// The effect of which a vehicle may have several.
pub(super) const WEAK_ROTOR: &str = WeakRotor::<f64>::NAME;
/// What a clock that jumps must be worth for each flight that it jumps in, which are all: by chance
/// something changes at one of the hundreds of times at which it may.
const JUMP_NATS: f64 = 40.0;
/// Part of its smallest size that a number without a sign has at least.
pub(super) const LEAST: f64 = 0.02;
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
                point = self.plausible(&linear, &best);
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
            point = self.plausible(&linear, &best);
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

    /// The same no farther out than is plausible: where a set does not explain the flights yet,
    /// everything else bends to what is left, and about such a point no set does.
    fn plausible(&self, linear: &Linear, set: &Scored) -> Point {
        let mut point = self.settled(set);
        for (x, sd) in point.base.iter_mut().zip(&linear.tolerance) {
            *x = x.clamp(-TOLERANCES_MIN * sd, TOLERANCES_MIN * sd);
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
            let is_worth_it = if next.members.len() > best.members.len() {
                self.is_worth_its_name(linear, best, &next)
            } else {
                self.weighed(&next) >= self.weighed(best) + BEHIND_NATS
            };
            if !is_worth_it {
                break;
            }
            *best = next;
            // Before a second effect explains what the first leaves, the first may have another
            // form.
            self.choose_forms(linear, best)?;
        }
        Ok(())
    }

    /// Whether the last member of a set is worth a name beside the others.
    ///
    /// * `before` - the set without it
    fn is_worth_its_name(&self, linear: &Linear, before: &Scored, set: &Scored) -> bool {
        let Some(last) = set.members.len().checked_sub(1) else { return false };
        let nats = set.log_evidence - before.log_evidence;
        nats >= self.needed(&set.members[last])
            && (before.members.is_empty()
                || nats >= FURTHER_NATS
                || self.stands_out(set, last, &deviations(self, linear, set)) >= SHARP)
    }

    /// The best set with one more effect, in the place of what it leaves too little of.
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
            let Some(scored) = self.without_small(linear, scored)? else { continue };
            if best.as_ref().is_none_or(|b| scored.log_evidence > b.log_evidence) {
                beats = beats.max(scored.log_evidence);
                best = Some(scored);
            }
        }
        Ok(best)
    }

    /// A set with a new last member, if that and the others are off. What the new one leaves of an
    /// earlier member may be too little: then it stands in its place.
    fn without_small(&self, linear: &Linear, set: Scored) -> Result<Option<Scored>, GapError> {
        let mut off = set.members.clone();
        off.retain(|member| self.is_beyond_tolerance(member));
        if off.last() != set.members.last() {
            return Ok(None);
        }
        let set = if off.len() < set.members.len() { self.score(linear, &off)? } else { set };
        Ok(self.is_off(&set).then_some(set))
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
                let least = best.log_evidence - self.needed(&out);
                // What was chosen beside it may have another form alone.
                let other = self.in_better_forms(linear, &without)?;
                if other.as_ref().unwrap_or(&without).log_evidence > least {
                    *best = other.unwrap_or(without);
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
