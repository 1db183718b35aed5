//! Every way an import can fail says in one line what is wrong, where, and with which value.

use super::import_support::{Flight, OMEGA, one_source};

const GOOD_CSV: &str = "t,x,y,z\n0,1,2,3\n1,4,5,6\n";

#[test]
fn a_bad_file_names_file_column_row_and_value() {
    for (csv, message) in [
        ("", "f.csv: empty file"),
        ("\n\r\n", "f.csv: empty file"),
        ("t,x,y,z\n", "f.csv: a header and no rows"),
        ("t,x,yy,z\n0,1,2,3\n", "f.csv: no column `y`; nearest: t, x, yy"),
        ("t,x,y,y,z\n0,1,2,2,3\n", "f.csv: column `y` is in the header 2 times"),
        ("t,x,y,z\n0,1,2,3\n1,4,oops,6\n", "f.csv, column `y`, row 3: `oops` is no number"),
        (
            "t,x,y,z\r\n0,1,2,3\r\n\r\n1,4,0x1F,6\r\n",
            "f.csv, column `y`, row 4: `0x1F` is no number",
        ),
        ("\n\nt,x,y,z\n\n0,1,2,3\n1,4,\"1,5\",6", "f.csv, column `y`, row 6: `1,5` is no number"),
        ("t,x,y,z\n0,1,2,-inf\n", "f.csv, column `z`, row 2: `-inf` is infinite"),
        ("t,x,y,z\n0,1,2,1e999\n", "f.csv, column `z`, row 2: `1e999` is infinite"),
        ("t,x,y,z\n0,1,2,3\n1,4,5\n", "f.csv, row 3: 3 cells, the header has 4"),
        ("t,x,y,z\n0,1,2,3\n1,4,5,6,7\n", "f.csv, row 3: 5 cells, the header has 4"),
        ("t,x,y,z\n0,1,2,3\n,4,5,6\n", "f.csv, column `t`, row 3: `` is no time"),
        ("t,x,y,z\nnan,1,2,3\n", "f.csv, column `t`, row 2: `` is no time"),
        (
            "t,x,y,z\n0.5,1,2,3\n0.25,1,2,3\n",
            "f.csv, column `t`, row 3: time runs backwards: 0.25 after 0.5 in row 2",
        ),
        (
            "t,x,y,z\n0.5,1,2,3\n0.5,1,2,3\n",
            "f.csv, column `t`, row 3: time repeats: 0.5 after 0.5 in row 2",
        ),
        (
            "t,x,y,z\n0,1,2,3\n1e300,1,2,3\n",
            "f.csv, column `t`, row 3: `1e300` is too long after the first time: a log holds 1.8e10 s",
        ),
        (
            "t,x,y,z\n0,,nan,\n1,,NaN,\n",
            "f.csv, columns x, y, z: `imu.omega_body_rad_s` has no number in any kept row",
        ),
    ] {
        let flight = Flight::new("bad", &[("f.csv", csv)]);
        let error = flight.import_file(&one_source(OMEGA)).unwrap_err();
        assert_eq!(flight.message(&error), message, "{csv:?}");
    }
}

#[test]
fn bytes_that_are_no_text_are_an_error_not_a_panic() {
    let flight = Flight::new("bytes", &[]);
    for bytes in [&b"\xff\xfe\x00t"[..], b"t,x,y,z\n0,\xff,2,3\n", b"\0\0\0\0", b"t,x,y,z\n\"0,1"] {
        flight.write("f.csv", bytes);
        let message = flight.message(&flight.import_file(&one_source(OMEGA)).unwrap_err());
        assert!(message.starts_with("f.csv") && !message.contains('\n'), "{message}");
    }
}

/// As a spreadsheet saves "Unicode text", with and without its mark.
#[test]
fn text_of_two_bytes_a_letter_is_told_as_such() {
    let flight = Flight::new("utf-16", &[]);
    let little: Vec<u8> = GOOD_CSV.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let big: Vec<u8> = GOOD_CSV.encode_utf16().flat_map(u16::to_be_bytes).collect();
    for bytes in
        [[b"\xff\xfe", &little[..]].concat(), [b"\xfe\xff", &big[..]].concat(), little, big]
    {
        flight.write("f.csv", &bytes);
        let message = flight.message(&flight.import_file(&one_source(OMEGA)).unwrap_err());
        assert!(message.starts_with("f.csv: is UTF-16 text; import reads UTF-8"), "{message}");
    }
}

#[test]
fn a_rate_that_no_log_has_is_told_with_the_unit_of_time() {
    let notes = |step: f64| {
        let rows = (0..5).map(|i| format!("{},{i},2,3", f64::from(i) * step));
        let csv = ["t,x,y,z".to_owned()].into_iter().chain(rows).collect::<Vec<_>>().join("\n");
        let flight = Flight::new("rate", &[("f.csv", &csv)]);
        flight.import_file(&one_source(OMEGA)).unwrap().1.notes
    };
    assert!(notes(1e-4).is_empty());
    let told = notes(1e-6);
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(told[0].starts_with("imu.omega_body_rad_s: at 1.0e6 Hz"), "{told:?}");
    assert!(told[0].ends_with("the map's time unit may be wrong"), "{told:?}");
}

#[test]
fn a_quaternion_that_is_no_rotation_names_row_and_norm() {
    let map = one_source(
        r#""attitude.q_ned_from_body_wxyz" = { columns = ["w", "x", "y", "z"], order = "wxyz", world = "ned", body = "frd", direction = "world_from_body" }"#,
    );
    let flight = Flight::new("norm", &[("f.csv", "t,w,x,y,z\n0,1.04,0,0,0\n1,0,0,0.94,0\n")]);
    assert_eq!(
        flight.message(&flight.import_file(&map).unwrap_err()),
        "f.csv, columns w, x, y, z, row 3: quaternion norm 0.9400 is more than 5 % away from 1"
    );
}

#[test]
fn a_number_that_overflows_by_scale_is_an_error() {
    let flight = Flight::new("overflow", &[("f.csv", "t,x\n0,1\n1,1e300\n")]);
    let map = one_source(r#""truth.a" = { columns = ["x"], scale = 1e10 }"#);
    let message = flight.message(&flight.import_file(&map).unwrap_err());
    assert!(message.starts_with("f.csv, column `x`, row 3: "), "{message}");
    assert!(message.ends_with("is infinite after scale and offset"), "{message}");
}

#[test]
fn a_bad_channel_says_what_to_write() {
    const XYZ: &str = r#"columns = ["x", "y", "z"]"#;
    for (name, keys, problem) in [
        (
            "imu.omega",
            format!(r#"{XYZ}, body = "frd""#),
            "no such channel; nearest: imu.omega_body_rad_s, imu.acceleration_ned_m_s2, \
             imu.specific_force_body_m_s2; truth.*, \
             reference.* and control.* are open",
        ),
        (
            "time_s",
            r#"columns = ["t"]"#.into(),
            "time is not a channel: write `time = { column, unit }`",
        ),
        ("imu.omega_body_rad_s", XYZ.into(), "add `body` (frd or flu)"),
        ("gnss.position_ned_m", XYZ.into(), "add `world` (ned, enu or nwu)"),
        (
            "gnss.position_ned_m",
            r#"columns = ["x"], world = "ned""#.into(),
            "columns: wants 3, got 1",
        ),
        (
            "attitude.q_ned_from_body_wxyz",
            r#"columns = ["t", "x", "y", "z"], world = "ned""#.into(),
            "add `order` (wxyz or xyzw), `direction` (world_from_body or body_from_world), `body` (frd or flu)",
        ),
        (
            "imu.omega_body_rad_s",
            format!(r#"{XYZ}, body = "frd", world = "ned""#),
            "`world` means nothing for this channel: leave it out",
        ),
        (
            "baro.altitude_m",
            r#"columns = ["x"], rotors = [1]"#.into(),
            "`rotors` means nothing for this channel: leave it out",
        ),
        (
            "imu.omega_body_rad_s",
            r#"columns = ["x", "y", "x"], body = "frd""#.into(),
            "columns: `x` is there more than once",
        ),
        ("rotor.command", r#"columns = ["x", "x"]"#.into(), "columns: `x` is there more than once"),
        ("rotor.command", "columns = []".into(), "columns: wants at least 1, got 0"),
        (
            "rotor.command",
            format!("{XYZ}, rotors = [0, 1, 2]"),
            "rotors: wants each of 1 to 3 once, got [0, 1, 2]",
        ),
        (
            "rotor.command",
            format!("{XYZ}, rotors = [1, 2, 2]"),
            "rotors: wants each of 1 to 3 once, got [1, 2, 2]",
        ),
        (
            "rotor.command",
            format!("{XYZ}, rotors = [1, 2]"),
            "rotors: wants each of 1 to 3 once, got [1, 2]",
        ),
        ("rotor.command", format!("{XYZ}, scale = [1, 2]"), "scale: 2 numbers for 3 columns"),
        ("rotor.command", format!("{XYZ}, scale = 0"), "scale: must not be 0"),
        ("rotor.command", format!("{XYZ}, offset = nan"), "offset: must be finite, got NaN"),
    ] {
        let flight = Flight::new("channel", &[("f.csv", GOOD_CSV)]);
        let map = one_source(&format!(r#""{name}" = {{ {keys} }}"#));
        let error = flight.import_file(&map).unwrap_err();
        assert_eq!(error.to_string(), format!("map.toml: source 1, `{name}`: {problem}"), "{map}");
    }
}

#[test]
fn a_map_that_toml_refuses_gives_line_and_text() {
    let good = one_source(OMEGA);
    for (from, to, line, problem) in [
        (
            "unit = \"s\"",
            "unit = \"min\"",
            2,
            "unknown variant `min`, expected one of `s`, `ms`, `us`, `ns`",
        ),
        ("unit = \"s\"", "units = \"s\"", 2, "unknown field `units`"),
        ("\"frd\"", "\"fru\"", 4, "unknown variant `fru`, expected `frd` or `flu`"),
        ("body =", "frame =", 4, "unknown field `frame`"),
        ("[[source]]", "keeps = \"x > 1\"\n[[source]]", 1, "unknown field `keeps`"),
        (
            "columns = [",
            "scale = \"1\", columns = [",
            4,
            "expected a number or a list with one number a column",
        ),
        ("columns = [", "columns = [1, ", 4, "invalid type: integer `1`, expected a string"),
        ("[source.channels]", "[source.channels", 3, ""),
        ("time =", "tine =", 2, "unknown field `tine`"),
    ] {
        let map = good.replacen(from, to, 1);
        let flight = Flight::new("syntax", &[("f.csv", GOOD_CSV)]);
        let message = flight.import_file(&map).unwrap_err().to_string();
        assert!(message.starts_with(&format!("map.toml, line {line}: {problem}")), "{message}");
        assert!(!message.contains('\n'), "{message}");
    }
    for map in ["", "keep = \"x > 1\"", "[[source]]\nchannels = {}"] {
        let message = Flight::new("syntax", &[]).import_folder(map).unwrap_err().to_string();
        assert!(message.starts_with("map.toml, line 1: missing field"), "{message}");
    }
}

#[test]
fn a_map_that_contradicts_itself_names_the_field() {
    let good = one_source(OMEGA);
    let flight = Flight::new("field", &[("f.csv", GOOD_CSV)]);
    for (map, message) in [
        ("source = []".to_owned(), "source: no [[source]]: nothing to import"),
        (one_source(""), "source 1, channels: no channel: nothing to import"),
        (
            good.replace("\"s\"", "\"s\", offset_s = inf"),
            "source 1, time.offset_s: must be finite, got inf",
        ),
        (
            good.replace("time =", "file = \"../f.csv\"\ntime ="),
            "source 1, file: `../f.csv` is not a file inside the flight folder",
        ),
        (format!("{good}{good}"), "source 2, `imu.omega_body_rad_s`: is in another source already"),
        (format!("keep = \"x >\"\n{good}"), "keep: expected a number, found the end"),
        (format!("keep = \"xx > 1\"\n{good}"), "keep: no file has a column `xx`; nearest: x, t, y"),
    ] {
        assert_eq!(
            flight.import_file(&map).unwrap_err().to_string(),
            format!("map.toml: {message}")
        );
    }
    let error = flight.import_file(&format!("keep = \"x > 9\"\n{good}")).unwrap_err();
    assert_eq!(flight.message(&error), "f.csv: `keep` drops all 2 rows");
}

#[test]
fn a_condition_over_two_files_asks_to_be_split() {
    let flight =
        Flight::new("split", &[("a.csv", "t,x\n0,1\n1,2\n"), ("b.csv", "t,y\n0,1\n1,2\n")]);
    let map = |keep: &str| {
        format!(
            r#"
            keep = "{keep}"
            [[source]]
            file = "a.csv"
            time = {{ column = "t", unit = "s" }}
            channels = {{ "truth.a" = {{ columns = ["x"] }} }}
            [[source]]
            file = "b.csv"
            time = {{ column = "t", unit = "s" }}
            channels = {{ "reference.b" = {{ columns = ["y"] }} }}
            "#
        )
    };
    assert_eq!(
        flight.import_folder(&map("x > 1 or y > 1")).unwrap_err().to_string(),
        "map.toml: keep: no single file has all of x, y: split the condition with `and`"
    );
    assert!(flight.import_folder(&map("x > 1 and y > 1")).is_ok());
}

#[test]
fn paths_that_do_not_fit_the_map_are_named() {
    let flight =
        Flight::new("paths", &[("a.csv", GOOD_CSV), ("b.csv", GOOD_CSV), ("sub/a.csv", GOOD_CSV)]);
    let without_file = one_source(OMEGA);
    let with_file = without_file.replace("time =", "file = \"a.csv\"\ntime =");
    let missing = without_file.replace("time =", "file = \"c.csv\"\ntime =");
    for (map, paths, message) in [
        (&with_file, &["nowhere"][..], "nowhere: No such file or directory (os error 2)"),
        (&missing, &["sub"], "map.toml: file `c.csv` is in none of the given paths: sub"),
        (
            &missing,
            &["a.csv", "b.csv"],
            "map.toml: file `c.csv` is in none of the given paths: a.csv, b.csv",
        ),
        (&missing, &[], "map.toml: file `c.csv` is in none of the given paths: none"),
        (
            &with_file,
            &["a.csv", "sub"],
            "map.toml: file `a.csv` is given twice: a.csv and sub/a.csv; import one flight at a time",
        ),
        (&with_file, &["a.csv", "b.csv"], "b.csv: no source of map.toml reads this"),
        (
            &without_file,
            &["sub"],
            "map.toml: source 1, file: without it PATH must be one file, given: sub",
        ),
        (
            &without_file,
            &["a.csv", "b.csv"],
            "map.toml: source 1, file: without it PATH must be one file, given: a.csv, b.csv",
        ),
    ] {
        let error = flight.import(map, paths).unwrap_err();
        assert_eq!(flight.message(&error), message);
    }
}
