//! The same logs explained for a vehicle of an eighth or eight times the mass: no size of the
//! workflow is one of 0.5 kg.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::fly_rich;
use squirrel_core::effects::Scale;
use squirrel_gap::{Kind, Value, Verdict, diagnose};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;
use toml_edit::{DocumentMut, Item, Table};

/// Fields that carry mass: with all of them times a factor, and lengths and times as they are, a
/// vehicle flies the same.
const HEAVY: [(&str, &[&str]); 4] = [
    ("mass", &["mass_kg", "inertia_kg_m2"]),
    ("propulsion", &["thrust_coefficient_n_s2", "torque_coefficient_n_m_s2"]),
    ("drag", &["linear_n_s_per_m", "area_m2"]),
    ("wing", &["area_per_side_m2"]),
];

/// The squirrel with flat wings and more text, every mass and force of it times a factor.
fn squirrel(factor: f64, effects: &str) -> VehicleFile {
    let text = VehicleFile::squirrel().text.replace("\"membrane\"", "\"flat\"");
    let mut file: DocumentMut = text.parse().unwrap();
    for (table, fields) in HEAVY {
        for field in fields {
            let number = file[table][field].as_inline_table_mut().unwrap();
            for key in ["value", "sd"] {
                let value = number.get_mut(key).unwrap();
                match value.as_array_mut() {
                    Some(array) => {
                        array.iter_mut().for_each(|x| *x = (x.as_float().unwrap() * factor).into());
                    }
                    None => *value = (value.as_float().unwrap() * factor).into(),
                }
            }
        }
    }
    // The learned part of a membrane is of one wing; a flat one has none.
    file["wing"].as_table_mut().unwrap().remove("parnn_weights");
    let limits = file["limits"].as_table_mut().unwrap();
    let thrust_n = limits["thrust_max_n"]["value"].as_float().unwrap();
    limits["thrust_max_n"]["value"] = (thrust_n * factor).into();
    let thrust_min_n = file["control"]["thrust_min_n"]["value"].as_float().unwrap();
    file["control"]["thrust_min_n"]["value"] = (thrust_min_n * factor).into();
    let more: DocumentMut = effects.parse().unwrap();
    let all = file.entry("effects").or_insert(Item::Table(Table::new())).as_table_mut().unwrap();
    for (name, effect) in more.as_table() {
        all.insert(name, effect.clone());
    }
    VehicleFile::parse(&file.to_string(), "squirrel").unwrap()
}

fn flown(effects: &str, seed: u64) -> (String, FlightLog) {
    fly_rich(&squirrel(1.0, effects), seed)
}

/// How a number of the verdict grows with the vehicle's mass where its lengths stay.
fn power(effect: &str, key: &str) -> i32 {
    let list = squirrel_core::effects::Effects::<f64>::parameters(effect).unwrap();
    let parameter = list.iter().find(|p| p.key == key).unwrap();
    let scale = parameter.range(&VehicleFile::squirrel().vehicle).map(|range| range.scale);
    i32::from(scale.is_some_and(|scale| scale != Scale::Fixed && scale != Scale::Arm))
}

/// Names, and the numbers of each with their ends.
fn said(verdict: &Verdict) -> Vec<(&'static str, &'static str, [f64; 3])> {
    let numbers = |effect: &squirrel_gap::NamedEffect| {
        let (name, all) = (effect.name, effect.parameters.clone());
        all.into_iter().filter_map(move |(key, value)| match value {
            Value::Number { value, low, high } => Some((name, key, [value, low, high])),
            Value::Choice { .. } => None,
        })
    };
    verdict.effects.iter().flat_map(numbers).collect()
}

fn same_answer(hidden: &str) {
    let flights = [flown(hidden, 3)];
    let held_out = [flown(hidden, 4)];
    let verdict = |factor: f64| {
        let vehicle = squirrel(factor, "");
        diagnose(&vehicle, &flights, &held_out, &|_| {}).unwrap().verdict
    };
    let own = verdict(1.0);
    println!("{}", own.words);
    // Whether a form is said to fit all of it depends on the noise of the flight; what is scaled
    // here is the answer.
    let patches = [Kind::Named, Kind::NamedFormDiffers, Kind::NamedIncomplete];
    assert!(patches.contains(&own.verdict), "{hidden}: {}", own.words);
    for factor in [0.125, 8.0] {
        let other = verdict(factor);
        assert_eq!(other.verdict, own.verdict, "{hidden} x {factor}: {}", other.words);
        let (own, other) = (said(&own), said(&other));
        assert_eq!(own.len(), other.len(), "{hidden} x {factor}");
        for ((name, key, own), (other_name, other_key, other)) in own.into_iter().zip(other) {
            assert_eq!((name, key), (other_name, other_key), "{hidden} x {factor}");
            let times = factor.powi(power(name, key));
            let width = (own[2] - own[1]) * times;
            for (own, other) in own.into_iter().zip(other) {
                let expected = own * times;
                let off = (other - expected).abs();
                // Jets of rotors do not scale with mass where lengths stay, and float beside it:
                // as far as a part of the interval.
                assert!(
                    off <= 1e-3 * expected.abs() + 0.05 * width,
                    "{name}.{key} x {factor}: {other}, not {expected}"
                );
            }
        }
    }
}

#[test]
fn forces_scale_with_the_vehicle() {
    same_answer("[linear_drag]\nextra_drag_n_s_per_m = 0.12\n[mass_error]\nmass_fraction = 0.1\n");
}

#[test]
fn moments_scale_with_the_vehicle() {
    same_answer("[angular_damping]\ndamping_n_m_s_per_rad = 0.012\n");
    same_answer("[cg_offset]\ncg_x_m = 0.006\ncg_y_m = 0.0\n");
}

#[test]
fn a_load_scales_with_the_vehicle() {
    same_answer("[payload_swing]\nmass_kg = 0.06\nlength_m = 0.5\n");
}
