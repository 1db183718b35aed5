//! Where the frame's drag acts: in the middle of the rotors, unless flights ask for another place.
//!
//! No file says where, and a few hundredths of an arm make more than the noise of calm flights. What
//! they turn is then read into rotors that are elsewhere, each by several of its tolerances, and
//! what those give hides a centre of mass. A place that floats all the time would hide it, too:
//! drag is what tells a centre of mass that is elsewhere from rotors that all are.

use super::column::Column;
use super::day::explain_thrusts;
use super::evidence::BETA;
use super::point::{Airframe, Member};
use super::refine::extended;
use super::{Catalogue, Naming, Search};
use crate::GapError;
use crate::predictor::{DYNAMIC, Predictor};
use squirrel_core::effects::Mimic;
use std::cmp::Ordering;

/// How far from the middle it may be along an axis, one standard deviation, over the arm.
const SD_OF_ARM: f64 = 0.05;
/// What another place must be worth, nats.
const WORTH_NATS: f64 = 10.0;

/// The best explanation, with drag that acts elsewhere if flights ask for it.
///
/// * `progress` - called after each piece of work
///
/// # Errors
/// What the predictor says.
pub(super) fn explain_wherever(
    predictor: &Predictor<'_>,
    catalogue: &mut Catalogue,
    progress: &dyn Fn(),
) -> Result<Naming, GapError> {
    let naming = explain_thrusts(predictor, catalogue, progress)?;
    let has_moments = (3..DYNAMIC).all(|channel| predictor.has_all_of(channel));
    // Asked for once, beside other candidates, it stays free.
    let is_free =
        catalogue.airframe.iter().any(|(number, _)| matches!(number, Airframe::DragCentre { .. }));
    let could_ask = has_moments && predictor.has_channel(0);
    if is_free || !could_ask {
        return Ok(naming);
    }
    let sd_m = SD_OF_ARM * predictor.arm_m();
    let search = Search { predictor, catalogue, gust_m_s: None, progress };
    let asked = search.worth_of_drag_centre(&naming, sd_m)? >= WORTH_NATS;
    // Two names may be the way around one.
    let named = &naming.found.best.members;
    if !asked && named.len() < 2 && !search.turns_as_drag_does(named) {
        return Ok(naming);
    }
    let held = catalogue.airframe.len();
    catalogue.airframe.extend((0..3).map(|axis| (Airframe::DragCentre { axis }, sd_m)));
    let elsewhere = explain_thrusts(predictor, catalogue, progress)?;
    let search = Search { predictor, catalogue, gust_m_s: elsewhere.gust_m_s, progress };
    // Names in calm air against none in gusts are told apart by what they leave: their noises
    // differ.
    let are_gusts = elsewhere.gust_m_s.is_some() && naming.leftover.is_real();
    if asked || are_gusts || search.leads_one_in_the_middle(&elsewhere, &naming)? {
        return Ok(elsewhere);
    }
    catalogue.airframe.truncate(held);
    Ok(naming)
}

impl Search<'_> {
    /// Whether one of the members is a moment that goes with velocity, as that of drag beside the
    /// centre of mass does.
    fn turns_as_drag_does(&self, members: &[Member]) -> bool {
        members.iter().any(|member| self.profile(member).mimic == Mimic::DragElsewhere)
    }

    /// Whether an explanation with drag elsewhere is worth it beside one with drag in the middle.
    fn leads_one_in_the_middle(&self, own: &Naming, other: &Naming) -> Result<bool, GapError> {
        let (best, rival) = (&own.found.best, &other.found.best);
        let may_lead = match best.members.len().cmp(&rival.members.len()) {
            Ordering::Less => true,
            Ordering::Equal => self.turns_as_drag_does(&best.members),
            Ordering::Greater => false,
        };
        if !may_lead {
            return Ok(false);
        }
        let rival = self.score(&own.found.linear, &rival.members)?;
        let mut prior = rival.prior.clone();
        let first = rival.free.len() + self.catalogue.shared_columns() - 3;
        prior[first..first + 3].fill(0.0);
        let held = rival.gram.posterior(&prior, BETA).ok_or(GapError::NotFinite)?;
        Ok(best.log_evidence >= held.log_evidence + WORTH_NATS)
    }

    /// Evidence that another place of drag adds to an explanation, nats.
    ///
    /// * `sd_m` - how far off it may be along an axis
    fn worth_of_drag_centre(&self, naming: &Naming, sd_m: f64) -> Result<f64, GapError> {
        let (linear, best) = (&naming.found.linear, &naming.found.best);
        let segments = &self.predictor.segments;
        let residual = self.predictor.residual(&naming.hypothesis)?;
        let mut places = Vec::new();
        for axis in 0..3 {
            let mut moved = naming.hypothesis.clone();
            moved.drag_centre_m[axis] += sd_m;
            let column = Column::of(self.predictor.slope(&residual, &moved, sd_m, None)?);
            places.push(linear.whitener.apply_to(segments, &column));
        }
        let own = best.columns(linear);
        let known = (0..own.len()).map(Some).chain([None; 3]).collect::<Vec<_>>();
        let all: Vec<&Column> = own.into_iter().chain(&places).collect();
        let gram = extended(&best.gram.g, &known, &all, &best.y);
        let prior = [best.prior.as_slice(), &[sd_m; 3]].concat();
        let with = gram.posterior(&prior, BETA).ok_or(GapError::NotFinite)?;
        Ok(with.log_evidence - best.log_evidence)
    }
}
