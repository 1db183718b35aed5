//! Whether a number is off: beyond what the vehicle file allows, and neither at the end of what is
//! plausible nor past it, where it was forced.

use super::point::Member;
use super::ranked::ratio;
use super::refine::Scored;
use super::search::{LEAST, Search};
use super::standing::CLEAR_BESIDE;
use super::{CLEAR, Naming};
use squirrel_core::effects::Response;

/// Tolerances beyond which a number is off: what is inside them the vehicle file allows.
pub(super) const TOLERANCES_MIN: f64 = 3.0;
/// Part of its bounds at which a number is at its end.
const AT_ITS_END: f64 = 0.98;
/// How much larger than the largest plausible size a number may be.
const PLAUSIBLE: f64 = 1.3;

impl Search<'_> {
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
    pub(super) fn is_beyond_tolerance(&self, member: &Member) -> bool {
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
            || standard.any(|p| {
                off(before[p.slot], member.values[p.slot])
                    >= TOLERANCES_MIN * self.catalogue.least(p)
            })
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
        let least = if best.members.len() > 1 { CLEAR_BESIDE } else { CLEAR };
        let unclear = (0..best.members.len()).filter(|i| clear(i) < least);
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
}
