//! The practice cases: flights of another simulator, each with something hidden in it.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{imported, shared, vehicle};
use squirrel_gap::find::{CHANNELS, find};

/// The channel in which each effect shows most, for effects that the cases hide.
fn channel_of(effect: &str) -> Option<&'static str> {
    match effect {
        "motor_lag" | "weak_rotor" => Some("moment_body_y_n_m"),
        "linear_drag" => Some("force_body_x_n"),
        // A late velocity is a wrong angle of attack.
        "battery_sag" | "wing_membrane" | "gnss_latency" => Some("force_body_z_n"),
        _ => None,
    }
}

/// What a case hides.
struct Answer {
    case: String,
    verdict: String,
    excitation: String,
    effects: Vec<String>,
}

fn answers() -> Option<Vec<Answer>> {
    let text = std::fs::read_to_string(shared("gap-practice")?.join("answers.json")).unwrap();
    let answers: serde_json::Value = serde_json::from_str(&text).unwrap();
    let text = |c: &serde_json::Value, key: &str| c[key].as_str().unwrap().to_owned();
    let all = answers.as_object().unwrap().iter().map(|(case, c)| Answer {
        case: case.clone(),
        verdict: text(c, "verdict"),
        excitation: text(c, "excitation"),
        effects: c["effects"].as_object().map_or_else(Vec::new, |e| e.keys().cloned().collect()),
    });
    Some(all.collect())
}

/// Residual of the case in which nothing is hidden.
fn floor(answers: &[Answer]) -> [f64; 6] {
    residual(&answers.iter().find(|a| a.verdict == "none").unwrap().case).unwrap()
}

fn residual(case: &str) -> Option<[f64; 6]> {
    let flight = shared("gap-practice/cases")?.join(case).join("train/flight00");
    let finding =
        find(&vehicle("practice.toml"), &[(case.to_owned(), imported("practice.toml", &flight))]).unwrap();
    let r = finding.residual;
    let ([fx, fy, fz], [mx, my, mz]) = (r.force_body_rms_n, r.moment_body_rms_n_m);
    assert!(r.per_flight[case].duration_s > 39.0 && finding.notes.is_empty());
    Some([fx, fy, fz, mx, my, mz])
}

/// Channels are compared in units of the case with nothing hidden. That case is not the least in every one of them: the
/// nominal numbers are off by their tolerances in each case, and an arm that is off by half a millimetre is a steady
/// moment.
#[test]
fn what_is_hidden_shows_in_its_channel() {
    let Some(answers) = answers() else { return };
    let nothing = floor(&answers);
    let mut seen = 0;
    for Answer { case, excitation, effects, .. } in &answers {
        let Some(channel) = effects.iter().find_map(|e| channel_of(e)) else { continue };
        assert_ne!(excitation, "calm");
        let residual = residual(case).unwrap();
        let ratio: Vec<f64> = residual.iter().zip(nothing).map(|(r, floor)| r / floor).collect();
        let worst = (0..6).max_by(|a, b| ratio[*a].total_cmp(&ratio[*b])).unwrap();
        println!("{case} {residual:.5?}, over nothing hidden {ratio:.2?}: {effects:?}");
        assert_eq!(CHANNELS[worst], channel, "{case}: {effects:?}");
        assert!(ratio[worst] > 1.4, "{case}: {effects:?}");
        seen += 1;
    }
    assert!(seen >= 6, "only {seen} cases were looked at");
}

/// A calm flight hides its effect: its residual is near that of nothing hidden, never far above.
#[test]
fn a_calm_flight_hides_its_effect() {
    let Some(answers) = answers() else { return };
    let nothing = floor(&answers);
    for Answer { case, .. } in answers.iter().filter(|a| a.excitation == "calm") {
        let calm = residual(case).unwrap();
        assert!(calm.iter().zip(nothing).all(|(calm, floor)| *calm < 1.4 * floor), "{case}: {calm:.5?}");
    }
}
