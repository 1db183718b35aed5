//! A load on a tether under the vehicle: `F_NED += m_l g / l (s_N, s_E, 0) + m_l g e3`,
//! `s'' = -(g / l) s - c s' - a`.
//!
//! `s` is the load's horizontal offset from the vehicle, whose horizontal acceleration is `a`;
//! small angles, damping `c = 0.1 1/s`, in the form `damped` a parameter. The tether is fixed at
//! the centre of mass. A length of 0 is no load.

use super::{Effect, EffectParameter, Fitted, Response, Scale, Shown, Tolerance, Words, is};
use crate::lane::Lane;
use crate::math::{GRAVITY_M_S2, Real, real};
use crate::numbers;

const DAMPED: usize = 1;

/// Mass and tether of the load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PayloadSwing<T>(pub(super) [T; 4]);

impl<T: Real> Effect<T> for PayloadSwing<T> {
    const NAME: &'static str = "payload_swing";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::size("mass_kg", 0.03, 0.12)
            .growing_with(Scale::Mass)
            .within(Tolerance::Nothing),
        EffectParameter::size("length_m", 0.3, 0.9),
        EffectParameter::size("damping_per_s", 0.2, 2.0).only_in(&["damped"]),
        EffectParameter::form(&["light", "damped"]),
    ];
    const WORDS: Words = Words {
        what: "swinging load",
        more: "A load swings below",
        less: "A lighter load swings below",
        fly: "stop and go along one axis at 0.6 to 0.9 Hz, then hover",
    };
    const SHOWN: Shown = Shown::HORIZONTAL;
    const RESPONSE: Response = Response::Swings { length: "length_m" };
    const FITTED: Fitted = Fitted::Never;

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

numbers! {
    /// Where the load hangs.
    PendulumState {
        /// Offset from the vehicle, north and east, m.
        offset_m [2],
        /// Its rate, m/s.
        velocity_m_s [2]
    }
}

impl<L: Lane> PendulumState<L> {
    /// Hanging straight down.
    pub fn at_rest() -> Self {
        Self::all(L::of(0.0))
    }
}

numbers! {
    /// A load over steps of one length: what it does in one is linear in where it hangs.
    Swing {
        /// `m_l g`, N.
        weight_n,
        /// Pull across over offset, N/m.
        pull_per_m,
        /// Where the load trails, over the vehicle's acceleration, s^2.
        trail,
        /// `g / l`, 1/s^2.
        stiffness,
        /// `c / 2`, 1/s.
        decay,
        /// Decaying cosine of a step.
        cosine,
        /// Decaying sine of a step over its frequency, s.
        sine
    }
}

impl<T: Real> Pendulum<T> {
    /// The load over steps of any length, s.
    pub fn over(&self, dt_s: T) -> Swing<T> {
        let stiffness = real::<T>(GRAVITY_M_S2) / self.length_m;
        let decay = self.damping_per_s * real(0.5);
        let squared = stiffness - decay * decay;
        let root = squared.abs().sqrt();
        // Cosine and sine over frequency times the decay; their hyperbolic twins where damping
        // wins, written without growth.
        let (cosine, sine) = if squared > T::zero() {
            let (sine, cosine) = (root * dt_s).sin_cos();
            let left = (-decay * dt_s).exp();
            (left * cosine, left * sine / root)
        } else {
            let (slow, fast) = (((root - decay) * dt_s).exp(), (-(root + decay) * dt_s).exp());
            let sine =
                if root > T::zero() { (slow - fast) / (root * real(2.0)) } else { slow * dt_s };
            ((slow + fast) * real(0.5), sine)
        };
        let weight_n = self.mass_kg * real(GRAVITY_M_S2);
        let (pull_per_m, trail) = (weight_n / self.length_m, -T::one() / stiffness);
        Swing { weight_n, pull_per_m, trail, stiffness, decay, cosine, sine }
    }
}

impl<L: Lane> Swing<L> {
    /// Force of the tether on the vehicle, world frame, N.
    #[inline(always)]
    pub fn force(&self, state: &PendulumState<L>) -> [L; 3] {
        let [north, east] = state.offset_m;
        [north * self.pull_per_m, east * self.pull_per_m, self.weight_n]
    }

    /// Moves the load exactly over a step, in which the vehicle accelerates evenly.
    ///
    /// * `acceleration` - north and east, m/s^2
    #[inline(always)]
    pub fn lead(&self, state: &mut PendulumState<L>, acceleration: [L; 2]) {
        for i in 0..2 {
            // Evenly accelerated, the load swings about where it trails.
            let trail = acceleration[i] * self.trail;
            let (x, v) = (state.offset_m[i] - trail, state.velocity_m_s[i]);
            state.offset_m[i] = trail + x * self.cosine + (v + x * self.decay) * self.sine;
            state.velocity_m_s[i] =
                v * self.cosine - (v * self.decay + x * self.stiffness) * self.sine;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;

    /// The exact solution against many small steps, lightly damped, critically and beyond.
    #[test]
    fn long_steps_are_exact() {
        for damping_per_s in [0.1, 2.0 * (GRAVITY_M_S2 / 0.5).sqrt(), 40.0] {
            let load = Pendulum { mass_kg: 0.1, length_m: 0.5, damping_per_s };
            let acceleration = Vector2::new(2.0, -1.0);
            let mut long = PendulumState { offset_m: [0.1, 0.0], velocity_m_s: [0.0, 0.3] };
            let (mut offset_m, mut velocity_m_s) = (Vector2::new(0.1, 0.0), Vector2::new(0.0, 0.3));
            load.over(0.7).lead(&mut long, acceleration.into());
            let h = 1e-6;
            for _ in 0..700_000 {
                let pull = offset_m * (-GRAVITY_M_S2 / 0.5) - velocity_m_s * damping_per_s;
                velocity_m_s += (pull - acceleration) * h;
                offset_m += velocity_m_s * h;
            }
            assert!(
                (Vector2::from(long.offset_m) - offset_m).norm() < 1e-5,
                "{damping_per_s}: {long:?}"
            );
            assert!(
                (Vector2::from(long.velocity_m_s) - velocity_m_s).norm() < 1e-4,
                "{damping_per_s}"
            );
            load.over(1e6).lead(&mut long, acceleration.into());
            let trails = acceleration * (-0.5 / GRAVITY_M_S2);
            assert!((Vector2::from(long.offset_m) - trails).norm() < 1e-9);
        }
    }

    #[test]
    fn a_load_that_hangs_back_pulls_back() {
        let load = Pendulum { mass_kg: 0.1, length_m: 0.5, damping_per_s: 0.1 };
        let mut state = PendulumState::at_rest();
        let swing = load.over(0.1);
        assert_eq!(swing.force(&state), [0.0, 0.0, 0.1 * GRAVITY_M_S2]);
        swing.lead(&mut state, [1.0, 0.0]);
        assert!(state.offset_m[0] < 0.0 && swing.force(&state)[0] < 0.0);
    }
}
