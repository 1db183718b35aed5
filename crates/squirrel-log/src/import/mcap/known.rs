//! A map of a ROS 2 bag by the types of its topics.
//!
//! Each quantity comes from the topic whose type says it
//! best; two topics of that type are two answers, and the user chooses.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use super::{LOG_TIME, Log, Logs, Topic};
use crate::import::error::ImportError;
use crate::import::format;
use crate::import::map::ImportMap;
use crate::import::meter::Meter;

/// How far the clocks of two topics' stamps may be from each other, s; the rest is another clock.
const CLOCKS_APART_MAX_S: f64 = 1.0;
/// What a stamp and MCAP's own time are in.
const NS_PER_S: f64 = 1e9;

/// PX4's own time of a message, us.
const PX4_STAMP: &str = "timestamp";

/// What a topic can be used for; the smaller the number, the better it says so.
const OFFERS: [(&str, &[(Role, u8)]); 16] = [
    ("px4_msgs/VehicleAngularVelocity", &[(Role::Omega, 0)]),
    ("px4_msgs/VehicleAcceleration", &[(Role::Force, 0)]),
    ("px4_msgs/SensorCombined", &[(Role::Omega, 1), (Role::Force, 1)]),
    ("px4_msgs/VehicleAttitude", &[(Role::Attitude, 0)]),
    ("px4_msgs/VehicleLocalPosition", &[(Role::Position, 0), (Role::Velocity, 0)]),
    ("px4_msgs/VehicleOdometry", &[(Role::Attitude, 1), (Role::Position, 1), (Role::Velocity, 1)]),
    ("px4_msgs/ActuatorMotors", &[(Role::Command, 0)]),
    ("px4_msgs/BatteryStatus", &[(Role::Battery, 0)]),
    ("sensor_msgs/Imu", &[(Role::Omega, 0), (Role::Force, 0), (Role::Attitude, 2)]),
    ("nav_msgs/Odometry", &[(Role::Attitude, 0), (Role::Position, 0), (Role::Velocity, 0)]),
    ("geometry_msgs/PoseStamped", &[(Role::Attitude, 1), (Role::Position, 1)]),
    ("geometry_msgs/TwistStamped", &[(Role::Velocity, 1)]),
    ("sensor_msgs/BatteryState", &[(Role::Battery, 0)]),
    ("mavros_msgs/ESCTelemetry", &[(Role::Speed, 0)]),
    ("mavros_msgs/RCOut", &[(Role::Command, 1)]),
    ("mavros_msgs/ActuatorControl", &[(Role::Control, 0)]),
];

/// The quantities that a bag may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Role {
    Omega,
    Force,
    Attitude,
    Position,
    Velocity,
    Battery,
    Command,
    Speed,
    /// What a flight controller asks of its mixer; no rotor's command.
    Control,
}

impl Role {
    pub(super) fn name(self) -> &'static str {
        match self {
            Role::Omega => "imu.omega_body_rad_s",
            Role::Force => "imu.specific_force_body_m_s2",
            Role::Attitude => "attitude.q_ned_from_body_wxyz",
            Role::Position => "gnss.position_ned_m",
            Role::Velocity => "gnss.velocity_ned_m_s",
            Role::Battery => "battery.voltage_v",
            Role::Command => "rotor.command",
            Role::Speed => "rotor.speed_rad_s",
            Role::Control => "control.actuator_controls",
        }
    }
}

/// `package/Name` of `package/msg/Name`.
pub(super) fn short(schema: &str) -> String {
    schema.replacen("/msg/", "/", 1)
}

fn offers(schema: &str) -> &'static [(Role, u8)] {
    let schema = short(schema);
    OFFERS.iter().find(|(name, _)| *name == schema).map_or(&[], |(_, roles)| roles)
}

/// The map of a bag, and what was chosen, a line each.
///
/// * `chosen` - topics that are taken where several of a type would do
/// * `logs` - gets the bag, so that an import by the map need not read it again
///
/// # Errors
/// The file cannot be read, no topic has a known type, several say the same, a message contradicts
/// its schema.
pub(in crate::import) fn map_of_bag(
    path: &Path,
    chosen: &[String],
    logs: &mut Logs,
) -> Result<(ImportMap, Vec<String>), ImportError> {
    let (path, inside) = bag_in(path)?;
    format::check_known(&path)?;
    if !format::starts_with(&path, mcap::MAGIC)? {
        return Err(ImportError::Damaged {
            file: path.display().to_string(),
            problem: "no ROS 2 bag (MCAP): say by --map what its columns are".to_owned(),
        });
    }
    let log = Rc::new(Log::read(&path, &|_, schema| !offers(schema).is_empty())?);
    logs.keep(&path, &log);
    let damaged = |problem| ImportError::Damaged { file: log.file.clone(), problem };
    if let Some(topic) = chosen.iter().find(|topic| !log.topics.contains_key(*topic)) {
        return Err(damaged(format!("--topic {topic}: no topic of a known type has this name")));
    }
    let picked = pick(&log, chosen).map_err(damaged)?;
    if picked.is_empty() {
        let known: Vec<&str> = OFFERS.iter().map(|(name, _)| *name).collect();
        return Err(damaged(format!(
            "no ROS 2 topic of a known type ({}): say what the topics are with --map",
            known.join(", ")
        )));
    }
    let meter = Meter::new(0, &|_, _| {});
    let mut bag = Bag { log: &log, inside, has_attitude: false, notes: Vec::new(), meter: &meter };
    let clock = bag.clock(&picked)?;
    let mut text = String::from("# Of the types of the bag's topics.\ntimes = \"union\"\n");
    // The attitude first: what it turns needs it.
    let mut ordered: Vec<_> = picked.iter().collect();
    ordered.sort_by_key(|(_, roles)| !roles.contains(&Role::Attitude));
    for (topic, roles) in ordered {
        bag.source(&mut text, topic, roles, clock)?;
    }
    if !text.contains("[[source]]") {
        return Err(damaged(format!("no topic has numbers to use: {}", bag.notes.join("; "))));
    }
    Ok((ImportMap::parse(&text, &format!("the map of {}", log.file))?, bag.notes))
}

/// The file of a bag, and its name if the folder of it was given, as rosbag2 records one.
fn bag_in(path: &Path) -> Result<(PathBuf, Option<String>), ImportError> {
    if !path.is_dir() {
        return Ok((path.to_owned(), None));
    }
    let folder = path.display().to_string();
    let read = |source| ImportError::Read { file: folder.clone(), source };
    let mut names = Vec::new();
    for entry in fs::read_dir(path).map_err(read)? {
        let name = entry.map_err(read)?.file_name().to_string_lossy().into_owned();
        if Path::new(&name).extension().is_some_and(|extension| extension == "mcap") {
            names.push(name);
        }
    }
    names.sort_unstable();
    match names.as_slice() {
        [name] => Ok((path.join(name), Some(name.clone()))),
        [] => Err(ImportError::Damaged {
            file: folder,
            problem: "no .mcap file in this folder".to_owned(),
        }),
        names => Err(ImportError::Damaged {
            file: folder,
            problem: format!(
                "{} .mcap files: import one, or join them by `mcap merge`",
                names.len()
            ),
        }),
    }
}

/// Which topic says what.
fn pick(log: &Log, chosen: &[String]) -> Result<BTreeMap<String, Vec<Role>>, String> {
    let mut by_role: BTreeMap<Role, Vec<(u8, &str)>> = BTreeMap::new();
    for (name, topic) in &log.topics {
        for (role, rank) in offers(&topic.schema) {
            // A chosen topic goes before all others.
            let rank = if chosen.contains(name) { 0 } else { rank + 1 };
            by_role.entry(*role).or_default().push((rank, name));
        }
    }
    let mut picked: BTreeMap<String, Vec<Role>> = BTreeMap::new();
    for (role, mut topics) in by_role {
        topics.sort_unstable();
        let best: Vec<&str> =
            topics.iter().filter(|(rank, _)| *rank == topics[0].0).map(|(_, name)| *name).collect();
        let [one] = best[..] else {
            return Err(format!(
                "`{}` is in the topics {}: choose by --topic NAME, or with --map",
                role.name(),
                best.join(", ")
            ));
        };
        picked.entry(one.to_owned()).or_default().push(role);
    }
    Ok(picked)
}

#[derive(Clone, Copy, PartialEq)]
enum Clock {
    Stamp,
    Log,
}

pub(super) struct Bag<'a> {
    pub(super) log: &'a Log,
    /// Name of the file in the folder that was given.
    inside: Option<String>,
    /// Whether there is one to turn vectors by.
    pub(super) has_attitude: bool,
    pub(super) notes: Vec<String>,
    pub(super) meter: &'a Meter<'a>,
}

impl Bag<'_> {
    pub(super) fn columns(
        &self,
        topic: &str,
        names: &[&str],
    ) -> Result<Vec<Vec<f64>>, ImportError> {
        let table = self.log.table(topic, self.meter)?.read(names)?;
        Ok(names.iter().map(|name| table.column(name).to_vec()).collect())
    }

    /// One clock for all topics: that of their stamps, if all have it.
    fn clock(&mut self, picked: &BTreeMap<String, Vec<Role>>) -> Result<Clock, ImportError> {
        let mut ahead_s: Vec<(f64, &str)> = Vec::new();
        for topic in picked.keys() {
            let own = &self.log.topics[topic];
            let (column, per_s) = stamp(own);
            let stamps = self.columns(topic, &[column])?.swap_remove(0);
            let problem = if !(stamps[0] > 0.0) {
                "has no stamps"
            } else if stamps.windows(2).any(|pair| !(pair[1] > pair[0])) {
                "has stamps that do not increase"
            } else {
                let first = own.log_time_ns[0] as f64 / NS_PER_S;
                ahead_s.push((stamps[0] / per_s - first, topic));
                continue;
            };
            self.notes
                .push(format!("time: MCAP's log_time of all topics, since `{topic}` {problem}"));
            return Ok(Clock::Log);
        }
        ahead_s.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let (Some((first, early)), Some((last, late))) = (ahead_s.first(), ahead_s.last()) else {
            return Ok(Clock::Log);
        };
        if last - first > CLOCKS_APART_MAX_S {
            self.notes.push(format!(
                "time: MCAP's log_time of all topics, since the stamps of `{early}` and `{late}` are of clocks {:.3} s apart",
                last - first
            ));
            return Ok(Clock::Log);
        }
        self.notes
            .push("time: the stamps in the messages (header.stamp, PX4's timestamp)".to_owned());
        Ok(Clock::Stamp)
    }

    /// Appends the `[[source]]` of a topic; none if it has nothing to use.
    fn source(
        &mut self,
        text: &mut String,
        topic: &str,
        roles: &[Role],
        clock: Clock,
    ) -> Result<(), ImportError> {
        let mut channels = Vec::new();
        for role in roles {
            self.channels(topic, *role, &mut channels)?;
        }
        let own = &self.log.topics[topic];
        let (column, _) = stamp(own);
        let (column, unit) = match clock {
            Clock::Log => (LOG_TIME, "ns"),
            Clock::Stamp => (column, if column == PX4_STAMP { "us" } else { "ns" }),
        };
        if !channels.is_empty() {
            // A topic's name is text of the file: quoted as TOML wants it.
            let name = toml::Value::String(topic.to_owned());
            let file = self.inside.clone().map(toml::Value::String);
            let file = file.map_or(String::new(), |file| format!("file = {file}\n"));
            // Writing to a string cannot fail.
            let _ = write!(
                text,
                "\n[[source]]\n{file}topic = {name}\ntime = {{ column = \"{column}\", unit = \"{unit}\" }}\n[source.channels]\n{}\n",
                channels.join("\n")
            );
        }
        Ok(())
    }
}

/// The column of a topic's own time, and what a second is in it.
fn stamp(topic: &Topic) -> (&'static str, f64) {
    if topic.schema.starts_with("px4_msgs/") {
        (PX4_STAMP, 1e6)
    } else {
        ("header.stamp", NS_PER_S)
    }
}
