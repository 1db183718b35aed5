//! `squirrel train` and `squirrel study table2` as a user runs them.

#![allow(clippy::print_stdout, reason = "a test may panic and say what it skips")]

use super::support::{Folder, json};
use squirrel_log::FlightLog;
use squirrel_nn::trained::Trained;
use squirrel_sim::scenario::Scenario;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A folder with short flights `f/a.mcap`, `f/b.mcap`, ... of spread wings.
fn with_flights(name: &str, flights: &[&str]) -> Folder {
    let folder = Folder::new(name);
    let scenario = Scenario { duration_s: 8.0, ..Scenario::find("random_spread").unwrap() };
    folder.write("short.toml", &scenario.to_toml());
    fs::create_dir(folder.0.join("f")).unwrap();
    for (seed, flight) in flights.iter().enumerate() {
        let (seed, out) = (seed.to_string(), format!("f/{flight}.mcap"));
        let fly = [
            "fly",
            "--arm",
            "pc_wings_open",
            "--scenario",
            "short.toml",
            "--seed",
            &seed,
            "--out",
            &out,
        ];
        folder.succeeds(&fly);
    }
    folder
}

#[test]
fn flights_become_weights_with_figures_and_a_loss_curve_the_same_bytes_twice() {
    let folder = with_flights("train", &["a", "b", "c"]);
    let train = |out: &str| {
        let paths = [format!("{out}.safetensors"), format!("{out}.html"), format!("{out}.json")];
        let [weights, report, figures] = paths.each_ref().map(String::as_str);
        let what = [
            "train",
            "parnn",
            "--flights",
            "f",
            "--seed",
            "3",
            "--epochs",
            "60",
            "--validation",
            "c",
        ];
        let where_to = ["--out", weights, "--report", report, "--json", figures];
        let table = folder.succeeds(&[&what[..], &where_to[..]].concat());
        (table, [weights, report, figures].map(|file| fs::read(folder.0.join(file)).unwrap()))
    };
    let (table, files) = train("one");
    assert!(files == train("two").1, "two runs differ");
    for word in ["training", "validation", "RMSE to labels N", "flat plate N", "epoch"] {
        assert!(table.contains(word), "`{word}` is not in:\n{table}");
    }
    assert!(!folder.files().iter().any(|file| file.contains("checkpoint")), "{:?}", folder.files());

    let figures = json(&folder, "one.json");
    assert_eq!(figures["sets"][0]["flights"], serde_json::json!(["a", "b"]), "split by flight");
    assert_eq!(figures["sets"][1]["flights"], serde_json::json!(["c"]));
    let history = figures["history"].as_array().unwrap();
    assert_eq!(history.len(), 60);
    assert!(history[59]["training"].as_f64() < history[0]["training"].as_f64());
    let trained = Trained::load(&folder.0.join("one.safetensors")).unwrap();
    assert_eq!(trained.card.vehicle, "squirrel");
    assert_eq!(
        trained.card.figures["validation_rmse_to_labels_n"],
        figures["sets"][1]["rmse_to_labels_n"]
    );
    assert!(trained.parnn().is_some() && trained.card.domain.speed_m_s[1] > 4.0);
    assert!(String::from_utf8_lossy(&files[1]).contains("<svg"));
}

#[test]
fn every_model_can_be_trained() {
    let folder = with_flights("models", &["a"]);
    let names =
        "parnn parnn_window_1 vanilla vanilla_body vanilla_plane flat_plate scaled_flat_plate";
    for model in names.split(' ') {
        folder.succeeds(&[
            "train",
            model,
            "--flights",
            "f/a.mcap",
            "--out",
            "w.safetensors",
            "--epochs",
            "2",
        ]);
        assert_eq!(
            Trained::load(&folder.0.join("w.safetensors")).unwrap().card.model.name(),
            model
        );
    }
}

#[test]
fn a_training_that_was_killed_goes_on_to_the_same_bytes() {
    let folder = with_flights("killed", &["a"]);
    let arguments = |out: &'static str| {
        ["train", "parnn", "--flights", "f", "--epochs", "20000", "--seed", "7", "--out", out]
    };
    let [checkpoint, weights] =
        ["killed.checkpoint.safetensors", "killed.safetensors"].map(|name| folder.0.join(name));
    // On a busy machine the training may be over before this process has its turn: then once more.
    let was_killed = (0..20).any(|_| {
        let _ = fs::remove_file(&weights);
        let mut training = Command::new(env!("CARGO_BIN_EXE_squirrel"))
            .args(arguments("killed.safetensors"))
            .current_dir(&folder.0)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        while !checkpoint.exists() && training.try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        training.kill().unwrap();
        training.wait().unwrap();
        checkpoint.exists() && !weights.exists()
    });
    assert!(was_killed, "always over before it can be killed");

    let other = ["train", "vanilla", "--flights", "f", "--resume", "--out", "killed.safetensors"];
    folder.fails(&other, &["killed.checkpoint.safetensors: is of parnn, seed 7, 20000 epochs"]);
    folder.succeeds(&[&arguments("killed.safetensors")[..], &["--resume"]].concat());
    folder.succeeds(&arguments("whole.safetensors"));
    let [killed, whole] =
        ["killed", "whole"].map(|w| fs::read(folder.0.join(format!("{w}.safetensors"))).unwrap());
    assert!(killed == whole, "the weights differ");
    assert!(!checkpoint.exists());
}

#[test]
fn a_checkpoint_that_is_there_is_not_written_over() {
    let folder = with_flights("checkpoint_there", &["a"]);
    folder.write("w.checkpoint.safetensors", "of somebody else");
    for (model, epochs) in [("flat_plate", "1"), ("vanilla", "60")] {
        let train = ["train", model, "--flights", "f", "--epochs", epochs];
        folder.fails(
            &[&train[..], &["--out", "w.safetensors"]].concat(),
            &["w.checkpoint.safetensors: is there already", "--resume", "delete"],
        );
    }
    let left = fs::read_to_string(folder.0.join("w.checkpoint.safetensors")).unwrap();
    assert_eq!(left, "of somebody else");
}

#[test]
fn what_cannot_be_trained_on_gets_one_line() {
    let folder = with_flights("bad", &["a", "b"]);
    let fails = |extra: &[&str], words: &[&str]| {
        let out = if extra.contains(&"--out") { &[][..] } else { &["--out", "w.safetensors"][..] };
        folder.fails(&[&["train", "parnn"][..], extra, out].concat(), words);
    };
    fs::create_dir(folder.0.join("empty")).unwrap();
    fails(&["--flights", "empty"], &["empty: no .mcap file"]);
    fails(&["--flights", "none.mcap"], &["none.mcap"]);
    fails(&["--flights", "f", "--out", "no/w.safetensors"], &["no/w.safetensors"]);
    fails(&["--flights", "f", "--out", "f"], &["f: is a folder"]);
    fails(&["--flights", "f", "--epochs", "0"], &["epochs = 0"]);
    fails(&["--flights", "f", "--validation", "c"], &["--validation: c: no flight"]);
    fails(&["--flights", "f", "--validation", "a,b"], &["--validation", "none is left"]);
    fails(&["--flights", "f/a.mcap", "f/a.mcap"], &["a: two flights have this name"]);
    fails(&["--flights", "f", "--resume"], &["w.checkpoint.safetensors"]);
    folder.succeeds(&["fly", "--arm", "pc", "--scenario", "hover", "--out", "f/folded.mcap"]);
    fails(&["--flights", "f/folded.mcap"], &["f/folded.mcap: wing.command: never above 0.99"]);
    let mixed = ["train", "flat_plate", "--flights", "f", "--out", "w.safetensors"];
    let output = folder.run(&mixed);
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && said.contains("left out: f/folded.mcap"), "{said}");

    let mut log = FlightLog::read(&folder.0.join("f/a.mcap")).unwrap();
    log.sources.remove("imu");
    log.write(&folder.0.join("deaf.mcap")).unwrap();
    fails(&["--flights", "deaf.mcap"], &["deaf.mcap: imu.specific_force_body_m_s2: missing"]);
    let bytes = fs::read(folder.0.join("f/a.mcap")).unwrap();
    fs::write(folder.0.join("cut.mcap"), &bytes[..bytes.len() / 2]).unwrap();
    fails(&["--flights", "cut.mcap"], &["cut.mcap", "truncated"]);
    assert_eq!(
        folder.run(&["train", "oracle", "--flights", "f", "--out", "w"]).status.code(),
        Some(2)
    );
}

/// One CSV file a source, axes and quaternion as another autopilot would have them.
const MAP: &str = r#"
[[source]]
file = "imu.csv"
time = { column = "t", unit = "s" }
[source.channels]
"imu.omega_body_rad_s" = { columns = ["0", "1", "2"], body = "flu" }
"imu.specific_force_body_m_s2" = { columns = ["3", "4", "5"], body = "flu" }
[[source]]
file = "gnss.csv"
time = { column = "t", unit = "s" }
[source.channels]
"gnss.velocity_ned_m_s" = { columns = ["0", "1", "2"], world = "nwu" }
[[source]]
file = "attitude.csv"
time = { column = "t", unit = "s" }
[source.channels]
"attitude.q_ned_from_body_wxyz" = { columns = ["0", "1", "2", "3"], order = "wxyz", world = "ned", body = "frd", direction = "world_from_body" }
[[source]]
file = "commands.csv"
time = { column = "t", unit = "s" }
[source.channels]
"rotor.command" = { columns = ["0", "1", "2", "3"], rotors = [1, 2, 3, 4] }
"wing.command" = { columns = ["4", "5"] }
"#;

/// Columns of channels that share a time axis; `flu` turns the y and z of a vector round.
fn csv(log: &FlightLog, channels: &[&str], flu: bool) -> String {
    let columns: usize = channels.iter().map(|name| log.channel(name).unwrap().1.width).sum();
    let mut text =
        format!("t,{}\n", (0..columns).map(|c| c.to_string()).collect::<Vec<_>>().join(","));
    let time_s = log.channel(channels[0]).unwrap().0;
    for (i, t) in time_s.iter().enumerate() {
        let _ = write!(text, "{t}");
        for name in channels {
            for (axis, x) in log.channel(name).unwrap().1.row(i).iter().enumerate() {
                let _ = write!(text, ",{}", if flu && axis > 0 { -x } else { *x });
            }
        }
        text.push('\n');
    }
    text
}

#[test]
fn an_imported_flight_gives_what_the_flight_itself_gives() {
    let folder = with_flights("imported", &["a"]);
    let log = FlightLog::read(&folder.0.join("f/a.mcap")).unwrap();
    fs::create_dir(folder.0.join("csv")).unwrap();
    folder.write(
        "csv/imu.csv",
        &csv(&log, &["imu.omega_body_rad_s", "imu.specific_force_body_m_s2"], true),
    );
    folder.write("csv/gnss.csv", &csv(&log, &["gnss.velocity_ned_m_s"], true));
    folder.write("csv/attitude.csv", &csv(&log, &["attitude.q_ned_from_body_wxyz"], false));
    folder.write("csv/commands.csv", &csv(&log, &["rotor.command", "wing.command"], false));
    folder.write("map.toml", MAP);
    folder.succeeds(&["import", "--map", "map.toml", "csv", "--out", "imported.mcap"]);
    let error = |flight: &str| {
        let train = ["train", "scaled_flat_plate", "--flights", flight];
        folder.succeeds(&[&train[..], &["--out", "w.safetensors", "--json", "t.json"]].concat());
        let judged = json(&folder, "t.json")["sets"][0].clone();
        (judged["rmse_to_labels_n"].as_f64().unwrap(), judged["rmse_to_truth_n"].is_null())
    };
    let ((native, knows_no_truth), (imported, has_none)) =
        (error("f/a.mcap"), error("imported.mcap"));
    assert!(!knows_no_truth && has_none);
    // The import has no battery, whose voltage thrust does not feel, and numbers of another
    // rounding.
    assert!(
        (imported - native).abs() < 1e-3 * native,
        "{imported} N, from the flight itself {native} N"
    );
}

#[test]
fn a_measured_flight_without_wings_says_what_it_lacks() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let flight = root.join("tests/data/flights/nanobench/B3_figure8_fast_rep1.csv");
    let folder = Folder::new("measured");
    let text = |path: PathBuf| path.canonicalize().unwrap().to_str().unwrap().to_owned();
    let map = text(root.join("vehicles/maps/nanobench.toml"));
    folder.succeeds(&["import", "--map", &map, &text(flight), "--out", "b3.mcap"]);
    let train = ["train", "parnn", "--flights", "b3.mcap", "--out", "w.safetensors"];
    folder.fails(&train, &["b3.mcap: wing.command: missing; wings must be spread"]);
    let crazyflie = text(root.join("vehicles/crazyflie21_brushed.toml"));
    folder.fails(
        &[&train[..], &["--vehicle", &crazyflie]].concat(),
        &["has no wings to learn about"],
    );
}

#[test]
fn table_two_writes_the_same_bytes_twice_and_holds_every_model() {
    let folder = Folder::new("table2");
    let run = |out: &str| {
        let study =
            ["study", "table2", "--trials", "2", "--seed", "1", "--epochs", "5", "--out", out];
        let table = folder.succeeds(&study);
        let files = ["table2.csv", "table2.json", "table2.html"];
        (table, files.map(|file| fs::read(folder.0.join(out).join(file)).unwrap()))
    };
    let (table, files) = run("one");
    assert!((table.clone(), files.clone()) == run("two"), "two runs differ");
    for word in
        ["30 s of training, t1", "300 s of training, t4", "vanilla_plane", "label noise N", "over"]
    {
        assert!(table.contains(word), "`{word}` is not in:\n{table}");
    }
    let study = json(&folder, "one/table2.json");
    assert_eq!(study["rows"].as_array().unwrap().len(), 3 * 5 * 7);
    let csv = String::from_utf8(files[0].clone()).unwrap();
    let width = csv.lines().next().unwrap().split(',').count();
    assert_eq!(csv.lines().count(), 1 + 3 * 5 * 7);
    assert!(csv.lines().all(|line| line.split(',').count() == width));
    for set in ["training", "t1", "t2", "t3", "t4"] {
        let scenario = format!("one/{set}.toml");
        folder.succeeds(&[
            "fly",
            "--arm",
            "pc_wings_open",
            "--scenario",
            &scenario,
            "--json",
            "f.json",
        ]);
        assert_eq!(json(&folder, "f.json")["scenario"], set);
    }
    folder.fails(&["study", "table2", "--trials", "0"], &["trials = 0"]);
    folder.fails(&["study", "table2", "--epochs", "0"], &["epochs = 0"]);
}
