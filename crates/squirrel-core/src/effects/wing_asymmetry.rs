//! One wing gives less: `N (1 - e)` on its side, taken from the flat plate's force.

use super::{Effect, EffectParameter, Kind, Situation, is};
use crate::aero::flat_plate;
use crate::frames::{Body, Wrench};
use crate::math::Real;

/// Which side, and the fraction that it lacks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WingAsymmetry<T>(pub(super) [T; 2]);

impl<T: Real> Effect<T> for WingAsymmetry<T> {
    const NAME: &'static str = "wing_asymmetry";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::new("side", Kind::OneOf(&["left", "right"])),
        EffectParameter::size("loss_fraction", 0.12, 0.5),
    ];

    #[inline(always)]
    fn wrench(&self, situation: &Situation<'_, T>) -> Wrench<Body, T> {
        let Some(wing) = situation.wing else { return Wrench::zero() };
        let [side, loss] = self.0;
        let mut less =
            flat_plate::normal_forces(wing, situation.air, situation.deployment).map(|n| -n * loss);
        // The other side keeps its force.
        less[usize::from(is(side, 0))] = T::zero();
        flat_plate::pair_wrench(wing, less)
    }
}
