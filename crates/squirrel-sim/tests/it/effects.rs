//! Effects in vehicle files and in flights: every effect and form can be written, and what sensors,
//! clocks and servos do shows in the log.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use squirrel_core::dynamics::State;
use squirrel_core::effects::{Effects, FORM, Kind, forms};
use squirrel_core::frames::{Body, In, Ned, Rotation};
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::nalgebra::{Quaternion, Vector3};
use squirrel_core::vehicle::{MAX_ROTORS, Vehicle};
use squirrel_log::FlightLog;
use squirrel_sim::arm::Arm;
use squirrel_sim::estimator::Estimator;
use squirrel_sim::flight::{Flight, Integrator, Setup};
use squirrel_sim::plant::{Led, Plant, PlantState, WingPlant};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::sensors::SensorParameters;
use squirrel_sim::vehicle_file::{SQUIRREL_TOML, VehicleFile, effects_page, listed_effects};
use std::fmt::Write;

fn parse(effect: &str) -> Result<VehicleFile, String> {
    VehicleFile::parse(&format!("{SQUIRREL_TOML}\n{effect}"), "file").map_err(|e| e.to_string())
}

/// The table of an effect in a form, at its smallest sizes.
fn table(name: &str, form: &str) -> String {
    let mut text = format!("[effects.{name}]\n");
    for p in Effects::<f64>::parameters(name).unwrap().iter().filter(|p| p.exists_in(form)) {
        let value = match p.kind {
            Kind::Size { smallest, .. } => format!("{smallest:?}"),
            Kind::Rotor => "2".to_owned(),
            Kind::OneOf(_) if p.key == FORM => format!("\"{form}\""),
            Kind::OneOf(names) => format!("\"{}\"", names[0]),
        };
        writeln!(text, "{} = {value}", p.key).unwrap();
    }
    text
}

#[test]
fn every_effect_and_form_can_be_written_in_a_file() {
    for name in Effects::<f64>::NAMES {
        let names = forms(Effects::<f64>::parameters(name).unwrap());
        for (i, form) in names.iter().copied().chain(names.is_empty().then_some("")).enumerate() {
            let full = table(name, form);
            let mut file = parse(&full).unwrap();
            let found = file.effects.get_mut(name).unwrap();
            if !names.is_empty() {
                assert_eq!(*found.values.last().unwrap(), i as f64, "{full}");
            }
            // Each of its keys is needed, and only its own are known.
            for p in found.parameters.iter().filter(|p| p.key != FORM) {
                let line = full.lines().find(|l| l.starts_with(&format!("{} = ", p.key)));
                let (text, expected) = match line {
                    Some(line) => {
                        (full.replace(&format!("{line}\n"), ""), format!("{}: missing", p.key))
                    }
                    None => {
                        (format!("{full}{} = 0.1\n", p.key), format!("{} = 0.1: not in", p.key))
                    }
                };
                let refused = parse(&text).unwrap_err();
                assert!(refused.contains(&format!("effects.{name}.{expected}")), "{refused}");
                assert_eq!(refused.lines().count(), 1, "{refused}");
            }
        }
        if let Some(standard) = names.first() {
            let unsaid = table(name, standard).replace(&format!("form = \"{standard}\"\n"), "");
            assert_eq!(
                parse(&unsaid).unwrap().effects,
                parse(&table(name, standard)).unwrap().effects
            );
        }
    }
}

/// `SQUIRREL_EFFECTS_WRITE=1` writes the page anew.
#[test]
fn the_page_of_the_docs_has_every_effect() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/guide/effects.md");
    if std::env::var_os("SQUIRREL_EFFECTS_WRITE").is_some() {
        std::fs::write(path, effects_page()).unwrap();
    }
    let page = std::fs::read_to_string(path).unwrap();
    assert!(
        page == effects_page(),
        "docs/guide/effects.md is not what the code has: SQUIRREL_EFFECTS_WRITE=1 writes it"
    );
    let names: Vec<&str> = listed_effects().iter().map(|effect| effect.name).collect();
    assert_eq!(names, Effects::<f64>::NAMES);
    assert!(names.iter().all(|name| page.contains(&format!("| `{name}` |"))));
}

#[test]
fn forms_that_cannot_be_are_refused() {
    let wind = "[effects.constant_wind]\nwind_north_m_s = 1.0\nwind_east_m_s = 0.0\n";
    for (text, expected) in [
        (
            format!("{wind}form = \"spiral\""),
            "effects.constant_wind.form = \"spiral\": must be one of constant, log_profile",
        ),
        (
            format!("{wind}form = 1"),
            "effects.constant_wind.form = 1: must be one of constant, log_profile",
        ),
        (
            format!("{wind}roughness_m = 0.1"),
            "effects.constant_wind.roughness_m = 0.1: not in the form \"constant\", only in log_profile",
        ),
        (
            format!("{wind}form = \"log_profile\""),
            "effects.constant_wind.roughness_m: missing; the form \"log_profile\" needs it",
        ),
        (
            "[effects.added_mass]\nmass_kg = 0.1\nform = \"heavy\"".to_owned(),
            "effects.added_mass.form = \"heavy\": no such parameter; known are mass_kg",
        ),
        (
            "[effects.accel_bias]\nbias_x_m_s2 = nan".to_owned(),
            "effects.accel_bias.bias_x_m_s2 = NaN: must be finite",
        ),
    ] {
        let refused = parse(&text).unwrap_err();
        assert_eq!(refused, format!("file: {expected}"));
    }
}

fn fly(effect: &str, arm: Arm, scenario: &str, duration_s: f64) -> FlightLog {
    measured(effect, arm, scenario, duration_s).log.unwrap()
}

fn measured(effect: &str, arm: Arm, scenario: &str, duration_s: f64) -> Flight {
    let mut vehicle = parse(effect).unwrap();
    vehicle.sensors = SensorParameters::ideal();
    // What an effect does to a reading is seen where no filter bears it.
    vehicle.estimator = Estimator::External;
    let mut scenario = Scenario::find(scenario).unwrap();
    scenario.duration_s = duration_s;
    // Low enough for the ground to be felt.
    scenario.height_m = 3.0;
    scenario.seed = 3;
    let setup = Setup { vehicle, arm, scenario, integrator: Integrator::Rk4 };
    setup.fly(true, |_| {}).unwrap()
}

/// Times and rows of a channel.
fn rows(log: &FlightLog, name: &str) -> Vec<(f64, Vec<f64>)> {
    let (time_s, channel) = log.channel(name).unwrap();
    time_s.iter().enumerate().map(|(i, t)| (*t, channel.row(i).to_vec())).collect()
}

fn rows_at(log: &FlightLog, name: &str, i: usize) -> Vec<f64> {
    log.channel(name).unwrap().1.row(i).to_vec()
}

fn at(rows: &[(f64, Vec<f64>)], time_s: f64) -> &[f64] {
    &rows.iter().min_by(|a, b| (a.0 - time_s).abs().total_cmp(&(b.0 - time_s).abs())).unwrap().1
}

/// Every effect in every form flies at its smallest size, and leaves a trace in the log.
#[test]
fn every_effect_flies() {
    let nominal = measured("", Arm::PcWingsOpen, "track", 12.0);
    // No scenario sinks as fast as a vortex ring begins.
    for name in Effects::<f64>::NAMES.iter().filter(|name| **name != "vortex_ring") {
        let names = forms(Effects::<f64>::parameters(name).unwrap());
        for form in names.iter().copied().chain(names.is_empty().then_some("")) {
            let flight = measured(&table(name, form), Arm::PcWingsOpen, "track", 12.0);
            let (rmse_m, before_m) = (flight.metrics.rmse_m, nominal.metrics.rmse_m);
            assert!(flight.metrics.contact_s.is_none(), "{name}, {form}");
            assert!(rmse_m < 2.0 * before_m, "{name}, {form}: {rmse_m} m, without {before_m} m");
            let traces = [&nominal, &flight].map(|f| &f.log.as_ref().unwrap().sources);
            assert!(traces[0] != traces[1], "{name}, {form} leaves no trace");
        }
    }
}

#[test]
fn an_accelerometer_bias_drifts_in_the_log() {
    let bias = "[effects.accel_bias]\nbias_x_m_s2 = 0.3\nbias_y_m_s2 = 0.0\nbias_z_m_s2 = -0.2\nform = \"drifting\"\n\
        drift_x_m_s3 = 0.0\ndrift_y_m_s3 = 0.02\ndrift_z_m_s3 = 0.0\n";
    // The flight code does not use the accelerometer, so both flights are the same.
    let (with, without) = (fly(bias, Arm::Pc, "hover", 4.0), fly("", Arm::Pc, "hover", 4.0));
    let channel = "imu.specific_force_body_m_s2";
    for (i, (t, read)) in rows(&with, channel).iter().enumerate() {
        let true_force = rows_at(&without, channel, i);
        for (axis, expected) in [0.3, 0.02 * t, -0.2].into_iter().enumerate() {
            assert!((read[axis] - true_force[axis] - expected).abs() < 2e-6, "{axis} at {t} s");
        }
    }
}

#[test]
fn a_heading_bias_turns_the_measured_attitude_about_down() {
    let log = fly("[effects.heading_bias]\nbias_rad = 0.2\n", Arm::Pc, "track", 3.0);
    let rotation = |row: &[f64]| {
        Rotation::<Ned, Body, f64>::from_wxyz([row[0], row[1], row[2], row[3]]).unwrap().quaternion
    };
    let truth = rows(&log, "truth.q_ned_from_body_wxyz");
    for (t, measured) in rows(&log, "attitude.q_ned_from_body_wxyz") {
        let error = (rotation(&measured) * rotation(at(&truth, t)).inverse()).scaled_axis();
        assert!(error.xy().norm() < 1e-5 && (error.z - 0.2).abs() < 1e-5, "{error} at {t} s");
    }
}

#[test]
fn a_late_receiver_says_where_the_vehicle_was() {
    let log = fly("[effects.gnss_latency]\nlatency_s = 0.2\n", Arm::Pc, "track", 4.0);
    let truth = rows(&log, "truth.position_ned_m");
    let fixes = rows(&log, "gnss.position_ned_m");
    assert!(fixes[0].0 >= 0.2 - 1e-9 && fixes.len() > 20, "{} from {} s", fixes.len(), fixes[0].0);
    for (t, fix) in fixes.iter().filter(|(t, _)| *t > 1.0) {
        let error = (0..3).map(|i| (fix[i] - at(&truth, t - 0.2)[i]).abs()).fold(0.0, f64::max);
        assert!(error < 0.02, "{error} m at {t} s");
    }
}

#[test]
fn a_skewed_clock_stamps_commands_and_nothing_else() {
    let log = fly("[effects.clock_skew]\nskew_ppm = 1000\n", Arm::Pc, "hover", 2.0);
    for source in ["rotor", "wing"] {
        let stamps = &log.sources[source].time_s;
        let frames = &log.sources["frame"].time_s;
        assert!(
            stamps.iter().zip(frames).all(|(s, t)| (s - t * 1.001).abs() < 1e-12)
                && stamps.len() == frames.len()
        );
    }
    assert_eq!(log.sources["truth"].time_s, log.sources["frame"].time_s);
}

/// Forwards nothing has a stamp within the step; backwards what would be stamped a second time is
/// not written.
#[test]
fn a_clock_that_jumps_leaves_a_gap_of_its_step() {
    for (step_s, gap_s) in [(0.05, 0.05), (-0.05, 0.0)] {
        let log = fly(
            &format!("[effects.clock_step]\nstep_s = {step_s}\nat_s = 1.0\n"),
            Arm::Pc,
            "hover",
            2.0,
        );
        let (stamps, frames) = (&log.sources["rotor"].time_s, &log.sources["frame"].time_s);
        let period_s = frames[1] - frames[0];
        let jump = stamps.windows(2).position(|w| w[1] - w[0] > 1.5 * period_s);
        assert!(stamps.windows(2).all(|w| w[1] > w[0]));
        assert_eq!(
            jump.map(|i| stamps[i] < 1.0 && (stamps[i + 1] - 1.0 - gap_s).abs() < period_s),
            (step_s > 0.0).then_some(true)
        );
        let last = (stamps[stamps.len() - 1] - frames[frames.len() - 1] - step_s).abs();
        assert!(last < 1e-9, "{last}");
        assert_eq!(log.sources["wing"].time_s, *stamps);
    }
}

#[test]
fn scales_and_current_show_in_the_log() {
    let scales = "[effects.gyro_scale]\nscale_x_fraction = 0.05\nscale_y_fraction = 0.0\nscale_z_fraction = -0.1\n\
        [effects.accel_scale]\nscale_x_fraction = 0.0\nscale_y_fraction = 0.0\nscale_z_fraction = 0.03\n\
        [effects.compass_current]\nheading_in_hover_rad = 0.2\n";
    let log = fly(scales, Arm::Pc, "track", 3.0);
    let truth = rows(&log, "truth.omega_body_rad_s");
    for (t, read) in rows(&log, "imu.omega_body_rad_s") {
        let turns = at(&truth, t);
        for (axis, scale) in [1.05, 1.0, 0.9].into_iter().enumerate() {
            assert!(
                (read[axis] - scale * turns[axis]).abs() < 1e-6 + 1e-6 * turns[axis].abs(),
                "{axis} at {t} s"
            );
        }
    }
    // In hover the heading is off by what the file says; where rotors work harder, by more.
    let rotation = |row: &[f64]| {
        Rotation::<Ned, Body, f64>::from_wxyz([row[0], row[1], row[2], row[3]]).unwrap().quaternion
    };
    let attitude = rows(&log, "truth.q_ned_from_body_wxyz");
    let vehicle = parse("").unwrap().vehicle;
    let speeds = rows(&log, "rotor.speed_rad_s");
    let mut loads = Vec::new();
    for (t, measured) in rows(&log, "attitude.q_ned_from_body_wxyz") {
        let mut speed = [0.0; MAX_ROTORS];
        speed[..4].copy_from_slice(at(&speeds, t));
        let load = vehicle.rotor_load(&speed);
        let error = (rotation(&measured) * rotation(at(&attitude, t)).inverse()).scaled_axis();
        assert!(
            error.xy().norm() < 1e-5 && (error.z - 0.2 * load).abs() < 1e-5,
            "{error}, {load} at {t} s"
        );
        loads.push(load);
    }
    assert!((loads[0] - 1.0).abs() < 0.05 && loads.iter().any(|load| *load > 1.1), "{loads:?}");
}

#[test]
fn late_commands_act_late() {
    // Until the first command acts, rotors keep their hover speed.
    let first_change = |effect: &str| {
        let speeds = rows(&fly(effect, Arm::Pc, "track", 1.0), "rotor.speed_rad_s");
        speeds.iter().find(|(_, row)| *row != speeds[0].1).unwrap().0
    };
    let late = first_change("[effects.actuation_latency]\nlatency_s = 0.05\n") - first_change("");
    assert!((late - 0.05).abs() < 0.004, "{late} s");
}

#[test]
fn gusts_move_the_air_by_the_seed_of_the_flight() {
    for form in ["gauss_markov", "dryden"] {
        let gust = format!("[effects.gust]\nsigma_m_s = 1.0\nform = \"{form}\"\n");
        let log = fly(&gust, Arm::Pc, "hover", 60.0);
        let air = rows(&log, "truth.wind_ned_m_s");
        for axis in 0..3 {
            let sd =
                (air.iter().map(|(_, w)| w[axis] * w[axis]).sum::<f64>() / air.len() as f64).sqrt();
            assert!((0.6..1.5).contains(&sd), "{form}, axis {axis}: {sd} m/s");
        }
        assert!(log == fly(&gust, Arm::Pc, "hover", 60.0), "one seed, one air");
    }
    let still = rows(&fly("", Arm::Pc, "hover", 1.0), "truth.wind_ned_m_s");
    assert!(still.iter().all(|(_, w)| w.iter().all(|x| *x == 0.0)));
}

#[test]
fn a_load_is_carried_and_swings() {
    let log =
        fly("[effects.payload_swing]\nmass_kg = 0.1\nlength_m = 0.5\n", Arm::Pc, "hover", 12.0);
    let speeds = rows(&log, "rotor.speed_rad_s");
    let last: Vec<_> = speeds.iter().filter(|(t, _)| *t > 10.0).collect();
    let thrust: f64 =
        last.iter().map(|(_, row)| row.iter().map(|w| 6e-7 * w * w).sum::<f64>()).sum::<f64>()
            / last.len() as f64;
    assert!((thrust / GRAVITY_M_S2 - 0.648).abs() < 0.005, "{} kg in hover", thrust / GRAVITY_M_S2);
}

#[test]
fn slow_servos_open_late() {
    let half_open = |effect: &str| {
        let wings = rows(&fly(effect, Arm::PcWingsOpen, "hover", 2.0), "wing.deployment");
        wings.iter().find(|(_, row)| row[0] > 0.5).unwrap().0
    };
    let late = half_open("[effects.wing_servo_lag]\nextra_time_constant_s = 0.3\n") - half_open("");
    assert!((0.1..0.25).contains(&late), "{late} s");
}

/// Without noise a log says exactly what the plant did, so the led plant predicts the accelerometer
/// of the same flight.
#[test]
fn a_led_plant_reads_the_accelerometer_of_the_log() {
    let effects = "[effects.payload_swing]\nmass_kg = 0.1\nlength_m = 0.5\n[effects.cg_offset]\ncg_x_m = 0.01\n\
        cg_y_m = 0.0\n[effects.accel_bias]\nbias_x_m_s2 = 0.3\nbias_y_m_s2 = 0.0\nbias_z_m_s2 = 0.0\n\
        drift_x_m_s3 = 0.0\ndrift_y_m_s3 = 0.05\ndrift_z_m_s3 = 0.0\nform = \"drifting\"\n";
    let log = fly(effects, Arm::Phantom, "track", 4.0);
    let file = parse(effects).unwrap();
    let wing = Arm::Phantom.plant_wing(&file.wing);
    let plant = Plant::new(file.vehicle, file.effects, wing, None, 1e-3).unwrap();
    let channel = |name: &str| rows(&log, name);
    let vector = |row: &[f64]| Vector3::new(row[0], row[1], row[2]);
    let (position, velocity) = (channel("truth.position_ned_m"), channel("truth.velocity_ned_m_s"));
    let (attitude, omega) =
        (channel("truth.q_ned_from_body_wxyz"), channel("truth.omega_body_rad_s"));
    let (commands, read) = (channel("rotor.command"), channel("imu.specific_force_body_m_s2"));
    let mut state = None;
    let (mut worst, mut drift) = (0.0_f64, 0.0_f64);
    for i in 0..read.len() - 1 {
        let q = &attitude[i].1;
        let motion = State {
            position: In::new(vector(&position[i].1)),
            velocity: In::new(vector(&velocity[i].1)),
            attitude: Quaternion::new(q[0], q[1], q[2], q[3]),
            omega: In::new(vector(&omega[i].1)),
            rotor_speed_rad_s: [0.0; 8],
        };
        let state = state.get_or_insert_with(|| {
            let mut start = motion;
            start.rotor_speed_rad_s[..4].copy_from_slice(&rows_at(&log, "rotor.speed_rad_s", 0));
            plant.initial_state(start, 1.0)
        });
        let mut command = [0.0; 8];
        command[..4].copy_from_slice(&commands[i].1);
        let dt_s = read[i + 1].0 - read[i].0;
        let led = plant.lead(state, &motion, &command, [0.0; 2], 14.8, dt_s);
        worst = worst.max((led.specific_force.vector - vector(&read[i].1)).norm());
        drift = state.time_s - read[i + 1].0;
    }
    assert!(drift.abs() < 1e-9, "the plant's clock is {drift} s off the log's");
    // What is left is the rounding of the log's sensors to single precision, and the load's tension
    // between samples.
    assert!(worst < 4e-3, "{worst} m/s^2");
}

/// Plants are asked at many states at once, on registers: each effect and form, without wings, with
/// flat ones and with membranes, with four rotors and with six in eight places, says the same there
/// as at one state after the other.
#[test]
fn many_states_at_once_say_what_each_says() {
    let mut rng = Pcg64Mcg::seed_from_u64(5);
    let mut draw = |size: f64| rng.random_range(-size..size);
    let mut bodies = Vec::new();
    for _ in 0..20 {
        let mut body = State::at_rest();
        let mut three = |size| Vector3::from_fn(|_, _| draw(size));
        (body.position, body.velocity) = (In::new(three(2.0)), In::new(three(8.0)));
        body.omega = In::new(three(4.0));
        body.attitude *= Quaternion::new(1.0, draw(0.5), draw(0.5), draw(2.0));
        bodies.push(body.normalised());
    }
    let of_rotors = |count: usize| {
        let mut parameters = *parse("").unwrap().vehicle.parameters();
        parameters.rotor_count = count;
        for i in 4..count {
            parameters.rotors[i] = parameters.rotors[i - 4];
            parameters.rotors[i].position.vector.x *= 1.5;
        }
        Vehicle::new(parameters).unwrap()
    };
    let flat = SQUIRREL_TOML.replace("model = \"membrane\"", "model = \"flat\"");
    let flat = VehicleFile::parse(&flat, "file").unwrap().wing;
    let all = Effects::<f64>::NAMES.iter().flat_map(|name| {
        let names = forms(Effects::<f64>::parameters(name).unwrap());
        names.iter().copied().chain(names.is_empty().then_some("")).map(|form| table(name, form))
    });
    for effect in all.chain([String::new()]) {
        let file = parse(&effect).unwrap();
        for (rotors, wing) in [
            (4, WingPlant::None),
            (4, flat.clone()),
            (4, file.wing.clone()),
            (6, flat.clone()),
            (6, file.wing.clone()),
        ] {
            let plant = Plant::new(of_rotors(rotors), file.effects, wing, None, 1e-3).unwrap();
            let mut states = plant.side_by_side(bodies.len());
            let (mut met, mut expected) = (Vec::new(), Vec::new());
            let mut state = plant.initial_state(bodies[0], 1.0);
            for (i, body) in bodies.iter().enumerate() {
                let speed = [0, 1, 2, 3, 4, 5, 6, 7].map(|r| 0.4 + 0.01 * f64::from(r + i as u8));
                plant.lead(&mut state, body, &speed, [0.9, 0.7], 15.0, 0.02);
                states.push(&state);
                met.push(state);
                expected.push(plant.led(&state));
            }
            let case = format!("{rotors} rotors, {effect}");
            assert_eq!(plant.led_at(&states), expected, "{case}");
            let still = |state: &PlantState| {
                let mut state = *state;
                state.body.rotor_speed_rad_s = [0.0; MAX_ROTORS];
                plant.led(&state)
            };
            let expected: Vec<Led> = met.iter().map(still).collect();
            assert_eq!(plant.led_at_without_rotors(&states), expected, "still, {case}");
        }
    }
}
