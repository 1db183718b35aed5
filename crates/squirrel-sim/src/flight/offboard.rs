//! Who commands instead of the flight code's outer loop: an offboard computer, of which the flight
//! code knows nothing but the commands.

use super::{CONTROL_RATE_HZ, FlightError, Setup};
use crate::track::{Track, TrackPoint};
use squirrel_core::control::Reference;
use squirrel_core::control::follow::{FollowGains, PlanPoint};
use squirrel_core::control::position::MeasuredMotion;
use squirrel_core::control::twcc::OuterAirframe;
use squirrel_core::frames::In;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::policy::PilotCommand;
use squirrel_core::stack::{Known, SensorFrame, Stack};

/// Commands a second of who follows a plan.
const FOLLOW_RATE_HZ: u64 = 50;

/// An offboard computer.
pub trait Offboard {
    /// Looks at the frame of a step of the flight code; what to fly from here on, where that
    /// changes in this step.
    ///
    /// * `tick` - number of the step
    fn command(&mut self, tick: u64, frame: &SensorFrame) -> Option<PilotCommand>;

    /// Obstacles that were met so far.
    fn encounters(&self) -> u32 {
        0
    }

    /// What it follows now, where that is not the flight code's mission.
    fn reference(&self) -> Option<Reference> {
        None
    }

    /// What it believes besides, for the log: vectors in NED, by names with units.
    fn believed(&self) -> Vec<(&'static str, [f64; 3])> {
        Vec::new()
    }

    /// What a log shall say of it.
    fn facts(&self) -> Vec<(&'static str, String)>;
}

/// Flies along a plan ([`FollowGains`]), fifty times a second, on what the flight code believes.
#[derive(Debug, Clone)]
pub struct Follower {
    track: Track,
    /// When the plan begins, us.
    begin_us: u64,
    gains: FollowGains,
    airframe: OuterAirframe,
    stack: Stack,
    known: Known,
    time_us: u64,
    now: Option<TrackPoint>,
}

impl Follower {
    /// Follows nothing yet.
    ///
    /// # Errors
    /// A vehicle that cannot be flown.
    pub fn new(setup: &Setup) -> Result<Self, FlightError> {
        let stack = setup.stack()?;
        let gains = FollowGains::behind(&stack.parameters().attitude);
        gains.check().map_err(|e| FlightError(e.to_string()))?;
        let vehicle = stack.vehicle();
        let tilt_max_rad = vehicle.parameters().limits.tilt_max_rad;
        let airframe =
            OuterAirframe::new(vehicle, stack.parameters().twcc.thrust_min_n, tilt_max_rad);
        Ok(Self {
            track: Track::default(),
            begin_us: 0,
            gains,
            airframe,
            stack,
            known: Known::default(),
            time_us: 0,
            now: None,
        })
    }

    /// From now on, this plan.
    pub fn follow(&mut self, track: Track, begin_us: u64) {
        (self.track, self.begin_us) = (track, begin_us);
    }

    /// What flies it.
    pub fn airframe(&self) -> &OuterAirframe {
        &self.airframe
    }

    /// Takes over what a frame brings.
    pub fn look(&mut self, frame: &SensorFrame) {
        self.known.take_over(frame);
        self.time_us = frame.time_us;
    }

    /// Motion as known from the frames so far, at the heading that the flight code takes commands
    /// to be of.
    pub fn motion(&self) -> Option<MeasuredMotion> {
        let (gnss, attitude) = (self.known.gnss?, self.known.attitude?);
        let mut position = gnss.position;
        if let Some(altitude_m) = self.known.altitude_m {
            position.vector.z = -altitude_m;
        }
        let heading_rad = self.stack.heading_rad(self.time_us, &attitude);
        Some(MeasuredMotion::new(position, gnss.velocity, &attitude, heading_rad))
    }

    /// The plan at a time of the flight.
    pub fn planned(&self, time_us: u64) -> Option<TrackPoint> {
        self.track.at(time_us.saturating_sub(self.begin_us) as f64 * 1e-6)
    }

    /// The command where one is due.
    pub fn steer(&mut self, tick: u64, time_us: u64) -> Option<PilotCommand> {
        self.now = self.planned(time_us);
        if !tick.is_multiple_of(CONTROL_RATE_HZ / FOLLOW_RATE_HZ) {
            return None;
        }
        let (motion, now) = (self.motion()?, self.now?);
        let later = |delay_s: f32| self.planned(time_us + (f64::from(delay_s) * 1e6) as u64);
        let (ahead, wing) = (later(self.gains.delay_s)?, later(self.gains.wing_delay_s)?.wing);
        let single = |v: Vector3<f64>| In::new(v.map(|x| x as f32));
        let point = PlanPoint {
            position: single(now.position),
            velocity: single(now.velocity),
            thrust: single(now.thrust),
            wing: now.wing as f32,
        };
        Some(self.gains.command(&self.airframe, &motion, &point, single(ahead.thrust), wing as f32))
    }
}

impl Offboard for Follower {
    fn command(&mut self, tick: u64, frame: &SensorFrame) -> Option<PilotCommand> {
        self.look(frame);
        self.steer(tick, frame.time_us)
    }

    fn reference(&self) -> Option<Reference> {
        self.now.map(|now| Reference {
            position: In::new(now.position.map(|x| x as f32)),
            velocity: In::new(now.velocity.map(|x| x as f32)),
            acceleration: In::new(now.acceleration.map(|x| x as f32)),
            yaw_rad: 0.0,
        })
    }

    fn facts(&self) -> Vec<(&'static str, String)> {
        vec![("offboard", "follows a plan".to_owned())]
    }
}
