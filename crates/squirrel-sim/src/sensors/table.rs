//! One table of `[sensors]` in a vehicle file: keys, limits and reading are the same for all
//! sensors.
//!
//! What a table says is kept until all of it is known, because `device` acts before the other keys
//! wherever it stands.

use super::parameters::Timing;
use crate::quantity::plain;
use crate::setting::SettingError;
use serde::de::{Deserialize, DeserializeSeed, Deserializer, Error, MapAccess, Visitor};
use std::fmt;

/// The key that names a device.
pub(super) const DEVICE: &str = "device";

/// What a number may be.
#[derive(Debug, Clone, Copy)]
pub(super) enum Limit {
    /// Any finite number.
    Signed,
    /// Finite and not negative.
    Size,
    /// More than nothing; infinite is no limit.
    AboveZero,
    /// From the one to the other.
    Within(f64, f64),
}

impl Limit {
    /// What a number outside must be.
    fn broken(self, x: f64) -> Option<String> {
        let (holds, reason) = match self {
            Self::Signed => (x.is_finite(), "must be finite".to_owned()),
            Self::Size => (x.is_finite() && x >= 0.0, "must be finite and >= 0".to_owned()),
            Self::AboveZero => (x > 0.0, "must be > 0".to_owned()),
            Self::Within(low, high) => {
                ((low..=high).contains(&x), format!("must be {low} to {high}"))
            }
        };
        (!holds).then_some(reason)
    }
}

/// Where a number of a sensor lies.
pub(super) enum Slot<'a> {
    Count(&'a mut u32),
    Number(&'a mut f64),
    Triple(&'a mut [f64; 3]),
    Timing(&'a mut Timing),
}

impl<'a> From<&'a mut u32> for Slot<'a> {
    fn from(x: &'a mut u32) -> Self {
        Self::Count(x)
    }
}
impl<'a> From<&'a mut f64> for Slot<'a> {
    fn from(x: &'a mut f64) -> Self {
        Self::Number(x)
    }
}
impl<'a> From<&'a mut [f64; 3]> for Slot<'a> {
    fn from(x: &'a mut [f64; 3]) -> Self {
        Self::Triple(x)
    }
}

/// A key of a sensor's table.
pub(super) struct Field<'a> {
    pub(super) key: &'static str,
    pub(super) slot: Slot<'a>,
    pub(super) limit: Limit,
}

impl Field<'_> {
    /// * `sensor` - name of the table, for the error
    pub(super) fn check(&self, sensor: &str) -> Result<(), SettingError> {
        let numbers: &[f64] = match &self.slot {
            Slot::Count(n) => &[f64::from(**n)],
            Slot::Number(x) => std::slice::from_ref(&**x),
            Slot::Triple(list) => &list[..],
            Slot::Timing(timing) => return timing.check(sensor),
        };
        for x in numbers {
            if let Some(reason) = self.limit.broken(*x) {
                return Err(SettingError::value(
                    format!("sensors.{sensor}.{}", self.key),
                    x,
                    reason,
                ));
            }
        }
        Ok(())
    }
}

/// The numbers of one sensor as a table.
pub(super) trait Table {
    /// All keys, for the error about one that is none of them.
    fn keys(&self) -> &'static [&'static str];

    /// Keys with where their numbers lie, and between which limits.
    fn fields(&mut self) -> Vec<Field<'_>>;

    /// Names of devices of which the numbers may be.
    fn devices(&self) -> &'static [&'static str] {
        &[]
    }

    /// Takes the numbers of a device of [`Self::devices`]. What belongs to the airframe stays.
    fn fit(&mut self, _device: &str) {}

    /// Takes over what a vehicle file says.
    fn apply(&mut self, said: &Said) {
        // Noise per sample is a matter of the rate, so a device wants to know it.
        if let Some(timing) = said.values.iter().find(|(key, _)| *key == "timing") {
            self.set(std::slice::from_ref(timing));
        }
        if let Some(device) = said.device {
            self.fit(device);
        }
        self.set(&said.values);
    }

    /// Sets numbers by their keys.
    fn set(&mut self, values: &[(&'static str, Value)]) {
        let mut fields = self.fields();
        for (key, value) in values {
            match (fields.iter_mut().find(|f| f.key == *key).map(|f| &mut f.slot), value) {
                (Some(Slot::Count(slot)), Value::Count(n)) => **slot = *n,
                (Some(Slot::Number(slot)), Value::Number(x)) => **slot = *x,
                (Some(Slot::Triple(slot)), Value::Triple(list)) => **slot = *list,
                (Some(Slot::Timing(slot)), Value::Timing(timing)) => **slot = *timing,
                // Values are read as what their slot takes.
                _ => {}
            }
        }
    }
}

/// What a table says.
#[derive(Debug, Default)]
pub(super) struct Said {
    device: Option<&'static str>,
    values: Vec<(&'static str, Value)>,
}

#[derive(Debug)]
pub(super) enum Value {
    Count(u32),
    Number(f64),
    Triple([f64; 3]),
    Timing(Timing),
}

/// Reads a table that looks like this sensor's.
pub(super) struct Reader<'a> {
    pub(super) fields: Vec<Field<'a>>,
    pub(super) keys: &'static [&'static str],
    pub(super) devices: &'static [&'static str],
}

impl<'a> Reader<'a> {
    pub(super) fn of(like: &'a mut dyn Table) -> Self {
        let (keys, devices) = (like.keys(), like.devices());
        Self { fields: like.fields(), keys, devices }
    }
}

impl<'de> DeserializeSeed<'de> for Reader<'_> {
    type Value = Said;
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Said, D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Reader<'_> {
    type Value = Said;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table of a sensor")
    }
    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Said, A::Error> {
        let mut said = Said::default();
        while let Some(key) = map.next_key_seed(OneOf { names: self.keys, what: None })? {
            if key == DEVICE {
                said.device =
                    Some(map.next_value_seed(OneOf { names: self.devices, what: Some(DEVICE) })?);
                continue;
            }
            // Every key but the device has a field.
            let Some(field) = self.fields.iter().find(|f| f.key == key) else { continue };
            let value = match field.slot {
                Slot::Count(_) => Value::Count(map.next_value::<Plain<u32>>()?.0),
                Slot::Number(_) => Value::Number(map.next_value::<Plain<f64>>()?.0),
                Slot::Triple(_) => Value::Triple(map.next_value::<Plain<[f64; 3]>>()?.0),
                Slot::Timing(_) => Value::Timing(map.next_value()?),
            };
            said.values.push((key, value));
        }
        Ok(said)
    }
}

/// A number, plain or with its source.
struct Plain<V>(V);

impl<'de, V: Deserialize<'de>> Deserialize<'de> for Plain<V> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        plain(deserializer).map(Self)
    }
}

/// One of these names: a key of a table, or what something is called.
pub(super) struct OneOf {
    pub(super) names: &'static [&'static str],
    /// What they are names of; `None` for keys.
    pub(super) what: Option<&'static str>,
}

impl<'de> DeserializeSeed<'de> for OneOf {
    type Value = &'static str;
    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<&'static str, D::Error> {
        deserializer.deserialize_str(self)
    }
}

impl Visitor<'_> for OneOf {
    type Value = &'static str;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the name of a {}", self.what.unwrap_or("key"))
    }
    fn visit_str<E: Error>(self, given: &str) -> Result<&'static str, E> {
        let found = self.names.iter().find(|name| **name == given);
        found.copied().ok_or_else(|| match self.what {
            None => E::unknown_field(given, self.names),
            Some(what) => E::custom(format_args!(
                "{what} \"{given}\": no such {what}; known are {}",
                self.names.join(", ")
            )),
        })
    }
}
