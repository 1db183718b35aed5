//! What the known types of ROS 2 messages have, as lines of a map.
//!
//! ROS is east north up and forward left up (REP-103), PX4's own messages are north east down and
//! forward right down. A battery's current is negative while it discharges (sensor_msgs), a twist
//! in an odometry is in the body's frame.

use super::known::{Bag, Role, short};
use crate::import::error::ImportError;

/// Most rotors that a message has.
const ROTORS_MAX: usize = 16;

/// Lines of a map for one quantity.
struct Lines {
    name: &'static str,
    world: &'static str,
    body: &'static str,
}

impl Lines {
    fn vector(&self, columns: [&str; 3], frame: &str) -> String {
        format!("\"{}\" = {{ columns = {columns:?}, {frame} }}", self.name)
    }

    fn in_world(&self, columns: [&str; 3]) -> String {
        self.vector(columns, &format!("world = \"{}\"", self.world))
    }

    fn in_body(&self, columns: [&str; 3]) -> String {
        self.vector(columns, &format!("body = \"{}\"", self.body))
    }

    /// A vector of the body that goes into the world.
    fn turned(&self, columns: [&str; 3]) -> String {
        let by = Role::Attitude.name();
        self.vector(columns, &format!("body = \"{}\", turned_by = \"{by}\"", self.body))
    }

    fn unturned(&self, topic: &str) -> String {
        let name = self.name;
        format!("{name}: left out, `{topic}` is in the body's frame and no topic has an attitude")
    }

    fn quaternion(&self, columns: [&str; 4], order: &str) -> String {
        let Self { name, world, body } = self;
        format!(
            "\"{name}\" = {{ columns = {columns:?}, order = \"{order}\", direction = \"world_from_body\", world = \"{world}\", body = \"{body}\" }}"
        )
    }
}

impl Bag<'_> {
    /// Appends the channels of a topic for one quantity.
    pub(super) fn channels(
        &mut self,
        topic: &str,
        role: Role,
        channels: &mut Vec<String>,
    ) -> Result<(), ImportError> {
        let own = &self.log.topics[topic];
        let schema = short(&own.schema);
        if schema.starts_with("px4_msgs/") {
            self.px4(topic, &schema, role, channels)?;
        } else {
            self.ros(topic, &schema, role, channels)?;
        }
        self.has_attitude |= role == Role::Attitude && !channels.is_empty();
        Ok(())
    }

    fn px4(
        &mut self,
        topic: &str,
        schema: &str,
        role: Role,
        channels: &mut Vec<String>,
    ) -> Result<(), ImportError> {
        let name = role.name();
        let lines = Lines { name, world: "ned", body: "frd" };
        match (schema, role) {
            ("px4_msgs/VehicleAngularVelocity" | "px4_msgs/VehicleAcceleration", _) => {
                channels.push(lines.in_body(["xyz[0]", "xyz[1]", "xyz[2]"]));
            }
            ("px4_msgs/SensorCombined", Role::Omega) => {
                channels.push(lines.in_body(["gyro_rad[0]", "gyro_rad[1]", "gyro_rad[2]"]));
            }
            ("px4_msgs/SensorCombined", _) => channels.push(lines.in_body([
                "accelerometer_m_s2[0]",
                "accelerometer_m_s2[1]",
                "accelerometer_m_s2[2]",
            ])),
            ("px4_msgs/VehicleAttitude" | "px4_msgs/VehicleOdometry", Role::Attitude) => {
                channels.push(lines.quaternion(["q[0]", "q[1]", "q[2]", "q[3]"], "wxyz"));
            }
            ("px4_msgs/VehicleLocalPosition", Role::Position) => {
                channels.push(lines.in_world(["x", "y", "z"]));
            }
            ("px4_msgs/VehicleLocalPosition", _) => {
                channels.push(lines.in_world(["vx", "vy", "vz"]));
            }
            ("px4_msgs/VehicleOdometry", role) => {
                // 1 is NED, 3 the body.
                let (key, columns) = match role {
                    Role::Position => ("pose_frame", ["position[0]", "position[1]", "position[2]"]),
                    _ => ("velocity_frame", ["velocity[0]", "velocity[1]", "velocity[2]"]),
                };
                let frame = self.columns(topic, &[key])?[0][0];
                // Whole numbers of one byte.
                match frame as u8 {
                    1 => channels.push(lines.in_world(columns)),
                    3 if self.has_attitude => channels.push(lines.turned(columns)),
                    3 => self.notes.push(lines.unturned(topic)),
                    frame => self
                        .notes
                        .push(format!("{name}: left out, `{topic}` has {key} {frame}, not NED")),
                }
            }
            ("px4_msgs/BatteryStatus", _) => {
                channels.push(format!("\"{name}\" = {{ columns = [\"voltage_v\"] }}"));
                // -1 is a current that nobody measures.
                if self.columns(topic, &["current_a"])?[0][0] >= 0.0 {
                    channels
                        .push("\"battery.current_a\" = { columns = [\"current_a\"] }".to_owned());
                }
            }
            ("px4_msgs/ActuatorMotors", _) => {
                self.rotors(topic, schema, name, channels)?;
            }
            _ => {}
        }
        Ok(())
    }

    fn ros(
        &mut self,
        topic: &str,
        schema: &str,
        role: Role,
        channels: &mut Vec<String>,
    ) -> Result<(), ImportError> {
        let name = role.name();
        let lines = Lines { name, world: "enu", body: "flu" };
        match (schema, role) {
            ("sensor_msgs/Imu", Role::Omega) => {
                let columns = ["angular_velocity.x", "angular_velocity.y", "angular_velocity.z"];
                channels.push(lines.in_body(columns));
            }
            ("sensor_msgs/Imu", Role::Force) => channels.push(lines.in_body([
                "linear_acceleration.x",
                "linear_acceleration.y",
                "linear_acceleration.z",
            ])),
            ("sensor_msgs/Imu", _) => {
                let q = ["orientation.x", "orientation.y", "orientation.z", "orientation.w"];
                let numbers =
                    self.columns(topic, &[q[0], q[1], q[2], q[3], "orientation_covariance[0]"])?;
                // REP-145: a device that does not estimate orientation says so by -1.
                if numbers[4][0] < 0.0 || numbers[..4].iter().flatten().all(|x| *x == 0.0) {
                    self.notes.push(format!("{name}: left out, `{topic}` has no orientation"));
                } else {
                    channels.push(lines.quaternion(q, "xyzw"));
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
                    channels.push(lines.quaternion([&q[0], &q[1], &q[2], &q[3]], "xyzw"));
                } else {
                    let p = ["x", "y", "z"].map(|axis| part(&format!("position.{axis}")));
                    channels.push(lines.in_world([&p[0], &p[1], &p[2]]));
                }
            }
            ("nav_msgs/Odometry", _) if !self.has_attitude => {
                self.notes.push(lines.unturned(topic));
            }
            ("nav_msgs/Odometry", _) => {
                channels.push(lines.turned([
                    "twist.twist.linear.x",
                    "twist.twist.linear.y",
                    "twist.twist.linear.z",
                ]));
            }
            ("geometry_msgs/TwistStamped", _) => {
                let columns = ["twist.linear.x", "twist.linear.y", "twist.linear.z"];
                let frame = self.log.topics[topic].frame_id();
                let of_body =
                    ["base", "body", "fcu", "imu"].iter().any(|word| frame.contains(word));
                self.notes.push(format!(
                    "{name}: `{topic}` is in the frame `{frame}`, taken as {}",
                    if of_body { "the body's" } else { "the world's" }
                ));
                if !of_body {
                    channels.push(lines.in_world(columns));
                } else if self.has_attitude {
                    channels.push(lines.turned(columns));
                } else {
                    self.notes.push(lines.unturned(topic));
                }
            }
            ("sensor_msgs/BatteryState", _) => {
                channels.push(format!("\"{name}\" = {{ columns = [\"voltage\"] }}"));
                channels.push("\"battery.current_a\" = { columns = [\"current\"], scale = -1.0, optional = true }".to_owned());
            }
            ("mavros_msgs/RCOut" | "mavros_msgs/ESCTelemetry", _) => {
                self.rotors(topic, schema, name, channels)?;
            }
            ("mavros_msgs/ActuatorControl", _) => {
                let columns: Vec<String> = (0..8).map(|i| format!("controls[{i}]")).collect();
                channels.push(format!("\"{name}\" = {{ columns = {columns:?} }}"));
            }
            _ => {}
        }
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
