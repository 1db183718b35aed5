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
/// here. [`check`] asks what they may be, as it knows the field's name.
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
    let provenance = |item: &toml::Value| {
        if !item.is_table() {
            return Provenance { value: item.to_string(), ..Provenance::default() };
        }
        let text = |key: &str| {
            item.get(key).map(|v| v.as_str().map_or_else(|| v.to_string(), str::to_owned))
        };
        let value = text("value").unwrap_or_default();
        Provenance { value, sd: text("sd"), source: text("source") }
    };
    all(table).into_iter().map(|(field, item)| (field, provenance(item))).collect()
}

/// Whether each `sd`, `low` and `high` of a vehicle file is one.
///
/// # Errors
/// One line that names field, key and value.
pub(crate) fn check(table: &toml::Table) -> Result<(), String> {
    /// Its square is finite, also over that of a small number.
    const SD_MAX: f64 = 1e100;
    for (field, item) in all(table) {
        let Some(value) = item.get("value") else { continue };
        let wrong = |key: &str, given: &toml::Value, must: &str| {
            Err(format!("{field}.{key} = {given}: must be {must}"))
        };
        if let Some(sd) = item.get("sd") {
            if !numbers(sd).iter().all(|x| (0.0..=SD_MAX).contains(x)) {
                return wrong("sd", sd, "finite, >= 0 and at most 1e100");
            }
            // A number by itself is that of all.
            if sd.is_array() && !is_like(sd, value) {
                return wrong("sd", sd, "one number, or as many as the value has");
            }
        }
        let limits = ["low", "high"].map(|key| item.get(key).map(|x| (key, x, numbers(x))));
        for (key, given, numbers) in limits.iter().flatten() {
            if !numbers.iter().all(|x| x.is_finite()) {
                return wrong(key, given, "finite");
            }
        }
        if let [Some((key, given, low)), Some((_, most, high))] = &limits
            && low.iter().zip(high).any(|(low, high)| low > high)
        {
            return wrong(key, given, &format!("at most {field}.high = {most}"));
        }
    }
    Ok(())
}

/// The numbers of a value in their order.
fn numbers(value: &toml::Value) -> Vec<f64> {
    match value {
        toml::Value::Float(x) => vec![*x],
        toml::Value::Integer(n) => vec![*n as f64],
        toml::Value::Array(list) => list.iter().flat_map(numbers).collect(),
        _ => Vec::new(),
    }
}

/// Whether a list has as many entries as a value, and each list in it, too; the diagonal of a matrix
/// may stand for its rows.
fn is_like(list: &toml::Value, value: &toml::Value) -> bool {
    match (list.as_array(), value.as_array()) {
        (Some(list), Some(value)) => {
            list.len() == value.len() && list.iter().zip(value).all(|(a, b)| is_like(a, b))
        }
        (list, _) => list.is_none(),
    }
}

/// Every number of a vehicle file by its field: as itself, or in its long form a table.
fn all(table: &toml::Table) -> Vec<(String, &toml::Value)> {
    let mut all = Vec::new();
    inside(table, "", &mut all);
    all
}

fn inside<'a>(table: &'a toml::Table, field: &str, all: &mut Vec<(String, &'a toml::Value)>) {
    for (key, inner) in table {
        walk(inner, if field.is_empty() { key.clone() } else { format!("{field}.{key}") }, all);
    }
}

fn walk<'a>(value: &'a toml::Value, field: String, all: &mut Vec<(String, &'a toml::Value)>) {
    match value {
        toml::Value::Table(table) if !table.contains_key("value") => inside(table, &field, all),
        toml::Value::Array(list) if list.iter().all(toml::Value::is_table) => {
            for (i, inner) in list.iter().enumerate() {
                walk(inner, format!("{field}[{i}]"), all);
            }
        }
        toml::Value::String(_) => {}
        number => all.push((field, number)),
    }
}
