//! The example of docs/embedding.md.

#![no_std]
#![no_main]

use squirrel_core::estimate::navigator::Start;
use squirrel_core::stack::wire::{Reader, Record, Wire};
use squirrel_core::stack::{SensorFrame, StackState};

/// What a board has to give.
trait Board {
    /// Waits for the next 1/300 s; microseconds since the flight began, never backwards.
    fn wait_for_tick(&mut self) -> u64;
    /// Fills in the sensors that have spoken since the last tick.
    fn read(&mut self, frame: &mut SensorFrame);
    /// One command a rotor in the vehicle's unit, and each wing's, 0 folded to 1 spread.
    fn write(&mut self, rotors: &[f32], wings: [f32; 2]);
}

/// Flies the setup that `squirrel export-vectors` wrote as its first record; returns only if it or
/// the start is none.
fn fly(board: &mut impl Board, setup: &[u8], start: Start) {
    let Some(Record::Setup(setup)) = Record::take(&mut Reader::new(setup)) else { return };
    let Ok(stack) = setup.starting(start) else { return };
    let mut state = StackState::default();
    loop {
        let mut frame = SensorFrame::empty(board.wait_for_tick());
        board.read(&mut frame);
        let output = stack.step(&mut state, &frame);
        let rotors = output.rotor_command.get(..stack.vehicle().rotors().len()).unwrap_or(&[]);
        board.write(rotors, output.wing_command);
    }
}
// The rest is this board: a clock that only counts, a sensor that always rests, rotors that are
// only looked at.
use squirrel_core::estimate::rest::Preflight;
use squirrel_core::frames::In;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::stack::Imu;

struct Bench(u64);

impl Board for Bench {
    fn wait_for_tick(&mut self) -> u64 {
        self.0 += 3333;
        self.0
    }
    fn read(&mut self, frame: &mut SensorFrame) {
        let specific_force = In::new(Vector3::new(0.0, 0.0, -9.81));
        frame.imu = Some(Imu { omega: In::zero(), specific_force });
    }
    fn write(&mut self, rotors: &[f32], wings: [f32; 2]) {
        core::hint::black_box((rotors, wings));
    }
}

/// Hears the sensors at rest until they say where a flight begins; a board with a pilot goes on
/// until he arms.
fn stand(board: &mut impl Board) -> Start {
    let mut ground = Preflight::default();
    loop {
        let mut frame = SensorFrame::empty(board.wait_for_tick());
        board.read(&mut frame);
        ground.hear(&frame);
        if let Some(start) = ground.start(In::zero()) {
            return start;
        }
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let start = stand(&mut Bench(0));
    fly(&mut Bench(0), core::hint::black_box(&[]), start);
    squirrel_m7::host::exit(false)
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    squirrel_m7::host::exit(false)
}
