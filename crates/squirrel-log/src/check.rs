//! The rules that every flight log keeps, checked before writing and after reading.

use super::{FlightLog, LogError, Source, schema};

/// Times are stored in whole nanoseconds beside their exact value; later ones do not fit 64 bits.
pub(crate) const TIME_MAX_S: f64 = 1.8e10;

/// Longest time between two samples of a flight, s.
const JUMP_S: f64 = 3600.0;

/// What to say of a sample, in words behind its time, where the clock has jumped since the one
/// before it.
pub fn clock_jump(before_s: f64, time_s: f64) -> Option<String> {
    let since_s = time_s - before_s;
    (since_s > JUMP_S)
        .then(|| format!("is {since_s:.1} s after the sample before it, at most {JUMP_S}"))
}

/// # Errors
/// [`LogError`] with the first name, time or length that breaks a rule.
pub(super) fn check(file: &str, log: &FlightLog) -> Result<(), LogError> {
    check_piece(file, log, |_| None)
}

/// As [`check`], of a piece of a log.
///
/// * `before` - of a source by its name, how many samples are before the piece, and the time of the
///   last of them, s
pub(super) fn check_piece(
    file: &str,
    log: &FlightLog,
    before: impl Fn(&str) -> Option<(usize, f64)>,
) -> Result<(), LogError> {
    for (name, source) in &log.sources {
        check_names(file, name, source)?;
        check_times(file, name, source, before(name))?;
        check_lengths(file, name, source)?;
    }
    Ok(())
}

fn check_names(file: &str, source_name: &str, source: &Source) -> Result<(), LogError> {
    let refuse =
        |name: String, kind, why| Err(LogError::Name { file: file.to_owned(), name, kind, why });
    if !source_name.split('.').all(is_identifier) {
        return refuse(
            source_name.to_owned(),
            "source",
            "need letters, digits and `_`, parts joined by `.`",
        );
    }
    for name in source.channels.keys() {
        if !is_identifier(name) {
            return refuse(
                format!("{source_name}.{name}"),
                "channel",
                "need letters, digits and `_`",
            );
        }
        if [schema::TIME.0, schema::CRC.0].contains(&name.as_str()) {
            return refuse(
                format!("{source_name}.{name}"),
                "channel",
                "the file has a field of that name",
            );
        }
    }
    if source.channels.len() > schema::CHANNELS_MAX {
        return Err(LogError::TooManyChannels {
            file: file.to_owned(),
            source_name: source_name.to_owned(),
            channels: source.channels.len(),
            most: schema::CHANNELS_MAX,
        });
    }
    Ok(())
}

fn is_identifier(name: &str) -> bool {
    name.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_')
        && name.chars().all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
}

fn check_times(
    file: &str,
    source_name: &str,
    source: &Source,
    before: Option<(usize, f64)>,
) -> Result<(), LogError> {
    let (first, mut last_s) = before.map_or((0, None), |(samples, last_s)| (samples, Some(last_s)));
    for (index, &time_s) in (first..).zip(&source.time_s) {
        let before_s = last_s.replace(time_s);
        let why = if !time_s.is_finite() {
            "not finite".to_owned()
        } else if time_s < 0.0 {
            "before 0 s".to_owned()
        } else if time_s > TIME_MAX_S {
            format!("after {TIME_MAX_S:e} s, the last that a file holds")
        } else if let Some(before_s) = before_s.filter(|&before_s| time_s <= before_s) {
            format!("not after the sample before it ({before_s})")
        } else {
            continue;
        };
        return Err(LogError::Time {
            file: file.to_owned(),
            source_name: source_name.to_owned(),
            index,
            time_s,
            why,
        });
    }
    Ok(())
}

fn check_lengths(file: &str, source_name: &str, source: &Source) -> Result<(), LogError> {
    let samples = source.time_s.len();
    for (name, channel) in &source.channels {
        let (width, values) = (channel.width, channel.values.len());
        if width == 0 || samples.checked_mul(width) != Some(values) {
            let channel = format!("{source_name}.{name}");
            return Err(LogError::Length {
                file: file.to_owned(),
                channel,
                values,
                samples,
                width,
            });
        }
    }
    Ok(())
}
