//! The example of docs/embedding.md.

#![no_std]
#![no_main]

use squirrel_core::estimate::rest::Preflight;
use squirrel_core::frames::In;
use squirrel_core::stack::wire::{Reader, Record, Wire};
use squirrel_core::stack::{SensorFrame, StackState};

/// What a board has to give.
trait Board {
    /// Waits for the next 1/300 s; microseconds since the start, never backwards.
    fn wait_for_tick(&mut self) -> u64;
    /// Fills in the sensors that have spoken since the last tick.
    fn read(&mut self, frame: &mut SensorFrame);
    /// Whether the pilot wants to fly, and the vehicle stands level and still.
    fn is_armed(&self) -> bool;
    /// One command a rotor in the vehicle's unit, and each wing's, 0 folded to 1 spread.
    fn write(&mut self, rotors: &[f32], wings: [f32; 2]);
}

/// Flies the setup that `squirrel export-vectors` wrote as its first record; returns only if that is none.
fn fly(board: &mut impl Board, setup: &[u8]) {
    let Some(Record::Setup(setup)) = Record::take(&mut Reader::new(setup)) else { return };
    // A second at rest says where the flight begins: attitude, gyro bias, what receiver and barometer are off by.
    let mut ground = Preflight::default();
    let (stack, begin_us) = loop {
        let mut frame = SensorFrame::empty(board.wait_for_tick());
        board.read(&mut frame);
        ground.hear(&frame);
        let start = ground.start(In::zero()).filter(|_| board.is_armed());
        if let Some(stack) = start.and_then(|start| setup.starting(start).ok()) {
            break (stack, frame.time_us);
        }
    };
    let mut state = StackState::default();
    loop {
        let mut frame = SensorFrame::empty(board.wait_for_tick() - begin_us);
        board.read(&mut frame);
        let output = stack.step(&mut state, &frame);
        let rotors = output.rotor_command.get(..stack.vehicle().rotors().len()).unwrap_or(&[]);
        board.write(rotors, output.wing_command);
    }
}
// The rest is this board: a clock that only counts, no sensors, rotors that are only looked at.
struct Bench(u64);

impl Board for Bench {
    fn wait_for_tick(&mut self) -> u64 {
        self.0 += 3333;
        self.0
    }
    fn read(&mut self, _: &mut SensorFrame) {}
    fn is_armed(&self) -> bool {
        true
    }
    fn write(&mut self, rotors: &[f32], wings: [f32; 2]) {
        core::hint::black_box((rotors, wings));
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    fly(&mut Bench(0), core::hint::black_box(&[]));
    squirrel_m7::host::exit(false)
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    squirrel_m7::host::exit(false)
}
