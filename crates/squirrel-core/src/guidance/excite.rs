//! Excitation: manoeuvres flown so that a log can tell effects apart.
//!
//! A [`Programme`] is a list of [`Leg`]s from rest to rest, with headings and forced wings, and a
//! [`Multisine`] on top. A leg's speed is a trapezoid: constant acceleration, constant speed,
//! constant deceleration. The multisine is added behind the command filter, whose 3 Hz would
//! swallow it, and brings its own derivatives: the attitude law turns those into moments at once.
//! Each axis has its own harmonics of one base frequency, so that over the base period no axis
//! hides behind another (orthogonal multisines: Klein and Morelli, Aircraft System Identification).

use super::mission::scramble;
use crate::command::EulerReference;
use crate::command::Reference;
use crate::frames::{In, Ned};
use crate::math::{limit, lower, sqrt, upper, wrap_angle};
use crate::vehicle::{ParameterError, Vehicle, positive};
use core::f32::consts::TAU;
use nalgebra::Vector3;

/// Most legs of a programme.
pub const MAX_LEGS: usize = 16;
/// Sines on one axis.
pub const LINES: usize = 8;
/// Lowest and highest frequency of a multisine, Hz.
pub const BAND_HZ: [f32; 2] = [0.3, 6.0];
/// All frequencies are multiples of this, Hz.
const BASE_HZ: f32 = 0.025;
/// Attitude lines are flat in angle below and flat in rate above this frequency, Hz.
const CORNER_HZ: f32 = 3.0;
/// The multisine fades in over this time, s.
const FADE_S: f32 = 1.0;
/// Mean size of a normally distributed number of deviation 1.
const MEAN_OF_NORMAL: f32 = 0.798;
/// A change of heading takes this long, s: a quarter turn stays within the yaw torque of small
/// rotors.
const YAW_S: f32 = 1.5;

/// One leg: a straight move from where the last one ended, then a hover.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    /// Whole length, s.
    pub duration_s: f32,
    /// Length of the move, s, > 0, at most the duration.
    pub move_s: f32,
    /// Length of its acceleration, and of its deceleration, s, > 0, at most half the move.
    pub ramp_s: f32,
    /// Where it ends, m.
    pub to: In<Ned, f32>,
    /// Heading at the end, rad; the vehicle turns the short way, at the leg's begin.
    pub yaw_rad: f32,
    /// Wings are spread between these times from the leg's start, s.
    pub wings_s: [f32; 2],
}

impl Leg {
    /// A place that no leg takes.
    pub const UNUSED: Self = Self {
        duration_s: 1.0,
        move_s: 1.0,
        ramp_s: 0.5,
        to: In::<Ned, f32>::ORIGIN,
        yaw_rad: 0.0,
        wings_s: [0.0; 2],
    };

    fn check(&self) -> Result<(), ParameterError> {
        positive("leg.duration_s", self.duration_s)?;
        if !(self.move_s > 0.0 && self.move_s <= self.duration_s) {
            return Err(ParameterError::of(
                "leg.move_s",
                self.move_s,
                "must be > 0 and <= leg.duration_s",
            ));
        }
        if !(self.ramp_s > 0.0 && 2.0 * self.ramp_s <= self.move_s) {
            return Err(ParameterError::of(
                "leg.ramp_s",
                self.ramp_s,
                "must be > 0 and <= leg.move_s / 2",
            ));
        }
        let numbers = [self.to.vector.x, self.to.vector.y, self.to.vector.z, self.yaw_rad];
        match numbers.iter().chain(&self.wings_s).find(|x| !x.is_finite()) {
            Some(x) => Err(ParameterError::of("leg", *x, "must be finite")),
            None => Ok(()),
        }
    }

    /// Share of the way, and its first two derivatives.
    fn progress(&self, t: f32) -> [f32; 3] {
        let (t, ramp) = (limit(t, 0.0, self.move_s), self.ramp_s);
        let speed = 1.0 / (self.move_s - ramp);
        let left = self.move_s - t;
        if t < ramp {
            [0.5 * speed * t * t / ramp, speed * t / ramp, speed / ramp]
        } else if left > ramp {
            [speed * (t - 0.5 * ramp), speed, 0.0]
        } else if left > 0.0 {
            [1.0 - 0.5 * speed * left * left / ramp, speed * left / ramp, -speed / ramp]
        } else {
            [1.0, 0.0, 0.0]
        }
    }
}

/// What is added to the attitude command and to the thrust command.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Excitation {
    /// Roll, pitch, yaw with derivatives.
    pub attitude: EulerReference,
    /// Share of the commanded thrust.
    pub thrust_share: f32,
}

impl Excitation {
    /// All of it, a share of it.
    #[must_use]
    pub(crate) fn scaled(&self, share: f32) -> Self {
        let EulerReference { angle, rate, acceleration } = self.attitude;
        let attitude = EulerReference {
            angle: angle * share,
            rate: rate * share,
            acceleration: acceleration * share,
        };
        Self { attitude, thrust_share: self.thrust_share * share }
    }
}

/// One sine.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Line {
    pub(crate) frequency_hz: f32,
    pub(crate) amplitude: f32,
    /// In turns.
    pub(crate) phase: f32,
}

/// Sums of sines on roll, pitch, yaw and thrust.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Multisine {
    pub(crate) lines: [[Line; LINES]; 4],
}

impl Multisine {
    /// * `angle_rad` - amplitude of each line of roll, pitch, yaw at low frequency
    /// * `thrust_share` - amplitude of each line of thrust, as a share of the command
    /// * `seed` - of the phases
    ///
    /// # Errors
    /// Amplitudes that are negative, or too large to fly, by their names in a scenario.
    pub fn new(angle_rad: [f32; 3], thrust_share: f32, seed: u32) -> Result<Self, ParameterError> {
        for angle in angle_rad {
            if !(0.0..=0.05).contains(&angle) {
                return Err(ParameterError::of("multisine_angle_rad", angle, "must be 0 to 0.05"));
            }
        }
        if !(0.0..=0.05).contains(&thrust_share) {
            return Err(ParameterError::of(
                "multisine_thrust_share",
                thrust_share,
                "must be 0 to 0.05",
            ));
        }
        let mut lines = [[Line::default(); LINES]; 4];
        let ratio = BAND_HZ[1] / BAND_HZ[0];
        for (axis, lines) in lines.iter_mut().enumerate() {
            for (i, line) in lines.iter_mut().enumerate() {
                let wanted = BAND_HZ[0] * libm::powf(ratio, i as f32 / (LINES - 1) as f32);
                // Up to a multiple of four base frequencies, then this axis' own place below it;
                // never below the band.
                let top =
                    upper(4.0 * libm::ceilf(wanted / BASE_HZ / 4.0), BAND_HZ[0] / BASE_HZ + 3.0);
                let harmonic = lower(top, BAND_HZ[1] / BASE_HZ) - axis as f32;
                line.frequency_hz = harmonic * BASE_HZ;
                line.amplitude = match angle_rad.get(axis) {
                    Some(angle) => angle * lower(1.0, CORNER_HZ / line.frequency_hz),
                    None => thrust_share,
                };
                let bits = scramble(seed ^ scramble((axis * LINES + i) as u32 + 1));
                line.phase = (bits >> 8) as f32 / (1u32 << 24) as f32;
            }
        }
        Ok(Self { lines })
    }

    /// Largest roll or pitch that the sines can add up to, rad.
    pub fn tilt_max_rad(&self) -> f32 {
        let sum = |axis: usize| self.lines[axis].iter().map(|l| l.amplitude).sum::<f32>();
        upper(sum(0), sum(1))
    }

    /// What turning along with the sines takes of the collective thrust where rotors give all they
    /// can, N: roll and pitch come first there, so that of four rotors those that are told less
    /// lower the sum, by `|roll| + |pitch|` in the mean.
    pub(crate) fn thrust_taken_n(&self, vehicle: &Vehicle<f32>) -> f32 {
        let inertia = vehicle.parameters().inertia_kg_m2;
        let count = vehicle.rotors().len() as f32;
        // Of a sum of sines in roll or pitch, normally distributed.
        let torque_n_m = |axis: usize| {
            let square = |line: &Line| {
                let rate = TAU * line.frequency_hz;
                let peak = line.amplitude * rate * rate;
                0.5 * peak * peak
            };
            let squares: f32 = self.lines[axis].iter().map(square).sum();
            inertia[(axis, axis)] * sqrt(squares) * MEAN_OF_NORMAL
        };
        let arm_m = |axis: usize| {
            let sum: f32 = vehicle.rotors().iter().map(|r| r.position.vector[axis].abs()).sum();
            upper(sum / count, 1e-3)
        };
        torque_n_m(0) / arm_m(1) + torque_n_m(1) / arm_m(0)
    }

    /// Frequencies of one axis, Hz: roll, pitch, yaw, thrust.
    pub fn frequencies_hz(&self, axis: usize) -> [f32; LINES] {
        self.lines.get(axis).map_or([0.0; LINES], |lines| lines.map(|l| l.frequency_hz))
    }

    fn is_silent(&self) -> bool {
        self.lines.iter().flatten().all(|l| l.amplitude == 0.0)
    }

    /// At a time since the start of the mission.
    fn at(&self, time_us: u64) -> Excitation {
        let t = time_us as f32 * 1e-6;
        let mut sums = [[0.0; 3]; 4];
        for (sum, lines) in sums.iter_mut().zip(&self.lines) {
            for line in lines.iter().filter(|l| l.amplitude != 0.0) {
                let turns = line.frequency_hz * t + line.phase;
                let angle = TAU * (turns - libm::floorf(turns));
                let rate = TAU * line.frequency_hz;
                let (s, c) = libm::sincosf(angle);
                sum[0] += line.amplitude * s;
                sum[1] += line.amplitude * rate * c;
                sum[2] -= line.amplitude * rate * rate * s;
            }
        }
        let [f, df, ddf] = smooth(t, FADE_S);
        let axis = |k: usize| Vector3::new(sums[0][k], sums[1][k], sums[2][k]);
        let (angle, rate, acceleration) = (axis(0), axis(1), axis(2));
        Excitation {
            attitude: EulerReference {
                angle: angle * f,
                rate: rate * f + angle * df,
                acceleration: acceleration * f + rate * (2.0 * df) + angle * ddf,
            },
            thrust_share: sums[3][0] * f,
        }
    }
}

/// Legs and a multisine on top.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Programme {
    pub(crate) start: In<Ned, f32>,
    legs: [Leg; MAX_LEGS],
    count: usize,
    multisine: Multisine,
}

impl Programme {
    /// * `start` - where the first leg begins, m, at a heading of 0
    /// * `legs` - one after the other
    ///
    /// # Errors
    /// No leg or more than [`MAX_LEGS`], or the first number of a leg that is out of range.
    pub fn new(
        start: In<Ned, f32>,
        legs: &[Leg],
        multisine: Multisine,
    ) -> Result<Self, ParameterError> {
        let mut all = [Leg::UNUSED; MAX_LEGS];
        if legs.is_empty() || legs.len() > MAX_LEGS {
            return Err(ParameterError::of("legs", legs.len() as f32, "must be 1 to 16"));
        }
        for (place, leg) in all.iter_mut().zip(legs) {
            leg.check()?;
            *place = *leg;
        }
        Ok(Self { start, legs: all, count: legs.len(), multisine })
    }

    /// The legs in order.
    pub fn legs(&self) -> &[Leg] {
        self.legs.get(..self.count).unwrap_or(&[])
    }

    /// The multisine.
    pub fn multisine(&self) -> &Multisine {
        &self.multisine
    }

    /// The leg at a time, the time since its start, and where and with which heading it began. The
    /// last leg does not end.
    fn leg(&self, time_us: u64) -> (Leg, f32, In<Ned, f32>, f32) {
        let mut since = time_us as f32 * 1e-6;
        let (mut from, mut yaw, mut leg) = (self.start, 0.0, Leg::UNUSED);
        for (i, next) in self.legs().iter().enumerate() {
            leg = *next;
            if since < leg.duration_s || i + 1 == self.count {
                break;
            }
            since -= leg.duration_s;
            (from, yaw) = (leg.to, leg.yaw_rad);
        }
        (leg, since, from, yaw)
    }

    /// What to follow at a time since the start of the mission.
    pub(super) fn reference(&self, time_us: u64) -> Reference {
        let (leg, t, from, yaw) = self.leg(time_us);
        let way = leg.to - from;
        let [s, ds, dds] = leg.progress(t);
        let [turned, ..] = smooth(t, YAW_S);
        Reference {
            position: from + way * s,
            velocity: way * ds,
            acceleration: way * dds,
            yaw_rad: yaw + wrap_angle(leg.yaw_rad - yaw) * turned,
        }
    }

    /// Where the leg at a time comes to rest, m down.
    pub(super) fn rest_down_m(&self, time_us: u64) -> f32 {
        self.leg(time_us).0.to.vector.z
    }

    /// Wing command at a time: 0 folded, 1 spread.
    pub(super) fn wing_command(&self, time_us: u64) -> f32 {
        let (leg, t, ..) = self.leg(time_us);
        f32::from(t >= leg.wings_s[0] && t < leg.wings_s[1])
    }

    /// What to add to the commands; `None` where the multisine is silent.
    pub(super) fn excitation(&self, time_us: u64) -> Option<Excitation> {
        (!self.multisine.is_silent()).then(|| self.multisine.at(time_us))
    }
}

/// From 0 to 1 over `length`, with its first two derivatives.
fn smooth(t: f32, length: f32) -> [f32; 3] {
    if t >= length {
        return [1.0, 0.0, 0.0];
    }
    let x = upper(t, 0.0) / length;
    [x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x) / length, (6.0 - 12.0 * x) / (length * length)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leg(north_m: f32) -> Leg {
        Leg {
            duration_s: 5.0,
            move_s: 4.0,
            ramp_s: 1.0,
            to: In::new(Vector3::new(north_m, 0.0, -2.0)),
            yaw_rad: 1.5,
            wings_s: [1.0, 2.0],
        }
    }

    fn programme() -> Programme {
        let multisine = Multisine::new([0.02, 0.02, 0.01], 0.01, 7).unwrap();
        Programme::new(In::new(Vector3::new(0.0, 0.0, -2.0)), &[leg(9.0), leg(0.0)], multisine)
            .unwrap()
    }

    #[test]
    fn a_leg_goes_all_the_way_at_the_speed_it_needs_and_waits() {
        let p = programme();
        assert_eq!(p.reference(2_000_000).velocity.vector, Vector3::new(3.0, 0.0, 0.0));
        assert_eq!(p.reference(4_500_000).position.vector, Vector3::new(9.0, 0.0, -2.0));
        assert_eq!(p.reference(4_500_000).velocity.vector.norm(), 0.0);
        assert!((p.reference(7_000_000).velocity.vector.x + 3.0).abs() < 1e-5, "and back");
        assert_eq!(p.reference(60_000_000).position.vector.x, 0.0, "the last leg does not end");
        assert_eq!(
            [0.9, 1.0, 1.9, 2.0].map(|t| p.wing_command((t * 1e6) as u64)),
            [0.0, 1.0, 1.0, 0.0]
        );
    }

    #[test]
    fn derivatives_are_derivatives() {
        let p = programme();
        for k in 1..240u64 {
            let (before, now, after) = (k * 41_000 - 500, k * 41_000, k * 41_000 + 500);
            let (a, b, c) = (p.reference(before), p.reference(now), p.reference(after));
            let slope = (c.position - a.position).vector * 1e3;
            assert!(
                (slope - b.velocity.vector).norm() < 0.02,
                "{now}: {slope} {}",
                b.velocity.vector
            );
            let at = |t| p.excitation(t).unwrap().attitude;
            let (a, b, c) = (at(before), at(now), at(after));
            assert!(((c.angle - a.angle) * 1e3 - b.rate).norm() < 2e-3, "{now}");
            assert!(((c.rate - a.rate) * 1e3 - b.acceleration).norm() < 0.05, "{now}");
        }
    }

    #[test]
    fn every_axis_has_its_own_frequencies_in_the_band_and_keeps_to_its_bound() {
        let p = programme();
        let mut all: Vec<f32> =
            (0..4).flat_map(|axis| p.multisine().frequencies_hz(axis)).collect();
        assert!(all.iter().all(|f| (0.299..=6.001).contains(f)), "{all:?}");
        all.sort_by(f32::total_cmp);
        assert!(all.windows(2).all(|w| w[1] - w[0] > 0.9 * BASE_HZ), "{all:?}");
        assert!(all.first().is_some_and(|f| *f < 0.31) && all.last().is_some_and(|f| *f > 5.99));
        let bound = p.multisine().tilt_max_rad();
        let largest =
            (0..4000u64).map(|k| p.excitation(k * 10_000).unwrap().attitude.angle.xy().amax());
        let largest = largest.fold(0.0, f32::max);
        assert!(largest <= bound && largest > 0.5 * bound, "{largest} of {bound}");
        assert_eq!(p.excitation(0).unwrap().attitude.angle.norm(), 0.0, "it fades in");
    }

    #[test]
    fn numbers_that_cannot_be_flown_are_refused_by_name() {
        let start = In::zero();
        let silent = Multisine::new([0.0; 3], 0.0, 0).unwrap();
        assert!(
            Programme::new(start, &[], silent).unwrap_err().to_string().starts_with("legs = 0")
        );
        assert!(Programme::new(start, &[Leg::UNUSED; 17], silent).is_err());
        for (broken, field) in [
            (Leg { duration_s: f32::NAN, ..Leg::UNUSED }, "leg.duration_s"),
            (Leg { move_s: 2.0, ..Leg::UNUSED }, "leg.move_s"),
            (Leg { ramp_s: 0.6, ..Leg::UNUSED }, "leg.ramp_s"),
            (Leg { yaw_rad: f32::INFINITY, ..Leg::UNUSED }, "leg = inf"),
        ] {
            let error = Programme::new(start, &[broken], silent).unwrap_err().to_string();
            assert!(error.starts_with(field), "{error}");
        }
        assert!(Multisine::new([0.0, f32::NAN, 0.0], 0.0, 0).is_err());
        assert!(Multisine::new([0.0; 3], -0.1, 0).is_err());
        assert_eq!(Programme::new(start, &[leg(1.0)], silent).unwrap().excitation(5_000_000), None);
    }
}
