//! Plans in moving air: known, they hold; unknown, the planner in the loop finds it.

use squirrel_plan::pilot;
use squirrel_plan::trajectory::{Air, Craft, Planner, RESERVE, Task};
use squirrel_plan::wing::WingModel;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Follower, InProcess, Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

fn avoid(arm: Arm, wind: [f64; 3]) -> Setup {
    let mut scenario = Scenario { seed: 1, ..Scenario::find("avoid").unwrap() };
    scenario.wind.mean_ned_m_s = wind;
    Setup { vehicle: VehicleFile::squirrel(), arm, scenario, integrator: Integrator::Rk4 }
}

/// With a wind from behind wings do little at the speed that is flown, and a plan that counts on
/// them sinks.
#[test]
fn a_tail_wind_is_noticed() {
    for arm in [Arm::PlanWings, Arm::PlanNoWings] {
        let flight = pilot::fly(&avoid(arm, [3.0, 0.0, 0.0]), true, |_| {}).unwrap();
        let lost_m = flight.metrics.height_lost_m;
        assert!(lost_m < 1.5, "{arm:?} sinks {lost_m} m");
        let log = flight.log.unwrap();
        let (time_s, wind) = log.channel("offboard.believed.wind_ned_m_s").unwrap();
        let last = wind.row(time_s.len() - 1);
        // Wings that do less than the flat plate that is believed in pass for more of it.
        assert!(
            (1.0..7.0).contains(&last[0]) && last[1].hypot(last[2]) < last[0],
            "{arm:?}: {last:?}"
        );
    }
}

/// Against the wind they do more, and so they are worth more.
#[test]
fn a_head_wind_is_used() {
    let rmse_m = |arm, north| {
        pilot::fly(&avoid(arm, [north, 0.0, 0.0]), false, |_| {}).unwrap().metrics.rmse_m
    };
    let gain = |north| rmse_m(Arm::PlanNoWings, north) / rmse_m(Arm::PlanWings, north);
    let (calm, windy) = (gain(0.0), gain(-3.0));
    assert!(windy > 1.1 * calm && calm > 1.1, "{windy} for {calm}");
}

/// A plan for a wind that is known is flown in it within 0.3 m, and closer than one for calm air.
#[test]
fn a_known_wind_is_planned_for() {
    let wind = [4.0, -2.0, 0.0];
    let mut setup = avoid(Arm::Pc, wind);
    (setup.scenario.measured_window_s, setup.scenario.duration_s) = (0.0, 8.0);
    let mut craft = Craft::of(
        &setup.vehicle,
        setup.thrust_to_weight() * setup.vehicle.vehicle.weight_n(),
        Some(WingModel::Flat),
        RESERVE,
    )
    .unwrap();
    let rmse_m = |craft: &Craft| {
        let task = Task::of(&setup.scenario, craft, 0.8, 8.0, 0.1).unwrap();
        let plan = Planner::default().plan(craft, &task, None);
        let mut follower = Follower::new(&setup).unwrap();
        follower.follow(plan.track, 0);
        let mut link = InProcess::new(setup.stack().unwrap());
        setup.fly_on(&mut link, Some(&mut follower), false, |_| {}).unwrap().metrics.rmse_m
    };
    let unknown_m = rmse_m(&craft);
    craft.air = Air::windy(wind.into()).unwrap();
    let known_m = rmse_m(&craft);
    assert!(known_m < 0.3 && known_m < 0.7 * unknown_m, "{known_m} for {unknown_m}");
}
