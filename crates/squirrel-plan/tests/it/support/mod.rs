//! Questions at random, and what dense sampling says of them.
#![allow(dead_code, reason = "each test binary uses its part")]
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use nalgebra::{Rotation3, Vector3};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use squirrel_core::frames::In;
use squirrel_plan::reach::{Question, Tilt};
use squirrel_plan::wing::{WingForce, WingModel};
use squirrel_sim::vehicle_file::VehicleFile;
use std::f64::consts::{PI, TAU};

pub(crate) const G: f64 = 9.80665;
pub(crate) const MASS_KG: f64 = 0.548;
pub(crate) const LIMIT_RAD: f64 = PI / 6.0;
pub(crate) const ROLL_AND_PITCH: Tilt =
    Tilt::Box { roll_max_rad: LIMIT_RAD, pitch_max_rad: LIMIT_RAD, yaw_rad: 0.0 };

pub(crate) fn flat() -> WingForce {
    WingForce::Flat { area_m2: 0.04 }
}

pub(crate) fn question(ratio: f64, velocity: [f64; 3], tilt: Tilt, wing: &WingForce) -> Question {
    let (thrust_max_n, velocity) = (ratio * MASS_KG * G, In::new(Vector3::from(velocity)));
    Question { mass_kg: MASS_KG, thrust_max_n, tilt, velocity, wing: wing.clone() }
}

pub(crate) struct Dice(pub(crate) Pcg64Mcg);

impl Dice {
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }
    pub(crate) fn direction(&mut self) -> Vector3<f64> {
        let (z, turn) = (self.between(-1.0, 1.0), self.between(0.0, TAU));
        let r = (1.0 - z * z).sqrt();
        Vector3::new(r * turn.cos(), r * turn.sin(), z)
    }
    /// Any flight: up to 11 m/s in any direction, one in ten along the direction that is asked for.
    pub(crate) fn case(&mut self, wing: &WingForce) -> (Question, Vector3<f64>) {
        let d = self.direction();
        let along = self.between(0.0, 1.0) < 0.1;
        let v = if along { d } else { self.direction() } * self.between(0.0, 11.0);
        let tilt = if self.between(0.0, 1.0) < 0.5 {
            Tilt::Cone { max_rad: self.between(0.1, 1.2) }
        } else {
            Tilt::Box {
                roll_max_rad: self.between(0.1, 1.2),
                pitch_max_rad: self.between(0.1, 1.2),
                yaw_rad: self.between(-PI, PI),
            }
        };
        (question(self.between(1.05, 4.0), v.into(), tilt, wing), d)
    }
}

/// The same tilt sets, written another way: the attitude of a point of the unit square.
pub(crate) fn normal(tilt: &Tilt, [p, q]: [f64; 2]) -> Vector3<f64> {
    let (roll, pitch, yaw) = match *tilt {
        Tilt::Box { roll_max_rad, pitch_max_rad, yaw_rad } => {
            ((2.0 * p - 1.0) * roll_max_rad, (2.0 * q - 1.0) * pitch_max_rad, yaw_rad)
        }
        Tilt::Cone { max_rad } => (0.0, p * max_rad, q * TAU),
    };
    Rotation3::from_euler_angles(roll, pitch, yaw) * Vector3::z()
}

/// Best of both thrusts at an attitude, folded or spread.
pub(crate) fn sample(question: &Question, d: Vector3<f64>, at: [f64; 2]) -> f64 {
    let n = normal(&question.tilt, at);
    let wing = question.wing.force(question.velocity, In::new(n)).vector.dot(&d).max(0.0);
    let thrust = (-n.dot(&d) * question.thrust_max_n).max(0.0);
    G * d.z + (wing + thrust) / question.mass_kg
}

/// The largest acceleration of a dense grid, and of denser ones around its best point.
pub(crate) fn sampled(question: &Question, d: Vector3<f64>, cells: u32, rounds: u32) -> f64 {
    let grid =
        |cells: u32| (0..=cells).flat_map(move |i| (0..=cells).map(move |j| [i, j].map(f64::from)));
    let value = |at: [f64; 2]| (sample(question, d, at), at);
    let best = |places: &mut dyn Iterator<Item = [f64; 2]>| {
        places.map(value).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
    };
    let (mut most, mut at) = best(&mut grid(cells).map(|ij| ij.map(|k| k / f64::from(cells))));
    let mut width = 2.0 / f64::from(cells);
    for _ in 0..rounds {
        // A cone goes round: the second number may leave the square.
        let least = if matches!(question.tilt, Tilt::Cone { .. }) { -1.0 } else { 0.0 };
        let around = |ij: [f64; 2]| {
            let [p, q] = [0, 1].map(|k| at[k] + width * (ij[k] / 8.0 - 0.5));
            [p.clamp(0.0, 1.0), q.clamp(least, 1.0 - least)]
        };
        let (found, there) = best(&mut grid(8).map(around));
        if found > most {
            (most, at) = (found, there);
        }
        width *= 0.6;
    }
    most
}

/// Questions and a direction for each model of the wings.
pub(crate) fn any(
    wing: &WingForce,
    count: u32,
    seed: u64,
) -> impl Iterator<Item = (Question, Vector3<f64>)> {
    let mut dice = Dice(Pcg64Mcg::seed_from_u64(seed));
    (0..count).map(move |_| dice.case(wing))
}

pub(crate) fn wings() -> [WingForce; 3] {
    WingModel::ALL.map(|model| WingForce::of(&VehicleFile::squirrel(), model).unwrap())
}
