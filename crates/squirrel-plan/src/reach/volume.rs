//! How much there is to choose from: the volume of the set and of its convex hull
//! (docs/equations.md F.5).
//!
//! With a flat plate the set is made of stretches along `-n`: thrust and wings together are `r n`
//! with `0 <= r <= U_max` folded and `b c <= r <= b c + U_max` spread, `c = v.n`, and the volume is
//! the integral of `r^2` over both. Where `|b c| > U_max` there is a gap between them. For any
//! wing, spread accelerations are an image of (normal, thrust) with the Jacobian
//! `|F_m - U cos| |U - F_v' cos + F_m' sin|` over angle of attack, turn and thrust; what folded
//! wings reach too is left out, and what is hit several times counts once.

use super::polar::Polar;
use super::{Compared, Reach, Wings};
use nalgebra::Vector3;
use serde::Serialize;
use squirrel_core::frames::{In, Ned};
use squirrel_core::math::GRAVITY_M_S2;

/// Cells of the tilt set along each of its two numbers.
const CELLS: u32 = 96;
/// Steps of thrust.
const STEPS: u32 = 48;
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
            Polar::Nodes(_) => folded + self.beyond_folded(),
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

    /// Volume that spread wings alone reach, by the Jacobian.
    pub(super) fn beyond_folded(&self) -> f64 {
        let lookup = self.lookup();
        let of = |n: Vector3<f64>| {
            let s = n.dot(&self.motion).clamp(-1.0, 1.0);
            let (alpha, c) = (s.asin(), (1.0 - s * s).sqrt());
            let ([_, cross], [along_slope, cross_slope]) =
                (self.polar.force(alpha), self.polar.slope(alpha));
            let wing = self.wing_force(n);
            let step = self.thrust_max_n / f64::from(STEPS);
            let at = |i: u32| {
                let thrust = step * (f64::from(i) + 0.5);
                let force = wing - n * thrust;
                if self.folds(force) {
                    return 0.0;
                }
                let jacobian = (cross - thrust * c) * (thrust - along_slope * c + cross_slope * s);
                jacobian.abs() / c.max(1e-9) / f64::from(self.ways(force, &lookup).max(1))
            };
            (0..STEPS).map(at).sum::<f64>() * step
        };
        self.over_tilt(of) / self.mass_kg.powi(3)
    }

    /// Whether folded wings reach a force of thrust and wings, N.
    fn folds(&self, force: Vector3<f64>) -> bool {
        let thrust = force.norm();
        thrust <= self.thrust_max_n
            && force.try_normalize(0.0).is_none_or(|f| self.region.contains(-f))
    }

    fn lookup(&self) -> Lookup {
        let angle = |i: u32| std::f64::consts::PI * (f64::from(i) / f64::from(ANGLES) - 0.5);
        let at = |alpha: f64| {
            let [along, cross] = self.polar.force(alpha);
            [alpha.sin(), alpha.cos(), along, cross]
        };
        (0..=ANGLES).map(|i| at(angle(i))).collect()
    }

    /// In how many ways spread wings reach a force of thrust and wings, N.
    fn ways(&self, force: Vector3<f64>, lookup: &Lookup) -> u32 {
        let along = force.dot(&self.motion);
        let aside = force - self.motion * along;
        let towards = aside.try_normalize(0.0).unwrap_or_else(|| super::tilt::across(self.motion));
        let mut ways = 0;
        for sign in [1.0, -1.0] {
            let cross = sign * aside.norm();
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
                let [s, c] = [0, 1].map(|i| pair[0][i] + share * (pair[1][i] - pair[0][i]));
                let normal = self.motion * s + towards * (sign * c);
                if (0.0..=self.thrust_max_n).contains(&thrust) && self.region.contains(normal) {
                    ways += 1;
                }
            }
        }
        ways
    }

    /// Whether an acceleration can be had, m/s^2.
    pub fn contains(&self, acceleration: In<Ned, f64>) -> bool {
        let force = (acceleration.vector - Vector3::z() * GRAVITY_M_S2) * self.mass_kg;
        self.folds(force) || self.ways(force, &self.lookup()) > 0
    }
}

#[cfg(test)]
mod tests {
    use crate::reach::{Question, Reach, Tilt};
    use crate::wing::WingForce;
    use nalgebra::Vector3;
    use squirrel_core::frames::In;

    /// The formula for the flat plate and the Jacobian for any wing are two ways to one number.
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
                let by_jacobian = reach.folded_volume() + reach.beyond_folded();
                assert!(
                    (by_jacobian / by_formula - 1.0).abs() < 3e-3,
                    "{tilt:?} {velocity:?}: {by_jacobian} {by_formula}"
                );
            }
        }
    }
}
