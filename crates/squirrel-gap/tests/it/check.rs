//! What flights are worth before any verdict: their data, and what of each effect they could show.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::support::{
    flights, fly, fly_rich, hold, imported, nanobench, step, vehicle, vehicle_with,
};
use squirrel_gap::report::render_check;
use squirrel_gap::{Check, EffectCheck, Kind, NumberCheck, Shows, check, diagnose};
use squirrel_log::FlightLog;
use squirrel_sim::vehicle_file::VehicleFile;

type Flights = Vec<(String, FlightLog)>;

fn looked(flights: &[(String, FlightLog)]) -> Check {
    check(&VehicleFile::squirrel(), flights, &[], &|_| {}).unwrap()
}

fn effect<'a>(check: &'a Check, name: &str) -> &'a EffectCheck {
    check.effects.iter().find(|effect| effect.name == name).unwrap()
}

fn number<'a>(check: &'a Check, name: &str) -> &'a NumberCheck {
    effect(check, name).decisive().unwrap()
}

/// Drag needs speed, the ground a low hover and wings wings: a hover far above the ground with
/// folded wings shows none of them, and its own weight all the same.
#[test]
fn a_hover_shows_little_and_a_rich_flight_nearly_all() {
    let hover = looked(&[fly("hover", &VehicleFile::squirrel(), 1)]);
    let rich = looked(&[fly_rich(&VehicleFile::squirrel(), 1)]);
    for name in ["linear_drag", "quadratic_drag", "wing_membrane", "wing_servo_lag", "added_mass"] {
        let [hover, rich] = [&hover, &rich].map(|check| effect(check, name));
        assert_eq!((hover.shown, rich.shown), (Shows::Cannot, Shows::Can), "{name}: {hover:?}");
        assert!(hover.fly.is_some() && rich.fly.is_none());
    }
    let can = |check: &Check| check.effects.iter().filter(|e| e.shown == Shows::Can).count();
    println!("{}\n{}", hover.words, rich.words);
    assert!(can(&rich) > 30 && can(&hover) < 20, "{} {}", can(&hover), can(&rich));
    assert_eq!(hover.effects.len(), rich.effects.len(), "each effect has its line");
    assert!(hover.fly_next.unwrap().contains("dashes"));
    assert!(hover.words.contains("linear_drag") && !rich.words.contains("linear_drag"));
}

/// Where noise alone stands against an effect, half the smallest size takes four times the flights;
/// where a tolerance does, no number of flights helps. In calm air quick flights are what lacks for
/// lift and drag, and a rotor's inertia is seen well.
#[test]
fn sizes_fall_with_the_root_of_the_number_of_flights() {
    let calm = |seed| fly("excite_calm", &VehicleFile::squirrel(), seed);
    let all: Flights = (1..=4).map(calm).collect();
    let [one, four] = [looked(&all[..1]), looked(&all)];
    let ratio = |name: &str| {
        let [one, four] = [&one, &four].map(|check| number(check, name).smallest_shown.unwrap());
        println!("{name}: {one:.3e} to {four:.3e}");
        one / four
    };
    // Flights of other seeds fly other manoeuvres; the price of a number among more data is a
    // logarithm.
    assert!((1.85..2.15).contains(&ratio("translational_lift")));
    assert!((1.7..2.2).contains(&ratio("quadratic_drag")));
    assert!((0.98..1.02).contains(&ratio("rotor_gyro_torque")));
}

/// The names of the flights of a vehicle with so much drag more than its file.
fn named(extra_drag_n_s_per_m: f64) -> (Kind, Vec<&'static str>) {
    let drag = format!("[effects.linear_drag]\nextra_drag_n_s_per_m = {extra_drag_n_s_per_m}\n\n");
    let flown = vehicle_with("squirrel.toml", &[("[limits]", &format!("{drag}[limits]"))]);
    let flights = [3, 4].map(|seed| fly_rich(&flown, seed));
    let verdict = diagnose(&VehicleFile::squirrel(), &flights, &[], &|_| {}).unwrap().verdict;
    (verdict.verdict, verdict.effects.iter().map(|effect| effect.name).collect())
}

#[test]
fn twice_the_smallest_size_is_named_and_a_quarter_is_not() {
    let found = looked(&[1, 2].map(|seed| fly_rich(&VehicleFile::squirrel(), seed)));
    let drag = number(&found, "linear_drag");
    let smallest = drag.smallest_shown.unwrap();
    assert_eq!(named(2.0 * smallest), (Kind::Named, vec!["linear_drag"]));
    let (kind, names) = named(0.25 * smallest);
    assert!(names.is_empty(), "{kind:?} {names:?}");
    assert!(drag.not_shown_below.unwrap() > 0.25 * smallest);
    let typical = (drag.smallest * drag.largest).sqrt();
    assert!((drag.smallest_shown_of_typical.unwrap() * typical / smallest - 1.0).abs() < 1e-12);
}

/// What the import did to one of two flights is told with what to change; the other one goes on.
#[test]
fn clocks_and_held_samples_are_listed() {
    let files = nanobench();
    let read = |i: usize| {
        let name = files[i].file_stem().unwrap().to_string_lossy().into_owned();
        (name, imported("nanobench.toml", &files[i]))
    };
    let file = vehicle("crazyflie21_brushed.toml");
    let spoilt = |spoil: fn(&mut FlightLog)| {
        let (good, mut bad) = (read(0), read(1));
        spoil(&mut bad.1);
        check(&file, &[good, bad], &[], &|_| {}).unwrap()
    };
    let clean = spoilt(|_| {});
    assert!(clean.flights.iter().all(|flight| flight.problem.is_none()), "{}", clean.words);

    let held = spoilt(|log| hold(log, "imu", 5));
    let problem = held.flights[1].problem.as_ref().unwrap();
    assert!(problem.channel.starts_with("imu.") && problem.words.contains("forward_filled"));
    let channel = |check: &Check, flight: usize, name: &str| {
        let own = check.flights[flight].channels.iter().find(|c| c.channel == name).unwrap();
        (own.held_share, own.largest_gap_s)
    };
    let (share, _) = channel(&held, 1, "imu.omega_body_rad_s");
    assert!((share - 0.8).abs() < 0.02, "{share}: four of five repeat the first");
    assert!(channel(&clean, 1, "imu.omega_body_rad_s").0 < 0.5);
    assert!(held.flights[0].problem.is_none() && !held.effects.is_empty());
    assert!((held.flights[1].usable_s, held.flights[0].usable_s > 1.0) == (0.0, true));

    let stepped = spoilt(|log| step(log, "gnss", 0.3));
    let problem = stepped.flights[1].problem.as_ref().unwrap();
    assert!(problem.channel.starts_with("gnss."), "{}", problem.words);
    let (_, gap_s) = channel(&stepped, 1, "gnss.velocity_ned_m_s");
    assert!(gap_s > 0.3, "{gap_s}");
    assert!(stepped.words.starts_with("1 of 2 flights"), "{}", stepped.words);
}

/// Of flights that all contradict themselves nothing is said but that.
#[test]
fn where_no_flight_is_left_no_effect_is_judged() {
    let (name, mut log) = fly_rich(&VehicleFile::squirrel(), 1);
    hold(&mut log, "imu", 30);
    let found = looked(&[(name, log)]);
    assert!(found.effects.is_empty() && found.fly_next.is_none());
    assert!(found.flights[0].problem.is_some() && found.words.contains("mend the import"));
    let page = render_check("squirrel", &found);
    assert!(page.contains("no flight is left"));
}

/// Commands that change ten times a second say nothing of a lag below a tenth.
#[test]
fn slow_commands_show_no_lag() {
    let file = vehicle("crazyflie2_arpl.toml");
    let folder = flights("arpl-motorlag");
    let read = |name: &str| imported("arpl.toml", &folder.join(format!("{name}.csv")));
    let quick = check(&file, &[("log10".to_owned(), read("log10"))], &[], &|_| {}).unwrap();
    assert_eq!(effect(&quick, "motor_lag").shown, Shows::Can, "{}", quick.words);
    let mut slow = read("log10");
    let source = slow.sources.get_mut("rotor").unwrap();
    let rate_hz = source.time_s.len() as f64 / (source.time_s.last().unwrap() - source.time_s[0]);
    hold(&mut slow, "rotor", (rate_hz / 12.0) as usize);
    let slow = check(&file, &[("log10".to_owned(), slow)], &[], &|_| {}).unwrap();
    let lag = slow.effects.iter().find(|effect| effect.name == "motor_lag");
    let problem = slow.flights[0].problem.as_ref().map(|problem| problem.channel);
    match lag {
        Some(lag) => {
            assert_eq!(lag.shown, Shows::Cannot);
            assert!(lag.lacks.as_ref().unwrap().contains("rotor.command changes at 1"), "{lag:?}");
        }
        None => assert_eq!(problem, Some("rotor.command")),
    }
}

/// Without velocity nobody knows what the air does, above all to spread wings; that rotors lag is
/// seen while they are folded.
#[test]
fn what_needs_velocity_or_height_lacks_it() {
    let (name, mut log) = fly_rich(&VehicleFile::squirrel(), 1);
    for source in ["gnss", "baro"] {
        log.sources.remove(source);
    }
    log.source_mut("rotor").channels.remove("speed_rad_s");
    let found = looked(&[(name, log)]);
    assert_eq!(effect(&found, "motor_lag").shown, Shows::Can, "{}", found.words);
    for name in ["rotor_wash", "wing_membrane", "wing_servo_lag"] {
        assert_eq!(effect(&found, name).shown, Shows::Cannot, "{name}");
    }
    for (name, what) in [
        ("linear_drag", "velocity, attitude and heading"),
        ("constant_wind", "velocity, attitude and heading"),
        ("wing_tangential", "velocity, attitude and heading"),
        ("ground_effect", "no height"),
    ] {
        let effect = effect(&found, name);
        assert_eq!(effect.shown, Shows::Cannot, "{name}");
        assert!(effect.lacks.as_ref().unwrap().contains(what), "{name}: {:?}", effect.lacks);
    }
}

#[test]
fn the_page_and_the_json_have_what_was_found() {
    let flight = fly("excite_calm", &VehicleFile::squirrel(), 1);
    let found = check(
        &VehicleFile::squirrel(),
        std::slice::from_ref(&flight),
        &[("held <out>".to_owned(), flight.1.clone())],
        &|_| {},
    )
    .unwrap();
    let page = render_check("squirrel", &found);
    assert_eq!(page, render_check("squirrel", &found));
    for part in ["check-flights", "check-effects", "held &lt;out&gt;", "imu.omega_body_rad_s"] {
        assert!(page.contains(part), "{part}");
    }
    assert!(found.effects.iter().all(|effect| page.contains(effect.name)));
    let json = serde_json::to_value(&found).unwrap();
    let effects = json["effects"].as_array().unwrap();
    let weak = effects.iter().find(|effect| effect["name"] == "weak_rotor").unwrap();
    assert_eq!(weak["numbers"].as_array().unwrap().len(), 8, "one a rotor in each form");
    assert_eq!(weak["numbers"][4]["choices"]["rotor"], 3);
    assert_eq!(weak["numbers"][5]["choices"]["form"], "thrust_alone");
    assert!(effects.iter().all(|e| e["shown"] == "can" || e["shown"] == "cannot"));
    assert_eq!(json["flights"][1]["is_held_out"], true);
}
