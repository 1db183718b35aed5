//! A policy for the flight code to be commanded by: its file, made from nothing.
//!
//! A controller that anybody would write, as the network that flies: acceleration from the errors
//! of position and velocity, on the part of tanh that is nearly linear, wings half open. That it
//! flies well is no matter here, that commands differ all the time is.

use std::fmt::Write as _;

const OBSERVATION: usize = 25;
const HIDDEN: usize = 32;
const ACTION: usize = 4;
const TENSORS: [(&str, &[usize]); 6] = [
    ("first.bias", &[HIDDEN]),
    ("first.weight", &[OBSERVATION, HIDDEN]),
    ("output.bias", &[ACTION]),
    ("output.weight", &[HIDDEN, ACTION]),
    ("second.bias", &[HIDDEN]),
    ("second.weight", &[HIDDEN, HIDDEN]),
];
const RECORD: &str =
    r#"{\"kind\":\"policy\",\"format\":1,\"observation\":25,\"hidden\":32,\"action\":4}"#;

/// The bytes of the file: length of a header, the header, numbers.
pub(super) fn file() -> Vec<u8> {
    let mut header = format!("{{\"__metadata__\":{{\"squirrel\":\"{RECORD}\"}}");
    let mut numbers: Vec<u8> = Vec::new();
    for (name, shape) in TENSORS {
        let start = numbers.len();
        let columns = shape.last().copied().unwrap_or(1);
        for i in 0..shape.iter().product::<usize>() {
            numbers.extend(number(name, i / columns, i % columns).to_le_bytes());
        }
        let end = numbers.len();
        let _ = write!(
            header,
            ",\"{name}\":{{\"dtype\":\"F32\",\"shape\":{shape:?},\"data_offsets\":[{start},{end}]}}"
        );
    }
    header.push('}');
    [&(header.len() as u64).to_le_bytes()[..], header.as_bytes(), &numbers].concat()
}

/// North by pitching down, east by rolling right, down by less thrust: neuron 0, 1, 2 of each
/// layer.
fn number(tensor: &str, row: usize, column: usize) -> f32 {
    const GAIN: [f32; 3] = [-0.2, 0.2, -0.1];
    match (tensor, row, column) {
        ("first.weight", axis @ 0..3, neuron) if neuron == axis => 0.3 * GAIN[axis],
        ("first.weight", seen @ 3..6, neuron) if neuron == seen - 3 => 1.1 * GAIN[neuron],
        ("second.weight", from @ 0..3, to) if from == to => 1.0,
        ("output.weight", 0, 1) | ("output.weight", 1, 0) | ("output.weight", 2, 2) => 10.0,
        _ => 0.0,
    }
}
