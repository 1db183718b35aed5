//! Vehicle files from nothing to another simulator.

use crate::support::{Folder, SQUIRREL, json};

const NEW: [&str; 8] =
    ["vehicle", "new", "--frame", "quad-x", "--mass-kg", "0.6", "--propeller-inch", "5"];

fn new(folder: &Folder, more: &[&str]) -> String {
    folder.succeeds(&[&NEW[..], more].concat())
}

#[test]
fn a_first_file_is_checked_and_flown() {
    let folder = Folder::new("vehicle_new");
    let printed = new(&folder, &["--cells", "4", "--out", "mine.toml", "--json", "new.json"]);
    assert!(printed.contains("numbers are guessed"), "{printed}");
    let told = json(&folder, "new.json");
    assert_eq!(told["vehicle"], "mine");
    assert!(told["means"]["thrust_to_weight"].as_f64().unwrap() > 2.0);
    let guessed = told["guessed"].as_array().unwrap();
    assert!(guessed.iter().any(|field| field == "propulsion.thrust_coefficient_n_s2"));
    assert!(!guessed.iter().any(|field| field == "mass.mass_kg"));
    // What is guessed and can be fitted says how far it may be off.
    for field in guessed.iter().map(|field| field.as_str().unwrap()) {
        let number = &told["numbers"][field];
        let usual = ["battery.r0_ohm", "battery.r1_ohm"].contains(&field);
        assert!(usual || number["sd"].is_string(), "{field}: {number}");
    }
    folder.succeeds(&["vehicle", "check", "mine.toml"]);
    folder.succeeds(&[
        "fly",
        "--vehicle",
        "mine.toml",
        "--scenario",
        "hover",
        "--seed",
        "1",
        "--out",
        "hover.mcap",
    ]);
    // A hover of its own says what the file says already.
    folder.succeeds(&[
        "vehicle",
        "fit",
        "mine.toml",
        "--hover",
        "hover.mcap",
        "--out",
        "fitted.toml",
    ]);
    folder.succeeds(&["vehicle", "diff", "mine.toml", "fitted.toml", "--json", "diff.json"]);
    let told = json(&folder, "diff.json");
    let of = |which: &str| told[which]["hover_command"].as_f64().unwrap();
    assert!((of("b") / of("a") - 1.0).abs() < 0.02, "{told}");
    assert!(
        told["numbers"].as_array().unwrap().iter().any(|n| n["field"] == "limits.thrust_max_n")
    );
}

#[test]
fn what_is_missing_is_wrong_usage_and_what_cannot_be_fails() {
    let folder = Folder::new("vehicle_new_errors");
    let output = folder.run(&["vehicle", "new", "--frame", "quad-x", "--out", "x.toml"]);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(stderr.contains("missing: --mass-kg, --propeller-inch"), "{stderr}");
    assert_eq!(folder.run(&["vehicle", "fit", "x.toml", "--out", "y.toml"]).status.code(), Some(2));
    let bad = ["vehicle", "new", "--frame", "quad-x", "--mass-kg", "-1", "--propeller-inch", "5"];
    folder.fails(&[&bad[..], &["--out", "x.toml"]].concat(), &["mass_kg = -1"]);
    folder.write("no.ulg", "no log");
    folder.fails(
        &[&NEW[..], &["--from", "no.ulg", "--out", "x.toml"]].concat(),
        &["no.ulg", "not those of a ULog"],
    );
    folder.write("bench.csv", "thrust_n,command\n1,x\n");
    folder.write("squirrel.toml", SQUIRREL);
    folder.fails(
        &["vehicle", "fit", "squirrel.toml", "--bench", "bench.csv", "--out", "y.toml"],
        &["bench.csv, line 2: command = x"],
    );
    folder.fails(
        &["vehicle", "export", "squirrel.toml", "--to", "mjcf", "--out", "squirrel.toml"],
        &["would be written over"],
    );
}

#[test]
fn what_an_export_loses_is_said() {
    let folder = Folder::new("vehicle_export");
    folder.write(
        "a.toml",
        &format!("{SQUIRREL}\n[effects.weak_rotor]\nrotor = 1\nthrust_loss_fraction = 0.1\n"),
    );
    for target in ["sdf", "ardupilot-json", "px4-params", "mjcf", "rotorpy", "crazyflow"] {
        let output = folder.run(&[
            "vehicle",
            "export",
            "a.toml",
            "--to",
            target,
            "--out",
            target,
            "--json",
            "told.json",
        ]);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{stderr}");
        let told = json(&folder, "told.json");
        assert_eq!(told["target"], target);
        let lost = told["lost"].as_array().unwrap();
        assert_eq!(stderr.lines().count(), lost.len(), "{stderr}");
        let weak = lost.iter().find(|lost| lost["what"] == "effects.weak_rotor");
        let alike = ["ardupilot-json", "px4-params", "rotorpy"].contains(&target);
        assert_eq!(weak.is_some(), alike, "{target}");
        let moment = told["remains"]["hover"]["moment_n_m"].as_f64().unwrap();
        assert_eq!(moment > 1e-6, alike, "{target}: {moment}");
        if let Some(weak) = weak {
            assert!(weak["size"][0]["force_n"].as_f64().unwrap() > 0.1, "{weak}");
        }
    }
    folder.fails(&["vehicle", "export", "b.toml", "--to", "mjcf", "--out", "x"], &["b.toml"]);
}

/// Numbers of which each may be and that make no flight together: the check says what a flight
/// would, and both say of which file.
#[test]
fn what_does_not_fly_is_not_called_sound() {
    let folder = Folder::new("unsound");
    for (from, to, field) in [
        ("[0.276, 0.373, 0.025]", "[1e155, 0.373, 0.025]", "size_body_m[0] = 1000"),
        ("value = 6.6e-9", "value = 1e12", "wrench.force_body_n[0] = NaN: must be finite"),
    ] {
        assert!(SQUIRREL.contains(from));
        folder.write("v.toml", &SQUIRREL.replacen(from, to, 1));
        folder.fails(&["vehicle", "check", "v.toml"], &["error: v.toml: ", field]);
        let fly = ["fly", "--scenario", "hover", "--arm", "pc", "--vehicle", "v.toml"];
        folder.fails(&fly, &["error: v.toml: ", field]);
    }
}

/// What a number is known to is a number, too.
#[test]
fn a_tolerance_that_cannot_be_is_refused_where_the_file_is_read() {
    let folder = Folder::new("vehicle_sd");
    let (mass, inertia) = ("sd = 0.0011", "sd = [3e-5, 5e-5, 8e-5]");
    for (from, to, words) in [
        (mass, "sd = -0.1", "mass.mass_kg.sd = -0.1: must be finite, >= 0"),
        (mass, "sd = nan", "mass.mass_kg.sd = nan"),
        (mass, "sd = inf", "mass.mass_kg.sd = inf"),
        (mass, "sd = 1e308", "mass.mass_kg.sd = 1"),
        (mass, "sd = [0.1]", "mass.mass_kg.sd = [0.1]: must be one number"),
        (mass, "low = nan", "mass.mass_kg.low = nan: must be finite"),
        (mass, "high = -inf", "mass.mass_kg.high = -inf: must be finite"),
        (mass, "low = 2.0, high = 1.5", "low = 2.0: must be at most mass.mass_kg.high = 1.5"),
        (inertia, "sd = [3e-5, -1, 8e-5]", "mass.inertia_kg_m2.sd = "),
        (inertia, "sd = [3e-5, 5e-5]", "as many as the value has"),
        ("sd = [8.5e-4, ", "sd = [-8.5e-4, ", "rotor[0].position_body_m.sd = "),
    ] {
        assert!(SQUIRREL.contains(from));
        folder.write("v.toml", &SQUIRREL.replacen(from, to, 1));
        folder.fails(&["vehicle", "check", "v.toml"], &["error: v.toml: ", words]);
    }
    for (from, to) in [
        (mass, "sd = 0"),
        (mass, "low = 0.5, high = 1"),
        (inertia, "sd = 3e-5"),
        (
            "value = [3.22e-3, 4.68e-3, 7.72e-3]",
            "value = [[3e-3, 0, 0], [0, 4e-3, 0], [0, 0, 6e-3]]",
        ),
    ] {
        assert!(SQUIRREL.contains(from));
        folder.write("v.toml", &SQUIRREL.replacen(from, to, 1));
        folder.succeeds(&["vehicle", "check", "v.toml"]);
    }
}
