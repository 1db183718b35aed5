//! Which published form of a named effect the flights ask for.

use super::linear::Linear;
use super::point::Member;
use super::refine::Scored;
use super::search::Search;
use crate::GapError;
use squirrel_core::effects::{Effects, FORM, Kind, SizeRange};

/// What another form must be worth, nats.
const FORM_NATS: f64 = 6.0;

impl Search<'_> {
    /// Tries the other forms of each member and keeps what has more evidence.
    ///
    /// # Errors
    /// What the predictor says.
    pub(super) fn choose_forms(&self, linear: &Linear, best: &mut Scored) -> Result<(), GapError> {
        if let Some(other) = self.in_better_forms(linear, best)? {
            *best = other;
        }
        Ok(())
    }

    /// A set with members in other forms, if one of them has more evidence.
    ///
    /// # Errors
    /// What the predictor says.
    pub(super) fn in_better_forms(
        &self,
        linear: &Linear,
        set: &Scored,
    ) -> Result<Option<Scored>, GapError> {
        let mut better: Option<Scored> = None;
        for index in 0..set.members.len() {
            for form in self.other_forms(&better.as_ref().unwrap_or(set).members[index]) {
                let best = better.as_ref().unwrap_or(set);
                let mut members = best.members.clone();
                members[index] = form;
                let scored = self.score(linear, &members)?;
                (self.progress)();
                if scored.log_evidence > best.log_evidence + FORM_NATS && self.is_off(&scored) {
                    better = Some(scored);
                }
            }
        }
        Ok(better)
    }

    /// Name of a member's form; `standard` where there is one only.
    pub(crate) fn form(&self, member: &Member) -> &'static str {
        let list = Effects::<f64>::parameters(self.effect(member)).unwrap_or_default();
        let slot = list.iter().position(|p| p.key == FORM);
        slot.map_or("standard", |slot| match list[slot].kind {
            Kind::OneOf(names) => names[member.values[slot] as usize],
            _ => "standard",
        })
    }

    /// Slots of a member that are sizes in its form.
    pub(super) fn free_slots(&self, member: &Member) -> Vec<usize> {
        let list = Effects::<f64>::parameters(self.effect(member)).unwrap_or_default();
        let form = self.form(member);
        (0..list.len())
            .filter(|slot| {
                matches!(list[*slot].kind, Kind::Size { .. }) && list[*slot].exists_in(form)
            })
            .collect()
    }

    /// The member in each of its other forms, with numbers to start from.
    fn other_forms(&self, member: &Member) -> Vec<Member> {
        let list = Effects::<f64>::parameters(self.effect(member)).unwrap_or_default();
        let Some(slot) = list.iter().position(|p| p.key == FORM) else { return Vec::new() };
        let Kind::OneOf(names) = list[slot].kind else { return Vec::new() };
        let now = names[member.values[slot] as usize];
        (0..names.len())
            .filter(|form| names[*form] != now)
            .map(|form| {
                let mut other = member.clone();
                other.values[slot] = form as f64;
                other.candidate = self.catalogue.other_form(member.candidate, form, slot);
                for (value, parameter) in other.values.iter_mut().zip(list) {
                    let vehicle = &self.predictor.vehicle.vehicle;
                    let Some(range) = parameter.range_in(names[form], vehicle) else { continue };
                    let SizeRange { smallest, largest, signed, .. } = range;
                    match (parameter.exists_in(now), parameter.exists_in(names[form])) {
                        (false, true) if signed => *value = 0.0,
                        (false, true) => *value = (smallest * largest).sqrt(),
                        (true, false) => *value = 0.0,
                        _ => {}
                    }
                }
                other
            })
            .collect()
    }
}
