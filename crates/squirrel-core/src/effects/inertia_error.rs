//! Inertia about one axis off by a fraction: `J_ii (1 + e)`.

use super::{Alteration, Declared, Effect, EffectParameter, Kind, Ratio, Shown, SideOf, Words, is};
use crate::math::Real;

/// Place of z among the axes.
const Z: usize = 2;

/// Which axis, and the fraction by which its inertia exceeds the nominal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct InertiaError<T>(pub(super) [T; 2]);

impl<T: Real> Effect<T> for InertiaError<T> {
    const NAME: &'static str = "inertia_error";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::new("axis", Kind::OneOf(&["x", "y", "z"])),
        EffectParameter::signed("inertia_fraction", 0.12, 0.4).declared(Declared::Inertia),
    ];
    const WORDS: Words = Words {
        what: "inertia in @",
        more: "More inertia in @",
        less: "Less inertia in @",
        fly: "doublets about one axis at a time",
    };
    const SHOWN: Shown = Shown::MOMENTS;
    const IS_OF_MOMENTS: bool = true;
    const SIDE_OF: Option<SideOf> =
        Some(SideOf { ratio: Ratio::TorqueOverInertia, choice: Some(Z) });

    fn alter(&self, airframe: &mut Alteration<T>) {
        let [axis, fraction] = self.0;
        for i in 0..3 {
            if is(axis, i) {
                airframe.inertia_kg_m2[(i, i)] *= T::one() + fraction;
            }
        }
    }
}
