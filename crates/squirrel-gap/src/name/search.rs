//! The search for the set of effects with the most evidence: forward, drop, swap, each step refined through the simulator.

use super::evidence::{BETA, Gram, Posterior, dot};
use super::linear::{Linear, height_columns};
use super::parameters::{Candidate, Catalogue, SLAB_OF_LARGEST};
use super::point::{Member, Other, Point, hypothesis};
use crate::GapError;
use crate::predictor::{Hypothesis, Predictor};
use nalgebra::DMatrix;
use std::collections::BTreeMap;

/// What an effect must be worth to be named, nats.
pub(crate) const NATS_MIN: f64 = 6.0;
/// What each further effect must be worth: a wrong first number leaves a little to explain.
const FURTHER_NATS: f64 = 10.0;
/// What an effect must be worth beside gusts, which blow harder at times than at others; and per squared m/s of their
/// deviation, if it acts through moving air, as gusts on average do.
const BESIDE_GUSTS_NATS: f64 = 12.0;
const BLOWN_NATS: f64 = 40.0;
const BLOWN: [&str; 3] = ["constant_wind", "wing_asymmetry", "wing_membrane"];
/// Part of the smallest size worth reporting that an effect must reach.
const SIZE_MIN: f64 = 0.5;
/// How much larger than the largest plausible size a number may be.
const PLAUSIBLE: f64 = 1.3;
/// Candidates that are refined after each linear ranking.
const REFINED: usize = 4;
/// Most steps of a refinement.
const STEPS_MAX: usize = 10;
/// Evidence that a step towards the mode may cost, nats.
const STEP_NATS: f64 = 1.0;
/// Part of the smallest size worth reporting below which a step is the last.
const CONVERGED: f64 = 0.01;
/// Part of its tolerance by which a number must be off to act in the simulator's own model.
const ACTS: f64 = 0.7;
/// Most effects in a set.
const MEMBERS_MAX: usize = 4;
/// Most times that the predictor is linearised anew.
const ROUNDS_MAX: usize = 4;

/// A set of effects with its best numbers and its evidence.
pub(crate) struct Scored {
    pub(crate) members: Vec<Member>,
    /// Relative to nothing in particular; differences within one [`Linear`] count.
    pub(crate) log_evidence: f64,
    /// Of the members' free numbers, then of all columns of the [`Linear`].
    pub(crate) posterior: Posterior,
    pub(crate) gram: Gram,
    /// Prior deviations, in the order of the posterior.
    pub(crate) prior: Vec<f64>,
    /// Which number of which member each of the first columns is.
    pub(crate) free: Vec<(usize, usize)>,
    /// Columns of the free numbers, as they are and whitened.
    pub(crate) own_raw: Vec<Vec<f64>>,
    pub(crate) own: Vec<Vec<f64>>,
    /// Whitened measurement, with the free numbers' part in it.
    pub(crate) y: Vec<f64>,
}

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
    pub(crate) linear: Linear,
    pub(crate) null: Scored,
    pub(crate) best: Scored,
    /// What each member is worth: evidence of the set over the set without it, nats.
    pub(crate) worth: Vec<f64>,
}

impl Search<'_> {
    /// # Errors
    /// What the predictor says.
    pub(crate) fn run(&self) -> Result<Found, GapError> {
        let mut point =
            Point { members: Vec::new(), base: vec![0.0; self.catalogue.columns(self.predictor)] };
        let mut round = 1;
        let mut before: Option<Linear> = None;
        loop {
            let linear =
                Linear::about(self.predictor, self.catalogue, &point, before.as_ref(), self.gust_m_s)?;
            (self.progress)();
            let null = self.score(&linear, &[])?;
            let mut best = self.score(&linear, &point.members)?;
            self.extend(&linear, &mut best)?;
            self.drop_and_swap(&linear, &mut best)?;
            let settled = round > 1 && self.has_settled(&best, &point.members);
            if settled || round == ROUNDS_MAX {
                self.prune(&linear, &mut best)?;
                self.finish(&mut best);
                let worth = self.worth(&linear, &null, &best)?;
                return Ok(Found { linear, null, best, worth });
            }
            point = self.settled(&best);
            before = Some(linear);
            round += 1;
        }
    }

    /// The point at which a set explains most: its members, and everything else where it most likely is.
    pub(crate) fn whole(&self, set: &Scored) -> Point {
        let mut base: Vec<f64> = set.posterior.mean.iter().skip(set.free.len()).copied().collect();
        for (x, parameter) in base.iter_mut().zip(&self.catalogue.parameters) {
            if self.catalogue.starts_flat(parameter) {
                *x = 0.0;
            }
        }
        Point { members: set.members.clone(), base }
    }

    /// The same without what is hardly off, which is left to the linear part: every effect that acts costs time.
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
    fn needed(&self, member: &Member) -> f64 {
        match self.gust_m_s {
            None => NATS_MIN,
            Some(sigma) if BLOWN.contains(&self.effect(member)) => BLOWN_NATS * (sigma * sigma).max(1.0),
            Some(_) => BESIDE_GUSTS_NATS,
        }
    }

    /// Drops members that refinement has made too small to report.
    fn prune(&self, linear: &Linear, best: &mut Scored) -> Result<(), GapError> {
        while let Some(small) = best.members.iter().position(|member| !self.is_large_enough(member)) {
            let mut rest = best.members.clone();
            rest.remove(small);
            *best = self.score(linear, &rest)?;
        }
        Ok(())
    }

    /// The last step of a refinement that has converged, too short to be worth another look.
    fn finish(&self, best: &mut Scored) {
        for (column, (member, slot)) in best.free.iter().enumerate() {
            let (smallest, ..) = self.range(&best.members[*member], *slot);
            let step = best.posterior.mean[column] - best.members[*member].values[*slot];
            if step.abs() < CONVERGED * smallest {
                best.members[*member].values[*slot] += step;
            }
        }
    }

    fn worth(&self, linear: &Linear, null: &Scored, best: &Scored) -> Result<Vec<f64>, GapError> {
        (0..best.members.len())
            .map(|i| {
                let mut rest = best.members.clone();
                rest.remove(i);
                let without =
                    if rest.is_empty() { null.log_evidence } else { self.score(linear, &rest)?.log_evidence };
                Ok(best.log_evidence - without)
            })
            .collect()
    }

    /// Whether a set is the one that the predictor was linearised about, with numbers within a tenth of what they are.
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
                            moved < 0.1 * self.range(member, slot).0
                        })
                })
            })
    }

    /// Adds effects as long as the evidence asks for them.
    fn extend(&self, linear: &Linear, best: &mut Scored) -> Result<(), GapError> {
        while best.members.len() < MEMBERS_MAX {
            let Some(next) = self.best_addition(linear, best, &[])? else { break };
            let kept = if best.members.is_empty() { NATS_MIN } else { FURTHER_NATS };
            let needed = next.members.last().map_or(kept, |member| self.needed(member).max(kept));
            if next.log_evidence < best.log_evidence + needed {
                break;
            }
            *best = next;
            // Before a second effect explains what the first leaves, the first may have another form.
            self.choose_forms(linear, best)?;
        }
        Ok(())
    }

    /// The best set with one more effect that is large enough to report.
    fn best_addition(
        &self,
        linear: &Linear,
        set: &Scored,
        except: &[&str],
    ) -> Result<Option<Scored>, GapError> {
        let mut best: Option<Scored> = None;
        for member in self.ranked(set, except).into_iter().take(REFINED) {
            let members = [set.members.as_slice(), &[member.1]].concat();
            let scored = self.score(linear, &members)?;
            (self.progress)();
            if self.is_large(&scored) && best.as_ref().is_none_or(|b| scored.log_evidence > b.log_evidence) {
                best = Some(scored);
            }
        }
        Ok(best)
    }

    /// Whether each member is at least half the smallest size worth reporting.
    pub(crate) fn is_large(&self, scored: &Scored) -> bool {
        scored.members.iter().all(|member| self.is_large_enough(member))
    }

    /// Whether no member is larger than anything plausible: what is forced into a name goes to its limit.
    pub(crate) fn is_plausible(&self, scored: &Scored) -> bool {
        scored.members.iter().all(|member| {
            self.free_slots(member).into_iter().all(|slot| {
                let (_, largest, _) = self.range(member, slot);
                member.values[slot].abs() <= PLAUSIBLE * largest
            })
        })
    }

    fn is_large_enough(&self, member: &Member) -> bool {
        self.catalogue.candidates[member.candidate].parameters.iter().any(|p| {
            let p = &self.catalogue.parameters[*p];
            let size = member.values[p.slot];
            (if p.signed { size.abs() } else { size }) >= SIZE_MIN * p.smallest
        })
    }

    /// Candidates by the evidence that a linear model gives them beside a set, best first, with their linear numbers.
    pub(crate) fn ranked(&self, set: &Scored, except: &[&str]) -> Vec<(f64, Member)> {
        let offset = set.free.len();
        let mut all = Vec::new();
        for (index, candidate) in self.catalogue.candidates.iter().enumerate() {
            let in_set =
                set.members.iter().any(|m| excludes(&self.catalogue.candidates[m.candidate], candidate));
            if in_set || except.contains(&candidate.effect) {
                continue;
            }
            let mut prior = set.prior.clone();
            if candidate.effect == "payload_swing" {
                for (p, parameter) in self.catalogue.parameters.iter().enumerate() {
                    if self.catalogue.candidates[parameter.candidate].effect == "payload_swing" {
                        prior[offset + p] = 0.0;
                    }
                }
            }
            for p in &candidate.parameters {
                prior[offset + p] = self.catalogue.parameters[*p].slab;
            }
            let Some(posterior) = set.gram.posterior(&prior, BETA) else { continue };
            let mut member = self.catalogue.absent(self.predictor, index);
            let mut plausible = true;
            for p in &candidate.parameters {
                let parameter = &self.catalogue.parameters[*p];
                let value = &mut member.values[parameter.slot];
                *value += posterior.mean[offset + p];
                plausible &= parameter.signed || *value > 0.0;
                *value = value.clamp(-1.5 * parameter.largest, 1.5 * parameter.largest);
                // What starts flat is not found from below.
                if self.catalogue.starts_flat(parameter) {
                    *value = value.max(parameter.smallest);
                }
            }
            if plausible {
                all.push((posterior.log_evidence, member));
            }
        }
        all.sort_by(|a, b| b.0.total_cmp(&a.0));
        // Of the several lines of a payload, the best two.
        let mut payloads = 0;
        all.retain(|(_, m)| {
            payloads += usize::from(self.effect(m) == "payload_swing");
            self.effect(m) != "payload_swing" || payloads <= 2
        });
        all
    }

    pub(crate) fn effect(&self, member: &Member) -> &'static str {
        self.catalogue.candidates[member.candidate].effect
    }

    fn hypothesis(&self, point: &Point) -> Result<Hypothesis, GapError> {
        hypothesis(self.predictor, self.catalogue, point)
    }

    fn drop_and_swap(&self, linear: &Linear, best: &mut Scored) -> Result<(), GapError> {
        // Later members may have taken over what an early one was named for.
        let mut changed = true;
        let mut passes = 0;
        while changed && passes < 3 {
            changed = false;
            passes += 1;
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
                    && let Some(other) = self.best_addition(linear, &without, &[self.effect(&out)])?
                    && other.log_evidence > best.log_evidence
                {
                    *best = other;
                    self.extend(linear, best)?;
                    changed = true;
                    break;
                }
            }
        }
        Ok(())
    }

    /// Refines the numbers of a set by Gauss-Newton through the simulator, everything else floating with its tolerance.
    ///
    /// # Errors
    /// What the predictor says.
    pub(crate) fn score(&self, linear: &Linear, members: &[Member]) -> Result<Scored, GapError> {
        let mut base = linear.point.base.clone();
        let along = self.moving_along(linear, members);
        // A lag that is new explains what others were taken to be off for: they start at nothing.
        for (column, _) in along.iter().filter(|(column, _)| *column < self.catalogue.parameters.len()) {
            base[*column] = 0.0;
        }
        let mut best = self.evaluate(linear, members, &base, None)?;
        let mut share = 1.0;
        for _ in 0..STEPS_MAX {
            let mut next = best.members.clone();
            let mut moved: f64 = 0.0;
            for (column, (member, slot)) in best.free.iter().enumerate() {
                let (smallest, largest, signed) = self.range(&next[*member], *slot);
                let low = if signed { -2.0 * largest } else { 0.02 * smallest };
                let value = &mut next[*member].values[*slot];
                let target = best.posterior.mean[column].clamp(low, 2.0 * largest);
                let step = share * (target - *value);
                moved = moved.max(step.abs() / smallest);
                *value += step;
            }
            let before = base.clone();
            for (column, sd) in &along {
                let target = best.posterior.mean[best.free.len() + column].clamp(-3.0 * sd, 3.0 * sd);
                let step = share * (target - base[*column]);
                moved = moved.max(0.1 * step.abs() / sd);
                base[*column] += step;
            }
            if moved < CONVERGED {
                break;
            }
            let scored = self.evaluate(linear, &next, &base, Some(&best))?;
            // Where the model is linear, every point of it has the same evidence: the mode is where steps end.
            if scored.log_evidence > best.log_evidence - STEP_NATS {
                best = scored;
            } else {
                // Too far for what the columns know: half the way.
                base = before;
                share *= 0.5;
                if share < 0.2 {
                    break;
                }
            }
        }
        Ok(best)
    }

    /// Columns that bend so much beside some members that they are refined with them, with their tolerances: heights where
    /// thrust feels them, and lags and delays beside one of them that is new.
    fn moving_along(&self, linear: &Linear, members: &[Member]) -> Vec<(usize, f64)> {
        let catalogue = self.catalogue;
        let bends = |m: &Member| {
            catalogue.candidates[m.candidate]
                .parameters
                .iter()
                .any(|p| catalogue.bends(&catalogue.parameters[*p]))
        };
        let is_new = |m: &Member| !linear.point.members.iter().any(|other| other.candidate == m.candidate);
        let mut all = Vec::new();
        if members.iter().any(|m| bends(m) && is_new(m)) {
            let own = |p: usize| members.iter().any(|m| m.candidate == p);
            let free = catalogue.parameters.iter().enumerate();
            let bending = free.filter(|(_, p)| catalogue.bends(p) && !own(p.candidate) && p.tolerance > 0.0);
            all.extend(bending.map(|(column, p)| (column, p.tolerance)));
        }
        if catalogue.feels_height(members) {
            let sensors = catalogue.shared_columns()..linear.point.base.len();
            all.extend(sensors.filter_map(|column| match catalogue.other(column) {
                (Other::Height { .. }, sd) => Some((column, sd)),
                _ => None,
            }));
        }
        all
    }

    /// Whether a number of a member has one slope all along: it is in the catalogue's linear part and no lag.
    fn keeps_slope(&self, member: &Member, slot: usize) -> bool {
        let own = &self.catalogue.candidates[member.candidate].parameters;
        own.iter()
            .map(|p| &self.catalogue.parameters[*p])
            .any(|p| p.slot == slot && !self.catalogue.bends(p) && !self.catalogue.starts_flat(p))
    }

    /// Range of a number of a member.
    pub(crate) fn range(&self, member: &Member, slot: usize) -> (f64, f64, bool) {
        use squirrel_core::effects::{Effects, Kind};
        let list = Effects::<f64>::parameters(self.effect(member)).unwrap_or_default();
        match list[slot].kind {
            Kind::Size { smallest, largest, signed } => (smallest, largest, signed),
            _ => (1.0, 1.0, true),
        }
    }

    /// Evidence of a set, linearised in its free numbers where they are.
    ///
    /// * `before` - the same set with other numbers: columns that hardly bend are its
    fn evaluate(
        &self,
        linear: &Linear,
        members: &[Member],
        base: &[f64],
        before: Option<&Scored>,
    ) -> Result<Scored, GapError> {
        let segments = &self.predictor.segments;
        let mut point = Point { members: members.to_vec(), base: base.to_vec() };
        let mut spikes = linear.tolerance.clone();
        for member in members {
            let candidate = &self.catalogue.candidates[member.candidate];
            for (p, parameter) in self.catalogue.parameters.iter().enumerate() {
                let other = &self.catalogue.candidates[parameter.candidate];
                // Another rotor may still be off by its tolerance; the payload is one thing at several lengths.
                let same = parameter.candidate == member.candidate
                    || (other.effect == candidate.effect && other.fixed == candidate.fixed);
                if same {
                    spikes[p] = 0.0;
                    point.base[p] = 0.0;
                }
            }
        }
        let residual = self.predictor.residual(&self.hypothesis(&point)?)?;
        let mut y = linear.whitener.apply(segments, &residual);
        // Height matters where an effect of it acts, and as much as it acts.
        if !self.catalogue.feels_height(members) {
            for (column, spike) in spikes.iter_mut().enumerate().skip(self.catalogue.shared_columns()) {
                if matches!(self.catalogue.other(column).0, Other::Height { .. }) {
                    *spike = 0.0;
                }
            }
        }
        let mut fresh = BTreeMap::new();
        for (index, column) in height_columns(self.predictor, self.catalogue, &point, &residual)? {
            fresh.insert(index, linear.whitener.apply(segments, &column));
        }
        let column = |j: usize| fresh.get(&j).unwrap_or(&linear.columns[j]);
        for (j, x) in point.base.iter().enumerate() {
            if *x != 0.0 {
                add_scaled(&mut y, column(j), *x);
            }
        }
        let (mut own, mut own_raw, mut free, mut prior) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for (index, member) in members.iter().enumerate() {
            for slot in self.free_slots(member) {
                let (smallest, largest, _) = self.range(member, slot);
                let (column, white) = match before {
                    Some(before) if self.keeps_slope(member, slot) => {
                        (before.own_raw[own.len()].clone(), before.own[own.len()].clone())
                    }
                    _ => {
                        let step = 0.1 * smallest;
                        let mut moved = point.clone();
                        moved.members[index].values[slot] += step;
                        let after = self.predictor.residual(&self.hypothesis(&moved)?)?;
                        let column: Vec<f64> =
                            residual.iter().zip(&after).map(|(b, a)| (b - a) / step).collect();
                        let white = linear.whitener.apply(segments, &column);
                        (column, white)
                    }
                };
                add_scaled(&mut y, &white, member.values[slot]);
                own.push(white);
                own_raw.push(column);
                free.push((index, slot));
                prior.push(SLAB_OF_LARGEST * largest);
            }
        }
        let (k, n) = (own.len(), linear.columns.len());
        let mut gram =
            Gram { g: DMatrix::zeros(k + n, k + n), b: nalgebra::DVector::zeros(k + n), yy: dot(&y, &y) };
        gram.g.view_mut((k, k), (n, n)).copy_from(&linear.gram);
        for i in 0..k {
            for j in 0..k {
                gram.g[(i, j)] = dot(&own[i], &own[j]);
            }
            for j in 0..n {
                let x = dot(&own[i], column(j));
                gram.g[(i, k + j)] = x;
                gram.g[(k + j, i)] = x;
            }
            gram.b[i] = dot(&own[i], &y);
        }
        for j in 0..n {
            gram.b[k + j] = dot(column(j), &y);
        }
        for i in fresh.keys().copied() {
            for j in 0..n {
                let x = dot(column(i), column(j));
                gram.g[(k + i, k + j)] = x;
                gram.g[(k + j, k + i)] = x;
            }
        }
        prior.extend(spikes);
        let posterior = gram.posterior(&prior, BETA).ok_or(GapError::NoFlights)?;
        Ok(Scored {
            members: members.to_vec(),
            log_evidence: posterior.log_evidence,
            posterior,
            gram,
            prior,
            free,
            own_raw,
            own,
            y,
        })
    }
}

/// Whether an effect leaves no room for another: itself, and where flights show a ratio alone, what stands on its other side.
fn excludes(named: &Candidate, other: &Candidate) -> bool {
    let yaw = |c: &Candidate| {
        c.effect == "yaw_torque_coeff"
            || (c.effect == "inertia_error" && c.fixed.iter().any(|(_, axis)| *axis as usize == 2))
    };
    let thrust = |c: &Candidate| ["mass_error", "thrust_coefficient"].contains(&c.effect);
    named.effect == other.effect || (thrust(named) && thrust(other)) || (yaw(named) && yaw(other))
}

fn add_scaled(y: &mut [f64], column: &[f64], x: f64) {
    for (y, c) in y.iter_mut().zip(column) {
        *y += c * x;
    }
}
