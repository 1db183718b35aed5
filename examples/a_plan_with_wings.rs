//! Lesson 14, `squirrel plan`: what wings buy where both with and without them plan ahead.
//!
//! A [`Craft`] is what the vehicle can do, a [`Task`] where it is and what it should be near to,
//! and a [`Planner`] makes a plan of both: where to be, how the rotors shall push, when the wings
//! shall open. Here a run-up of 6 s leads straight on, and then the vehicle shall go off at 120 deg
//! at once, the paper's manoeuvre, of which the first plan knew nothing. The same planner without
//! wings is the fair rival. Both plans in a row are flown on the full plant, with sensors, rotors
//! and a membrane for a wing, by a [`Follower`]: look how far beside its plan each flight is. Wings
//! brake harder, so that the turn comes nearer to what was wanted, by four percent where thrust is
//! scarce and by hardly one where it is not.
//!
//! ```sh
//! cargo run --release -p squirrel-examples --example a_plan_with_wings
//! squirrel plan --scenario avoid --out plan.mcap --report plan.html
//! squirrel fly --scenario avoid --reference plan.mcap
//! squirrel study planning
//! ```
#![allow(clippy::print_stdout, reason = "a lesson is told")]

use squirrel_core::frames::In;
use squirrel_core::guidance::trajectory::Trajectory;
use squirrel_core::nalgebra::Vector3;
use squirrel_examples::Outcome;
use squirrel_plan::trajectory::{Begin, Craft, Planner, RESERVE, Status, Task, Wanted};
use squirrel_plan::wing::WingModel;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Follower, InProcess, Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::track::{Track, TrackPoint};
use squirrel_sim::vehicle_file::VehicleFile;

const STEP_S: f64 = 0.1;
const RUN_UP_S: f64 = 6.0;
const TURN_S: f64 = 2.0;
const SPEED_M_S: f32 = 7.0;

/// What came of a plan.
struct Flown {
    status: Status,
    /// Of the planned turn to what was wanted, m.
    wanted_rmse_m: f64,
    /// Of the flown turn to the planned one, m.
    beside_rmse_m: f64,
    wings_open_s: f64,
    /// Planned speed against the old course at the end, m/s.
    back_m_s: f64,
}

/// Along a course from a place on, up to speed within a time.
fn along(from: Vector3<f64>, course_rad: f32, ramp_s: f32, duration_s: f64) -> Vec<Wanted> {
    let run = Trajectory::new(In::new(from.cast()), course_rad, SPEED_M_S, ramp_s);
    let wanted = (0..=(duration_s / STEP_S).round() as usize).map(|k| {
        let at = run.at((k as f64 * STEP_S) as f32);
        Wanted { position: at.position.vector.cast(), velocity: at.velocity.vector.cast() }
    });
    wanted.collect()
}

fn rmse_m(squares: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = squares.len() as f64;
    (squares.sum::<f64>() / count).sqrt()
}

fn fly(thrust_to_weight: f64, wing: Option<WingModel>) -> Outcome<Flown> {
    let vehicle = VehicleFile::squirrel();
    let thrust_max_n = thrust_to_weight * vehicle.vehicle.weight_n();
    let craft = Craft::of(&vehicle, thrust_max_n, wing, RESERVE)?;
    let mut scenario =
        Scenario { duration_s: RUN_UP_S + TURN_S, seed: 1, ..Scenario::find("hover")? };
    scenario.thrust_to_weight = Some(thrust_to_weight);

    let start = Vector3::new(0.0, 0.0, -scenario.height_m);
    let hover =
        Begin { position: start, velocity: Vector3::zeros(), thrust: -craft.hover(), spread: 0.0 };
    let straight =
        Task::new(hover, along(start, 0.0, 5.0, RUN_UP_S), vec![], STEP_S, f64::INFINITY)?;
    let run_up = Planner::default().plan(&Craft { wing: None, ..craft.clone() }, &straight, None);
    let last = run_up.track.points().last().ok_or("an empty plan")?;

    let begin = Begin {
        position: last.position,
        velocity: last.velocity,
        thrust: last.thrust,
        spread: 0.0,
    };
    let wanted = along(last.position, 120_f32.to_radians(), 2.0, TURN_S);
    let task = Task::new(begin, wanted, vec![], STEP_S, f64::INFINITY)?;
    let turn = Planner::default().plan(&craft, &task, None);

    let points = turn.track.points();
    let both: Vec<TrackPoint> = run_up.track.points().iter().chain(&points[1..]).copied().collect();
    let track = Track::even(STEP_S, both);
    let setup = Setup { vehicle, arm: Arm::Pc, scenario, integrator: Integrator::Rk4 };
    let mut follower = Follower::new(&setup)?;
    follower.follow(track.clone(), 0);
    let flight =
        setup.fly_on(&mut InProcess::new(setup.stack()?), Some(&mut follower), true, |_| {})?;

    let log = flight.log.ok_or("no log was kept")?;
    let (time_s, truth) = log.channel("truth.position_ned_m").ok_or("the log lacks the truth")?;
    let mut beside = Vec::new();
    for (i, time_s) in time_s.iter().enumerate().filter(|(_, time_s)| **time_s >= RUN_UP_S) {
        let planned = track.at(*time_s).ok_or("an empty plan")?.position;
        beside.push((Vector3::from_column_slice(truth.row(i)) - planned).norm_squared());
    }
    let off = points
        .iter()
        .zip(task.wanted())
        .map(|(point, wanted)| (point.position - wanted.position).norm_squared());
    Ok(Flown {
        status: turn.status,
        wanted_rmse_m: rmse_m(off),
        beside_rmse_m: rmse_m(beside.into_iter()),
        wings_open_s: points.iter().map(|point| point.wing * STEP_S).sum(),
        back_m_s: -points.last().map_or(0.0, |point| point.velocity.x),
    })
}

fn main() -> Outcome<()> {
    println!("ratio  wings  plan    to wanted m  beside the plan m  wings open s  back at m/s");
    for ratio in [1.2, 1.5, 2.0] {
        for wing in [Some(WingModel::Flat), None] {
            let flown = fly(ratio, wing)?;
            println!(
                "{ratio:>5.1}  {:<5}  {}  {:>11.3}  {:>17.3}  {:>12.2}  {:>11.2}",
                wing.map_or("none", WingModel::name),
                flown.status.name(),
                flown.wanted_rmse_m,
                flown.beside_rmse_m,
                flown.wings_open_s,
                flown.back_m_s
            );
        }
    }
    Ok(())
}

#[test]
fn wings_buy_a_few_percent_where_both_plan() -> Outcome<()> {
    let gain = |ratio| {
        let [with, without] = [fly(ratio, Some(WingModel::Flat))?, fly(ratio, None)?];
        assert!(with.beside_rmse_m < 0.5 && without.beside_rmse_m < 0.5, "{ratio}");
        assert!(with.wings_open_s > 0.3 && without.wings_open_s < 1e-6, "{ratio}");
        Ok::<_, Box<dyn std::error::Error>>(without.wanted_rmse_m / with.wanted_rmse_m - 1.0)
    };
    let [scarce, plenty] = [gain(1.2)?, gain(2.0)?];
    assert!(plenty > 0.0 && plenty < scarce && scarce < 0.1, "{scarce} {plenty}");
    Ok(())
}
