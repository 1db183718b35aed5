//! What the set means for climbing and braking.
//!
//! Upwards and against the motion with height free are values of the support function. Braking at constant height is not: it is asked
//! of the set, not of its hull, which would mix folded and spread wings. For an attitude the thrust that holds height is
//! `U = (m g + w f_z)/n_z`, and a search over the tilt set that narrows around its best points finds the attitude.

use super::{Reach, Wings};
use nalgebra::Vector3;
use squirrel_core::frames::In;
use squirrel_core::math::GRAVITY_M_S2;

/// Horizontal speed below which there is nothing to brake, m/s.
const BRAKING_SPEED_MIN_M_S: f64 = 1e-3;
/// Cells of the first grid along each of its two numbers.
const CELLS: u32 = 60;
/// Points from which the search narrows.
const STARTS: usize = 4;
/// How often it narrows.
const ROUNDS: u32 = 40;

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

    /// With wings over folded.
    pub fn ratio(&self) -> f64 {
        self.with_wings / self.folded
    }
}

/// The largest accelerations that matter most, m/s^2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    /// Upwards; below zero, height cannot be held.
    pub upward_m_s2: Compared,
    /// Against the horizontal motion, whatever becomes of the height; nothing to brake without such a motion.
    pub braking_height_free_m_s2: Option<Compared>,
    /// Against the horizontal motion with no vertical acceleration; nothing where height cannot be held in either way.
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
            let [folded, spread] = [Wings::Folded, Wings::Spread].map(|wings| self.level(back, wings));
            let with_wings = folded.max(spread);
            (with_wings > f64::NEG_INFINITY).then_some(Compared { folded, with_wings })
        });
        Extremes {
            upward_m_s2: along(-Vector3::z()),
            braking_height_free_m_s2: back.map(along),
            braking_level_m_s2: level,
        }
    }

    /// Acceleration along a horizontal direction at an attitude whose thrust holds height; minus infinity where none does.
    fn holding_height(&self, normal: Vector3<f64>, direction: Vector3<f64>, wings: Wings) -> f64 {
        let wing = match wings {
            Wings::Folded => Vector3::zeros(),
            Wings::Spread => self.wing_force(normal),
        };
        let thrust = (self.mass_kg * GRAVITY_M_S2 + wing.z) / normal.z;
        let has = (0.0..=self.thrust_max_n).contains(&thrust);
        if has { (wing - normal * thrust).dot(&direction) / self.mass_kg } else { f64::NEG_INFINITY }
    }

    /// The largest acceleration along a horizontal direction at constant height; minus infinity where height cannot be held.
    fn level(&self, direction: Vector3<f64>, wings: Wings) -> f64 {
        let value = |[p, q]: [f64; 2]| self.holding_height(self.tilt.normal(p, q).0, direction, wings);
        let place = |i: u32| f64::from(i) / f64::from(CELLS);
        let grid = (0..=CELLS).flat_map(|i| (0..=CELLS).map(move |j| [place(i), place(j)]));
        let mut starts: Vec<(f64, [f64; 2])> = grid.map(|at| (value(at), at)).collect();
        starts.sort_by(|a, b| b.0.total_cmp(&a.0));
        let narrowed = starts.into_iter().take(STARTS).map(|(mut best, mut at)| {
            let mut reach = 1.5 / f64::from(CELLS);
            for _ in 0..ROUNDS {
                let centre = at;
                let near = (-4..=4).flat_map(|i| (-4..=4).map(move |j| [i, j]));
                for offset in near.map(|ij| ij.map(|k| reach * f64::from(k) / 4.0)) {
                    let there = [0, 1].map(|k| (centre[k] + offset[k]).clamp(0.0, 1.0));
                    let found = value(there);
                    if found > best {
                        (best, at) = (found, there);
                    }
                }
                reach *= 0.6;
            }
            best
        });
        narrowed.fold(f64::NEG_INFINITY, f64::max)
    }
}
