//! Rotor wash: the rotors blow on spread wings.
//!
//! Form `jets`: each rotor's jet has the speed of momentum theory
//! ([`induced`](crate::aero::induced)), `v_j = v_i k` with `k = 1 + s / sqrt(1 + s^2)` at `s`
//! radii below the disc (Leishman, Principles of Helicopter Aerodynamics, ch. 2: a contracting
//! wake), and the area that goes with it. It is taken as a square, so that what it covers of a wing
//! is a product of two lengths, and is carried back by `(u, v) gap / (v_j - w)`. Where it covers a
//! wing the wing has stalled air of the jet instead of its own:
//!
//! ```text
//! dN = g S_c (1/2 rho V_j^2 C(a_j) - N / S)     V_j^2 = u^2 + v^2 + (w - v_j)^2
//! ```
//! with the flat plate's `N / S` taken away. Form `of_thrust`: a part of the thrust, whatever the
//! speed (10 % on a tilt rotor: Felker and Light 1988). Neither knows of the wings' work on the
//! rotors, nor of swirl.

use super::{Acts, Effect, EffectParameter, Forms, Mimic, Shown, Situation, Words, absent, is};
use crate::aero::{BodyWrench, flat_plate, induced};
use crate::lane::{Lane, Several};
use crate::math::{AIR_DENSITY_KG_M3, Real, real, sqrt};
use crate::numbers;
use crate::vehicle::{MAX_ROTORS, Vehicle};
use core::array::from_fn;

const JETS: usize = 0;
const OF_THRUST: usize = 1;
/// Normal force coefficient of a wing about as long as wide, broadside (docs/guide/wing.md).
const NORMAL_DRAG: f64 = 1.13;
/// Stands for 0 where a division must stay finite, m^2/s^2.
const TINY: f64 = 1e-12;
/// A jet falls no slower past the wings than this, m/s: one that does not arrive covers nothing.
const SLOWEST_M_S: f64 = 0.1;

/// Over what momentum theory has, or a part of the thrust.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RotorWash<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for RotorWash<T> {
    const NAME: &'static str = "rotor_wash";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::signed("gain", 0.2, 1.5).only_in(&["jets"]),
        EffectParameter::signed("thrust_fraction", 0.03, 0.3).only_in(&["of_thrust"]),
        EffectParameter::form(&["jets", "of_thrust"]).seeking(&["of_thrust"]),
    ];
    const WORDS: Words = Words {
        what: "rotors blowing on the wings",
        more: "The rotors push the spread wings down",
        less: "The rotors push the spread wings down less",
        fly: "opening and closing the wings six times or more, in hover, in climbs and descents, and at 5 m/s",
    };
    const SHOWN: Shown = Shown::NOTHING;
    const MIMIC: Mimic = Mimic::Gusts;
    const IS_OF_WINGS: bool = true;
    const FORMS_APART: bool = true;
}

numbers! {
    /// Where the jets are, and where the wings.
    Numbers {
        /// Over what momentum theory has.
        gain,
        /// Part of the thrust that pushes down with both wings spread.
        of_thrust,
        /// Square of a rotor's induced speed in hover over its own.
        per_square [MAX_ROTORS],
        /// Speed of a jet at the wings over that at the disc.
        faster,
        /// Half the side of a jet, m.
        half_m,
        /// From the discs down to the wings, m.
        gap_m,
        /// Ahead of the centre of mass, m.
        x_m [MAX_ROTORS],
        /// To the right, m.
        y_m [MAX_ROTORS],
        /// Trailing and leading edge, m.
        chord_m [2],
        /// Inner and outer end of each side, from the x axis, m.
        span_m [2],
        /// `1 / S` of one side, 1/m^2.
        per_area
    }
}

impl<T: Real> RotorWash<T> {
    pub(super) fn prepare(&self, vehicle: &Vehicle<T>) -> Numbers<T> {
        let [gain, of_thrust, form] = self.0;
        let mut out = Numbers::all(T::zero());
        // No edge of a wing or jet on another, where there is neither.
        out.faster = T::one();
        let Some(wing) = vehicle.parameters().wing else { return out };
        if is(form, OF_THRUST) {
            return Numbers { of_thrust, ..out };
        }
        let (rotors, half) = (vehicle.rotors(), real::<T>(0.5));
        let radius_m = vehicle.parameters().propulsion.propeller_radius_m;
        // Lanes may have more places than a vehicle has rotors.
        out.x_m = [real(NOWHERE_M); MAX_ROTORS];
        let mut plane_m = T::zero();
        for (i, rotor) in rotors.iter().enumerate() {
            (out.x_m[i], out.y_m[i]) = (rotor.position.vector.x, rotor.position.vector.y);
            out.per_square[i] =
                vehicle.rotor_wrench_per_speed_squared().thrust[i] * induced::per_thrust(radius_m);
            plane_m += rotor.position.vector.z / real(rotors.len() as f64);
        }
        let gap_m = wing.vertical_arm_m - plane_m;
        let faster = T::one() + gap_m / sqrt(radius_m * radius_m + gap_m * gap_m);
        // A square with the area of the contracted disc.
        let half_m = radius_m * sqrt(real::<T>(core::f64::consts::PI) / faster) * half;
        let (half_chord, half_span) =
            (half * wing.chord_m, half * wing.area_per_side_m2 / wing.chord_m);
        Numbers {
            gain,
            faster,
            half_m,
            gap_m,
            chord_m: [wing.longitudinal_arm_m - half_chord, wing.longitudinal_arm_m + half_chord],
            span_m: [wing.lateral_arm_m - half_span, wing.lateral_arm_m + half_span],
            per_area: T::one() / wing.area_per_side_m2,
            ..out
        }
    }
}

/// Length that two intervals share, and its middle.
#[inline(always)]
fn shared<L: Lane>([from, to]: [L; 2], middle: L, half: L) -> [L; 2] {
    let (low, high) = (from.upper(middle - half), to.lower(middle + half));
    [(high - low).upper(L::of(0.0)), L::of(0.5) * (low + high)]
}

/// Where no wing is, m.
const NOWHERE_M: f64 = 1e6;
/// Rotors whose jets are computed side by side.
const BESIDE: usize = 4;

impl<L: Lane> Numbers<L> {
    /// Where the jets of some rotors meet the wings' level and how hard they press there: ahead, to
    /// the right, m, and the pressure, Pa.
    #[inline(always)]
    fn jets(&self, at: &Situation<'_, L>, first: usize) -> [Several<L, BESIDE>; 3] {
        let all = Several::all;
        let of = |numbers: &[L]| {
            Several(from_fn(|i| numbers.get(first + i).copied().unwrap_or(L::of(0.0))))
        };
        let none = Several::of(0.0);
        let [u, v, w] = at.flow.velocity.map(all);
        let across = u * u + v * v;
        let own_speed = of(at.rotor_speed);
        let square = own_speed * own_speed * of(&self.per_square) * all(at.thrust_factor);
        let speed = induced::speed(square, across, none - w) * all(self.faster);
        let down = w - speed;
        let squared = across + down * down;
        let sine = down / squared.upper(Several::of(TINY)).root();
        let pressure = Several::of(0.5 * AIR_DENSITY_KG_M3 * NORMAL_DRAG)
            * squared
            * flat_plate::separated(sine);
        let late = all(self.gap_m) / (speed - w).upper(Several::of(SLOWEST_M_S));
        [of(&self.x_m) - u * late, of(&self.y_m) - v * late, pressure]
    }

    /// What a jet does to both wings.
    ///
    /// * `own` - what each wing has over its area without, Pa
    #[inline(always)]
    fn blow(&self, at: &Situation<'_, L>, [x, y, pressure]: [L; 3], own: &[L; 2]) -> BodyWrench<L> {
        let none = L::of(0.0);
        let [inner, outer] = self.span_m;
        let sides = [[none - outer, none - inner], [inner, outer]];
        let [length, ahead] = shared(self.chord_m, x, self.half_m);
        let mut out = BodyWrench::zero();
        for side in 0..2 {
            let [width, right] = shared(sides[side], y, self.half_m);
            let covered = length * width * self.gain * at.deployment[side];
            let force = covered * (own[side] - pressure);
            // (ahead, right, z) x (0, 0, F)
            out.force[2] = out.force[2] + force;
            out.moment[0] = out.moment[0] + right * force;
            out.moment[1] = out.moment[1] - ahead * force;
        }
        out
    }
}

impl<L: Lane> Acts<L> for Numbers<L> {
    #[inline(always)]
    fn wrench(&self, at: &Situation<'_, L>, forms: Forms) -> BodyWrench<L> {
        let mut sum = BodyWrench { force: [absent(); 3], moment: [absent(); 3] };
        // Jets cost more than all other effects together.
        if forms.has(JETS) && at.deployment[0].upper(at.deployment[1]).any_positive() {
            // Of the plate's own air, over its area.
            let mut own = at.wings.normal_forces(at.flow, &[L::of(1.0); 2]);
            own = [own[0] * self.per_area, own[1] * self.per_area];
            let rotors = at.rotor_speed.len().min(MAX_ROTORS);
            for first in (0..rotors).step_by(BESIDE) {
                let jets = self.jets(at, first);
                for i in 0..BESIDE.min(rotors - first) {
                    sum = sum.plus(&self.blow(at, jets.map(|all| all.0[i]), &own));
                }
            }
        }
        if forms.has(OF_THRUST) {
            let spread = L::of(0.5) * (at.deployment[0] + at.deployment[1]);
            sum.force[2] = sum.force[2] + self.of_thrust * at.thrust_n * spread;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::aero::{Air, Airflow};
    use crate::effects::{Acting, Effects, forms};
    use crate::frames::In;
    use crate::vehicle::fixtures::squirrel;
    use nalgebra::Vector3;

    const HOVER_N: f64 = 0.548 * 9.80665 / 4.0;

    /// Force down, roll and pitch moment.
    fn washed(
        form: &str,
        size: f64,
        rotor_thrust_n: [f64; 4],
        velocity: [f64; 3],
        deployment: [f64; 2],
    ) -> [f64; 3] {
        let vehicle = Vehicle::new(squirrel::<f64>()).unwrap();
        let mut effects = Effects::none();
        let found = effects.insert("rotor_wash").unwrap();
        let number = forms(found.parameters).iter().position(|f| *f == form).unwrap();
        found.values[number] = size;
        found.values[2] = number as f64;
        let acting = Acting::new(&effects, &vehicle);
        let flow = Airflow::from(&Air::new(In::new(Vector3::from(velocity)), In::zero()));
        let at = Situation {
            flow: &flow,
            omega: &flow.omega,
            thrust_n: rotor_thrust_n.iter().sum(),
            rotor_speed: &rotor_thrust_n.map(|thrust_n| (thrust_n / 6.0e-7_f64).sqrt()),
            thrust_factor: 1.0,
            force: [0.0; 3],
            rotor_spin: [0.0; 2],
            wing_force: [0.0; 3],
            wings: &flat_plate::Pair::new(vehicle.parameters().wing.as_ref().unwrap()),
            deployment,
        };
        let all = acting.numbers().wrench(acting.present(), &at);
        assert_eq!(all.force[..2], [0.0; 2]);
        assert_eq!(all.moment[2], 0.0);
        [all.force[2], all.moment[0], all.moment[1]]
    }

    /// `benches/wash/strips.py`: strips and cells, round jets, bisection. Moments are off by more than
    /// forces, because a square ends elsewhere.
    #[test]
    fn jets_push_as_strip_theory_says() {
        let even = [HOVER_N; 4];
        let rolling = [1.2 * HOVER_N, 1.2 * HOVER_N, 0.8 * HOVER_N, 0.8 * HOVER_N];
        let (cos, sin) = (30.0_f64.to_radians().cos(), 0.5);
        for (what, thrusts, velocity, [down, roll, pitch]) in [
            ("hover", even, [0.0; 3], [1.4844, 0.0, 0.0]),
            ("climb", even, [0.0, 0.0, -3.0], [1.6124, 0.0, 0.0]),
            ("descent", even, [0.0, 0.0, 3.0], [1.4764, 0.0, 0.0]),
            ("forward", even, [7.0, 0.0, 0.0], [1.4765, 0.0, -0.01969]),
            ("braking", even, [7.0 * cos, 0.0, 7.0 * sin], [1.6163, 0.0, -0.02143]),
            ("rolling", rolling, [0.0; 3], [1.4844, -0.02524, 0.0]),
            ("sideways", even, [0.0, 7.0, 0.0], [1.4087, -0.02343, 0.0]),
        ] {
            let [force, m_x, m_y] = washed("jets", 1.0, thrusts, velocity, [1.0; 2]);
            assert!((force / down - 1.0).abs() < 0.05, "{what}: {force} N for {down} N");
            assert!((m_x - roll).abs() < 0.15 * roll.abs() + 1e-5, "{what}: {m_x} for {roll}");
            assert!((m_y - pitch).abs() < 0.15 * pitch.abs() + 1e-5, "{what}: {m_y} for {pitch}");
        }
    }

    #[test]
    fn only_what_is_spread_is_blown_on() {
        let even = [HOVER_N; 4];
        for form in ["jets", "of_thrust"] {
            let both = washed(form, 0.5, even, [0.0; 3], [1.0; 2]);
            assert!(both[0] > 0.0 && washed(form, 1.0, even, [0.0; 3], [1.0; 2])[0] > both[0]);
            assert_eq!(washed(form, 1.0, even, [3.0, 1.0, -2.0], [0.0; 2]), [0.0; 3]);
        }
        // The left wing alone: its download rolls to the left.
        let left = washed("jets", 1.0, even, [0.0; 3], [1.0, 0.0]);
        let both = washed("jets", 1.0, even, [0.0; 3], [1.0; 2]);
        assert!((left[0] - 0.5 * both[0]).abs() < 1e-12 && left[1] < -0.05, "{left:?}");
        let tilt_rotor = washed("of_thrust", 0.1, even, [0.0; 3], [1.0; 2])[0];
        assert!((tilt_rotor - 0.4 * HOVER_N).abs() < 1e-12);
    }

    #[test]
    fn rotors_that_stand_blow_nothing() {
        assert_eq!(washed("jets", 1.0, [0.0; 4], [0.0; 3], [1.0; 2]), [0.0; 3]);
    }
}
