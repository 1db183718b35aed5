//! What a batch refuses, in one line that says what and how much.

use super::support::Thrown;
use nalgebra::Vector3;
use squirrel_batch::{Batch, Scheme, Settings};
use squirrel_core::dynamics::State;
use squirrel_core::frames::In;

fn refused(count: usize, change: impl FnOnce(&mut Settings)) -> String {
    let mut settings = Settings::default();
    change(&mut settings);
    Batch::<f32>::new(&Thrown::new(count).vehicles, settings).unwrap_err().to_string()
}

#[test]
fn settings_that_cannot_work() {
    assert_eq!(refused(0, |_| {}), "vehicles: none given");
    assert_eq!(refused(1, |s| s.threads = 0), "threads = 0: must be at least 1");
    for (dt_s, text) in [(0.0, "0"), (-1.0, "-1"), (f64::NAN, "NaN"), (f64::INFINITY, "inf")] {
        assert_eq!(refused(1, |s| s.dt_s = dt_s), format!("dt_s = {text}: must be finite and > 0"));
    }
    let text = refused(1, |s| s.dt_s = 1e-60);
    assert!(text.ends_with("must be finite and > 0"), "nothing in f32: {text}");
    let text = refused(2, |s| s.dt_s = 0.5);
    assert!(
        text.starts_with("vehicles[0]: dt_s = 0.5 must be at most twice propulsion.time_constant_"),
        "{text}"
    );
    let vehicles = Thrown::<f32>::new(3).vehicles;
    let narrow = Batch::<f32, 2>::new(&vehicles, Settings::default()).unwrap_err();
    assert_eq!(narrow.to_string(), "vehicles[0]: 4 rotors, this batch holds 2 a vehicle");
}

#[test]
fn states_that_are_none() {
    let thrown = Thrown::<f32>::new(3);
    let mut batch = thrown.batch(Settings { scheme: Scheme::Euler, ..Settings::default() });
    let before = batch.state(1).unwrap();
    let mut state = State::at_rest();
    state.omega.vector.y = f32::NAN;
    assert_eq!(batch.reset(1, &state).unwrap_err().to_string(), "state of vehicle 1: not finite");
    let mut state = State::at_rest();
    state.attitude.w = 0.5;
    let text = batch.reset(1, &state).unwrap_err().to_string();
    assert_eq!(text, "attitude of vehicle 1: norm 0.5, must be 1 to within 1e-3");
    let text =
        batch.set_wind(2, In::new(Vector3::new(0.0, f32::INFINITY, 0.0))).unwrap_err().to_string();
    assert_eq!(text, "wind of vehicle 2: not finite");
    assert_eq!(batch.state(1).unwrap(), before, "what is refused changes nothing");
}

#[test]
fn shapes_that_do_not_fit() {
    let mut batch = Thrown::<f64>::new(3).batch(Settings::default());
    let text = "vehicle 3: the batch has 3";
    assert_eq!(batch.state(3).unwrap_err().to_string(), text);
    assert_eq!(batch.reset(3, &State::at_rest()).unwrap_err().to_string(), text);
    assert_eq!(
        batch.command(&[0.5; 11]).unwrap_err().to_string(),
        "commands: 11 numbers, must be 12"
    );
    assert_eq!(
        batch.write_states(&mut [0.0; 52]).unwrap_err().to_string(),
        "rows: 52 numbers, must be 51"
    );
}

/// As for a vehicle alone: a command is limited, and NaN asks for nothing.
#[test]
fn a_command_that_is_none_stops_the_rotor() {
    let thrown = Thrown::<f32>::new(2);
    let mut batch = thrown.batch(Settings::default());
    batch.command(&[f32::NAN, f32::INFINITY, -3.0, 0.5, 0.0, 1.0, 0.0, 0.5]).unwrap();
    for number in [0, 1] {
        batch.replace(number, &thrown.vehicles[0]).unwrap();
        batch.reset(number, &State::at_rest()).unwrap();
        batch.set_wind(number, In::zero()).unwrap();
    }
    batch.step(100);
    assert_eq!(batch.state(0).unwrap(), batch.state(1).unwrap());
    assert!(batch.state(0).unwrap().rotor_speed_rad_s[1] > 1000.0, "turns");
}
