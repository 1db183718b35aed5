//! Identify, then fly: an effect is hidden in the vehicle, two excitation flights are diagnosed,
//! the named effect is added to the vehicle file, and the patched vehicle flies other missions in
//! closed loop. It must fly them as the true one does.
//!
//! A few effects by default; `IDENTIFY_CASES=50 cargo test -p hidden-effects --release --test
//! identify_then_fly -- --nocapture` draws as many as one likes.
#![allow(clippy::print_stdout, reason = "tests")]

use hidden_effects::catalogue::{CATALOGUE, CLASS_MASS_KG};
use hidden_effects::draw::Draw;
use hidden_effects::squirrel_made::effect_table;
use squirrel_gap::{Kind, add, diagnose};
use squirrel_log::FlightLog;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Flight, Integrator, Setup};
use squirrel_sim::scenario::{MissionTable, Scenario};
use squirrel_sim::vehicle_file::{SQUIRREL_TOML, VehicleFile};

/// Effects that the short run hides: of rotors, air, wings and the inertial unit's lever arm.
const FEW: [&str; 4] = ["motor_lag", "linear_drag", "wing_asymmetry", "cg_offset"];
/// Largest difference of tracking errors, part of the true vehicle's.
const DIFFERENCE_MAX: f64 = 0.05;
const ROTORS: usize = 4;
/// What is flown, by whom.
const MISSIONS: [(&str, Arm); 2] = [("track", Arm::Pc), ("avoid", Arm::TwccFlat)];

fn fly(
    vehicle: &VehicleFile,
    scenario: Scenario,
    arm: Arm,
    seed: u64,
    record: bool,
) -> Option<Flight> {
    let scenario = Scenario { seed, ..scenario };
    let setup = Setup { vehicle: vehicle.clone(), arm, scenario, integrator: Integrator::Rk4 };
    setup.fly(record, |_| {}).ok()
}

/// An excitation flight that does not touch the ground, whose forces are no flight: a vehicle that
/// is heavier than it thinks flies its ladder higher. `None` if it does not stay up at all.
fn excite(vehicle: &VehicleFile, seed: u64) -> Option<FlightLog> {
    let mut flown = (0..8).filter_map(|attempt| {
        let mut scenario = Scenario::find("excite_rich").unwrap();
        if let MissionTable::Excite(table) = &mut scenario.mission {
            table.heights_m.iter_mut().for_each(|height| *height += 0.3 * f64::from(attempt));
        }
        fly(vehicle, scenario, Arm::Pc, seed, true)?.log
    });
    let clear = |log: &FlightLog| {
        let (_, position) = log.channel("truth.position_ned_m").unwrap();
        position.values.chunks(3).all(|p| -p[2] > 0.06)
    };
    flown.find(clear)
}

/// A mission that every vehicle can fly: at the scenario's own 1.25 the weakest do not even reach
/// the obstacle.
fn mission(name: &str) -> Scenario {
    let scenario = Scenario::find(name).unwrap();
    Scenario { thrust_to_weight: scenario.thrust_to_weight.map(|ratio| ratio.max(1.6)), ..scenario }
}

/// What became of one hidden effect.
struct Case {
    hidden: String,
    /// The verdict and its names.
    said: String,
    /// Difference of the patched vehicle's tracking error from the true one's, part of it, for each
    /// mission.
    differences: [f64; 2],
    /// The same for the vehicle as it was.
    nominal: [f64; 2],
}

impl Case {
    fn flies_as_the_truth(&self) -> bool {
        self.differences.iter().all(|difference| difference.abs() <= DIFFERENCE_MAX)
    }
}

/// `None` if the true vehicle cannot be flown: its latency or loss is too much for its controller.
fn case(name: &str, seed: u64) -> Option<Case> {
    let entry = CATALOGUE.iter().find(|entry| entry.name == name).unwrap();
    let effect = entry.draw(&mut Draw::new(seed), "standard", CLASS_MASS_KG, ROTORS);
    let nominal = VehicleFile::squirrel();
    let truth =
        VehicleFile::parse(&(SQUIRREL_TOML.to_owned() + &effect_table(&effect)), "truth").unwrap();

    let log = |name: &str, seed| excite(&truth, seed).map(|log| (name.to_owned(), log));
    let flights = [log("first", 2 * seed + 2)?, log("second", 2 * seed + 3)?];
    let diagnosis = diagnose(&nominal, &flights, &[], &|_| {}).unwrap();
    let names: Vec<&str> = diagnosis.verdict.effects.iter().map(|effect| effect.name).collect();
    let said = format!("{:?} {}", diagnosis.verdict.verdict, names.join(" + "));
    let named =
        [Kind::Named, Kind::NamedFormDiffers, Kind::Ambiguous].contains(&diagnosis.verdict.verdict);
    let patched = if named {
        let text = add(&nominal, &diagnosis, &["first".to_owned(), "second".to_owned()]).unwrap();
        VehicleFile::parse(&text, "patched").unwrap()
    } else {
        nominal.clone()
    };

    let rmse = |vehicle: &VehicleFile| -> Option<[f64; 2]> {
        let [track, avoid] =
            MISSIONS.map(|(name, arm)| fly(vehicle, mission(name), arm, 1000 + seed, false));
        Some([track?.metrics.rmse_m, avoid?.metrics.rmse_m])
    };
    let (truth, lost) = (rmse(&truth)?, [f64::INFINITY; 2]);
    let (nominal, patched) = (rmse(&nominal).unwrap_or(lost), rmse(&patched).unwrap_or(lost));
    let over = |errors: [f64; 2]| [errors[0] / truth[0] - 1.0, errors[1] / truth[1] - 1.0];
    Some(Case {
        hidden: format!("{:?}", effect.parameters),
        said,
        differences: over(patched),
        nominal: over(nominal),
    })
}

#[test]
fn the_patched_vehicle_flies_as_the_true_one() {
    let cases: Vec<(&str, u64)> = match std::env::var("IDENTIFY_CASES") {
        Ok(count) => (0..count.parse().unwrap())
            .map(|i: usize| (CATALOGUE[i % CATALOGUE.len()].name, i as u64))
            .collect(),
        Err(_) => FEW.iter().enumerate().map(|(i, name)| (*name, i as u64)).collect(),
    };
    println!(
        "tracking error over that of the true vehicle, %: {} and {}",
        MISSIONS[0].0, MISSIONS[1].0
    );
    let (mut right, mut wrong) = (0, Vec::new());
    for (name, seed) in &cases {
        let case = (0..5).find_map(|again| case(name, seed + 100 * again)).unwrap();
        let percent = |x: [f64; 2]| format!("{:+7.2} {:+7.2}", 100.0 * x[0], 100.0 * x[1]);
        let line = format!(
            "{name:20} nominal {} patched {}  {} {}",
            percent(case.nominal),
            percent(case.differences),
            case.said,
            case.hidden
        );
        println!("{line}");
        if case.flies_as_the_truth() { right += 1 } else { wrong.push(line) }
    }
    println!("{right} of {} fly as the truth", cases.len());
    assert!(wrong.is_empty(), "{wrong:#?}");
}
