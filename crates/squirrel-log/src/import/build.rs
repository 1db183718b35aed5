//! From the columns of a table to the channels of the log.

use std::collections::BTreeMap;

use super::error::ImportError;
use super::frames::AttitudeFrame;
use super::map::{ChannelMap, Conversion, ImportMap, SourceMap};
use super::report::{AbsentChannel, ChannelReport, ImportReport, Pace};
use super::table::Table;
use crate::{Channel, FlightLog, Source};

/// How far the norm of a quaternion may be from 1 before it is no rotation.
const QUATERNION_NORM_TOLERANCE: f64 = 0.05;

/// Adds the channels of one `[[source]]`; `rows` are the kept ones, `time_s` is the time of all
/// rows in the log.
///
/// # Errors
/// Time axes that differ within one source of the log, a quaternion that is no rotation, a channel
/// without numbers.
pub(super) fn add_source(
    log: &mut FlightLog,
    report: &mut ImportReport,
    map: &ImportMap,
    source: &SourceMap,
    table: &Table,
    time_s: &[f64],
    rows: &[usize],
) -> Result<(), ImportError> {
    let mut groups: BTreeMap<&str, Vec<(&str, &ChannelMap)>> = BTreeMap::new();
    for channel in &source.channels {
        // A canonical name always has a dot.
        let (group, name) = channel.name.rsplit_once('.').unwrap_or(("", &channel.name));
        groups.entry(group).or_default().push((name, channel));
    }
    for (group, channels) in groups {
        let axes_error = |channel: &ChannelMap, problem, remedy| ImportError::TimeAxes {
            map: map.name.clone(),
            channel: channel.name.clone(),
            log_source: group.to_owned(),
            problem,
            remedy,
        };
        let forward_filled = channels[0].1.forward_filled;
        if let Some((_, other)) = channels.iter().find(|(_, c)| c.forward_filled != forward_filled)
        {
            return Err(axes_error(
                other,
                "some are forward_filled and some are not",
                "give `repeats` to all of them or to none",
            ));
        }
        let changed = forward_filled.then(|| changes(&channels, table, rows));
        let repeats_dropped = changed.as_ref().map_or(0, |changed| rows.len() - changed.len());
        let rows = changed.as_deref().unwrap_or(rows);
        if let (true, Some((_, channel))) = (rows.is_empty(), channels.first()) {
            if channels.iter().all(|(_, channel)| channel.optional) {
                report.absent.extend(channels.iter().map(|(_, channel)| absent(channel)));
                continue;
            }
            return Err(all_missing(channel, table));
        }
        let axis: Vec<f64> = rows.iter().map(|&row| time_s[row]).collect();
        let Pace { rate_hz, mean_rate_hz, gaps } = Pace::of(&axis);
        let target = log
            .sources
            .entry(group.to_owned())
            .or_insert_with(|| Source { time_s: axis.clone(), channels: BTreeMap::new() });
        if target.time_s != axis && !map.union {
            return Err(axes_error(
                channels[0].1,
                "they are read from another file or by another time column",
                "import one of them under a name of another source",
            ));
        }
        for (name, map) in channels {
            let Some(channel) = channel(map, table, rows)? else {
                report.absent.push(absent(map));
                continue;
            };
            let samples_missing =
                (0..rows.len()).filter(|&i| channel.row(i).iter().any(|x| x.is_nan())).count();
            report.channels.push(ChannelReport {
                channel: map.name.clone(),
                columns: map.columns.clone(),
                origin: None,
                samples: rows.len(),
                rate_hz,
                mean_rate_hz,
                gaps,
                samples_missing,
                repeats_dropped,
            });
            if target.time_s == axis {
                target.channels.insert(name.to_owned(), channel);
            } else {
                add_at_other_times(target, name, &channel, &axis);
            }
        }
        log.sources.retain(|_, source| !source.channels.is_empty());
    }
    Ok(())
}

/// Adds a channel with times of its own: all channels get all times, and NaN where they have no
/// sample, so that no number is made up.
fn add_at_other_times(source: &mut Source, name: &str, channel: &Channel, time_s: &[f64]) {
    let mut union = [&source.time_s, time_s].concat();
    union.sort_unstable_by(f64::total_cmp);
    union.dedup();
    let before = std::mem::replace(&mut source.time_s, union);
    let source_time_s = &source.time_s;
    let spread = |channel: &Channel, time_s: &[f64]| {
        let mut values = vec![f64::NAN; source_time_s.len() * channel.width];
        let mut at = 0;
        for (t, row) in time_s.iter().zip(channel.values.chunks_exact(channel.width)) {
            while source_time_s[at] < *t {
                at += 1;
            }
            values[at * channel.width..][..channel.width].copy_from_slice(row);
        }
        Channel { width: channel.width, values }
    };
    for channel in source.channels.values_mut() {
        *channel = spread(channel, &before);
    }
    let channel = spread(channel, time_s);
    source.channels.insert(name.to_owned(), channel);
}

fn absent(channel: &ChannelMap) -> AbsentChannel {
    AbsentChannel { channel: channel.name.clone(), column: channel.columns[0].clone() }
}

/// Rows at which any column of the channels has another number than before. An empty cell is not a
/// change.
fn changes(channels: &[(&str, &ChannelMap)], table: &Table, rows: &[usize]) -> Vec<usize> {
    let columns: Vec<&[f64]> = channels
        .iter()
        .flat_map(|(_, channel)| &channel.columns)
        .map(|name| table.column(name))
        .collect();
    let mut last = vec![f64::NAN; columns.len()];
    let mut changed = Vec::new();
    for &row in rows {
        let mut differs = false;
        for (last, column) in last.iter_mut().zip(&columns) {
            if !column[row].is_nan() && column[row] != *last {
                *last = column[row];
                differs = true;
            }
        }
        if differs {
            changed.push(row);
        }
    }
    changed
}

/// `None` is an optional channel without a number.
fn channel(
    map: &ChannelMap,
    table: &Table,
    rows: &[usize],
) -> Result<Option<Channel>, ImportError> {
    let width = map.columns.len();
    let columns: Vec<&[f64]> = map.columns.iter().map(|name| table.column(name)).collect();
    let mut values = Vec::with_capacity(rows.len() * width);
    let mut attitude = Continuous { last: None };
    let mut sample = vec![0.0; width];
    for &row in rows {
        for (i, number) in sample.iter_mut().enumerate() {
            *number = columns[i][row] * map.scale[i] + map.offset[i];
            if number.is_infinite() {
                return Err(ImportError::Cell {
                    file: table.name.clone(),
                    column: map.columns[i].clone(),
                    row: table.rows[row],
                    value: columns[i][row].to_string(),
                    problem: "is infinite after scale and offset",
                });
            }
        }
        match (&map.conversion, sample.as_slice()) {
            (Conversion::Ned(world), &[x, y, z]) => values.extend(world.to_ned([x, y, z])),
            (Conversion::Frd(body), &[x, y, z]) => values.extend(body.to_frd([x, y, z])),
            (Conversion::Attitude(frame), &[a, b, c, d]) => {
                let q = attitude.next(*frame, [a, b, c, d]).map_err(|norm| {
                    ImportError::QuaternionNorm {
                        file: table.name.clone(),
                        columns: map.columns.join(", "),
                        row: table.rows[row],
                        norm,
                    }
                })?;
                values.extend(q);
            }
            (Conversion::Rotors(rotors), sample) => {
                let start = values.len();
                values.resize(start + width, f64::NAN);
                for (&rotor, &number) in rotors.iter().zip(sample) {
                    values[start + rotor] = number;
                }
            }
            // The map has checked the widths.
            (_, sample) => values.extend_from_slice(sample),
        }
    }
    match values.iter().all(|x| x.is_nan()) {
        true if map.optional => Ok(None),
        true => Err(all_missing(map, table)),
        false => Ok(Some(Channel { width, values })),
    }
}

fn all_missing(map: &ChannelMap, table: &Table) -> ImportError {
    ImportError::AllMissing {
        file: table.name.clone(),
        columns: map.columns.join(", "),
        channel: map.name.clone(),
    }
}

/// Normalises attitudes and picks of `q` and `-q` the one nearer to the last; the first has
/// `w >= 0`.
struct Continuous {
    last: Option<[f64; 4]>,
}

impl Continuous {
    /// `q_ned_from_body` as w x y z, NaN if any number is missing; an error is the norm.
    fn next(&mut self, frame: AttitudeFrame, file: [f64; 4]) -> Result<[f64; 4], f64> {
        if file.iter().any(|x| x.is_nan()) {
            return Ok([f64::NAN; 4]);
        }
        let q = frame.q_ned_from_body(file);
        let norm = q.norm();
        if (norm - 1.0).abs() > QUATERNION_NORM_TOLERANCE {
            return Err(norm);
        }
        let q = [q.w / norm, q.i / norm, q.j / norm, q.k / norm];
        let last = self.last.unwrap_or([1.0, 0.0, 0.0, 0.0]);
        let along: f64 = q.iter().zip(last).map(|(a, b)| a * b).sum();
        let q = if along < 0.0 { q.map(|x| -x) } else { q };
        self.last = Some(q);
        Ok(q)
    }
}
