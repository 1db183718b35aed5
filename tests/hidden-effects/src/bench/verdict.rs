//! What the program says about a case; the part of its JSON that the bench looks at.

use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// The words of the program, and one for where it said nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Word {
    /// No effect above the tolerances.
    None,
    /// Effects of the catalogue, in a form that fits.
    Named,
    /// Effects of the catalogue, with something of their form left over.
    NamedFormDiffers,
    /// Effects of the catalogue that hold, with something else left over.
    NamedIncomplete,
    /// Several explanations.
    Ambiguous,
    /// Something else.
    OutsideCatalogue,
    /// These flights cannot tell.
    NotIdentifiable,
    /// The logs contradict themselves.
    DataProblem,
    /// The program failed; never in its JSON.
    #[serde(skip_deserializing)]
    Failed,
}

/// An interval of a parameter.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Parameter {
    /// A number, or a name.
    pub value: serde_json::Value,
    /// Lower end of its 95 % interval; of a name, the name.
    #[serde(default)]
    pub low: serde_json::Value,
    /// Upper end.
    #[serde(default)]
    pub high: serde_json::Value,
}

/// A named effect.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Named {
    /// Standard name.
    pub name: String,
    /// What it is worth.
    pub evidence_nats: Option<f64>,
    /// By key.
    #[serde(default)]
    pub parameters: BTreeMap<String, Parameter>,
}

/// Another explanation.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Alternative {
    /// Its effects.
    pub effects: Vec<NameOnly>,
}

/// An effect of an alternative: its name alone, or an object with it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum NameOnly {
    /// The name.
    Text(String),
    /// With more.
    Object {
        /// Standard name.
        name: String,
    },
}

/// The gap on held-out flights.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(default)]
pub struct Gap {
    /// Of the difference to the noise floor, 1 for all.
    pub removed_fraction: Option<f64>,
}

/// A verdict.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Verdict {
    /// The word.
    pub verdict: Word,
    /// Named effects.
    #[serde(default)]
    pub effects: Vec<Named>,
    /// Other explanations.
    #[serde(default)]
    pub alternatives: Vec<Alternative>,
    /// What stating the effects is worth.
    pub gap: Option<Gap>,
    /// What a leftover goes with.
    pub goes_with: Option<String>,
    /// Path of the patched vehicle file, where one was written.
    pub model_patch: Option<String>,
    /// Flights that the program did not use, because their data contradict themselves.
    #[serde(default)]
    pub set_aside: Vec<serde_json::Value>,
}

impl Verdict {
    /// Whether names are said without a doubt. A remainder beside them is no doubt about them.
    pub fn names_surely(&self) -> bool {
        matches!(self.verdict, Word::Named | Word::NamedFormDiffers | Word::NamedIncomplete)
    }

    /// A number of a named effect.
    pub fn number(&self, effect: &str, key: &str) -> Option<f64> {
        let named = self.effects.iter().find(|named| named.name == effect)?;
        named.parameters.get(key)?.value.as_f64()
    }

    /// The named effect with the highest evidence; of equals the first.
    pub fn first(&self) -> Option<&str> {
        let evidence = |effect: &Named| effect.evidence_nats.unwrap_or(f64::NEG_INFINITY);
        let best = self.effects.iter().reduce(|a, b| if evidence(b) > evidence(a) { b } else { a });
        best.map(|effect| effect.name.as_str())
    }

    /// Names of the explanation itself.
    pub fn names(&self) -> BTreeSet<&str> {
        self.effects.iter().map(|effect| effect.name.as_str()).collect()
    }

    /// Names of the explanation and of all alternatives.
    pub fn all_names(&self) -> BTreeSet<&str> {
        let others =
            self.alternatives.iter().flat_map(|other| &other.effects).map(|effect| match effect {
                NameOnly::Text(name) | NameOnly::Object { name } => name.as_str(),
            });
        self.names().into_iter().chain(others).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_contract_is_read() {
        let text = r#"{"verdict": "ambiguous",
            "effects": [{"name": "motor_lag", "form": "standard", "evidence_nats": 12.0,
                         "parameters": {"extra_time_constant_s": {"value": 0.03, "low": 0.02, "high": 0.04}}},
                        {"name": "weak_rotor", "evidence_nats": 40.5,
                         "parameters": {"rotor": {"value": 2, "low": null, "high": null},
                                        "axis": {"value": "z", "low": "z", "high": "z"}}}],
            "alternatives": [{"effects": [{"name": "cg_offset"}], "evidence_nats": 11.0},
                             {"effects": ["clock_skew"], "evidence_nats": 9.0}],
            "where": [], "goes_with": null, "fly_next": "multisine",
            "gap": {"before": 3.0, "after": 1.1, "removed_fraction": 0.95}, "model_patch": "x.toml"}"#;
        let verdict: Verdict = serde_json::from_str(text).unwrap();
        assert_eq!(verdict.first(), Some("weak_rotor"));
        assert_eq!(verdict.names().len(), 2);
        assert!(
            verdict.all_names().contains("clock_skew") && verdict.all_names().contains("cg_offset")
        );
        assert_eq!(verdict.gap.unwrap().removed_fraction, Some(0.95));
        assert!(serde_json::from_str::<Verdict>(r#"{"verdict": "failed"}"#).is_err());
        let bare: Verdict = serde_json::from_str(r#"{"verdict": "none"}"#).unwrap();
        assert_eq!((bare.first(), bare.verdict), (None, Word::None));
        assert!(bare.model_patch.is_none() && bare.set_aside.is_empty() && !bare.names_surely());
        assert_eq!(verdict.model_patch.as_deref(), Some("x.toml"));
        assert_eq!(verdict.number("motor_lag", "extra_time_constant_s"), Some(0.03));
        let incomplete = r#"{"verdict": "named_incomplete", "set_aside": ["flight00.mcap"]}"#;
        let incomplete: Verdict = serde_json::from_str(incomplete).unwrap();
        assert!(incomplete.names_surely() && incomplete.set_aside.len() == 1);
    }
}
