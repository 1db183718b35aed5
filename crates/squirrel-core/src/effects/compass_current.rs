//! A compass that follows the current of the motors: `psi_measured = psi + b L`, `L = sum n^3 / (N n_hover^3)`.
//!
//! Power leads make a field in proportion to their current, which turns the heading in proportion to it while it is small. At
//! one voltage the current goes as the rotors' power, with the cube of their speed, so that any log with commands tells it.

use super::{Effect, EffectParameter};
use crate::math::Real;

/// Heading error in hover.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompassCurrent<T>(pub(super) [T; 1]);

impl<T: Real> Effect<T> for CompassCurrent<T> {
    const NAME: &'static str = "compass_current";
    const IS_OF_SENSORS: bool = true;
    const PARAMETERS: &'static [EffectParameter] =
        &[EffectParameter::signed("heading_in_hover_rad", 0.05, 0.35)];

    fn heading_per_load_rad(&self) -> T {
        self.0[0]
    }
}
