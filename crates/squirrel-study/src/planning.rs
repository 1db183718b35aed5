//! What wings buy where both plan: random avoidance tasks, planned with and without, and flown on
//! the full plant.
//!
//! Each trial flies straight on for four and a half seconds. Then one plan is made from what the
//! vehicle believes of itself, two seconds long, and followed to its end without another one. Two
//! kinds of task, each at three thrust-to-weight ratios:
//! - `pass`: on past one to three trunks that stand in the way;
//! - `turn`: away from a trunk by 110 to 130 deg, the paper's manoeuvre.
//!
//! Both planners have the same numbers; the one without wings is the fair rival (docs/equations.md
//! G.1).

mod table;

pub use table::STUDY;

use crate::campaign::{self, Flown, Plan};
use crate::journal::{Journal, Keep};
use crate::statistics::{Estimate, Share, gain, mean, paired};
use serde::{Deserialize, Serialize};
use squirrel_core::control::Reference;
use squirrel_core::frames::In;
use squirrel_core::guidance::trajectory::Trajectory;
use squirrel_core::nalgebra::{Vector2, Vector3};
use squirrel_core::policy::PilotCommand;
use squirrel_core::stack::SensorFrame;
use squirrel_plan::pilot::{HORIZON_S, SPARE_M, STEP_S, begin, half_width_m};
use squirrel_plan::trajectory::{Begin, Craft, KeepOut, Planner, RESERVE, Task, Wanted};
use squirrel_plan::wing::WingModel;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{FlightError, Follower, InProcess, Offboard, Setup};
use squirrel_sim::scenario::{MissionTable, Scenario};

/// The arms: with wings, and the rival.
pub const ARMS: [Arm; 2] = [Arm::PlanWings, Arm::PlanNoWings];
/// Thrust-to-weight ratios.
pub const THRUST_TO_WEIGHT: [f64; 3] = [1.2, 1.5, 2.0];
/// Kinds of task.
pub const KINDS: [&str; 2] = ["pass", "turn"];
/// When the plan is made, s.
const BEGIN_S: f64 = 4.5;
/// Time to reach the speed of the run-up, s.
const RAMP_S: f64 = 3.0;
/// Error in following a plan that counts as having followed it, m.
pub const FOLLOWED_M: f64 = 0.3;

/// One task, drawn.
#[derive(Debug, Clone, PartialEq)]
struct Drawn {
    speed_m_s: f64,
    /// Away from the course, rad; `None` goes straight on.
    turn_rad: Option<f64>,
    /// Along and across the course from where the plan begins, and radius, m.
    trunks: Vec<[f64; 3]>,
}

/// One flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Trial {
    status: String,
    cost: f64,
    iterations: u32,
    /// Of the plan to what was wanted, m.
    wanted_rmse_m: f64,
    /// Of the flight to the plan, m.
    tracking_rmse_m: f64,
    /// From the vehicle's edge to the nearest trunk, as flown, m.
    clearance_m: f64,
    height_lost_m: f64,
    wings_open_s: f64,
}

/// An arm on one kind of task at one ratio.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// [`KINDS`].
    pub kind: &'static str,
    /// Thrust-to-weight ratio.
    pub thrust_to_weight: f64,
    /// Arm.
    pub arm: &'static str,
    /// Plans that hold every constraint and are done.
    pub solved: Share,
    /// Flights without contact.
    pub clear: Share,
    /// Flights within [`FOLLOWED_M`] of their plan.
    pub followed: Share,
    /// Mean and worst error in following the plan, m.
    pub tracking_rmse_m: [f64; 2],
    /// Mean distance of the plan to what was wanted, m.
    pub wanted_rmse_m: f64,
    /// Mean cost.
    pub cost: f64,
    /// Mean distance to what was wanted of `plan_no_wings` over the arm's, minus 1.
    pub gain_over_no_wings: Estimate,
    /// Mean of the largest sink, as flown, m.
    pub height_lost_m: f64,
    /// Mean, as flown, s.
    pub wings_open_s: f64,
    /// Mean number of convex problems.
    pub iterations: f64,
}

/// The study's result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Planning {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Tasks of each kind at each ratio.
    pub trials: u32,
    /// Seed of all trials.
    pub seed: u64,
    /// By kind, ratio and arm.
    pub rows: Vec<Row>,
}

/// Kind and ratio of each condition.
fn conditions() -> impl Iterator<Item = (&'static str, f64)> {
    KINDS.into_iter().flat_map(|kind| THRUST_TO_WEIGHT.map(|ratio| (kind, ratio)))
}

/// Flies the study on all cores; the result depends neither on threads nor on how often it was
/// stopped. `None` where only a part is flown here.
///
/// * `plan` - its arms must be [`ARMS`]
///
/// # Errors
/// A vehicle that cannot fly, or a folder that cannot be written.
pub fn run(plan: &Plan, keep: &Keep<'_>) -> Result<Option<Planning>, FlightError> {
    let all: Vec<(&str, f64)> = conditions().collect();
    for (kind, ratio) in &all {
        plan.check(&plan.vehicle, &scenario(plan, kind, *ratio, 0).1)?;
    }
    let scenarios: Vec<Scenario> =
        all.iter().map(|(kind, ratio)| scenario(plan, kind, *ratio, 0).1).collect();
    let journal = Journal::open(keep, "planning", &plan.identity("planning", &scenarios))?;
    let fly = |arm, condition: usize, trial| {
        let (kind, ratio) = all[condition];
        fly(plan, arm, kind, ratio, trial)
    };
    let Some(flown) = campaign::run(plan, all.len(), &journal, fly)? else { return Ok(None) };
    let rows = all.iter().enumerate().flat_map(|(i, (kind, ratio))| {
        let flown = &flown;
        plan.arms.iter().map(move |arm| row(flown, *arm, i, kind, *ratio))
    });
    Ok(Some(Planning {
        vehicle: plan.vehicle.name.clone(),
        trials: plan.trials,
        seed: plan.seed,
        rows: rows.collect(),
    }))
}

fn row(flown: &Flown<Trial>, arm: Arm, condition: usize, kind: &'static str, ratio: f64) -> Row {
    let trials = flown.of(arm, condition);
    let share = |is: &dyn Fn(&Trial) -> bool| Share::of(trials.iter().map(|trial| is(trial)));
    let figures = |of: fn(&Trial) -> f64| flown.figures(arm, condition, of);
    let rival = flown.figures(Arm::PlanNoWings, condition, |trial| trial.wanted_rmse_m);
    let own = figures(|trial| trial.wanted_rmse_m);
    let tracking = figures(|trial| trial.tracking_rmse_m);
    Row {
        kind,
        thrust_to_weight: ratio,
        arm: arm.name(),
        solved: share(&|trial| trial.status == "solved"),
        clear: share(&|trial| trial.clearance_m > 0.0),
        followed: share(&|trial| trial.tracking_rmse_m <= FOLLOWED_M),
        tracking_rmse_m: [mean(&tracking), tracking.iter().copied().fold(0.0, f64::max)],
        wanted_rmse_m: mean(&own),
        cost: mean(&figures(|trial| trial.cost)),
        gain_over_no_wings: paired(&rival, &own, gain),
        height_lost_m: mean(&figures(|trial| trial.height_lost_m)),
        wings_open_s: mean(&figures(|trial| trial.wings_open_s)),
        iterations: mean(&figures(|trial| f64::from(trial.iterations))),
    }
}

/// A task and the scenario around it.
fn scenario(plan: &Plan, kind: &str, ratio: f64, trial: u32) -> (Drawn, Scenario) {
    let seed = plan.trial_seed(trial);
    let mut draw = campaign::Draw::new(seed, trial);
    let speed_m_s = draw.between(4.0, 8.0);
    let drawn = if kind == "turn" {
        let side = draw.one_of(&[-1.0, 1.0]);
        let turn_rad = side * draw.between(110.0, 130.0).to_radians();
        let trunk = [draw.between(0.9, 1.4) * speed_m_s, draw.between(-0.5, 0.5), 0.5];
        Drawn { speed_m_s, turn_rad: Some(turn_rad), trunks: vec![trunk] }
    } else {
        let count = draw.one_of(&[1, 2, 3]);
        let trunks = (0..count)
            .map(|_| {
                [
                    draw.between(0.9, 1.8) * speed_m_s,
                    draw.between(-1.5, 1.5),
                    draw.between(0.3, 0.6),
                ]
            })
            .collect();
        Drawn { speed_m_s, turn_rad: None, trunks }
    };
    let mut scenario = Scenario::turn("planning", speed_m_s, 0.1, 0.0, 0.0);
    if let MissionTable::Avoid { ramp_s, .. } = &mut scenario.mission {
        *ramp_s = RAMP_S;
    }
    let begin_m = speed_m_s * (BEGIN_S - RAMP_S / 3.0);
    scenario.obstacles =
        drawn.trunks.iter().map(|[ahead, across, r]| [begin_m + ahead, *across, *r]).collect();
    scenario.duration_s = BEGIN_S + HORIZON_S + 0.1;
    scenario.measured_window_s = HORIZON_S;
    scenario.thrust_to_weight = Some(ratio);
    scenario.seed = seed;
    (drawn, plan.outside(scenario))
}

/// One plan, made at [`BEGIN_S`] and followed.
struct Once {
    drawn: Drawn,
    setup: Setup,
    craft: Craft,
    follower: Follower,
    made: Option<(Task, squirrel_plan::trajectory::Plan)>,
}

impl Once {
    fn new(drawn: Drawn, setup: &Setup) -> Result<Self, FlightError> {
        let follower = Follower::new(setup)?;
        Ok(Self { craft: craft(setup)?, drawn, setup: setup.clone(), follower, made: None })
    }
}

/// What the planner of a setup's arm believes.
fn craft(setup: &Setup) -> Result<Craft, FlightError> {
    let thrust_max_n = setup.thrust_to_weight() * setup.vehicle.vehicle.weight_n();
    let wing = (setup.arm == Arm::PlanWings).then_some(WingModel::Flat);
    Craft::of(&setup.vehicle, thrust_max_n, wing, RESERVE).map_err(FlightError)
}

/// What is asked of the planner.
fn task(drawn: &Drawn, setup: &Setup, begin: Begin, time_s: f64) -> Result<Task, FlightError> {
    let start = Vector3::new(0.0, 0.0, -setup.scenario.height_m as f32);
    let (run, since_s) = match drawn.turn_rad {
        None => {
            (Trajectory::new(In::new(start), 0.0, drawn.speed_m_s as f32, RAMP_S as f32), time_s)
        }
        Some(turn_rad) => {
            let here = Vector3::new(begin.position.x as f32, begin.position.y as f32, start.z);
            (Trajectory::new(In::new(here), turn_rad as f32, drawn.speed_m_s as f32, 2.0), 0.0)
        }
    };
    let wanted = (0..=(HORIZON_S / STEP_S).round() as usize).map(|k| {
        let at: Reference = run.at((since_s + k as f64 * STEP_S) as f32);
        Wanted { position: at.position.vector.cast(), velocity: at.velocity.vector.cast() }
    });
    let spare_m = half_width_m(setup) + SPARE_M;
    let keep_out = setup.scenario.obstacles.iter().map(|[north, east, radius]| KeepOut {
        centre: Vector2::new(*north, *east),
        radius_m: radius + spare_m,
    });
    Task::new(begin, wanted.collect(), keep_out.collect(), STEP_S, f64::INFINITY)
        .map_err(FlightError)
}

impl Offboard for Once {
    fn command(&mut self, tick: u64, frame: &SensorFrame) -> Option<PilotCommand> {
        self.follower.look(frame);
        let time_s = frame.time_us as f64 * 1e-6;
        if self.made.is_none() && time_s >= BEGIN_S {
            let motion = self.follower.motion()?;
            // Level flight: thrust carries the weight.
            let thrust_n =
                self.craft.hover().z / f64::from(motion.roll_rad.cos() * motion.pitch_rad.cos());
            let task =
                task(&self.drawn, &self.setup, begin(&motion, thrust_n, 0.0), time_s).ok()?;
            let plan = Planner::default().plan(&self.craft, &task, None);
            self.follower.follow(plan.track.clone(), frame.time_us);
            self.made = Some((task, plan));
        }
        self.made.as_ref()?;
        self.follower.steer(tick, frame.time_us)
    }

    /// What is measured begins with the plan.
    fn encounters(&self) -> u32 {
        u32::from(self.made.is_some())
    }

    fn reference(&self) -> Option<Reference> {
        self.follower.reference()
    }

    fn facts(&self) -> Vec<(&'static str, String)> {
        vec![("offboard", "plans once".to_owned())]
    }
}

fn fly(plan: &Plan, arm: Arm, kind: &str, ratio: f64, trial: u32) -> Result<Trial, FlightError> {
    let (drawn, scenario) = scenario(plan, kind, ratio, trial);
    let setup = plan.setup(arm, scenario);
    let mut pilot = Once::new(drawn, &setup)?;
    let flight =
        setup.fly_on(&mut InProcess::new(setup.stack()?), Some(&mut pilot), false, |_| {})?;
    let Some((task, plan)) = pilot.made else {
        return Err(FlightError("planning: the vehicle never knew where it was".to_owned()));
    };
    let off = plan
        .track
        .points()
        .iter()
        .zip(task.wanted())
        .map(|(p, w)| (p.position - w.position).norm_squared());
    let m = flight.metrics;
    Ok(Trial {
        status: plan.status.name().to_owned(),
        cost: plan.cost,
        iterations: plan.iterations,
        wanted_rmse_m: (off.sum::<f64>() / plan.track.points().len() as f64).sqrt(),
        tracking_rmse_m: m.rmse_m,
        clearance_m: m.clearance_m.map_or(0.0, |clearance| clearance - half_width_m(&setup)),
        height_lost_m: m.height_lost_m,
        wings_open_s: m.wings_open_s,
    })
}

/// The tasks of a kind at a ratio without flying there: as if the run-up had been flown exactly.
/// For who measures how long plans take.
///
/// # Errors
/// A vehicle that cannot be planned for.
pub fn tasks(
    plan: &Plan,
    arm: Arm,
    kind: &str,
    ratio: f64,
) -> Result<Vec<(Craft, Task)>, FlightError> {
    (0..plan.trials)
        .map(|trial| {
            let (drawn, scenario) = scenario(plan, kind, ratio, trial);
            let setup = plan.setup(arm, scenario);
            let craft = craft(&setup)?;
            let begin = Begin {
                position: Vector3::new(
                    drawn.speed_m_s * (BEGIN_S - RAMP_S / 3.0),
                    0.0,
                    -setup.scenario.height_m,
                ),
                velocity: Vector3::new(drawn.speed_m_s, 0.0, 0.0),
                thrust: -craft.hover(),
                spread: 0.0,
            };
            Ok((craft, task(&drawn, &setup, begin, BEGIN_S)?))
        })
        .collect()
}
