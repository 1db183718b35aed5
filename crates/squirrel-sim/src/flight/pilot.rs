//! A learned policy in the loop: it sees what the flight code sees, and its answers come back as
//! commands from outside.
//!
//! The policy is asked 50 times a second, on the last valid measurements. It follows the mission as
//! if no obstacle were met, and knows what its lookout knows: avoiding is its own business. The
//! flight code treats it as any offboard computer.

use super::{CONTROL_RATE_HZ, FlightError, Offboard, Setup};
use crate::weights::PolicyWeights;
use squirrel_core::guidance::mission::{Mission, MissionState};
use squirrel_core::guidance::sensing::Sensing;
use squirrel_core::policy::{Lookout, PilotCommand, RATE_HZ, Sight, Span, observe};
use squirrel_core::stack::{Known, SensorFrame, Stack};

/// Steps of the flight code from one question to the next.
const STEPS: u64 = CONTROL_RATE_HZ / RATE_HZ;
/// What is seen where the mission says nothing of it: the range of the paper's simulated study.
const SENSING: Sensing = Sensing { range_m: 5.0, half_view_rad: 0.261_799_4, speed_min_m_s: 1.0 };

/// A policy that flies one flight of a setup.
#[derive(Debug, Clone, PartialEq)]
pub struct Pilot {
    weights: PolicyWeights,
    span: Span,
    mission: Mission,
    lookout: Lookout,
    known: Known,
    wing: f32,
    encounters: u32,
}

impl Pilot {
    /// Before take-off.
    ///
    /// # Errors
    /// The mission of the setup cannot be flown.
    pub fn new(weights: PolicyWeights, setup: &Setup, stack: &Stack) -> Result<Self, FlightError> {
        let mission = setup.scenario.mission().map_err(|e| FlightError(e.to_string()))?;
        let sensing = match mission {
            Mission::Avoid { sensing, .. } => sensing,
            _ => SENSING,
        };
        Ok(Self {
            weights,
            span: Span::of(stack.vehicle()),
            mission,
            lookout: Lookout::new(sensing),
            known: Known::default(),
            wing: 0.0,
            encounters: 0,
        })
    }

    /// The policy.
    pub fn weights(&self) -> &PolicyWeights {
        &self.weights
    }
}

impl Offboard for Pilot {
    fn encounters(&self) -> u32 {
        self.encounters
    }

    fn facts(&self) -> Vec<(&'static str, String)> {
        vec![("policy", self.weights.name.clone()), ("policy_hash", self.weights.hash())]
    }

    fn command(&mut self, tick: u64, frame: &SensorFrame) -> Option<PilotCommand> {
        self.known.take_over(frame);
        let (Some(imu), Some(ned_from_body), Some(gnss)) =
            (self.known.imu, self.known.attitude, self.known.gnss)
        else {
            return None;
        };
        if !tick.is_multiple_of(STEPS) {
            return None;
        }
        let mut position = gnss.position;
        if let Some(altitude_m) = self.known.altitude_m {
            position.vector.z = -altitude_m;
        }
        let before = self.lookout.known.map(|o| o.id);
        let obstacle = self.lookout.look(position, gnss.velocity, frame.obstacles());
        let now = self.lookout.known.map(|o| o.id);
        self.encounters += u32::from(now.is_some() && now != before);
        let sight = Sight {
            position,
            velocity: gnss.velocity,
            ned_from_body,
            omega: imu.omega,
            obstacle,
            wing: self.wing,
        };
        let reference = self.mission.reference(&MissionState::default(), frame.time_us);
        let action = self.weights.policy.evaluate(&observe(&sight, &reference));
        let command = self.span.command(&action);
        self.wing = command.wing;
        Some(command)
    }
}
