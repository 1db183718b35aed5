//! Logs that lack something, or hold what cannot be: an error names flight, channel and value, a
//! note what was taken instead.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{vehicle, vehicle_with};
use squirrel_gap::{Finding, GapError, find};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;

const SAGGING: (&str, &str) =
    ("[limits]", "[effects.battery_sag]\nvoltage_exponent = 0.9\n\n[limits]");

/// A hover of the squirrel at 100 Hz with every channel: level, still, all rotors at the hover
/// command.
fn hover(seconds: f64) -> FlightLog {
    let mut log = FlightLog::default();
    let p = *VehicleFile::squirrel().vehicle.parameters();
    let command = p.propulsion.command_for_thrust(p.mass_kg * 9.80665 / 4.0);
    for k in 0..=(seconds * 100.0) as usize {
        let t = k as f64 * 0.01;
        let imu: &[(&str, &[f64])] =
            &[("omega_body_rad_s", &[0.0; 3]), ("specific_force_body_m_s2", &[0.0, 0.0, -9.80665])];
        log.source_mut("imu").push(t, imu);
        log.source_mut("attitude").push(t, &[("q_ned_from_body_wxyz", &[1.0, 0.0, 0.0, 0.0])]);
        log.source_mut("gnss").push(t, &[("velocity_ned_m_s", &[0.0; 3])]);
        log.source_mut("battery").push(t, &[("voltage_v", &[14.8])]);
        log.source_mut("baro").push(t, &[("altitude_m", &[30.0])]);
        log.source_mut("rotor").push(t, &[("command", &[command; 4])]);
        log.source_mut("wing").push(t, &[("command", &[0.0; 2])]);
    }
    log
}

fn run(vehicle: &VehicleFile, log: &FlightLog) -> Result<Finding, GapError> {
    find(vehicle, &[("f".to_owned(), log.clone())])
}

/// The message for a hover of three seconds after a change.
fn error(change: impl FnOnce(&mut FlightLog)) -> String {
    let mut log = hover(3.0);
    change(&mut log);
    run(&VehicleFile::squirrel(), &log).unwrap_err().to_string()
}

fn values<'a>(log: &'a mut FlightLog, source: &str, channel: &str) -> &'a mut Vec<f64> {
    &mut log.sources.get_mut(source).unwrap().channels.get_mut(channel).unwrap().values
}

#[test]
fn a_hover_that_the_model_explains_has_no_residual() {
    let finding = run(&VehicleFile::squirrel(), &hover(3.0)).unwrap();
    let r = &finding.residual;
    assert!(r.force_body_rms_n.iter().chain(&r.moment_body_rms_n_m).all(|x| *x < 1e-9), "{r:?}");
    // 301 samples, 20 of the filter and 2 of the derivative at each end.
    assert_eq!((r.per_flight["f"].samples, finding.notes.len()), (257, 0));
    assert!((r.per_flight["f"].duration_s - 2.57).abs() < 1e-9);
}

/// Rates that no rotor explains: a steady turn leaves `w x J w`, a growing one `J w'`.
#[test]
fn turning_without_a_cause_is_a_moment() {
    let squirrel = VehicleFile::squirrel();
    let j = squirrel.vehicle.parameters().inertia_kg_m2.diagonal();
    let turning = |omega: &dyn Fn(f64) -> [f64; 3]| {
        let mut log = hover(3.0);
        for (k, row) in values(&mut log, "imu", "omega_body_rad_s").chunks_exact_mut(3).enumerate()
        {
            row.copy_from_slice(&omega(k as f64 * 0.01));
        }
        run(&squirrel, &log).unwrap().residual.moment_body_rms_n_m
    };
    let near = |found: [f64; 3], wanted: [f64; 3]| {
        let error = found.iter().zip(wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-9, "{found:?} N m, must be {wanted:?}");
    };
    near(
        turning(&|_| [2.0, 3.0, 5.0]),
        [15.0 * (j.z - j.y), 10.0 * (j.z - j.x), 6.0 * (j.y - j.x)],
    );
    near(turning(&|t| [0.0, 4.0 * t, 0.0]), [0.0, 4.0 * j.y, 0.0]);
}

/// Memory goes with samples, not with what a clock says: one sample that is far away is named, and
/// so are samples that no sensor could have given.
#[test]
fn a_clock_that_jumps_or_stands_is_named() {
    for (source, channel) in
        [("imu", "omega_body_rad_s"), ("gnss", "velocity_ned_m_s"), ("rotor", "command")]
    {
        for far_s in [1e4, 1e8, 1.7e9] {
            let name = if source == "imu" { "" } else { channel };
            let jumps = error(|log| log.sources.get_mut(source).unwrap().time_s[300] = far_s);
            let place = format!("f: {source}.{name}");
            assert!(jumps.starts_with(&place), "{jumps}");
            let named = format!("time_s[300] = {far_s}: is ");
            assert!(jumps.contains(&named) && jumps.contains("the clock has jumped"), "{jumps}");
        }
        let stands = error(|log| {
            let times = &mut log.sources.get_mut(source).unwrap().time_s;
            for (k, t) in times.iter_mut().enumerate().take(300) {
                *t = k as f64 * 3e-12;
            }
        });
        assert!(stands.contains("its rate is 3.33"), "{stands}");
        assert!(stands.contains("e11 Hz, must be at most 1e5 Hz"), "{stands}");
    }
    // Each step is short enough, all of them are not.
    let long = error(|log| {
        for (k, t) in log.sources.get_mut("gnss").unwrap().time_s.iter_mut().enumerate() {
            *t = k as f64 * 3599.0;
        }
    });
    assert!(long.contains("after the first sample, at most 1e6"), "{long}");
}

#[test]
fn what_a_residual_needs_is_named() {
    let instead = "gnss.position_ned_m, gnss.velocity_ned_m_s or imu.acceleration_ned_m_s2 with \
                   attitude.q_ned_from_body_wxyz";
    for (source, channel, need) in [
        ("imu", "omega_body_rad_s", ", or attitude.q_ned_from_body_wxyz".to_owned()),
        ("imu", "specific_force_body_m_s2", format!(", or {instead}")),
        ("rotor", "command", String::new()),
    ] {
        let full = format!("{source}.{channel}");
        let missing = error(|log| {
            log.sources.get_mut(source).unwrap().channels.remove(channel);
            if source == "imu" {
                log.sources.remove("attitude");
            }
        });
        assert_eq!(missing, format!("f: {full}: missing; the residual needs it{need}"));
        let nan = error(|log| values(log, source, channel).fill(f64::NAN));
        let count = "none of its 301 samples has usable numbers, at least 2 are needed";
        assert_eq!(nan, format!("f: {full}: {count}"));
    }
    assert_eq!(find(&VehicleFile::squirrel(), &[]).unwrap_err(), GapError::NoFlights);
    let twice = [("f".to_owned(), hover(3.0)), ("f".to_owned(), hover(3.0))];
    assert_eq!(
        find(&VehicleFile::squirrel(), &twice).unwrap_err().to_string(),
        "f: two flights have this name"
    );
}

#[test]
fn what_the_log_lacks_is_noted() {
    let sagging = vehicle_with("squirrel.toml", &[SAGGING]);
    let note = |source: &str, channel: &str| {
        let mut log = hover(3.0);
        log.sources.get_mut(source).unwrap().channels.remove(channel);
        let notes = run(&sagging, &log).unwrap().notes;
        assert_eq!(notes.len(), 1, "{notes:?}");
        notes.into_iter().next().unwrap()
    };
    let still = "missing; drag is that of zero velocity over ground";
    assert_eq!(note("gnss", "velocity_ned_m_s"), format!("f: gnss.velocity_ned_m_s: {still}"));
    assert_eq!(
        note("attitude", "q_ned_from_body_wxyz"),
        format!("f: attitude.q_ned_from_body_wxyz: {still}")
    );
    assert!(
        note("battery", "voltage_v")
            .ends_with("battery_sag is that of the reference voltage, 14.8 V")
    );
    assert_eq!(note("wing", "command"), "f: wing.command: missing; the wings are taken as folded");

    assert!(note("baro", "altitude_m").ends_with("missing; what depends on height cannot be seen"));

    // Where no effect of the file feels the voltage, thrust may still lack it.
    let mut log = hover(3.0);
    log.sources.remove("battery");
    let finding = run(&VehicleFile::squirrel(), &log).unwrap();
    assert_eq!(finding.notes, ["f: battery.voltage_v: missing; thrust may be that of any charge"]);
    assert!(
        finding.places.iter().all(|place| !place.condition.contains(" V")),
        "{:?}",
        finding.places
    );
}

#[test]
fn shapes_and_times_that_cannot_be_are_refused() {
    let rotors = run(
        &vehicle_with(
            "crazyflie21_brushed.toml",
            &[(
                "yaw_sign = 1\n[[rotor]]\nposition_body_m = { value = [0.0325, -0.0325, 0.0], sd = [5e-4, 5e-4, 1e-3], source = \"manufacturer's data sheet\" }\nyaw_sign = -1",
                "yaw_sign = 1",
            )],
        ),
        &hover(3.0),
    );
    assert_eq!(
        rotors.unwrap_err().to_string(),
        "f: rotor.command: has 4 rotors, the vehicle crazyflie21_brushed has 3"
    );
    let width = error(|log| {
        let attitude = log.sources.get_mut("attitude").unwrap();
        attitude.channels.get_mut("q_ned_from_body_wxyz").unwrap().width = 3;
    });
    assert_eq!(width, "f: attitude.q_ned_from_body_wxyz: has 3 numbers a sample, must have 4");
    let length = error(|log| values(log, "gnss", "velocity_ned_m_s").truncate(902));
    assert_eq!(length, "f: gnss.velocity_ned_m_s: has 902 numbers, its time axis asks for 903");
    let backwards = error(|log| log.sources.get_mut("imu").unwrap().time_s[7] = 0.05);
    assert_eq!(
        backwards,
        "f: imu.specific_force_body_m_s2: time_s[7] = 0.05: must be finite and later than the sample before"
    );
    let nan = error(|log| log.sources.get_mut("rotor").unwrap().time_s[300] = f64::NAN);
    assert!(nan.starts_with("f: rotor.command: time_s[300] = NaN"), "{nan}");
    let huge = error(|log| values(log, "imu", "specific_force_body_m_s2")[450] = f64::MAX);
    assert!(
        huge.starts_with("f: force_body_x_n: the residual at ")
            && huge.ends_with("must be finite and below 1e100"),
        "{huge}"
    );
    let zero = error(|log| values(log, "attitude", "q_ned_from_body_wxyz")[400] = 0.0);
    assert_eq!(zero, "f: attitude.q_ned_from_body_wxyz: norm 0 at 1.000 s, must be 1 within 5 %");
    let empty = error(|log| *log = FlightLog::default());
    assert!(
        empty.starts_with("f: imu.specific_force_body_m_s2: missing; the residual needs it, or "),
        "{empty}"
    );
}

#[test]
fn a_flight_must_last_a_second_in_every_channel() {
    let squirrel = VehicleFile::squirrel();
    let short = run(&squirrel, &hover(1.4)).unwrap_err().to_string();
    assert_eq!(
        short,
        "f: imu.specific_force_body_m_s2: leaves 0.970 s of usable flight, at least 1 s are needed"
    );
    assert!(run(&squirrel, &hover(1.45)).is_ok());
    // A log with a gap in every quarter of a second.
    let torn = error(|log| {
        let omega = values(log, "imu", "omega_body_rad_s");
        for (row, numbers) in omega.chunks_exact_mut(3).enumerate() {
            if row % 75 < 8 {
                numbers.fill(f64::NAN);
            }
        }
    });
    assert_eq!(
        torn,
        "f: imu.omega_body_rad_s: leaves 0.920 s of usable flight, at least 1 s are needed; gaps cut the flight into 4 pieces, the longest of 0.660 s, and each loses 0.220 s at either end"
    );
    let cut = error(|log| values(log, "gnss", "velocity_ned_m_s")[300..].fill(f64::NAN));
    assert!(cut.starts_with("f: gnss.velocity_ned_m_s: leaves 0.560 s"), "{cut}");
    let slow = error(|log| {
        for t in &mut log.sources.get_mut("imu").unwrap().time_s {
            *t *= 3.0;
        }
    });
    assert_eq!(
        slow,
        "f: imu.specific_force_body_m_s2: its rate is 33.333 Hz, must be at least 48 Hz"
    );
}

/// A gap cuts the flight: both pieces lose their edges, and the jump between them leaves no
/// residual.
#[test]
fn a_gap_cuts_the_flight() {
    let squirrel = VehicleFile::squirrel();
    let mut log = hover(6.0);
    values(&mut log, "imu", "specific_force_body_m_s2")[3 * 300..3 * 306].fill(f64::NAN);
    // A step of thrust that happens inside the gap, and settles there.
    let before: Vec<f64> = values(&mut log, "rotor", "command").clone();
    for (k, u) in values(&mut log, "rotor", "command").iter_mut().enumerate() {
        *u = if k >= 4 * 300 { before[k] * 1.1_f64.sqrt() } else { before[k] };
    }
    for row in values(&mut log, "imu", "specific_force_body_m_s2")[3 * 306..].chunks_exact_mut(3) {
        row[2] *= 1.1;
    }
    let finding = run(&squirrel, &log).unwrap();
    let r = &finding.residual;
    assert_eq!(r.per_flight["f"].samples, (300 - 44) + (295 - 44));
    assert!(r.force_body_rms_n[2] < 1e-6, "{}", r.force_body_rms_n[2]);
}

/// A log may hold only the edges of the wing command, and commands that change between samples of a
/// slow IMU.
#[test]
fn wing_commands_may_come_as_edges() {
    let squirrel = vehicle_with("squirrel.toml", &[("\"membrane\"", "\"flat\"")]);
    let streamed = {
        let mut log = hover(4.0);
        values(&mut log, "wing", "command")[400..].fill(1.0);
        log
    };
    let mut edges = streamed.clone();
    edges.sources.remove("wing");
    edges.source_mut("wing").push(0.0, &[("command", &[0.0; 2])]);
    edges.source_mut("wing").push(2.0, &[("command", &[1.0; 2])]);
    let [a, b] = [streamed, edges].map(|mut log| {
        for row in values(&mut log, "gnss", "velocity_ned_m_s").chunks_exact_mut(3) {
            row.copy_from_slice(&[3.0, 0.0, 2.0]);
        }
        run(&squirrel, &log).unwrap()
    });
    assert!(a.residual.force_body_rms_n[2] > 0.1, "the wings of the model act");
    assert_eq!(a, b);
}

#[test]
fn a_vehicle_that_the_plant_cannot_step_is_refused() {
    let stiff = vehicle_with(
        "squirrel.toml",
        &[("value = 0.04, sd = 0.004", "value = 0.0004, sd = 0.00004")],
    );
    let message = run(&stiff, &hover(3.0)).unwrap_err().to_string();
    assert!(
        message.starts_with("squirrel: dt_s = 0.001") && message.contains("time_constant_up_s"),
        "{message}"
    );
}

/// Other vehicles and scales: a flight of a Crazyflie without attitude, velocity, height and
/// battery, each of which is said.
#[test]
fn a_log_of_motors_and_imu_alone_is_enough() {
    let flight = crate::support::flights("arpl-motorlag").join("log10.csv");
    let log = crate::support::imported("arpl.toml", &flight);
    let finding = run(&vehicle("crazyflie21_brushed.toml"), &log).unwrap();
    println!("{:?}\n{:?}\n{:?}", finding.residual, finding.notes, finding.places[0]);
    assert_eq!(finding.notes.len(), 4);
    assert!(
        finding.places[0].condition.starts_with("throttle 0."),
        "{}",
        finding.places[0].condition
    );
}
