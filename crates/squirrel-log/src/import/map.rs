//! The import map: a TOML file that says what the columns of a foreign log mean.
//!
//! All that can be checked without data is checked here, once: channel names, widths, frames,
//! permutations, the mask.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path};

use serde::Deserialize;

use super::error::ImportError;
use super::frames::{AttitudeFrame, Body, Direction, Order, World};
use super::mask::Condition;
use super::names::{Kind, kind, nearest_canonical};
use crate::files;

/// A checked import map.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportMap {
    /// Name for error messages.
    pub(super) name: String,
    /// The TOML text.
    pub(super) text: String,
    /// Conditions that must all hold for a row to be kept.
    pub(super) keep: Vec<Condition>,
    /// Whether channels of one source of the log may have times of their own.
    pub(super) union: bool,
    pub(super) sources: Vec<SourceMap>,
}

/// One file of the foreign log, or one topic of a file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SourceMap {
    pub(super) file: Option<String>,
    pub(super) topic: Option<String>,
    /// Which of several publishers of a topic, from 0.
    pub(super) instance: Option<u8>,
    pub(super) time: TimeMap,
    pub(super) channels: Vec<ChannelMap>,
}

/// One channel of the log and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ChannelMap {
    /// Canonical name.
    pub(super) name: String,
    pub(super) columns: Vec<String>,
    /// One a column.
    pub(super) scale: Vec<f64>,
    /// One a column.
    pub(super) offset: Vec<f64>,
    pub(super) conversion: Conversion,
    pub(super) forward_filled: bool,
    /// A file without these columns, or without a number in them, is imported without the channel.
    pub(super) optional: bool,
    pub(super) turn: Option<Turn>,
}

/// A vector that an attitude of the log takes from the world into the body, or back.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Turn {
    /// Canonical name of the attitude.
    pub(super) by: String,
    /// Whether the vector comes in the world frame and becomes one of the body.
    pub(super) into_body: bool,
    /// Taken off an acceleration that becomes a specific force, added to one that becomes an
    /// acceleration; 0 for other vectors, m/s2.
    pub(super) gravity_m_s2: f64,
}

/// How the scaled columns become the numbers of the channel.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Conversion {
    None,
    Ned(World),
    Frd(Body),
    Attitude(AttitudeFrame),
    /// Column `i` is number `rotors[i]` of the channel, from 0.
    Rotors(Vec<usize>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MapToml {
    keep: Option<String>,
    times: Option<Times>,
    source: Vec<SourceToml>,
}

/// What becomes of channels of one source of the log that have different times.
#[derive(Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Times {
    /// They are refused.
    Same,
    /// Each gets the times of all, and NaN where it has no sample.
    Union,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SourceToml {
    file: Option<String>,
    topic: Option<String>,
    instance: Option<u8>,
    time: TimeMap,
    channels: BTreeMap<String, ChannelToml>,
}

/// The time column of a file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TimeMap {
    pub(super) column: String,
    pub(super) unit: TimeUnit,
    /// Added to the time in seconds.
    #[serde(default)]
    pub(super) offset_s: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum TimeUnit {
    S,
    Ms,
    Us,
    Ns,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ChannelToml {
    columns: Vec<String>,
    scale: Option<PerColumn>,
    offset: Option<PerColumn>,
    world: Option<World>,
    body: Option<Body>,
    order: Option<Order>,
    direction: Option<Direction>,
    rotors: Option<Vec<usize>>,
    repeats: Option<Repeats>,
    turned_by: Option<String>,
    gravity_m_s2: Option<f64>,
    #[serde(default)]
    optional: bool,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a number or a list with one number a column")]
enum PerColumn {
    All(f64),
    Each(Vec<f64>),
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Repeats {
    ForwardFilled,
}

impl ImportMap {
    /// Reads and checks a map file, or takes a built-in map by its name where no such file is.
    ///
    /// # Errors
    /// [`ImportError::Read`] if the file cannot be read, else as [`ImportMap::parse`].
    pub fn load(path: &Path) -> Result<Self, ImportError> {
        let name = path.display().to_string();
        if let Some((_, text)) =
            squirrel_vehicles::MAPS.iter().find(|(own, _)| *own == name && !path.exists())
        {
            return Self::parse(text, &name);
        }
        let text = files::read_text(path)
            .map_err(|source| ImportError::Read { file: name.clone(), source })?;
        Self::parse(&text, &name)
    }

    /// Checks the text of a map; `name` is how error messages call it.
    ///
    /// # Errors
    /// [`ImportError::MapSyntax`] with the line for what TOML itself can tell (unknown keys, units
    /// and frames), [`ImportError::MapField`] for the rest.
    pub fn parse(text: &str, name: &str) -> Result<Self, ImportError> {
        let toml: MapToml =
            toml::from_str(text).map_err(|error| syntax_error(text, name, &error))?;
        let field_error =
            |field: String, problem| ImportError::MapField { map: name.to_owned(), field, problem };
        let keep = toml.keep.as_deref().map(Condition::parse).transpose();
        let keep = keep.map_err(|problem| field_error("keep".to_owned(), problem))?;
        if toml.source.is_empty() {
            return Err(field_error(
                "source".to_owned(),
                "no [[source]]: nothing to import".to_owned(),
            ));
        }
        let mut seen = BTreeSet::new();
        let mut sources = Vec::new();
        for (index, mut source) in toml.source.into_iter().enumerate() {
            let number = index + 1;
            check_source(&source).map_err(|(field, problem)| {
                field_error(format!("source {number}, {field}"), problem)
            })?;
            let mut channels = Vec::new();
            for (channel, toml) in std::mem::take(&mut source.channels) {
                let field = format!("source {number}, `{channel}`");
                if !seen.insert(channel.clone()) {
                    return Err(field_error(field, "is in another source already".to_owned()));
                }
                channels.push(
                    channel_map(channel, toml).map_err(|problem| field_error(field, problem))?,
                );
            }
            let SourceToml { file, topic, instance, time, .. } = source;
            sources.push(SourceMap { file, topic, instance, time, channels });
        }
        let keep = keep.map_or_else(Vec::new, Condition::into_terms);
        let attitude = |name: &str| kind(name) == Some(Kind::Attitude) && seen.contains(name);
        let turned = sources.iter().enumerate().flat_map(|(index, source)| {
            source
                .channels
                .iter()
                .filter_map(move |channel| Some((index + 1, channel, channel.turn.as_ref()?)))
        });
        for (number, channel, turn) in turned {
            if !attitude(&turn.by) {
                let field = format!("source {number}, `{}`", channel.name);
                let problem = format!("turned_by: `{}` is no attitude of this map", turn.by);
                return Err(field_error(field, problem));
            }
        }
        let union = toml.times == Some(Times::Union);
        Ok(Self { name: name.to_owned(), text: text.to_owned(), keep, union, sources })
    }
}

impl TimeMap {
    /// Seconds of a number in the time column.
    pub(super) fn seconds(&self, time: f64) -> f64 {
        // Division by a power of ten rounds once; multiplication by its inverse would round twice.
        let seconds = match self.unit {
            TimeUnit::S => time,
            TimeUnit::Ms => time / 1e3,
            TimeUnit::Us => time / 1e6,
            TimeUnit::Ns => time / 1e9,
        };
        seconds + self.offset_s
    }
}

fn syntax_error(text: &str, name: &str, error: &toml::de::Error) -> ImportError {
    let place = crate::toml_text::place(text, error);
    ImportError::MapSyntax {
        map: name.to_owned(),
        line: place.line,
        message: place.message,
        text: place.text,
    }
}

/// Checks a source but not its channels; an error is the field and what is wrong with it.
fn check_source(source: &SourceToml) -> Result<(), (&'static str, String)> {
    if let Some(file) = &source.file {
        let inside = |part| matches!(part, Component::Normal(_) | Component::CurDir);
        if file.is_empty() || !Path::new(file).components().all(inside) {
            return Err(("file", format!("`{file}` is not a file inside the flight folder")));
        }
    }
    if !source.time.offset_s.is_finite() {
        return Err(("time.offset_s", format!("must be finite, got {}", source.time.offset_s)));
    }
    if source.channels.is_empty() {
        return Err(("channels", "no channel: nothing to import".to_owned()));
    }
    Ok(())
}

fn channel_map(name: String, toml: ChannelToml) -> Result<ChannelMap, String> {
    let kind = match kind(&name) {
        Some(kind) => kind,
        None if name == "time_s" => {
            return Err("time is not a channel: write `time = { column, unit }`".into());
        }
        None => return Err(format!("no such channel; nearest: {}", nearest_canonical(&name))),
    };
    let count = toml.columns.len();
    let width = match kind {
        Kind::VectorNed | Kind::VectorBody => Some(3),
        Kind::Attitude => Some(4),
        Kind::Numbers(width) => Some(width),
        Kind::PerRotor | Kind::Free => None,
    };
    if count == 0 || width.is_some_and(|width| width != count) {
        let wanted = width.map_or("at least 1".to_owned(), |width| width.to_string());
        return Err(format!("columns: wants {wanted}, got {count}"));
    }
    // Both wings may follow one signal; axes and rotors are each something else.
    if !matches!(kind, Kind::Numbers(_) | Kind::Free)
        && let Some(twice) =
            (1..count).find_map(|i| toml.columns[..i].iter().find(|c| **c == toml.columns[i]))
    {
        return Err(format!("columns: `{twice}` is there more than once"));
    }
    let turn = turn(&toml, kind)?;
    let scale = per_column("scale", toml.scale, 1.0, count)?;
    if scale.contains(&0.0) {
        return Err("scale: must not be 0".to_owned());
    }
    let offset = per_column("offset", toml.offset, 0.0, count)?;

    // A vector that is turned comes in the other frame.
    let kind = match (&turn, kind) {
        (Some(_), Kind::VectorNed) => Kind::VectorBody,
        (Some(_), Kind::VectorBody) => Kind::VectorNed,
        _ => kind,
    };
    let mut given = BTreeMap::from([
        ("world", toml.world.is_some()),
        ("body", toml.body.is_some()),
        ("order", toml.order.is_some()),
        ("direction", toml.direction.is_some()),
        ("rotors", toml.rotors.is_some()),
    ]);
    let (keys, conversion) = match kind {
        Kind::VectorNed => (&["world"][..], toml.world.map(Conversion::Ned)),
        Kind::VectorBody => (&["body"][..], toml.body.map(Conversion::Frd)),
        Kind::Attitude => {
            let frame = toml.order.zip(toml.direction).zip(toml.world.zip(toml.body)).map(
                |((order, direction), (world, body))| {
                    Conversion::Attitude(AttitudeFrame { order, direction, world, body })
                },
            );
            (&["order", "direction", "world", "body"][..], frame)
        }
        Kind::PerRotor => {
            given.remove("rotors");
            let rotors = toml.rotors.unwrap_or_else(|| (1..=count).collect());
            (&[][..], Some(Conversion::Rotors(permutation(&rotors, count)?)))
        }
        Kind::Numbers(_) | Kind::Free => (&[][..], Some(Conversion::None)),
    };
    let missing: Vec<&str> = keys.iter().copied().filter(|key| !given[key]).collect();
    let (Some(conversion), true) = (conversion, missing.is_empty()) else {
        let hints: Vec<String> =
            missing.iter().map(|key| format!("`{key}` ({})", choices(key))).collect();
        return Err(format!("add {}", hints.join(", ")));
    };
    if let Some((key, _)) = given.iter().find(|(key, is_given)| **is_given && !keys.contains(key)) {
        return Err(format!("`{key}` means nothing for this channel: leave it out"));
    }
    let forward_filled = toml.repeats.is_some_and(|Repeats::ForwardFilled| true);
    let (columns, optional) = (toml.columns, toml.optional);
    Ok(ChannelMap { name, columns, scale, offset, conversion, forward_filled, optional, turn })
}

fn turn(toml: &ChannelToml, kind: Kind) -> Result<Option<Turn>, String> {
    let gravity_m_s2 = toml.gravity_m_s2.unwrap_or(0.0);
    if !gravity_m_s2.is_finite() {
        return Err(format!("gravity_m_s2: must be finite, got {gravity_m_s2}"));
    }
    let into_body = kind == Kind::VectorBody;
    match &toml.turned_by {
        Some(by) if into_body || kind == Kind::VectorNed => {
            Ok(Some(Turn { by: by.clone(), into_body, gravity_m_s2 }))
        }
        Some(_) => Err("`turned_by` means nothing for this channel: leave it out".to_owned()),
        None if toml.gravity_m_s2.is_some() => {
            Err("`gravity_m_s2` means nothing without `turned_by`: leave it out".to_owned())
        }
        None => Ok(None),
    }
}

fn choices(key: &str) -> &'static str {
    match key {
        "world" => "ned, enu or nwu",
        "body" => "frd or flu",
        "order" => "wxyz or xyzw",
        _ => "world_from_body or body_from_world",
    }
}

fn per_column(
    key: &str,
    given: Option<PerColumn>,
    default: f64,
    count: usize,
) -> Result<Vec<f64>, String> {
    let numbers = match given {
        None => vec![default; count],
        Some(PerColumn::All(x)) => vec![x; count],
        Some(PerColumn::Each(numbers)) => numbers,
    };
    if numbers.len() != count {
        return Err(format!("{key}: {} numbers for {count} columns", numbers.len()));
    }
    match numbers.iter().find(|x| !x.is_finite()) {
        Some(x) => Err(format!("{key}: must be finite, got {x}")),
        None => Ok(numbers),
    }
}

/// Rotor numbers from 1 to indices from 0.
fn permutation(rotors: &[usize], count: usize) -> Result<Vec<usize>, String> {
    let mut sorted = rotors.to_vec();
    sorted.sort_unstable();
    if sorted.iter().copied().ne(1..=count) {
        return Err(format!("rotors: wants each of 1 to {count} once, got {rotors:?}"));
    }
    Ok(rotors.iter().map(|rotor| rotor - 1).collect())
}
