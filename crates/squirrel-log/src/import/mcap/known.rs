//! A map of a ROS 2 bag by the types of its topics.
//!
//! ROS is east north up and forward left up (REP-103), PX4's own messages are north east down and
//! forward right down. A battery's current is negative while it discharges (sensor_msgs), a twist
//! in an odometry is in the body's frame. Each quantity comes from the topic whose type says it
//! best; two topics of that type are two answers, and the user chooses.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use super::{LOG_TIME, Log, Topic};
use crate::import::error::ImportError;
use crate::import::map::ImportMap;
use crate::import::meter::Meter;

/// How far the clocks of two topics' stamps may be from each other, s; the rest is another clock.
const CLOCKS_APART_MAX_S: f64 = 1.0;
/// What a stamp and MCAP's own time are in.
const NS_PER_S: f64 = 1e9;
/// Most rotors that a message has.
const ROTORS_MAX: usize = 16;

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
enum Role {
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
    fn name(self) -> &'static str {
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
fn short(schema: &str) -> String {
    schema.replacen("/msg/", "/", 1)
}

fn offers(schema: &str) -> &'static [(Role, u8)] {
    let schema = short(schema);
    OFFERS.iter().find(|(name, _)| *name == schema).map_or(&[], |(_, roles)| roles)
}

/// The map of a bag, and what was chosen, a line each.
///
/// * `chosen` - topics that are taken where several of a type would do
///
/// # Errors
/// The file cannot be read, no topic has a known type, several say the same, a message contradicts
/// its schema.
pub(in crate::import) fn map_of_bag(
    path: &Path,
    chosen: &[String],
) -> Result<(ImportMap, Vec<String>), ImportError> {
    let (path, inside) = bag_in(path)?;
    let log = Log::read(&path, &|_, schema| !offers(schema).is_empty())?;
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
        if name.ends_with(".mcap") {
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

struct Bag<'a> {
    log: &'a Log,
    /// Name of the file in the folder that was given.
    inside: Option<String>,
    /// Whether there is one to turn vectors by.
    has_attitude: bool,
    notes: Vec<String>,
    meter: &'a Meter<'a>,
}

impl Bag<'_> {
    fn columns(&self, topic: &str, names: &[&str]) -> Result<Vec<Vec<f64>>, ImportError> {
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
        let (column, per_s) = stamp(own);
        let (column, unit) = match clock {
            Clock::Log => (LOG_TIME, "ns"),
            Clock::Stamp if per_s == NS_PER_S => (column, "ns"),
            Clock::Stamp => (column, "us"),
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

    /// Appends the channels of a topic for one quantity.
    fn channels(
        &mut self,
        topic: &str,
        role: Role,
        channels: &mut Vec<String>,
    ) -> Result<(), ImportError> {
        let own = &self.log.topics[topic];
        let schema = short(&own.schema);
        let px4 = schema.starts_with("px4_msgs/");
        let (world, body) = if px4 { ("ned", "frd") } else { ("enu", "flu") };
        let name = role.name();
        let vector = |columns: [&str; 3], frame: &str| {
            format!("\"{name}\" = {{ columns = {columns:?}, {frame} }}")
        };
        let in_world = |columns| vector(columns, &format!("world = \"{world}\""));
        let in_body = |columns| vector(columns, &format!("body = \"{body}\""));
        let by = Role::Attitude.name();
        let turned = |columns| vector(columns, &format!("body = \"{body}\", turned_by = \"{by}\""));
        let unturned = format!(
            "{name}: left out, `{topic}` is in the body's frame and no topic has an attitude"
        );
        let quaternion = |columns: [&str; 4], order: &str| {
            format!(
                "\"{name}\" = {{ columns = {columns:?}, order = \"{order}\", direction = \"world_from_body\", world = \"{world}\", body = \"{body}\" }}"
            )
        };
        match (schema.as_str(), role) {
            ("px4_msgs/VehicleAngularVelocity" | "px4_msgs/VehicleAcceleration", _) => {
                channels.push(in_body(["xyz[0]", "xyz[1]", "xyz[2]"]));
            }
            ("px4_msgs/SensorCombined", Role::Omega) => {
                channels.push(in_body(["gyro_rad[0]", "gyro_rad[1]", "gyro_rad[2]"]));
            }
            ("px4_msgs/SensorCombined", _) => channels.push(in_body([
                "accelerometer_m_s2[0]",
                "accelerometer_m_s2[1]",
                "accelerometer_m_s2[2]",
            ])),
            ("px4_msgs/VehicleAttitude" | "px4_msgs/VehicleOdometry", Role::Attitude) => {
                channels.push(quaternion(["q[0]", "q[1]", "q[2]", "q[3]"], "wxyz"));
            }
            ("px4_msgs/VehicleLocalPosition", Role::Position) => {
                channels.push(in_world(["x", "y", "z"]))
            }
            ("px4_msgs/VehicleLocalPosition", _) => channels.push(in_world(["vx", "vy", "vz"])),
            ("px4_msgs/VehicleOdometry", role) => {
                // 1 is NED, 3 the body.
                let (key, columns) = match role {
                    Role::Position => ("pose_frame", ["position[0]", "position[1]", "position[2]"]),
                    _ => ("velocity_frame", ["velocity[0]", "velocity[1]", "velocity[2]"]),
                };
                let frame = self.columns(topic, &[key])?[0][0];
                match frame {
                    1.0 => channels.push(in_world(columns)),
                    3.0 if self.has_attitude => channels.push(turned(columns)),
                    3.0 => self.notes.push(unturned),
                    frame => self
                        .notes
                        .push(format!("{name}: left out, `{topic}` has {key} {frame}, not NED")),
                }
            }
            ("sensor_msgs/Imu", Role::Omega) => {
                let columns = ["angular_velocity.x", "angular_velocity.y", "angular_velocity.z"];
                channels.push(in_body(columns));
            }
            ("sensor_msgs/Imu", Role::Force) => channels.push(in_body([
                "linear_acceleration.x",
                "linear_acceleration.y",
                "linear_acceleration.z",
            ])),
            ("sensor_msgs/Imu", _) => {
                let q = ["orientation.x", "orientation.y", "orientation.z", "orientation.w"];
                let numbers =
                    self.columns(topic, &[q[0], q[1], q[2], q[3], "orientation_covariance[0]"])?;
                // REP-145: a device that does not estimate orientation says so by -1.
                if numbers[4][0] == -1.0 || numbers[..4].iter().flatten().all(|x| *x == 0.0) {
                    self.notes.push(format!("{name}: left out, `{topic}` has no orientation"));
                } else {
                    channels.push(quaternion(q, "xyzw"));
                }
            }
            (
                "nav_msgs/Odometry" | "geometry_msgs/PoseStamped",
                Role::Attitude | Role::Position,
            ) => {
                let pose = if schema == "nav_msgs/Odometry" { "pose.pose" } else { "pose" };
                let part = |part: &str| format!("{pose}.{part}");
                if role == Role::Attitude {
                    let q = ["x", "y", "z", "w"].map(|axis| part(&format!("orientation.{axis}")));
                    channels.push(quaternion([&q[0], &q[1], &q[2], &q[3]], "xyzw"));
                } else {
                    let p = ["x", "y", "z"].map(|axis| part(&format!("position.{axis}")));
                    channels.push(in_world([&p[0], &p[1], &p[2]]));
                }
            }
            ("nav_msgs/Odometry", _) if !self.has_attitude => self.notes.push(unturned),
            ("nav_msgs/Odometry", _) => {
                channels.push(turned([
                    "twist.twist.linear.x",
                    "twist.twist.linear.y",
                    "twist.twist.linear.z",
                ]));
            }
            ("geometry_msgs/TwistStamped", _) => {
                let columns = ["twist.linear.x", "twist.linear.y", "twist.linear.z"];
                let frame = own.frame_id();
                let of_body =
                    ["base", "body", "fcu", "imu"].iter().any(|word| frame.contains(word));
                self.notes.push(format!(
                    "{name}: `{topic}` is in the frame `{frame}`, taken as {}",
                    if of_body { "the body's" } else { "the world's" }
                ));
                match of_body {
                    false => channels.push(in_world(columns)),
                    true if self.has_attitude => channels.push(turned(columns)),
                    true => self.notes.push(unturned),
                }
            }
            ("px4_msgs/BatteryStatus", _) => {
                channels.push(format!("\"{name}\" = {{ columns = [\"voltage_v\"] }}"));
                // -1 is a current that nobody measures.
                if self.columns(topic, &["current_a"])?[0][0] != -1.0 {
                    channels
                        .push("\"battery.current_a\" = { columns = [\"current_a\"] }".to_owned());
                }
            }
            ("sensor_msgs/BatteryState", _) => {
                channels.push(format!("\"{name}\" = {{ columns = [\"voltage\"] }}"));
                channels.push("\"battery.current_a\" = { columns = [\"current\"], scale = -1.0, optional = true }".to_owned());
            }
            ("px4_msgs/ActuatorMotors" | "mavros_msgs/RCOut" | "mavros_msgs/ESCTelemetry", _) => {
                self.rotors(topic, &schema, name, channels)?;
            }
            ("mavros_msgs/ActuatorControl", _) => {
                let columns: Vec<String> = (0..8).map(|i| format!("controls[{i}]")).collect();
                channels.push(format!("\"{name}\" = {{ columns = {columns:?} }}"));
            }
            _ => {}
        }
        self.has_attitude |= role == Role::Attitude && !channels.is_empty();
        Ok(())
    }

    /// One column a rotor: those that the vehicle has are the first that are used.
    fn rotors(
        &mut self,
        topic: &str,
        schema: &str,
        name: &str,
        channels: &mut Vec<String>,
    ) -> Result<(), ImportError> {
        let (path, after, scale) = match schema {
            "px4_msgs/ActuatorMotors" => ("control", "", ""),
            "mavros_msgs/RCOut" => ("channels", "", ""),
            // Revolutions a minute.
            _ => ("esc_telemetry", ".rpm", ", scale = 0.10471975511965977"),
        };
        let file = self.log.table(topic, self.meter)?;
        let mut columns: Vec<String> = (0..ROTORS_MAX)
            .map(|i| format!("{path}[{i}]{after}"))
            .take_while(|column| file.columns().contains(column))
            .collect();
        let names: Vec<&str> = columns.iter().map(String::as_str).collect();
        let table = if names.is_empty() { None } else { Some(file.read(&names)?) };
        let used = |column: &&String| {
            let numbers = table.as_ref().map_or(&[][..], |table| table.column(column));
            let mut known = numbers.iter().filter(|x| !x.is_nan());
            // A channel that never moves is no rotor of a flight; PX4's others are NaN.
            known
                .next()
                .is_some_and(|first| schema != "mavros_msgs/RCOut" || known.any(|x| x != first))
        };
        columns.truncate(columns.iter().take_while(used).count());
        if columns.is_empty() {
            self.notes.push(format!("{name}: left out, `{topic}` has no rotor that moves"));
        } else {
            let (count, unit) =
                (columns.len(), if schema == "mavros_msgs/RCOut" { ", in us" } else { "" });
            self.notes.push(format!("{name}: the first {count} of `{topic}`{unit}"));
            channels.push(format!("\"{name}\" = {{ columns = {columns:?}{scale} }}"));
        }
        Ok(())
    }
}

/// The column of a topic's own time, and what a second is in it.
fn stamp(topic: &Topic) -> (&'static str, f64) {
    if topic.schema.starts_with("px4_msgs/") {
        ("timestamp", 1e6)
    } else {
        ("header.stamp", NS_PER_S)
    }
}
