//! What excitation flights really excite, measured from what was flown.

use squirrel_core::guidance::excite::LINES;
use squirrel_core::guidance::mission::Mission;
use squirrel_log::FlightLog;
use squirrel_sim::arm::Arm;
use squirrel_sim::estimator::Estimator;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::replay::{replay, setup};
use squirrel_sim::scenario::{Scenario, pilot_card};
use squirrel_sim::vehicle_file::{SQUIRREL_TOML, VehicleFile};
use std::f64::consts::{PI, TAU};

/// The heights of the ladder, m.
const RUNGS_M: [f64; 4] = [1.5, 0.9, 0.5, 0.2];

/// The squirrel's gains under the practice vehicle: other arms, rotors, wings and limits.
fn practice() -> VehicleFile {
    let path = format!("{}/../../vehicles/practice.toml", env!("CARGO_MANIFEST_DIR"));
    let airframe = std::fs::read_to_string(path).unwrap();
    let (_, control) = SQUIRREL_TOML.split_once("[control]").unwrap();
    VehicleFile::parse(&format!("{airframe}\n[control]{control}"), "practice").unwrap()
}

fn setup_of(vehicle: VehicleFile, arm: Arm, name: &str, seed: u64) -> Setup {
    let mut scenario = Scenario::find(name).unwrap();
    scenario.seed = seed;
    Setup { vehicle, arm, scenario, integrator: Integrator::Rk4 }
}

fn fly(vehicle: VehicleFile, arm: Arm, name: &str, seed: u64) -> FlightLog {
    let flight = setup_of(vehicle, arm, name, seed).fly(true, |_| {}).unwrap();
    assert_eq!(flight.metrics.contact_s, None, "{name}, seed {seed}");
    flight.log.unwrap()
}

/// Squirrel and the other vehicle, over seeds of both orders and both charges.
fn flights(name: &str) -> Vec<(String, FlightLog)> {
    // What is asked for is seen best where nothing is estimated.
    let right = |vehicle| VehicleFile { estimator: Estimator::Oracle, ..vehicle };
    let squirrel = (0..4).map(|seed| {
        (
            format!("squirrel {name} {seed}"),
            fly(right(VehicleFile::squirrel()), Arm::Pc, name, seed),
        )
    });
    let other = (4..6).map(|seed| {
        (format!("practice {name} {seed}"), fly(right(practice()), Arm::Pc, name, seed))
    });
    squirrel.chain(other).collect()
}

/// What a flight covered.
#[derive(Debug, Default)]
struct Figures {
    /// Top speed to the north, south, east and west, m/s.
    top_m_s: [f64; 4],
    speed_m_s: f64,
    climb_m_s: f64,
    sink_m_s: f64,
    turned_rad: f64,
    /// Seconds slower than 0.3 m/s with the nose within 10 deg of each quarter.
    headings_s: [f64; 4],
    lowest_m: f64,
    /// Mean of the last half second before each height of the ladder is left, m.
    rungs_m: Vec<f64>,
    edges: usize,
    edges_at_speed: usize,
    roll_pitch_rad: f64,
}

impl Figures {
    fn of(log: &FlightLog) -> Self {
        let (time, velocity) = log.channel("truth.velocity_ned_m_s").unwrap();
        let (_, position) = log.channel("truth.position_ned_m").unwrap();
        let (_, reference) = log.channel("reference.position_ned_m").unwrap();
        let (_, q) = log.channel("truth.q_ned_from_body_wxyz").unwrap();
        let (_, wing) = log.channel("wing.command").unwrap();
        let mut f = Self { lowest_m: f64::INFINITY, ..Self::default() };
        let (mut turned, mut least, mut most, mut last_yaw) = (0.0, 0.0_f64, 0.0_f64, 0.0);
        for i in 0..time.len() {
            let (v, height_m) = (velocity.row(i), -position.row(i)[2]);
            for (top, along) in f.top_m_s.iter_mut().zip([v[0], -v[0], v[1], -v[1]]) {
                *top = top.max(along);
            }
            let speed = v[0].hypot(v[1]).hypot(v[2]);
            f.speed_m_s = f.speed_m_s.max(speed);
            (f.climb_m_s, f.sink_m_s) = (f.climb_m_s.max(-v[2]), f.sink_m_s.max(v[2]));
            f.lowest_m = f.lowest_m.min(height_m);
            let &[w, x, y, z] = q.row(i) else { unreachable!() };
            let yaw = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
            let roll = (2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y));
            let pitch = (2.0 * (w * y - z * x)).asin();
            f.roll_pitch_rad = f.roll_pitch_rad.max(roll.abs()).max(pitch.abs());
            turned += wrapped(yaw - last_yaw);
            last_yaw = yaw;
            (least, most) = (least.min(turned), most.max(turned));
            for (k, seconds) in f.headings_s.iter_mut().enumerate() {
                let off = wrapped(yaw - k as f64 * PI / 2.0).abs();
                *seconds +=
                    if off < 10_f64.to_radians() && speed < 0.3 { 1.0 / 300.0 } else { 0.0 };
            }
            if i > 0 && wing.row(i) != wing.row(i - 1) {
                f.edges += 1;
                f.edges_at_speed += usize::from(v[0].hypot(v[1]) >= 5.0);
            }
            let leaves = |rung: f64| {
                i > 0 && -reference.row(i - 1)[2] == rung && -reference.row(i)[2] != rung && i > 150
            };
            if RUNGS_M.iter().any(|m| leaves(f64::from(*m as f32))) {
                let before = (i - 150..i).map(|k| -position.row(k)[2]).sum::<f64>() / 150.0;
                f.rungs_m.push(before);
            }
        }
        f.turned_rad = most - least;
        f
    }
}

fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

#[test]
fn rich_flights_cover_speeds_climbs_headings_heights_and_wings() {
    for (name, log) in flights("excite_rich") {
        let f = Figures::of(&log);
        let limit = if name.starts_with("squirrel") { 30_f64.to_radians() } else { 0.6 };
        let say = format!("{name}: {f:#.2?}");
        let charge = log.channel("truth.battery_charge").unwrap().1.values[0];
        let half = name.ends_with(['0', '2', '4']);
        assert!((charge - if half { 0.5 } else { 1.0 }).abs() < 0.01, "{name}: {charge}");
        assert!(f.top_m_s.iter().all(|v| (8.7..10.5).contains(v)) && f.speed_m_s >= 9.0, "{say}");
        assert!((3.0..4.0).contains(&f.climb_m_s) && (2.9..4.0).contains(&f.sink_m_s), "{say}");
        assert!(f.turned_rad > 0.98 * TAU && f.headings_s.iter().all(|s| *s > 0.3), "{say}");
        assert!(f.rungs_m.len() == 4, "{say}");
        for (flown, wanted) in f.rungs_m.iter().zip(RUNGS_M) {
            assert!((flown - wanted).abs() < 0.15 + 0.2 * wanted, "{say}");
        }
        assert!(f.rungs_m.windows(2).all(|w| w[1] < w[0] - 0.1) && f.lowest_m > 0.12, "{say}");
        assert!(f.edges >= 6 && f.edges_at_speed >= 6, "{say}");
        // The multisine is on top, and the loop overshoots.
        assert!(f.roll_pitch_rad < limit + 0.15, "{say}");
    }
}

#[test]
fn normal_flights_are_half_as_fast_and_calm_ones_stay_slow_folded_and_straight() {
    for (name, log) in flights("excite_normal") {
        let f = Figures::of(&log);
        assert!(f.top_m_s.iter().all(|v| (4.2..5.3).contains(v)), "{name}: {f:#.2?}");
        assert!(
            (1.4..2.1).contains(&f.climb_m_s) && (1.4..2.0).contains(&f.sink_m_s),
            "{name}: {f:#.2?}"
        );
        assert!(f.turned_rad > 0.98 * TAU && f.lowest_m > 0.12 && f.edges == 8, "{name}: {f:#.2?}");
    }
    for (name, log) in flights("excite_calm") {
        let f = Figures::of(&log);
        assert!(f.speed_m_s < 2.05 && f.top_m_s.iter().all(|v| *v > 1.5), "{name}: {f:#.2?}");
        assert!(f.turned_rad < 0.1 && f.edges == 0 && f.lowest_m > 5.0, "{name}: {f:#.2?}");
    }
}

/// Mean square of one line of a signal.
fn line(time: &[f64], signal: &[f64], frequency_hz: f64) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for (t, x) in time.iter().zip(signal) {
        let (s, c) = (TAU * frequency_hz * t).sin_cos();
        (re, im) = (re + x * c, im + x * s);
    }
    2.0 * (re * re + im * im) / (signal.len() * signal.len()) as f64
}

/// Body rates, and the moments behind them, hold every line of the multisine up to 6 Hz, far above
/// what a flight without it holds there.
#[test]
fn rates_and_moments_hold_the_multisine_up_to_6_hz() {
    for vehicle in [VehicleFile::squirrel(), practice()] {
        let rich = setup_of(vehicle.clone(), Arm::Pc, "excite_rich", 1);
        let Mission::Excite(programme) = rich.scenario.mission().unwrap() else { unreachable!() };
        let logs =
            ["excite_rich", "excite_normal"].map(|name| fly(vehicle.clone(), Arm::Pc, name, 1));
        for (channel, ratio) in
            [("truth.omega_body_rad_s", 10.0), ("control.inner.achieved_torque_n_m", 10.0)]
        {
            for axis in 0..3 {
                let powers = logs.each_ref().map(|log| {
                    let (time, c) = log.channel(channel).unwrap();
                    let signal: Vec<f64> = (0..time.len()).map(|i| c.row(i)[axis]).collect();
                    programme
                        .multisine()
                        .frequencies_hz(axis)
                        .map(|f| line(time, &signal, f64::from(f)))
                });
                // Below 2 Hz the manoeuvres and the position loop have their say as well.
                let high = LINES - 3..LINES;
                for k in high {
                    let (with, without) = (powers[0][k], powers[1][k]);
                    let f = programme.multisine().frequencies_hz(axis)[k];
                    assert!(
                        with > ratio * without,
                        "{channel}[{axis}] at {f} Hz: {with:e}, without {without:e}"
                    );
                }
                let sums = powers.map(|p| p.iter().sum::<f64>());
                assert!(axis == 2 || sums[0] > 2.0 * sums[1], "{channel}[{axis}]: {sums:?}");
            }
        }
    }
}

#[test]
fn seeds_change_order_directions_phases_and_charge() {
    let of = |seed| setup_of(VehicleFile::squirrel(), Arm::Pc, "excite_rich", seed).scenario;
    assert_eq!([0, 1, 2, 3].map(|seed| of(seed).start_charge()), [0.5, 1.0, 0.5, 1.0]);
    assert_eq!(Scenario::find("hover").unwrap().start_charge(), 1.0);
    let cards: Vec<String> = (0..32).map(|seed| of(seed).pilot_card().unwrap().unwrap()).collect();
    assert!(
        cards.iter().enumerate().all(|(i, card)| !cards[..i].contains(card)),
        "two seeds fly alike"
    );
    let ladder_first = cards
        .iter()
        .filter(|c| c.contains("s  descend") && c.find("descend") < c.find("dash"))
        .count();
    let north_first = cards.iter().filter(|c| c.find("m north") < c.find("m south")).count();
    assert!((8..24).contains(&ladder_first) && (8..24).contains(&north_first));
}

#[test]
fn every_arm_flies_the_forced_wings_and_replays_bit_for_bit() {
    for arm in Arm::ALONE {
        let log = fly(VehicleFile::squirrel(), arm, "excite_rich", 2);
        assert_eq!(Figures::of(&log).edges, 8, "{arm:?}");
        let result = replay(&log, &setup(&log).unwrap()).unwrap();
        assert_eq!(result.first_difference, None, "{arm:?}");
        assert!(log.sources.contains_key("control.excitation"));
    }
}

#[test]
fn cards_are_for_excitation_scenarios_and_name_what_is_flown() {
    let rich = pilot_card("excite_rich").unwrap();
    for words in
        ["8.8 m/s", "to 0.2 m", "wings open at", "0.3 to 6 Hz", "turn 90 deg", "climb to 10.8 m"]
    {
        assert!(rich.contains(words), "{words}:\n{rich}");
    }
    let calm = pilot_card("excite_calm").unwrap();
    assert!(!calm.contains("wings") && !calm.contains("turn") && !calm.contains("Hz"), "{calm}");
    assert_eq!(pilot_card("hover"), None);
    assert_eq!(pilot_card("excite"), None);
}

#[test]
fn numbers_that_cannot_be_flown_are_refused_by_name() {
    let text = Scenario::find("excite_rich").unwrap().to_toml();
    for (from, to, message) in [
        ("heights_m = [1.5, 0.9, 0.5, 0.2]", "heights_m = []", "mission.heights_m = []"),
        ("heights_m = [1.5, 0.9, 0.5, 0.2]", "heights_m = [1.0, -0.5]", "mission.heights_m = -0.5"),
        ("speed_m_s = 8.8", "speed_m_s = nan", "mission.speed_m_s = NaN"),
        ("even_seed_charge = 0.5", "even_seed_charge = 1.5", "mission.even_seed_charge = 1.5"),
        ("[0.01, 0.01, 0.0015]", "[0.01, 0.2, 0.0015]", "mission.multisine_angle_rad = 0.2"),
        (
            "multisine_thrust_share = 0.01",
            "multisine_thrust_share = -1.0",
            "mission.multisine_thrust_share = -1",
        ),
    ] {
        let changed = text.replace(from, to);
        assert_ne!(changed, text, "{from}");
        let error = Scenario::parse(&changed, "s.toml").unwrap_err();
        assert!(error.starts_with(&format!("s.toml: {message}")), "{error}");
    }
    let mut stiff = VehicleFile::squirrel();
    let mut p = *stiff.vehicle.parameters();
    p.limits.tilt_max_rad = 0.05;
    stiff.vehicle = squirrel_core::vehicle::Vehicle::new(p).unwrap();
    let error = setup_of(stiff, Arm::Pc, "excite_rich", 0).stack().unwrap_err().to_string();
    assert!(error.starts_with("limits.tilt_max_rad = 0.05"), "{error}");
}
