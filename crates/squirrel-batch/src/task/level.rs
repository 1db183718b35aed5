//! What the numbers of an action are. Each is limited to [-1, 1]; NaN counts as -1. The last one is
//! for both wings, from -1 folded to 1 spread.

use crate::SetPoint;
use squirrel_core::control::wiic::Envelope;
use squirrel_core::math::{limit, lower};
use squirrel_core::policy::{ACTION, Span};
use squirrel_core::vehicle::{MAX_ROTORS, PerRotor, Vehicle};

/// Largest body rates about roll, pitch and yaw, rad/s.
pub const RATE_MAX_RAD_S: [f32; 3] = [6.0, 6.0, 3.0];

/// Level of actions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// Thrust of each rotor, from none to all that it has, and wings.
    Motor,
    /// Rates of roll, pitch and yaw in [`RATE_MAX_RAD_S`], thrust in weights above hover, and
    /// wings.
    BodyRate,
    /// As [`Span::command`]: roll, pitch, thrust and wings; heading is held north; limited as the
    /// flight code limits commands. What [`squirrel_core::policy`] flies.
    AttitudeWing,
}

/// What an action commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ActionCommand {
    /// Set point or rotor commands, as many as [`Level::command_numbers`].
    pub(super) rotors: PerRotor<f32>,
    /// Both wings, 0..1.
    pub(super) wing: f32,
}

impl Level {
    /// Numbers of an action for vehicles of so many rotors.
    pub fn numbers(self, rotors: usize) -> usize {
        match self {
            Self::Motor => rotors + 1,
            Self::BodyRate => 5,
            Self::AttitudeWing => ACTION,
        }
    }

    /// Numbers of a set point or of rotor commands.
    pub(super) fn command_numbers(self, rotors: usize) -> usize {
        if self == Self::Motor { rotors } else { 4 }
    }

    /// What set points are; none where rotors are commanded.
    pub(super) fn set_point(self) -> Option<SetPoint> {
        match self {
            Self::Motor => None,
            Self::BodyRate => Some(SetPoint::BodyRate),
            Self::AttitudeWing => Some(SetPoint::Attitude),
        }
    }

    /// * `action` - [`Self::numbers`] long
    /// * `envelope` - to which the flight code limits attitude commands
    pub(super) fn command(
        self,
        action: &[f32],
        span: &Span,
        envelope: &Envelope,
        vehicle: &Vehicle<f32>,
    ) -> ActionCommand {
        let number = |i: usize| limit(action.get(i).copied().unwrap_or(f32::NAN), -1.0, 1.0);
        let mut rotors = [0.0; MAX_ROTORS];
        let mut wing = 0.5 * (1.0 + number(action.len().wrapping_sub(1)));
        match self {
            Self::Motor => {
                let most = vehicle.rotor_thrust_max_n();
                let propulsion = &vehicle.parameters().propulsion;
                for (i, command) in rotors.iter_mut().enumerate().take(vehicle.rotors().len()) {
                    *command = propulsion.command_for_thrust(0.5 * (1.0 + number(i)) * most);
                }
            }
            Self::BodyRate => {
                for (i, most) in RATE_MAX_RAD_S.into_iter().enumerate() {
                    rotors[i] = number(i) * most;
                }
                rotors[3] = lower((1.0 + number(3)) * span.weight_n, span.thrust_max_n);
            }
            Self::AttitudeWing => {
                let pilot = span.command(&[number(0), number(1), number(2), number(3)]);
                let attitude = envelope.limit(&pilot.attitude);
                (rotors[0], rotors[1], rotors[3]) =
                    (attitude.roll_rad, attitude.pitch_rad, attitude.thrust_n);
                wing = pilot.wing;
            }
        }
        ActionCommand { rotors, wing }
    }
}
