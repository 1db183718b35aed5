//! Margins of the attitude loop, computed beside measured: the plant hovers under its flight code, a
//! torque of one frequency is added to what the rotors are asked for, and the open loop is the
//! ratio of what the flight code asks for to what the rotors get.

use squirrel_core::nalgebra::{Complex, Vector3};
use squirrel_sim::vehicle_file::margins::{AxisLoop, PHASE_MARGIN_RAD, SENSITIVITY_PEAK};
use squirrel_sim::vehicle_file::{Hovering, VehicleFile};

const STEP_S: f64 = 1.0 / 300.0;

/// `L` at a frequency, rad/s, measured after the start has died away.
fn measured(file: &VehicleFile, axis: usize, omega_rad_s: f64) -> Complex<f64> {
    let mut hovering = Hovering::new(file).unwrap();
    let periods = (4.0 * omega_rad_s / std::f64::consts::TAU).ceil();
    let counted = (periods * std::f64::consts::TAU / omega_rad_s / STEP_S).round() as usize;
    let settle = (6.0 / STEP_S) as usize;
    let size_n_m = 0.004;
    let (mut asked_sum, mut given_sum) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
    for k in 0..settle + counted {
        let phase = omega_rad_s * k as f64 * STEP_S;
        let mut extra = Vector3::zeros();
        extra[axis] = size_n_m * phase.sin();
        let asked = hovering.step([0.0; 2], &extra)[axis];
        if k >= settle {
            let turn = Complex::new(0.0, -phase).exp();
            asked_sum += turn * asked;
            given_sum += turn * (asked + extra[axis]);
        }
    }
    -asked_sum / given_sum
}

#[test]
fn computed_loops_are_those_of_the_plant() {
    let base = VehicleFile::squirrel();
    let edit = |from: &str, to: &str| {
        let text = base.text.replace(from, to);
        assert_ne!(text, base.text);
        VehicleFile::parse(&text, "vehicle").unwrap()
    };
    let late = edit("time_constant_s = { value = 0.04,", "time_constant_s = { value = 0.07,");
    let euler = edit("form = \"quaternion\"", "form = \"euler\"");
    let lead = edit("[control.attitude]", "[control.attitude]\nrotor_lead = 3.0");
    for (name, file) in
        [("squirrel", &base), ("late rotors", &late), ("euler", &euler), ("lead", &lead)]
    {
        let loops: [AxisLoop; 3] = file.attitude_loops().unwrap();
        for axis in 0..3 {
            let crossover = loops[axis].margins().crossover_rad_s;
            for share in [0.6, 1.0, 1.6] {
                let omega = share * crossover;
                let (found, computed) = (measured(file, axis, omega), loops[axis].open_loop(omega));
                let off = found / computed;
                assert!(
                    off.arg().to_degrees().abs() < 3.0 && (off.norm() - 1.0).abs() < 0.05,
                    "{name}, axis {axis}, {omega:.1} rad/s: {found} measured, {computed} computed"
                );
            }
        }
    }
}

/// What the margin of delay says: with as much more of it the vehicle oscillates, with less it does
/// not.
#[test]
fn a_vehicle_oscillates_beyond_its_margin_of_delay() {
    let base = VehicleFile::squirrel();
    let margin_s = base.margins().unwrap()[0].nominal.delay_margin_s;
    let with_lag = |lag_s: f64| {
        let text = base.text.replace(
            "time_constant_s = { value = 0.04,",
            &format!("time_constant_s = {{ value = {lag_s},"),
        );
        VehicleFile::parse(&text, "vehicle").unwrap()
    };
    let settles_s = |lag_s: f64| Hovering::new(&with_lag(lag_s)).unwrap().answer(0).settling_s;
    assert!(margin_s > 0.01 && settles_s(0.04) < 1.2, "{margin_s} s, {} s", settles_s(0.04));
    // A lag of this size takes more phase than there is.
    assert!(with_lag(0.3).margins().unwrap()[0].nominal.phase_margin_rad < 0.0);
    assert!(settles_s(0.3) > 2.9);
}

/// What the rule of gains asks for, in the vehicle that is shipped.
#[test]
fn the_shipped_squirrel_has_the_margins_that_the_rule_asks_for() {
    for axis in VehicleFile::squirrel().margins().unwrap() {
        let (now, late) = (axis.nominal, axis.twice_the_lag);
        assert!(
            now.phase_margin_rad >= PHASE_MARGIN_RAD[0]
                && late.phase_margin_rad >= PHASE_MARGIN_RAD[1]
                && now.sensitivity_peak <= SENSITIVITY_PEAK,
            "{axis:?}"
        );
    }
}
