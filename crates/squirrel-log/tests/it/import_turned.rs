//! What maps can do beyond columns: vectors turned by attitude, lists in cells, times of their own.

use super::import_support::Flight;
use std::f64::consts::FRAC_PI_2;

/// Pitched up by 90 deg, in FRD and NED.
const NOSE_UP: &str = "0.70710678118654757,0,0.70710678118654757,0";
const ATTITUDE: &str = r#""attitude.q_ned_from_body_wxyz" = { columns = ["qw", "qx", "qy", "qz"], order = "wxyz", direction = "world_from_body", world = "ned", body = "frd" }"#;

fn source(file: &str, channels: &str) -> String {
    format!(
        "[[source]]\nfile = \"{file}\"\ntime = {{ column = \"t\", unit = \"s\" }}\n[source.channels]\n{channels}\n"
    )
}

fn near(got: &[f64], expected: [f64; 3]) {
    for (got, expected) in got.iter().zip(expected) {
        assert!((got - expected).abs() < 1e-12, "{got} is not {expected}");
    }
}

#[test]
fn an_acceleration_in_the_world_becomes_what_the_accelerometer_feels() {
    // At rest, nose up: the accelerometer feels the support along its nose.
    let flight = Flight::new(
        "turn",
        &[("f.csv", &format!("t,ae,an,au,qw,qx,qy,qz\n0,0,0,0,{NOSE_UP}\n1,0,2,0,{NOSE_UP}\n"))],
    );
    let force = r#""imu.specific_force_body_m_s2" = { columns = ["ae", "an", "au"], world = "enu", turned_by = "attitude.q_ned_from_body_wxyz", gravity_m_s2 = 9.8 }"#;
    let map = source("f.csv", &format!("{ATTITUDE}\n{force}"));
    let (log, report) = flight.import(&map, &["f.csv"]).unwrap();
    let (_, own) = log.channel("imu.specific_force_body_m_s2").unwrap();
    near(own.row(0), [9.8, 0.0, 0.0]);
    // North is along the body's down axis reversed: nose up, the belly looks north.
    near(own.row(1), [9.8, 0.0, 2.0]);
    assert_eq!(report.channels.iter().map(|channel| channel.samples_missing).sum::<usize>(), 0);

    // And back: what an accelerometer feels, as an acceleration in the world.
    let back = r#""truth.acceleration_ned_m_s2" = { columns = ["ae", "an", "au"], body = "frd", turned_by = "attitude.q_ned_from_body_wxyz", gravity_m_s2 = 9.8 }"#;
    flight.write("f.csv", format!("t,ae,an,au,qw,qx,qy,qz\n0,9.8,0,2,{NOSE_UP}\n").as_bytes());
    let map = source("f.csv", &format!("{ATTITUDE}\n{back}"));
    let (log, _) = flight.import(&map, &["f.csv"]).unwrap();
    near(log.channel("truth.acceleration_ned_m_s2").unwrap().1.row(0), [2.0, 0.0, 0.0]);
}

/// Another file, other times: between two attitudes at constant speed, and none far from them.
#[test]
fn an_attitude_of_another_file_turns_at_the_time_of_the_vector() {
    let quarter = FRAC_PI_2 / 2.0;
    let flight = Flight::new(
        "turn",
        &[
            (
                "q.csv",
                &format!(
                    "t,qw,qx,qy,qz\n0,1,0,0,0\n0.1,{},0,0,{}\n9,1,0,0,0\n",
                    quarter.cos(),
                    quarter.sin()
                ),
            ),
            ("v.csv", "t,vx,vy,vz\n0,1,0,0\n0.05,1,0,0\n0.1,1,0,0\n0.2,1,0,0\n"),
        ],
    );
    let velocity = r#""gnss.velocity_ned_m_s" = { columns = ["vx", "vy", "vz"], body = "frd", turned_by = "attitude.q_ned_from_body_wxyz" }"#;
    let map = source("v.csv", velocity) + &source("q.csv", ATTITUDE);
    let (log, report) = flight.import_folder(&map).unwrap();
    let (_, own) = log.channel("gnss.velocity_ned_m_s").unwrap();
    near(own.row(0), [1.0, 0.0, 0.0]);
    near(own.row(1), [0.5_f64.sqrt(), 0.5_f64.sqrt(), 0.0]);
    near(own.row(2), [0.0, 1.0, 0.0]);
    assert!(own.row(3).iter().all(|x| x.is_nan()), "8.8 s from the next attitude");
    assert_eq!(report.channels[0].samples_missing, 1);

    flight.write("v.csv", b"t,vx,vy,vz\n5,1,0,0\n");
    let error = flight.import_folder(&map).unwrap_err();
    assert_eq!(
        flight.message(&error),
        "map.toml: source 1, `gnss.velocity_ned_m_s`: turned_by: no `attitude.q_ned_from_body_wxyz` within 0.1 s of any sample"
    );
    for (from, to, problem) in [
        (
            "turned_by = \"attitude.q_ned_from_body_wxyz\"",
            "turned_by = \"attitude.yaw_rad\"",
            "turned_by: `attitude.yaw_rad` is no attitude of this map",
        ),
        ("body = \"frd\", turned_by", "turned_by", "add `body` (frd or flu)"),
        ("body = \"frd\", turned_by", "world = \"ned\", turned_by", "add `body` (frd or flu)"),
        (
            "turned_by = \"attitude.q_ned_from_body_wxyz\"",
            "gravity_m_s2 = 9.8",
            "add `world` (ned, enu or nwu)",
        ),
    ] {
        let error = flight.import_folder(&map.replacen(from, to, 1)).unwrap_err();
        let message = flight.message(&error);
        assert!(message.starts_with("map.toml: source 1, `gnss.velocity_ned_m_s`: "), "{message}");
        if !to.contains("gravity") {
            assert!(message.ends_with(problem), "{message}");
        }
    }
}

#[test]
fn lists_in_cells_are_columns_by_their_elements() {
    let text = "t,u,v,n\n0,\"[1.0, 2.0]\",(3 4 5),7\n1,\"[nan,-2e3]\",(6),8\n2,,\"[1;None;2]\",9\n3,[],[],10\n";
    let flight = Flight::new("lists", &[("f.csv", text)]);
    let one =
        |columns: &[&str]| source("f.csv", &format!("\"truth.a\" = {{ columns = {columns:?} }}"));
    let (log, _) =
        flight.import(&one(&["u[1]", "u[0]", "v[0]", "v[1]", "v[2]", "n"]), &["f.csv"]).unwrap();
    let (_, a) = log.channel("truth.a").unwrap();
    let rows: Vec<String> = (0..4).map(|i| format!("{:?}", a.row(i))).collect();
    assert_eq!(
        rows,
        [
            "[2.0, 1.0, 3.0, 4.0, 5.0, 7.0]",
            "[-2000.0, NaN, 6.0, NaN, NaN, 8.0]",
            "[NaN, NaN, 1.0, NaN, 2.0, 9.0]",
            "[NaN, NaN, NaN, NaN, NaN, 10.0]",
        ]
    );
    for (text, columns, problem) in [
        (text, ["u[2]"], "f.csv: no column `u[2]`; nearest: u[0], u[1]"),
        (text, ["u"], "f.csv, column `u`, row 2: `[1.0, 2.0]` is no number"),
        ("t,u\n0,[1]\n1,2\n", ["u[0]"], "f.csv, column `u[0]`, row 3: `2` is no list of numbers"),
        (
            "t,u\n0,[1]\n1,[x]\n",
            ["u[0]"],
            "f.csv, column `u[0]`, row 3: `[x]` is no list of numbers",
        ),
        (
            "t,u\n0,[1]\n1,[inf]\n",
            ["u[0]"],
            "f.csv, column `u[0]`, row 3: `[inf]` is no list of numbers",
        ),
    ] {
        flight.write("f.csv", text.as_bytes());
        let message = flight.message(&flight.import(&one(&columns), &["f.csv"]).unwrap_err());
        assert!(message.starts_with(problem), "{message}");
    }
}

#[test]
fn channels_of_one_source_may_have_times_of_their_own() {
    let flight =
        Flight::new("union", &[("a.csv", "t,x\n0,1\n2,2\n"), ("b.csv", "t,y\n1,3\n2,4\n3,5\n")]);
    let map = source("a.csv", "\"truth.a\" = { columns = [\"x\"] }")
        + &source("b.csv", "\"truth.b\" = { columns = [\"y\"] }");
    assert!(flight.import_folder(&map).unwrap_err().to_string().contains("has other times"));
    let (log, report) = flight.import_folder(&format!("times = \"union\"\n{map}")).unwrap();
    let (time_s, a) = log.channel("truth.a").unwrap();
    assert_eq!(time_s, [0.0, 1.0, 2.0, 3.0]);
    assert_eq!(format!("{:?}", a.values), "[1.0, NaN, 2.0, NaN]");
    assert_eq!(format!("{:?}", log.channel("truth.b").unwrap().1.values), "[NaN, 3.0, 4.0, 5.0]");
    assert_eq!(report.channels[1].samples, 3);
}

#[test]
fn an_optional_channel_without_a_number_is_absent() {
    let flight = Flight::new("optional", &[("f.csv", "t,x,y\n0,1,nan\n1,2,\n")]);
    let map = source(
        "f.csv",
        "\"truth.a\" = { columns = [\"x\"] }\n\"battery.voltage_v\" = { columns = [\"y\"], optional = true }",
    );
    let (log, report) = flight.import(&map, &["f.csv"]).unwrap();
    assert!(log.sources.keys().eq(["truth"]));
    assert_eq!(report.absent[0].channel, "battery.voltage_v");
}
