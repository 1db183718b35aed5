//! What an effect is known by in flights: how it is spoken of, what shows it, and what makes the
//! same.
//!
//! Each constant of [`Effect`] that is of one of these types has a default that suits most effects.
//! The gap workflow reads them through [`Effects::profile`](super::Effects::profile) and knows no
//! effect by its name.

use super::Effect;
use crate::math::Real;

/// How an effect is spoken of. `@` stands for a rotor, an axis or a side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Words {
    /// What it is: `drag that grows with speed`.
    pub what: &'static str,
    /// What is said where its number is above that of the vehicle file.
    pub more: &'static str,
    /// What is said where it is below.
    pub less: &'static str,
    /// The manoeuvre that shows it and tells it from those it is confused with.
    pub fly: &'static str,
}

/// What shows how spread wings push.
pub(super) const WINGS_AT_SPEED: &str =
    "opening and closing the wings six times or more at 5 m/s and faster, in dashes and in braking";

/// What an effect is known by; several at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shown(u8);

impl Shown {
    /// Nothing in particular.
    pub const NOTHING: Self = Self(0);
    /// Its moments: without them nothing is said of it.
    pub const MOMENTS: Self = Self(1);
    /// What lasts of forces and moments.
    pub const LASTING: Self = Self(1 << 1);
    /// What lies between commands and the speeds of rotors.
    pub const COMMANDS: Self = Self(1 << 2);
    /// An accelerometer, or velocities against one.
    pub const ACCELEROMETER: Self = Self(1 << 3);
    /// A gyroscope beside an attitude.
    pub const TURNS: Self = Self(1 << 4);
    /// Horizontal forces.
    pub const HORIZONTAL: Self = Self(1 << 5);
    /// A height over ground.
    pub const HEIGHT: Self = Self(1 << 6);

    /// Both.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
    /// Whether all of `other` is in it.
    pub const fn has(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

/// How what an effect does grows with its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Response {
    /// In proportion, near enough that one slope at the vehicle file finds it.
    Linear,
    /// With another slope after a few tolerances: lags and delays.
    Bends,
    /// As [`Self::Bends`], from the time on that the parameter `at` says. The gap workflow looks
    /// for that time first.
    Jumps {
        /// Key of the parameter, s.
        at: &'static str,
    },
    /// With no slope at zero: no linear fit near zero sees it.
    StartsFlat,
    /// In proportion at one length of a pendulum. The gap workflow looks for the length first, at
    /// lines of the spectrum.
    Swings {
        /// Key of the length, m.
        length: &'static str,
    },
    /// At random: no model predicts it, and its size is that of what every model leaves.
    Random,
}

/// Which fits may move the numbers of an effect without naming it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fitted {
    /// All: the numbers belong to the vehicle and last.
    Always,
    /// Not that to flights in which a machine flew well: the numbers are of the day, are known
    /// better, or are there or not.
    ExceptToBaselines,
    /// None: they belong to a sensor, a clock or the air, or have no slope at zero.
    Never,
}

/// What is no effect and makes the same as one in flights, so that the effect has to stand beside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mimic {
    /// Nothing in particular.
    Nothing,
    /// Gusts, averaged over a flight: for effects of moving air.
    Gusts,
    /// Drag that acts beside the centre of mass.
    DragElsewhere,
}

/// A ratio that flights show, where they do not show its two sides: of two effects on it one is
/// named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ratio {
    /// Thrust over mass.
    ThrustOverMass,
    /// Reaction torque of the rotors over the inertia about z.
    TorqueOverInertia,
}

/// That an effect changes one side of a ratio.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SideOf {
    /// Of which ratio.
    pub ratio: Ratio,
    /// Of an effect with a choice, as of an axis, the one choice that does: its index.
    pub choice: Option<usize>,
}

/// What time an effect is about. A log tells no time better than to a part of its sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Timing {
    /// By how much something is late.
    Latency,
    /// How fast the clock of commands runs.
    ClockRate,
    /// When the clock of commands jumps.
    ClockJump,
}

/// How far a parameter may be off without being worth a name, one standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tolerance {
    /// A part of its smallest size: the vehicle file has no number for it.
    PartOfSmallest,
    /// Nothing: it is there or it is not.
    Nothing,
    /// So much, in the unit of the parameter, on any vehicle.
    Usual(f64),
    /// What the vehicle file declares of one of its own numbers.
    Declared(Declared),
    /// An angle against the rotors' axes: as [`Self::PartOfSmallest`] beside an accelerometer,
    /// which shows these; else as well as markers are stuck on.
    RotorAxes,
}

/// A number of a vehicle file, with its standard deviation there, that a parameter changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Declared {
    /// Mass; the parameter is a fraction of it.
    Mass,
    /// Inertia about the axis that the effect chooses; a fraction.
    Inertia,
    /// Thrust coefficient of the rotors; a fraction.
    Thrust,
    /// Torque coefficient of the rotors; a fraction.
    Torque,
    /// Slope of the wings' normal force; a fraction.
    WingForce,
    /// Linear drag along a body axis; the parameter adds to it.
    LinearDrag(usize),
    /// Drag area; added to.
    DragArea,
    /// Inflow of the rotors in climbs; added to.
    AxialInflow,
    /// Lift of the rotors in forward flight; added to.
    TranslationalLift,
    /// Moment of blade flapping; added to.
    FlappingMoment,
    /// Part of the thrust that is lost in the own wake; added to.
    VortexRing,
    /// Time constant of the rotors; added to.
    RotorLag,
    /// Time constant of the wings; added to.
    WingLag,
    /// Places of the rotors, whose middle the parameter is beside, along the axis of its place
    /// among the parameters.
    RotorPlaces,
    /// Bias of the accelerometer, along the axis of the parameter's place.
    AccelBias,
    /// Bias of the heading.
    HeadingBias,
    /// Scale of the gyroscope.
    GyroScale,
    /// Scale of the accelerometer.
    AccelScale,
}

impl Declared {
    /// Whether it is a time constant.
    pub const fn is_lag(self) -> bool {
        matches!(self, Self::RotorLag | Self::WingLag)
    }
}

/// All of this that stands in the file of one effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(clippy::struct_excessive_bools, reason = "each is an answer about an effect of its own")]
pub struct Profile {
    /// See [`Effect::WORDS`].
    pub words: Words,
    /// See [`Effect::SHOWN`].
    pub shown: Shown,
    /// See [`Effect::RESPONSE`].
    pub response: Response,
    /// See [`Effect::FITTED`].
    pub fitted: Fitted,
    /// See [`Effect::MIMIC`].
    pub mimic: Mimic,
    /// See [`Effect::SIDE_OF`].
    pub side_of: Option<SideOf>,
    /// See [`Effect::TIMING`].
    pub timing: Option<Timing>,
    /// See [`Effect::IS_OF_MOMENTS`].
    pub is_of_moments: bool,
    /// See [`Effect::IS_OF_WINGS`].
    pub is_of_wings: bool,
    /// See [`Effect::IS_OF_A_STATE`].
    pub is_of_a_state: bool,
    /// See [`Effect::FEELS_HEIGHT`].
    pub feels_height: bool,
}

impl Profile {
    /// Of one effect.
    pub(super) const fn of<T: Real, E: Effect<T>>() -> Self {
        Self {
            words: E::WORDS,
            shown: E::SHOWN,
            response: E::RESPONSE,
            fitted: E::FITTED,
            mimic: E::MIMIC,
            side_of: E::SIDE_OF,
            timing: E::TIMING,
            is_of_moments: E::IS_OF_MOMENTS,
            is_of_wings: E::IS_OF_WINGS,
            is_of_a_state: E::IS_OF_A_STATE,
            feels_height: E::FEELS_HEIGHT,
        }
    }
    /// Whether its slope is another one after a few tolerances.
    pub const fn bends(&self) -> bool {
        matches!(self.response, Response::Bends | Response::Jumps { .. })
    }
    /// Whether nothing linear in all of its numbers holds near zero.
    pub const fn starts_flat(&self) -> bool {
        matches!(self.response, Response::StartsFlat | Response::Swings { .. })
    }
}
