//! Vehicle files that say more of an effect than there is: in `[effects.NAME]`, or in a number of
//! the vehicle itself.

use crate::airframe::Airframe;
use crate::catalogue::{Entry, HiddenEffect, Value};
use crate::draw::Draw;
use serde::{Deserialize, Serialize};

/// What the file says of an effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Stated {
    /// The effect in the file's size.
    pub effect: HiddenEffect,
    /// Whether a number of the vehicle has it, not a table of effects.
    pub in_base: bool,
}

/// What a file says, and what flies.
#[derive(Debug, Clone, PartialEq)]
pub struct Overstatement {
    /// In the file.
    pub stated: Stated,
    /// In the vehicle; `None` where there is nothing of it.
    pub real: Option<HiddenEffect>,
}

/// Part of what the file says that is there.
const PART: [f64; 2] = [0.3, 0.6];

/// Effects whose size is positive in the catalogue and has another side in the world: a rotor that
/// is stronger than its neighbours, lift, inflow and flapping against the usual sign. Only the
/// independent generator flies them.
const OTHER_SIDE: [&str; 4] =
    ["weak_rotor", "translational_lift", "axial_inflow", "flapping_moment"];

/// Effects that a number of the vehicle has too. A moment of inertia is not among them: too high by
/// much, it is that of no body, and no file may have it.
const IN_BASE: [&str; 7] = [
    "linear_drag",
    "quadratic_drag",
    "thrust_coefficient",
    "motor_lag",
    "mass_error",
    "yaw_torque_coeff",
    "wing_servo_lag",
];

impl Overstatement {
    /// The case of a number in the set, whose effects come in rounds: in four rounds each effect is
    /// there in part, not at all, in part with the file's own number too high, and with the
    /// opposite sign, as far as that exists.
    pub fn draw(entry: &Entry, round: usize, draw: &mut Draw, mass_kg: f64, rotors: usize) -> Self {
        let part = draw.uniform(PART[0], PART[1]);
        let in_base = round % 4 == 2 && IN_BASE.contains(&entry.name);
        let turned = round % 4 == 3 && (entry.is_signed() || OTHER_SIDE.contains(&entry.name));
        let share = match round % 4 {
            3 if turned => -part,
            1 | 3 => 0.0,
            _ => part,
        };
        // What is to be found is the difference: it must not be below the smallest that is worth
        // reporting.
        let effect =
            entry.draw_above(1.0 / (1.0 - share.max(0.0)), draw, "standard", mass_kg, rotors);
        let real = (share != 0.0).then(|| effect.scaled(share));
        Self { stated: Stated { effect, in_base }, real }
    }

    /// Whether squirrel's own vehicle files refuse what flies.
    pub fn is_of_the_other_side(&self) -> bool {
        let negative = |real: &HiddenEffect| real.parameters.values().any(is_negative);
        OTHER_SIDE.contains(&self.stated.effect.name.as_str())
            && self.real.as_ref().is_some_and(negative)
    }
}

fn is_negative(value: &Value) -> bool {
    matches!(value, Value::Number(x) if *x < 0.0)
}

impl Stated {
    /// The vehicle with the effect in its numbers.
    pub fn in_airframe(&self, nominal: &Airframe) -> Airframe {
        let (mut file, x) = (nominal.clone(), |key: &str| self.effect.number(key));
        if !self.in_base {
            return file;
        }
        match self.effect.name.as_str() {
            "linear_drag" => {
                file.drag_n_s_per_m.x += x("extra_drag_n_s_per_m");
                file.drag_n_s_per_m.y += x("extra_drag_n_s_per_m");
            }
            "quadratic_drag" => file.drag_area_m2 += x("extra_drag_area_m2"),
            "thrust_coefficient" => {
                let grown = 1.0 + x("thrust_fraction");
                file.rotors.iter_mut().for_each(|rotor| rotor.thrust_coefficient_n_s2 *= grown);
            }
            "motor_lag" => file.rotor_time_constant_s += x("extra_time_constant_s"),
            "mass_error" => file.mass_kg *= 1.0 + x("mass_fraction"),
            "yaw_torque_coeff" => {
                let grown = 1.0 + x("torque_fraction");
                file.rotors.iter_mut().for_each(|rotor| rotor.torque_coefficient_n_m_s2 *= grown);
            }
            "wing_servo_lag" => file.servo_time_constant_s += x("extra_time_constant_s"),
            // No other effect is drawn with `in_base`.
            _ => {}
        }
        file
    }

    /// What the patched file says in all of a parameter, given the number of a verdict. That of an
    /// effect whose table is there is the table's new number; where the vehicle's own number has
    /// it, it adds to that.
    fn total(&self, key: &str, said: f64) -> f64 {
        let file = self.effect.number(key);
        if !self.in_base {
            said
        } else if key.ends_with("_fraction") {
            (1.0 + file) * (1.0 + said) - 1.0
        } else {
            file + said
        }
    }

    /// Whether the patched file is near what flies: every size of the effect has lost most of what
    /// it was off by.
    ///
    /// * `said` - numbers of the verdict by key
    pub fn is_mended(
        &self,
        real: Option<&HiddenEffect>,
        said: impl Fn(&str) -> Option<f64>,
    ) -> bool {
        let sizes = self.effect.sizes();
        !sizes.is_empty()
            && sizes.iter().all(|keys| {
                let (mut off, mut left) = (0.0_f64, 0.0_f64);
                for key in keys {
                    let truth = real.map_or(0.0, |real| real.number(key));
                    // A key that the verdict lacks stays as the file has it.
                    let total =
                        said(key).map_or(self.effect.number(key), |said| self.total(key, said));
                    off = off.hypot(self.effect.number(key) - truth);
                    left = left.hypot(total - truth);
                }
                left <= LEFT_MAX * off
            })
    }
}

/// Part of what the file was off by that a patch may leave.
const LEFT_MAX: f64 = 1.0 / 3.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::set::Set;

    fn each() -> impl Iterator<Item = (&'static Entry, usize, Overstatement)> {
        let entries = Set::Overstated.effects();
        entries.into_iter().flat_map(|entry| {
            (0..4).map(move |round| {
                let mut draw = Draw::new(round as u64);
                (entry, round, Overstatement::draw(entry, round, &mut draw, 0.6, 4))
            })
        })
    }

    #[test]
    fn files_say_more_than_there_is() {
        let (mut negative, mut based) = (0, 0);
        for (entry, round, drawn) in each() {
            for keys in drawn.stated.effect.sizes() {
                let norm = |of: &dyn Fn(&str) -> f64| {
                    keys.iter().map(|key| of(key).powi(2)).sum::<f64>().sqrt()
                };
                let file = norm(&|key| drawn.stated.effect.number(key));
                let real = norm(&|key| drawn.real.as_ref().map_or(0.0, |real| real.number(key)));
                let part = real / file;
                // The length of a load's line is right in the file.
                assert!(
                    part == 0.0 || (0.3..=0.6).contains(&part),
                    "{} {round}: {part}",
                    entry.name
                );
            }
            negative += usize::from(drawn.is_of_the_other_side());
            based += usize::from(drawn.stated.in_base);
        }
        assert_eq!((negative, based), (OTHER_SIDE.len(), IN_BASE.len()));
    }

    #[test]
    fn base_numbers_are_too_high_where_they_are_said_to_be() {
        let nominal = Airframe::draw(&mut Draw::new(3));
        for (entry, _, drawn) in each() {
            let file = drawn.stated.in_airframe(&nominal);
            assert_eq!(file != nominal, drawn.stated.in_base, "{}", entry.name);
        }
    }

    #[test]
    fn the_truth_mends_the_file_and_the_file_itself_does_not() {
        for (entry, round, drawn) in each() {
            let stated = &drawn.stated;
            let truth = |key: &str| drawn.real.as_ref().map_or(0.0, |real| real.number(key));
            let said = |key: &str| {
                let (file, truth) = (stated.effect.number(key), truth(key));
                Some(match (stated.in_base, key.ends_with("_fraction")) {
                    (false, _) => truth,
                    (true, true) => (1.0 + truth) / (1.0 + file) - 1.0,
                    (true, false) => truth - file,
                })
            };
            assert!(stated.is_mended(drawn.real.as_ref(), said), "{} {round}", entry.name);
            assert!(!stated.is_mended(drawn.real.as_ref(), |_| None), "{} {round}", entry.name);
        }
    }
}
