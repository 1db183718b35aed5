//! Lesson 3, the flight code alone: no simulator, no clock, no allocation.
//!
//! [`Stack`] is what does not change in flight: vehicle, gains, mission. [`StackState`] is all that
//! does, a plain struct. A step is a function of state and sensor frame, and gives commands with
//! every term behind them. So an autopilot calls it 300 times a second with what its sensors said
//! since; so a log is replayed bit for bit; and a state that was copied goes on as the original.
//! Look at what happens when a sensor speaks nonsense, and when it goes silent.
//!
//! ```sh
//! cargo run --release -p squirrel-examples --example the_flight_code_alone
//! ```
#![allow(clippy::print_stdout, reason = "a lesson is told")]

use squirrel_core::estimate::navigator::Navigation;
use squirrel_core::frames::{In, Rotation};
use squirrel_core::guidance::mission::Mission;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::stack::{
    Gnss, Imu, SensorFrame, Stack, StackOutput, StackParameters, StackState,
};
use squirrel_examples::Outcome;
use squirrel_sim::vehicle_file::VehicleFile;

/// The flight code of the shipped vehicle. An embedded user has these numbers in flash
/// (docs/embedding.md).
fn stack() -> Outcome<Stack> {
    let file = VehicleFile::squirrel();
    // Attitude comes with the frame, so that a frame can be made up by hand.
    let parameters = StackParameters {
        navigation: Navigation::external(),
        ..file.control.ok_or("no [control]")?
    };
    let hold = Mission::Hover { position: In::new(Vector3::new(0.0, 0.0, -10.0)) };
    Ok(Stack::new(file.vehicle.cast()?, parameters, hold)?)
}

/// What sensors say of a vehicle that hangs a metre below its place and slowly swings to and fro.
fn frame(tick: u64) -> SensorFrame {
    let mut frame = SensorFrame::empty(tick * 1_000_000 / 300);
    let phase_rad = 0.02 * tick as f32;
    let omega = In::new(Vector3::new(0.06 * phase_rad.cos(), 0.0, 0.0));
    frame.imu = Some(Imu { omega, specific_force: In::new(Vector3::new(0.0, 0.0, -9.8)) });
    frame.attitude = Some(Rotation::from_euler(0.01 * phase_rad.sin(), 0.0, 0.0));
    // A receiver is slower than a gyro: what has not spoken is left out.
    if tick.is_multiple_of(30) {
        let position = In::new(Vector3::new(0.0, 0.0, -9.0));
        frame.gnss = Some(Gnss { position, velocity: In::zero() });
    }
    frame
}

/// Steps through frames.
fn fly(stack: &Stack, state: &mut StackState, ticks: std::ops::Range<u64>) -> Vec<StackOutput> {
    ticks.map(|tick| stack.step(state, &frame(tick))).collect()
}

/// The same with another inertial measurement, or none.
fn frame_with(tick: u64, imu: Option<Imu>) -> SensorFrame {
    let mut frame = frame(tick);
    frame.imu = imu;
    frame
}

/// A gyro that says no number.
fn nonsense() -> Imu {
    Imu { omega: In::new(Vector3::repeat(f32::NAN)), specific_force: In::zero() }
}

fn main() -> Outcome<()> {
    let (stack, mut state) = (stack()?, StackState::default());
    println!("state: {} bytes; stack: {} bytes", size_of::<StackState>(), size_of::<Stack>());
    println!("time s  outer loop  rotor commands");
    for (tick, output) in (0_u32..).zip(fly(&stack, &mut state, 0..300)) {
        if tick % 45 == 0 {
            let (ran, rotors) = (output.outer.is_some(), &output.rotor_command[..4]);
            println!("{:>6.2}  {ran:<10}  {rotors:.3?}", f64::from(tick) / 300.0);
        }
    }

    let mut thawed = state;
    let [on, again] = [fly(&stack, &mut state, 300..600), fly(&stack, &mut thawed, 300..600)];
    println!("\nthawed after 1 s: {} of {} outputs the same", on.len(), again.len());
    println!("is every bit the same? {}", on == again && state == thawed);

    let output = stack.step(&mut state, &frame_with(600, Some(nonsense())));
    println!(
        "\na gyro that is no number: {} rejected, {:?}",
        output.rejected, output.failsafe.mode
    );
    let silent = (601..900).map(|tick| stack.step(&mut state, &frame_with(tick, None)));
    if let Some(output) = silent.last() {
        println!("silent for a second: {:?}, {:?}", output.failsafe.mode, output.failsafe.reason);
    }
    Ok(())
}

#[test]
fn a_copied_state_goes_on_as_the_original() -> Outcome<()> {
    let (stack, mut state) = (stack()?, StackState::default());
    let before = fly(&stack, &mut state, 0..300);
    assert_eq!(before.iter().filter(|output| output.outer.is_some()).count(), 10, "10 Hz");
    let mut thawed = state;
    assert_eq!(fly(&stack, &mut state, 300..600), fly(&stack, &mut thawed, 300..600));
    assert_eq!(state, thawed);
    // It hangs too low: more than hovering takes is asked for.
    let thrust_n = state.command.thrust_n;
    assert!(thrust_n > stack.vehicle().weight_n(), "{thrust_n} N");
    Ok(())
}

#[test]
fn whatever_a_sensor_says_commands_are_numbers() -> Outcome<()> {
    let (stack, mut state) = (stack()?, StackState::default());
    fly(&stack, &mut state, 0..300);
    let output = stack.step(&mut state, &frame_with(300, Some(nonsense())));
    assert_eq!(output.rejected, 1);
    assert!(output.rotor_command.iter().all(|command| (0.0..=1.0).contains(command)));
    Ok(())
}
