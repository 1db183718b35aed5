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
    /// Samples in the log.
    pub samples: usize,
    /// Median rate, Hz; `None` with fewer than two samples.
    pub rate_hz: Option<f64>,
    /// Samples in the log with at least one number missing (NaN).
    pub samples_missing: usize,
    /// Kept rows that only repeated the sample before.
    pub repeats_dropped: usize,
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
            write!(f, "{} from {columns}: {} samples", report.channel, report.samples)?;
            if let Some(rate_hz) = report.rate_hz {
                write!(f, " at {rate_hz:.1} Hz")?;
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
        Ok(())
    }
}
