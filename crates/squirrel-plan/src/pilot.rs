//! The planner in the loop: ten times a second a new plan from what is believed, followed in
//! between.
//!
//! It is told what the other controllers are told: the mission's reference, which turns away where
//! an obstacle comes into view, and of obstacles those that came into view so far. It looks
//! [`HORIZON_S`] ahead. The time that planning takes is not simulated: a plan acts in the step in
//! which it is asked for. What the air does, and what its model lacks, it takes from how the
//! vehicle moves ([`AirEstimate`]). The arms are [`Arm::PlanWings`] and, with the wings folded,
//! [`Arm::PlanNoWings`].

use crate::air::AirEstimate;
use crate::trajectory::{Begin, Craft, KeepOut, Planner, Task, Wanted};
use crate::wing::WingModel;
use nalgebra::{Vector2, Vector3};
use squirrel_core::control::Reference;
use squirrel_core::control::position::MeasuredMotion;
use squirrel_core::frames::{Body, In, Ned, Rotation};
use squirrel_core::guidance::mission::{Mission, MissionState};
use squirrel_core::guidance::sensing::{Obstacle, Sensing};
use squirrel_core::policy::PilotCommand;
use squirrel_core::stack::{SensorFrame, Stack};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{
    CONTROL_RATE_HZ, Flight, FlightError, Follower, InProcess, Offboard, Pilot, Setup,
};
use squirrel_sim::track::Track;
use squirrel_sim::weights::PolicyWeights;

/// How far a plan looks ahead, s.
pub const HORIZON_S: f64 = 2.0;
/// From node to node, s; plans are made as often.
pub const STEP_S: f64 = 0.1;
/// From estimate to estimate of the air, s; a whole part of [`STEP_S`].
const FEEL_S: f64 = 0.02;
/// What is kept to spare between vehicle and obstacle, m.
pub const SPARE_M: f64 = 0.3;
/// Convex problems a plan, with folded wings and again where they may spread: the next plan goes on
/// from this one.
const ITERATIONS: u32 = 4;
/// Obstacles further behind than this are forgotten, m.
const FORGET_M: f64 = 30.0;

/// Plans and follows.
#[derive(Debug, Clone)]
pub struct Replanner {
    planner: Planner,
    air: AirEstimate,
    /// The velocity at the last estimate of the air, and when that was, us.
    felt: Option<(In<Ned, f32>, u64)>,
    follower: Follower,
    mission: Mission,
    state: MissionState,
    sensing: Option<Sensing>,
    speed_max_m_s: f64,
    keep_out_m: f64,
    seen: Vec<Obstacle>,
    last: Option<(Track, u64)>,
    thrust_n: f64,
    reference: Option<Reference>,
}

impl Replanner {
    /// For one flight of a setup; its arm says whether there are wings.
    ///
    /// * `wing` - what is believed of the wings where the arm has them
    ///
    /// # Errors
    /// A vehicle or mission that cannot be planned for.
    pub fn new(setup: &Setup, wing: WingModel) -> Result<Self, FlightError> {
        let mission = setup.scenario.mission().map_err(|e| FlightError(e.to_string()))?;
        let sensing = match &mission {
            Mission::Avoid { sensing, .. } => Some(*sensing),
            Mission::Excite(_) => {
                let name = &setup.scenario.name;
                return Err(FlightError(format!(
                    "scenario = {name}: is flown for its own manoeuvres, there is nothing to plan"
                )));
            }
            _ => None,
        };
        let thrust_max_n = setup.thrust_to_weight() * setup.vehicle.vehicle.weight_n();
        let wing = (setup.arm == Arm::PlanWings).then_some(wing);
        let craft = Craft::of(&setup.vehicle, thrust_max_n, wing, 0.0).map_err(FlightError)?;
        let obstacles = setup.scenario.all_obstacles();
        let largest_m = obstacles.iter().map(|[_, _, radius]| *radius).fold(0.0, f64::max);
        Ok(Self {
            planner: Planner { iterations_max: ITERATIONS, ..Planner::default() },
            thrust_n: craft.hover().z,
            air: AirEstimate::new(craft),
            felt: None,
            follower: Follower::new(setup)?,
            mission,
            state: MissionState::default(),
            sensing,
            speed_max_m_s: setup.scenario.speed_max_m_s.unwrap_or(f64::INFINITY),
            keep_out_m: largest_m + half_width_m(setup) + SPARE_M,
            seen: Vec::new(),
            last: None,
            reference: None,
        })
    }

    fn plan(&mut self, motion: &MeasuredMotion, frame: &SensorFrame) {
        let time_us = frame.time_us;
        self.mission.sense(
            &mut self.state,
            time_us,
            motion.position,
            motion.velocity,
            frame.obstacles(),
        );
        self.look(motion, frame.obstacles());
        let wide = |v: &Vector3<f32>| v.cast::<f64>();
        let wanted = |k: usize| {
            let later_us = time_us + (k as f64 * STEP_S * 1e6) as u64;
            let at = self.mission.reference(&self.state, later_us);
            Wanted { position: wide(&at.position.vector), velocity: wide(&at.velocity.vector) }
        };
        let steps = (HORIZON_S / STEP_S).round() as usize;
        let keep = |o: &Obstacle| KeepOut {
            centre: Vector2::new(f64::from(o.north_m), f64::from(o.east_m)),
            radius_m: self.keep_out_m,
        };
        let task = Task::new(
            begin(motion, self.thrust_n, self.spread(time_us)),
            (0..=steps).map(wanted).collect(),
            self.seen.iter().map(keep).collect(),
            STEP_S,
            self.speed_max_m_s,
        );
        // What is believed can be nonsense where sensors fail: then the last plan is flown to its
        // end.
        let Ok(task) = task else { return };
        let warm =
            self.last.as_ref().map(|(track, begin_us)| (track, (time_us - begin_us) as f64 * 1e-6));
        let plan = self.planner.plan(self.air.craft(), &task, warm);
        self.follower.follow(plan.track.clone(), time_us);
        self.last = Some((plan.track, time_us));
    }

    /// Deployment of the wings, as planned.
    fn spread(&self, time_us: u64) -> f64 {
        self.follower.planned(time_us).map_or(0.0, |point| point.wing)
    }

    /// What the last moments say about the air.
    fn feel(&mut self, motion: &MeasuredMotion, time_us: u64) {
        let (before, before_us) = self.felt.unwrap_or((motion.velocity, time_us));
        let now = begin(motion, self.thrust_n, self.spread(time_us));
        self.air.predict(&-now.thrust, now.spread, time_us.saturating_sub(before_us) as f64 * 1e-6);
        // A velocity that stays the same to the bit is the last one still.
        if self.felt.is_none() || motion.velocity != before {
            self.air.measure(&now.velocity);
        }
        self.felt = Some((motion.velocity, time_us));
    }

    /// Remembers obstacles that are in range and in view, as the mission's own sensing does.
    fn look(&mut self, motion: &MeasuredMotion, obstacles: &[Obstacle]) {
        let Some(sensing) = &self.sensing else { return };
        let far = |o: &Obstacle| {
            let (north, east) =
                (o.north_m - motion.position.vector.x, o.east_m - motion.position.vector.y);
            f64::from(north.hypot(east)) > FORGET_M
        };
        self.seen.retain(|o| !far(o));
        // Known ones move with what is believed of the own place.
        for seen in &mut self.seen {
            if let Some(now) = obstacles.iter().find(|o| o.id == seen.id) {
                *seen = *now;
            }
        }
        loop {
            let known = |id: u32| self.seen.iter().any(|o| o.id == id);
            let next = sensing.nearest(motion.position, motion.velocity, obstacles, known);
            let Some(new) = next else { return };
            self.seen.push(new);
        }
    }
}

/// Where a plan begins that begins now.
///
/// * `thrust_n` - asked for last
/// * `spread` - deployment of the wings
pub fn begin(motion: &MeasuredMotion, thrust_n: f64, spread: f64) -> Begin {
    let attitude = Rotation::<Ned, Body, f32>::from_euler(
        motion.roll_rad,
        motion.pitch_rad,
        motion.heading_rad,
    );
    let down = attitude * In::new(Vector3::z());
    Begin {
        position: motion.position.vector.cast(),
        velocity: motion.velocity.vector.cast(),
        thrust: down.vector.cast::<f64>() * -thrust_n,
        spread,
    }
}

/// Half of the vehicle's larger horizontal size, m.
pub fn half_width_m(setup: &Setup) -> f64 {
    let [length, width, _] = setup.vehicle.size_body_m;
    0.5 * length.max(width)
}

impl Offboard for Replanner {
    fn command(&mut self, tick: u64, frame: &SensorFrame) -> Option<PilotCommand> {
        self.follower.look(frame);
        let every =
            |step_s: f64| tick.is_multiple_of((CONTROL_RATE_HZ as f64 * step_s).round() as u64);
        if every(FEEL_S)
            && let Some(motion) = self.follower.motion()
        {
            self.feel(&motion, frame.time_us);
            if every(STEP_S) {
                self.plan(&motion, frame);
            }
        }
        self.reference = Some(self.mission.reference(&self.state, frame.time_us));
        let command = self.follower.steer(tick, frame.time_us);
        if let Some(command) = &command {
            self.thrust_n = f64::from(command.attitude.thrust_n);
        }
        command
    }

    fn encounters(&self) -> u32 {
        self.state.encounters
    }

    fn reference(&self) -> Option<Reference> {
        self.reference
    }

    fn believed(&self) -> Vec<(&'static str, [f64; 3])> {
        let air = &self.air.craft().air;
        vec![("wind_ned_m_s", air.wind.into()), ("offset_ned_m_s2", air.offset.into())]
    }

    fn facts(&self) -> Vec<(&'static str, String)> {
        vec![("offboard", format!("plans {HORIZON_S} s ahead every {STEP_S} s"))]
    }
}

/// Who commands a setup from outside of the flight code, if anybody: a policy, or the planner of
/// its arm.
///
/// # Errors
/// A mission that cannot be flown so.
pub fn offboard(
    setup: &Setup,
    stack: &Stack,
    policy: Option<PolicyWeights>,
) -> Result<Option<Box<dyn Offboard + Send>>, FlightError> {
    Ok(match policy {
        Some(weights) => Some(Box::new(Pilot::new(weights, setup, stack)?)),
        None if setup.arm.plans() => Some(Box::new(Replanner::new(setup, WingModel::Flat)?)),
        None => None,
    })
}

/// Flies a setup, with a [`Replanner`] that believes in the flat plate where its arm plans.
///
/// # Errors
/// As [`Setup::fly`], and what cannot be planned for.
pub fn fly(setup: &Setup, record: bool, progress: impl FnMut(f64)) -> Result<Flight, FlightError> {
    if !setup.arm.plans() {
        return setup.fly(record, progress);
    }
    let mut pilot = Replanner::new(setup, WingModel::Flat)?;
    setup.fly_on(&mut InProcess::new(setup.stack()?), Some(&mut pilot), record, progress)
}
