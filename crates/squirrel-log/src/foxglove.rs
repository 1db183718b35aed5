//! What Foxglove's 3-D panel shows of a flight: the vehicle as a moving frame, obstacles as
//! cylinders.
//!
//! The messages are Foxglove's own schemas, field numbers as published at
//! <https://github.com/foxglove/foxglove-sdk/tree/main/schemas/proto/foxglove>, with only the
//! fields used here. The panel has z up, so the parent frame `map` is ENU; the child frame `body`
//! stays FRD.

use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet, Timestamp,
};

pub(super) const TRANSFORM_TOPIC: &str = "/tf";
pub(super) const TRANSFORM_SCHEMA: &str = "foxglove.FrameTransform";
pub(super) const SCENE_TOPIC: &str = "/scene";
pub(super) const SCENE_SCHEMA: &str = "foxglove.SceneUpdate";

/// Obstacles have a place and a radius; the panel needs a height too.
const OBSTACLE_HEIGHT_M: f64 = 3.0;

#[derive(Clone, Copy, PartialEq, Message)]
struct Vector3 {
    #[prost(double, tag = "1")]
    x: f64,
    #[prost(double, tag = "2")]
    y: f64,
    #[prost(double, tag = "3")]
    z: f64,
}

#[derive(Clone, Copy, PartialEq, Message)]
struct Quaternion {
    #[prost(double, tag = "1")]
    x: f64,
    #[prost(double, tag = "2")]
    y: f64,
    #[prost(double, tag = "3")]
    z: f64,
    #[prost(double, tag = "4")]
    w: f64,
}

#[derive(Clone, PartialEq, Message)]
struct FrameTransform {
    #[prost(message, optional, tag = "1")]
    timestamp: Option<Timestamp>,
    #[prost(string, tag = "2")]
    parent_frame_id: String,
    #[prost(string, tag = "3")]
    child_frame_id: String,
    #[prost(message, optional, tag = "4")]
    translation: Option<Vector3>,
    #[prost(message, optional, tag = "5")]
    rotation: Option<Quaternion>,
}

#[derive(Clone, Copy, PartialEq, Message)]
struct Pose {
    #[prost(message, optional, tag = "1")]
    position: Option<Vector3>,
    #[prost(message, optional, tag = "2")]
    orientation: Option<Quaternion>,
}

#[derive(Clone, Copy, PartialEq, Message)]
struct Color {
    #[prost(double, tag = "1")]
    r: f64,
    #[prost(double, tag = "2")]
    g: f64,
    #[prost(double, tag = "3")]
    b: f64,
    #[prost(double, tag = "4")]
    a: f64,
}

#[derive(Clone, Copy, PartialEq, Message)]
struct CylinderPrimitive {
    #[prost(message, optional, tag = "1")]
    pose: Option<Pose>,
    #[prost(message, optional, tag = "2")]
    size: Option<Vector3>,
    #[prost(double, tag = "3")]
    bottom_scale: f64,
    #[prost(double, tag = "4")]
    top_scale: f64,
    #[prost(message, optional, tag = "5")]
    color: Option<Color>,
}

#[derive(Clone, PartialEq, Message)]
struct SceneEntity {
    #[prost(message, optional, tag = "1")]
    timestamp: Option<Timestamp>,
    #[prost(string, tag = "2")]
    frame_id: String,
    #[prost(string, tag = "3")]
    id: String,
    #[prost(message, repeated, tag = "10")]
    cylinders: Vec<CylinderPrimitive>,
}

#[derive(Clone, PartialEq, Message)]
struct SceneUpdate {
    #[prost(message, repeated, tag = "2")]
    entities: Vec<SceneEntity>,
}

/// The vehicle's frame in ENU from its position (NED, m) and attitude (NED from body, w x y z);
/// `None` if a number is not finite.
pub(super) fn frame_transform(
    time_ns: u64,
    position_ned_m: &[f64],
    q_ned_from_body_wxyz: &[f64],
) -> Option<Vec<u8>> {
    let (&[north, east, down], &[w, x, y, z]) = (position_ned_m, q_ned_from_body_wxyz) else {
        return None;
    };
    if ![north, east, down, w, x, y, z].iter().all(|value| value.is_finite()) {
        return None;
    }
    // q_enu_from_ned = (0, 1, 1, 0) / sqrt(2), times q_ned_from_body.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let rotation =
        Quaternion { w: -half * (x + y), x: half * (w + z), y: half * (w - z), z: half * (y - x) };
    let transform = FrameTransform {
        timestamp: Some(timestamp(time_ns)),
        parent_frame_id: "map".to_owned(),
        child_frame_id: "body".to_owned(),
        translation: Some(Vector3 { x: east, y: north, z: -down }),
        rotation: Some(rotation),
    };
    Some(transform.encode_to_vec())
}

/// Cylinders on the ground at `[north_m, east_m, radius_m]`.
pub(super) fn scene(time_ns: u64, obstacles: &[[f64; 3]]) -> Vec<u8> {
    let cylinder = |&[north, east, radius]: &[f64; 3]| CylinderPrimitive {
        pose: Some(Pose {
            position: Some(Vector3 { x: east, y: north, z: 0.5 * OBSTACLE_HEIGHT_M }),
            orientation: Some(Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 }),
        }),
        size: Some(Vector3 { x: 2.0 * radius, y: 2.0 * radius, z: OBSTACLE_HEIGHT_M }),
        bottom_scale: 1.0,
        top_scale: 1.0,
        color: Some(Color { r: 0.45, g: 0.33, b: 0.22, a: 1.0 }),
    };
    let entity = SceneEntity {
        timestamp: Some(timestamp(time_ns)),
        frame_id: "map".to_owned(),
        id: "obstacles".to_owned(),
        cylinders: obstacles.iter().map(cylinder).collect(),
    };
    SceneUpdate { entities: vec![entity] }.encode_to_vec()
}

fn timestamp(time_ns: u64) -> Timestamp {
    Timestamp {
        seconds: (time_ns / 1_000_000_000).cast_signed(),
        nanos: (time_ns % 1_000_000_000) as i32,
    }
}

/// Serialised `FileDescriptorSet` of [`TRANSFORM_SCHEMA`].
pub(super) fn transform_schema() -> Vec<u8> {
    let transform = [
        ("timestamp", 1, One(TIMESTAMP)),
        ("parent_frame_id", 2, Text),
        ("child_frame_id", 3, Text),
        ("translation", 4, One(".foxglove.Vector3")),
        ("rotation", 5, One(".foxglove.Quaternion")),
    ];
    descriptor_set(vec![vector3(), quaternion(), message("FrameTransform", &transform)])
}

/// Serialised `FileDescriptorSet` of [`SCENE_SCHEMA`].
pub(super) fn scene_schema() -> Vec<u8> {
    let pose = [
        ("position", 1, One(".foxglove.Vector3")),
        ("orientation", 2, One(".foxglove.Quaternion")),
    ];
    let color = [("r", 1, Double), ("g", 2, Double), ("b", 3, Double), ("a", 4, Double)];
    let cylinder = [
        ("pose", 1, One(".foxglove.Pose")),
        ("size", 2, One(".foxglove.Vector3")),
        ("bottom_scale", 3, Double),
        ("top_scale", 4, Double),
        ("color", 5, One(".foxglove.Color")),
    ];
    let entity = [
        ("timestamp", 1, One(TIMESTAMP)),
        ("frame_id", 2, Text),
        ("id", 3, Text),
        ("cylinders", 10, Many(".foxglove.CylinderPrimitive")),
    ];
    descriptor_set(vec![
        vector3(),
        quaternion(),
        message("Pose", &pose),
        message("Color", &color),
        message("CylinderPrimitive", &cylinder),
        message("SceneEntity", &entity),
        message("SceneUpdate", &[("entities", 2, Many(".foxglove.SceneEntity"))]),
    ])
}

use Field::{Double, Int32, Int64, Many, One, Text};

/// Type of a field; messages by their full name.
#[derive(Clone, Copy)]
enum Field {
    Double,
    Int32,
    Int64,
    Text,
    One(&'static str),
    Many(&'static str),
}

const TIMESTAMP: &str = ".google.protobuf.Timestamp";

fn vector3() -> DescriptorProto {
    message("Vector3", &[("x", 1, Double), ("y", 2, Double), ("z", 3, Double)])
}

fn quaternion() -> DescriptorProto {
    message("Quaternion", &[("x", 1, Double), ("y", 2, Double), ("z", 3, Double), ("w", 4, Double)])
}

fn message(name: &str, fields: &[(&str, i32, Field)]) -> DescriptorProto {
    let field = |&(name, number, field): &(&str, i32, Field)| {
        let (kind, type_name) = match field {
            Double => (Type::Double, None),
            Int32 => (Type::Int32, None),
            Int64 => (Type::Int64, None),
            Text => (Type::String, None),
            One(type_name) | Many(type_name) => (Type::Message, Some(type_name.to_owned())),
        };
        let label = if matches!(field, Many(_)) { Label::Repeated } else { Label::Optional };
        FieldDescriptorProto {
            name: Some(name.to_owned()),
            number: Some(number),
            label: Some(label.into()),
            r#type: Some(kind.into()),
            type_name,
            ..FieldDescriptorProto::default()
        }
    };
    DescriptorProto {
        name: Some(name.to_owned()),
        field: fields.iter().map(field).collect(),
        ..DescriptorProto::default()
    }
}

fn descriptor_set(messages: Vec<DescriptorProto>) -> Vec<u8> {
    let timestamp_file = "google/protobuf/timestamp.proto";
    let timestamp = message("Timestamp", &[("seconds", 1, Int64), ("nanos", 2, Int32)]);
    let file =
        |name: &str, package: &str, dependency: Vec<String>, message_type| FileDescriptorProto {
            name: Some(name.to_owned()),
            package: Some(package.to_owned()),
            dependency,
            message_type,
            syntax: Some("proto3".to_owned()),
            ..FileDescriptorProto::default()
        };
    let set = FileDescriptorSet {
        file: vec![
            file(timestamp_file, "google.protobuf", Vec::new(), vec![timestamp]),
            file("foxglove/squirrel.proto", "foxglove", vec![timestamp_file.to_owned()], messages),
        ],
    };
    set.encode_to_vec()
}
