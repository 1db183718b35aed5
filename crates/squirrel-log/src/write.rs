//! Writes a flight as an MCAP file: metadata first, then all samples in the order of time.

use std::collections::BTreeMap;
use std::io::{Result, Write};
use std::path::Path;

use super::container::Container;
use super::{
    FlightLog, LIBRARY, LogError, METADATA_CRC, METADATA_NAME, Source, check, foxglove, message,
    metadata_crc32, schema,
};
use crate::files::Growing;

/// A chunk is what a truncated file loses. It is closed by flight time, because only time bounds
/// the loss for every mix of sources: 1 s is some 300 kB of a simulated flight and 2 kB of a GNSS
/// receiver alone. Beyond 1 MiB, mcap's default, it is closed by bytes too.
const CHUNK_NS: u64 = 1_000_000_000;

/// Poses for the 3-D panel, at most 50 a second.
const TRANSFORM_INTERVAL_NS: u64 = 20_000_000;

/// Sources that begin in this time from the first sample on, s, have their topics at the begin of
/// the file in the order of their names; one that begins later has its own where it begins. So the
/// bytes of a flight are the same whether all of it is there or it is still flown.
pub(super) const HEAD_S: f64 = 60.0;

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
    pub fn write(&self, path: &Path) -> std::result::Result<(), LogError> {
        let file = path.display().to_string();
        check::check(&file, self)?;
        let mut encoder = Encoder::at(path, &file, &self.metadata)?;
        encoder
            .put(self, f64::INFINITY)
            .and_then(|()| encoder.finish())
            .map_err(|error| LogError::Io { file, error })
    }
}

/// A log on its way into a file.
pub(super) struct Encoder<W> {
    file: Container<W>,
    /// For the 3-D panel, until they are written.
    obstacles: Option<Vec<[f64; 3]>>,
    topics: Vec<Topic>,
    /// Their places, by source.
    places: BTreeMap<String, usize>,
    chunk_start_ns: u64,
}

/// A source's topic.
struct Topic {
    id: u16,
    pose: Option<Pose>,
}

impl Encoder<Growing> {
    /// Begins a file with the metadata.
    ///
    /// # Errors
    /// [`LogError`]: obstacles that are none, or what the disk says.
    pub(super) fn at(
        path: &Path,
        file: &str,
        metadata: &BTreeMap<String, String>,
    ) -> std::result::Result<Self, LogError> {
        let obstacles =
            metadata.get("obstacles_json").map(|json| serde_json::from_str(json)).transpose();
        let obstacles =
            obstacles.map_err(|error| LogError::Obstacles { file: file.to_owned(), error })?;
        let at = |error| LogError::Io { file: file.to_owned(), error };
        Growing::at(path).and_then(|to| Self::new(to, metadata, obstacles)).map_err(at)
    }

    /// Ends the file, which takes its name.
    pub(super) fn finish(self) -> Result<()> {
        self.file.finish()?.becomes_whole()
    }
}

impl<W: Write> Encoder<W> {
    fn new(
        to: W,
        metadata: &BTreeMap<String, String>,
        obstacles: Option<Vec<[f64; 3]>>,
    ) -> Result<Self> {
        let mut file = Container::new(to, LIBRARY)?;
        let mut metadata = metadata.clone();
        metadata.remove(METADATA_CRC);
        metadata.insert(METADATA_CRC.to_owned(), metadata_crc32(&metadata));
        file.metadata(METADATA_NAME, &metadata)?;
        let (topics, places) = (Vec::new(), BTreeMap::new());
        Ok(Self { file, obstacles, topics, places, chunk_start_ns: 0 })
    }

    /// Writes the samples before a time, in the order of time. Those of the head must be in the
    /// first log that is given ([`HEAD_S`]), and no log has samples that were given before.
    pub(super) fn put(&mut self, log: &FlightLog, before_s: f64) -> Result<()> {
        if self.topics.is_empty() {
            self.head(log)?;
        }
        let sources = log.sources.iter().filter(|(_, source)| !source.time_s.is_empty());
        let mut tracks: Vec<Track<'_>> = sources
            .map(|(name, source)| Track {
                name,
                source,
                topic: self.places.get(name).copied(),
                next: 0,
            })
            .collect();
        while let Some(track) = next(&mut tracks, before_s) {
            self.sample(track)?;
            track.next += 1;
        }
        Ok(())
    }

    /// The topics of what begins early, and the obstacles.
    fn head(&mut self, log: &FlightLog) -> Result<()> {
        let begins = |source: &Source| source.time_s.first().copied();
        let Some(start_s) = log.sources.values().filter_map(begins).min_by(f64::total_cmp) else {
            return Ok(());
        };
        for (name, source) in &log.sources {
            if begins(source).is_some_and(|begin_s| begin_s < start_s + HEAD_S) {
                self.topic(name, source)?;
            }
        }
        let start_ns = time_ns(start_s);
        self.chunk_start_ns = start_ns;
        if let Some(obstacles) = self.obstacles.take() {
            let set = foxglove::scene_schema();
            let id = self.file.topic(foxglove::SCENE_TOPIC, foxglove::SCENE_SCHEMA, &set)?;
            let scene = foxglove::scene(start_ns, &obstacles);
            self.file.message(id, start_ns, |to| to.extend(scene))?;
        }
        Ok(())
    }

    /// Begins a source's topic; returns its place.
    fn topic(&mut self, name: &str, source: &Source) -> Result<usize> {
        let set = schema::encode(name, source);
        let id = self.file.topic(name, &schema::message_name(name), &set)?;
        let pose = Pose::of(name, source, &mut self.file)?;
        let place = self.topics.len();
        self.topics.push(Topic { id, pose });
        self.places.insert(name.to_owned(), place);
        Ok(place)
    }

    /// Writes the next sample of a track.
    fn sample(&mut self, track: &mut Track<'_>) -> Result<()> {
        let (source, index) = (track.source, track.next);
        let now_ns = time_ns(source.time_s[index]);
        if now_ns.saturating_sub(self.chunk_start_ns) >= CHUNK_NS {
            self.file.end_chunk()?;
            self.chunk_start_ns = now_ns;
        }
        let place = match track.topic {
            Some(place) => place,
            None => *track.topic.insert(self.topic(track.name, source)?),
        };
        let topic = &mut self.topics[place];
        self.file.message(topic.id, now_ns, |to| message::encode(source, index, to))?;
        if let Some(pose) = &mut topic.pose {
            pose.put(&mut self.file, source, index, now_ns)?;
        }
        Ok(())
    }
}

/// A source on its way into the file.
struct Track<'a> {
    name: &'a str,
    source: &'a Source,
    /// Place of its topic, once it has begun.
    topic: Option<usize>,
    next: usize,
}

/// The track with the earliest sample left before a time; of equal times the first by source name.
fn next<'a, 'b>(tracks: &'b mut [Track<'a>], before_s: f64) -> Option<&'b mut Track<'a>> {
    let is_left = |track: &&mut Track<'_>| {
        track.source.time_s.get(track.next).is_some_and(|time_s| *time_s < before_s)
    };
    let left = tracks.iter_mut().filter(is_left);
    left.min_by(|a, b| a.source.time_s[a.next].total_cmp(&b.source.time_s[b.next]))
}

/// The topic of the vehicle's pose, beside the source `truth`.
struct Pose {
    id: u16,
    /// Interval of the message before.
    interval: Option<u64>,
}

impl Pose {
    const POSITION: &str = "position_ned_m";
    const ATTITUDE: &str = "q_ned_from_body_wxyz";

    /// `None` unless the source is `truth` and knows place and attitude.
    fn of(name: &str, source: &Source, file: &mut Container<impl Write>) -> Result<Option<Self>> {
        let has =
            |name, width| source.channels.get(name).is_some_and(|channel| channel.width == width);
        if name != "truth" || !has(Self::POSITION, 3) || !has(Self::ATTITUDE, 4) {
            return Ok(None);
        }
        let set = foxglove::transform_schema();
        let id = file.topic(foxglove::TRANSFORM_TOPIC, foxglove::TRANSFORM_SCHEMA, &set)?;
        Ok(Some(Self { id, interval: None }))
    }

    fn put(
        &mut self,
        file: &mut Container<impl Write>,
        source: &Source,
        index: usize,
        now_ns: u64,
    ) -> Result<()> {
        let interval = now_ns / TRANSFORM_INTERVAL_NS;
        if self.interval == Some(interval) {
            return Ok(());
        }
        let row = |name| source.channels[name].row(index);
        let message = foxglove::frame_transform(now_ns, row(Self::POSITION), row(Self::ATTITUDE));
        if let Some(message) = message {
            file.message(self.id, now_ns, |to| to.extend(message))?;
            self.interval = Some(interval);
        }
        Ok(())
    }
}

fn time_ns(time_s: f64) -> u64 {
    (time_s * 1e9).round() as u64
}
