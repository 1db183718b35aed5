//! The map of CrazyPAD: a piece of one flight by hand, and all flights that are at hand against
//! physics in NED and FRD. At hand are the cut-outs in `tests/data/flights`, or the whole flights
//! in the folder `SQUIRREL_FLIGHTS`.
#![allow(clippy::print_stdout, reason = "tests")]
#![allow(clippy::unreadable_literal, reason = "numbers as another decoder prints them")]

use std::path::{Path, PathBuf};

use squirrel_log::FlightLog;
use squirrel_log::import::{ImportMap, Reading, import};

const GRAVITY_M_S2: f64 = 9.80665;

fn root(part: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(part)
}

fn map_text() -> String {
    std::fs::read_to_string(root("../../vehicles/maps/crazypad.toml")).unwrap()
}

fn map(text: &str) -> ImportMap {
    ImportMap::parse(text, "crazypad.toml").unwrap()
}

#[test]
fn the_map_turns_a_piece_of_a_flight_into_our_frames() {
    let (log, report) =
        import(&map(&map_text()), &[root("tests/data/crazypad/E8_log00.bin")]).unwrap();
    assert_eq!((report.files[0].rows, report.files[0].rows_masked), (200, 108));
    let close = |channel: &str, expected: &[f64]| {
        let last = log.channel(channel).unwrap().1.row(91);
        assert_eq!(last.len(), expected.len());
        for (got, expected) in last.iter().zip(expected) {
            assert!((got - expected).abs() < 1e-12, "{channel}: {got} is not {expected}");
        }
    };
    let counts = |counts: [f64; 4]| counts.map(|count| count / 65535.0);
    close("rotor.command", &counts([46_263.0, 42_608.0, 48_087.0, 40_659.0]));
    close("control.rotor_thrust_request", &counts([42_979.0, 37_829.0, 45_865.0, 35_343.0]));
    close("battery.voltage_v", &[3.536]);
    // North, west and up in the file.
    close(
        "gnss.position_ned_m",
        &[5.896473885513842e-05, 0.011082288809120655, -0.5031231641769409],
    );
    close(
        "gnss.velocity_ned_m_s",
        &[0.028661735355854034, -0.030340489000082016, -0.07731214165687561],
    );
    let acceleration_g = [-0.00902516022324562, 0.007438897155225277, 0.021492421627044678];
    close("imu.acceleration_ned_m_s2", &acceleration_g.map(|g| g * GRAVITY_M_S2));
    close("attitude.roll_rad", &[-0.06214368715882301_f64.to_radians()]);
    close("attitude.yaw_rad", &[-3.140734910964966_f64.to_radians()]);
}

/// The same without a map: what the names of the variables say.
#[test]
fn the_names_of_the_variables_are_map_enough() {
    let piece = [root("tests/data/crazypad/E8_log00.bin")];
    let (by_map, _) = import(&map(&map_text()), &piece).unwrap();
    let reading = Reading::new(&piece, None, &[]).unwrap();
    assert_eq!(reading.files().unwrap(), piece);
    assert_eq!(
        reading.notes,
        [
            "of the variables of the event `fixedFrequency`, by their names",
            "kept: what is flown above 0.3 m, for on the floor legs push"
        ]
    );
    let (log, _) = reading.import(&|_, _| {}).unwrap();
    let names: Vec<&String> = log.sources.keys().collect();
    assert_eq!(names, by_map.sources.keys().collect::<Vec<_>>());
    for (name, source) in &by_map.sources {
        let own = &log.sources[name];
        assert_eq!(
            own.channels.keys().collect::<Vec<_>>(),
            source.channels.keys().collect::<Vec<_>>()
        );
        // Its rows end a little later, after the motors have slowed down.
        for (channel, expected) in &source.channels {
            let got = &own.channels[channel].values;
            assert_eq!(got[..expected.values.len()], expected.values[..], "{name}.{channel}");
        }
    }
}

/// All flights, by name; two of the whole set have no yaw, one of the cut-outs.
fn flights() -> Vec<(String, FlightLog)> {
    let folder = std::env::var_os("SQUIRREL_FLIGHTS")
        .map_or_else(|| root("../../tests/data/flights"), PathBuf::from)
        .join("crazypad-dev");
    let map = map(&map_text());
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "bin"));
    paths.sort();
    let flight = |path: PathBuf| {
        let name = path.file_stem().unwrap().display().to_string();
        let (log, report) = import(&map, &[path]).unwrap();
        let without_yaw = ["cut_M3_2mm__E8_log02", "cut_M3_3mm__E8_log02"].contains(&name.as_str());
        let absent: Vec<&str> =
            report.absent.iter().map(|absent| absent.channel.as_str()).collect();
        assert_eq!(absent, if without_yaw { vec!["attitude.yaw_rad"] } else { vec![] }, "{name}");
        (name, log)
    };
    paths.into_iter().map(flight).collect()
}

/// Numbers of one column of a channel.
fn column(log: &FlightLog, channel: &str, place: usize) -> Vec<f64> {
    let (_, channel) = log.channel(channel).unwrap();
    channel.values.iter().skip(place).step_by(channel.width).copied().collect()
}

/// Correlation and regression slope of y on x.
fn correlation(x: &[f64], y: &[f64]) -> (f64, f64) {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let (mean_x, mean_y) = (mean(x), mean(y));
    let sum = |f: &dyn Fn(f64, f64) -> f64| {
        x.iter().zip(y).map(|(x, y)| f(x - mean_x, y - mean_y)).sum::<f64>()
    };
    let (xx, yy, xy) = (sum(&|x, _| x * x), sum(&|_, y| y * y), sum(&|x, y| x * y));
    (xy / (xx * yy).sqrt(), xy / xx)
}

/// Correlation of an angle's acceleration with a sum of the rotors' thrusts `LAG` rows before:
/// rotors, filter and estimate are late by about 40 ms. Both are means over the same triangle of
/// `2 WIDTH` rows.
fn follows(log: &FlightLog, angle: &[f64], signs: [f64; 4]) -> f64 {
    const LAG: usize = 4;
    const WIDTH: usize = 10;
    let (time_s, command) = log.channel("rotor.command").unwrap();
    let asked: Vec<f64> = (0..time_s.len())
        .map(|row| command.row(row).iter().zip(signs).map(|(u, sign)| sign * u * u).sum())
        .collect();
    let whole = |row: &usize| time_s[row + WIDTH + LAG] - time_s[row - WIDTH] < 0.3;
    let (x, y): (Vec<f64>, Vec<f64>) = (WIDTH..time_s.len() - WIDTH - LAG)
        .filter(whole)
        .map(|row| {
            let weight = |k: usize| WIDTH as f64 - k.abs_diff(WIDTH) as f64;
            let asked: f64 = (0..=2 * WIDTH).map(|k| weight(k) * asked[row + k - WIDTH]).sum();
            let at = row + LAG;
            (asked, angle[at + WIDTH] - 2.0 * angle[at] + angle[at - WIDTH])
        })
        .unzip();
    correlation(&x, &y).0
}

#[test]
fn every_flight_obeys_physics() {
    let flights = flights();
    let whole = std::env::var_os("SQUIRREL_FLIGHTS").is_some();
    assert_eq!(flights.len(), if whole { 77 } else { 12 });
    for (name, log) in flights {
        let (time_s, command) = log.channel("rotor.command").unwrap();
        assert!(time_s.len() > 1400, "{name}: {} rows in flight", time_s.len());
        assert!(command.values.iter().all(|u| (0.0..=1.0).contains(u)), "{name}");
        let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_unstable_by(f64::total_cmp);
        let step_s = if name.contains("__E8_") { 9.886e-3 } else { 9.9125e-3 };
        assert!(
            (steps[steps.len() / 2] - step_s).abs() < 3e-6,
            "{name}: {}",
            steps[steps.len() / 2]
        );

        // Half a metre up is minus half a metre down, and the way is the velocity's.
        let down = column(&log, "gnss.position_ned_m", 2);
        assert!(down.iter().all(|down| (-0.7..-0.3).contains(down)), "{name}");
        let (north, speed) =
            (column(&log, "gnss.position_ned_m", 0), column(&log, "gnss.velocity_ned_m_s", 0));
        let rows: Vec<usize> =
            (1..time_s.len() - 1).filter(|row| time_s[row + 1] - time_s[row - 1] < 0.03).collect();
        let moved: Vec<f64> = rows
            .iter()
            .map(|&row| (north[row + 1] - north[row - 1]) / (time_s[row + 1] - time_s[row - 1]))
            .collect();
        let speed: Vec<f64> = rows.iter().map(|&row| speed[row]).collect();
        let (r, slope) = correlation(&speed, &moved);
        // Fixes of the position make steps, up to 0.76 of correlation; the slope is 0.96 to 1.005.
        assert!(r > 0.7 && (slope - 1.0).abs() < 0.05, "{name}: {r} {slope}");

        // Right side down pulls east, by g times the angle: 0.84 to 1.10 times that in these
        // flights.
        let roll = column(&log, "attitude.roll_rad", 0);
        let east = column(&log, "imu.acceleration_ned_m_s2", 1);
        let (r, slope) = correlation(&roll, &east);
        assert!(r > 0.2 && (0.75..1.25).contains(&(slope / GRAVITY_M_S2)), "{name}: {r} {slope}");

        // Rotors 1 to 4 front right, back right, back left, front left; 1 and 3 turn the nose
        // right. The acceleration is noisy as a pitch, but its correlation has the right sign in
        // every flight, 0.016 to 0.5.
        let nose_down = column(&log, "imu.acceleration_ned_m_s2", 0);
        let nose_up: Vec<f64> = nose_down.iter().map(|north| -north / GRAVITY_M_S2).collect();
        let by_roll = follows(&log, &roll, [-1.0, -1.0, 1.0, 1.0]);
        let by_pitch = follows(&log, &nose_up, [1.0, -1.0, -1.0, 1.0]);
        assert!(by_roll > 0.3 && by_pitch > 0.01, "{name}: {by_roll} {by_pitch}");
        if log.channel("attitude.yaw_rad").is_some() {
            let yaw = column(&log, "attitude.yaw_rad", 0);
            let by_yaw = follows(&log, &yaw, [1.0, -1.0, 1.0, -1.0]);
            assert!(by_yaw > 0.1, "{name}: {by_yaw}");
        }
    }
}

/// The rotors get what Bitcraze's firmware makes of the request and the voltage; the request is not
/// what they get.
#[test]
fn the_command_is_the_request_after_the_compensation_of_the_battery() {
    for (name, log) in flights() {
        let volts = column(&log, "battery.voltage_v", 0);
        for rotor in 0..4 {
            let request = column(&log, "control.rotor_thrust_request", rotor);
            let command = column(&log, "rotor.command", rotor);
            let off =
                request.iter().zip(&command).zip(&volts).filter(|((request, command), volts)| {
                    let g = 60.0 * **request * 65535.0 / 65536.0;
                    let motor_v = 0.088 * g - 0.0006239 * g * g;
                    // The voltage is cut to millivolts, the command to 1/65535.
                    !(-0.0002..0.0013).contains(&(motor_v / **command - **volts))
                });
            // At full request the two may be of different steps.
            assert!(off.count() <= 2, "{name}, rotor {}", rotor + 1);
        }
    }
}
