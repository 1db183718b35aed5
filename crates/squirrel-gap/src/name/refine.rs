//! The numbers of one set of effects: Gauss-Newton through the simulator, everything else floating
//! with its tolerance.

use super::column::Column;
use super::evidence::{BETA, Gram, Posterior, products};
use super::linear::{Linear, height_columns};
use super::parameters::{SLAB_OF_LARGEST, bounds};
use super::point::{Member, Other, Point};
use super::search::{LEAST, Search};
use crate::GapError;
use nalgebra::DMatrix;
use squirrel_core::effects::{Effects, Scale, SizeRange};
use std::collections::BTreeMap;
use std::rc::Rc;

/// Most steps of a refinement.
const STEPS_MAX: usize = 10;
/// Evidence that a step towards the mode may cost, nats.
const STEP_NATS: f64 = 1.0;
/// Part of the smallest size worth reporting below which a step is the last.
const CONVERGED: f64 = 0.01;
/// The same for a step after which columns are what they were, unless they grow from nothing: that
/// of the difference that makes them.
const CLOSE: f64 = 0.1;

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
    pub(crate) own_raw: Vec<Rc<Column>>,
    pub(crate) own: Vec<Rc<Column>>,
    /// Where everything else is held, as in [`Point::base`], and whitened columns of heights, by
    /// index, if they matter there.
    base: Vec<f64>,
    heights: BTreeMap<usize, Rc<Column>>,
    /// Whitened measurement, with the free numbers' part in it.
    pub(crate) y: Column,
}

impl Scored {
    /// Whitened columns in the order of the posterior: of the free numbers, then of everything
    /// else, heights as they act here.
    pub(super) fn columns<'a>(&'a self, linear: &'a Linear) -> Vec<&'a Column> {
        let others = linear.columns.iter().enumerate();
        let here =
            others.map(|(index, column)| self.heights.get(&index).map_or(column, |here| &**here));
        self.own.iter().map(|column| &**column).chain(here).collect()
    }
}

impl Search<'_> {
    /// Refines the numbers of a set by Gauss-Newton through the simulator, everything else floating
    /// with its tolerance.
    ///
    /// # Errors
    /// What the predictor says.
    pub(crate) fn score(&self, linear: &Linear, members: &[Member]) -> Result<Scored, GapError> {
        self.score_towards(linear, members, None, f64::NEG_INFINITY)
    }

    /// As [`Self::score`], given up after the first step that does not come near what the set must
    /// reach.
    ///
    /// * `from` - the set that the last member was added to: everything else starts where it is
    ///   there
    /// * `near` - evidence that each step must lead to, nats
    ///
    /// # Errors
    /// As [`Self::score`].
    pub(super) fn score_towards(
        &self,
        linear: &Linear,
        members: &[Member],
        from: Option<&Scored>,
        near: f64,
    ) -> Result<Scored, GapError> {
        let mut base = from.map_or(&linear.point.base, |from| &from.base).clone();
        let along = self.moving_along(linear, members);
        let moved_already =
            from.map_or(Vec::new(), |from| self.moving_along(linear, &from.members));
        // A lag that is new explains what others were taken to be off for: they start at nothing.
        let mut moved = false;
        for (column, _) in
            along.iter().filter(|(column, _)| *column < self.catalogue.parameters.len())
        {
            if moved_already.iter().all(|(other, _)| other != column) {
                moved |= base[*column] != 0.0;
                base[*column] = 0.0;
            }
        }
        let mut best = self.evaluate(linear, members, &base, from, !moved)?;
        let flat = members.iter().any(|member| self.catalogue.starts_flat(member.candidate));
        let mut share = 1.0;
        for _ in 0..STEPS_MAX {
            let mut next = best.members.clone();
            let mut moved: f64 = 0.0;
            for (column, (member, slot)) in best.free.iter().enumerate() {
                let range = self.range(&next[*member], *slot);
                let (low, most) = self.bounds(&next[*member], *slot);
                let low = if range.signed { low } else { LEAST * range.smallest };
                let smallest = range.smallest;
                let value = &mut next[*member].values[*slot];
                let target = best.posterior.mean[column].clamp(low, most);
                let step = share * (target - *value);
                moved = moved.max(step.abs() / smallest);
                *value += step;
            }
            let before = base.clone();
            for (column, sd) in &along {
                let target =
                    best.posterior.mean[best.free.len() + column].clamp(-3.0 * sd, 3.0 * sd);
                let step = share * (target - base[*column]);
                moved = moved.max(0.1 * step.abs() / sd);
                base[*column] += step;
            }
            if moved < CONVERGED {
                break;
            }
            let scored =
                self.evaluate(linear, &next, &base, Some(&best), moved < CLOSE && !flat)?;
            // Where the model is linear, every point of it has the same evidence: the mode is where
            // steps end.
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
            if best.log_evidence < near {
                break;
            }
        }
        Ok(best)
    }

    /// Columns that bend so much beside some members that they are refined with them, with their
    /// tolerances: heights where thrust feels them, and lags and delays beside one of them that is
    /// new.
    fn moving_along(&self, linear: &Linear, members: &[Member]) -> Vec<(usize, f64)> {
        let catalogue = self.catalogue;
        let bends = |m: &Member| catalogue.bends(m.candidate);
        let is_new =
            |m: &Member| !linear.point.members.iter().any(|other| other.candidate == m.candidate);
        let mut all = Vec::new();
        if members.iter().any(|m| bends(m) && is_new(m)) {
            let own = |p: usize| members.iter().any(|m| m.candidate == p);
            let free = catalogue.parameters.iter().enumerate();
            let bending = free.filter(|(_, p)| {
                catalogue.bends(p.candidate) && !own(p.candidate) && p.tolerance > 0.0
            });
            all.extend(bending.map(|(column, p)| (column, p.tolerance)));
        }
        if catalogue.feels_height(members) {
            let sensors = catalogue.shared_columns()..catalogue.columns(self.predictor);
            all.extend(sensors.filter_map(|column| match catalogue.other(column) {
                (Other::Height { .. }, sd) => Some((column, sd)),
                _ => None,
            }));
        }
        all
    }

    /// Whether a number of a member has one slope all along: it is in the catalogue's linear part
    /// and no lag.
    fn keeps_slope(&self, member: &Member, slot: usize) -> bool {
        let own = &self.catalogue.candidates[member.candidate].parameters;
        own.iter().map(|p| &self.catalogue.parameters[*p]).any(|p| p.slot == slot)
            && !self.catalogue.bends(member.candidate)
            && !self.catalogue.starts_flat(member.candidate)
    }

    /// Range of a number of a member.
    pub(crate) fn range(&self, member: &Member, slot: usize) -> SizeRange {
        let list = Effects::<f64>::parameters(self.effect(member)).unwrap_or_default();
        let chosen = SizeRange { smallest: 1.0, largest: 1.0, signed: true, scale: Scale::Fixed };
        list[slot].range_in(self.form(member), &self.predictor.vehicle.vehicle).unwrap_or(chosen)
    }

    /// How far a number of a member may go.
    fn bounds(&self, member: &Member, slot: usize) -> (f64, f64) {
        let list = Effects::<f64>::parameters(self.effect(member)).unwrap_or_default();
        bounds(&self.predictor.vehicle.vehicle, &list[slot], &self.range(member, slot))
    }

    /// Evidence of a set, linearised in its free numbers where they are.
    ///
    /// * `before` - the same set with other numbers, or without its last member: columns that
    ///   hardly bend are its
    /// * `close` - it is so close that all of its columns hold here
    fn evaluate(
        &self,
        linear: &Linear,
        members: &[Member],
        base: &[f64],
        before: Option<&Scored>,
        close: bool,
    ) -> Result<Scored, GapError> {
        let segments = &self.predictor.segments;
        let mut point = Point { members: members.to_vec(), base: base.to_vec() };
        let mut spikes = linear.tolerance.clone();
        for member in members {
            for (p, parameter) in self.catalogue.parameters.iter().enumerate() {
                // Another rotor may still be off by its tolerance; the payload is one thing at
                // several lengths.
                let same = parameter.candidate == member.candidate
                    || self.catalogue.is_one_thing(parameter.candidate, member.candidate);
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
            let of_flights =
                self.catalogue.shared_columns()..self.catalogue.columns(self.predictor);
            for column in of_flights {
                if matches!(self.catalogue.other(column).0, Other::Height { .. }) {
                    spikes[column] = 0.0;
                }
            }
        }
        let mut heights =
            before.filter(|_| close).map_or_else(BTreeMap::new, |before| before.heights.clone());
        let heights_hold = !heights.is_empty();
        if !heights_hold {
            for (index, column) in
                height_columns(self.predictor, self.catalogue, &point, &residual)?
            {
                heights.insert(index, Rc::new(linear.whitener.apply_to(segments, &column)));
            }
        }
        let column = |j: usize| heights.get(&j).map_or(&linear.columns[j], |column| &**column);
        for (j, x) in point.base.iter().enumerate() {
            if *x != 0.0 {
                column(j).add_scaled_to(&mut y, *x);
            }
        }
        let (mut own, mut own_raw, mut free, mut prior) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        // Where a column is among those of before, if it holds here.
        let mut places = Vec::new();
        for (index, member) in members.iter().enumerate() {
            for slot in self.free_slots(member) {
                let SizeRange { smallest, largest, .. } = self.range(member, slot);
                let place = before
                    .filter(|_| close || self.keeps_slope(member, slot))
                    .and_then(|before| self.place(before, index, member, slot));
                let (column, white) = if let Some((before, place)) = before.zip(place) {
                    (before.own_raw[place].clone(), before.own[place].clone())
                } else {
                    let step = 0.1 * smallest;
                    let mut moved = point.clone();
                    moved.members[index].values[slot] += step;
                    let moved = self.hypothesis(&moved)?;
                    let column = Column::of(self.predictor.slope(&residual, &moved, step, None)?);
                    let white = linear.whitener.apply_to(segments, &column);
                    (Rc::new(column), Rc::new(white))
                };
                white.add_scaled_to(&mut y, member.values[slot]);
                own.push(white);
                own_raw.push(column);
                places.push(place);
                free.push((index, slot));
                prior.push(SLAB_OF_LARGEST * largest);
            }
        }
        let n = linear.columns.len();
        // Products of columns that are not new are known.
        let (known, offset) =
            before.map_or((&linear.gram, 0), |before| (&before.gram.g, before.free.len()));
        let is_new = |j: usize| heights.contains_key(&j) && !heights_hold;
        places.extend((0..n).map(|j| (!is_new(j)).then_some(offset + j)));
        let all: Vec<&Column> = own.iter().map(|c| &**c).chain((0..n).map(&column)).collect();
        let y = Column::of(y);
        let gram = extended(known, &places, &all, &y);
        prior.extend(spikes);
        let posterior = gram.posterior(&prior, BETA).ok_or(GapError::NotFinite)?;
        Ok(Scored {
            members: members.to_vec(),
            log_evidence: posterior.log_evidence,
            posterior,
            gram,
            prior,
            free,
            own_raw,
            own,
            base: base.to_vec(),
            heights,
            y,
        })
    }

    /// Where the column of a number of a member is among those of another set that has the same
    /// member at the same place.
    fn place(&self, other: &Scored, index: usize, member: &Member, slot: usize) -> Option<usize> {
        let same =
            |m: &Member| m.candidate == member.candidate && self.form(m) == self.form(member);
        other.members.get(index).filter(|m| same(m))?;
        other.free.iter().position(|free| *free == (index, slot))
    }

    /// The last step of a refinement that has converged, too short to be worth another look.
    pub(super) fn finish(&self, best: &mut Scored) {
        for (column, (member, slot)) in best.free.iter().enumerate() {
            let SizeRange { smallest, .. } = self.range(&best.members[*member], *slot);
            let step = best.posterior.mean[column] - best.members[*member].values[*slot];
            if step.abs() < CONVERGED * smallest {
                best.members[*member].values[*slot] += step;
            }
        }
    }
}

/// Inner products of columns of which some have places in known products.
pub(super) fn extended(
    known: &DMatrix<f64>,
    places: &[Option<usize>],
    columns: &[&Column],
    y: &Column,
) -> Gram {
    let n = columns.len();
    let new: Vec<usize> = (0..n).filter(|i| places[*i].is_none()).collect();
    let with_new: Vec<&Column> = new.iter().map(|i| columns[*i]).chain([y]).collect();
    let inner = products(&with_new, &[columns, &[y]].concat());
    let mut g = DMatrix::from_fn(n, n, |i, j| match (places[i], places[j]) {
        (Some(i), Some(j)) => known[(i, j)],
        _ => 0.0,
    });
    for (row, i) in new.iter().enumerate() {
        for j in 0..n {
            g[(*i, j)] = inner[(row, j)];
            g[(j, *i)] = inner[(row, j)];
        }
    }
    Gram { g, b: inner.row(new.len()).columns(0, n).transpose(), yy: inner[(new.len(), n)] }
}
