//! The effects that a vehicle file may name, as data: for Python, and for the page of the docs.

use serde::Serialize;
use squirrel_core::effects::{EffectParameter, Effects, FORM, Kind, Scale, forms};
use std::fmt::Write;

/// One effect of the catalogue.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ListedEffect {
    /// Its table in a vehicle file is `[effects.<name>]`.
    pub name: &'static str,
    /// What it is, in a few words.
    pub what: &'static str,
    /// The manoeuvre that shows it.
    pub fly: &'static str,
    /// Published forms, the standard one first; empty where there is one only.
    pub forms: &'static [&'static str],
    /// Keys of its table, `form` left out.
    pub parameters: Vec<ListedParameter>,
}

/// One key of an effect's table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ListedParameter {
    /// The key, which ends with the unit.
    pub key: &'static str,
    /// Forms that have it; all where there is none.
    pub forms: &'static [&'static str],
    /// Names to choose from; none for a number.
    pub names: &'static [&'static str],
    /// Smallest and largest plausible size on the vehicle of the paper, 0.548 kg; `None` for what
    /// counts or chooses.
    pub range: Option<[f64; 2]>,
    /// What both grow with from one vehicle to another; empty for nothing.
    pub grows_with: &'static str,
    /// Whether it may be negative.
    pub signed: bool,
}

impl From<&EffectParameter> for ListedParameter {
    fn from(parameter: &EffectParameter) -> Self {
        let (mut names, mut range, mut grows_with, mut is_signed) = (&[][..], None, "", false);
        match parameter.kind {
            Kind::Size { smallest, largest, signed, scale } => {
                (range, is_signed) = (Some([smallest, largest]), signed);
                grows_with = match scale {
                    Scale::Fixed => "",
                    Scale::Mass => "mass",
                    Scale::Inertia => "inertia",
                    Scale::Arm => "arm",
                    Scale::MassTimesArm => "mass times arm",
                    Scale::PerTipSpeed => "1 / tip speed in hover",
                    Scale::PerTipSpeedSquared => "1 / square of the tip speed in hover",
                };
            }
            Kind::Rotor => {}
            Kind::OneOf(all) => names = all,
        }
        let forms = parameter.forms.unwrap_or_default();
        Self { key: parameter.key, forms, names, range, grows_with, signed: is_signed }
    }
}

/// All effects of the catalogue, by name.
pub fn listed_effects() -> Vec<ListedEffect> {
    let listed = |name: &&'static str| {
        let (list, profile) = (Effects::<f64>::parameters(name)?, Effects::<f64>::profile(name)?);
        let parameters = list.iter().filter(|p| p.key != FORM).map(ListedParameter::from).collect();
        let (what, fly) = (profile.words.what, profile.words.fly);
        Some(ListedEffect { name, what, fly, forms: forms(list), parameters })
    };
    Effects::<f64>::NAMES.iter().filter_map(listed).collect()
}

/// The page `docs/guide/effects.md`.
pub fn effects_page() -> String {
    let mut page = "# Effects\n\n\
        What a vehicle file may add to the base model, each in a table `[effects.<name>]` of its own. Sizes are those that are plausible on a\n\
        vehicle of 0.548 kg, and grow with what is said; +- marks those with a sign. Where there are forms, the first is taken without `form`.\n\
        The head of `crates/squirrel-core/src/effects/<name>.rs` has the law of each with its source. `voltage_exponent` is that of the rotors'\n\
        speed: thrust goes with twice of it. Isotropic linear drag acts in the rotors' plane, not along their axis.\n\
        This page is made from the code: `SQUIRREL_EFFECTS_WRITE=1 cargo test --release -p squirrel-sim --test it effects` writes it.\n\n\
        | effect | what it is | parameters | forms | what shows it |\n|---|---|---|---|---|\n"
        .to_owned();
    for effect in listed_effects() {
        let parameters: Vec<String> = effect.parameters.iter().map(in_words).collect();
        let _ = writeln!(
            page,
            "| `{}` | {} | {} | {} | {} |",
            effect.name,
            effect.what.replace('@', "..."),
            parameters.join("<br>"),
            effect.forms.join(", "),
            effect.fly
        );
    }
    page
}

/// `extra_drag_n_s_per_m` +-0.04 to 0.25, with mass.
fn in_words(parameter: &ListedParameter) -> String {
    let mut text = format!("`{}`", parameter.key);
    if let Some([smallest, largest]) = parameter.range {
        let sign = if parameter.signed { "+-" } else { "" };
        let _ = write!(text, " {sign}{smallest} to {largest}");
    }
    if !parameter.names.is_empty() {
        let _ = write!(text, " {}", parameter.names.join(", "));
    }
    if !parameter.grows_with.is_empty() {
        let _ = write!(text, ", with {}", parameter.grows_with);
    }
    if !parameter.forms.is_empty() {
        let _ = write!(text, " ({})", parameter.forms.join(", "));
    }
    text
}
