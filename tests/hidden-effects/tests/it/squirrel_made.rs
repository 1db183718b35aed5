//! Cases that squirrel flies itself: they hold the same channels as the others, nothing more, and
//! stay in the air.

use hidden_effects::case::{Case, Generator, Set};
use hidden_effects::catalogue::CATALOGUE;
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;

fn names(log: &FlightLog) -> Vec<String> {
    let sources = log.sources.iter();
    sources
        .flat_map(|(source, s)| s.channels.keys().map(move |channel| format!("{source}.{channel}")))
        .collect()
}

/// A case of a set that squirrel flies.
fn case(set: Set, index: usize) -> Case {
    let case = Case::draw(set, index, 1);
    assert_eq!(case.answer.generator, Generator::Squirrel);
    case
}

#[test]
fn logs_hold_what_the_other_generator_logs() {
    let ours = case(Set::None, 1).flight(0).unwrap();
    let other = Case::draw(Set::None, 0, 1).flight(0).unwrap();
    assert_eq!(names(&ours), names(&other));
    assert!(ours.metadata.is_empty());
    let rate = |log: &FlightLog, name: &str| log.sources[name].time_s.len() as f64 / 40.0;
    for name in ours.sources.keys() {
        let ratio = rate(&ours, name) / rate(&other, name);
        assert!((ratio - 1.0).abs() < 0.02, "{name}: {ratio} times as often");
    }
}

#[test]
fn a_skewed_clock_does_not_show_in_the_stamps() {
    // Effect 27 of the catalogue is the clock's; the case flies at normal excitation.
    let skewed = case(Set::Normal, 27);
    assert_eq!(skewed.answer.effects[0].name, "clock_skew");
    let log = skewed.flight(0).unwrap();
    assert_eq!(log.sources["rotor"].time_s, log.sources["imu"].time_s);
    assert_eq!(log.sources["wing"].time_s, log.sources["imu"].time_s);
}

#[test]
fn without_an_effect_only_noise_and_tolerances_are_left() {
    for index in [1, 3, 5] {
        let case = case(Set::None, index);
        let vehicle = VehicleFile::parse(&case.nominal().to_toml(), "vehicle.toml").unwrap();
        let flights = [("flight".to_owned(), case.flight(1).unwrap())];
        let r = squirrel_gap::find(&vehicle, &flights).unwrap().residual;
        let floor = case.nominal().mass_kg * hidden_effects::independent::white::ACCEL_M_S2 * 0.283;
        for axis in 0..3 {
            let most = if axis == 2 { 4.0 } else { 1.8 };
            let ratio = r.force_body_rms_n[axis] / floor;
            assert!((0.9..most).contains(&ratio), "{index}, axis {axis}: {ratio} times the noise");
        }
    }
}

/// The largest loads and latencies are flown too: the height is held and nobody tumbles. A vehicle
/// that falls is drawn again, as the bench does it.
#[test]
fn every_effect_can_be_flown() {
    for index in (1..2 * CATALOGUE.len()).step_by(2) {
        let first = case(Set::Single, index);
        let again = (2..12).map(|seed| Case::draw(Set::Single, index, seed));
        let flown = std::iter::once(first)
            .chain(again)
            .find_map(|case| case.flight(0).ok().map(|log| (case, log)));
        let (case, log) = flown.unwrap_or_else(|| panic!("single effect {index} falls"));
        let (_, altitude) = log.channel("baro.altitude_m").unwrap();
        let lowest = altitude.values.iter().copied().fold(f64::MAX, f64::min);
        assert!(lowest > -1.0, "{:?}: {lowest} m", case.answer.effects);
    }
}
