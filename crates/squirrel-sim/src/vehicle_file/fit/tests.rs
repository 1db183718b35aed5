use super::*;
use squirrel_log::{Channel, Source};
use std::fmt::Write;

fn squirrel() -> VehicleFile {
    VehicleFile::squirrel()
}

fn field(numbers: &[Fitted], name: &str) -> (f64, f64) {
    let found = numbers.iter().find(|f| f.field == name).unwrap();
    (found.value[0], found.sd[0])
}

#[test]
fn a_stand_gives_back_what_it_was_made_of() {
    let mut text = "# stand\ncommand,rotor_speed_rpm,thrust_g,torque_n_m,voltage_v\n".to_owned();
    for i in 1..=10 {
        let u = 0.1 * f64::from(i);
        let speed = 2800.0 * u;
        let (rpm, grams) =
            (speed * 60.0 / std::f64::consts::TAU, 5e-7 * speed * speed / 9.80665e-3);
        writeln!(text, "{u},{rpm},{grams},{},15.5", 6e-9 * speed * speed).unwrap();
    }
    let stand = Stand::parse(&text, "stand.csv").unwrap();
    let fit = stand.fit(&squirrel(), "stand.csv").unwrap();
    assert!(fit.residual_n < 1e-9);
    let close = |name: &str, truth: f64| {
        let (value, sd) = field(&fit.numbers, name);
        assert!((value / truth - 1.0).abs() < 1e-6, "{name}: {value}");
        assert!((sd / value - 0.02).abs() < 1e-3, "{name}: {sd}");
    };
    close("propulsion.thrust_coefficient_n_s2", 5e-7);
    close("propulsion.torque_coefficient_n_m_s2", 6e-9);
    close("propulsion.speed_max_rad_s", 2800.0);
    let file = VehicleFile::parse(&patched(&squirrel(), &fit.numbers).unwrap(), "fitted").unwrap();
    let p = file.vehicle.parameters();
    assert!((p.propulsion.thrust_coefficient_n_s2 - 5e-7).abs() < 1e-12);
    assert!((p.propulsion.reference_voltage_v - 15.5).abs() < 1e-9);
    assert!((p.limits.thrust_max_n - 4.0 * 5e-7 * 2800.0_f64.powi(2)).abs() < 1e-2);
    // Nothing else has changed.
    let changed = crate::vehicle_file::diff::compare(&squirrel(), &file).unwrap().numbers;
    assert_eq!(changed.len(), 5, "{changed:?}");
}

#[test]
fn a_stand_that_is_no_square_gets_a_curve() {
    let mut text = "command,thrust_n\n".to_owned();
    for i in 1..=12 {
        let u = f64::from(i) / 12.0;
        writeln!(text, "{u},{}", 3.0 * u + 2.0 * u * u).unwrap();
    }
    let fit = Stand::parse(&text, "s").unwrap().fit(&squirrel(), "s").unwrap();
    let file = VehicleFile::parse(&patched(&squirrel(), &fit.numbers).unwrap(), "f").unwrap();
    // 3 u + 2 u^2 = 1.3435 N.
    let u = (9.0_f64 + 8.0 * 1.3435).sqrt();
    assert!((file.means().unwrap().hover_command - (u - 3.0) / 4.0).abs() < 1e-3);
}

#[test]
fn stands_that_say_nothing_are_refused_by_place() {
    for (text, word) in [
        ("", "no column thrust_n"),
        ("thrust_n\n1\n", "rotor_speed_rad_s"),
        ("thrust_n,command\n1,x\n", "line 2: command = x"),
        ("thrust_n,command\n1,0.5\n2\n", "line 3: command = "),
        ("thrust_n,thrust_g,command\n1,1,1\n", "thrust_g: a second"),
        ("thrust_n,command_pwm_us\n1,1500\n1,0.2\n", "line 3: command_pwm_us = 0.2: must be 1000"),
        ("thrust_n,command\n1,-0.1\n", "line 2: command = -0.1: must be 0 to 1"),
        ("thrust_n,command\n1,55\n", "line 2: command = 55"),
        ("thrust_n,command,voltage_v\n1,0.5,0\n", "line 2: voltage_v = 0: must be 0.1 to 1000"),
        ("thrust_n,command,voltage_v\n1,0.5,16000\n", "line 2: voltage_v = 16000"),
        ("thrust_n,rotor_speed_rpm\n1,-5\n", "line 2: rotor_speed_rpm = -5"),
        ("thrust_n,command,torque_n_m\n1,0.5,1e4\n", "line 2: torque_n_m = 1e4"),
    ] {
        let error = Stand::parse(text, "s.csv").unwrap_err();
        assert!(error.starts_with("s.csv") && error.contains(word), "{error}");
    }
    let few = Stand::parse("thrust_n,command\n1,0.5\n2,0.6\n", "s.csv").unwrap();
    assert!(few.fit(&squirrel(), "s.csv").unwrap_err().contains("2 points"));
}

#[test]
fn swings_say_the_inertia() {
    // T = 4 pi / d sqrt(L J / (m g)).
    let period =
        |j: f64| 4.0 * std::f64::consts::PI / 0.2 * (1.5 * j / (0.548 * GRAVITY_M_S2)).sqrt();
    let text = format!(
        "axis,period_s,thread_length_m,thread_distance_m\nx,{},1.5,0.2\nx,{},1.5,0.2\nz,{},1.5,0.2\n",
        period(0.004),
        period(0.004),
        period(0.008),
    );
    let fit = swings(&squirrel(), &Swing::parse(&text, "w.csv").unwrap(), "w.csv").unwrap();
    let [x, y, z] = fit.numbers[0].value[..].try_into().unwrap();
    assert!((x - 0.004_f64).abs() < 1e-9 && (z - 0.008_f64).abs() < 1e-9);
    assert!((y - 4.68e-3_f64).abs() < 1e-9, "not swung");
    patched(&squirrel(), &fit.numbers).unwrap();
    for (text, word) in [
        ("axis,period_s\n", "thread_length_m"),
        ("axis,period_s,thread_length_m,thread_distance_m\nw,1,1,1\n", "axis = w"),
        ("axis,period_s,thread_length_m,thread_distance_m\nx,-1,1,1\n", "period_s = -1"),
        ("axis,period_s,thread_length_m,thread_distance_m\n", "no swings"),
    ] {
        let error = Swing::parse(text, "w.csv").unwrap_err();
        assert!(error.starts_with("w.csv") && error.contains(word), "{error}");
    }
    let far = "axis,period_s,thread_length_m,thread_distance_m\ny,1e200,1.5,0.2\n";
    let error = swings(&squirrel(), &Swing::parse(far, "w.csv").unwrap(), "w.csv").unwrap_err();
    assert!(error.starts_with("w.csv: mass.inertia_kg_m2 comes out as ["), "{error}");
}

fn log(source: &str, channel: &str, width: usize, time_s: Vec<f64>, values: Vec<f64>) -> FlightLog {
    let mut log = FlightLog::default();
    let channels = [(channel.to_owned(), Channel { width, values })].into();
    log.sources.insert(source.to_owned(), Source { time_s, channels });
    log
}

#[test]
fn a_gyroscope_says_the_period() {
    let time_s: Vec<f64> = (0..2000).map(|i| 0.01 * f64::from(i)).collect();
    let values = time_s
        .iter()
        .flat_map(|t| {
            let swing = (std::f64::consts::TAU * t / 1.7).sin() * (-0.05 * t).exp();
            [0.01 * (13.0 * t).sin(), 0.4 + 1.5 * swing + 0.02 * (91.0 * t).sin(), 0.0]
        })
        .collect();
    let log = log("imu", "omega_body_rad_s", 3, time_s, values);
    let (axis, period) = period_s(&log, "w").unwrap();
    assert_eq!(axis, 1);
    assert!((period - 1.7).abs() < 0.01, "{period}");
    assert!(period_s(&FlightLog::default(), "w").unwrap_err().contains("omega_body_rad_s"));
}

#[test]
fn a_hover_scales_thrust() {
    let time_s: Vec<f64> = (0..300).map(|i| 0.01 * f64::from(i)).collect();
    // The file says sqrt(1.3435 / 5.4) = 0.499; this one hovers at 0.55.
    let values = vec![0.55; 1200];
    let hovering = log("rotor", "command", 4, time_s, values);
    let numbers = hover(&squirrel(), &hovering, "h.mcap").unwrap();
    let file = VehicleFile::parse(&patched(&squirrel(), &numbers).unwrap(), "f").unwrap();
    assert!((file.means().unwrap().hover_command - 0.55).abs() < 1e-4);
    let (value, sd) = field(&numbers, "propulsion.thrust_coefficient_n_s2");
    assert!((sd / value - 0.02).abs() < 1e-6);
    let three = log("rotor", "command", 3, vec![0.0, 0.1], vec![0.5; 6]);
    assert!(hover(&squirrel(), &three, "h.mcap").unwrap_err().contains("3 rotors"));
    assert!(
        hover(&squirrel(), &FlightLog::default(), "h.mcap").unwrap_err().contains("rotor.command")
    );
}
