//! What is planned is flown, and what wings buy where both plan.

use squirrel_plan::pilot;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::journal::Keep;
use squirrel_study::planning::{self, ARMS, Row};

/// The bars of the trajectories on the full plant, with sensors and filters: nearly all are solved,
/// none that passes trunks touches one, none leaves its plan by 0.3 m, and wings gain where there
/// is braking at little thrust.
#[test]
fn plans_are_followed_on_the_full_plant() {
    let plan = Plan::calm(VehicleFile::squirrel(), ARMS.to_vec(), 40, 1);
    let study = planning::run(&plan, &Keep::default()).unwrap().unwrap();
    let row = |kind: &str, ratio: f64, arm: Arm| -> &Row {
        let is =
            |row: &&Row| row.kind == kind && row.thrust_to_weight == ratio && row.arm == arm.name();
        study.rows.iter().find(is).unwrap()
    };
    for r in &study.rows {
        assert!(r.solved.share.value >= 0.95, "{r:?}");
    }
    for arm in ARMS {
        for ratio in planning::THRUST_TO_WEIGHT {
            let r = row("pass", ratio, arm);
            assert!(
                r.clear.count == 40 && r.followed.count == 40 && r.tracking_rmse_m[1] <= 0.3,
                "{r:?}"
            );
        }
    }
    for ratio in planning::THRUST_TO_WEIGHT {
        assert!(ARMS.iter().all(|arm| row("turn", ratio, *arm).followed.count == 40), "{ratio}");
    }
    let gain = |ratio| row("turn", ratio, Arm::PlanWings).gain_over_no_wings;
    assert!(
        gain(1.2).low > 0.02
            && gain(1.2).value > gain(1.5).value
            && gain(1.5).value > gain(2.0).value
    );
    assert!(row("turn", 1.2, Arm::PlanNoWings).wings_open_s == 0.0);
}

/// Ten plans a second through the paper's manoeuvre, on what the other arms are told. Wings help
/// where thrust is short.
#[test]
fn a_planner_flies_the_paper_s_manoeuvre() {
    let fly = |arm, ratio| {
        let mut scenario = Scenario::find("steer").unwrap();
        scenario.thrust_to_weight = Some(ratio);
        let setup =
            Setup { vehicle: VehicleFile::squirrel(), arm, scenario, integrator: Integrator::Rk4 };
        let flown = pilot::fly(&setup, true, |_| {}).unwrap();
        assert_eq!(
            flown.metrics,
            pilot::fly(&setup, false, |_| {}).unwrap().metrics,
            "the same flight twice"
        );
        (flown.metrics, flown.log.unwrap())
    };
    let (with, log) = fly(Arm::PlanWings, 1.3);
    let (without, _) = fly(Arm::PlanNoWings, 1.3);
    assert!(with.encounters == 1 && with.wings_open_s > 0.3 && without.wings_open_s == 0.0);
    assert!(with.rmse_m < without.rmse_m, "{} for {}", with.rmse_m, without.rmse_m);
    // What it follows turns away; the flight code, which it commands, knows nothing of that.
    let end = |name: &str| {
        let (_, channel) = log.channel(name).unwrap();
        channel.row(channel.values.len() / channel.width - 1).to_vec()
    };
    assert!(
        end("offboard.reference.velocity_ned_m_s")[0] < 0.0
            && end("reference.velocity_ned_m_s")[0] > 6.0
    );
    let setup = Setup {
        vehicle: VehicleFile::squirrel(),
        arm: Arm::PlanWings,
        scenario: Scenario::find("steer").unwrap(),
        integrator: Integrator::Rk4,
    };
    assert!(setup.fly(false, |_| {}).unwrap_err().to_string().contains("needs its planner"));
}

/// 400 m of trunks that are not known of before they come into sight. A reference that turns back
/// this side of a trunk leads along it: who weighs that against the trunk comes through none of
/// these.
#[test]
fn a_planner_comes_through_the_forest_in_its_band() {
    let through = |seed: &u64| {
        let setup = Setup {
            vehicle: VehicleFile::squirrel(),
            arm: Arm::PlanWings,
            scenario: Scenario { seed: *seed, ..Scenario::find("forest").unwrap() },
            integrator: Integrator::Rk4,
        };
        let m = pilot::fly(&setup, false, |_| {}).unwrap().metrics;
        m.path_m >= 400.0 && m.contact_s.is_none() && m.height_lost_m.max(m.height_gained_m) < 3.0
    };
    // Two of three: the third is flown where one is lost.
    let count = (1..=3).filter(through).take(2).count();
    assert_eq!(count, 2, "of 3");
}

#[test]
fn what_cannot_be_planned_is_refused() {
    let of = |scenario: &str| Setup {
        vehicle: VehicleFile::squirrel(),
        arm: Arm::PlanWings,
        scenario: Scenario::find(scenario).unwrap(),
        integrator: Integrator::Rk4,
    };
    let error = pilot::fly(&of("excite_calm"), false, |_| {}).unwrap_err().to_string();
    assert!(error.contains("nothing to plan"), "{error}");
    // Hardly more thrust than weight still holds height.
    let mut weak = of("hover");
    weak.scenario.thrust_to_weight = Some(1.04);
    let flown = pilot::fly(&weak, false, |_| {}).unwrap().metrics;
    assert!(flown.height_lost_m < 1.0, "{flown:?}");
}
