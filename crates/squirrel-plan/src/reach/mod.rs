//! Which accelerations a multirotor can reach at once, with its wings folded and with a choice of
//! folded or spread.
//!
//! ```text
//! A(v) = { g e3 - (U/m) n + w f(v, n)/m : 0 <= U <= U_max, n within the tilt limits, w = 0 or 1 }      (docs/equations.md F)
//! ```
//! `v` is the velocity through the air and `f` the steady force of spread wings ([`WingForce`]).
//! Spread wings push whether wanted or not: the union over `w` is not convex and may have a gap, so
//! the set and its convex hull are told apart. [`Reach::support`] is the largest acceleration along
//! a direction, which both share, with a bound that no acceleration exceeds; [`Reach::volumes`]
//! compares set and hull with those of folded wings, [`Reach::extremes`] says what that means for
//! climbing and for braking.

mod case;
mod extremes;
mod flat;
mod mesh;
mod page;
mod polar;
mod tilt;
mod turned;
mod volume;

pub use case::Case;
pub use extremes::{Compared, Extremes};
pub use mesh::Mesh;
pub use page::page;
pub use tilt::Tilt;
pub use volume::Volumes;

use crate::wing::WingForce;
use flat::Largest;
use nalgebra::Vector3;
use polar::Polar;
use squirrel_core::frames::{In, Ned};
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_sim::setting::SettingError;
use tilt::Region;
use turned::Search;

/// Largest mass, kg, and thrust, N: more was not meant.
const LARGEST: f64 = 1e5;
/// Fastest of each component of the velocity, m/s.
const FASTEST_M_S: f64 = 100.0;
/// Airspeed below which wings do nothing, m/s.
const SPEED_MIN_M_S: f64 = 1e-6;
/// How far the bound of a wing that is not flat may lie above what was found, m/s^2.
const GAP_M_S2: f64 = 1e-3;

/// What to answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Question {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Limit of the rotors together, N.
    pub thrust_max_n: f64,
    /// Limits of the attitude.
    pub tilt: Tilt,
    /// Velocity relative to the air, m/s.
    pub velocity: In<Ned, f64>,
    /// What spread wings do.
    pub wing: WingForce,
}

/// Folded or spread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wings {
    /// No force.
    Folded,
    /// All of it.
    Spread,
}

/// The largest acceleration along a direction, and how to get it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Support {
    /// Acceleration along the direction, times its length, m/s^2.
    pub value_m_s2: f64,
    /// Nothing in the set goes beyond this, m/s^2.
    pub upper_m_s2: f64,
    /// Thrust, N.
    pub thrust_n: f64,
    /// Unit vector against the thrust, body z.
    pub normal: In<Ned, f64>,
    /// Wings.
    pub wings: Wings,
    /// The whole acceleration, m/s^2.
    pub acceleration: In<Ned, f64>,
}

/// The controllable accelerations of a [`Question`].
#[derive(Debug, Clone)]
pub struct Reach {
    mass_kg: f64,
    thrust_max_n: f64,
    tilt: Tilt,
    region: Region,
    velocity_ned: Vector3<f64>,
    /// Unit vector of the motion; anything at rest.
    motion: Vector3<f64>,
    polar: Polar,
}

impl Reach {
    /// Checks the question, and asks the wing model for its force over the angle of attack.
    ///
    /// # Errors
    /// One line with the field and the value that is out of range.
    pub fn new(question: &Question) -> Result<Self, SettingError> {
        let Question { mass_kg, thrust_max_n, tilt, velocity, wing } = question;
        for (name, value) in [("mass_kg", *mass_kg), ("thrust_max_n", *thrust_max_n)] {
            if !(value > 0.0 && value <= LARGEST) {
                return Err(SettingError::value(
                    name,
                    value,
                    format!("must be finite, > 0 and within {LARGEST}"),
                ));
            }
        }
        let velocity_ned = velocity.vector;
        if let Some(wrong) = velocity_ned.iter().find(|x| !(x.abs() <= FASTEST_M_S)) {
            return Err(SettingError::value(
                "velocity_ned_m_s",
                wrong,
                format!("must be finite and within {FASTEST_M_S}"),
            ));
        }
        tilt.check()?;
        if let WingForce::Flat { area_m2 } = wing
            && !(*area_m2 >= 0.0 && area_m2.is_finite())
        {
            return Err(SettingError::value("wing.area_m2", area_m2, "must be finite and >= 0"));
        }
        let speed_m_s = velocity_ned.norm();
        let (motion, polar) = match velocity_ned.try_normalize(SPEED_MIN_M_S) {
            Some(motion) => (motion, Polar::new(wing, speed_m_s)),
            None => (Vector3::x(), Polar::Flat { force_n: 0.0 }),
        };
        Ok(Self {
            mass_kg: *mass_kg,
            thrust_max_n: *thrust_max_n,
            tilt: *tilt,
            region: Region::new(tilt),
            velocity_ned,
            motion,
            polar,
        })
    }

    /// The largest acceleration along a direction, wings folded or spread, whichever goes further:
    /// the support function of the set.
    ///
    /// Exact to rounding for the flat plate. For other wings the bound is within a thousandth of a
    /// m/s^2, of the force as read between its nodes. A direction that is not finite makes NaN.
    pub fn support(&self, direction: In<Ned, f64>) -> Support {
        let [folded, spread] = [self.folded(direction), self.spread(direction)];
        let upper_m_s2 = folded.upper_m_s2.max(spread.upper_m_s2);
        let better = if spread.value_m_s2 > folded.value_m_s2 { spread } else { folded };
        Support { upper_m_s2, ..better }
    }

    /// The largest acceleration along a direction with folded wings.
    pub fn folded(&self, direction: In<Ned, f64>) -> Support {
        let d = direction.vector;
        let normal = self.region.furthest(-d).unwrap_or(Vector3::z());
        let thrust_n = if normal.dot(&d) < 0.0 { self.thrust_max_n } else { 0.0 };
        let value = -thrust_n * normal.dot(&d);
        self.supported(d, thrust_n, Largest { value, upper: value, normal }, Wings::Folded)
    }

    /// The largest acceleration along a direction with spread wings.
    pub fn spread(&self, direction: In<Ned, f64>) -> Support {
        self.spread_by(direction.vector, Some(GAP_M_S2))
    }

    /// As [`Self::spread`]; without a gap, the bound of a wing that is not flat is left out, which
    /// is faster.
    fn spread_by(&self, d: Vector3<f64>, gap_m_s2: Option<f64>) -> Support {
        let length = d.norm();
        let unit = d.try_normalize(0.0).unwrap_or(d);
        let one = |thrust_n: f64| {
            let Self { region, polar, motion, .. } = self;
            let largest = match polar {
                Polar::Flat { force_n } => flat::largest(region, thrust_n, motion * *force_n, unit),
                Polar::Nodes(_) => {
                    let search = Search { region, polar, thrust_n, motion: *motion, d: unit };
                    gap_m_s2
                        .map_or_else(|| search.largest(), |gap| search.bound(gap * self.mass_kg))
                }
            };
            // Only a direction that is none has no largest value.
            let none = Largest { value: 0.0 * length, upper: 0.0 * length, normal: Vector3::z() };
            let largest = largest.unwrap_or(none);
            let scaled =
                Largest { value: largest.value * length, upper: largest.upper * length, ..largest };
            self.supported(d, thrust_n, scaled, Wings::Spread)
        };
        // The acceleration is linear in thrust: one of its ends is the best.
        let [off, full] = [one(0.0), one(self.thrust_max_n)];
        let upper_m_s2 = off.upper_m_s2.max(full.upper_m_s2);
        let better = if off.value_m_s2 > full.value_m_s2 { off } else { full };
        Support { upper_m_s2, ..better }
    }

    /// From the part of thrust and wings along `d`, N.
    fn supported(&self, d: Vector3<f64>, thrust_n: f64, largest: Largest, wings: Wings) -> Support {
        let Largest { value, upper, normal } = largest;
        let weight = GRAVITY_M_S2 * d.z;
        Support {
            value_m_s2: weight + value / self.mass_kg,
            upper_m_s2: weight + upper / self.mass_kg,
            thrust_n,
            normal: In::new(normal),
            wings,
            acceleration: In::new(self.acceleration(thrust_n, normal, wings)),
        }
    }

    /// Force of spread wings, N.
    fn wing_force(&self, normal: Vector3<f64>) -> Vector3<f64> {
        let sine = normal.dot(&self.motion).clamp(-1.0, 1.0);
        let across = (normal - self.motion * sine).try_normalize(1e-12).unwrap_or_default();
        let [along, cross] = self.polar.force(sine.asin());
        self.motion * along + across * cross
    }

    fn acceleration(&self, thrust_n: f64, normal: Vector3<f64>, wings: Wings) -> Vector3<f64> {
        let wing = match wings {
            Wings::Folded => Vector3::zeros(),
            Wings::Spread => self.wing_force(normal),
        };
        Vector3::z() * GRAVITY_M_S2 + (wing - normal * thrust_n) / self.mass_kg
    }
}
