//! The default estimator on measured flights, beside the estimate that the autopilot made on board.
#![allow(clippy::print_stdout, clippy::disallowed_methods, reason = "tests")]

use squirrel_core::estimate::eskf::{Eskf, EskfParameters};
use squirrel_core::estimate::{Estimator, Sensed};
use squirrel_core::frames::{Body, In, Ned, Rotation};
use squirrel_core::nalgebra::{Matrix3, Vector3};
use squirrel_core::stack::{Gnss, Imu};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Flights of a Crazyflie 2.1 in a motion-capture room (NanoBench, Ullah and Baca 2026): the
/// cut-outs in `tests/data/flights`, or the whole ones in the folder `SQUIRREL_FLIGHTS`.
fn nanobench() -> PathBuf {
    let cut_outs = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/flights");
    std::env::var_os("SQUIRREL_FLIGHTS").map_or_else(cut_outs, PathBuf::from).join("nanobench")
}

/// Columns of a CSV file by their names.
fn columns(file: &Path) -> HashMap<String, Vec<f64>> {
    let text = std::fs::read_to_string(file).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut columns: HashMap<String, Vec<f64>> =
        names.iter().map(|name| ((*name).to_owned(), Vec::new())).collect();
    for line in lines {
        for (name, number) in names.iter().zip(line.split(',')) {
            columns.get_mut(*name).unwrap().push(number.parse().unwrap_or(f64::NAN));
        }
    }
    columns
}

/// Vertical in the body frame, FRD, of a quaternion of a body forward, left, up in a world north,
/// west, up.
fn down_of(wxyz: [f64; 4]) -> Vector3<f64> {
    let [w, x, y, z] = wxyz;
    let rotation = Rotation::<Ned, Body, f64>::from_wxyz([w, x, -y, -z]).unwrap();
    (rotation.inverse() * In::<Ned, f64>::new(Vector3::z())).vector
}

/// RMS angle between two series of directions, deg, once the turn between them that does not change
/// and the best shift in time, of up to a tenth of a second, are taken off.
fn misfit_deg(estimate: &[Vector3<f64>], truth: &[Vector3<f64>], flies: &[bool]) -> f64 {
    let shifted = |shift: usize| {
        let middle = 10;
        let pairs: Vec<_> = (20..truth.len() - 20)
            .filter(|k| flies[*k])
            .map(|k| (estimate[k + shift - middle], truth[k]))
            .collect();
        let sum = pairs.iter().fold(Matrix3::zeros(), |sum, (e, t)| sum + e * t.transpose());
        let svd = sum.svd(true, true);
        let (u, v) = (svd.u.unwrap(), svd.v_t.unwrap());
        let hand = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v).determinant().signum()));
        let turn = u * hand * v;
        let square = |(e, t): &(Vector3<f64>, Vector3<f64>)| {
            let t = turn * t;
            e.cross(&t).norm().atan2(e.dot(&t)).to_degrees().powi(2)
        };
        (pairs.iter().map(square).sum::<f64>() / pairs.len() as f64).sqrt()
    };
    (0..=20).map(shifted).fold(f64::INFINITY, f64::min)
}

/// Motion-capture position ten times a second is all the aid there is. The autopilot had the motion
/// capture at full rate.
#[test]
fn inclination_on_measured_flights_is_as_good_as_the_autopilots() {
    let folder = nanobench();
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    for name in [
        "B2_circle_medium_rep1",
        "B3_figure8_fast_rep1",
        "B8_star_slow_rep1",
        "B9_trefoil_slow_rep1",
    ] {
        let columns = columns(&folder.join(format!("{name}.csv")));
        let row = |prefix: &str, names: [&str; 3], k: usize| {
            let [x, y, z] = names.map(|name| columns[&format!("{prefix}{name}")][k]);
            // Forward, left, up and north, west, up alike.
            Vector3::new(x, -y, -z)
        };
        let quaternion = |prefix: &str, k: usize| {
            ["qw", "qx", "qy", "qz"].map(|name| columns[&format!("{prefix}{name}")][k])
        };
        let time_s = &columns["t"];
        // Between this gyro, which was logged at 73 Hz and resampled, and the rates of the motion
        // capture lie 0.3 rad/s in flight; the accelerometer shakes by 0.03 g. Positions are of
        // millimetres, and there are no velocities.
        let parameters = EskfParameters {
            gyro_noise_rad_s: 0.3,
            accel_noise_m_s2: 0.3,
            start_gyro_bias_rad_s: 0.02,
            gnss_position_noise_m: 0.002,
            gnss_velocity_noise_m_s: 1e3,
            // Motion capture does not lie; a filter that drifts on such a gyro must not think so.
            gate: 100.0,
            ..EskfParameters::default()
        };
        let narrow = |v: Vector3<f64>| v.map(|x| x as f32);
        let [w, x, y, z] = quaternion("", 0).map(|x| x as f32);
        let start = Rotation::from_wxyz([w, x, -y, -z]).unwrap();
        let mut filter = Eskf::new(parameters, start, In::zero());
        let (mut estimate, mut truth, mut board, mut flies) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for k in 0..time_s.len() {
            let dt_s = if k == 0 { 0.0 } else { time_s[k] - time_s[k - 1] };
            filter.step(&Sensed {
                dt_s: dt_s as f32,
                imu: Imu {
                    omega: In::new(narrow(row("imu_gyro_", ["x", "y", "z"], k))),
                    specific_force: In::new(narrow(row("imu_acc_", ["x", "y", "z"], k) * 9.806_65)),
                },
                gnss: k.is_multiple_of(10).then(|| Gnss {
                    position: In::new(narrow(row("p", ["x", "y", "z"], k))),
                    velocity: In::zero(),
                }),
                altitude_m: None,
                magnetic: None,
            });
            let believed = filter.estimate().ned_from_body;
            estimate.push(
                (believed.inverse() * In::<Ned, f32>::new(Vector3::z())).vector.map(f64::from),
            );
            truth.push(down_of(quaternion("", k)));
            board.push(down_of(quaternion("att_stateEstimate_", k)));
            flies.push(columns["pz"][k] > 0.4);
        }
        let (our, their) =
            (misfit_deg(&estimate, &truth, &flies), misfit_deg(&board, &truth, &flies));
        println!("{name}: {our:.2} deg, the autopilot's own {their:.2} deg");
        ours.push(our);
        theirs.push(their);
    }
    for (our, their) in ours.iter().zip(&theirs) {
        assert!(*our <= 1.2 * their, "{our} and {their} deg");
    }
}
