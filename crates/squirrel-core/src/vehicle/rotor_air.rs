//! What the air makes of rotors, as numbers of the vehicle.

use super::check::{ParameterError, at_most};
use crate::math::Real;

/// What motion through the air makes of the rotors' thrust, in the standard forms of the effects of
/// these names, which add to it. The flight code does not ask.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RotorAir<T> {
    /// See the effect `axial_inflow`, s/m.
    pub axial_inflow_s_per_m: T,
    /// See the effect `translational_lift`, s^2/m^2.
    pub translational_lift_s2_per_m2: T,
    /// See the effect `flapping_moment`, N m s/m.
    pub flapping_moment_n_m_s_per_m: T,
    /// See the effect `vortex_ring`, a part of the thrust.
    pub vortex_ring_fraction: T,
}

impl<T: Real> RotorAir<T> {
    /// Thrust that asks for rotor speed alone.
    pub fn still() -> Self {
        Self {
            axial_inflow_s_per_m: T::zero(),
            translational_lift_s2_per_m2: T::zero(),
            flapping_moment_n_m_s_per_m: T::zero(),
            vortex_ring_fraction: T::zero(),
        }
    }
    /// The same numbers in another scalar.
    pub(super) fn map<U>(self, to: impl Fn(T) -> U) -> RotorAir<U> {
        RotorAir {
            axial_inflow_s_per_m: to(self.axial_inflow_s_per_m),
            translational_lift_s2_per_m2: to(self.translational_lift_s2_per_m2),
            flapping_moment_n_m_s_per_m: to(self.flapping_moment_n_m_s_per_m),
            vortex_ring_fraction: to(self.vortex_ring_fraction),
        }
    }
    pub(super) fn check(&self) -> Result<(), ParameterError> {
        for (field, number, most) in [
            ("propulsion.axial_inflow_s_per_m", self.axial_inflow_s_per_m, 1.0),
            ("propulsion.translational_lift_s2_per_m2", self.translational_lift_s2_per_m2, 1.0),
            ("propulsion.flapping_moment_n_m_s_per_m", self.flapping_moment_n_m_s_per_m, 100.0),
            ("propulsion.vortex_ring_fraction", self.vortex_ring_fraction, 1.0),
        ] {
            at_most(field, number, most, "must be finite and plausible in size")?;
        }
        Ok(())
    }
}
