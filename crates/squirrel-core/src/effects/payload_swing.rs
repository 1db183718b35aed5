//! A load on a tether under the vehicle: `F_NED += T u`, `T = m_l (u . (g e3 - a) + |r'|^2 / l)`,
//! `s'' = -T / m_l s / l - c s' - a`.
//!
//! A spherical pendulum on a pivot whose acceleration is `a`: `r = l u` is the load's place from the
//! vehicle, `s` its horizontal part. A load that is lifted quicker weighs more, one that swings far
//! swings slower and pulls more below than at its turns. Damping `c = 0.1 1/s`, in the form `damped`
//! a parameter. The tether is fixed at the centre of mass and pulls, or hangs loose; it stays a
//! little below the horizontal, and a log that says otherwise than any flight leaves it finite. A
//! length of 0 is no load.

use super::{Effect, EffectParameter, Fitted, Response, Scale, Shown, Tolerance, Words, is};
use crate::lane::Lane;
use crate::lane::vector::{dot, scaled};
use crate::math::{GRAVITY_M_S2, Real, real};
use crate::numbers;

const DAMPED: usize = 1;
/// Height of a tether below the vehicle over its length, at least.
const BELOW_MIN: f64 = 0.15;
/// Half a step from which on the middle of a step says nothing, s.
const HALF_MAX_S: f64 = 0.02;
/// Tension over the load's mass, at most, m/s^2: nine times its weight.
const TENSION_MAX_M_S2: f64 = 9.0 * GRAVITY_M_S2;

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
    /// A tether as it hangs.
    Tether {
        /// `m_l`, kg.
        mass_kg,
        /// `u`, world frame.
        along [3],
        /// `|r'|^2 / l`, m/s^2.
        circling_m_s2
    }
}

impl<L: Lane> Tether<L> {
    /// Its pull over the load's mass where the vehicle's acceleration is known, m/s^2.
    ///
    /// * `acceleration` - of the vehicle, world frame, m/s^2
    #[inline(always)]
    pub fn tension_m_s2(&self, acceleration: &[L; 3]) -> L {
        let [north, east, down] = *acceleration;
        let falling = [north, east, down - L::of(GRAVITY_M_S2)];
        let tension = self.circling_m_s2 - dot(&self.along, &falling);
        tension.upper(L::of(0.0)).lower(L::of(TENSION_MAX_M_S2))
    }

    /// Its pull on the vehicle, world frame, N.
    ///
    /// Along the tether the load is accelerated as the vehicle is: of all that acts on both there
    /// beside gravity, it is carried by its share.
    ///
    /// * `force` - on the vehicle without gravity and tether, world frame, N
    /// * `inverse_mass` - of the vehicle, 1/kg
    #[inline(always)]
    pub fn force(&self, force: &[L; 3], inverse_mass: L) -> [L; 3] {
        let both = L::of(1.0) + self.mass_kg * inverse_mass;
        let tension = (self.circling_m_s2 - dot(&self.along, force) * inverse_mass) / both;
        scaled(&self.along, self.mass_kg * tension.upper(L::of(0.0)).lower(L::of(TENSION_MAX_M_S2)))
    }
}

numbers! {
    /// A load over steps of one length: what it does in one is linear in where it hangs.
    Swing {
        /// `m_l`, kg.
        mass_kg,
        /// `1 / l`, 1/m.
        per_length,
        /// Where the load trails, over the vehicle's acceleration, s^2.
        trail,
        /// `g / l`, 1/s^2.
        stiffness,
        /// `c / 2`, 1/s.
        decay,
        /// Decaying cosine of a step.
        cosine,
        /// Decaying sine of a step over its frequency, s.
        sine,
        /// Half a step, s.
        half_s
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
        let (per_length, trail) = (T::one() / self.length_m, -T::one() / stiffness);
        let half_s =
            if dt_s < real(2.0 * HALF_MAX_S) { dt_s * real(0.5) } else { real(HALF_MAX_S) };
        Swing { mass_kg: self.mass_kg, per_length, trail, stiffness, decay, cosine, sine, half_s }
    }
}

impl<L: Lane> Swing<L> {
    /// How the tether hangs.
    #[inline(always)]
    pub fn tether(&self, state: &PendulumState<L>) -> Tether<L> {
        let ([north, east], [u, v]) = (state.offset_m, state.velocity_m_s);
        let (x, y) = (north * self.per_length, east * self.per_length);
        let widest = L::of(1.0 - BELOW_MIN * BELOW_MIN);
        let within = (widest / (x * x + y * y).upper(widest)).root();
        let (x, y) = (x * within, y * within);
        let below = (L::of(1.0) - (x * x + y * y)).root();
        let sinking = (x * u + y * v) / below;
        let circling_m_s2 = (u * u + v * v + sinking * sinking) * self.per_length;
        Tether { mass_kg: self.mass_kg, along: [x, y, below], circling_m_s2 }
    }

    /// Moves the load over a step, in which the vehicle accelerates evenly: exactly while it swings
    /// little, and to second order in the step what large swings and climbs add.
    ///
    /// * `acceleration` - north, east and down, m/s^2
    #[inline(always)]
    pub fn lead(&self, state: &mut PendulumState<L>, acceleration: [L; 3]) {
        let gravity = L::of(GRAVITY_M_S2);
        let mut middle = *state;
        for i in 0..2 {
            middle.offset_m[i] = state.offset_m[i] + state.velocity_m_s[i] * self.half_s;
        }
        let tether = self.tether(&middle);
        let more_m_s2 = tether.tension_m_s2(&acceleration) - gravity;
        for i in 0..2 {
            // Evenly accelerated, the load swings about where it trails.
            let trail = (acceleration[i] + more_m_s2 * tether.along[i]) * self.trail;
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
    use nalgebra::{Vector2, Vector3};

    /// Long steps of a small swing against many short ones, lightly damped, critically and beyond.
    #[test]
    fn long_steps_of_small_swings_are_exact() {
        for damping_per_s in [0.1, 2.0 * (GRAVITY_M_S2 / 0.5).sqrt(), 40.0] {
            let load = Pendulum { mass_kg: 0.1, length_m: 0.5, damping_per_s };
            let acceleration = Vector2::new(2.0, -1.0) * 1e-4;
            let start = [Vector2::new(0.1, 0.0) * 1e-4, Vector2::new(0.0, 0.3) * 1e-4];
            let mut long =
                PendulumState { offset_m: start[0].into(), velocity_m_s: start[1].into() };
            let [mut offset_m, mut velocity_m_s] = start;
            load.over(0.7).lead(&mut long, [acceleration.x, acceleration.y, 0.0]);
            let h = 1e-6;
            for _ in 0..700_000 {
                let pull = offset_m * (-GRAVITY_M_S2 / 0.5) - velocity_m_s * damping_per_s;
                velocity_m_s += (pull - acceleration) * h;
                offset_m += velocity_m_s * h;
            }
            let near = |a: [f64; 2], b: Vector2<f64>| (Vector2::from(a) - b).norm() < 1e-8;
            assert!(near(long.offset_m, offset_m), "{damping_per_s}: {long:?}");
            assert!(near(long.velocity_m_s, velocity_m_s), "{damping_per_s}: {long:?}");
            load.over(1e6).lead(&mut long, [acceleration.x, acceleration.y, 0.0]);
            let trails = acceleration * (-0.5 / GRAVITY_M_S2);
            assert!((Vector2::from(long.offset_m) - trails).norm() < 1e-9);
        }
    }

    #[test]
    fn a_load_that_hangs_back_pulls_back() {
        let load = Pendulum { mass_kg: 0.1, length_m: 0.5, damping_per_s: 0.1 };
        let mut state = PendulumState::at_rest();
        let (swing, mass_kg) = (load.over(0.01), 0.5);
        let hover = [0.0, 0.0, -(mass_kg + load.mass_kg) * GRAVITY_M_S2];
        let pull = |state: &PendulumState<f64>, force: [f64; 3]| {
            Vector3::from(swing.tether(state).force(&force, 1.0 / mass_kg))
        };
        let weight = Vector3::new(0.0, 0.0, 0.1 * GRAVITY_M_S2);
        assert!((pull(&state, hover) - weight).norm() < 1e-12);
        let lifted = pull(&state, hover.map(|force| 1.5 * force));
        assert!((lifted - weight * 1.5).norm() < 1e-12, "both are lifted");
        swing.lead(&mut state, [1.0, 0.0, 0.0]);
        assert!(state.offset_m[0] < 0.0 && pull(&state, hover).x < 0.0);
    }

    /// A vehicle of 0.5 kg, pushed up and down and to and fro, with a load of 0.15 kg on 0.6 m, beside
    /// two point masses on a stiff rod: what the rod pulls at swings of half a radian and more, in
    /// steps of a log.
    #[test]
    fn the_pull_is_that_of_a_rod_between_two_masses() {
        let load = Pendulum { mass_kg: 0.15, length_m: 0.6, damping_per_s: 0.0 };
        let (mass_kg, h, every) = (0.5, 1e-4, 40);
        let (swing, mut state) = (load.over(h * f64::from(every)), PendulumState::at_rest());
        let gravity = Vector3::new(0.0, 0.0, GRAVITY_M_S2);
        let (mut along, mut rate) =
            (Vector3::new(0.0, 0.0, load.length_m), Vector3::<f64>::zeros());
        let (mut error, mut size, mut widest): (f64, f64, f64) = (0.0, 0.0, 0.0);
        let mut gained = Vector3::zeros();
        for step in 0..200_000 {
            let t = h * f64::from(step);
            let wave = |size: f64, hz: f64| size * (core::f64::consts::TAU * hz * t).sin();
            let lift = (mass_kg + load.mass_kg) * GRAVITY_M_S2;
            let force =
                Vector3::new(wave(0.5, 0.5), wave(0.3, 0.8), -lift * (1.0 + wave(0.3, 0.6)));
            let u = along / load.length_m;
            // The rod keeps its length: u . r'' = -|r'|^2 / l.
            let pull = load.mass_kg
                * (rate.norm_squared() / load.length_m - u.dot(&force) / mass_kg)
                / (1.0 + load.mass_kg / mass_kg);
            let acceleration = (force + u * pull) / mass_kg + gravity;
            if step % every == 0 && step > 0 {
                swing.lead(&mut state, (gained / (h * f64::from(every))).into());
                gained = Vector3::zeros();
                let ours = swing.tether(&state).force(&force.into(), 1.0 / mass_kg);
                error += (Vector3::<f64>::from(ours) - u * pull).norm_squared();
                size += (u * pull - load.mass_kg * gravity).norm_squared();
            }
            widest = widest.max(u.z.acos());
            rate += (gravity - u * (pull / load.mass_kg) - acceleration) * h;
            along += rate * h;
            along *= load.length_m / along.norm();
            gained += acceleration * h;
        }
        assert!(widest > 0.5, "{widest}");
        assert!((error / size).sqrt() < 0.01, "{}", (error / size).sqrt());
    }
}
