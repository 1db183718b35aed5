//! Flights of the simulator in `tests/hidden-effects`, which shares no dynamics with ours, each
//! with something hidden in it: what `find` shows of it, and the verdict of the whole workflow.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use hidden_effects::case::{Answer, Case, Generator, Set};
use hidden_effects::catalogue::{self, HiddenEffect};
use hidden_effects::independent::Excitation;
use hidden_effects::outside::Outside;
use squirrel_gap::find::{CHANNELS, find};
use squirrel_gap::{Kind, NamedEffect, Value, Verdict, diagnose};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;
use std::collections::BTreeSet;

/// Largest error of a parameter.
const ERROR_MAX: f64 = 0.1;

pub(crate) type Flights = Vec<(String, FlightLog)>;

/// An effect, its form, and its numbers by key.
type Hidden<'a> = (&'a str, &'a str, &'a [(&'a str, f64)]);

/// A case of the other simulator that hides nothing.
pub(crate) fn nothing() -> Case {
    let case = Case::draw(Set::None, 0, 2);
    assert_eq!((case.answer.generator, case.nominal().rotors.len()), (Generator::Independent, 4));
    case
}

/// The vehicle as its file has it, two flights to fit and one held out.
pub(crate) fn flown(case: &Case) -> (VehicleFile, Flights, Flights) {
    let flight =
        |number: usize| (case.flight_names()[number].to_owned(), case.flight(number).unwrap());
    let vehicle = VehicleFile::parse(&case.vehicle_toml(), "vehicle").unwrap();
    (vehicle, vec![flight(0), flight(1)], vec![flight(2)])
}

fn hiding(effects: &[Hidden<'_>]) -> Case {
    let effect = |(name, form, parameters): &Hidden<'_>| HiddenEffect {
        name: (*name).to_owned(),
        form: (*form).to_owned(),
        parameters: parameters
            .iter()
            .map(|(key, x)| ((*key).to_owned(), catalogue::Value::Number(*x)))
            .collect(),
    };
    nothing().hiding(effects.iter().map(effect).collect(), None)
}

fn excited(mut case: Case, excitation: Excitation) -> Case {
    case.answer.excitation = excitation;
    case
}

/// Effects of the rotors, the air, the wings and the sensors, alone and in a pair, in other forms,
/// excited more and less.
fn cases() -> Vec<Case> {
    let lost = Outside::MassLost { mass_fraction: 0.19, at_s: 19.0 };
    vec![
        nothing(),
        nothing().hiding(vec![], Some(lost)),
        excited(
            hiding(&[("ground_effect", "standard", &[("effective_radius_m", 0.4)])]),
            Excitation::Calm,
        ),
        hiding(&[("motor_lag", "standard", &[("extra_time_constant_s", 0.053)])]),
        excited(
            hiding(&[("gnss_latency", "standard", &[("latency_s", 0.31)])]),
            Excitation::Normal,
        ),
        hiding(&[("battery_sag", "standard", &[("voltage_exponent", 0.91)])]),
        hiding(&[
            ("weak_rotor", "standard", &[("rotor", 3.0), ("thrust_loss_fraction", 0.052)]),
            ("translational_lift", "standard", &[("gain_s2_per_m2", 1.13e-3)]),
        ]),
        hiding(&[("linear_drag", "anisotropic", &[("extra_drag_n_s_per_m", 0.18)])]),
        hiding(&[(
            "wing_membrane",
            "speed_dependent",
            &[("gain", -0.22), ("angle_of_attack_offset_rad", 0.036)],
        )]),
    ]
}

/// The channels in one of which each effect shows most, for effects that the cases hide.
fn channels_of(effect: &str) -> Option<&'static [&'static str]> {
    match effect {
        // Whichever is more, the layout and the manoeuvres decide.
        "motor_lag" | "weak_rotor" => Some(&["moment_body_x_n_m", "moment_body_y_n_m"]),
        "linear_drag" => Some(&["force_body_x_n"]),
        "battery_sag" | "wing_membrane" => Some(&["force_body_z_n"]),
        // A late velocity is a wrong drag and a wrong angle of attack.
        "gnss_latency" => Some(&["force_body_x_n", "force_body_y_n", "force_body_z_n"]),
        _ => None,
    }
}

fn residual(case: &Case) -> [f64; 6] {
    let vehicle = VehicleFile::parse(&case.vehicle_toml(), "vehicle").unwrap();
    let finding = find(&vehicle, &[("flight".to_owned(), case.flight(0).unwrap())]).unwrap();
    let r = finding.residual;
    assert!(r.per_flight["flight"].duration_s > 39.0 && finding.notes.is_empty());
    let ([fx, fy, fz], [mx, my, mz]) = (r.force_body_rms_n, r.moment_body_rms_n_m);
    [fx, fy, fz, mx, my, mz]
}

/// Channels are compared in units of a rich flight of the same vehicle with nothing hidden.
#[test]
fn what_is_hidden_shows_in_its_channel() {
    let nothing = residual(&nothing());
    let mut seen = 0;
    for case in cases() {
        let Answer { effects, excitation, .. } = &case.answer;
        let Some(channels) = effects.iter().find_map(|effect| channels_of(&effect.name)) else {
            continue;
        };
        assert_ne!(*excitation, Excitation::Calm);
        let ratio: Vec<f64> =
            residual(&case).iter().zip(nothing).map(|(r, floor)| r / floor).collect();
        let worst = (0..6).max_by(|a, b| ratio[*a].total_cmp(&ratio[*b])).unwrap();
        println!("over nothing hidden {ratio:.2?}: {effects:?}");
        assert!(channels.contains(&CHANNELS[worst]), "{ratio:.2?}: {effects:?}");
        assert!(ratio[worst] > 1.4, "{ratio:.2?}: {effects:?}");
        seen += 1;
    }
    assert_eq!(seen, 6);
}

/// A calm flight hides its effect: its residual is near that of nothing hidden, never far above.
#[test]
fn a_calm_flight_hides_its_effect() {
    let nothing = residual(&nothing());
    for case in cases().iter().filter(|case| case.answer.excitation == Excitation::Calm) {
        let calm = residual(case);
        assert!(calm.iter().zip(nothing).all(|(calm, floor)| *calm < 1.4 * floor), "{calm:.5?}");
    }
}

/// What is wrong with a verdict; `None` if nothing is.
fn complaint(answer: &Answer, verdict: &Verdict) -> Option<String> {
    let other_form = answer.effects.iter().any(|effect| effect.form != "standard");
    let right = match answer.excitation {
        _ if answer.outside.is_some() => &[Kind::OutsideCatalogue][..],
        _ if answer.effects.is_empty() => &[Kind::None],
        _ if other_form => &[Kind::Named, Kind::NamedFormDiffers],
        // Nobody sees the ground from far above it.
        Excitation::Calm => &[Kind::Named, Kind::NotIdentifiable],
        _ => &[Kind::Named],
    };
    if !right.contains(&verdict.verdict) {
        return Some(format!("the verdict must be one of {right:?}"));
    }
    if !matches!(verdict.verdict, Kind::Named | Kind::NamedFormDiffers) {
        return None;
    }
    let names: BTreeSet<&str> = verdict.effects.iter().map(|effect| effect.name).collect();
    let hidden: BTreeSet<&str> = answer.effects.iter().map(|effect| effect.name.as_str()).collect();
    if names != hidden {
        return Some(format!("names {names:?}, hidden are {hidden:?}"));
    }
    let wrong = |hidden: &HiddenEffect| {
        wrong_parameter(hidden, verdict.effects.iter().find(|effect| effect.name == hidden.name)?)
    };
    if other_form { None } else { answer.effects.iter().find_map(wrong) }
}

fn wrong_parameter(hidden: &HiddenEffect, found: &NamedEffect) -> Option<String> {
    hidden.parameters.keys().find_map(|key| {
        let truth = hidden.number(key);
        let Some(Value::Number { value, .. }) = found.parameters.get(key.as_str()) else {
            return Some(format!("{}.{key}: missing", found.name));
        };
        let off = (value / truth - 1.0).abs();
        (off > ERROR_MAX).then(|| format!("{}.{key}: {value}, hidden is {truth}", found.name))
    })
}

#[test]
fn every_case_gets_its_verdict() {
    let mut wrong = Vec::new();
    for case in cases() {
        let (vehicle, flights, held_out) = flown(&case);
        let verdict = diagnose(&vehicle, &flights, &held_out, &|_| {}).unwrap().verdict;
        let hidden = format!("{:?} {:?}", case.answer.effects, case.answer.outside);
        println!("{hidden}\n  {:?}: {}", verdict.verdict, verdict.words);
        if let Some(complaint) = complaint(&case.answer, &verdict) {
            wrong.push(format!("{hidden}: {:?}: {complaint}", verdict.verdict));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
