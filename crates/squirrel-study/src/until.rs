//! When a study has flown enough: as soon as its 95 % intervals are narrow.
//!
//! A study that stops so is one of that many trials, byte for byte: nothing of it says how it came
//! to them. Whoever looks again and again stops a little early by chance, so that intervals cover
//! somewhat less than they say; the rounds are few for that reason.

use serde_json::Value;
use squirrel_sim::flight::FlightError;
use std::str::FromStr;

/// Trials of the first round.
const FIRST: u32 = 16;

/// How far an interval may reach to either side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Until {
    /// As a share of the figure, or of 1 where the figure is smaller: a share, gain or ratio is
    /// known to so many points.
    share: f64,
}

impl FromStr for Until {
    type Err = String;

    /// `5%`.
    fn from_str(text: &str) -> Result<Self, String> {
        let number = text.strip_suffix('%').and_then(|percent| percent.parse::<f64>().ok());
        match number {
            Some(percent) if percent > 0.0 && percent <= 100.0 => {
                Ok(Self { share: percent / 100.0 })
            }
            _ => Err("must be a share above 0% and up to 100%, as 5%".to_owned()),
        }
    }
}

impl Until {
    /// Trials after which a study looks whether it is done: each time twice as many, the most
    /// last.
    pub fn rounds(most: u32) -> impl Iterator<Item = u32> {
        let next = |n: &u32| n.checked_mul(2);
        std::iter::successors(Some(FIRST), next)
            .take_while(move |n| *n < most)
            .chain(std::iter::once(most))
    }

    /// Whether the widest interval is narrow enough, and how far it reaches, as a share.
    ///
    /// * `json` - what the study found, [`crate::study::Found::json`]
    ///
    /// # Errors
    /// A study without intervals.
    pub fn is_met(self, json: &str) -> Result<(bool, f64), FlightError> {
        let found: Value = serde_json::from_str(json).map_err(|e| FlightError(e.to_string()))?;
        let widest = widest(&found).ok_or_else(|| {
            FlightError("until: this study has no intervals; say --trials alone".to_owned())
        })?;
        Ok((widest <= self.share, widest))
    }
}

/// The farthest reach of an interval; infinite where it has no ends yet.
fn widest(found: &Value) -> Option<f64> {
    let larger = |all: &mut dyn Iterator<Item = f64>| all.reduce(f64::max);
    match found {
        Value::Array(all) => larger(&mut all.iter().filter_map(widest)),
        Value::Object(fields) => {
            if let (Some(value), Some(low), Some(high)) =
                (fields.get("value"), fields.get("low"), fields.get("high"))
            {
                let reach = [value, low, high].map(Value::as_f64);
                let [Some(value), Some(low), Some(high)] = reach else {
                    return Some(f64::INFINITY);
                };
                return Some((high - value).max(value - low) / value.abs().max(1.0));
            }
            larger(&mut fields.values().filter_map(widest))
        }
        _ => None,
    }
}
