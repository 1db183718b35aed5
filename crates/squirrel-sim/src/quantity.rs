//! A number in a vehicle file: plain, or `{ value, sd, source }`.

use serde::de::value::{
    F64Deserializer, I64Deserializer, MapAccessDeserializer, SeqAccessDeserializer,
};
use serde::de::{
    Deserialize, Deserializer, Error, IntoDeserializer, MapAccess, SeqAccess, Visitor,
};
use std::fmt;
use std::marker::PhantomData;

/// A value with its tolerance and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Quantity<V>(pub(crate) V);

/// The long form. `low`, `high` and `domain` are what the gap workflow writes; they do not act
/// here.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Detailed<V> {
    value: V,
    #[serde(rename = "sd")]
    _sd: Option<Deviation>,
    #[serde(rename = "source")]
    _source: Option<String>,
    #[serde(rename = "low")]
    _low: Option<V>,
    #[serde(rename = "high")]
    _high: Option<V>,
    #[serde(rename = "domain")]
    _domain: Option<String>,
}

/// One standard deviation for all numbers, or one each.
#[derive(serde::Deserialize)]
#[serde(untagged, expecting = "a number or a list of numbers")]
enum Deviation {
    All(#[allow(dead_code, reason = "checked here, used by the gap workflow")] f64),
    Each(#[allow(dead_code, reason = "checked here, used by the gap workflow")] Vec<f64>),
    Rows(#[allow(dead_code, reason = "checked here, used by the gap workflow")] Vec<Vec<f64>>),
}

/// For fields of other tables that take a quantity: the value alone.
pub(crate) fn plain<'de, D: Deserializer<'de>, V: Deserialize<'de>>(
    deserializer: D,
) -> Result<V, D::Error> {
    Quantity::deserialize(deserializer).map(|q| q.0)
}

impl<'de, V: Deserialize<'de>> Deserialize<'de> for Quantity<V> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct AsQuantity<V>(PhantomData<V>);
        impl<'de, V: Deserialize<'de>> Visitor<'de> for AsQuantity<V> {
            type Value = V;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number, a list of numbers, or { value, sd, source }")
            }
            fn visit_f64<E: Error>(self, x: f64) -> Result<V, E> {
                let number: F64Deserializer<E> = x.into_deserializer();
                V::deserialize(number)
            }
            fn visit_i64<E: Error>(self, x: i64) -> Result<V, E> {
                // An integer serves as a float too, and as itself where a count is asked for.
                let number: I64Deserializer<E> = x.into_deserializer();
                V::deserialize(number)
            }
            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<V, A::Error> {
                V::deserialize(SeqAccessDeserializer::new(seq))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<V, A::Error> {
                Ok(Detailed::<V>::deserialize(MapAccessDeserializer::new(map))?.value)
            }
        }
        deserializer.deserialize_any(AsQuantity(PhantomData)).map(Quantity)
    }
}

/// What the long form says of one number beside its value.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub struct Provenance {
    /// The value as written.
    pub value: String,
    /// Tolerance, one standard deviation, as written; one number or a list.
    pub sd: Option<String>,
    /// Where the number comes from.
    pub source: Option<String>,
}

/// Every number of a vehicle file by its field, with provenance where it has any.
pub(crate) fn provenance(table: &toml::Table) -> Vec<(String, Provenance)> {
    let mut all = Vec::new();
    walk(&toml::Value::Table(table.clone()), String::new(), &mut all);
    all
}

fn walk(value: &toml::Value, field: String, all: &mut Vec<(String, Provenance)>) {
    match value {
        toml::Value::Table(table) if table.contains_key("value") => {
            let text = |key: &str| {
                table.get(key).map(|v| v.as_str().map_or_else(|| v.to_string(), str::to_owned))
            };
            let value = text("value").unwrap_or_default();
            all.push((field, Provenance { value, sd: text("sd"), source: text("source") }));
        }
        toml::Value::Table(table) => {
            for (key, inner) in table {
                let name = if field.is_empty() { key.clone() } else { format!("{field}.{key}") };
                walk(inner, name, all);
            }
        }
        toml::Value::Array(list) if list.iter().all(toml::Value::is_table) => {
            for (i, inner) in list.iter().enumerate() {
                walk(inner, format!("{field}[{i}]"), all);
            }
        }
        toml::Value::String(_) => {}
        other => {
            all.push((field, Provenance { value: other.to_string(), ..Provenance::default() }));
        }
    }
}
