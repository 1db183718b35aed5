use super::*;
use crate::control::wing_force::{ForceModel, fixtures::loud};
use crate::guidance::excite::{Leg, Multisine, Programme};
use crate::guidance::mission::Mission;
use crate::guidance::sensing::Obstacle;
use crate::stack::tests::{commanded, level, stack_on};
use crate::stack::{SensorFrame, StackState};

fn bytes(value: &impl Wire) -> Vec<u8> {
    let mut buffer = [0; RECORD_MAX];
    let mut writer = Writer::new(&mut buffer);
    value.put(&mut writer);
    writer.bytes().unwrap().to_vec()
}

fn back<T: Wire>(bytes: &[u8]) -> Option<T> {
    let mut reader = Reader::new(bytes);
    T::take(&mut reader).filter(|_| reader.is_empty())
}

fn programme() -> Mission {
    let multisine = Multisine::new([0.01, 0.02, 0.01], 0.01, 3).unwrap();
    Mission::Excite(Programme::new(In::zero(), &[Leg::UNUSED; 5], multisine).unwrap())
}

#[test]
fn setups_frames_and_outputs_come_back() {
    let hover = Mission::Hover { position: In::zero() };
    for (model, mission) in
        [(ForceModel::FlatPlate, programme()), (ForceModel::Parnn(loud()), hover)]
    {
        let stack = stack_on(&model, &mission);
        let there = bytes(&Record::Setup(stack));
        assert_eq!(back::<Record>(&there), Some(Record::Setup(stack)));
        let mut state = StackState::default();
        let mut frame = level(5);
        frame.altitude_m = Some(3.0);
        frame.wing_force = Some(In::zero());
        frame.command = Some(commanded([0.1, -0.2, 5.0, 0.5]));
        frame.set_obstacles(&[Obstacle { id: 7, north_m: 1.0, east_m: -2.0 }]);
        assert_eq!(back::<Record>(&bytes(&Record::Frame(frame, 9))), Some(Record::Frame(frame, 9)));
        let output = stack.step(&mut state, &frame);
        assert_eq!(back(&bytes(&output)), Some(output));
    }
}

#[test]
fn a_memory_comes_back_and_flies_on_to_the_bit() {
    let stack = stack_on(&ForceModel::FlatPlate, &programme());
    let mut state = StackState::default();
    let frame = |k: u64| {
        let mut frame = level(k * 3333);
        frame.altitude_m = k.is_multiple_of(7).then_some(k as f32 * 0.01);
        frame
    };
    for k in 0..400 {
        stack.step(&mut state, &frame(k));
    }
    let there = bytes(&Outside::of(&state).unwrap());
    let mut again = *back::<Outside>(&there).unwrap().state();
    assert_eq!(again, state);
    for k in 400..800 {
        assert_eq!(stack.step(&mut again, &frame(k)), stack.step(&mut state, &frame(k)));
    }
    for end in 0..there.len() {
        assert_eq!(back::<Outside>(&there[..end]), None, "{end}");
    }
    let map = crate::control::supply::ThrustByVoltage { exponent: 1.0, reference_v: 14.8 };
    state.supply.hear(14.0, &map);
    assert_eq!(Outside::of(&state), None, "a battery was heard");
}

#[test]
fn truncated_or_wrong_bytes_are_none() {
    let stack = stack_on(&ForceModel::FlatPlate, &programme());
    for whole in [bytes(&Record::Setup(stack)), bytes(&Record::Frame(level(0), 1))] {
        for end in 0..whole.len() {
            assert_eq!(back::<Record>(&whole[..end]), None, "{end}");
        }
        let mut wrong = whole.clone();
        wrong[0] = 9;
        assert_eq!(back::<Record>(&wrong), None);
    }
    let mut header = bytes(&Header { sequences: 1, frames: 2 });
    assert_eq!(header.len(), Header::LENGTH);
    assert_eq!(back(&header), Some(Header { sequences: 1, frames: 2 }));
    header[8] += 1;
    assert_eq!(back::<Header>(&header), None, "another version");
    // More obstacles than a frame has room for.
    let mut frame = bytes(&SensorFrame::empty(0));
    *frame.last_mut().unwrap() = 200;
    assert_eq!(back::<SensorFrame>(&frame), None);
}

#[test]
fn one_nan_and_one_bit_tell() {
    assert_eq!(bytes(&f32::NAN), bytes(&-f32::NAN));
    assert_ne!(bytes(&0.0f32), bytes(&-0.0f32));
    let start = hash(HASH_START, b"squirrel");
    assert_ne!(start, hash(HASH_START, b"squirrem"));
    assert_eq!(hash(HASH_START, b"a"), 0xAF63_DC4C_8601_EC8C, "as published for FNV-1a");
}

#[test]
fn what_does_not_fit_is_said() {
    let mut small = [0; 3];
    let mut writer = Writer::new(&mut small);
    7u32.put(&mut writer);
    assert_eq!(writer.bytes(), None);
}
