//! The maps in `vehicles/maps` against real flights: what they import must obey physics in NED and
//! FRD.
#![allow(clippy::print_stdout, reason = "tests")]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use squirrel_log::FlightLog;
use squirrel_log::import::{ImportMap, ImportReport, import};
use squirrel_sim::arm::Arm;
use squirrel_sim::estimator::Estimator;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

const GRAVITY_M_S2: f64 = 9.80665;

/// Measured flights: the cut-outs in `tests/data/flights`, or the whole flights in the folder
/// `SQUIRREL_FLIGHTS`.
fn flights() -> PathBuf {
    let cut_outs = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/flights");
    std::env::var_os("SQUIRREL_FLIGHTS").map_or_else(cut_outs, PathBuf::from)
}

/// Of a bar for a whole flight and one for a cut-out, that of what is at hand.
fn bar<T>(whole: T, cut_out: T) -> T {
    if std::env::var_os("SQUIRREL_FLIGHTS").is_some() { whole } else { cut_out }
}

fn map_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../vehicles/maps").join(name)
}

fn import_with(map: &str, path: PathBuf) -> (FlightLog, ImportReport) {
    let map = ImportMap::load(&map_file(map)).unwrap();
    import(&map, &[path]).unwrap()
}

fn vectors(log: &FlightLog, name: &str) -> (Vec<f64>, Vec<Vector3<f64>>) {
    let (time_s, channel) = log.channel(name).unwrap();
    assert_eq!(channel.width, 3);
    (time_s.to_vec(), (0..time_s.len()).map(|i| Vector3::from_row_slice(channel.row(i))).collect())
}

fn attitudes(log: &FlightLog) -> Vec<UnitQuaternion<f64>> {
    let (time_s, channel) = log.channel("attitude.q_ned_from_body_wxyz").unwrap();
    let unit = |q: &[f64]| UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]));
    (0..time_s.len()).map(|i| unit(channel.row(i))).collect()
}

fn mean(v: &[Vector3<f64>]) -> Vector3<f64> {
    v.iter().sum::<Vector3<f64>>() / v.len() as f64
}

/// Correlation and regression slope of y on x, axis by axis.
fn correlation(x: &[Vector3<f64>], y: &[Vector3<f64>]) -> (Vector3<f64>, Vector3<f64>) {
    assert_eq!(x.len(), y.len());
    let (mean_x, mean_y) = (mean(x), mean(y));
    let sum = |f: &dyn Fn(Vector3<f64>, Vector3<f64>) -> Vector3<f64>| {
        x.iter().zip(y).map(|(x, y)| f(x - mean_x, y - mean_y)).sum::<Vector3<f64>>()
    };
    let xx = sum(&|x, _| x.component_mul(&x));
    let yy = sum(&|_, y| y.component_mul(&y));
    let xy = sum(&|x, y| x.component_mul(&y));
    (xy.component_div(&xx.component_mul(&yy).map(f64::sqrt)), xy.component_div(&xx))
}

/// Starts of windows of `step` samples without a gap in time.
fn windows(time_s: &[f64], step: usize) -> Vec<usize> {
    let typical = (time_s[step] - time_s[0]) * 1.5;
    (0..time_s.len() - step).filter(|&i| time_s[i + step] - time_s[i] < typical).collect()
}

/// Mean body rate over windows of `step` samples: by gyro, and by the attitude's turn over the
/// window.
fn rates(log: &FlightLog, step: usize) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    let (time_s, omega) = vectors(log, "imu.omega_body_rad_s");
    let q = attitudes(log);
    windows(&time_s, step)
        .into_iter()
        .map(|i| {
            let turn =
                (q[i].inverse() * q[i + step]).scaled_axis() / (time_s[i + step] - time_s[i]);
            (mean(&omega[i..i + step]), turn)
        })
        .unzip()
}

/// Mean velocity over `step` samples, and the step in position over time.
fn velocities(log: &FlightLog, step: usize) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    let (time_s, position) = vectors(log, "gnss.position_ned_m");
    let (_, velocity) = vectors(log, "gnss.velocity_ned_m_s");
    windows(&time_s, step)
        .into_iter()
        .map(|i| {
            // Trapezoid, so that mean and step are of the same time.
            let inner = mean(&velocity[i + 1..i + step]) * (step - 1) as f64;
            let mean = (inner + (velocity[i] + velocity[i + step]) * 0.5) / step as f64;
            (mean, (position[i + step] - position[i]) / (time_s[i + step] - time_s[i]))
        })
        .unzip()
}

/// Correlation of the angular acceleration, `lag` samples later, with what an X quadrotor's rotors
/// ask for: rotors 1 to 4 front right, back right, back left, front left; reaction of 1 and 3 about
/// +z (down), of 2 and 4 about -z.
fn motor_geometry(log: &FlightLog, lag: usize, step: usize) -> Vector3<f64> {
    let (time_s, omega) = vectors(log, "imu.omega_body_rad_s");
    let (_, command) = log.channel("rotor.command").unwrap();
    let (asked, got): (Vec<_>, Vec<_>) = windows(&time_s, lag + step)
        .into_iter()
        .map(|i| {
            let mut asked = Vector3::zeros();
            for row in i..i + step {
                let thrust: Vec<f64> = command.row(row).iter().map(|u| u * u).collect();
                let &[t1, t2, t3, t4] = thrust.as_slice() else { panic!("not four rotors") };
                asked += Vector3::new(-t1 - t2 + t3 + t4, t1 - t2 - t3 + t4, t1 - t2 + t3 - t4);
            }
            (asked, omega[i + lag + step] - omega[i + lag])
        })
        .unzip();
    correlation(&asked, &got).0
}

#[test]
fn nanobench_obeys_physics() {
    let folder = flights().join("nanobench");
    // Flights with much motion in roll and pitch, and one with little: its Vicon attitude is mostly
    // noise.
    for (file, least) in [
        ("B2_circle_medium_rep1.csv", bar(0.9, 0.85)),
        ("B3_figure8_fast_rep1.csv", 0.9),
        ("B8_star_slow_rep1.csv", 0.9),
        ("B9_trefoil_slow_rep1.csv", 0.6),
    ] {
        let (log, report) = import_with("nanobench.toml", folder.join(file));
        println!("{report}");
        assert!(report.files[0].rows_masked > bar(100, 30), "take-off and landing are dropped");
        assert_eq!(log.metadata["imported_from"], file);

        let (_, force) = vectors(&log, "imu.specific_force_body_m_s2");
        let hover = mean(&force);
        assert!((hover - Vector3::new(0.0, 0.0, -GRAVITY_M_S2)).amax() < 0.2, "{file}: {hover}");

        let (gyro, turn) = rates(&log, 20);
        let (r, slope) = correlation(&gyro, &turn);
        println!("{file}: gyro against attitude, correlation {r:.3?}, slope {slope:.3?}");
        assert!(r.x > 0.9 && r.y > least && r.z > 0.6, "{file}: {r}");
        assert!(slope.min() > 0.8 && slope.max() < 1.2, "{file}: rad/s, not deg/s: {slope}");

        let (velocity, step) = velocities(&log, 10);
        let (r, slope) = correlation(&velocity, &step);
        assert!(r.min() > 0.99 && (slope.add_scalar(-1.0)).amax() < 0.02, "{file}: {r} {slope}");

        // Height is up: flights are at about 1 m, so down is about -1 m.
        let (_, position) = vectors(&log, "gnss.position_ned_m");
        assert!(position.iter().all(|p| p.z < -0.4 && p.z > -1.4), "{file}");

        // Force in NED from the accelerometer against that from the velocity, 0.2 s apart.
        let (time_s, velocity) = vectors(&log, "gnss.velocity_ned_m_s");
        let q = attitudes(&log);
        let (felt, moved): (Vec<_>, Vec<_>) = windows(&time_s, 20)
            .into_iter()
            .map(|i| {
                let felt: Vec<_> = (i..i + 20).map(|k| q[k] * force[k]).collect();
                let acceleration = (velocity[i + 20] - velocity[i]) / (time_s[i + 20] - time_s[i]);
                (mean(&felt), acceleration - Vector3::new(0.0, 0.0, GRAVITY_M_S2))
            })
            .unzip();
        let (r, _) = correlation(&felt, &moved);
        println!("{file}: accelerometer against velocity in NED, correlation {r:.3?}");
        assert!(r.min() > 0.8, "{file}: {r}");

        let r = motor_geometry(&log, 3, 2);
        println!("{file}: rotors against angular acceleration, correlation {r:.3?}");
        assert!(r.min() > 0.2, "{file}: {r}");
    }
}

#[test]
fn arpl_obeys_physics() {
    let folder = flights().join("arpl-motorlag");
    for file in ["log10.csv", "log16.csv"] {
        let (log, report) = import_with("arpl.toml", folder.join(file));
        println!("{report}");
        let (_, force) = vectors(&log, "imu.specific_force_body_m_s2");
        let hover = mean(&force);
        assert!((hover - Vector3::new(0.0, 0.0, -GRAVITY_M_S2)).amax() < 0.6, "{file}: {hover}");
        assert!(force.iter().all(|f| f.x.abs() < 6.0 && f.y.abs() < 6.0), "{file}");
        let (_, omega) = vectors(&log, "imu.omega_body_rad_s");
        let fastest = omega.iter().map(Vector3::amax).fold(0.0, f64::max);
        assert!(
            (1.0..2000_f64.to_radians()).contains(&fastest),
            "{file}: range of the sensor: {fastest} rad/s"
        );
        let r = motor_geometry(&log, 30, 20);
        println!("{file}: rotors against angular acceleration, correlation {r:.3?}");
        assert!(r.min() > 0.2, "{file}: {r}");
    }
}

/// Channels of one source as a CSV file with such column names.
fn csv(log: &FlightLog, names: &str, channels: &[&str]) -> String {
    let time_s = log.channel(channels[0]).unwrap().0;
    let mut text = format!("{names}\n");
    for (row, t) in time_s.iter().enumerate() {
        let _ = write!(text, "{t}");
        let rows = channels.iter().map(|name| log.channel(name).unwrap().1.row(row));
        rows.flatten().for_each(|x| {
            let _ = write!(text, ",{x}");
        });
        text.push('\n');
    }
    text
}

/// One folder a flight, nothing to convert: what a flight of ours writes into such files comes back
/// as it was.
#[test]
fn practice_files_are_in_our_frames_and_units() {
    let vehicle = VehicleFile { estimator: Estimator::External, ..VehicleFile::squirrel() };
    let scenario = Scenario::find("excite_rich").unwrap();
    let flown =
        Setup { vehicle, arm: Arm::Pc, scenario, integrator: Integrator::Rk4 }.fly(true, |_| {});
    let log = flown.unwrap().log.unwrap();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("practice-flight");
    std::fs::create_dir_all(&folder).unwrap();
    let files: [(&str, &str, &[&str]); 4] = [
        (
            "imu.csv",
            "t,gx,gy,gz,ax,ay,az,qw,qx,qy,qz,u1,u2,u3,u4,wl,wr",
            &[
                "imu.omega_body_rad_s",
                "imu.specific_force_body_m_s2",
                "attitude.q_ned_from_body_wxyz",
                "rotor.command",
                "wing.command",
            ],
        ),
        ("gnss.csv", "t,pn,pe,pd,vn,ve,vd", &["gnss.position_ned_m", "gnss.velocity_ned_m_s"]),
        ("baro.csv", "t,alt", &["baro.altitude_m"]),
        ("batt.csv", "t,volt,curr", &["battery.voltage_v", "battery.current_a"]),
    ];
    for (file, names, channels) in files {
        std::fs::write(folder.join(file), csv(&log, names, channels)).unwrap();
    }
    let (imported, _) = import_with("practice.toml", folder);
    for channel in files.iter().flat_map(|(_, _, channels)| *channels) {
        let ((time_s, ours), (imported_s, theirs)) =
            (log.channel(channel).unwrap(), imported.channel(channel).unwrap());
        assert_eq!(time_s.len(), imported_s.len(), "{channel}");
        let off =
            ours.values.iter().zip(&theirs.values).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // A quaternion is made a unit again.
        assert!(off < 1e-6, "{channel}: {off}");
    }
}

/// Mean thrust that a vehicle file makes of the rotor commands, over mass times the mean upward
/// specific force.
fn thrust_over_force(vehicle: &str, log: &FlightLog) -> f64 {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../vehicles").join(vehicle);
    let vehicle = VehicleFile::load(&path).unwrap().vehicle;
    let propulsion = &vehicle.parameters().propulsion;
    let (_, force) = vectors(log, "imu.specific_force_body_m_s2");
    let (_, command) = log.channel("rotor.command").unwrap();
    let speeds = command.values.iter().map(|&u| propulsion.target_speed_rad_s(u));
    let thrust_n: f64 =
        speeds.map(|speed| propulsion.thrust_coefficient_n_s2 * speed * speed).sum();
    let force_m_s2 = -mean(&force).z;
    // In the mean over a flight the rotors carry the weight, whatever happens in between.
    assert!((force_m_s2 / GRAVITY_M_S2 - 1.0).abs() < 0.05, "{force_m_s2}");
    thrust_n / force.len() as f64 / (vehicle.parameters().mass_kg * force_m_s2)
}

#[test]
fn the_thrust_of_the_vehicle_files_carries_the_weight() {
    let folder = flights();
    for (map, vehicle, file, within) in [
        ("arpl.toml", "crazyflie2_arpl.toml", "arpl-motorlag/log10.csv", bar(0.001, 0.02)),
        ("arpl.toml", "crazyflie2_arpl.toml", "arpl-motorlag/log16.csv", 0.05),
        (
            "nanobench.toml",
            "crazyflie21_brushed_curve.toml",
            "nanobench/B8_star_slow_rep1.csv",
            bar(0.01, 0.03),
        ),
        (
            "nanobench.toml",
            "crazyflie21_brushed_curve.toml",
            "nanobench/B3_figure8_fast_rep1.csv",
            bar(0.01, 0.03),
        ),
        (
            "nanobench.toml",
            "crazyflie21_brushed_curve.toml",
            "nanobench/B2_circle_medium_rep1.csv",
            0.05,
        ),
    ] {
        let (log, _) = import_with(map, folder.join(file));
        let ratio = thrust_over_force(vehicle, &log);
        println!("{vehicle}, {file}: thrust over force {ratio:.4}");
        assert!((ratio - 1.0).abs() < within, "{vehicle}, {file}: {ratio}");
    }
}

/// Every number of the vehicle says how well it is known, and the rotors follow at once.
#[test]
fn the_arpl_vehicle_has_no_lag_and_all_tolerances() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../vehicles/crazyflie2_arpl.toml");
    let vehicle = VehicleFile::load(&path).unwrap();
    let propulsion = &vehicle.vehicle.parameters().propulsion;
    assert_eq!((propulsion.time_constant_up_s, propulsion.time_constant_down_s), (0.0, 0.0));
    for (field, number) in &vehicle.provenance {
        let certain = field.ends_with("yaw_sign");
        assert!(certain || (number.sd.is_some() && number.source.is_some()), "{field}: {number:?}");
    }
}
