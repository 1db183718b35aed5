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
    /// A step that no integrator can take.
    #[error("dt_s = {dt_s}: must be finite and > 0")]
    Step {
        /// The step, s.
        dt_s: f64,
    },
    /// A step that cannot follow the rotors of a vehicle.
    #[error("vehicles[{vehicle}]: dt_s = {dt_s} must be at most twice propulsion.{key} = {time_constant_s}")]
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
