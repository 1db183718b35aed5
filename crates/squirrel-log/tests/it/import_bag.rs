//! ROS 2 bags without a map: what each known type becomes, in whose frame, by whose clock.

use super::import_support::Flight;
use squirrel_log::FlightLog;
use squirrel_log::import::{ImportReport, import, map_of_bag};
use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::{Path, PathBuf};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/ros").join(name)
}

fn imported(name: &str, topics: &[&str]) -> (FlightLog, ImportReport, String) {
    let topics: Vec<String> = topics.iter().map(|&topic| topic.to_owned()).collect();
    let (map, notes) = map_of_bag(&data(name), &topics).unwrap();
    let (log, report) = import(&map, &[data(name)]).unwrap();
    (log, report, notes.join("\n"))
}

fn near(log: &FlightLog, channel: &str, expected: impl Fn(f64) -> Vec<f64>, tolerance: f64) {
    let (time_s, own) = log.channel(channel).unwrap_or_else(|| panic!("no {channel}"));
    assert_eq!(time_s.len(), 5, "{channel}");
    for i in 0..5 {
        let expected = expected(i as f64);
        assert_eq!(own.width, expected.len(), "{channel}");
        for (got, expected) in own.row(i).iter().zip(&expected) {
            assert!(
                (got - expected).abs() <= tolerance,
                "{channel} row {i}: {got}, not {expected}"
            );
        }
    }
}

/// A heading of NED, from north to east, as w x y z.
fn heading(rad: f64) -> Vec<f64> {
    vec![(rad / 2.0).cos(), 0.0, 0.0, (rad / 2.0).sin()]
}

#[test]
fn a_bag_of_mavros_is_turned_from_enu_and_flu() {
    let (log, _, notes) = imported("ros.mcap", &[]);
    near(&log, "imu.omega_body_rad_s", |i| vec![0.1 * i, 0.2, -0.3], 1e-15);
    near(&log, "imu.specific_force_body_m_s2", |i| vec![0.01, -0.02 * i, -9.81], 1e-15);
    near(&log, "gnss.position_ned_m", |i| vec![-0.25 * i, 1.5 * i, -2.0 - i], 1e-15);
    let yaw = |i: f64| 0.3 + 0.1 * i;
    near(&log, "attitude.q_ned_from_body_wxyz", |i| heading(FRAC_PI_2 - yaw(i)), 1e-12);
    let velocity = |i: f64| {
        let (sin, cos) = yaw(i).sin_cos();
        let (east, north) = (cos * (1.0 + i) - sin * 0.5, sin * (1.0 + i) + cos * 0.5);
        vec![north, east, 0.1]
    };
    near(&log, "gnss.velocity_ned_m_s", velocity, 1e-12);
    // sensor_msgs/BatteryState holds f32, and a current that flows out is negative.
    near(&log, "battery.voltage_v", |i| vec![15.5 - 0.1 * i], 1e-6);
    near(&log, "battery.current_a", |_| vec![3.25], 0.0);
    near(
        &log,
        "rotor.command",
        |i| [1100.0, 1200.0, 1300.0, 1400.0].map(|us| us + i).to_vec(),
        0.0,
    );
    let speed = |i: f64| (0..4).map(|k| (6000.0 + 10.0 * i + f64::from(k)) * TAU / 60.0).collect();
    near(&log, "rotor.speed_rad_s", speed, 1e-10);
    near(
        &log,
        "control.actuator_controls",
        |i| (0..8).map(|k| f64::from(k) * 0.1 + i).collect(),
        1e-6,
    );
    assert_eq!(log.metadata["time_zero_s"], "1700000000.1234567", "the stamps, not log_time");
    assert!(notes.contains("time: the stamps in the messages"), "{notes}");
    assert!(notes.contains("rotor.command: the first 4 of `/mavros/rc/out`, in us"), "{notes}");
}

#[test]
fn a_bag_of_px4_is_ned_and_frd_already() {
    let (log, _, notes) = imported("px4.mcap", &[]);
    let f = |x: f64| f64::from(x as f32);
    near(&log, "imu.omega_body_rad_s", |i| [0.1, 0.2 * i, -0.3].map(f).to_vec(), 0.0);
    near(&log, "imu.specific_force_body_m_s2", |i| [0.5, -0.1 * i, -9.8].map(f).to_vec(), 0.0);
    near(&log, "attitude.q_ned_from_body_wxyz", |i| heading(-0.4 + 0.1 * i), 1e-7);
    near(&log, "gnss.position_ned_m", |i| vec![1.0 + i, 2.0, -3.5], 0.0);
    near(&log, "gnss.velocity_ned_m_s", |i| vec![0.25, -0.5 * i, 0.125], 0.0);
    near(&log, "rotor.command", |i| [0.4 + 0.01 * i, 0.5, 0.6, 0.7].map(f).to_vec(), 0.0);
    near(&log, "battery.voltage_v", |i| vec![16.25 - 0.25 * i], 0.0);
    near(&log, "battery.current_a", |_| vec![8.5], 0.0);
    assert_eq!(log.metadata["time_zero_s"], "61");
    assert!(notes.contains("rotor.command: the first 4 of `/fmu/out/actuator_motors`"), "{notes}");
}

#[test]
fn one_topic_without_stamps_puts_all_on_the_clock_of_the_log() {
    let (log, report, notes) = imported("mocap.mcap", &[]);
    assert_eq!(log.metadata["time_zero_s"], "1700000000.123462");
    near(&log, "gnss.position_ned_m", |i| vec![-0.25 * i, 1.5 * i, -2.0 - i], 1e-15);
    near(&log, "gnss.velocity_ned_m_s", |i| vec![0.5, 1.0 + i, 0.1], 1e-15);
    assert!(log.channel("battery.voltage_v").is_some());
    // The current is NaN throughout.
    assert!(log.channel("battery.current_a").is_none());
    assert_eq!(report.absent[0].channel, "battery.current_a");
    for line in [
        "time: MCAP's log_time of all topics, since `/battery` has no stamps",
        "gnss.velocity_ned_m_s: `/vrpn/twist` is in the frame `world`, taken as the world's",
    ] {
        assert!(notes.contains(line), "{notes}");
    }
}

#[test]
fn two_topics_of_a_type_are_a_question() {
    let error = map_of_bag(&data("two_imus.mcap"), &[]).unwrap_err().to_string();
    let answer = "two_imus.mcap: `imu.omega_body_rad_s` is in the topics /front/imu, /rear/imu: choose by --topic NAME, or with --map";
    assert!(error.ends_with(answer), "{error}");
    let (log, report, _) = imported("two_imus.mcap", &["/rear/imu"]);
    assert_eq!(log.sources.len(), 2);
    assert!(report.files.iter().all(|file| file.topic.as_deref() == Some("/rear/imu")));
    let error = map_of_bag(&data("two_imus.mcap"), &["/imu".to_owned()]).unwrap_err().to_string();
    assert!(error.ends_with("--topic /imu: no topic of a known type has this name"), "{error}");
}

#[test]
fn what_is_no_bag_is_told_what_to_do() {
    let flight = Flight::new("bag", &[("a.csv", "t,x\n1,2\n")]);
    flight.write("old.bag", b"#ROSBAG V2.0\n");
    flight.write("old.db3", b"SQLite format 3\0");
    flight.write("odd.mcap", &std::fs::read(data("odd.mcap")).unwrap());
    for (path, problem) in [
        (
            "old.bag",
            "old.bag: a ROS 1 bag; import reads ROS 2's MCAP: `pip install rosbags`, then `rosbags-convert --src FLIGHT.bag --dst FOLDER --dst-storage mcap`",
        ),
        (
            "old.db3",
            "old.db3: a ROS 2 bag in SQLite; import reads MCAP: `pip install rosbags`, then `rosbags-convert --src FOLDER --dst OTHER --dst-storage mcap`",
        ),
        ("a.csv", "a.csv: no ROS 2 bag (MCAP): say by --map what its columns are"),
        ("odd.mcap", "odd.mcap: no ROS 2 topic of a known type (px4_msgs/VehicleAngularVelocity, "),
    ] {
        let error = map_of_bag(&flight.folder().join(path), &[]).unwrap_err();
        let message = flight.message(&error);
        assert!(message.starts_with(problem) && message.lines().count() == 1, "{message}");
    }
    // With a map, too.
    let map = "[[source]]\ntime = { column = \"t\", unit = \"s\" }\nchannels = { \"truth.a\" = { columns = [\"x\"] } }\n";
    let error = flight.import(map, &["old.bag"]).unwrap_err();
    assert!(flight.message(&error).starts_with("old.bag: a ROS 1 bag"), "{error}");
    // A folder as rosbag2 records it.
    flight.write("bag/metadata.yaml", b"");
    flight.write("bag/bag_0.mcap", &std::fs::read(data("px4.mcap")).unwrap());
    let folder = flight.folder().join("bag");
    let (map, _) = map_of_bag(&folder, &[]).unwrap();
    assert!(import(&map, &[folder]).unwrap().0.channel("rotor.command").is_some());
}
