//! The gap workflow as a user runs it: what goes wrong is one line and leaves nothing behind, what
//! is added leaves the rest of the vehicle file as it was, and the same flights give the same
//! bytes.

use super::support::{Folder, SQUIRREL, json};
use squirrel_log::FlightLog;
use std::fs;

/// The steps of the workflow.
const STEPS: [&str; 6] = ["check", "find", "name", "add", "shrink", "run"];

/// The shipped vehicle, and the one that flies: its rotors lag.
fn write_vehicles(folder: &Folder) {
    folder.write("squirrel.toml", SQUIRREL);
    let lag = "[effects.motor_lag]\nextra_time_constant_s = 0.035\n\n[limits]";
    folder.write("individual.toml", &SQUIRREL.replacen("[limits]", lag, 1));
}

/// Two flights to fit in `train`, one in `held-out`.
fn with_flights(name: &str) -> Folder {
    let folder = Folder::new(name);
    write_vehicles(&folder);
    for out in ["train", "held-out"] {
        fs::create_dir(folder.0.join(out)).unwrap();
    }
    for (out, seed) in [("train/a.mcap", "1"), ("train/b.mcap", "2"), ("held-out/c.mcap", "3")] {
        let flight =
            ["fly", "--vehicle", "individual.toml", "--arm", "pc", "--scenario", "excite_rich"];
        folder.succeeds(&[&flight[..], &["--seed", seed, "--out", out]].concat());
    }
    folder
}

const FLIGHTS: [&str; 6] =
    ["--vehicle", "squirrel.toml", "--flights", "train", "--held-out", "held-out"];

#[test]
fn what_cannot_be_read_is_one_line_and_leaves_nothing() {
    let folder = Folder::new("gap-unreadable");
    write_vehicles(&folder);
    folder.succeeds(&["fly", "--arm", "pc", "--scenario", "hover", "--out", "f.mcap"]);
    folder.succeeds(&[
        "fly",
        "--arm",
        "pc",
        "--scenario",
        "hover",
        "--seed",
        "2",
        "--out",
        "g.mcap",
    ]);
    let bytes = fs::read(folder.0.join("f.mcap")).unwrap();
    fs::write(folder.0.join("cut.mcap"), &bytes[..bytes.len() / 2]).unwrap();
    folder.write("empty.mcap", "");
    folder.write("text.mcap", "t,gx,gy,gz\n0,1,2,3\n");
    fs::create_dir(folder.0.join("no-flights")).unwrap();

    let whole = FlightLog::read(&folder.0.join("f.mcap")).unwrap();
    let mut nan = whole.clone();
    nan.sources
        .values_mut()
        .flat_map(|s| s.channels.values_mut())
        .for_each(|c| c.values.fill(f64::NAN));
    nan.write(&folder.0.join("nan.mcap")).unwrap();
    let mut six = whole.clone();
    let command = six.source_mut("rotor").channels.get_mut("command").unwrap();
    command.values = command.values.chunks(4).flat_map(|u| [u, &u[..2]].concat()).collect();
    command.width = 6;
    six.write(&folder.0.join("six.mcap")).unwrap();
    let mut deaf = whole;
    for source in ["imu", "gnss", "attitude"] {
        deaf.sources.remove(source);
    }
    deaf.write(&folder.0.join("deaf.mcap")).unwrap();

    let cases: [(&str, &[&str]); 8] = [
        ("cut.mcap", &["truncated", "import --recover"]),
        ("empty.mcap", &["empty"]),
        ("text.mcap", &[]),
        ("nowhere.mcap", &["No such file"]),
        ("no-flights", &["no .mcap file"]),
        ("nan.mcap", &["none of its", "usable numbers"]),
        ("six.mcap", &["rotor.command", "6 rotors", "squirrel has 4"]),
        ("deaf.mcap", &["imu.", "missing"]),
    ];
    for step in STEPS {
        for (flight, words) in cases {
            let words = [&[flight][..], words].concat();
            let arguments =
                ["gap", step, "--vehicle", "squirrel.toml", "--out", "out", "--json", "v.json"];
            let fit =
                [&arguments[..], &["--flights", flight, "f.mcap", "--held-out", "g.mcap"]].concat();
            folder.fails(&fit, &words);
            let unseen =
                [&arguments[..], &["--flights", "g.mcap", "f.mcap", "--held-out", flight]].concat();
            folder.fails(&unseen, &words);
        }
        let twice = ["gap", step, "--vehicle", "squirrel.toml", "--flights", "f.mcap", "f.mcap"];
        let twice = [&twice[..], &["--held-out", "g.mcap", "--out", "out"]].concat();
        folder.fails(&twice, &["f.mcap", "two flights have this name"]);
    }
}

#[test]
fn a_vehicle_file_that_will_not_do_is_one_line() {
    let folder = Folder::new("gap-vehicle");
    write_vehicles(&folder);
    folder.succeeds(&["fly", "--arm", "pc", "--scenario", "hover", "--out", "f.mcap"]);
    let without = SQUIRREL.replacen("value = 0.548, sd = 0.0011", "value = 0.548", 1);
    assert_ne!(without, SQUIRREL);
    folder.write("without.toml", &without);
    for step in ["name", "add", "run"] {
        let arguments =
            |vehicle| ["gap", step, "--vehicle", vehicle, "--flights", "f.mcap", "--out", "out"];
        folder.fails(&arguments("without.toml"), &["mass.mass_kg = 0.548", "no sd"]);
        folder.fails(&arguments("nowhere.toml"), &["nowhere.toml"]);
    }
    folder.fails(
        &["gap", "shrink", "--vehicle", "squirrel.toml", "--flights", "f.mcap", "--out", "out"],
        &["--held-out"],
    );
}

/// Problems are what `check` is to find: they are told, and it has done its work.
#[test]
fn check_says_what_flights_are_worth_and_run_begins_with_it() {
    let folder = Folder::new("gap-check");
    write_vehicles(&folder);
    for (seed, out) in [("1", "f.mcap"), ("2", "g.mcap")] {
        folder.succeeds(&[
            "fly",
            "--arm",
            "pc",
            "--scenario",
            "hover",
            "--seed",
            seed,
            "--out",
            out,
        ]);
    }
    let mut stuck = FlightLog::read(&folder.0.join("g.mcap")).unwrap();
    let imu = stuck.sources.get_mut("imu").unwrap();
    for channel in imu.channels.values_mut() {
        let (width, old) = (channel.width, channel.values.clone());
        for (i, x) in channel.values.iter_mut().enumerate() {
            *x = old[i / width / 9 * 9 * width + i % width];
        }
    }
    stuck.write(&folder.0.join("stuck.mcap")).unwrap();
    let flights = ["--vehicle", "squirrel.toml", "--flights", "f.mcap", "stuck.mcap"];
    let said = folder.succeeds(
        &[&["gap", "check"], &flights[..], &["--out", "out", "--json", "c.json"]].concat(),
    );
    for words in
        ["1 of 2 flights contradict", "set aside: stuck.mcap: imu.", "linear_drag", "what to fly"]
    {
        assert!(said.contains(words), "{words}: {said}");
    }
    let read = |file: &str| fs::read_to_string(folder.0.join(file)).unwrap();
    assert_eq!(read("c.json"), read("out/check.json"));
    assert!(read("out/check.html").contains("check-effects"));
    let found = json(&folder, "c.json");
    assert_eq!(found["flights"][1]["usable_s"], 0.0);
    folder.succeeds(&[&["gap", "run"], &flights[..], &["--out", "run"]].concat());
    assert!(read("run/report.html").contains("check-effects"));
    folder.fails(&[&["gap", "check"], &flights[..], &["--json", "f.mcap"]].concat(), &["f.mcap"]);
}

/// Good flights of the same machine: what could be shown is then what has changed since, and what is
/// wrong with them is said of them.
#[test]
fn check_with_good_flights_says_what_a_change_since_would_show() {
    let folder = Folder::new("gap-check-since");
    write_vehicles(&folder);
    for (seed, out) in [("1", "good.mcap"), ("2", "f.mcap")] {
        let flight = ["fly", "--arm", "pc", "--scenario", "excite_rich", "--seed", seed];
        folder.succeeds(&[&flight[..], &["--out", out]].concat());
    }
    let given = ["gap", "check", "--vehicle", "squirrel.toml", "--flights", "f.mcap"];
    let check = |more: &[&str]| folder.succeeds(&[&given[..], more].concat());
    check(&["--json", "alone.json"]);
    check(&["--baseline", "good.mcap", "--json", "since.json", "--out", "since"]);
    let [alone, since] = ["alone.json", "since.json"].map(|file| json(&folder, file));
    // A gyroscope's scale was as wrong in the good flights: half of it shows.
    let smallest = |found: &serde_json::Value| {
        let effects = found["effects"].as_array().unwrap();
        let scale = effects.iter().find(|effect| effect["name"] == "gyro_scale").unwrap();
        scale["numbers"][0]["smallest_shown"].as_f64().unwrap()
    };
    let [before, after] = [smallest(&alone), smallest(&since)];
    assert!(after < 0.7 * before, "{after} of {before}");
    assert!(folder.0.join("since/check.html").exists());
    folder.fails(&[&given[..], &["--baseline", "none.mcap"]].concat(), &["none.mcap"]);
    folder.fails(
        &[&given[..], &["--baseline", "good.mcap", "--json", "good.mcap"]].concat(),
        &["good.mcap"],
    );
}

/// The lines of a text stand in another one in their order.
fn holds_in_order(text: &str, lines: &str) -> bool {
    let mut left = text.lines();
    lines.lines().all(|line| left.any(|other| other == line))
}

#[test]
fn what_is_added_leaves_the_file_as_it_was() {
    let folder = with_flights("gap-add");
    let before = folder.files();
    let patch =
        folder.succeeds(&[&["gap", "add"], &FLIGHTS[..], &["--out", "out", "--dry-run"]].concat());
    assert!(!patch.contains("vehicle with"), "{patch}");
    for line in ["+ [effects.motor_lag]", "+ extra_time_constant_s = { value = "] {
        assert!(patch.contains(line), "`{line}` is not in:\n{patch}");
    }
    assert!(!patch.lines().any(|line| line.starts_with("- ")), "{patch}");
    assert_eq!(folder.files(), before, "a dry run writes nothing");

    let said = folder
        .succeeds(&[&["gap", "add"], &FLIGHTS[..], &["--out", "out", "--json", "v.json"]].concat());
    assert!(said.contains("vehicle with motor_lag: out/squirrel.toml"), "{said}");
    let patched = fs::read_to_string(folder.0.join("out/squirrel.toml")).unwrap();
    assert!(holds_in_order(&patched, SQUIRREL), "every line and comment stays in its place");
    let more = patched.lines().count() - SQUIRREL.lines().count();
    let added = patch.lines().filter(|line| line.starts_with("+ ")).count();
    assert!((added..added + 3).contains(&more), "{added} lines were shown, {more} were added");
    assert_eq!(fs::read_to_string(folder.0.join("squirrel.toml")).unwrap(), SQUIRREL);
    assert_eq!(json(&folder, "v.json")["model_patch"], "out/squirrel.toml");
    folder.succeeds(&["vehicle", "check", "out/squirrel.toml"]);

    // Another explanation is added by its name; one that none has is an error which says what there
    // is, and writes nothing.
    let verdict = json(&folder, "v.json");
    let other = verdict["alternatives"][0]["effects"][0].as_str().unwrap();
    folder.succeeds(
        &[&["gap", "add"], &FLIGHTS[..], &["--out", "other", "--effect", other]].concat(),
    );
    let chosen = fs::read_to_string(folder.0.join("other/squirrel.toml")).unwrap();
    assert!(chosen.contains(&format!("[effects.{other}]")), "{chosen}");
    let output = folder
        .run(&[&["gap", "add"], &FLIGHTS[..], &["--out", "never", "--effect", "gust"]].concat());
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{stderr}");
    let last = stderr.lines().last().unwrap();
    assert!(last.contains("no explanation of these flights has \"gust\"; they have: "), "{stderr}");
    assert!(last.contains("motor_lag"), "{stderr}");
    assert!(!folder.0.join("never").exists(), "nothing is written");

    // With it, the flights hold no gap any more. A verdict without a name is an answer, but no patch:
    // `add` fails with why, `run` says it.
    let none = [
        "--vehicle",
        "out/squirrel.toml",
        "--flights",
        "train",
        "--out",
        "more",
        "--json",
        "w.json",
    ];
    let why = "squirrel: nothing to add: no effect is above its tolerance";
    for dry_run in [&["--dry-run"][..], &[]] {
        let output = folder.run(&[&["gap", "add"], &none[..], dry_run].concat());
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert_eq!(stderr.lines().last(), Some(format!("error: {why}").as_str()), "{stderr}");
        assert_eq!(json(&folder, "w.json")["verdict"], "none");
    }
    let said = folder.succeeds(&[&["gap", "run"], &none[..]].concat());
    assert!(said.lines().any(|line| line == why), "{said}");
    assert!(!folder.0.join("more/squirrel.toml").exists(), "no patch");
}

/// An answer that does not account for all of it still has effects in it, whose numbers hold with
/// those that floated beside them.
#[test]
fn effects_are_shown_with_what_moved_beside_them() {
    let folder = Folder::new("gap-moved");
    let known = "value = [3.22e-3, 4.68e-3, 7.72e-3], sd = [3e-5, 5e-5, 8e-5]";
    let vague = "value = [32.2e-3, 46.8e-3, 77.2e-3], sd = [3e-2, 5e-2, 8e-2]";
    assert!(SQUIRREL.contains(known));
    folder.write("squirrel.toml", &SQUIRREL.replacen(known, vague, 1));
    folder.succeeds(&["fly", "--arm", "pc", "--scenario", "track", "--out", "f.mcap"]);
    let mut light = FlightLog::read(&folder.0.join("f.mcap")).unwrap();
    let force = light.source_mut("imu").channels.get_mut("specific_force_body_m_s2").unwrap();
    force.values.iter_mut().for_each(|f| *f *= 0.7);
    light.write(&folder.0.join("f.mcap")).unwrap();
    let shown = folder.succeeds(&[
        "gap",
        "name",
        "--vehicle",
        "squirrel.toml",
        "--flights",
        "f.mcap",
        "--json",
        "v.json",
    ]);
    let verdict = json(&folder, "v.json");
    assert_ne!(verdict["verdict"], "none");
    let moved = verdict["moved"].as_array().unwrap();
    assert!(moved.iter().any(|m| m["name"] == "inertia_error[x].inertia_fraction"), "{moved:?}");
    for number in moved {
        let [value, sd, tolerance] =
            ["value", "sd", "tolerance"].map(|key| number[key].as_f64().unwrap());
        assert!(value != 0.0 && sd > 0.0 && tolerance > 0.0, "{number}");
        assert!(shown.contains(number["name"].as_str().unwrap()), "{number} is not in:\n{shown}");
    }
    assert!(shown.contains("moved with them"), "{shown}");
}

#[test]
fn the_vehicle_file_is_never_overwritten() {
    let folder = with_flights("gap-overwrite");
    folder.fails(
        &[&["gap", "add"], &FLIGHTS[..], &["--out", "."]].concat(),
        &["squirrel.toml", "overwritten"],
    );
    assert_eq!(fs::read_to_string(folder.0.join("squirrel.toml")).unwrap(), SQUIRREL);
}

/// Known as one file before anything is read, by whatever path.
#[test]
fn a_flight_of_two_lists_is_refused() {
    let folder = Folder::new("gap-two-lists");
    write_vehicles(&folder);
    fs::create_dir(folder.0.join("good")).unwrap();
    folder.write("f.mcap", "is not read");
    folder.write("h.mcap", "neither is this one");
    fs::hard_link(folder.0.join("f.mcap"), folder.0.join("good/g.mcap")).unwrap();
    for step in STEPS {
        let gap = ["gap", step, "--vehicle", "squirrel.toml", "--out", "o", "--flights", "f.mcap"];
        for (given, list) in [
            (["--held-out", "f.mcap"], "--held-out f.mcap: is --flights f.mcap"),
            (["--held-out", "./f.mcap"], "--held-out ./f.mcap: is --flights f.mcap"),
            (["--baseline", "good"], "--baseline good/g.mcap: is --flights f.mcap"),
        ] {
            // Shrinking asks for them.
            let more = if list.starts_with("--b") { &["--held-out", "h.mcap"][..] } else { &[] };
            let words = [list, "a flight proves nothing about itself"];
            folder.fails(&[&gap[..], more, &given[..]].concat(), &words);
        }
    }
}

/// A patched vehicle file beside a verdict is taken for a part of it.
#[test]
fn a_patch_of_before_does_not_stay_beside_a_verdict_without_one() {
    let folder = Folder::new("gap-stale-patch");
    folder.write("v.toml", &SQUIRREL.replacen("parnn_weights", "# parnn_weights", 1));
    folder.succeeds(&["fly", "--scenario", "track", "--seed", "1", "--out", "f.mcap"]);
    fs::create_dir(folder.0.join("out")).unwrap();
    folder.write("out/v.toml", SQUIRREL);
    let given = ["--vehicle", "v.toml", "--flights", "f.mcap", "--out"];
    for step in ["add", "run"] {
        let gap = [&["gap", step], &given[..]].concat();
        // Nobody knows whose it is.
        folder.fails(&[&gap[..], &["out"]].concat(), &["out/v.toml", "not of an earlier run"]);
        for no_folder in ["f.mcap", "f.mcap/out"] {
            folder.fails(&[&gap[..], &[no_folder]].concat(), &["f.mcap: is a file, must be a"]);
        }
    }
    let patch = r#"extra_time_constant_s = { value = 0.01, source = "gap: f.mcap" }"#;
    folder.write("out/v.toml", &format!("{SQUIRREL}\n[effects.motor_lag]\n{patch}\n"));
    folder.succeeds(&[&["gap", "run"], &given[..], &["out"]].concat());
    assert!(json(&folder, "out/verdict.json")["model_patch"].is_null());
    assert!(!folder.0.join("out/v.toml").exists());
}

#[test]
fn the_same_flights_give_the_same_bytes() {
    let made = |name| {
        let folder = with_flights(name);
        folder.succeeds(
            &[&["gap", "run"], &FLIGHTS[..], &["--out", "out", "--json", "v.json"]].concat(),
        );
        let files: Vec<String> = fs::read_dir(folder.0.join("out"))
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        assert!(
            ["squirrel.toml", "verdict.json"]
                .iter()
                .all(|file| files.contains(&(*file).to_owned()))
        );
        let mut all: Vec<_> = files
            .iter()
            .map(|file| (file.clone(), fs::read(folder.0.join("out").join(file)).unwrap()))
            .collect();
        all.sort();
        assert_eq!(
            fs::read(folder.0.join("v.json")).unwrap(),
            fs::read(folder.0.join("out/verdict.json")).unwrap()
        );
        all
    };
    let (first, second) = (made("gap-twice-a"), made("gap-twice-b"));
    for ((file, a), (other, b)) in first.iter().zip(&second) {
        assert_eq!(file, other);
        assert!(a == b, "{file} differs between two runs");
        let text = String::from_utf8_lossy(a);
        assert!(!text.contains(env!("CARGO_TARGET_TMPDIR")), "{file} holds a path of this machine");
    }
    assert_eq!(first.len(), second.len());
}

/// Under the controller that flew it, the simulated drone goes where the measured one went once the
/// name is in the file; a flight of another autopilot cannot be flown again, and a note says so.
#[test]
fn held_out_flights_are_flown_again_in_closed_loop() {
    let folder = with_flights("gap-closed-loop");
    let flight =
        ["fly", "--vehicle", "individual.toml", "--arm", "pc", "--scenario", "excite_rich"];
    folder.succeeds(&[&flight[..], &["--seed", "4", "--out", "d.mcap"]].concat());
    let mut foreign = FlightLog::read(&folder.0.join("d.mcap")).unwrap();
    foreign.metadata.clear();
    foreign.write(&folder.0.join("held-out/d.mcap")).unwrap();
    folder.succeeds(&[&["gap", "shrink"], &FLIGHTS[..], &["--json", "v.json"]].concat());
    let verdict = json(&folder, "v.json");
    let flown = verdict["closed_loop"].as_array().unwrap();
    assert_eq!(flown.len(), 1, "{flown:?}");
    assert_eq!(flown[0]["flight"], "held-out/c.mcap");
    let norm = |key: &str| {
        let axes = flown[0][key].as_array().unwrap();
        axes.iter().map(|x| x.as_f64().unwrap().powi(2)).sum::<f64>().sqrt()
    };
    assert!(norm("after_ned_m") < 0.2 * norm("before_ned_m"), "{flown:?}");
    let notes = verdict["notes"].as_array().unwrap();
    let said = |note: &serde_json::Value| {
        note.as_str().unwrap().starts_with("held-out/d.mcap: not flown again")
    };
    assert!(notes.iter().any(said), "{notes:?}");
}
