//! What a batch refuses.

/// One clear line: what, and its value.
#[derive(Debug, thiserror::Error)]
pub enum BatchError {
    /// There is nothing to simulate.
    #[error("vehicles: none given")]
    Empty,
    /// A vehicle that the batch has no place for.
    #[error("vehicles[{vehicle}]: {rotors} rotors, this batch holds {places} a vehicle")]
    Rotors {
        /// Which.
        vehicle: usize,
        /// Rotors that it has.
        rotors: usize,
        /// Rotors that the batch holds.
        places: usize,
    },
    /// An effect that acts on sensors only.
    #[error(
        "vehicles[{vehicle}]: effects.{effect}: acts on sensors or stamps only, a batch has none"
    )]
    Effect {
        /// Which.
        vehicle: usize,
        /// Name of the effect.
        effect: &'static str,
    },
    /// Wings that are a network.
    #[error("vehicles[{vehicle}]: wing.model = parnn: a batch flies none, flat and membrane")]
    Network {
        /// Which.
        vehicle: usize,
    },
    /// Two kinds of wings.
    #[error("vehicles[{vehicle}]: wing.model: flat and membrane do not fly in one batch")]
    Wings {
        /// Which.
        vehicle: usize,
    },
    /// Something that no vehicle had when the batch was made.
    #[error(
        "vehicles[{vehicle}]: {what}: the batch was made without; what there is, is decided by the first vehicles"
    )]
    NotFitted {
        /// Which.
        vehicle: usize,
        /// What it has.
        what: &'static str,
    },
    /// Effects that leave an airframe that cannot be, or one that cannot be in the batch's scalar.
    #[error("vehicles[{vehicle}]: with effects, {problem}")]
    Airframe {
        /// Which.
        vehicle: usize,
        /// `field = value: reason`.
        problem: squirrel_core::vehicle::ParameterError,
    },
    /// A charge that is none.
    #[error("charge of vehicle {vehicle}: {charge}, must be 0 to 1")]
    Charge {
        /// Which.
        vehicle: usize,
        /// The charge.
        charge: f64,
    },
    /// A step that no integrator can take.
    #[error("dt_s = {dt_s}: must be finite and > 0")]
    Step {
        /// The step, s.
        dt_s: f64,
    },
    /// A step that cannot follow the rotors of a vehicle.
    #[error(
        "vehicles[{vehicle}]: dt_s = {dt_s} must be at most twice propulsion.{key} = {time_constant_s}"
    )]
    TimeConstant {
        /// Which.
        vehicle: usize,
        /// The step, s.
        dt_s: f64,
        /// The field, as a vehicle file spells it.
        key: &'static str,
        /// Its value, s.
        time_constant_s: f64,
    },
    /// Somebody must do the work.
    #[error("threads = 0: must be at least 1")]
    NoThreads,
    /// The system gives no thread.
    #[error("cannot start a thread: {0}")]
    Thread(#[from] std::io::Error),
    /// There is no vehicle of this number.
    #[error("vehicle {vehicle}: the batch has {vehicles}")]
    NoVehicle {
        /// Which.
        vehicle: usize,
        /// Vehicles in the batch.
        vehicles: usize,
    },
    /// A number that is not finite.
    #[error("{what} of vehicle {vehicle}: not finite")]
    NotFinite {
        /// What was given.
        what: &'static str,
        /// Which.
        vehicle: usize,
    },
    /// An attitude that is none.
    #[error("attitude of vehicle {vehicle}: norm {norm}, must be 1 to within 1e-3")]
    Attitude {
        /// Which.
        vehicle: usize,
        /// Length of the quaternion.
        norm: f64,
    },
    /// Set points where nothing flies the vehicles.
    #[error("set points: the batch has no autopilot")]
    NoAutopilot,
    /// An autopilot that never acts.
    #[error("period_steps = 0: must be at least 1")]
    Period,
    /// A memory that is not of such a batch.
    #[error("state: {0}")]
    Memory(&'static str),
    /// Whoever waited for it does so no more.
    #[error("interrupted")]
    Interrupted,
    /// Too few numbers, or too many.
    #[error("{what}: {given} numbers, must be {needed}")]
    Shape {
        /// What was given.
        what: &'static str,
        /// How many numbers.
        given: usize,
        /// How many there must be.
        needed: usize,
    },
}

impl BatchError {
    /// The same of a vehicle in the place of a kind, where it is of one.
    pub(super) fn of(mut self, place: impl Fn(usize) -> usize) -> Self {
        match &mut self {
            Self::Effect { vehicle, .. }
            | Self::Network { vehicle }
            | Self::Wings { vehicle }
            | Self::Airframe { vehicle, .. } => *vehicle = place(*vehicle),
            _ => {}
        }
        self
    }
}
