//! Writes a flight as an MCAP file: metadata first, then all samples in the order of time.

use std::io::Cursor;
use std::path::Path;

use mcap::records::{MessageHeader, Metadata};
use mcap::{McapError, WriteOptions};

use super::{
    FlightLog, LIBRARY, LogError, METADATA_CRC, METADATA_NAME, Source, check, foxglove, message,
    metadata_crc32, schema,
};
use crate::files::write_whole;

/// A chunk is what a truncated file loses. It is closed by flight time, because only time bounds
/// the loss for every mix of sources: 1 s is some 300 kB of a simulated flight and 2 kB of a GNSS
/// receiver alone. Beyond 1 MiB, mcap's default, it is closed by bytes too.
const CHUNK_NS: u64 = 1_000_000_000;

/// Poses for the 3-D panel, at most 50 a second.
const TRANSFORM_INTERVAL_NS: u64 = 20_000_000;

type Writer = mcap::Writer<Cursor<Vec<u8>>>;

impl FlightLog {
    /// Writes the log as an MCAP file; equal logs give equal bytes.
    ///
    /// One topic a source, protobuf with the schema inside the file, and [`FlightLog::metadata`] as
    /// the metadata record `squirrel`. A source without samples is left out. If the log has
    /// `truth.position_ned_m` and `truth.q_ned_from_body_wxyz`, the vehicle also moves in
    /// Foxglove's 3-D panel; metadata `obstacles_json` (`[[north_m, east_m, radius_m], ...]`) puts
    /// cylinders there.
    ///
    /// The file appears under its name only when it is whole.
    ///
    /// # Errors
    /// [`LogError`] that names the source, index and value if a time is not finite, negative or not
    /// after the one before it, if the number of values does not fit, if a name cannot be a field,
    /// or if the disk refuses.
    pub fn write(&self, path: &Path) -> Result<(), LogError> {
        let file = path.display().to_string();
        check::check(&file, self)?;
        let bytes = self.to_mcap(&file)?;
        write_whole(path, &bytes).map_err(|error| LogError::Io { file, error })
    }

    fn to_mcap(&self, file: &str) -> Result<Vec<u8>, LogError> {
        let obstacles =
            self.metadata.get("obstacles_json").map(|json| serde_json::from_str(json)).transpose();
        let obstacles: Option<Vec<[f64; 3]>> =
            obstacles.map_err(|error| LogError::Obstacles { file: file.to_owned(), error })?;
        self.encode(obstacles.as_deref())
            .map_err(|error| LogError::Mcap { file: file.to_owned(), error })
    }

    fn encode(&self, obstacles: Option<&[[f64; 3]]>) -> Result<Vec<u8>, McapError> {
        // The library string and one compression thread keep the bytes the same on every machine.
        let options = WriteOptions::new().library(LIBRARY).compression_threads(0);
        let mut writer = options.create(Cursor::new(Vec::new()))?;
        let mut metadata = self.metadata.clone();
        metadata.remove(METADATA_CRC);
        metadata.insert(METADATA_CRC.to_owned(), metadata_crc32(&metadata));
        writer.write_metadata(&Metadata { name: METADATA_NAME.to_owned(), metadata })?;
        let mut tracks = Vec::new();
        for (name, source) in self.sources.iter().filter(|(_, source)| !source.time_s.is_empty()) {
            let set = schema::encode(name, source);
            let id = add_topic(&mut writer, name, &schema::message_name(name), &set)?;
            tracks.push(Track { source, next: 0, id, pose: Pose::of(name, source, &mut writer)? });
        }
        let start_ns = tracks.iter().map(|track| time_ns(track.source.time_s[0])).min();
        if let (Some(start_ns), Some(obstacles)) = (start_ns, obstacles) {
            let set = foxglove::scene_schema();
            let id = add_topic(&mut writer, foxglove::SCENE_TOPIC, foxglove::SCENE_SCHEMA, &set)?;
            put(&mut writer, id, 0, start_ns, &foxglove::scene(start_ns, obstacles))?;
        }
        let mut chunk_start_ns = start_ns.unwrap_or(0);
        while let Some(track) = next(&mut tracks) {
            let index = track.next;
            let now_ns = time_ns(track.source.time_s[index]);
            if now_ns - chunk_start_ns >= CHUNK_NS {
                writer.flush()?;
                chunk_start_ns = now_ns;
            }
            put(&mut writer, track.id, index, now_ns, &message::encode(track.source, index))?;
            if let Some(pose) = &mut track.pose {
                pose.put(&mut writer, track.source, index, now_ns)?;
            }
            track.next += 1;
        }
        writer.finish()?;
        Ok(writer.into_inner().into_inner())
    }
}

/// A source on its way into the file.
struct Track<'a> {
    source: &'a Source,
    next: usize,
    id: u16,
    pose: Option<Pose>,
}

/// The track with the earliest sample left; of equal times the first by source name.
fn next<'a, 'b>(tracks: &'b mut [Track<'a>]) -> Option<&'b mut Track<'a>> {
    let left = tracks.iter_mut().filter(|track| track.next < track.source.time_s.len());
    left.min_by(|a, b| a.source.time_s[a.next].total_cmp(&b.source.time_s[b.next]))
}

/// The topic of the vehicle's pose, beside the source `truth`.
struct Pose {
    id: u16,
    messages: usize,
    /// Interval of the message before.
    interval: Option<u64>,
}

impl Pose {
    const POSITION: &str = "position_ned_m";
    const ATTITUDE: &str = "q_ned_from_body_wxyz";

    /// `None` unless the source is `truth` and knows place and attitude.
    fn of(name: &str, source: &Source, writer: &mut Writer) -> Result<Option<Self>, McapError> {
        let has =
            |name, width| source.channels.get(name).is_some_and(|channel| channel.width == width);
        if name != "truth" || !has(Self::POSITION, 3) || !has(Self::ATTITUDE, 4) {
            return Ok(None);
        }
        let set = foxglove::transform_schema();
        let id = add_topic(writer, foxglove::TRANSFORM_TOPIC, foxglove::TRANSFORM_SCHEMA, &set)?;
        Ok(Some(Self { id, messages: 0, interval: None }))
    }

    fn put(
        &mut self,
        writer: &mut Writer,
        source: &Source,
        index: usize,
        now_ns: u64,
    ) -> Result<(), McapError> {
        let interval = now_ns / TRANSFORM_INTERVAL_NS;
        if self.interval == Some(interval) {
            return Ok(());
        }
        let row = |name| source.channels[name].row(index);
        let message = foxglove::frame_transform(now_ns, row(Self::POSITION), row(Self::ATTITUDE));
        if let Some(message) = message {
            put(writer, self.id, self.messages, now_ns, &message)?;
            self.messages += 1;
            self.interval = Some(interval);
        }
        Ok(())
    }
}

fn add_topic(
    writer: &mut Writer,
    topic: &str,
    schema_name: &str,
    set: &[u8],
) -> Result<u16, McapError> {
    let schema = writer.add_schema(schema_name, "protobuf", set)?;
    writer.add_channel(schema, topic, "protobuf", &std::collections::BTreeMap::new())
}

fn put(
    writer: &mut Writer,
    channel_id: u16,
    index: usize,
    time_ns: u64,
    message: &[u8],
) -> Result<(), McapError> {
    let header = MessageHeader {
        channel_id,
        sequence: index as u32,
        log_time: time_ns,
        publish_time: time_ns,
    };
    writer.write_to_known_channel(&header, message)
}

fn time_ns(time_s: f64) -> u64 {
    (time_s * 1e9).round() as u64
}
