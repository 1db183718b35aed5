//! Measured flights of a Crazyflie: the residual against an independent computation with NumPy.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{flights, imported, vehicle, vehicle_with};
use squirrel_gap::{diagnose, find};
use squirrel_sim::vehicle_file::VehicleFile;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The drag in `crazyflie21_brushed.toml`, as published.
const DRAG: &str = "value = [0.0068, 0.0068, 0.0], sd";

/// A Python with NumPy: `SQUIRREL_PYTHON`, or else `python3`, or else an environment of its own
/// under `target`.
fn python() -> PathBuf {
    let python: PathBuf =
        std::env::var_os("SQUIRREL_PYTHON").map_or_else(|| PathBuf::from("python3"), PathBuf::from);
    let run = |python: &Path, arguments: &[&str]| {
        Command::new(python).args(arguments).output().is_ok_and(|output| output.status.success())
    };
    if run(&python, &["-c", "import numpy"]) {
        return python;
    }
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("numpy");
    let own = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
    if !run(&own, &["-c", "import numpy"]) {
        assert!(
            run(&python, &["-m", "venv", folder.to_str().unwrap()]),
            "{} -m venv failed",
            python.display()
        );
        assert!(
            run(&own, &["-m", "pip", "install", "--quiet", "numpy>=2.3.5"]),
            "NumPy cannot be installed"
        );
    }
    own
}

#[test]
fn numpy_finds_the_same_residual_force() {
    let csv = flights("nanobench").join("B2_circle_medium_rep1.csv");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/residual_numpy.py");
    let shipped = vehicle("crazyflie21_brushed.toml");
    // The shipped drag is small; a large one shows what attitude and velocity do.
    let draggy = vehicle_with(
        "crazyflie21_brushed.toml",
        &[(DRAG, "value = [0.02, 0.04, 0.1], sd"), ("value = 0.0, sd", "value = 0.003, sd")],
    );
    let flights = [("B2".to_owned(), imported("nanobench.toml", &csv))];
    let mut forces = Vec::new();
    for (vehicle, name) in [(shipped, "shipped.toml"), (draggy, "draggy.toml")] {
        let toml = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::write(&toml, &vehicle.text).unwrap();
        let output = Command::new(python()).args([&script, &csv, &toml]).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let numpy: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();

        let ours = find(&vehicle, &flights).unwrap().residual;
        println!("{name}: {:?}, NumPy {numpy}", ours.force_body_rms_n);
        assert_eq!(ours.per_flight["B2"].samples as u64, numpy["samples"].as_u64().unwrap());
        for axis in 0..3 {
            let (ours, numpy) =
                (ours.force_body_rms_n[axis], numpy["force_body_rms_n"][axis].as_f64().unwrap());
            assert!((ours / numpy - 1.0).abs() < 1e-3, "axis {axis}: {ours} N, NumPy {numpy} N");
        }
        forces.push(ours.force_body_rms_n);
    }
    for (shipped, draggy) in forces[0].iter().zip(&forces[1]) {
        assert!((shipped / draggy - 1.0).abs() > 0.01, "drag is seen: {shipped} N, {draggy} N");
    }
}

/// What is known of these flights: k was fitted at 3.42 to 3.78 V, and thrust sags with the
/// battery, so that the two flights at 3.17 to 3.54 V disagree more along z.
#[test]
fn thrust_disagrees_more_on_an_emptier_battery() {
    let folder = flights("nanobench");
    let flights: Vec<_> = [
        "B8_star_slow_rep1",
        "B3_figure8_fast_rep1",
        "B9_trefoil_slow_rep1",
        "B2_circle_medium_rep1",
    ]
    .map(|name| (name.to_owned(), imported("nanobench.toml", &folder.join(format!("{name}.csv")))))
    .into();
    let finding = find(&vehicle("crazyflie21_brushed.toml"), &flights).unwrap();
    println!("{}", serde_json::to_string_pretty(&finding).unwrap());
    let z = |name: &str| finding.residual.per_flight[name].force_body_rms_n[2];
    for full in ["B8_star_slow_rep1", "B3_figure8_fast_rep1"] {
        for low in ["B9_trefoil_slow_rep1", "B2_circle_medium_rep1"] {
            assert!(z(low) > 1.5 * z(full), "{low}: {} N, {full}: {} N", z(low), z(full));
        }
    }
    assert!(finding.notes.is_empty(), "{:?}", finding.notes);
}

/// Motion capture alone names what the IMU names: the sag that the file lacks, in flights that it
/// was not fitted to.
#[test]
fn without_their_imu_flights_still_name_the_sag() {
    let folder = flights("nanobench");
    for name in ["B2_circle_medium_rep1", "B9_trefoil_slow_rep1"] {
        let mut log = imported("nanobench.toml", &folder.join(format!("{name}.csv")));
        log.sources.remove("imu");
        let flights = [(name.to_owned(), log)];
        let verdict =
            diagnose(&vehicle("crazyflie21_brushed.toml"), &flights, &[], &|_| {}).unwrap().verdict;
        println!("{name}: {}", verdict.words);
        assert_eq!(
            verdict.effects.iter().map(|e| e.name).collect::<Vec<_>>(),
            ["battery_sag"],
            "{name}"
        );
        assert!(
            verdict.notes.iter().any(|n| n.contains("forces are those of gnss.position_ned_m"))
        );
    }
}

/// Force along x and y of flights that no drag was fitted to: less is left with the published one
/// than without, and less again with the one that B8 and B3 show.
#[test]
fn rotor_drag_predicts_held_out_flights() {
    let folder = flights("nanobench");
    let held_out: Vec<_> = ["B2_circle_medium_rep1", "B9_trefoil_slow_rep1"]
        .map(|name| {
            (name.to_owned(), imported("nanobench.toml", &folder.join(format!("{name}.csv"))))
        })
        .into();
    let left = |vehicle: &VehicleFile| find(vehicle, &held_out).unwrap().residual.per_flight;
    let with = |drag: &str| left(&vehicle_with("crazyflie21_brushed.toml", &[(DRAG, drag)]));
    let none = with("value = [0.0, 0.0, 0.0], sd");
    let fitted = with("value = [0.0106, 0.0106, 0.0], sd");
    let shipped = left(&vehicle("crazyflie21_brushed.toml"));
    let datasheet = left(&vehicle("crazyflie21_datasheet.toml"));
    for name in none.keys() {
        let of_all = [&none, &shipped, &fitted, &datasheet];
        for axis in 0..2 {
            let [none, shipped, fitted, datasheet] =
                of_all.map(|all| all[name].force_body_rms_n[axis]);
            println!("{name}, axis {axis}: {none:.5}, {shipped:.5}, {fitted:.5} N");
            for left in [shipped, datasheet] {
                assert!(left < 0.8 * none, "{name}, axis {axis}: {left} N of {none} N");
            }
            assert!(fitted < shipped, "{name}, axis {axis}: {fitted} N, shipped {shipped} N");
        }
    }
}
