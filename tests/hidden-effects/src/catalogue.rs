//! The effects that a case may hide, their sizes, and which two go together.
//!
//! Names, keys and ranges are the vehicle file's. Sizes with a unit of force, moment or mass are
//! drawn above the lower end for vehicles heavier than the class that the ranges were made for.

use crate::draw::Draw;
use crate::independent::twins::{
    Equation, angular_damping, flapping_moment, rotor_wash, vortex_ring, wing_moment,
    wing_tangential,
};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The mass that the ranges were made for, kg.
pub const CLASS_MASS_KG: f64 = 0.548;

/// A parameter of an effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// In the unit that the key ends with.
    Number(f64),
    /// One of a few names.
    Name(String),
}

/// An effect with its sizes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HiddenEffect {
    /// Standard name.
    pub name: String,
    /// `standard`, or the other published form.
    pub form: String,
    /// By key.
    pub parameters: BTreeMap<String, Value>,
}

impl HiddenEffect {
    /// A number of the effect; 0 where it has none of that key.
    pub fn number(&self, key: &str) -> f64 {
        match self.parameters.get(key) {
            Some(Value::Number(x)) => *x,
            _ => 0.0,
        }
    }
    /// A name of the effect; empty where it has none of that key.
    pub fn text(&self, key: &str) -> &str {
        match self.parameters.get(key) {
            Some(Value::Name(name)) => name,
            _ => "",
        }
    }

    /// The same effect with all its sizes times a factor; what says where or how long stays.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let mut other = self.clone();
        for key in self.sizes().concat() {
            if let Some(Value::Number(x)) = other.parameters.get_mut(key) {
                *x *= factor;
            }
        }
        other
    }

    /// Keys of its sizes; those of a vector stand together.
    pub fn sizes(&self) -> Vec<Vec<&'static str>> {
        let entry = CATALOGUE.iter().find(|entry| entry.name == self.name);
        let quantities = entry.map_or(&[][..], |entry| entry.quantities);
        let sizes = quantities.iter().filter_map(|quantity| match *quantity {
            // The length of a load's line says how it swings, not how much of it there is.
            Quantity::Size { key: "length_m", .. }
            | Quantity::Rotor { .. }
            | Quantity::OneOf { .. } => None,
            Quantity::Size { key, .. }
            | Quantity::Extensive { key, .. }
            | Quantity::Signed { key, .. }
            | Quantity::Along { key, .. } => Some(vec![key]),
            Quantity::Plane { keys, .. } => Some(keys.to_vec()),
            Quantity::Space { keys, .. } => Some(keys.to_vec()),
        });
        sizes.collect()
    }
}

/// How a parameter, or a few together, are drawn.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Quantity {
    /// Between two positive sizes.
    Size { key: &'static str, smallest: f64, largest: f64 },
    /// The same, larger for a heavy vehicle.
    Extensive { key: &'static str, smallest: f64, largest: f64 },
    /// The same with either sign.
    Signed { key: &'static str, smallest: f64, largest: f64 },
    /// The same, a length that grows with the vehicle's.
    Along { key: &'static str, smallest: f64, largest: f64 },
    /// A vector of such a length in the plane.
    Plane { keys: [&'static str; 2], smallest: f64, largest: f64 },
    /// A vector of such a length in space.
    Space { keys: [&'static str; 3], smallest: f64, largest: f64 },
    /// A rotor's number, from 1.
    Rotor { key: &'static str },
    /// One of a few names.
    OneOf { key: &'static str, names: &'static [&'static str] },
}

/// Effects of one kind explain much the same; two hidden effects are of different kinds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Drag,
    SlowForce,
    Thrust,
    Lift,
    Ground,
    Actuation,
    Yaw,
    Moment,
    Wing,
    Sensor,
}

/// One effect of the catalogue.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// Standard name.
    pub name: &'static str,
    /// Other published forms that the independent generator can fly.
    pub forms: &'static [&'static str],
    /// Channels of the residual that it must show in, where its equation has a file of its own:
    /// force x, y, z, moment x, y, z.
    pub shows: &'static [usize],
    /// That equation.
    pub(crate) equation: Option<Equation>,
    kind: Kind,
    quantities: &'static [Quantity],
}

pub(crate) const fn size(key: &'static str, smallest: f64, largest: f64) -> Quantity {
    Quantity::Size { key, smallest, largest }
}
pub(crate) const fn extensive(key: &'static str, smallest: f64, largest: f64) -> Quantity {
    Quantity::Extensive { key, smallest, largest }
}
pub(crate) const fn signed(key: &'static str, smallest: f64, largest: f64) -> Quantity {
    Quantity::Signed { key, smallest, largest }
}
pub(crate) const fn along(key: &'static str, smallest: f64, largest: f64) -> Quantity {
    Quantity::Along { key, smallest, largest }
}
pub(crate) const fn entry(
    name: &'static str,
    kind: Kind,
    forms: &'static [&'static str],
    quantities: &'static [Quantity],
) -> Entry {
    Entry { name, forms, shows: &[], equation: None, kind, quantities }
}

impl Entry {
    /// The same with an equation that stands in a file of its own.
    ///
    /// * `shows` - channels of the residual that it must show in
    pub(crate) const fn flown_by(mut self, equation: Equation, shows: &'static [usize]) -> Self {
        (self.equation, self.shows) = (Some(equation), shows);
        self
    }
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;
const ROTOR: Quantity = Quantity::Rotor { key: "rotor" };
const AXIS: Quantity = Quantity::OneOf { key: "axis", names: &["x", "y", "z"] };
const SIDE: Quantity = Quantity::OneOf { key: "side", names: &["left", "right"] };
const WIND: Quantity =
    Quantity::Plane { keys: ["wind_north_m_s", "wind_east_m_s"], smallest: 1.5, largest: 6.0 };
const CG: Quantity =
    Quantity::Plane { keys: ["cg_x_m", "cg_y_m"], smallest: 0.003, largest: 0.012 };
const TILT: Quantity =
    Quantity::Plane { keys: ["tilt_x_rad", "tilt_y_rad"], smallest: DEGREE, largest: 4.0 * DEGREE };
const BIAS: Quantity = Quantity::Space {
    keys: ["bias_x_m_s2", "bias_y_m_s2", "bias_z_m_s2"],
    smallest: 0.15,
    largest: 0.6,
};

/// The whole catalogue.
pub const CATALOGUE: &[Entry] = &[
    entry(
        "linear_drag",
        Kind::Drag,
        &["anisotropic", "at_rotors"],
        &[extensive("extra_drag_n_s_per_m", 0.04, 0.25)],
    ),
    entry(
        "quadratic_drag",
        Kind::Drag,
        &["anisotropic"],
        &[extensive("extra_drag_area_m2", 0.008, 0.05)],
    ),
    entry("constant_wind", Kind::SlowForce, &["log_profile"], &[WIND]),
    entry("gust", Kind::SlowForce, &["dryden"], &[size("sigma_m_s", 0.8, 2.5)]),
    entry(
        "ground_effect",
        Kind::Ground,
        &["exponential"],
        &[size("effective_radius_m", 0.25, 0.55)],
    ),
    entry(
        "battery_sag",
        Kind::Thrust,
        &["linear", "load_dependent"],
        &[size("voltage_exponent", 0.4, 1.0)],
    ),
    entry("thrust_coefficient", Kind::Thrust, &[], &[signed("thrust_fraction", 0.04, 0.15)]),
    entry(
        "motor_lag",
        Kind::Actuation,
        &["asymmetric"],
        &[size("extra_time_constant_s", 0.015, 0.06)],
    ),
    entry(
        "weak_rotor",
        Kind::Thrust,
        &["thrust_alone"],
        &[ROTOR, size("thrust_loss_fraction", 0.05, 0.2)],
    ),
    entry("mass_error", Kind::Thrust, &[], &[signed("mass_fraction", 0.04, 0.2)]),
    entry("inertia_error", Kind::Moment, &[], &[AXIS, signed("inertia_fraction", 0.12, 0.4)]),
    entry("cg_offset", Kind::Moment, &[], &[CG]),
    entry("thrust_misalignment", Kind::SlowForce, &[], &[TILT]),
    entry(
        "translational_lift",
        Kind::Lift,
        &["linear", "quadratic", "at_rotors"],
        &[size("gain_s2_per_m2", 6e-4, 3e-3)],
    ),
    entry("axial_inflow", Kind::Lift, &["at_rotors"], &[size("gain_s_per_m", 0.012, 0.06)]),
    flapping_moment::ENTRY,
    entry("rotor_gyro_torque", Kind::Yaw, &[], &[extensive("rotor_inertia_kg_m2", 4e-6, 2e-5)]),
    entry("yaw_torque_coeff", Kind::Yaw, &[], &[signed("torque_fraction", 0.12, 0.4)]),
    angular_damping::ENTRY,
    entry("actuation_latency", Kind::Actuation, &[], &[size("latency_s", 0.015, 0.06)]),
    entry(
        "wing_membrane",
        Kind::Wing,
        &["speed_dependent"],
        &[
            signed("gain", 0.12, 0.45),
            signed("angle_of_attack_offset_rad", 1.5 * DEGREE, 6.0 * DEGREE),
        ],
    ),
    entry("wing_asymmetry", Kind::Wing, &[], &[SIDE, size("loss_fraction", 0.12, 0.5)]),
    entry("wing_servo_lag", Kind::Wing, &[], &[size("extra_time_constant_s", 0.12, 0.5)]),
    entry("added_mass", Kind::Thrust, &[], &[extensive("mass_kg", 0.03, 0.15)]),
    entry("accel_bias", Kind::Sensor, &["drifting"], &[BIAS]),
    entry("heading_bias", Kind::Sensor, &[], &[signed("bias_rad", 5.0 * DEGREE, 20.0 * DEGREE)]),
    entry("gnss_latency", Kind::Sensor, &[], &[size("latency_s", 0.08, 0.35)]),
    entry("clock_skew", Kind::Actuation, &[], &[signed("skew_ppm", 400.0, 1500.0)]),
    entry(
        "payload_swing",
        Kind::SlowForce,
        &["damped"],
        &[extensive("mass_kg", 0.03, 0.12), size("length_m", 0.3, 0.9)],
    ),
    rotor_wash::ENTRY,
    vortex_ring::ENTRY,
    wing_moment::ENTRY,
    wing_tangential::ENTRY,
];

/// Pairs of different kinds that flights tell apart only by the tolerances, or where one hides the
/// other's only sign.
const CONFOUNDED: [[&str; 2]; 8] = [
    ["weak_rotor", "cg_offset"],
    ["inertia_error", "yaw_torque_coeff"],
    ["inertia_error", "thrust_coefficient"],
    ["inertia_error", "mass_error"],
    ["accel_bias", "thrust_misalignment"],
    ["heading_bias", "constant_wind"],
    ["payload_swing", "mass_error"],
    ["axial_inflow", "wing_membrane"],
];

impl Entry {
    /// The effect of a size within its range.
    ///
    /// * `form` - `standard` or one of [`Entry::forms`]
    pub fn draw(&self, draw: &mut Draw, form: &str, mass_kg: f64, rotors: usize) -> HiddenEffect {
        self.draw_above(1.0, draw, form, mass_kg, rotors)
    }

    /// The same with the lower end of the range times a factor, as far as the range allows.
    pub fn draw_above(
        &self,
        factor: f64,
        draw: &mut Draw,
        form: &str,
        mass_kg: f64,
        rotors: usize,
    ) -> HiddenEffect {
        let raised = |smallest: f64, largest: f64| {
            if factor > 1.0 {
                (factor * smallest).min(0.7 * largest).max(smallest)
            } else {
                smallest
            }
        };
        let mut parameters = BTreeMap::new();
        let mut put = |key: &str, value: Value| parameters.insert(key.to_owned(), value);
        let heavy = (mass_kg / CLASS_MASS_KG).max(1.0);
        for quantity in self.quantities {
            match *quantity {
                Quantity::Size { key, smallest, largest } => {
                    put(key, Value::Number(draw.uniform(raised(smallest, largest), largest)));
                }
                Quantity::Extensive { key, smallest, largest } => {
                    let least = raised((smallest * heavy).min(0.7 * largest), largest);
                    put(key, Value::Number(draw.uniform(least, largest)));
                }
                Quantity::Signed { key, smallest, largest } => {
                    put(
                        key,
                        Value::Number(
                            draw.sign() * draw.uniform(raised(smallest, largest), largest),
                        ),
                    );
                }
                Quantity::Along { key, smallest, largest } => {
                    let length = (mass_kg / CLASS_MASS_KG).cbrt();
                    let size = draw.uniform(raised(smallest, largest), largest);
                    put(key, Value::Number(draw.sign() * length * size));
                }
                Quantity::Plane { keys, smallest, largest } => {
                    let (length, angle) =
                        (draw.uniform(raised(smallest, largest), largest), draw.angle());
                    put(keys[0], Value::Number(length * angle.cos()));
                    put(keys[1], Value::Number(length * angle.sin()));
                }
                Quantity::Space { keys, smallest, largest } => {
                    let (length, angle) =
                        (draw.uniform(raised(smallest, largest), largest), draw.angle());
                    let up = draw.uniform(-1.0, 1.0);
                    let flat = (1.0 - up * up).sqrt();
                    for (key, x) in keys.iter().zip([flat * angle.cos(), flat * angle.sin(), up]) {
                        put(key, Value::Number(length * x));
                    }
                }
                Quantity::Rotor { key } => {
                    put(key, Value::Number((1 + draw.index(rotors)) as f64));
                }
                Quantity::OneOf { key, names } => {
                    put(key, Value::Name(names[draw.index(names.len())].to_owned()));
                }
            }
        }
        HiddenEffect { name: self.name.to_owned(), form: form.to_owned(), parameters }
    }

    /// Whether its sizes have both signs in the catalogue.
    pub fn is_signed(&self) -> bool {
        let signed = |quantity: &Quantity| {
            matches!(
                quantity,
                Quantity::Signed { .. }
                    | Quantity::Along { .. }
                    | Quantity::Plane { .. }
                    | Quantity::Space { .. }
            )
        };
        self.quantities.iter().any(signed)
    }

    /// Whether both can be told from flights that hide the two of them.
    pub fn goes_with(&self, other: &Entry) -> bool {
        let confounded = |pair: &[&str; 2]| pair.contains(&self.name) && pair.contains(&other.name);
        self.kind != other.kind && !CONFOUNDED.iter().any(confounded)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_twelve_or_more_forms_are_there() {
        let mut names: Vec<_> = CATALOGUE.iter().map(|e| e.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), CATALOGUE.len());
        assert!(CATALOGUE.iter().map(|e| e.forms.len()).sum::<usize>() >= 12);
        for pair in CONFOUNDED {
            assert!(pair.iter().all(|name| names.contains(name)), "{pair:?}");
        }
    }

    #[test]
    fn sizes_stay_in_their_range_and_signs_are_both_drawn() {
        let entry = |name: &str| CATALOGUE.iter().find(|e| e.name == name).unwrap();
        let mut draw = Draw::new(3);
        let mut positive = 0;
        for _ in 0..200 {
            let x = entry("mass_error").draw(&mut draw, "standard", 0.5, 4).number("mass_fraction");
            assert!((0.04..0.2).contains(&x.abs()));
            positive += i32::from(x > 0.0);
            let wind = entry("constant_wind").draw(&mut draw, "standard", 0.5, 4);
            let speed = wind.number("wind_north_m_s").hypot(wind.number("wind_east_m_s"));
            assert!((1.5..6.0).contains(&speed));
            let rotor = entry("weak_rotor").draw(&mut draw, "standard", 0.5, 6).number("rotor");
            assert!((1.0..=6.0).contains(&rotor) && rotor.fract() == 0.0);
            let heavy = entry("added_mass").draw(&mut draw, "standard", 1.6, 4).number("mass_kg");
            assert!(
                (0.0876..0.15).contains(&heavy),
                "a heavy vehicle shows only much of it: {heavy}"
            );
        }
        assert!((60..140).contains(&positive));
    }

    #[test]
    fn nothing_goes_with_itself_and_everything_with_something() {
        for entry in CATALOGUE {
            assert!(!entry.goes_with(entry));
            let partners = CATALOGUE.iter().filter(|other| entry.goes_with(other));
            assert!(partners.count() >= 15, "{}", entry.name);
            assert!(CATALOGUE.iter().all(|other| entry.goes_with(other) == other.goes_with(entry)));
        }
    }
}
