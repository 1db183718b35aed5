//! Logs of autopilots without a map: which channel is made of what, in which frame, and what is
//! said of it.

use std::f64::consts::TAU;

use squirrel_log::FlightLog;
use squirrel_log::import::{ImportReport, import_without_map, parameters};

use crate::import_fields::data;
use crate::import_support::Flight;

fn read(file: &str) -> (FlightLog, ImportReport) {
    import_without_map(&data(file), &|_, _| {}).unwrap()
}

fn written(flight: &Flight, file: &str, bytes: &[u8]) -> (FlightLog, ImportReport) {
    flight.write(file, bytes);
    import_without_map(&flight.folder().join(file), &|_, _| {}).unwrap()
}

/// The samples of a channel that are there.
fn samples<'l>(log: &'l FlightLog, name: &str) -> Vec<(f64, &'l [f64])> {
    let (time_s, channel) = log.channel(name).unwrap_or_else(|| panic!("no {name}"));
    let rows = channel.values.chunks_exact(channel.width);
    time_s.iter().copied().zip(rows).filter(|(_, row)| !row.iter().any(|x| x.is_nan())).collect()
}

/// Fields of the messages of one name as DFReader reads them.
fn dfreader(name: &str, fields: &[&str]) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(data("ardupilot/quad.dfreader.csv")).unwrap();
    let rows = text.lines().filter(|line| line.starts_with(&format!("{name},")));
    rows.map(|line| {
        let value = |field: &&str| {
            let cell = line.split(',').find_map(|cell| cell.strip_prefix(&format!("{field}=")));
            cell.unwrap().parse().unwrap()
        };
        fields.iter().map(value).collect()
    })
    .collect()
}

fn close(a: &[f64], b: &[f64], tolerance: f64) {
    assert_eq!(a.len(), b.len());
    let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart <= tolerance, "{a:?} and {b:?}");
}

#[test]
fn an_ardupilot_log_needs_no_map() {
    let (log, report) = read("ardupilot/quad.bin");
    let imu = dfreader("IMU", &["I", "TimeUS", "GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ"]);
    let first: Vec<&Vec<f64>> = imu.iter().filter(|row| row[0] == 0.0).collect();
    let (omega, force) =
        (samples(&log, "imu.omega_body_rad_s"), samples(&log, "imu.specific_force_body_m_s2"));
    assert_eq!((omega.len(), force.len()), (first.len(), first.len()));
    for ((row, omega), force) in first.iter().zip(omega).zip(force) {
        assert_eq!((omega.1, force.1), (&row[2..5], &row[5..8]));
        assert_eq!(omega.0, (row[1] - 2e6) / 1e6);
    }
    // SERVO3 is motor 1, then 2, 4 and 6; MOT_PWM_MIN is 1050, MOT_PWM_MAX 1950.
    let pulses = dfreader("RCOU", &["C3", "C2", "C4", "C6"]);
    let commands = samples(&log, "rotor.command");
    assert_eq!(commands.len(), pulses.len());
    for (pulses, (_, command)) in pulses.iter().zip(commands) {
        let fraction = |us: &f64| ((us - 1050.0) / 900.0).clamp(0.0, 1.0);
        assert_eq!(command, pulses.iter().map(fraction).collect::<Vec<_>>());
    }
    // ESC 2 is on output 3, which is motor 1: its times are those of the channel.
    let esc = dfreader("ESC", &["Instance", "TimeUS", "RPM"]);
    let speeds = samples(&log, "rotor.speed_rad_s");
    let own = |n: f64| esc.iter().filter(move |row| row[0] == n);
    assert_eq!(speeds.len(), own(2.0).count());
    for (i, (t, speed)) in speeds.iter().enumerate() {
        let rpm = |n: f64| own(n).nth(i).unwrap();
        assert_eq!(*t, (rpm(2.0)[1] - 2e6) / 1e6);
        let expected = [2.0, 1.0, 3.0, 5.0].map(|n| rpm(n)[2] * (TAU / 60.0));
        assert_eq!(*speed, expected);
    }
    // XKQ agrees with ATT and is as frequent; it was written of the same angles.
    let q = dfreader("XKQ", &["C", "Q1", "Q2", "Q3", "Q4"]);
    let attitude = samples(&log, "attitude.q_ned_from_body_wxyz");
    let own: Vec<&Vec<f64>> = q.iter().filter(|row| row[0] == 0.0).collect();
    assert_eq!(attitude.len(), own.len());
    for (row, (_, q)) in own.iter().zip(&attitude) {
        let sign = (0..4).map(|k| row[k + 1] * q[k]).sum::<f64>().signum();
        close(q, &[row[1], row[2], row[3], row[4]].map(|x| x * sign), 1e-6);
    }
    let state = dfreader("XKF1", &["C", "PN", "PE", "PD", "VN", "VE", "VD"]);
    let position = samples(&log, "gnss.position_ned_m");
    let velocity = samples(&log, "gnss.velocity_ned_m_s");
    for (i, row) in state.iter().filter(|row| row[0] == 0.0).enumerate() {
        assert_eq!((position[i].1, velocity[i].1), (&row[1..4], &row[4..7]));
    }
    let bat = dfreader("BAT", &["Volt", "Curr"]);
    for (i, row) in bat.iter().enumerate() {
        assert_eq!(samples(&log, "battery.voltage_v")[i].1, &row[..1]);
        assert_eq!(samples(&log, "battery.current_a")[i].1, &row[1..]);
    }
    let text = report.to_string();
    for line in [
        "rotor.command from RCOU.C3, RCOU.C2, RCOU.C4, RCOU.C6 (pulses, us; from MOT_PWM_MIN = 0 to MOT_PWM_MAX = 1): 10 samples at 10.0 Hz",
        "rotor.command: motors 1 to 4 are RCOU C3, C2, C4, C6 by SERVOn_FUNCTION",
        "actuators at 10 Hz: motor_lag and actuation_latency cannot be judged; set bits 0, 10 and 18 of LOG_BITMASK",
        "angular rate at 25 Hz",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    assert!(log.metadata["parameters_json"].contains("\"MOT_THST_HOVER\":0.20000000298023224"));
}

#[test]
fn attitudes_of_ardupilot_are_of_frd_in_ned() {
    // Without XKQ the angles are taken: nose up 12.62 deg at first, heading 350 deg.
    let bytes = std::fs::read(data("ardupilot/quad.bin")).unwrap();
    let flight = Flight::new("attitude", &[]);
    let mut renamed = bytes;
    let at = renamed.windows(4).position(|name| name == b"XKQ\0").unwrap();
    renamed[at..at + 3].copy_from_slice(b"XXX");
    let (log, _) = written(&flight, "x.bin", &renamed);
    let attitude = samples(&log, "attitude.q_ned_from_body_wxyz");
    let angles = dfreader("ATT", &["Roll", "Pitch", "Yaw"]);
    assert_eq!(attitude.len(), angles.len());
    let q = nalgebra::Quaternion::new(
        attitude[0].1[0],
        attitude[0].1[1],
        attitude[0].1[2],
        attitude[0].1[3],
    );
    let nose = nalgebra::UnitQuaternion::from_quaternion(q) * nalgebra::Vector3::x();
    let (pitch, yaw) = (angles[0][1].to_radians(), angles[0][2].to_radians());
    close(nose.as_slice(), &[pitch.cos() * yaw.cos(), pitch.cos() * yaw.sin(), -pitch.sin()], 1e-9);
}

#[test]
fn a_px4_log_needs_no_map_and_is_told_its_rates() {
    let (log, report) = read("ulog/sample_cut.ulg");
    let text = report.to_string();
    for line in [
        "sample_cut.ulg (PX4 ULog)",
        "imu.omega_body_rad_s from sensor_combined.gyro_rad[0], sensor_combined.gyro_rad[1], sensor_combined.gyro_rad[2] (rad/s, FRD): 864 samples",
        "rotor.command: the first 4 outputs, for the vehicle has 4 rotors",
        "actuators at 19 Hz: motor_lag and actuation_latency cannot be judged; set SDLOG_PROFILE to 17",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    assert_eq!(log.channel("rotor.command").unwrap().1.width, 4);
    // At rest on the ground: gravity is up, z is down.
    let force = samples(&log, "imu.specific_force_body_m_s2");
    let mean = force.iter().map(|(_, f)| f[2]).sum::<f64>() / force.len() as f64;
    assert!((-10.3..-9.3).contains(&mean), "{mean}");
}

#[test]
fn a_blackbox_log_needs_no_map() {
    let (log, report) = read("blackbox/sitl.bbl");
    let text = report.to_string();
    assert!(text.contains("sitl.bbl (blackbox, Betaflight 4.6.0 () SITL)"), "{text}");
    assert!(text.contains("rotor.command from frame.motor[0]"), "{text}");
    assert!(!text.contains("cannot be judged"), "{text}");
    let command = samples(&log, "rotor.command");
    assert!(command.iter().all(|(_, row)| row.iter().all(|x| (0.0..=1.0).contains(x))));
    let spread = |i: usize| {
        let of = |pick: fn(f64, f64) -> f64, from| {
            command.iter().fold(from, |m, (_, row)| pick(m, row[i]))
        };
        of(f64::max, 0.0) - of(f64::min, 1.0)
    };
    assert!((0..4).all(|i| spread(i) > 0.2), "the motors have something to do");
    // On the ground: 1 g up. In FRD up is negative.
    let force = samples(&log, "imu.specific_force_body_m_s2");
    close(&force[10].1[2..], &[-9.806_65], 0.2);
    // The attitude turns as the gyroscope says, both in FRD and NED: signs and frames agree.
    let (rates, attitude) =
        (samples(&log, "imu.omega_body_rad_s"), samples(&log, "attitude.q_ned_from_body_wxyz"));
    let unit = |q: &[f64]| {
        nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[0], q[1], q[2], q[3]))
    };
    let (mut along, mut own, mut turned) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    let step = 40;
    for i in (0..attitude.len() - step).step_by(step) {
        let (a, b) = (&attitude[i], &attitude[i + step]);
        let turn = (unit(a.1).inverse() * unit(b.1)).scaled_axis() / (b.0 - a.0);
        for axis in 0..3 {
            let rate = rates[i..i + step].iter().map(|(_, w)| w[axis]).sum::<f64>() / step as f64;
            along[axis] += rate * turn[axis];
            own[axis] += rate * rate;
            turned[axis] += turn[axis] * turn[axis];
        }
    }
    for axis in 0..3 {
        let correlation = along[axis] / (own[axis] * turned[axis]).sqrt();
        assert!(correlation > 0.8, "axis {axis}: {correlation}");
    }
}

/// A blackbox log of intra frames alone: every number as signed VB of itself.
fn blackbox(firmware: &str, extra: &str, rows: &[&[i64]]) -> Vec<u8> {
    let names = "loopIteration,time,gyroADC[0],gyroADC[1],gyroADC[2],motor[0],motor[1],eRPM[0],eRPM[1],vbatLatest,amperageLatest";
    let list = |text: &str| [text; 11].join(",");
    let mut log = format!(
        "H Product:Blackbox flight data recorder by Nicholas Sherlock\nH Data version:2\nH Firmware type:Cleanflight\n\
         H Firmware revision:{firmware}\nH I interval:1\nH Field I name:{names}\nH Field I signed:0,0,1,1,1,0,0,0,0,0,1\n\
         H Field I predictor:{zeros}\nH Field I encoding:1,1,{signed},0\nH Field P predictor:{zeros}\n\
         H Field P encoding:1,1,{signed},0\nH gyro_scale:0x3f800000\nH motorOutput:48,2047\n{extra}",
        zeros = list("0"),
        signed = ["0"; 8].join(",")
    )
    .into_bytes();
    for row in rows {
        log.push(b'I');
        for (i, &number) in row.iter().enumerate() {
            let mut bits =
                if i < 2 { number as u64 } else { ((number << 1) ^ (number >> 63)) as u64 };
            while bits > 127 {
                log.push((bits & 127) as u8 | 128);
                bits >>= 7;
            }
            log.push(bits as u8);
        }
    }
    log
}

const ROWS: [&[i64]; 3] = [
    &[0, 1_000_000, 10, 20, 30, 48, 2047, 300, 310, 1642, 512],
    &[1, 1_000_500, -10, 20, -30, 1047, 1048, 301, 311, 1641, -3],
    &[2, 1_001_000, 11, -21, 31, 1047, 3000, 302, 312, 1640, 513],
];

#[test]
fn rotor_speeds_and_frames_of_a_blackbox_log() {
    let flight = Flight::new("blackbox", &[]);
    let bytes = blackbox(
        "Betaflight 4.5.1 (abc) STM32",
        "H motor_poles:14\nH motor_pwm_protocol:6\n",
        &ROWS,
    );
    let (log, _) = written(&flight, "a.bbl", &bytes);
    let omega = samples(&log, "imu.omega_body_rad_s");
    close(omega[0].1, &[10.0_f64, -20.0, -30.0].map(f64::to_radians), 1e-12);
    let speed = samples(&log, "rotor.speed_rad_s");
    // 300 is 30 000 electrical turns a minute: 14 poles are 7 pairs.
    close(speed[0].1, &[30_000.0 / 7.0 * TAU / 60.0, 31_000.0 / 7.0 * TAU / 60.0], 1e-9);
    let command = samples(&log, "rotor.command");
    close(command[0].1, &[0.0, 1.0], 0.0);
    close(command[2].1, &[999.0 / 1999.0, 1.0], 1e-12);
    assert_eq!(samples(&log, "battery.voltage_v")[1].1, [16.41]);
    assert_eq!(samples(&log, "battery.current_a")[1].1, [-0.03]);
    assert_eq!(parameters(&flight.folder().join("a.bbl")).unwrap()["motorOutput[1]"], 2047.0);
}

#[test]
fn whatever_firmware_wrote_them_frames_read_the_same() {
    let flight = Flight::new("firmware", &[]);
    let known = "H motor_poles:14\nH debug_mode:3\nH motor_pwm_protocol:6\n";
    let reference =
        written(&flight, "a.bbl", &blackbox("Betaflight 4.5.1 (abc) X", known, &ROWS)).0;
    let later = "H motor_poles:14\nH debug_mode:250\nH motor_pwm_protocol:99\n";
    for (firmware, extra) in [
        ("Betaflight 4.6.0 () SITL", known),
        ("Betaflight 2025.12.1 (f) X", later),
        ("Indiflight 1.0.0-rc.1 (f) X", later),
        ("INAV 7.1.2 (f) X", known),
        ("INAV 9.0.0 (f) X", later),
        ("EmuFlight 0.4.1 (f) X", "H motor_poles:14\n"),
        ("", known),
    ] {
        let (log, report) = written(&flight, "b.bbl", &blackbox(firmware, extra, &ROWS));
        assert_eq!(log.sources, reference.sources, "{firmware}");
        assert!(report.files[0].file.contains(firmware));
    }
    // Old firmware writes the battery in other units: it is left out, and said.
    let (log, report) =
        written(&flight, "c.bbl", &blackbox("Betaflight 3.5.7 (f) X", known, &ROWS));
    assert!(!log.sources.contains_key("battery"));
    assert!(
        report.to_string().contains("battery: left out, betaflight 3.5.7 writes other units")
            || report
                .to_string()
                .contains("battery: left out, Betaflight 3.5.7 writes other units")
    );
    assert_eq!(log.sources["rotor"], reference.sources["rotor"]);
}

#[test]
fn of_several_logs_in_a_file_the_longest_is_taken() {
    let flight = Flight::new("several", &[]);
    let known = "H motor_poles:14\nH motor_pwm_protocol:6\n";
    let one = |rows: &[&[i64]]| blackbox("Betaflight 4.5.1 (abc) X", known, rows);
    let file = [one(&ROWS[..1]), one(&ROWS), one(&ROWS[1..])].concat();
    let (log, report) = written(&flight, "a.bbl", &file);
    assert_eq!(log.sources["imu"].time_s, [0.0, 0.0005, 0.001]);
    assert!(report.to_string().contains("log 2 of 3 in the file, the longest"));
}

#[test]
fn kinds_are_told_from_content() {
    let flight = Flight::new("names", &[]);
    for file in ["ardupilot/quad.bin", "ulog/sample_cut.ulg", "blackbox/sitl.bbl"] {
        let bytes = std::fs::read(data(file)).unwrap();
        let (log, _) = written(&flight, "log.csv", &bytes);
        // As text, for there are NaN.
        assert!(format!("{:?}", log.sources) == format!("{:?}", read(file).0.sources), "{file}");
    }
    flight.write("t.csv", b"t,x\n1,2\n");
    let error = import_without_map(&flight.folder().join("t.csv"), &|_, _| {}).unwrap_err();
    assert!(flight.message(&error).starts_with("t.csv: needs --map"), "{error}");
    let error = import_without_map(flight.folder(), &|_, _| {}).unwrap_err();
    assert!(error.to_string().contains("needs --map"), "{error}");
}

#[test]
fn what_is_whole_of_a_damaged_ardupilot_log_is_read() {
    let flight = Flight::new("damaged", &[]);
    let mut bytes = std::fs::read(data("ardupilot/quad.bin")).unwrap();
    let whole = samples(&read("ardupilot/quad.bin").0, "rotor.command").len();
    let middle = bytes.len() / 2;
    bytes[middle..middle + 300].fill(0xFF);
    bytes.truncate(bytes.len() - 10);
    let (log, report) = written(&flight, "x.bin", &bytes);
    let left = samples(&log, "rotor.command").len();
    assert!(left >= whole - 2, "{left} of {whole}");
    let text = report.to_string();
    assert!(text.contains("bytes are no whole message and were skipped"), "{text}");
    assert!(text.contains("the file ends inside a record"), "{text}");
}
