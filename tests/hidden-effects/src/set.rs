//! The sets of cases: how many a full run has, what is flown in them and by whom.

use crate::catalogue::{CATALOGUE, Entry};
use crate::independent::Excitation;
use serde::{Deserialize, Serialize};

/// A group of cases that is scored together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Set {
    /// One effect of the catalogue.
    Single,
    /// Two of different kinds.
    Two,
    /// Nothing.
    None,
    /// Physics that no catalogue has.
    Outside,
    /// One effect in another published form.
    OtherForm,
    /// One effect, twice the noise.
    NoiseX2,
    /// One effect, three times the noise.
    NoiseX3,
    /// One effect, normal excitation.
    Normal,
    /// One effect, calm excitation.
    Calm,
    /// Attitude and velocity come from an autopilot's filter; one effect, or nothing.
    Estimates,
    /// A sensor or a clock errs.
    Sensors,
    /// Motion capture and no inertial unit; one effect that forces and trim show, or nothing.
    Capture,
    /// The vehicle file says more of an effect than is there.
    Overstated,
    /// One effect beside unmodelled, coloured forces and moments.
    Misfit,
    /// A vehicle that is off its file, with good flights of its own; then one effect more, or
    /// nothing.
    Baseline,
    /// One effect in poor flights: short, short and calm, or without fixes.
    Poor,
    /// No velocity, position or height: one effect that inertial unit and commands show, or nothing.
    Inertial,
    /// One effect beside unmodelled, coloured forces and moments in one place alone: horizontal
    /// force, vertical force, or moments.
    MisfitApart,
}

impl Set {
    /// All sets with the number of cases of a full run.
    pub const ALL: [(Self, usize); 18] = [
        (Self::Single, 290),
        (Self::Two, 200),
        (Self::None, 300),
        (Self::Outside, 204),
        (Self::OtherForm, 60),
        (Self::NoiseX2, 60),
        (Self::NoiseX3, 60),
        (Self::Normal, 60),
        (Self::Calm, 60),
        (Self::Estimates, 232),
        (Self::Sensors, 100),
        (Self::Capture, 180),
        (Self::Overstated, 112),
        (Self::Misfit, 105),
        (Self::Baseline, 116),
        (Self::Poor, 66),
        (Self::Inertial, 132),
        (Self::MisfitApart, 63),
    ];

    /// Name as on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Two => "two",
            Self::None => "none",
            Self::Outside => "outside",
            Self::OtherForm => "other_form",
            Self::NoiseX2 => "noise_x2",
            Self::NoiseX3 => "noise_x3",
            Self::Normal => "normal",
            Self::Calm => "calm",
            Self::Estimates => "estimates",
            Self::Sensors => "sensors",
            Self::Capture => "capture",
            Self::Overstated => "overstated",
            Self::Misfit => "misfit",
            Self::Baseline => "baseline",
            Self::Poor => "poor",
            Self::Inertial => "inertial",
            Self::MisfitApart => "misfit_apart",
        }
    }

    /// Where a case is counted: those of a half set that hide nothing are a group of their own.
    pub fn group(self, hides_nothing: bool) -> &'static str {
        match self {
            Self::Estimates if hides_nothing => "estimates_none",
            Self::Capture if hides_nothing => "capture_none",
            Self::Baseline if hides_nothing => "baseline_none",
            Self::Inertial if hides_nothing => "inertial_none",
            _ => self.name(),
        }
    }

    /// The set of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().map(|(set, _)| set).find(|set| set.name() == name)
    }

    /// Whether every other case of it hides nothing.
    pub fn is_half(self) -> bool {
        matches!(self, Self::Estimates | Self::Capture | Self::Baseline | Self::Inertial)
    }

    pub(crate) fn excitation(self) -> Excitation {
        match self {
            Self::Normal => Excitation::Normal,
            Self::Calm => Excitation::Calm,
            _ => Excitation::Rich,
        }
    }

    pub(crate) fn noise(self) -> f64 {
        match self {
            Self::NoiseX2 => 2.0,
            Self::NoiseX3 => 3.0,
            _ => 1.0,
        }
    }

    /// Effects that its cases hide in turn, each as often as any other.
    pub(crate) fn effects(self) -> Vec<&'static Entry> {
        let of = |names: &[&str]| {
            let named = |name: &&str| CATALOGUE.iter().find(|entry| entry.name == *name);
            names.iter().filter_map(named).collect()
        };
        match self {
            Self::Capture => of(&CAPTURED),
            Self::Inertial => of(&FELT),
            Self::Misfit | Self::MisfitApart => of(&BESIDE_MISFIT),
            // Gusts have no size that a file could state too large: what blows on one day is not
            // what blows on another.
            Self::Overstated => CATALOGUE.iter().filter(|entry| entry.name != "gust").collect(),
            _ => CATALOGUE.iter().collect(),
        }
    }
}

/// Flown by itself: dashes that show other effects swing it up to the horizontal, where nobody flies
/// a load and nothing of its swing can be foreseen.
pub(crate) const LOAD: &str = "payload_swing";

/// What position and attitude from outside, commands and voltage can show. Slow forces: drag, wind,
/// lift over speed and climb, the wings' and the ground's, thrust that follows the voltage or is
/// off, weight, a load that swings below 1 Hz, a thrust axis that leans. Trim, that is the moment
/// that is commanded all the time: a weak rotor, a centre of mass beside the rotors' middle, one
/// wing weaker than the other. Not on it: what shows above 3 Hz only, where attitude that is
/// differentiated twice is noise (lags, latencies, gyroscopic torque, damping, inertia), and the
/// sensors that are not there.
pub const CAPTURED: [&str; 15] = [
    "linear_drag",
    "quadratic_drag",
    "constant_wind",
    "ground_effect",
    "battery_sag",
    "thrust_coefficient",
    "weak_rotor",
    "mass_error",
    "cg_offset",
    "thrust_misalignment",
    "translational_lift",
    "axial_inflow",
    "wing_membrane",
    "wing_asymmetry",
    "payload_swing",
];

/// What forces along the thrust axis, rates and commands show at whatever velocity: thrust, weight,
/// what lies between commands and rotors, and what turns the vehicle. Not on it: what the air does
/// at a velocity that nobody knows.
pub const FELT: [&str; 11] = [
    "battery_sag",
    "thrust_coefficient",
    "motor_lag",
    "weak_rotor",
    "mass_error",
    "inertia_error",
    "cg_offset",
    "yaw_torque_coeff",
    "rotor_gyro_torque",
    "actuation_latency",
    "clock_skew",
];

/// Forces and moments that follow from motion and commands. Not on it: gusts, which are an
/// unmodelled force themselves, and errors of sensors and clocks, which are no force.
pub const BESIDE_MISFIT: [&str; 21] = [
    "linear_drag",
    "quadratic_drag",
    "constant_wind",
    "ground_effect",
    "battery_sag",
    "thrust_coefficient",
    "motor_lag",
    "weak_rotor",
    "mass_error",
    "inertia_error",
    "cg_offset",
    "thrust_misalignment",
    "translational_lift",
    "axial_inflow",
    "flapping_moment",
    "yaw_torque_coeff",
    "angular_damping",
    "actuation_latency",
    "wing_membrane",
    "wing_asymmetry",
    "payload_swing",
];

/// Who flies a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Generator {
    /// [`crate::independent`].
    Independent,
    /// [`crate::squirrel_made`].
    Squirrel,
}

impl Generator {
    /// Each flies every other case of a set, and so every effect and form. What no catalogue has,
    /// only one can fly.
    pub(crate) fn of(set: Set, index: usize) -> Self {
        // Of an even number of forms or effects: the generators change places from one round to the
        // next.
        let turn = match set {
            Set::Outside | Set::Misfit | Set::MisfitApart => return Self::Independent,
            Set::OtherForm => index + index / forms().len(),
            Set::Overstated => index + index / set.effects().len(),
            _ if set.is_half() => index / 2,
            _ => index,
        };
        if turn.is_multiple_of(2) { Self::Independent } else { Self::Squirrel }
    }
}

/// Every form that is not the standard one.
pub(crate) fn forms() -> Vec<(&'static Entry, &'static str)> {
    CATALOGUE.iter().flat_map(|entry| entry.forms.iter().map(move |form| (entry, *form))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn lists_name_effects_of_the_catalogue_and_groups_are_told_apart() {
        assert_eq!(Set::Capture.effects().len(), CAPTURED.len());
        assert_eq!(Set::Misfit.effects().len(), BESIDE_MISFIT.len());
        assert_eq!(Set::Inertial.effects().len(), FELT.len());
        assert_eq!(Set::Overstated.effects().len(), CATALOGUE.len() - 1);
        assert_eq!(Set::Estimates.group(true), "estimates_none");
        assert_eq!((Set::None.group(true), Set::Baseline.group(false)), ("none", "baseline"));
        assert!(Set::ALL.iter().all(|(set, _)| Set::from_name(set.name()) == Some(*set)));
    }

    /// Each generator flies each effect of a set that both fly.
    #[test]
    fn generators_share_the_effects() {
        for set in [
            Set::Single,
            Set::Estimates,
            Set::Capture,
            Set::Overstated,
            Set::Baseline,
            Set::Inertial,
        ] {
            let effects = set.effects().len();
            let step = if set.is_half() { 2 } else { 1 };
            let flown: BTreeSet<_> =
                (0..2 * effects).map(|k| (k % effects, Generator::of(set, step * k))).collect();
            assert_eq!(flown.len(), 2 * effects, "{set:?}");
        }
    }
}
