//! What an import did: rows read and dropped, samples a channel got.

use std::fmt;

/// Summary of an import, in the order of the map.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub struct ImportReport {
    /// One entry a `[[source]]`.
    pub files: Vec<FileReport>,
    /// One entry a channel.
    pub channels: Vec<ChannelReport>,
    /// Optional channels that the files lack.
    pub absent: Vec<AbsentChannel>,
    /// What else there is to know, a line each: what was chosen, what is left out, what the log is
    /// too slow for.
    pub notes: Vec<String>,
}

/// An optional channel of the map that the log does not have.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct AbsentChannel {
    /// Canonical name.
    pub channel: String,
    /// The first of its columns that the file lacks.
    pub column: String,
}

/// Rows of one file, or of one topic of a file.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct FileReport {
    /// File name without folders.
    pub file: String,
    /// Topic, where the file has topics.
    pub topic: Option<String>,
    /// Which publisher of the topic, from 0, where the map says.
    pub instance: Option<u8>,
    /// Rows in the file, header not counted; messages of the topic.
    pub rows: usize,
    /// Rows that `keep` dropped.
    pub rows_masked: usize,
    /// Bytes left out at the end of a file that ends inside a record.
    pub bytes_cut: u64,
}

/// Samples of one channel.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ChannelReport {
    /// Canonical name.
    pub channel: String,
    /// Columns that it is made of, in the order of the map.
    pub columns: Vec<String>,
    /// Unit and frame of these columns, where the kind of log says them.
    pub origin: Option<String>,
    /// Samples in the log.
    pub samples: usize,
    /// Median rate, Hz; `None` with fewer than two samples.
    pub rate_hz: Option<f64>,
    /// Samples over the time from the first to the last, Hz; `None` with fewer than two samples.
    pub mean_rate_hz: Option<f64>,
    /// Where samples are missing.
    pub gaps: Gaps,
    /// Samples in the log with at least one number missing (NaN).
    pub samples_missing: usize,
    /// Kept rows that only repeated the sample before.
    pub repeats_dropped: usize,
}

/// Steps of a time axis that are longer than [`Gaps::STEPS`] median steps.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Gaps {
    /// How many.
    pub count: usize,
    /// The longest of them, s.
    pub longest_s: f64,
}

impl Gaps {
    /// Median steps that are no gap yet: two samples in a row may be lost.
    pub const STEPS: f64 = 3.5;

    fn of(steps: impl Iterator<Item = f64>, median: f64) -> Self {
        let gaps = steps.filter(|&step| step > Self::STEPS * median);
        gaps.fold(Self::default(), |gaps, step| Self {
            count: gaps.count + 1,
            longest_s: gaps.longest_s.max(step),
        })
    }
}

/// How regularly samples follow each other; see the fields of [`ChannelReport`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Pace {
    pub(super) rate_hz: Option<f64>,
    pub(super) mean_rate_hz: Option<f64>,
    pub(super) gaps: Gaps,
}

impl Pace {
    pub(super) fn of(time_s: &[f64]) -> Self {
        let steps = || time_s.windows(2).map(|pair| pair[1] - pair[0]);
        let mut all: Vec<f64> = steps().collect();
        let middle = all.len() / 2;
        let median =
            (!all.is_empty()).then(|| *all.select_nth_unstable_by(middle, f64::total_cmp).1);
        let mean_rate_hz = match time_s {
            [first, .., last] if last > first => Some((time_s.len() - 1) as f64 / (last - first)),
            _ => None,
        };
        Self {
            rate_hz: median.map(|step| 1.0 / step),
            mean_rate_hz,
            gaps: Gaps::of(steps(), median.unwrap_or(f64::INFINITY)),
        }
    }
}

impl fmt::Display for ImportReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for FileReport { file, topic, instance, rows, rows_masked, bytes_cut } in &self.files {
            write!(f, "{file}")?;
            if let Some(topic) = topic {
                write!(f, ", {topic}")?;
            }
            if let Some(instance) = instance {
                write!(f, " instance {instance}")?;
            }
            write!(f, ": {rows} rows, {rows_masked} dropped by `keep`")?;
            if *bytes_cut > 0 {
                write!(
                    f,
                    "; the file ends inside a record, its last {bytes_cut} bytes are left out"
                )?;
            }
            writeln!(f)?;
        }
        for report in &self.channels {
            let columns = report.columns.join(", ");
            write!(f, "{} from {columns}", report.channel)?;
            if let Some(origin) = &report.origin {
                write!(f, " ({origin})")?;
            }
            write!(f, ": {} samples", report.samples)?;
            if let Some(rate_hz) = report.rate_hz {
                write!(f, " at {rate_hz:.1} Hz")?;
            }
            match report.gaps {
                Gaps { count: 0, .. } => {}
                Gaps { count: 1, longest_s } => write!(f, ", a gap of {longest_s:.3} s")?,
                Gaps { count, longest_s } => {
                    write!(f, ", {count} gaps, the longest {longest_s:.3} s")?;
                }
            }
            if report.samples_missing > 0 {
                write!(f, ", {} with missing numbers", report.samples_missing)?;
            }
            if report.repeats_dropped > 0 {
                write!(f, ", {} repeats dropped", report.repeats_dropped)?;
            }
            writeln!(f)?;
        }
        for AbsentChannel { channel, column } in &self.absent {
            writeln!(f, "{channel}: left out, the file has no column `{column}`")?;
        }
        for note in &self.notes {
            writeln!(f, "{note}")?;
        }
        Ok(())
    }
}
