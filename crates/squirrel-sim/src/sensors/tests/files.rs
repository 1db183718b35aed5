//! `[sensors]` of vehicle files: devices, suites, long forms, and errors that say where.

use super::super::devices;
use super::*;
use crate::vehicle_file::{SQUIRREL_TOML, VehicleFile};

fn parse(tables: &str) -> Result<SensorParameters, String> {
    // The shipped file with these tables instead of its own.
    let own = "[sensors]\nsuite = \"nominal\"\n";
    assert!(SQUIRREL_TOML.contains(own));
    let text = format!("{}\n{tables}", SQUIRREL_TOML.replace(own, ""));
    VehicleFile::parse(&text, "v.toml").map(|file| file.sensors).map_err(|e| e.to_string())
}

#[test]
fn every_device_parses_and_differs_from_the_default() {
    let lists = [
        ("imu", &devices::IMUS[..]),
        ("gnss", &devices::RECEIVERS),
        ("baro", &devices::BAROMETERS),
        ("magnetometer", &devices::MAGNETOMETERS),
    ];
    for (sensor, names) in lists {
        let mut seen = vec![parse("").unwrap(), parse(&format!("[sensors.{sensor}]")).unwrap()];
        for name in names {
            let p = parse(&format!("[sensors.{sensor}]\ndevice = \"{name}\"")).unwrap();
            assert!(!seen.contains(&p), "{name}");
            seen.push(p);
        }
        let problem = parse(&format!("[sensors.{sensor}]\ndevice = \"best\"")).unwrap_err();
        assert!(
            problem.contains(&names.join(", ")) && problem.contains("device \"best\""),
            "{problem}"
        );
        assert!(
            problem.contains(", line ") && problem.ends_with("(in `device = \"best\"`)"),
            "{problem}"
        );
    }
}

#[test]
fn keys_of_a_table_override_its_device_and_its_rate_makes_the_noise() {
    let at = |rate: &str| {
        parse(&format!(
            "[sensors.imu]\ngyro_scale_sd = {{ value = 0.1, sd = 0.01, source = \"bench\" }}\nunits = 2\n\
             timing = {{ rate_hz = {rate} }}\ndevice = \"mpu_6000\""
        ))
        .unwrap()
        .imu
    };
    let (slow, fast) = (at("100.0"), at("{ value = 400, source = \"bench\" }"));
    assert_eq!((slow.gyro_scale_sd, slow.units, fast.timing.rate_hz), (0.1, 2, 400.0));
    assert!(
        (slow.gyro_noise_rad_s - 0.05_f64.to_radians()).abs() < 1e-12,
        "5 mdps in a root of 100 Hz"
    );
    assert!((fast.accel_noise_m_s2 / slow.accel_noise_m_s2 - 2.0).abs() < 1e-12);
    assert!((slow.gyro_range_rad_s / slow.gyro_resolution_rad_s - 32768.0).abs() < 1e-6);
}

#[test]
fn a_suite_is_where_a_file_starts() {
    assert_eq!(
        SUITES.iter().filter_map(|name| SensorParameters::suite(name)).count(),
        SUITES.len()
    );
    assert_eq!(SensorParameters::suite("best"), None);
    let mut nominal = SensorParameters::suite("nominal").unwrap();
    (nominal.imu.units, nominal.magnetometer) = (1, None);
    assert_eq!(nominal, SensorParameters::default());
    for name in SUITES {
        let p = SensorParameters::suite(name).unwrap();
        p.check().unwrap();
        assert!(p.imu.units == 2 && p.magnetometer.is_some());
        assert_eq!(parse(&format!("[sensors]\nsuite = \"{name}\"")).unwrap(), p);
        let changed =
            format!("[sensors]\nbaro = {{ lag_s = 0.5, device = \"dps310\" }}\nsuite = \"{name}\"");
        let file = parse(&changed).unwrap();
        assert_eq!((file.imu, file.baro.lag_s), (p.imu, 0.5));
        assert_eq!(
            file.baro.pressure_coefficient, p.baro.pressure_coefficient,
            "the airframe's stays"
        );
    }
    let problem = parse("[sensors]\nsuite = \"best\"").unwrap_err();
    assert!(
        problem.contains("suite \"best\": no such suite; known are nominal, hobby, research, rtk")
    );
}

#[test]
fn errors_name_line_field_and_value() {
    let cases = [
        ("[sensors.imu]\nunits = 3", "sensors.imu.units = 3: must be 1 to 2"),
        ("[sensors.imu]\nunits = 1.5", "(in `units = 1.5`)"),
        ("[sensors.imu]\ngyro_range_rad_s = 0.0", "sensors.imu.gyro_range_rad_s = 0: must be > 0"),
        (
            "[sensors.imu]\ngyro_bias_rad_s = [0.0, nan, 0.0]",
            "sensors.imu.gyro_bias_rad_s = NaN: must be finite",
        ),
        (
            "[sensors.imu]\naccel_noise = 1.0",
            "unknown field `accel_noise`, expected one of `device`, `timing`,",
        ),
        (
            "[sensors.attitude]\ndevice = \"bmi270\"",
            "unknown field `device`, expected one of `timing`,",
        ),
        ("[sensors.gnss]\noutlier_share = 1.5", "sensors.gnss.outlier_share = 1.5: must be 0 to 1"),
        (
            "[sensors.gnss]\nwander_time_s = 0.0",
            "sensors.gnss.wander_time_s = 0: must be 0.01 to 1000000",
        ),
        ("[sensors.baro]\nlag_s = -0.1", "sensors.baro.lag_s = -0.1: must be 0 to 10"),
        ("[sensors.baro]\nnoise_m = -1", "sensors.baro.noise_m = -1: must be finite and >= 0"),
        ("[sensors.baro]\nnoise_m = \"much\"", "expected a number"),
        ("[sensors.baro]\npressure_coefficient = [0.1]", "(in `pressure_coefficient = [0.1]`)"),
        (
            "[sensors.magnetometer]\nfield_ut = 0.5",
            "sensors.magnetometer.field_ut = 0.5: must be 1 to 100",
        ),
        (
            "[sensors.magnetometer.timing]\nrate_hz = 0",
            "sensors.magnetometer.timing.rate_hz = 0: must be > 0",
        ),
        ("[sensors.gps]", "unknown field `gps`, expected one of `imu`,"),
    ];
    for (tables, expected) in cases {
        let problem = parse(tables).unwrap_err();
        assert!(problem.contains(expected) && !problem.contains('\n'), "{problem}");
        assert!(problem.starts_with("v.toml"), "{problem}");
    }
}
