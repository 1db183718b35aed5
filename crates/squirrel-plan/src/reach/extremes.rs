//! What the set means for climbing and braking.
//!
//! Upwards and against the motion with height free are values of the support function. Braking at
//! constant height is not: it is asked of the set, not of its hull, which would mix folded and
//! spread wings. For an attitude the thrust that holds height is `U = (m g + w f_z)/n_z`, and a
//! search in two numbers finds the attitude: the inner one ends where thrust does.

use super::turned::golden;
use super::{Reach, Wings};
use nalgebra::Vector3;
use serde::ser::SerializeStruct;
use serde::{Serialize, Serializer};
use squirrel_core::frames::In;
use squirrel_core::math::GRAVITY_M_S2;

/// Horizontal speed below which there is nothing to brake, m/s.
const BRAKING_SPEED_MIN_M_S: f64 = 1e-3;
/// What is not above this is rounding, or points the other way: where thrust is just the weight, a
/// last bit of it tilts a vehicle by the root of two such bits, which g makes 2e-7 m/s^2 of.
const NOTHING: f64 = 1e-6;
/// Steps of a search along each of the two numbers of an attitude.
const SAMPLES: usize = 40;
/// Peaks that are refined.
const PEAKS: usize = 2;
/// How often the end of what is defined is halved in.
const HALVINGS: u32 = 40;

/// A number with folded wings, and with a choice of folded or spread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compared {
    /// Wings folded.
    pub folded: f64,
    /// Wings folded or spread, whichever is better.
    pub with_wings: f64,
}

impl Compared {
    pub(super) fn new(folded: f64, with_wings: f64) -> Self {
        Self { folded, with_wings }
    }

    /// With wings over folded; NaN where folded wings have nothing to compare with.
    pub fn ratio(&self) -> f64 {
        if self.folded > NOTHING { self.with_wings / self.folded } else { f64::NAN }
    }
}

impl Serialize for Compared {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_struct("Compared", 3)?;
        map.serialize_field("folded", &self.folded)?;
        map.serialize_field("with_wings", &self.with_wings)?;
        map.serialize_field("ratio", &self.ratio())?;
        map.end()
    }
}

/// The largest accelerations that matter most, m/s^2.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Extremes {
    /// Upwards; below zero, height cannot be held.
    pub upward_m_s2: Compared,
    /// Against the horizontal motion, whatever becomes of the height; nothing to brake without such
    /// a motion.
    pub braking_height_free_m_s2: Option<Compared>,
    /// Against the horizontal motion with no vertical acceleration; nothing where height cannot be
    /// held in either way, NaN where it cannot be held with folded wings.
    pub braking_level_m_s2: Option<Compared>,
}

impl Reach {
    /// Largest accelerations upwards and against the motion.
    pub fn extremes(&self) -> Extremes {
        let along = |d: Vector3<f64>| {
            let folded = self.folded(In::new(d)).value_m_s2;
            Compared::new(folded, self.spread_by(d, None).value_m_s2.max(folded))
        };
        let back = Vector3::new(-self.velocity_ned.x, -self.velocity_ned.y, 0.0);
        let back = back.try_normalize(BRAKING_SPEED_MIN_M_S);
        let level = back.and_then(|back| {
            let [folded, spread] =
                [Wings::Folded, Wings::Spread].map(|wings| self.level(back, wings));
            let with_wings = folded.max(spread);
            let folded = if folded.is_finite() { folded } else { f64::NAN };
            with_wings.is_finite().then_some(Compared { folded, with_wings })
        });
        Extremes {
            upward_m_s2: along(-Vector3::z()),
            braking_height_free_m_s2: back.map(along),
            braking_level_m_s2: level,
        }
    }

    /// Acceleration along a horizontal direction at an attitude whose thrust holds height; minus
    /// infinity where none does.
    fn holding_height(&self, normal: Vector3<f64>, direction: Vector3<f64>, wings: Wings) -> f64 {
        let wing = match wings {
            Wings::Folded => Vector3::zeros(),
            Wings::Spread => self.wing_force(normal),
        };
        let thrust = (self.mass_kg * GRAVITY_M_S2 + wing.z) / normal.z;
        let has = (0.0..=self.thrust_max_n).contains(&thrust);
        if has {
            (wing - normal * thrust).dot(&direction) / self.mass_kg
        } else {
            f64::NEG_INFINITY
        }
    }

    /// The largest acceleration along a horizontal direction at constant height; minus infinity
    /// where height cannot be held.
    fn level(&self, direction: Vector3<f64>, wings: Wings) -> f64 {
        let value =
            |p: f64, q: f64| self.holding_height(self.tilt.normal(p, q).0, direction, wings);
        peak(&|q| peak(&|p| value(p, q)))
    }
}

/// The largest value of a function on [0, 1] that is minus infinity where it is not defined.
fn peak(value: &impl Fn(f64) -> f64) -> f64 {
    let place = |i: usize| i as f64 / SAMPLES as f64;
    let samples: Vec<f64> = (0..=SAMPLES).map(|i| value(place(i))).collect();
    let best = samples.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let beside =
        |i: usize| [i.checked_sub(1), Some(i + 1)].map(|j| j.and_then(|j| samples.get(j)).copied());
    let is_peak = |i: &usize| {
        samples[*i].is_finite() && beside(*i).iter().flatten().all(|x| *x <= samples[*i])
    };
    let mut peaks: Vec<usize> = (0..=SAMPLES).filter(is_peak).collect();
    peaks.sort_by(|a, b| samples[*b].total_cmp(&samples[*a]));
    let refined = peaks.into_iter().take(PEAKS).flat_map(|i| {
        let ends = [place(i.saturating_sub(1)), place((i + 1).min(SAMPLES))];
        // The thrust that holds height ends within a step: there the best is at the end of what is
        // defined.
        let ends = ends.map(|end| last_defined(value, place(i), end));
        [ends[0], golden(value, ends), ends[1]].map(value)
    });
    refined.fold(best, f64::max)
}

/// The end of where a function is defined between a place where it is and another.
fn last_defined(value: &impl Fn(f64) -> f64, mut inside: f64, end: f64) -> f64 {
    if value(end).is_finite() {
        return end;
    }
    let mut outside = end;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (inside + outside);
        if value(middle).is_finite() { inside = middle } else { outside = middle }
    }
    inside
}
