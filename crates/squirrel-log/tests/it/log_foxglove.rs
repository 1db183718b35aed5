//! A flight with a true pose opens in Foxglove's 3-D panel: frames in ENU, at most 50 a second,
//! obstacles as cylinders.

use std::fs;
use std::path::PathBuf;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use prost::encoding::{DecodeContext, WireType, decode_key, decode_varint, skip_field};
use squirrel_log::FlightLog;

fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// Numbers and parts of a protobuf message by field number, read without the schema.
#[derive(Default)]
struct Fields {
    doubles: std::collections::BTreeMap<u32, f64>,
    parts: Vec<(u32, Vec<u8>)>,
}

impl Fields {
    fn of(mut message: &[u8]) -> Self {
        let mut fields = Self::default();
        while !message.is_empty() {
            let (number, wire_type) = decode_key(&mut message).unwrap();
            match wire_type {
                WireType::SixtyFourBit => {
                    let (value, rest) = message.split_first_chunk().unwrap();
                    fields.doubles.insert(number, f64::from_le_bytes(*value));
                    message = rest;
                }
                WireType::LengthDelimited => {
                    let length = decode_varint(&mut message).unwrap() as usize;
                    fields.parts.push((number, message[..length].to_vec()));
                    message = &message[length..];
                }
                _ => skip_field(wire_type, number, &mut message, DecodeContext::default()).unwrap(),
            }
        }
        fields
    }

    fn part(&self, number: u32) -> &[u8] {
        &self.parts.iter().find(|part| part.0 == number).unwrap().1
    }

    /// Proto3 leaves zeros out.
    fn double(&self, number: u32) -> f64 {
        self.doubles.get(&number).copied().unwrap_or(0.0)
    }

    fn vector3(&self, number: u32) -> Vector3<f64> {
        let vector = Self::of(self.part(number));
        Vector3::new(vector.double(1), vector.double(2), vector.double(3))
    }
}

/// 2 s at 300 Hz of a climb to the north-east, nose to the east.
fn flight() -> FlightLog {
    let mut log = FlightLog::default();
    let nose_east =
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::FRAC_PI_2);
    let attitude: &[f64] = &[nose_east.w, nose_east.i, nose_east.j, nose_east.k];
    for i in 0..600 {
        let time_s = f64::from(i) / 300.0;
        let position = [3.0 * time_s, 2.0 * time_s, -time_s];
        log.source_mut("truth")
            .push(time_s, &[("position_ned_m", &position), ("q_ned_from_body_wxyz", attitude)]);
    }
    log
}

fn messages(log: &FlightLog, name: &str, topic: &str) -> Vec<(f64, Vec<u8>)> {
    let file = path(name);
    log.write(&file).unwrap();
    assert_eq!(
        FlightLog::read(&file).unwrap(),
        *log,
        "the reader skips what it did not write as a source"
    );
    let bytes = fs::read(&file).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap);
    let messages = messages.filter(|message| message.channel.topic == topic);
    messages.map(|message| (message.log_time as f64 * 1e-9, message.data.to_vec())).collect()
}

#[test]
fn the_vehicle_moves_in_enu_at_50_hz() {
    let transforms = messages(&flight(), "transform.mcap", "/tf");
    assert_eq!(transforms.len(), 100);
    for (time_s, message) in transforms {
        let transform = Fields::of(&message);
        assert_eq!((transform.part(2), transform.part(3)), (&b"map"[..], &b"body"[..]));
        let position_enu_m = Vector3::new(2.0 * time_s, 3.0 * time_s, time_s);
        assert!((transform.vector3(4) - position_enu_m).norm() < 1e-9);
        let q = Fields::of(transform.part(5));
        let q = Quaternion::new(q.double(4), q.double(1), q.double(2), q.double(3));
        assert!((q.norm() - 1.0).abs() < 1e-12);
        let enu_from_body = UnitQuaternion::from_quaternion(q);
        assert!(
            (enu_from_body * Vector3::x() - Vector3::x()).norm() < 1e-12,
            "the nose points east"
        );
        assert!(
            (enu_from_body * Vector3::y() + Vector3::y()).norm() < 1e-12,
            "the right wing points south"
        );
        assert!(
            (enu_from_body * Vector3::z() + Vector3::z()).norm() < 1e-12,
            "the belly points down"
        );
    }
}

#[test]
fn a_pose_that_is_not_known_is_left_out() {
    let mut log = flight();
    let position = log.source_mut("truth").channels.get_mut("position_ned_m").unwrap();
    position.values[..3 * 300].fill(f64::INFINITY);
    assert_eq!(messages(&log, "half_a_transform.mcap", "/tf").len(), 50);
    log.source_mut("truth").channels.remove("q_ned_from_body_wxyz");
    assert_eq!(messages(&log, "no_transform.mcap", "/tf").len(), 0);
}

#[test]
fn obstacles_are_cylinders() {
    let mut log = flight();
    assert_eq!(messages(&log, "no_scene.mcap", "/scene").len(), 0);
    log.metadata.insert("obstacles_json".to_owned(), "[[8, -1.5, 0.25], [10, 2, 0.5]]".to_owned());
    let scenes = messages(&log, "scene.mcap", "/scene");
    assert_eq!(scenes.len(), 1);
    let update = Fields::of(&scenes[0].1);
    let entity = Fields::of(update.part(2));
    assert_eq!(entity.part(2), b"map");
    let cylinders: Vec<_> = entity.parts.iter().filter(|part| part.0 == 10).collect();
    assert_eq!(cylinders.len(), 2);
    let first = Fields::of(&cylinders[0].1);
    let place_enu_m = Fields::of(first.part(1)).vector3(1);
    assert_eq!((place_enu_m.x, place_enu_m.y), (-1.5, 8.0));
    let size_m = first.vector3(2);
    assert_eq!((size_m.x, size_m.y), (0.5, 0.5));
    assert_eq!(place_enu_m.z, 0.5 * size_m.z, "it stands on the ground");
}

#[test]
fn obstacles_that_are_no_list_are_refused() {
    let (file, mut log) = (path("bad_scene.mcap"), flight());
    log.metadata.insert("obstacles_json".to_owned(), "[[8, 1]]".to_owned());
    let text = log.write(&file).unwrap_err().to_string();
    assert!(
        text.starts_with(&format!("{}: metadata `obstacles_json`: ", file.display())),
        "{text}"
    );
}
