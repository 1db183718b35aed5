//! How much there is to choose from: the volume of the set and of its convex hull
//! (docs/equations.md F.5).
//!
//! With a flat plate the set is made of stretches along `-n`: thrust and wings together are `r n`
//! with `0 <= r <= U_max` folded and `b c <= r <= b c + U_max` spread, `c = v.n`, and the volume is
//! the integral of `r^2` over both. Where `|b c| > U_max` there is a gap between them. For any
//! wing the force is in the plane of motion and normal, so which angles of attack reach
//! `a v + b m` does not depend on the turn of `m` around the motion; the tilt limits cut arcs out
//! of that turn, and the volume is the integral of `b` times what those arcs cover. What is
//! reached several times, or with folded wings too, counts once.

use super::polar::Polar;
use super::tilt::{Circle, across};
use super::{Compared, Reach, Wings};
use nalgebra::Vector3;
use serde::Serialize;
use squirrel_core::frames::{In, Ned};
use squirrel_core::math::GRAVITY_M_S2;
use std::f64::consts::{PI, TAU};

/// Cells of the tilt set along each of its two numbers.
const CELLS: u32 = 96;
/// Cells of forces along the motion and across it.
const FORCES: u32 = 400;
/// Steps in which an acceleration is looked for among angles of attack.
const ANGLES: u32 = 400;
/// Directions of a hull: 642 and 2562.
const HALVINGS: u32 = 3;

/// Volumes with folded wings and with a choice.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Volumes {
    /// Of the set, (m/s^2)^3.
    pub set_volume_m3_s6: Compared,
    /// Of its convex hull, (m/s^2)^3.
    pub hull_volume_m3_s6: Compared,
}

/// Angles of attack with what is needed to look for an acceleration: sine, cosine, force.
type Lookup = Vec<[f64; 4]>;

impl Reach {
    /// Volumes of the set and of its hull.
    pub fn volumes(&self) -> Volumes {
        let folded = self.folded_volume();
        let with_wings = match self.polar {
            Polar::Flat { force_n } => self.flat_volume(force_n),
            Polar::Nodes(_) => self.turned_volume(),
        };
        let hull = |wings: Wings| {
            let [coarse, fine] =
                [HALVINGS, HALVINGS + 1].map(|halvings| self.hull(wings, halvings));
            let [coarse, fine] = [coarse.volume_m3_s6(), fine.volume_m3_s6()];
            // Half the edges, a quarter of the error.
            fine + (fine - coarse) / 3.0
        };
        Volumes {
            set_volume_m3_s6: Compared::new(folded, with_wings),
            hull_volume_m3_s6: Compared::new(hull(Wings::Folded), hull(Wings::Spread)),
        }
    }

    /// Integral over the tilt set of a function of the normal.
    fn over_tilt(&self, value: impl Fn(Vector3<f64>) -> f64) -> f64 {
        let middle = |i: u32| (f64::from(i) + 0.5) / f64::from(CELLS);
        let cells = (0..CELLS).flat_map(|i| (0..CELLS).map(move |j| (i, j)));
        let cell = |(i, j)| {
            let (normal, solid_angle) = self.tilt.normal(middle(i), middle(j));
            value(normal) * solid_angle
        };
        cells.map(cell).sum::<f64>() / f64::from(CELLS * CELLS)
    }

    fn folded_volume(&self) -> f64 {
        self.over_tilt(|_| self.thrust_max_n.powi(3) / 3.0) / self.mass_kg.powi(3)
    }

    /// The formula for the flat plate.
    fn flat_volume(&self, force_n: f64) -> f64 {
        let most = self.thrust_max_n;
        let cubes = |[low, high]: [f64; 2]| (high.powi(3) - low.powi(3)) / 3.0;
        let of = |n: Vector3<f64>| {
            let shift = force_n * n.dot(&self.motion);
            let spread = [shift, shift + most];
            if shift.abs() > most {
                cubes([0.0, most]) + cubes(spread)
            } else {
                cubes([shift.min(0.0), spread[1].max(most)])
            }
        };
        self.over_tilt(of) / self.mass_kg.powi(3)
    }

    /// The integral over forces along the motion and across it.
    pub(super) fn turned_volume(&self) -> f64 {
        let lookup = self.lookup();
        let [along, aside] = self.box_of_forces(&lookup);
        let step = [along, aside].map(|[low, high]| (high - low) / f64::from(FORCES));
        let middle = |i: u32, from: f64, step: f64| from + step * (f64::from(i) + 0.5);
        let mut arcs = Vec::new();
        let mut volume = 0.0;
        for i in 0..FORCES {
            for j in 0..FORCES {
                let (along, aside) = (middle(i, along[0], step[0]), middle(j, aside[0], step[1]));
                self.normals(along, aside, &lookup, |normal| arcs.extend(self.arcs(normal)));
                volume += aside * covered(&mut arcs);
                arcs.clear();
            }
        }
        volume * step[0] * step[1] / self.mass_kg.powi(3)
    }

    /// Turns around the motion in which a normal, its sine and cosine with the motion, is allowed.
    fn arcs(&self, [sine, cosine]: [f64; 2]) -> Vec<[f64; 2]> {
        let circle = Circle::around(self.motion, sine, across(self.motion) * cosine.signum());
        self.region.arcs(&circle)
    }

    /// Least and largest force along the motion and across it, N, of all allowed normals.
    fn box_of_forces(&self, lookup: &Lookup) -> [[f64; 2]; 2] {
        let allowed = lookup.iter().filter(|[s, c, ..]| !self.arcs([*s, *c]).is_empty());
        let forces = allowed.flat_map(|[s, c, f, g]| {
            [[0.0, 0.0], [*f, *g]].into_iter().flat_map(move |[f, g]| {
                [0.0, self.thrust_max_n].map(|thrust| [f - thrust * s, g - thrust * c])
            })
        });
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let widest = |[low, high]: [f64; 2], x: f64| [low.min(x), high.max(x)];
        // No force at all is among them, so that forces across start at none.
        forces.fold([none, [0.0, 0.0]], |[along, aside], [a, b]| {
            [widest(along, a), widest(aside, b.abs())]
        })
    }

    fn lookup(&self) -> Lookup {
        let angle = |i: u32| PI * (f64::from(i) / f64::from(ANGLES) - 0.5);
        let at = |alpha: f64| {
            let [along, cross] = self.polar.force(alpha);
            [alpha.sin(), alpha.cos(), along, cross]
        };
        (0..=ANGLES).map(|i| at(angle(i))).collect()
    }

    /// Normals, as sine and cosine with the motion, that reach a force of thrust and wings, folded
    /// or spread, N; a cosine below zero is on the other side of the motion.
    fn normals(&self, along: f64, aside: f64, lookup: &Lookup, mut found: impl FnMut([f64; 2])) {
        let thrust = along.hypot(aside);
        if thrust <= self.thrust_max_n {
            let none = [0.0, -1.0];
            found(if thrust > 0.0 { [-along / thrust, -aside / thrust] } else { none });
        }
        for sign in [1.0, -1.0] {
            let cross = sign * aside;
            // Across thrust nothing may be left, and along it what is left is the thrust.
            let left = |[s, c, f, g]: [f64; 4]| {
                [(along - f) * c - (cross - g) * s, -(along - f) * s - (cross - g) * c]
            };
            for pair in lookup.windows(2) {
                let [a, b] = [left(pair[0]), left(pair[1])];
                if (a[0] < 0.0) == (b[0] < 0.0) {
                    continue;
                }
                let share = a[0] / (a[0] - b[0]);
                let thrust = a[1] + share * (b[1] - a[1]);
                if (0.0..=self.thrust_max_n).contains(&thrust) {
                    let [s, c] = [0, 1].map(|i| pair[0][i] + share * (pair[1][i] - pair[0][i]));
                    found([s, sign * c]);
                }
            }
        }
    }

    /// Whether an acceleration can be had, m/s^2.
    pub fn contains(&self, acceleration: In<Ned, f64>) -> bool {
        let force = (acceleration.vector - Vector3::z() * GRAVITY_M_S2) * self.mass_kg;
        let along = force.dot(&self.motion);
        let aside = force - self.motion * along;
        let towards = aside.try_normalize(0.0).unwrap_or_else(|| across(self.motion));
        let mut has = false;
        self.normals(along, aside.norm(), &self.lookup(), |[s, c]| {
            has |= self.region.contains(self.motion * s + towards * c);
        });
        has
    }
}

/// How much of a turn arcs cover together, rad; the arcs are put in order.
fn covered(arcs: &mut Vec<[f64; 2]>) -> f64 {
    for i in 0..arcs.len() {
        let [from, to] = arcs[i];
        let start = from.rem_euclid(TAU);
        let end = start + (to - from);
        arcs[i] = [start, end.min(TAU)];
        if end > TAU {
            arcs.push([0.0, end - TAU]);
        }
    }
    arcs.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let sweep = |[sum, reached]: [f64; 2], [from, to]: &[f64; 2]| {
        [sum + (to - from.max(reached)).max(0.0), to.max(reached)]
    };
    arcs.iter().fold([0.0, 0.0], sweep)[0]
}

#[cfg(test)]
mod tests {
    use crate::reach::{Question, Reach, Tilt};
    use crate::wing::WingForce;
    use nalgebra::Vector3;
    use squirrel_core::frames::In;

    /// The formula for the flat plate and the integral for any wing are two ways to one number.
    #[test]
    fn the_two_volumes_of_a_flat_wing_agree() {
        let [roll_max_rad, pitch_max_rad, yaw_rad] = [0.5, 0.6, 0.4];
        for tilt in
            [Tilt::Cone { max_rad: 0.7 }, Tilt::Box { roll_max_rad, pitch_max_rad, yaw_rad }]
        {
            for velocity in [[7.0, 0.0, 0.0], [4.0, 3.0, 6.0], [0.0, 0.0, 12.0], [2.0, 1.0, -11.0]]
            {
                let question = Question {
                    mass_kg: 0.548,
                    thrust_max_n: 6.0,
                    tilt,
                    velocity: In::new(Vector3::from(velocity)),
                    wing: WingForce::Flat { area_m2: 0.04 },
                };
                let reach = Reach::new(&question).unwrap();
                let by_formula = reach.volumes().set_volume_m3_s6.with_wings;
                let by_turns = reach.turned_volume();
                assert!(
                    (by_turns / by_formula - 1.0).abs() < 2e-3,
                    "{tilt:?} {velocity:?}: {by_turns} {by_formula}"
                );
            }
        }
    }
}
