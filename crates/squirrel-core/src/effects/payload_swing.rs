//! A load on a tether under the vehicle: `F_NED += m_l g / l (s_N, s_E, 0) + m_l g e3`, `s'' = -(g / l) s - c s' - a`.
//!
//! `s` is the load's horizontal offset from the vehicle, whose horizontal acceleration is `a`; small angles, damping
//! `c = 0.1 1/s`, in the form `damped` a parameter. The tether is fixed at the centre of mass. A length of 0 is no load.

use super::{Effect, EffectParameter, Scale, is};
use crate::frames::{In, Ned};
use crate::math::{GRAVITY_M_S2, Real, real};
use nalgebra::{Vector2, Vector3};

const DAMPED: usize = 1;

/// Mass and tether of the load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PayloadSwing<T>(pub(super) [T; 4]);

impl<T: Real> Effect<T> for PayloadSwing<T> {
    const NAME: &'static str = "payload_swing";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::size("mass_kg", 0.03, 0.12).growing_with(Scale::Mass),
        EffectParameter::size("length_m", 0.3, 0.9),
        EffectParameter::size("damping_per_s", 0.2, 2.0).only_in(&["damped"]),
        EffectParameter::form(&["light", "damped"]),
    ];

    fn pendulum(&self) -> Option<Pendulum<T>> {
        let [mass_kg, length_m, damping_per_s, form] = self.0;
        let damping_per_s = if is(form, DAMPED) { damping_per_s } else { real(0.1) };
        (length_m > T::zero()).then_some(Pendulum { mass_kg, length_m, damping_per_s })
    }
}

/// A load on a tether.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pendulum<T> {
    /// Mass, kg.
    pub mass_kg: T,
    /// Length of the tether, m; > 0.
    pub length_m: T,
    /// Damping `c`, 1/s.
    pub damping_per_s: T,
}

/// Where the load hangs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PendulumState<T: Real> {
    /// Offset from the vehicle, north and east, m.
    pub offset_m: Vector2<T>,
    /// Its rate, m/s.
    pub velocity_m_s: Vector2<T>,
}

impl<T: Real> PendulumState<T> {
    /// Hanging straight down.
    pub fn at_rest() -> Self {
        Self { offset_m: Vector2::zeros(), velocity_m_s: Vector2::zeros() }
    }
}

impl<T: Real> Pendulum<T> {
    /// Force of the tether on the vehicle, N.
    pub fn force(&self, state: &PendulumState<T>) -> In<Ned, T> {
        let weight = self.mass_kg * real(GRAVITY_M_S2);
        let across = state.offset_m * (weight / self.length_m);
        In::new(Vector3::new(across.x, across.y, weight))
    }

    /// Moves the load exactly over a time of any length, s, while the vehicle accelerates evenly, m/s^2.
    pub fn lead(&self, state: &mut PendulumState<T>, acceleration: In<Ned, T>, dt_s: T) {
        let stiffness = real::<T>(GRAVITY_M_S2) / self.length_m;
        let decay = self.damping_per_s * real(0.5);
        let squared = stiffness - decay * decay;
        let root = squared.abs().sqrt();
        // Cosine and sine over frequency times the decay; their hyperbolic twins where damping wins, written without growth.
        let (cosine, sine) = if squared > T::zero() {
            let (sine, cosine) = (root * dt_s).sin_cos();
            let left = (-decay * dt_s).exp();
            (left * cosine, left * sine / root)
        } else {
            let (slow, fast) = (((root - decay) * dt_s).exp(), (-(root + decay) * dt_s).exp());
            let sine = if root > T::zero() { (slow - fast) / (root * real(2.0)) } else { slow * dt_s };
            ((slow + fast) * real(0.5), sine)
        };
        // Evenly accelerated, the load swings about where it trails.
        let trail = acceleration.vector.xy() * (-T::one() / stiffness);
        let (x, v) = (state.offset_m - trail, state.velocity_m_s);
        state.offset_m = trail + x * cosine + (v + x * decay) * sine;
        state.velocity_m_s = v * cosine - (v * decay + x * stiffness) * sine;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The exact solution against many small steps, lightly damped, critically and beyond.
    #[test]
    fn long_steps_are_exact() {
        for damping_per_s in [0.1, 2.0 * (GRAVITY_M_S2 / 0.5).sqrt(), 40.0] {
            let load = Pendulum { mass_kg: 0.1, length_m: 0.5, damping_per_s };
            let acceleration = In::new(Vector3::new(2.0, -1.0, 5.0));
            let start =
                PendulumState { offset_m: Vector2::new(0.1, 0.0), velocity_m_s: Vector2::new(0.0, 0.3) };
            let (mut long, mut rate) = (start, start);
            load.lead(&mut long, acceleration, 0.7);
            let h = 1e-6;
            for _ in 0..700_000 {
                let pull = rate.offset_m * (-GRAVITY_M_S2 / 0.5) - rate.velocity_m_s * damping_per_s;
                rate.velocity_m_s += (pull - acceleration.vector.xy()) * h;
                rate.offset_m += rate.velocity_m_s * h;
            }
            assert!((long.offset_m - rate.offset_m).norm() < 1e-5, "{damping_per_s}: {long:?} {rate:?}");
            assert!((long.velocity_m_s - rate.velocity_m_s).norm() < 1e-4, "{damping_per_s}");
            load.lead(&mut long, acceleration, 1e6);
            assert!((long.offset_m - acceleration.vector.xy() * (-0.5 / GRAVITY_M_S2)).norm() < 1e-9);
        }
    }

    #[test]
    fn a_load_that_hangs_back_pulls_back() {
        let load = Pendulum { mass_kg: 0.1, length_m: 0.5, damping_per_s: 0.1 };
        let mut state = PendulumState::at_rest();
        assert_eq!(load.force(&state).vector, Vector3::new(0.0, 0.0, 0.1 * GRAVITY_M_S2));
        load.lead(&mut state, In::new(Vector3::new(1.0, 0.0, 0.0)), 0.1);
        assert!(state.offset_m.x < 0.0 && load.force(&state).vector.x < 0.0);
    }
}
