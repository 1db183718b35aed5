//! Every effect of the catalogue, in every form.

use super::*;
use crate::aero::Air;
use crate::frames::Wrench;
use crate::vehicle::fixtures::squirrel;
use crate::vehicle::{MAX_ROTORS, Parameters, RotorAir, Vehicle, Wing};
use nalgebra::Vector3;

const HEIGHT_M: f64 = 0.3;
const TIME_S: f64 = 10.0;

fn air() -> Air<f64> {
    Air::new(In::new(Vector3::new(3.0, -2.0, 1.0)), In::new(Vector3::new(0.4, -0.3, 0.2)))
}
const WING: Wing<f64> = Wing {
    area_per_side_m2: 0.02,
    normal_force_slope: 2.0,
    lateral_arm_m: 0.1,
    longitudinal_arm_m: 0.0,
    vertical_arm_m: 0.0,
    chord_m: 0.2,
    time_constant_s: 0.1,
};
fn vehicle() -> Vehicle<f64> {
    Vehicle::new(squirrel()).unwrap()
}
fn thrust_factor(effects: &Effects<f64>, height_m: f64) -> f64 {
    let acting = Acting::new(effects, &vehicle());
    acting.numbers().thrust_factor(acting.present(), &Airflow::from(&air()), height_m)
}
/// Where rotors sink into their own wake.
fn sinking_factor(effects: &Effects<f64>) -> f64 {
    let acting = Acting::new(effects, &vehicle());
    let sinking = Air::new(In::new(Vector3::new(0.0, 1.0, 9.0)), In::zero());
    acting.numbers().thrust_factor(acting.present(), &Airflow::from(&sinking), HEIGHT_M)
}
fn wrench_of(effects: &Effects<f64>) -> Wrench<Body, f64> {
    let acting = Acting::new(effects, &vehicle());
    let at = Situation {
        flow: &Airflow::from(&air()),
        omega: &air().omega.vector.into(),
        thrust_n: 5.0,
        rotor_speed: &[1443.0; 4],
        thrust_factor: 1.0,
        force: [0.2, 0.1, -5.0],
        wing_force: [-0.1, 0.05, -0.8],
        rotor_spin: [100.0, -4000.0],
        wings: &flat_plate::Pair::new(&WING),
        deployment: [1.0, 0.5],
    };
    acting.numbers().wrench(acting.present(), &at).into()
}
/// With nothing but air and four rotors.
fn in_flow(acting: &Acting<f64>, flow: &Airflow<f64>, rotor_rad_s: f64) -> BodyWrench<f64> {
    let at = Situation {
        flow,
        omega: &flow.omega,
        thrust_n: 5.0,
        rotor_speed: &[rotor_rad_s; 4],
        thrust_factor: 1.0,
        force: [0.0; 3],
        wing_force: [0.0; 3],
        rotor_spin: [0.0; 2],
        wings: &flat_plate::Pair::new(&WING),
        deployment: [0.0; 2],
    };
    acting.numbers().wrench(acting.present(), &at)
}
fn wind_at(effects: &Effects<f64>, height_m: f64) -> [f64; 2] {
    let acting = Acting::new(effects, &vehicle());
    acting.numbers().wind(acting.present(), height_m)
}
/// Steady speeds of two rotors, asked for 1500 and 2100 rad/s of 3000 at 13 V of 14.8.
fn targets(effects: &Effects<f64>) -> [f64; 2] {
    let mut target = [0.0; MAX_ROTORS];
    (target[0], target[1]) = (1500.0, 2100.0);
    let acting = Acting::new(effects, &vehicle());
    acting.numbers().rotor_targets(acting.present(), &mut target, 13.0);
    assert_eq!(target[2..], [0.0; MAX_ROTORS - 2]);
    [target[0], target[1]]
}
/// Every way in which effects can act, as one list of numbers.
fn actions(effects: &Effects<f64>) -> Vec<f64> {
    let wrench = wrench_of(effects);
    let acting = Acting::new(effects, &vehicle());
    let altered = effects.alter(&vehicle()).unwrap();
    let rotors = altered.rotor_wrench_per_speed_squared();
    let gust = match effects.gust() {
        None => 0.0,
        Some(GustSpectrum::GaussMarkov { sigma_m_s }) => sigma_m_s,
        Some(GustSpectrum::Dryden { sigma_m_s }) => -sigma_m_s,
    };
    let load = effects.pendulum().map_or([0.0; 3], |load| {
        let (swing, mut state) = (load.over(0.2), PendulumState::at_rest());
        swing.lead(&mut state, [1.0, 0.0, 0.0]);
        swing.tether(&state).force(&[0.0, 0.0, -5.0], 2.0)
    });
    let mut all = vec![
        gust,
        effects.command_latency_s(),
        effects.command_clock().stamp_s(TIME_S),
        effects.heading_bias_rad(TIME_S, 1.5),
        effects.gnss_latency_s(),
        acting.numbers().added_mass_kg(acting.present()),
        thrust_factor(effects, HEIGHT_M),
        sinking_factor(effects),
        altered.inverse_mass(),
    ];
    all.extend(targets(effects));
    all.extend(wind_at(effects, HEIGHT_M));
    all.extend(load);
    all.extend(effects.rotor_extra_time_constant_s());
    all.extend(effects.wing_extra_time_constant_s());
    for list in [rotors.thrust, rotors.roll, rotors.pitch, rotors.yaw] {
        all.extend(list);
    }
    all.extend(altered.inertia_inverse().iter());
    for v in [
        wrench.force.vector,
        wrench.moment.vector,
        effects.specific_force_bias(TIME_S).vector,
        effects.accel_scale().vector,
        effects.gyro_scale().vector,
        effects.accelerometer_position().vector,
    ] {
        all.extend(v.iter());
    }
    all
}
/// Names of all effects, each with the number of one of its forms.
fn names_and_forms() -> Vec<(&'static str, usize)> {
    let each = Effects::<f64>::NAMES.iter().flat_map(|name| {
        let forms = forms(Effects::<f64>::parameters(name).unwrap()).len().max(1);
        (0..forms).map(move |form| (*name, form))
    });
    each.collect()
}
fn sized(name: &str, form: usize, size: fn(f64, f64) -> f64) -> Effects<f64> {
    let mut effects = Effects::none();
    let found = effects.insert(name).unwrap();
    for (value, parameter) in found.values.iter_mut().zip(found.parameters) {
        *value = match parameter.kind {
            Kind::Size { smallest, largest, .. } => size(smallest, largest),
            Kind::Rotor => 2.0,
            Kind::OneOf(_) if parameter.key == FORM => form as f64,
            Kind::OneOf(_) => 1.0,
        };
    }
    effects
}
/// An effect with its first parameters.
fn with(name: &str, values: &[f64]) -> Effects<f64> {
    let mut effects = Effects::<f64>::none();
    effects.insert(name).unwrap().values[..values.len()].copy_from_slice(values);
    effects
}
/// An effect with its first parameters in a form.
fn formed(name: &str, form: &str, values: &[f64]) -> Effects<f64> {
    let mut effects = with(name, values);
    let found = effects.get_mut(name).unwrap();
    let last = found.values.len() - 1;
    found.values[last] = forms(found.parameters).iter().position(|f| *f == form).unwrap() as f64;
    effects
}
fn close(a: f64, b: f64, what: &str) {
    assert!((a - b).abs() < 1e-12 * b.abs().max(1.0), "{what}: {a} for {b}");
}
/// The same of what an exponential of lanes is in, which is exact to 6e-11.
fn close_exp(a: f64, b: f64, what: &str) {
    assert!((a - b).abs() < 1e-10 * b.abs().max(1.0), "{what}: {a} for {b}");
}

/// Zero means absent, for every effect of the catalogue.
#[test]
fn an_effect_of_size_zero_changes_nothing() {
    for (name, form) in names_and_forms() {
        assert_eq!(
            actions(&sized(name, form, |_, _| 0.0)),
            actions(&Effects::none()),
            "{name}, {form}"
        );
    }
}

/// A present effect acts somewhere, so that no file can name one that does nothing.
#[test]
fn every_effect_acts_at_its_smallest_size() {
    for (name, form) in names_and_forms() {
        let acts = actions(&sized(name, form, |smallest, _| smallest));
        assert_ne!(acts, actions(&Effects::none()), "{name}, {form}");
        if form > 0 {
            assert_ne!(
                acts,
                actions(&sized(name, 0, |smallest, _| smallest)),
                "{name}: form {form} is the standard"
            );
        }
    }
    assert!(Effects::<f64>::none().insert("phlogiston").is_none());
}

#[test]
fn ranges_are_ranges_and_the_largest_sizes_are_flyable() {
    for (name, form) in names_and_forms() {
        let mut effects = sized(name, form, |_, largest| largest);
        assert!(actions(&effects).iter().all(|x| x.is_finite()), "{name}");
        for parameter in effects.get_mut(name).unwrap().parameters {
            if let Kind::Size { smallest, largest, .. } = parameter.kind {
                assert!(smallest > 0.0 && smallest < largest, "{name}.{}", parameter.key);
            }
        }
    }
}

/// One number for each effect that makes a force or changes the airframe, worked out by hand from
/// its equation.
#[test]
fn sizes_and_signs_by_hand() {
    let wrench = |name: &str, values: &[f64]| wrench_of(&with(name, values));
    let factor = |name: &str, values: &[f64]| thrust_factor(&with(name, values), HEIGHT_M);
    let altered = |name: &str, values: &[f64]| with(name, values).alter(&vehicle()).unwrap();

    let drag = wrench("linear_drag", &[0.1]).force.vector;
    assert!((drag - Vector3::new(-0.3, 0.2, 0.0)).norm() < 1e-12);
    close(
        wrench("quadratic_drag", &[0.01]).force.vector.x,
        -0.5 * 1.225 * 0.01 * 14.0_f64.sqrt() * 3.0,
        "drag area",
    );
    // R = 0.4 m at 0.3 m: 1 / (1 - 0.16 / 1.44).
    close(factor("ground_effect", &[0.4]), 1.125, "ground effect");
    // At 0.25 m, still above the floor: 1 / (1 - 0.16 / 1). From R / 2 = 0.2 m down, what it is
    // there: 1 / (1 - 0.16 / 0.64).
    close(thrust_factor(&with("ground_effect", &[0.4]), 0.25), 1.0 / 0.84, "above the floor");
    for height_m in [0.2, 0.16, 0.05, 0.0, -1.0] {
        let factor = thrust_factor(&with("ground_effect", &[0.4]), height_m);
        close(factor, 4.0 / 3.0, "height floored at half the radius");
    }
    close(
        factor("translational_lift", &[1e-3]),
        1.0 + 1e-3 * 13.0 / (1.0 + 0.004 * 13.0),
        "translational lift",
    );
    close(factor("axial_inflow", &[0.03]), 1.03, "descending air lifts");
    // Centre of mass ahead: thrust acts behind it and pitches the nose down.
    close(wrench("cg_offset", &[0.01, 0.0]).moment.vector.y, -0.05, "cg ahead");
    close(wrench("cg_offset", &[0.0, 0.01]).moment.vector.x, 0.05, "cg to the right");
    let tilted = wrench("thrust_misalignment", &[0.02, -0.01]).force.vector;
    assert!((tilted - Vector3::new(-0.1, 0.05, 0.0)).norm() < 1e-12);
    let flap = wrench("flapping_moment", &[2e-3]).moment.vector;
    assert!((flap - Vector3::new(4e-3, 6e-3, 0.0)).norm() < 1e-12, "forward flight pitches up");
    let damped = wrench("angular_damping", &[0.01]).moment.vector;
    assert!((damped - Vector3::new(-4e-3, 3e-3, -1e-3)).norm() < 1e-12);

    // L: w = 1 - 0.04, R: w = 1 + 0.04 at half deployment; 1/2 rho S c_N V = 0.0245 * sqrt(14).
    let slope = 0.5 * 1.225 * 0.02 * 2.0 * 14.0_f64.sqrt();
    let wing = wrench("wing_membrane", &[0.2, 0.0]);
    close(wing.force.vector.z, -0.2 * slope * (0.96 + 0.52), "wing gain");
    close(wing.moment.vector.x, 0.2 * slope * (0.96 - 0.52) * 0.1, "and its roll");
    let wing = wrench("wing_membrane", &[0.2, 0.05]);
    close(
        wing.force.vector.z,
        -slope * (0.2 * 1.48 + 1.2 * 0.05 * 3.0 * 1.5),
        "gain and angle of attack",
    );
    let weak = wrench("wing_asymmetry", &[0.0, 0.3]);
    close(weak.force.vector.z, 0.3 * slope * 0.96, "the left wing lifts less");
    close(weak.moment.vector.x, -0.3 * slope * 0.96 * 0.1, "so the vehicle rolls left");
    close(
        wrench("wing_asymmetry", &[1.0, 0.3]).moment.vector.x,
        0.3 * slope * 0.52 * 0.1,
        "or right",
    );
    let gyro = wrench("rotor_gyro_torque", &[1e-5]).moment.vector;
    assert!((gyro - Vector3::new(0.3 * 1e-3, 0.4 * 1e-3, 0.04)).norm() < 1e-12, "{gyro}");

    close(1.0 / altered("mass_error", &[0.1]).inverse_mass(), 0.548 * 1.1, "mass");
    close(
        1.0 / altered("inertia_error", &[1.0, 0.2]).inertia_inverse()[(1, 1)],
        4.68e-3 * 1.2,
        "inertia about y",
    );
    let nominal = *vehicle().rotor_wrench_per_speed_squared();
    let strong = *altered("thrust_coefficient", &[0.1]).rotor_wrench_per_speed_squared();
    close(strong.roll[0] / nominal.roll[0], 1.1, "thrust scales roll");
    close(strong.yaw[0] / nominal.yaw[0], 1.0, "and not yaw");
    let weak = *altered("weak_rotor", &[3.0, 0.2]).rotor_wrench_per_speed_squared();
    close(weak.thrust[2] / nominal.thrust[2], 0.8, "the third rotor");
    close(weak.yaw[2] / nominal.yaw[2], 0.8, "and its torque");
    close(weak.thrust[1] / nominal.thrust[1], 1.0, "no other");
    let chipped = formed("weak_rotor", "thrust_alone", &[3.0, 0.2]).alter(&vehicle()).unwrap();
    let chipped = *chipped.rotor_wrench_per_speed_squared();
    close(chipped.thrust[2] / nominal.thrust[2], 0.8, "the third rotor");
    close(chipped.yaw[2] / nominal.yaw[2], 1.0, "but not its torque");
    let twisted = *altered("yaw_torque_coeff", &[-0.3]).rotor_wrench_per_speed_squared();
    close(twisted.yaw[1] / nominal.yaw[1], 0.7, "yaw torque");
}

/// A vehicle whose blade tips are half as fast in hover has the paper's plausible sizes at half the
/// speed, and so at the same advance ratio; the disc alone, or mass and thrust together, do nothing.
#[test]
fn gains_over_a_speed_go_with_the_speed_of_blade_tips() {
    let largest = |p: Parameters<f64>| {
        let vehicle = Vehicle::new(p).unwrap();
        [("translational_lift", 0), ("translational_lift", 1), ("axial_inflow", 0)].map(
            |(name, slot)| {
                Effects::<f64>::parameters(name).unwrap()[slot].range(&vehicle).unwrap().largest
            },
        )
    };
    let paper = largest(*vehicle().parameters());
    for (now, own) in paper.iter().zip([3e-3, 0.02, 0.06]) {
        assert!((now / own - 1.0).abs() < 1e-3, "{now} for {own}");
    }
    let mut slow = *vehicle().parameters();
    slow.propulsion.thrust_coefficient_n_s2 *= 4.0;
    for ((now, own), times) in largest(slow).iter().zip(paper).zip([4.0, 2.0, 2.0]) {
        close(now / own, times, "half the speed");
    }
    let mut large = *vehicle().parameters();
    large.propulsion.propeller_radius_m *= 2.0;
    for (now, own) in largest(large).iter().zip(paper) {
        assert!((now / own - 1.0).abs() < 1e-3, "tips twice as fast: {now} for {own}");
    }
    let mut heavy = *vehicle().parameters();
    heavy.mass_kg *= 8.0;
    heavy.propulsion.thrust_coefficient_n_s2 *= 8.0;
    for (now, own) in largest(heavy).iter().zip(paper) {
        close(now / own, 1.0, "eight times the mass and the thrust");
    }
}

#[test]
fn an_impossible_alteration_is_refused() {
    let mut effects = Effects::<f64>::none();
    effects.insert("mass_error").unwrap().values[0] = -1.0;
    assert!(effects.alter(&vehicle()).unwrap_err().to_string().starts_with("mass.mass_kg = 0"));
}

/// What acts on sensors, commands and servos, and the other forms, worked out by hand.
#[test]
fn the_other_forms_by_hand() {
    let factor = |name: &str, form: &str, values: &[f64]| {
        thrust_factor(&formed(name, form, values), HEIGHT_M)
    };
    let wrench = |name: &str, form: &str, values: &[f64]| wrench_of(&formed(name, form, values));

    let drag = wrench("linear_drag", "anisotropic", &[0.1, 0.2, 0.05]).force.vector;
    assert!((drag - Vector3::new(-0.36, 0.16, -0.05)).norm() < 1e-12);
    let drag = wrench("quadratic_drag", "anisotropic", &[0.02, -0.5, 0.03]).force.vector;
    let pressure = 0.5 * 1.225 * 14.0_f64.sqrt();
    assert!((drag - Vector3::new(-0.01 * 3.0, 0.03 * 2.0, -0.03) * pressure).norm() < 1e-12);
    close_exp(
        factor("ground_effect", "exponential", &[0.3, 0.2]),
        1.0 + 0.2 * (-1.0_f64).exp(),
        "ground",
    );
    close(
        factor("translational_lift", "linear", &[0.0, 0.01]),
        1.0 + 0.01 * 13.0_f64.sqrt(),
        "linear lift",
    );
    close(factor("translational_lift", "quadratic", &[1e-3]), 1.013, "quadratic lift");
    close(factor("axial_inflow", "quadratic", &[0.03, -0.01]), 1.02, "inflow");
    let damped = wrench("angular_damping", "quadratic", &[0.0, 0.01]).moment.vector;
    assert!((damped - Vector3::new(-1.6e-3, 0.9e-3, -0.2e-3)).norm() < 1e-12, "{damped}");
    let flap = wrench("flapping_moment", "saturating", &[2e-3, 13.0_f64.sqrt()]).moment.vector;
    assert!((flap - Vector3::new(2e-3, 3e-3, 0.0)).norm() < 1e-12, "half at the scale");
    let spatial = wrench("cg_offset", "spatial", &[0.0, 0.0, 0.01]).moment.vector;
    assert!((spatial - Vector3::new(1e-3, -2e-3, 0.0)).norm() < 1e-12, "{spatial}");
    let half = wrench("wing_membrane", "speed_dependent", &[0.2, 0.0, 2.0 * 14.0_f64.sqrt()]).force;
    close(half.vector.z, wrench_of(&with("wing_membrane", &[0.1, 0.0])).force.vector.z, "half");

    let wind = formed("constant_wind", "log_profile", &[4.0, -2.0, 0.1]);
    close(wind_at(&wind, 10.0)[0], 4.0, "the wind at 10 m");
    close(wind_at(&wind, 1.0)[1], -1.0, "half of it at 1 m over 0.1 m");
    close(
        wind_at(&wind, -5.0)[0],
        4.0 * 2.0_f64.ln() / 100.0_f64.ln(),
        "floored at twice the roughness",
    );
    let ratio = 13.0_f64 / 14.8;
    let [slow, fast] = targets(&with("battery_sag", &[0.8]));
    close_exp(slow, 1500.0 * ratio.powf(0.8), "power law");
    close(fast / slow, 1.4, "for all rotors");
    close(
        targets(&formed("battery_sag", "linear", &[0.8]))[0],
        1500.0 * (1.0 + 0.8 * (ratio - 1.0)),
        "linear",
    );
    let [slow, fast] = targets(&formed("battery_sag", "load_dependent", &[0.8, 1.0]));
    close_exp(slow, 1500.0 * ratio.powf(0.8), "at half speed as the power law");
    close_exp(fast, 2100.0 * ratio.powf(0.8 * 1.2), "and more above");

    let lag = |effects: &Effects<f64>| {
        [effects.rotor_extra_time_constant_s(), effects.wing_extra_time_constant_s()]
    };
    assert_eq!(lag(&with("motor_lag", &[0.04])), [[0.04, 0.04], [0.0, 0.0]]);
    assert_eq!(lag(&formed("motor_lag", "asymmetric", &[0.04, 0.5])), [[0.02, 0.06], [0.0, 0.0]]);
    assert_eq!(
        lag(&formed("motor_lag", "asymmetric", &[0.04, 2.0]))[0],
        [-0.04, 0.12],
        "may shorten"
    );
    assert_eq!(
        lag(&formed("wing_servo_lag", "asymmetric", &[0.25, -0.5])),
        [[0.0, 0.0], [0.375, 0.125]]
    );

    assert_eq!(with("actuation_latency", &[0.03]).command_latency_s(), 0.03);
    assert_eq!(with("gnss_latency", &[0.2]).gnss_latency_s(), 0.2);
    close(with("clock_skew", &[1000.0]).command_clock().stamp_s(40.0), 40.04, "a fast clock");
    let steps = with("clock_step", &[0.05, 20.0]).command_clock();
    assert_eq!([19.9, 20.1].map(|t| steps.stamp_s(t)), [19.9, 20.1 + 0.05]);
    assert_eq!(
        with("gyro_scale", &[0.05, 0.0, -0.02]).gyro_scale().vector,
        Vector3::new(0.05, 0.0, -0.02)
    );
    assert_eq!(
        with("accel_scale", &[0.0, 0.01, 0.03]).accel_scale().vector,
        Vector3::new(0.0, 0.01, 0.03)
    );
    assert_eq!(
        [0.0, 1.0, 2.5].map(|load| with("compass_current", &[0.2]).heading_bias_rad(TIME_S, load)),
        [0.0, 0.2, 0.5]
    );
    let added = Acting::new(&with("added_mass", &[0.1]), &vehicle());
    assert_eq!(added.numbers().added_mass_kg(added.present()), 0.1);
    assert_eq!(with("heading_bias", &[0.2, 0.01]).heading_bias_rad(TIME_S, 1.0), 0.2);
    close(
        formed("heading_bias", "drifting", &[0.2, 0.01]).heading_bias_rad(TIME_S, 1.0),
        0.3,
        "drifting",
    );
    let bias = formed("accel_bias", "drifting", &[0.2, 0.3, 0.4, 0.01, 0.0, -0.02]);
    assert!((bias.specific_force_bias(TIME_S).vector - Vector3::new(0.3, 0.3, 0.2)).norm() < 1e-12);
    assert_eq!(with("gust", &[1.0]).gust(), Some(GustSpectrum::GaussMarkov { sigma_m_s: 1.0 }));
    assert_eq!(
        formed("gust", "dryden", &[1.0]).gust(),
        Some(GustSpectrum::Dryden { sigma_m_s: 1.0 })
    );
    let load = with("payload_swing", &[0.1, 0.5]).pendulum().unwrap();
    assert_eq!(load, Pendulum { mass_kg: 0.1, length_m: 0.5, damping_per_s: 0.1 });
    assert_eq!(
        formed("payload_swing", "damped", &[0.1, 0.5, 0.7]).pendulum().unwrap().damping_per_s,
        0.7
    );
}

/// The standard form is the first and has the keys that vehicle files without `form` use.
#[test]
fn forms_choose_among_parameters() {
    let keys = |name: &str, form: &str| -> Vec<&str> {
        let parameters = Effects::<f64>::parameters(name).unwrap();
        parameters.iter().filter(|p| p.exists_in(form) && p.key != FORM).map(|p| p.key).collect()
    };
    assert_eq!(
        forms(Effects::<f64>::parameters("translational_lift").unwrap()),
        ["saturating", "linear", "quadratic", "at_rotors"]
    );
    assert_eq!(keys("translational_lift", "saturating"), ["gain_s2_per_m2"]);
    assert_eq!(keys("translational_lift", "linear"), ["gain_s_per_m"]);
    assert!(forms(Effects::<f64>::parameters("added_mass").unwrap()).is_empty());
    for name in Effects::<f64>::NAMES {
        let parameters = Effects::<f64>::parameters(name).unwrap();
        let names = forms(parameters);
        assert!(
            names.is_empty() || parameters.last().unwrap().key == FORM,
            "{name}: form comes last"
        );
        for parameter in parameters {
            assert!(
                parameter.forms.unwrap_or(&[]).iter().all(|f| names.contains(f)),
                "{name}.{}",
                parameter.key
            );
        }
    }
}

/// The forms at the rotors' hubs are the standard ones where nothing turns, and damp turning as
/// forces at the ends of arms do.
#[test]
fn what_acts_at_the_rotors_damps_turning() {
    let vehicle = vehicle();
    let rotors = vehicle.rotors();
    let thrust: f64 = vehicle.rotor_wrench_per_speed_squared().thrust.iter().sum();
    let hover = (vehicle.weight_n() / thrust).sqrt();
    let at = |effects: &Effects<f64>, flow: &Airflow<f64>, times: f64| {
        let acting = Acting::new(effects, &vehicle);
        let wrench = in_flow(&acting, flow, times * hover);
        (Vector3::from(wrench.force), Vector3::from(wrench.moment))
    };
    let flow = |velocity: Vector3<f64>, omega: Vector3<f64>| {
        Airflow::from(&Air::new(In::new(velocity), In::new(omega)))
    };
    let straight = flow(Vector3::new(3.0, -2.0, 1.0), Vector3::zeros());
    let height: f64 = rotors.iter().map(|r| r.position.vector.z).sum::<f64>() / 4.0;

    let drag = formed("linear_drag", "at_rotors", &[0.1, 0.0, 0.05]);
    let (force, moment) = at(&drag, &straight, 1.0);
    assert!((force - Vector3::new(-0.3, 0.2, -0.05)).norm() < 1e-12, "{force}");
    assert!((moment - Vector3::z().cross(&force) * height).norm() < 1e-12, "{moment}");
    close(at(&drag, &straight, 1.2).0.x, -0.36, "with the rotors' speed");
    let yawing = flow(Vector3::zeros(), Vector3::z());
    let arms: f64 = rotors.iter().map(|r| r.position.vector.xy().norm_squared()).sum::<f64>() / 4.0;
    close(at(&drag, &yawing, 1.0).1.z, -0.1 * arms, "yaw is damped");

    let inflow = formed("axial_inflow", "at_rotors", &[0.03]);
    let (force, moment) = at(&inflow, &straight, 1.0);
    close(force.z, -0.03 * vehicle.weight_n(), "as the standard form");
    assert!(moment.norm() < 1e-12, "{moment}");
    let rolling = flow(Vector3::zeros(), Vector3::x());
    let arms: f64 = rotors.iter().map(|r| r.position.vector.y.powi(2)).sum::<f64>() / 4.0;
    close(at(&inflow, &rolling, 1.0).1.x, -0.03 * vehicle.weight_n() * arms, "roll is damped");

    let lift = formed("translational_lift", "at_rotors", &[1e-3]);
    let (force, moment) = at(&lift, &straight, 1.5);
    close(force.z, -0.013 * vehicle.weight_n(), "whatever the rotors' speed");
    assert!(moment.norm() < 1e-12, "{moment}");
    // The rotors on the side that comes forward lift more.
    let turning = flow(Vector3::new(3.0, 0.0, 0.0), Vector3::z());
    let rolls = 1e-3 * vehicle.weight_n() * 2.0 * 3.0 * arms;
    close(at(&lift, &turning, 1.0).1.x, rolls, "a yawing disc rolls");

    let flapping = formed("flapping_moment", "at_rotors", &[2e-3]);
    let (force, moment) = at(&flapping, &straight, 1.2);
    assert!(force.norm() < 1e-12, "{force}");
    assert!((moment - Vector3::new(4e-3, 6e-3, 0.0) * 1.2).norm() < 1e-12, "{moment}");
}

/// A number of the vehicle does what the effect of its name does, and the effect adds to it.
#[test]
fn what_a_vehicle_declares_of_its_rotors_acts_as_the_effect_does() {
    let declaring = |size: f64| {
        let mut p = squirrel::<f64>();
        p.propulsion.air = RotorAir {
            axial_inflow_s_per_m: 0.03 * size,
            translational_lift_s2_per_m2: 1e-3 * size,
            flapping_moment_n_m_s_per_m: 2e-3 * size,
            vortex_ring_fraction: 0.1 * size,
        };
        Vehicle::new(p).unwrap()
    };
    let all = |size: f64| {
        let mut effects = Effects::none();
        for (name, gain) in [
            ("axial_inflow", 0.03),
            ("translational_lift", 1e-3),
            ("flapping_moment", 2e-3),
            ("vortex_ring", 0.1),
        ] {
            effects.insert(name).unwrap().values[0] = gain * size;
        }
        effects
    };
    let flow = Airflow::from(&Air::new(In::new(Vector3::new(1.0, -2.0, 7.0)), In::zero()));
    let acts = |vehicle: &Vehicle<f64>, effects: &Effects<f64>| {
        let acting = Acting::new(effects, vehicle);
        let factor = acting.numbers().thrust_factor(acting.present(), &flow, HEIGHT_M);
        (factor, in_flow(&acting, &flow, 1443.0).moment)
    };
    let (plain, none) = (vehicle(), Effects::none());
    let (factor, moment) = acts(&declaring(1.0), &none);
    assert_eq!((factor, moment), acts(&plain, &all(1.0)));
    assert!(factor != 1.0 && moment[1] != 0.0);
    let ((half, _), (double, _)) = (acts(&declaring(1.0), &all(1.0)), acts(&plain, &all(2.0)));
    assert!((half - double).abs() < 1e-12, "{half} for {double}");
    assert!(!Acting::new(&none, &plain).any());
}
