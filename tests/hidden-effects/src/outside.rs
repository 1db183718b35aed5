//! Physics that no catalogue has. Only this crate knows it; the right answer is to say so.

use crate::catalogue::CLASS_MASS_KG;
use crate::draw::Draw;
use crate::independent::{FEATURES, weights};
use serde::{Deserialize, Serialize};

/// One kind with its sizes. Places are horizontal, from the take-off point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[allow(clippy::large_enum_variant, reason = "there is one in a flight")]
#[allow(
    missing_docs,
    reason = "keys say quantity and unit; the equations are the independent generator's"
)]
pub enum Outside {
    /// Something falls off.
    MassLost { mass_fraction: f64, at_s: f64 },
    /// A spring to a point on the ground, slack up to its length.
    Tether { stiffness_n_per_m: f64, length_m: f64, north_m: f64, east_m: f64 },
    /// A pull towards a place in the air, strongest at its reach.
    Magnet { force_n: f64, reach_m: f64, north_m: f64, east_m: f64 },
    /// A rotor loses thrust and torque at once.
    RotorStep { rotor: usize, loss_fraction: f64, at_s: f64 },
    /// A force that swings at one frequency, whatever the vehicle does.
    VibrationLine { frequency_hz: f64, force_n: f64, direction_rad: f64 },
    /// A column of rising air.
    Updraft { force_n: f64, radius_m: f64, north_m: f64, east_m: f64 },
    /// Thrust that grows with the yaw rate.
    YawRateThrust { gain_s_per_rad: f64 },
    /// An open wing that swings in the wind.
    WingFlutter { frequency_hz: f64, gain_n_s2_per_m2: f64 },
    /// Thrust that falls as motors warm up, at any voltage.
    ThrustHeating { loss_fraction: f64, time_constant_s: f64 },
    /// Rotors that disturb each other above a throttle.
    RotorInterference { slope: f64, above_hover: f64 },
    /// A sideways force that turns twice with the heading.
    HeadingSideForce { force_n: f64, phase_rad: f64 },
    /// Liquid that swings in a tank and tips the vehicle.
    Slosh { frequency_hz: f64, mass_kg: f64 },
    /// Motors that follow a command only after it has moved by this much.
    MotorStiction { command_step: f64 },
    /// Yaw damping that is late, and stronger to the right.
    YawMemory { damping_n_m_s_per_rad: f64, memory_s: f64 },
    /// A constant moment from a time on.
    MomentSwitch { roll_n_m: f64, pitch_n_m: f64, at_s: f64 },
    /// Suction of a wall.
    Wall { force_n: f64, reach_m: f64, distance_m: f64, direction_rad: f64 },
    /// The wings stop where they should not.
    WingJam { deployment: f64, from_s: f64 },
    /// A random formula of motion and commands.
    Formula(Formula),
}

/// The shape of a formula.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs, reason = "each is the function of its name")]
pub enum Shape {
    Sin,
    Tanh,
    Square,
    Abs,
    Product,
}

/// What a formula makes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs, reason = "each is what its name says")]
pub enum Makes {
    BodyForce,
    Moment,
    NedForce,
    ThrustFactor,
}

/// `size * axis * shape(first . x, second . x)`, `x` motion and commands over what is usual; late
/// by a lag, and there only where another sum is positive.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the equation above says what each is")]
pub struct Formula {
    pub shape: Shape,
    pub makes: Makes,
    /// N, N m, or a share of the thrust.
    pub size: f64,
    pub axis: [f64; 3],
    pub first: [f64; FEATURES],
    pub second: [f64; FEATURES],
    pub lag_s: f64,
    pub gate: Option<[f64; FEATURES]>,
}

impl Formula {
    const SHAPES: [Shape; 5] = [Shape::Sin, Shape::Tanh, Shape::Square, Shape::Abs, Shape::Product];
    const MAKES: [Makes; 4] =
        [Makes::BodyForce, Makes::Moment, Makes::NedForce, Makes::ThrustFactor];

    /// Shape and what it makes go by the number, everything else is drawn.
    fn draw(number: usize, draw: &mut Draw, heavy: f64) -> Self {
        let makes = Self::MAKES[number % Self::MAKES.len()];
        let size = match makes {
            Makes::BodyForce | Makes::NedForce => heavy * draw.uniform(0.7, 1.1),
            Makes::Moment => heavy * draw.uniform(0.025, 0.04),
            Makes::ThrustFactor => draw.uniform(0.12, 0.2),
        };
        let mut axis = draw.normal3(1.0);
        if makes == Makes::Moment {
            // Rotors turn a vehicle about its vertical axis with little moment.
            axis[2] *= YAW;
        }
        let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
        Self {
            shape: Self::SHAPES[number % Self::SHAPES.len()],
            makes,
            size,
            axis: axis.map(|x| x / length),
            first: weights(LENGTH, draw),
            second: weights(LENGTH, draw),
            lag_s: if draw.sign() > 0.0 { draw.uniform(0.2, 0.6) } else { LAG_NONE_S },
            gate: (draw.sign() > 0.0).then(|| weights(LENGTH, draw)),
        }
    }

    /// The function of the two sums; of usual motion it is about 1 in size, and about 0 in the
    /// mean.
    pub fn of(&self, a: f64, b: f64) -> f64 {
        match self.shape {
            Shape::Sin => (2.0 * a).sin(),
            Shape::Tanh => (3.0 * a).tanh(),
            Shape::Square => (a * a - 0.5).min(3.0),
            Shape::Abs => (1.5 * a.abs() - 0.8).min(2.0),
            Shape::Product => (1.5 * a * b).clamp(-2.5, 2.5),
        }
    }
}

/// Moment about the vertical axis over that about the others.
const YAW: f64 = 0.2;
/// Length of a formula's weights.
const LENGTH: f64 = 1.6;
/// As good as none: three samples of the inertial unit.
const LAG_NONE_S: f64 = 0.01;

impl Outside {
    /// Kinds with an equation of their own, and as many formulas.
    const BY_HAND: usize = 17;
    /// How many kinds there are; the even ones are by hand, the odd ones formulas.
    pub const KINDS: usize = 2 * Self::BY_HAND;

    /// What it is called in summaries.
    pub fn name(&self) -> String {
        let value = serde_json::to_value(self).unwrap_or_default();
        let word = |key: &str| value[key].as_str().unwrap_or_default().to_owned();
        match self {
            Self::Formula(_) => format!("formula_{}_{}", word("shape"), word("makes")),
            _ => word("kind"),
        }
    }

    /// A kind by its number, 0 to [`Self::KINDS`], in sizes that matter for such a vehicle.
    pub fn draw(kind: usize, draw: &mut Draw, mass_kg: f64, rotors: usize) -> Self {
        let heavy = mass_kg / CLASS_MASS_KG;
        let place = |draw: &mut Draw, radius: f64| {
            (draw.uniform(-radius, radius), draw.uniform(-radius, radius))
        };
        let half_time_s = draw.uniform(14.0, 24.0);
        if kind % 2 == 1 {
            return Self::Formula(Formula::draw(kind / 2 % Self::BY_HAND, draw, heavy));
        }
        match kind / 2 % Self::BY_HAND {
            0 => Self::MassLost { mass_fraction: draw.uniform(0.1, 0.2), at_s: half_time_s },
            1 => {
                let (north_m, east_m) = place(draw, 3.0);
                let stiffness_n_per_m = heavy * draw.uniform(0.08, 0.16);
                Self::Tether {
                    stiffness_n_per_m,
                    length_m: draw.uniform(2.0, 4.0),
                    north_m,
                    east_m,
                }
            }
            2 => {
                let (north_m, east_m) = place(draw, 2.0);
                let force_n = heavy * draw.sign() * draw.uniform(0.5, 1.0);
                Self::Magnet { force_n, reach_m: draw.uniform(1.5, 2.5), north_m, east_m }
            }
            3 => Self::RotorStep {
                rotor: draw.index(rotors),
                loss_fraction: draw.uniform(0.12, 0.25),
                at_s: half_time_s,
            },
            4 => Self::VibrationLine {
                frequency_hz: draw.uniform(2.0, 8.0),
                force_n: heavy * draw.uniform(0.4, 0.9),
                direction_rad: draw.angle(),
            },
            5 => {
                let (north_m, east_m) = place(draw, 2.0);
                let force_n = heavy * draw.uniform(0.5, 1.0);
                Self::Updraft { force_n, radius_m: draw.uniform(2.0, 4.0), north_m, east_m }
            }
            6 => Self::YawRateThrust { gain_s_per_rad: draw.sign() * draw.uniform(0.05, 0.1) },
            7 => Self::WingFlutter {
                frequency_hz: draw.uniform(1.0, 3.0),
                gain_n_s2_per_m2: heavy * draw.uniform(0.015, 0.03),
            },
            8 => Self::ThrustHeating {
                loss_fraction: draw.uniform(0.1, 0.18),
                time_constant_s: draw.uniform(7.0, 14.0),
            },
            9 => Self::RotorInterference {
                slope: draw.uniform(1.2, 2.2),
                above_hover: draw.uniform(0.005, 0.02),
            },
            10 => Self::HeadingSideForce {
                force_n: heavy * draw.uniform(0.4, 0.8),
                phase_rad: draw.angle(),
            },
            11 => Self::Slosh {
                frequency_hz: draw.uniform(0.7, 1.5),
                mass_kg: heavy * draw.uniform(0.03, 0.06),
            },
            12 => Self::MotorStiction { command_step: draw.uniform(0.02, 0.04) },
            13 => Self::YawMemory {
                damping_n_m_s_per_rad: heavy * draw.uniform(0.015, 0.03),
                memory_s: draw.uniform(0.4, 0.8),
            },
            14 => {
                let (size, angle) = (heavy * draw.uniform(0.02, 0.035), draw.angle());
                let (pitch_n_m, roll_n_m) = (size * angle.sin(), size * angle.cos());
                Self::MomentSwitch { roll_n_m, pitch_n_m, at_s: half_time_s }
            }
            15 => Self::Wall {
                force_n: heavy * draw.uniform(0.7, 1.3),
                reach_m: draw.uniform(0.8, 1.5),
                distance_m: draw.uniform(0.5, 1.5),
                direction_rad: draw.angle(),
            },
            _ => {
                Self::WingJam { deployment: draw.uniform(0.3, 0.6), from_s: draw.uniform(4.0, 8.0) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_is_another_kind() {
        let mut names: Vec<_> = (0..Outside::KINDS)
            .map(|kind| Outside::draw(kind, &mut Draw::new(1), 0.5, 4).name())
            .collect();
        let formulas = names.iter().filter(|name| name.starts_with("formula_")).count();
        assert_eq!(2 * formulas, Outside::KINDS);
        names.sort();
        names.dedup();
        assert_eq!(names.len(), Outside::KINDS);
    }
}
