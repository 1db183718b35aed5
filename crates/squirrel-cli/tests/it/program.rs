//! The program as a user runs it: exit codes, files, one clear line where something is wrong.

use super::support::{Folder, MAP, SQUIRREL, json};
use squirrel_core::policy::Policy;
use squirrel_log::FlightLog;
use squirrel_sim::weights::PolicyWeights;
use std::fs;
use std::process::Command;

const SQUIRREL_PROGRAM: &str = env!("CARGO_BIN_EXE_squirrel");

/// What the README shows of it is what it says, and it opens nothing: files are all that is left.
#[test]
fn without_arguments_it_flies_the_demo() {
    let folder = Folder::new("demo");
    let output = folder.run(&[]);
    let text = |bytes| String::from_utf8(bytes).unwrap();
    let (table, talk) = (text(output.stdout), text(output.stderr));
    assert!(output.status.success(), "{talk}");
    let readme = include_str!("../../../../README.md");
    let shown = readme.split("```console\n$ squirrel\n").nth(1).and_then(|r| r.split("```").next());
    assert_eq!(
        shown.unwrap().trim_end(),
        format!("{table}{talk}").replace(SQUIRREL_PROGRAM, "squirrel").trim_end()
    );
    let mut files: Vec<String> = fs::read_dir(folder.0.join("squirrel-demo"))
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    files.sort();
    assert_eq!(
        files,
        [
            "flight-pc.mcap",
            "flight-pc_plus.mcap",
            "flight-twcc_flat.mcap",
            "flight-twcc_plus.mcap",
            "report.html"
        ]
    );
    let report = fs::read_to_string(folder.0.join("squirrel-demo/report.html")).unwrap();
    assert!(report.contains("<svg") && report.contains("twcc_plus"));
    for outside in ["src=\"http", "href=\"http", "url(http", "@import", "<link"] {
        assert!(!report.contains(outside), "the report reaches outside: {outside}");
    }
}

/// The arm that we recommend misses the trunk on any seed; the one with folded wings of the paper
/// hits it, so that there is something to see.
#[test]
fn in_the_demo_ours_passes_the_trunk_and_the_conventional_controller_does_not() {
    let folder = Folder::new("trunk");
    for seed in 1..=6 {
        folder.succeeds(&["--seed", &seed.to_string(), "--json", "figures.json"]);
        let figures = json(&folder, "figures.json");
        let arm = |name: &str| {
            let arms = figures["arms"].as_array().unwrap();
            arms.iter().find(|arm| arm["arm"] == name).unwrap().clone()
        };
        assert!(arm("pc")["contact_s"].is_f64(), "seed {seed}: {}", arm("pc"));
        let ours = arm("twcc_plus");
        assert!(ours["contact_s"].is_null(), "seed {seed}: {ours}");
        // Half of the vehicle's diagonal is 0.23 m.
        assert!(ours["clearance_m"].as_f64().unwrap() > 0.3, "seed {seed}: {ours}");
    }
}

/// The three commands that it ends with run as they stand.
#[test]
fn the_demo_ends_with_commands_that_work() {
    let folder = Folder::new("next");
    let output = folder.run(&["--out", "my demo"]);
    let talk = String::from_utf8(output.stderr).unwrap();
    let next: Vec<&str> = talk.lines().filter_map(|line| line.strip_prefix("  ")).collect();
    assert_eq!(next.len(), 3, "{talk}");
    for line in next {
        let done = Command::new("sh").args(["-c", line]).current_dir(&folder.0).output().unwrap();
        assert!(done.status.success(), "{line}: {}", String::from_utf8_lossy(&done.stderr));
    }
    for file in ["view.html", "forest.html", "forest.mcap", "mine.toml"] {
        assert!(folder.0.join(file).is_file(), "{file} is not in {:?}", folder.files());
    }
}

/// No command is the demo, with all of its options; an option before another command belongs to
/// nobody.
#[test]
fn the_options_of_the_demo_are_those_of_the_program() {
    let folder = Folder::new("options");
    for (command, out) in [(&["demo"][..], "a"), (&[], "b")] {
        let options = ["--out", out, "--seed", "3", "--json", &format!("{out}.json")];
        folder.succeeds(&[command, &options].concat());
    }
    for [a, b] in [["a.json", "b.json"], ["a/report.html", "b/report.html"]] {
        assert!(
            fs::read(folder.0.join(a)).unwrap() == fs::read(folder.0.join(b)).unwrap(),
            "{a} and {b} differ"
        );
    }
    assert_eq!(json(&folder, "b.json")["seed"], 3);
    let help = folder.succeeds(&["--help"]);
    for words in
        ["squirrel [OPTIONS]", "squirrel <COMMAND>", "Options of the demo", "--json <JSON>"]
    {
        assert!(help.contains(words), "`{words}` is not in:\n{help}");
    }
    assert_eq!(folder.run(&["--json", "c.json", "fly"]).status.code(), Some(2));
    assert_eq!(folder.files(), ["a", "a.json", "b", "b.json"]);
}

#[test]
fn the_demo_is_the_same_bytes_twice_and_replays() {
    let folder = Folder::new("twice");
    let figures = |out: &str| {
        folder.succeeds(&["demo", "--out", out, "--seed", "3", "--json", &format!("{out}.json")]);
        ["report.html", "flight-pc.mcap", "flight-twcc_flat.mcap"]
            .map(|f| fs::read(folder.0.join(out).join(f)).unwrap())
    };
    assert!(figures("a") == figures("b"), "two runs differ");
    assert_eq!(json(&folder, "a.json"), json(&folder, "b.json"));
    let line = folder.succeeds(&["replay", "a/flight-twcc_flat.mcap", "--json", "replay.json"]);
    assert!(line.contains("every bit identical"), "{line}");
    assert_eq!(json(&folder, "replay.json")["identical"], true);
}

#[test]
fn replay_names_the_first_output_of_a_changed_gain_and_a_flipped_byte() {
    let folder = Folder::new("replay");
    folder.succeeds(&["fly", "--arm", "pc", "--scenario", "hover", "--out", "f.mcap"]);
    folder.write(
        "v.toml",
        &SQUIRREL.replace("c2_per_s = { value = [7.9", "c2_per_s = { value = [8.4"),
    );
    folder.fails(
        &["replay", "f.mcap", "--vehicle", "v.toml"],
        &["f.mcap", "control.inner.", "is the first output"],
    );
    let mut bytes = fs::read(folder.0.join("f.mcap")).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    fs::write(folder.0.join("f.mcap"), bytes).unwrap();
    folder.fails(&["replay", "f.mcap"], &["f.mcap", "CRC"]);
}

#[test]
fn a_truncated_log_says_what_is_whole_and_can_be_recovered() {
    let folder = Folder::new("truncated");
    folder.succeeds(&["fly", "--arm", "pc", "--scenario", "hover", "--out", "f.mcap"]);
    let bytes = fs::read(folder.0.join("f.mcap")).unwrap();
    fs::write(folder.0.join("cut.mcap"), &bytes[..bytes.len() * 2 / 3]).unwrap();
    folder.fails(&["replay", "cut.mcap"], &["cut.mcap", "truncated", "s of flight"]);
    let said = folder.succeeds(&["import", "--recover", "cut.mcap", "--out", "whole.mcap"]);
    assert!(said.contains("bytes are whole"), "{said}");
    assert!(folder.succeeds(&["replay", "whole.mcap"]).contains("every bit identical"));
}

#[test]
fn fly_writes_log_report_and_figures() {
    let folder = Folder::new("fly");
    let arguments = [
        "fly",
        "--arm",
        "twcc_flat",
        "--scenario",
        "avoid",
        "--seed",
        "2",
        "--thrust-to-weight",
        "1.3",
    ];
    let outputs = ["--out", "f.mcap", "--report", "r.html", "--json", "f.json"];
    let table = folder.succeeds(&[&arguments[..], &outputs[..]].concat());
    assert!(table.contains("1.30") && table.contains("RMSE"), "{table}");
    assert_eq!(folder.files(), ["f.json", "f.mcap", "r.html"]);
    let figures = json(&folder, "f.json");
    assert_eq!(figures["arm"], "twcc_flat");
    assert!(figures["rmse_m"].as_f64().unwrap() > 1.0 && figures["thrust_to_weight"] == 1.3);
}

#[test]
fn a_policy_from_its_file_flies_and_its_flight_replays_without_it() {
    let folder = Folder::new("policy");
    // Level at hover thrust, wings half open: weights of zero.
    PolicyWeights::save(&Policy::filled(0.0), &folder.0.join("p.safetensors")).unwrap();
    let table = folder.succeeds(&[
        "fly",
        "--scenario",
        "hover",
        "--policy",
        "p.safetensors",
        "--out",
        "f.mcap",
        "--report",
        "r.html",
        "--json",
        "f.json",
    ]);
    assert!(table.contains("squirrel flies hover with policy p.safetensors over pc"), "{table}");
    let figures = json(&folder, "f.json");
    let hash = figures["policy"].as_str().unwrap();
    assert_eq!((figures["arm"].as_str(), hash.len()), (Some("pc"), 16));
    assert!(fs::read_to_string(folder.0.join("r.html")).unwrap().contains("policy p.safetensors"));
    fs::remove_file(folder.0.join("p.safetensors")).unwrap();
    assert!(folder.succeeds(&["replay", "f.mcap"]).contains("every bit identical"));
    let log = FlightLog::read(&folder.0.join("f.mcap")).unwrap();
    assert_eq!(log.metadata["policy_hash"], hash);
    let arguments = ["fly", "--policy", "p.safetensors", "--out", "g.mcap"];
    folder.fails(&arguments, &["p.safetensors: "]);
    fs::write(folder.0.join("p.safetensors"), "nonsense").unwrap();
    folder.fails(&arguments, &["p.safetensors: not a whole safetensors file"]);
}

#[test]
fn an_excitation_report_shows_the_pilots_card() {
    let folder = Folder::new("card");
    folder.succeeds(&["fly", "--arm", "pc", "--scenario", "excite_rich", "--report", "r.html"]);
    let report = fs::read_to_string(folder.0.join("r.html")).unwrap();
    assert!(report.contains("Pilot&#39;s card") && report.contains("wings open at"));
}

#[test]
fn the_study_writes_its_table_for_machines() {
    let folder = Folder::new("study");
    let arguments =
        ["study", "thrust", "--arms", "pc,twcc_flat", "--trials", "2", "--seed", "1", "--out", "d"];
    let table = folder.succeeds(&arguments);
    assert!(table.contains("95 % interval"), "{table}");
    let study = json(&folder, "d/thrust.json");
    let points = study["points"].as_array().unwrap();
    assert_eq!((points.len(), points[0]["rows"].as_array().unwrap().len()), (16, 2));
    let csv = fs::read_to_string(folder.0.join("d/thrust.csv")).unwrap();
    assert_eq!(csv.lines().count(), 33);
    let columns: Vec<usize> = csv.lines().map(|line| line.split(',').count()).collect();
    assert!(columns.iter().all(|n| *n == columns[0]), "{csv}");
}

/// Four parts, as on four machines, leave the folder that one machine leaves.
#[test]
fn parts_of_a_study_are_merged_into_the_whole() {
    let folder = Folder::new("parts");
    let study =
        ["study", "table3", "--arms", "pc,twcc_plus", "--trials", "2", "--seed", "7", "--out"];
    let whole = folder.succeeds(&[&study[..], &["whole"]].concat());
    for k in 1..=4 {
        let (out, shard) = (format!("part{k}"), format!("{k}/4"));
        let said = folder.succeeds(&[&study[..], &[&out, "--shard", &shard]].concat());
        assert!(said.is_empty(), "a part has nothing to say: {said}");
    }
    let merged =
        folder.succeeds(&["study", "merge", "part1", "part2", "part3", "part4", "--out", "merged"]);
    assert_eq!(merged, whole);
    let files = |name: &str| {
        let mut files: Vec<_> = fs::read_dir(folder.0.join(name))
            .unwrap()
            .map(|entry| entry.unwrap())
            .map(|entry| (entry.file_name(), fs::read(entry.path()).unwrap()))
            .collect();
        files.sort();
        files
    };
    assert!(files("merged") == files("whole") && files("whole").len() >= 3);
    folder.fails(
        &["study", "merge", "part1", "part2", "--out", "half"],
        &["table3.trials.jsonl", "flight = 2: missing"],
    );
    folder.fails(&["study", "merge", "nowhere", "--out", "half"], &["nowhere"]);
    folder.fails(&[&study[..8], &["--shard", "1/2"]].concat(), &["shard", "--out"]);
    assert_eq!(folder.run(&["study", "forest", "--shard", "3/2"]).status.code(), Some(2));
}

#[test]
fn the_study_of_filters_writes_its_table_and_its_flights() {
    let folder = Folder::new("filters");
    let arguments = ["study", "filters", "--trials", "2", "--out", "d", "--json", "f.json"];
    let table = folder.succeeds(&arguments);
    assert!(table.contains("rkf_mtf") && table.contains("off by 0.4, -0.3, 0.2 deg/s"), "{table}");
    assert_eq!(json(&folder, "f.json")["rows"].as_array().unwrap().len(), 12);
    assert_eq!(
        fs::read(folder.0.join("f.json")).unwrap(),
        fs::read(folder.0.join("d/filters.json")).unwrap()
    );
    assert_eq!(fs::read_to_string(folder.0.join("d/filters.csv")).unwrap().lines().count(), 13);
    folder.succeeds(&["fly", "--arm", "pc_wings_open", "--scenario", "d/flights/trial-001.toml"]);
}

#[test]
fn wrong_usage_is_exit_code_two() {
    let folder = Folder::new("usage");
    for arguments in
        [&["flie"][..], &["fly", "--speed", "3"], &["replay"], &["fly", "--seed", "one"]]
    {
        assert_eq!(folder.run(arguments).status.code(), Some(2), "{arguments:?}");
    }
    assert_eq!(folder.run(&["--help"]).status.code(), Some(0));
}

#[test]
fn a_bundled_vehicle_is_found_by_its_name_wherever_a_file_is() {
    let folder = Folder::new("bundled");
    let fly = ["fly", "--vehicle", "crazyflie2_arpl", "--scenario", "hover", "--arm", "pc"];
    // A folder of this name, as a clone of the repository is one, is no vehicle.
    fs::create_dir(folder.0.join("squirrel")).unwrap();
    let flown = folder.succeeds(&["fly", "--vehicle", "squirrel", "--scenario", "hover"]);
    assert!(flown.starts_with("squirrel flies hover"), "{flown}");
    let shown = folder.succeeds(&["vehicle", "check", "crazyflie2_arpl"]);
    assert!(shown.starts_with("crazyflie2_arpl: sound"), "{shown}");
    folder.succeeds(&["vehicle", "diff", "squirrel", "squirrel_air"]);
    // A file of the name comes first.
    folder.write("crazyflie2_arpl", SQUIRREL);
    let flown = folder.succeeds(&fly);
    assert!(flown.starts_with("squirrel flies hover"), "{flown}");
    folder.fails(
        &["fly", "--vehicle", "sqirrel", "--scenario", "hover"],
        &["sqirrel: no such file, and no bundled vehicle", "squirrel_air", "crazyflie21_brushed"],
    );
}

#[test]
fn a_patch_of_a_bundled_vehicle_is_a_vehicle_file() {
    let folder = Folder::new("bundled-patch");
    let log = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../tests/data/flights/nanobench/B3_figure8_fast_rep1.csv"
    );
    folder.succeeds(&["import", "--map", "nanobench", log, "--out", "f.mcap"]);
    let lacks = ["--vehicle", "crazyflie21_brushed", "--flights", "f.mcap", "--out", "gap"];
    folder.succeeds(&[&["gap", "run"], &lacks[..]].concat());
    folder.succeeds(&["vehicle", "check", "gap/crazyflie21_brushed.toml"]);
}

#[test]
fn bad_vehicles_get_one_line_with_file_field_and_value() {
    let folder = Folder::new("bad-vehicles");
    let cases: [(&str, &str, &str, &[&str]); 17] = [
        (
            "fifth rotor",
            "[limits]",
            "[effects.weak_rotor]\nrotor = 5\nthrust_loss_fraction = 0.1\n[limits]",
            &["effects.weak_rotor.rotor = 5", "1 to 4"],
        ),
        (
            "fourth axis",
            "[limits]",
            "[effects.inertia_error]\naxis = \"w\"\ninertia_fraction = 0.1\n[limits]",
            &["effects.inertia_error.axis = \"w\"", "x, y, z"],
        ),
        (
            "half an effect",
            "[limits]",
            "[effects.constant_wind]\nwind_north_m_s = 1.0\n[limits]",
            &["effects.constant_wind.wind_east_m_s: missing"],
        ),
        (
            "filter",
            "frequency_rad_s = { value = 14.0",
            "frequency_rad_s = { value = 400.0",
            &["filter_frequency_rad_s = 400"],
        ),
        (
            "negative drag",
            "[limits]",
            "[effects.linear_drag]\nextra_drag_n_s_per_m = -5.0\n[limits]",
            &["effects.linear_drag.extra_drag_n_s_per_m = -5"],
        ),
        (
            "efficiency",
            "efficiency = { value = 0.7",
            "efficiency = { value = 7.0",
            &["battery.efficiency = 7"],
        ),
        ("missing number", "tau1_s = ", "# tau1_s = ", &["line", "tau1_s"]),
        ("unknown key", "[mass]\n", "[mass]\nmas_kg = 1.0\n", &["line", "mas_kg"]),
        ("negative mass", "value = 0.548,", "value = -0.548,", &["mass.mass_kg = -0.548"]),
        ("NaN", "value = 0.548,", "value = nan,", &["mass.mass_kg = NaN"]),
        (
            "impossible inertia",
            "4.68e-3, 7.72e-3]",
            "4.68e-3, 9.72e-3]",
            &["mass.inertia_kg_m2 = 0.00972"],
        ),
        (
            "indefinite inertia",
            "[3.22e-3, 4.68e-3",
            "[-3.22e-3, 4.68e-3",
            &["mass.inertia_kg_m2 = -0.00322"],
        ),
        ("wing area without wing", "model = \"membrane\"\n", "", &["wing.area_per_side_m2 = 0.02"]),
        ("unknown effect", "[limits]", "[effects.magic]\nx = 1.0\n[limits]", &["effects.magic"]),
        (
            "zero gain",
            "value = [1.6, 1.6, 0.8]",
            "value = [1.6, 0.0, 0.8]",
            &["control.position.position_per_s[1] = 0"],
        ),
        ("text for a number", "value = 0.548,", "value = \"heavy\",", &["line", "heavy"]),
        (
            "rates",
            "[control]\n",
            "[sensors.gnss.timing]\nrate_hz = -1.0\n[control]\n",
            &["sensors.gnss.timing.rate_hz = -1"],
        ),
    ];
    for (what, from, to, words) in cases {
        let text = SQUIRREL.replacen(from, to, 1);
        assert_ne!(text, SQUIRREL, "{what}");
        folder.write("v.toml", &text);
        let words = [&["v.toml"][..], words].concat();
        folder.fails(&["vehicle", "check", "v.toml"], &words);
        folder.fails(&["fly", "--vehicle", "v.toml", "--out", "f.mcap"], &words);
    }
    folder.fails(&["vehicle", "check", "none.toml"], &["none.toml"]);
    folder.write("empty.toml", "");
    folder.fails(&["vehicle", "check", "empty.toml"], &["empty.toml"]);
    folder.fails(&["fly", "--scenario", "loop"], &["scenario = loop", "avoid"]);
    folder.fails(&["fly", "--arm", "hero"], &["arm = hero", "twcc_flat"]);
    folder.fails(&["fly", "--integrator", "euler"], &["integrator = euler"]);
    folder.fails(&["fly", "--thrust-to-weight", "nan"], &["thrust_to_weight = NaN"]);
    folder.fails(&["study", "thrust", "--trials", "0"], &["trials = 0"]);
    let avoid = squirrel_sim::scenario::Scenario::find("avoid").unwrap();
    folder.write("nan.toml", &avoid.to_toml().replace("course_rad = 0.0", "course_rad = nan"));
    folder.fails(&["fly", "--scenario", "nan.toml"], &["nan.toml", "course_rad = NaN"]);
    let nothing = squirrel_sim::scenario::Scenario { obstacles: Vec::new(), ..avoid };
    folder.write("nothing.toml", &nothing.to_toml());
    let flown = folder.run(&["fly", "--scenario", "nothing.toml"]);
    let said = String::from_utf8_lossy(&flown.stderr);
    assert!(flown.status.success() && said.contains("no encounter in duration_s = 13"), "{said}");
}

#[test]
fn a_sound_vehicle_is_shown_with_its_sources() {
    let folder = Folder::new("vehicle");
    folder.write("v.toml", SQUIRREL);
    let table = folder.succeeds(&["vehicle", "check", "v.toml", "--json", "v.json"]);
    assert_eq!(json(&folder, "v.json")["numbers"]["mass.mass_kg"]["source"], "paper, Table I");
    assert!(table.contains("squirrel: sound") && table.contains("paper, Table I"), "{table}");
}

#[test]
fn bad_tables_get_one_line_with_file_field_and_value() {
    let folder = Folder::new("bad-tables");
    folder.write("map.toml", MAP);
    let cases: [(&str, &[&str]); 6] = [
        ("t,gx,gy\n0,1,2\n", &["gz"]),
        ("t,gx,gy,gz\n0,1,2,3\n0.1,1,2,3\n0.05,1,2,3\n", &["0.05", "0.1"]),
        ("t,gx,gy,gz\n0,1,two,3\n", &["gy", "two"]),
        ("t,gx,gy,gz\n0,1,inf,3\n", &["gy", "inf"]),
        ("t,gx,gy,gz\n", &["f.csv"]),
        ("", &["f.csv"]),
    ];
    for (text, words) in cases {
        folder.write("f.csv", text);
        let words = [&["f.csv"][..], words].concat();
        folder.fails(&["import", "--map", "map.toml", "f.csv", "--out", "f.mcap"], &words);
    }
    folder.write("f.csv", "t,gx,gy,gz\n0,1,2,3\n0.1,1,2,3\n");
    folder
        .succeeds(&["import", "--map", "map.toml", "f.csv", "--out", "f.mcap", "--json", "f.json"]);
    assert_eq!(json(&folder, "f.json")["channels"][0]["samples"], 2);
    folder.fails(&["replay", "f.mcap"], &["f.mcap", "metadata"]);
}
