//! Import of small CSVs written for the purpose: conventions, masks, time axes.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_6};
use std::fmt::Write;

use super::import_support::{Flight, OMEGA, one_source};
use nalgebra::{UnitQuaternion, Vector3};

#[test]
fn an_enu_flu_attitude_comes_out_as_ned_from_frd() {
    // Nose up 30 deg, heading east: in ENU the nose points along (cos 30, 0, sin 30) and FLU's left
    // points north, so world_from_body is a turn by -30 deg about y (north in ENU).
    let q_enu_from_flu = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -FRAC_PI_6);
    let nose_enu = q_enu_from_flu * Vector3::x();
    assert!((nose_enu - Vector3::new(0.75_f64.sqrt(), 0.0, 0.5)).norm() < 1e-12, "{nose_enu}");

    let q = q_enu_from_flu.inverse();
    let row = format!("{},{},{},{}", q.i, q.j, q.k, q.w);
    let flight =
        Flight::new("attitude", &[("f.csv", &format!("t,qx,qy,qz,qw\n0,{row}\n1,{row}\n"))]);
    let map = one_source(
        r#""attitude.q_ned_from_body_wxyz" = { columns = ["qx", "qy", "qz", "qw"], order = "xyzw", world = "enu", body = "flu", direction = "body_from_world" }"#,
    );
    let (log, _) = flight.import_file(&map).unwrap();
    let (_, channel) = log.channel("attitude.q_ned_from_body_wxyz").unwrap();

    let expected = UnitQuaternion::from_euler_angles(0.0, FRAC_PI_6, FRAC_PI_2);
    let &[w, i, j, k] = channel.row(1) else { panic!("not four numbers") };
    for (got, wanted) in [(w, expected.w), (i, expected.i), (j, expected.j), (k, expected.k)] {
        assert!((got - wanted).abs() < 1e-12, "{:?} is not {expected}", channel.row(1));
    }
}

#[test]
fn attitudes_are_normalised_and_their_sign_is_continuous() {
    // A slow turn about down, every third row with the other sign, 3 % too long; one cell is empty.
    let mut csv = "t,w,x,y,z\n".to_owned();
    for step in 0..100 {
        let half = 0.05 * f64::from(step);
        let length = if step % 3 == 0 { -1.03 } else { 1.03 };
        let x = if step == 50 { "" } else { "0" };
        writeln!(csv, "{step},{},{x},0,{}", length * half.cos(), length * half.sin()).unwrap();
    }
    let flight = Flight::new("sign", &[("f.csv", &csv)]);
    let map = one_source(
        r#""truth.q_ned_from_body_wxyz" = { columns = ["w", "x", "y", "z"], order = "wxyz", world = "ned", body = "frd", direction = "world_from_body" }"#,
    );
    let (log, report) = flight.import_file(&map).unwrap();
    let (_, channel) = log.channel("truth.q_ned_from_body_wxyz").unwrap();
    for step in 0..100_u8 {
        let half = 0.05 * f64::from(step);
        let row = channel.row(step.into());
        if step == 50 {
            assert!(
                row.iter().all(|x| x.is_nan()),
                "a rotation without one of its numbers is none"
            );
        } else {
            assert!(
                (row[0] - half.cos()).abs() < 1e-12 && (row[3] - half.sin()).abs() < 1e-12,
                "{row:?}"
            );
        }
    }
    assert_eq!(report.channels[0].samples_missing, 1);
}

#[test]
fn vectors_are_scaled_then_turned() {
    let flight = Flight::new("vector", &[("f.csv", "t,a,b,c\n0,1,2,3\n1,10,20,30\n")]);
    for (name, key, expected) in [
        ("gnss.position_ned_m", r#"world = "ned""#, [2.0, 7.0, 1.5]),
        ("gnss.position_ned_m", r#"world = "enu""#, [7.0, 2.0, -1.5]),
        ("gnss.position_ned_m", r#"world = "nwu""#, [2.0, -7.0, -1.5]),
        ("truth.force_body_n", r#"body = "frd""#, [2.0, 7.0, 1.5]),
        ("truth.force_body_n", r#"body = "flu""#, [2.0, -7.0, -1.5]),
    ] {
        let map = one_source(&format!(
            r#""{name}" = {{ columns = ["a", "b", "c"], scale = [2, 3.0, 0.5], offset = [0, 1, 0], {key} }}"#
        ));
        let (log, _) = flight.import_file(&map).unwrap();
        assert_eq!(log.channel(name).unwrap().1.row(0), expected, "{key}");
    }
}

#[test]
fn rotors_land_at_their_number_in_the_vehicle() {
    let flight = Flight::new("rotors", &[("f.csv", "t,a,b,c,d\n0,10,20,30,40\n1,11,21,31,41\n")]);
    let first_row = |rotors: &str| {
        let map = one_source(&format!(
            r#""rotor.command" = {{ columns = ["a", "b", "c", "d"]{rotors}, scale = 0.5 }}"#
        ));
        flight.import_file(&map).unwrap().0.channel("rotor.command").unwrap().1.row(0).to_vec()
    };
    assert_eq!(first_row(""), [5.0, 10.0, 15.0, 20.0]);
    assert_eq!(first_row(", rotors = [3, 1, 4, 2]"), [10.0, 20.0, 5.0, 15.0]);
}

#[test]
fn a_held_sensor_gets_its_own_slow_time_axis() {
    let csv = "t,x,y,z,v,i\n0,1,1,1,,\n1,1,1,1,12.5,1\n2,1,1,1,12.5,1\n3,1,1,1,12.4,1\n4,1,1,1,,2\n5,1,1,1,12.4,2\n";
    let flight = Flight::new("held", &[("f.csv", csv)]);
    let map = one_source(&format!(
        "{OMEGA}\n\
         \"battery.voltage_v\" = {{ columns = [\"v\"], repeats = \"forward_filled\" }}\n\
         \"battery.current_a\" = {{ columns = [\"i\"], repeats = \"forward_filled\" }}"
    ));
    let (log, report) = flight.import_file(&map).unwrap();
    assert_eq!(log.channel("imu.omega_body_rad_s").unwrap().0, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    let (time_s, voltage) = log.channel("battery.voltage_v").unwrap();
    assert_eq!(time_s, [1.0, 3.0, 4.0], "a row stays when voltage or current changes");
    assert_eq!(voltage.values[..2], [12.5, 12.4]);
    assert!(voltage.values[2].is_nan());
    let battery = report.channels.iter().find(|c| c.channel == "battery.voltage_v").unwrap();
    assert_eq!((battery.samples, battery.repeats_dropped, battery.samples_missing), (3, 3, 1));
}

#[test]
fn channels_of_one_source_share_their_time_axis_or_the_import_fails() {
    let flight = Flight::new(
        "axes",
        &[
            ("f.csv", "t,x,y,z\n0,1,1,1\n1,1,1,1\n2,2,2,2\n"),
            ("g.csv", "t,x,y,z\n0,1,1,1\n5,1,1,1\n"),
        ],
    );
    let map = one_source(&format!(
        "{OMEGA}\n\"imu.specific_force_body_m_s2\" = \
         {{ columns = [\"x\", \"y\", \"z\"], body = \"frd\", repeats = \"forward_filled\" }}"
    ));
    assert_eq!(
        flight.import_file(&map).unwrap_err().to_string(),
        "map.toml: `imu.specific_force_body_m_s2` has other times than the rest of `imu` (some are forward_filled and \
         some are not): give `repeats` to all of them or to none"
    );
    let two = r#"
        [[source]]
        file = "f.csv"
        time = { column = "t", unit = "s" }
        channels = { "truth.a" = { columns = ["x"] } }
        [[source]]
        file = "g.csv"
        time = { column = "t", unit = "s" }
        channels = { "truth.b" = { columns = ["x"] } }
    "#;
    assert_eq!(
        flight.import_folder(two).unwrap_err().to_string(),
        "map.toml: `truth.b` has other times than the rest of `truth` (they are read from another file or by another \
         time column): import one of them under a name of another source"
    );
    // Two tables over one file do share their times.
    let (log, _) = flight.import_folder(&two.replace("g.csv", "f.csv")).unwrap();
    assert_eq!(log.sources["truth"].channels.len(), 2);
    assert_eq!(log.metadata["imported_from"], "f.csv");
}

#[test]
fn all_files_share_one_time_zero_whatever_their_unit() {
    let flight = Flight::new(
        "zero",
        &[
            ("imu.csv", "stamp_us,x,y,z\n1772421915832047,0,0,0\n1772421915842047,0,0,1\n"),
            ("baro.csv", "t_ms,alt\n1772421915900,1\n1772421916000,2\n"),
            ("batt.csv", "t_ns,v\n0,12\n500000000,11\n"),
        ],
    );
    let map = r#"
        [[source]]
        file = "imu.csv"
        time = { column = "stamp_us", unit = "us" }
        channels = { "imu.omega_body_rad_s" = { columns = ["x", "y", "z"], body = "frd" } }
        [[source]]
        file = "baro.csv"
        time = { column = "t_ms", unit = "ms" }
        channels = { "baro.altitude_m" = { columns = ["alt"] } }
        [[source]]
        file = "batt.csv"
        time = { column = "t_ns", unit = "ns", offset_s = 1772421915.5 }
        channels = { "battery.voltage_v" = { columns = ["v"] } }
    "#;
    let (log, _) = flight.import_folder(map).unwrap();
    let near = |name: &str, expected: [f64; 2]| {
        let (time_s, _) = log.channel(name).unwrap();
        assert_eq!(time_s.len(), 2);
        for (got, wanted) in time_s.iter().zip(expected) {
            assert!((got - wanted).abs() < 3e-7, "{name}: {got} s, not {wanted} s");
        }
    };
    near("battery.voltage_v", [0.0, 0.5]);
    near("imu.omega_body_rad_s", [0.332_047, 0.342_047]);
    near("baro.altitude_m", [0.4, 0.5]);
    assert_eq!(log.metadata["time_zero_s"], "1772421915.5");
    assert_eq!(log.metadata["imported_from"], "imu.csv, baro.csv, batt.csv");
    assert_eq!(log.metadata["map"], map);
}

#[test]
fn a_mask_drops_rows_of_its_file_and_time_spans_of_the_others() {
    let mut imu = "t,x,y,z\n".to_owned();
    for tick in 0..=20 {
        writeln!(imu, "{},0,0,{tick}", f64::from(tick) * 0.25).unwrap();
    }
    let gnss = "t,n,e,d\n0,0,0,0\n1,0,0,-1\n2,0,0,-1\n3,0,0,0\n4,0,0,-1\n5,0,0,-1\n";
    let flight = Flight::new("mask", &[("imu.csv", &imu), ("gnss.csv", gnss)]);
    let map = r#"
        keep = "d < -0.5 and z != 5"
        [[source]]
        file = "imu.csv"
        time = { column = "t", unit = "s" }
        channels = { "imu.omega_body_rad_s" = { columns = ["x", "y", "z"], body = "frd" } }
        [[source]]
        file = "gnss.csv"
        time = { column = "t", unit = "s" }
        channels = { "gnss.position_ned_m" = { columns = ["n", "e", "d"], world = "ned" } }
    "#;
    let (log, report) = flight.import_folder(map).unwrap();
    // d < -0.5 keeps GNSS rows at 1, 2, 4, 5 s, so IMU rows in [1, 2] and [4, 5] s; z != 5 drops
    // the IMU row at 1.25 s, and of the other files what lies strictly between its neighbours: here
    // nothing.
    assert_eq!(log.metadata["time_zero_s"], "1");
    assert_eq!(log.channel("gnss.position_ned_m").unwrap().0, [0.0, 1.0, 3.0, 4.0]);
    let imu_s = log.channel("imu.omega_body_rad_s").unwrap().0;
    assert_eq!(imu_s, [0.0, 0.5, 0.75, 1.0, 3.0, 3.25, 3.5, 3.75, 4.0]);
    assert_eq!(
        report.to_string(),
        "imu.csv: 21 rows, 12 dropped by `keep`\ngnss.csv: 6 rows, 2 dropped by `keep`\n\
         imu.omega_body_rad_s from x, y, z: 9 samples at 4.0 Hz, a gap of 2.000 s\n\
         gnss.position_ned_m from n, e, d: 4 samples at 1.0 Hz\n"
    );
}

/// Files and topics often call their columns alike: that a row of one holds by itself does not
/// bring back a time that the other has dropped.
#[test]
fn a_mask_drops_time_spans_of_files_that_have_its_column_too() {
    let mut imu = "t,x,y,z\n".to_owned();
    for tick in 0..=20 {
        writeln!(imu, "{},0,0,9.8", f64::from(tick) * 0.25).unwrap();
    }
    let place = "t,x,y,z\n0,0,0,0\n1,0,0,1\n2,0,0,1\n3,0,0,0\n4,0,0,1\n5,0,0,1\n";
    let flight = Flight::new("alike", &[("imu.csv", &imu), ("place.csv", place)]);
    let map = r#"
        keep = "z > 0.4"
        [[source]]
        file = "imu.csv"
        time = { column = "t", unit = "s" }
        channels = { "imu.specific_force_body_m_s2" = { columns = ["x", "y", "z"], body = "flu" } }
        [[source]]
        file = "place.csv"
        time = { column = "t", unit = "s" }
        channels = { "gnss.position_ned_m" = { columns = ["x", "y", "z"], world = "nwu" } }
    "#;
    let (log, _) = flight.import_folder(map).unwrap();
    assert_eq!(log.channel("gnss.position_ned_m").unwrap().0, [0.0, 1.0, 3.0, 4.0]);
    let imu_s = log.channel("imu.specific_force_body_m_s2").unwrap().0;
    assert_eq!(imu_s, [0.0, 0.25, 0.5, 0.75, 1.0, 3.0, 3.25, 3.5, 3.75, 4.0]);
}

#[test]
fn masked_rows_may_have_a_broken_clock() {
    let flight =
        Flight::new("clock", &[("f.csv", "t,x,y,z\n900,0,0,0\n901,0,0,0\n1,1,0,0\n2,1,0,0\n")]);
    let (log, _) = flight.import_file(&format!("keep = \"x > 0\"\n{}", one_source(OMEGA))).unwrap();
    assert_eq!(log.channel("imu.omega_body_rad_s").unwrap().0, [0.0, 1.0]);
}

#[test]
fn the_file_may_be_named_in_every_way() {
    let csv = "t,x,y,z\n0,0,0,0\n1,0,0,0\n";
    let flight = Flight::new("paths", &[("a.csv", csv), ("b.csv", csv)]);
    let with_file = one_source(OMEGA).replace("time =", "file = \"a.csv\"\ntime =");
    let by_folder = flight.import(&with_file, &[""]).unwrap().0;
    let by_file = flight.import(&with_file, &["a.csv"]).unwrap().0;
    assert_eq!(by_folder, by_file);
    let by_path_alone = flight.import(&one_source(OMEGA), &["b.csv"]).unwrap().0;
    assert_eq!(by_path_alone.sources, by_file.sources);
    assert_eq!(by_path_alone.metadata["imported_from"], "b.csv");
}

#[test]
fn the_way_a_csv_is_written_does_not_matter() {
    let plain = "t,x,y,z\n0,1,2,3\n1,4,5,6\n";
    let read = |csv: &str| {
        let flight = Flight::new("spelling", &[("f.csv", csv)]);
        flight.import_file(&one_source(OMEGA)).unwrap().0
    };
    let expected = read(plain);
    for csv in [
        plain.replace('\n', "\r\n"),
        plain.trim_end().to_owned(),
        format!("\u{feff}{plain}"),
        format!("\n\n{}\n\n", plain.replace("\n1", "\n\n1")),
        format!("{}\r\n", plain.replace('\n', "\r\n\r\n")),
        plain.replace(',', " ,\t"),
        plain.replace("t,", "\"t\",").replace("0,1", "\"0\",\"1\""),
        plain.replace("t,x", "t,note,x").replace("0,1", "0,\"a, b\",1").replace("1,4", "1,,4"),
        plain.replace("0,1", "0.0e0,+1."),
    ] {
        assert_eq!(read(&csv), expected, "{csv:?}");
    }
}

#[test]
fn a_file_without_an_optional_channel_is_imported_and_said_to_lack_it() {
    let with = "t,v,r,y\n0,3.7,0.1,0.2\n1,3.6,0.1,0.2\n";
    let without = "t,v,r\n0,3.7,0.1\n1,3.6,0.1\n";
    let flight = Flight::new("optional", &[("with.csv", with), ("without.csv", without)]);
    let channels = |optional: &str| {
        one_source(&format!(
            r#""battery.voltage_v" = {{ columns = ["v"] }}
"attitude.roll_rad" = {{ columns = ["r"] }}
"attitude.yaw_rad" = {{ columns = ["y"]{optional} }}"#
        ))
    };
    let (log, report) = flight.import(&channels(", optional = true"), &["with.csv"]).unwrap();
    assert_eq!(log.channel("attitude.yaw_rad").unwrap().1.values, [0.2, 0.2]);
    assert!(report.absent.is_empty());

    let (log, report) = flight.import(&channels(", optional = true"), &["without.csv"]).unwrap();
    assert!(log.channel("attitude.yaw_rad").is_none());
    assert_eq!(log.channel("attitude.roll_rad").unwrap().1.values, [0.1, 0.1]);
    let said = report.to_string();
    assert!(said.ends_with("attitude.yaw_rad: left out, the file has no column `y`\n"), "{said}");

    let error = flight.import(&channels(""), &["without.csv"]).unwrap_err();
    assert!(flight.message(&error).contains("no column `y`"), "{error}");
}
