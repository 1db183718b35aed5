//! Micro-SD logs of a Crazyflie: a piece of a real one against other decoders' numbers, every type
//! and version, every damage.
#![allow(clippy::unreadable_literal, reason = "numbers as another decoder prints them")]

use super::import_support::Flight;
use super::import_support::formats::Usd;

/// A map from columns of an event to `truth.a`.
fn map(event: &str, columns: &[&str]) -> String {
    format!(
        "[[source]]\ntopic = \"{event}\"\ntime = {{ column = \"timestamp\", unit = \"us\" }}\n\
         channels = {{ \"truth.a\" = {{ columns = {columns:?} }} }}\n"
    )
}

fn values(flight: &Flight, event: &str, columns: &[&str]) -> Vec<f64> {
    let (log, _) = flight.import(&map(event, columns), &["log00"]).unwrap();
    log.channel("truth.a").unwrap().1.values.clone()
}

fn error(flight: &Flight, event: &str, columns: &[&str]) -> String {
    flight.message(&flight.import(&map(event, columns), &["log00"]).unwrap_err())
}

/// Two seconds of a CrazyPAD flight; the numbers are those of Python's `struct.unpack` on the same
/// bytes.
#[test]
fn a_piece_of_a_real_flight_has_the_numbers_of_another_decoder() {
    let flight = Flight::new("piece", &[]);
    flight.write("log00", include_bytes!("../data/crazypad/E8_log00.bin"));
    for (column, row_100, sum) in [
        ("timestamp", 13_791_029.0, 2_757_217_450.0),
        ("motor.m1", 41_260.0, 8_651_074.0),
        ("motor.m4", 34_472.0, 7_460_186.0),
        ("pwm.m1_pwm", 44_634.0, 9_241_608.0),
        ("pwm.m4_pwm", 39_535.0, 8_416_837.0),
        ("pm.vbatMV", 3573.0, 708_184.0),
        ("stateEstimate.x", -0.015321879647672176, -1.3501870486559255),
        ("stateEstimate.z", 0.25560757517814636, 47.72394164895013),
        ("stateEstimate.vy", 0.00938181858509779, 1.2583068004933011),
        ("stateEstimate.az", -0.061269283294677734, 0.9693767428398132),
        ("stateEstimate.roll", -0.6674633026123047, -79.24897840770427),
        ("stateEstimate.yaw", 5.672431468963623, 701.183973092353),
    ] {
        let values = values(&flight, "fixedFrequency", &[column]);
        assert_eq!(values.len(), 200);
        assert_eq!(values[100], row_100, "{column}");
        assert_eq!(values.iter().sum::<f64>(), sum, "{column}");
    }
    assert_eq!(
        error(&flight, "activeMarkerModeChanged", &["mode"]),
        "log00: no message of topic `activeMarkerModeChanged`; nearest: fixedFrequency"
    );
}

/// Every type, its events mixed; the same in both versions.
#[test]
fn types_events_and_versions_are_read() {
    let all = [
        "a(b)",
        "b(B)",
        "c(h)",
        "d(H)",
        "e(i)",
        "f(I)",
        "g(q)",
        "h(Q)",
        "i(e)",
        "j(f)",
        "k.k(k)(d)",
    ];
    let names = ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k.k(k)"];
    let mut bytes = vec![0x80, 0xff];
    bytes.extend((-300_i16).to_le_bytes());
    bytes.extend(60_000_u16.to_le_bytes());
    bytes.extend((-70_000_i32).to_le_bytes());
    bytes.extend(4_000_000_000_u32.to_le_bytes());
    bytes.extend((-5_000_000_000_i64).to_le_bytes());
    bytes.extend(6_000_000_000_u64.to_le_bytes());
    bytes.extend(0xc100_u16.to_le_bytes());
    bytes.extend(1.5_f32.to_le_bytes());
    bytes.extend(0.1_f64.to_le_bytes());
    let numbers = [-128.0, 255.0, -300.0, 6e4, -7e4, 4e9, -5e9, 6e9, -2.5, 1.5, 0.1];
    for (version, step) in [(1, 1), (2, 1000)] {
        let log = Usd::new(
            version,
            &[(7, "all", &all), (0, "bare", &[]), (0xffff, "one", &["group.x(B)"])],
        )
        .record(7, 10 * step, &bytes)
        .record(0, 11 * step, &[])
        .record(0xffff, 12 * step, &[1])
        .record(0, 4_000_000_000 * step, &[])
        .record(7, 4_000_000_001 * step, &bytes);
        let flight = Flight::new("types", &[]);
        flight.write("log00", &log.finish());
        assert_eq!(values(&flight, "all", &names), [numbers, numbers].concat());
        assert_eq!(
            values(&flight, "all", &["timestamp"]),
            [10e3, 4_000_000_001e3],
            "version {version}"
        );
        assert_eq!(values(&flight, "bare", &["timestamp"]), [11e3, 4_000_000_000e3]);
        assert_eq!(values(&flight, "one", &["group.x"]), [1.0]);
        assert_eq!(
            error(&flight, "al", &["a"]),
            "log00: no message of topic `al`; nearest: all, bare, one",
            "version {version}"
        );
    }
}

#[test]
fn what_contradicts_the_format_is_one_line_with_its_place() {
    let flight = Flight::new("contradiction", &[]);
    let one = |version, variables| Usd::new(version, &[(1, "one", variables)]);
    let good = || one(2, &["x(f)"]).record(1, 5, &[0; 4]);
    // Header: 5 bytes, id, `one`, count: 13, `x(f)`: 18; the record has 14, and the CRC is at byte
    // 32.
    let whole = good().finish();
    assert_eq!(whole.len(), 36);
    let changed = |at: usize, byte: u8| {
        let mut bytes = whole.clone();
        bytes[at] = byte;
        bytes
    };
    for (bytes, problem) in [
        (vec![0xBC], "ends inside the header, after 1 bytes"),
        (whole[..12].to_vec(), "ends inside the header, after 12 bytes"),
        (whole[..17].to_vec(), "ends inside the header, after 17 bytes"),
        (whole[..20].to_vec(), "ends after 20 bytes, before the CRC-32 behind the header"),
        (whole[..35].to_vec(), "ends inside the record of `one` at byte 18: 13 of 14 bytes"),
        (whole[..23].to_vec(), "ends inside the record of an event at byte 18: 1 of 2 bytes"),
        (changed(1, 3), "version 3 at byte 1, import reads 1 and 2"),
        (changed(4, 0xff), "the name at byte 20 is no text"),
        (changed(12, 0xff), "the name at byte 18 is no text"),
        (changed(7, b'\n'), "the name at byte 7 is no text"),
        (changed(8, 0xff), "the name at byte 7 is no text"),
        (changed(15, b'L'), "the variable `x(L)` at byte 13 has the unknown type `L`"),
        (changed(16, b']'), "the variable `x(f]` at byte 13 is not `name(type)`"),
        (changed(18, 9), "the record at byte 18 is of the unknown event id 9"),
        (
            changed(29, 9),
            "the CRC-32 at byte 32 is 26090841, that of the bytes before it is 29d833ce",
        ),
        (
            changed(32, 0),
            "the CRC-32 at byte 32 is 26090800, that of the bytes before it is 26090841",
        ),
        (good().record(1, 6, &f32::INFINITY.to_le_bytes()).finish(), "`inf` is infinite"),
        (
            Usd::new(2, &[(1, "a", &[]), (1, "one", &["x(f)"])]).finish(),
            "the event type at byte 11 repeats",
        ),
        (
            Usd::new(2, &[(1, "one", &["x(f)"]), (2, "one", &[])]).finish(),
            "the event type at byte 18 repeats",
        ),
        (Usd::new(2, &[]).finish(), "no message of topic `one`; nearest: "),
        (
            one(2, &["x(f)", "x(f)"]).record(1, 5, &[0; 8]).finish(),
            "column `x` is in the header 2 times",
        ),
    ] {
        flight.write("log00", &bytes);
        let message = error(&flight, "one", &["x"]);
        assert!(message.starts_with("log00") && !message.contains('\n'), "{message}");
        assert!(message.contains(problem), "{message}\nwants {problem}");
    }
}

/// The CRC finds every single bit; before it is asked, and where it was made anew, nothing may
/// panic.
#[test]
fn no_flipped_bit_and_no_prefix_is_read() {
    let mut log = Usd::new(2, &[(0xffff, "fast", &["a.x(f)", "a.y(H)"]), (3, "slow", &["b(B)"])]);
    for t in 0..6_u8 {
        log = log.record(0xffff, t.into(), &[t; 6]).record(3, t.into(), &[t]);
    }
    let whole = log.finish();
    let flight = Flight::new("bits", &[]);
    let read = |bytes: &[u8]| {
        flight.write("log00", bytes);
        let imported =
            flight.import(&map("fast", &["a.x"]), &["log00"]).map_err(|e| flight.message(&e));
        if let Err(message) = &imported {
            assert!(message.starts_with("log00") && !message.contains('\n'), "{message}");
        }
        imported.is_ok()
    };
    for length in 0..whole.len() {
        assert!(!read(&whole[..length]), "{length} bytes");
    }
    let mut read_anew = 0;
    for bit in 0..8 * whole.len() {
        let mut bytes = whole.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(!read(&bytes), "bit {bit}");
        let body = &bytes[..bytes.len() - 4];
        read_anew += usize::from(read(&[body, &crc32fast::hash(body).to_le_bytes()].concat()));
    }
    assert!(read_anew > 400, "{read_anew}: most bits are of numbers");
    flight.write("log00", &whole);
    assert_eq!(values(&flight, "fast", &["a.y"]), [0.0, 257.0, 514.0, 771.0, 1028.0, 1285.0]);
}
