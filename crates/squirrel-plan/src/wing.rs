//! What a plan may believe about spread wings: the steady force at a velocity and an attitude.
//!
//! Planning looks seconds ahead, where camber and flow have settled, so the memory of the membrane
//! and of the network is taken at its end: the force that stays when the air stays. It depends on
//! the velocity through the air and on the wings' normal alone, and is the physics of the rooms
//! below, called at rest: [`flat_plate`], [`Membrane`], [`Parnn`].

use nalgebra::Vector3;
use squirrel_core::aero::{Air, flat_plate};
use squirrel_core::dynamics::VectorSpace;
use squirrel_core::frames::{Body, In, Ned};
use squirrel_core::rnn::parnn::{Parnn, WINDOW, features};
use squirrel_sim::plant::{Membrane, MembraneState, WingPlant};
use squirrel_sim::setting::SettingError;
use squirrel_sim::vehicle_file::VehicleFile;

/// Longest step in which the membrane is led to its steady state, s.
const SETTLING_STEP_S: f64 = 0.04;
/// The same in chords of the air's way: the flow attaches within four, and faster than that a step
/// is longer than what it follows.
const SETTLING_STEP_CHORDS: f64 = 1.6;
/// Bound on such steps: creep, the slowest, is over by then.
const SETTLING_STEPS: u32 = 2000;
/// Cambers and attachment that move less than this in a step have settled.
const SETTLED: f64 = 1e-10;

/// A model of the spread wings.
#[derive(Debug, Clone, PartialEq)]
pub enum WingForce {
    /// The paper's flat plate, for which the set is exact: `f = -rho A |v| (n . v) n`.
    Flat {
        /// Area of both sides, times half of the slope where that is not the paper's 2, m^2.
        area_m2: f64,
    },
    /// The simulator's membrane, settled.
    Membrane(Box<Membrane>),
    /// The paper's network on a window of equal rows.
    Parnn(Box<Parnn>),
}

/// Which model is believed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WingModel {
    /// [`WingForce::Flat`].
    Flat,
    /// [`WingForce::Membrane`].
    Membrane,
    /// [`WingForce::Parnn`].
    Parnn,
}

impl WingModel {
    /// All models.
    pub const ALL: [Self; 3] = [Self::Flat, Self::Membrane, Self::Parnn];

    /// Name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Membrane => "membrane",
            Self::Parnn => "parnn",
        }
    }

    /// The model of a name.
    ///
    /// # Errors
    /// One line that lists the names.
    pub fn parse(name: &str) -> Result<Self, SettingError> {
        Self::ALL.into_iter().find(|model| model.name() == name).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            SettingError::Name { field: "wing", name: name.to_owned(), what: "model", known }
        })
    }
}

/// What a model of the wing force needs of a vehicle file and does not find; with the file's name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum WingError {
    /// No wings.
    #[error("{0}: [wing] is missing; without wings there is nothing to compare")]
    NoWing(String),
    /// Wings of another model.
    #[error("{0}: wing.model: is not a membrane")]
    NoMembrane(String),
    /// No network.
    #[error("{0}: wing.parnn_weights: names none that were read")]
    NoWeights(String),
}

impl From<WingError> for String {
    fn from(error: WingError) -> Self {
        error.to_string()
    }
}

impl WingForce {
    /// The model of a vehicle's wings.
    ///
    /// # Errors
    /// One line that names what of the vehicle file the model needs and does not find.
    pub fn of(vehicle: &VehicleFile, model: WingModel) -> Result<Self, WingError> {
        let name = || vehicle.name.clone();
        if vehicle.vehicle.parameters().wing.is_none() {
            return Err(WingError::NoWing(name()));
        }
        match (model, &vehicle.wing, &vehicle.weights) {
            (WingModel::Flat, _, _) => Ok(Self::Flat { area_m2: vehicle.vehicle.plate_area_m2() }),
            (WingModel::Membrane, WingPlant::Membrane { membrane, .. }, _) => {
                Ok(Self::Membrane(membrane.clone()))
            }
            (WingModel::Membrane, _, _) => Err(WingError::NoMembrane(name())),
            (WingModel::Parnn, _, Some(weights)) => Ok(Self::Parnn(Box::new(*weights.parnn()))),
            (WingModel::Parnn, _, None) => Err(WingError::NoWeights(name())),
        }
    }

    /// Steady force of the air on the spread wings, N.
    ///
    /// * `velocity` - relative to the air, m/s
    /// * `normal` - unit vector along body z (down)
    pub fn force(&self, velocity: In<Ned, f64>, normal: In<Ned, f64>) -> In<Ned, f64> {
        if let Self::Flat { area_m2 } = self {
            return flat_plate::force(velocity, normal, *area_m2);
        }
        // In a frame with z along the normal and x along the motion in the wings' plane.
        let (v, n) = (velocity.vector, normal.vector);
        let through = v.dot(&n);
        let slip = v - n * through;
        let slip_speed = slip.norm();
        let in_plane = Vector3::new(slip_speed, 0.0, through);
        let force = match self {
            Self::Flat { .. } => return In::zero(),
            Self::Membrane(membrane) => settled(membrane, &Air::new(In::new(in_plane), In::zero())),
            Self::Parnn(parnn) => {
                let velocity = In::<Body, f32>::new(in_plane.map(|x| x as f32));
                parnn.estimate(&[features(velocity); WINDOW], velocity).force.vector.map(f64::from)
            }
        };
        let along = if slip_speed > 1e-9 { slip / slip_speed } else { Vector3::zeros() };
        In::new(along * force.x + n * force.z)
    }
}

/// Force of a membrane in air that does not change.
fn settled(membrane: &Membrane, air: &Air<f64>) -> Vector3<f64> {
    let mut state = MembraneState::at_rest();
    let mut force = Vector3::zeros();
    let chords_s = membrane.parameters().chord_m / air.speed.max(1e-9);
    let step_s = SETTLING_STEP_S.min(SETTLING_STEP_CHORDS * chords_s);
    for _ in 0..SETTLING_STEPS {
        let (wrench, rates) = membrane.evaluate(air, [0.0; 2], [1.0; 2], &state);
        force = wrench.force.vector;
        let next = state.plus_scaled(step_s, &rates);
        let moved = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() > SETTLED;
        if !moved(next.fast_camber, state.fast_camber)
            && !moved(next.creep_camber, state.creep_camber)
            && !moved(next.attached, state.attached)
        {
            break;
        }
        state = next;
    }
    force
}

#[cfg(test)]
mod tests {
    use super::*;

    fn squirrel(model: WingModel) -> WingForce {
        WingForce::of(&VehicleFile::squirrel(), model).unwrap()
    }

    /// Whatever is believed: braking with the nose up, nothing at rest, and the same force in any
    /// heading.
    #[test]
    fn every_model_brakes_and_turns_with_the_vehicle() {
        for model in WingModel::ALL {
            let wing = squirrel(model);
            let ahead = In::new(Vector3::new(7.0, 0.0, 0.0));
            let nose_up = In::new(Vector3::new(0.5, 0.0, 0.75_f64.sqrt()));
            let force = wing.force(ahead, nose_up).vector;
            assert!(force.x < -0.4 && force.z < -0.6 && force.y.abs() < 1e-9, "{model:?}: {force}");
            assert_eq!(wing.force(In::zero(), nose_up).vector.norm(), 0.0, "{model:?}");
            let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), 1.1);
            let turned =
                wing.force(In::new(turn * ahead.vector), In::new(turn * nose_up.vector)).vector;
            assert!((turned - turn * force).norm() < 1e-6, "{model:?}: {turned} for {force}");
        }
    }

    /// The membrane's steady force is where the plant's own wing ends up.
    #[test]
    fn the_membrane_has_settled() {
        let WingForce::Membrane(membrane) = squirrel(WingModel::Membrane) else { unreachable!() };
        for (pitch_rad, speed) in [0.05, 0.3, 0.6, 1.2]
            .iter()
            .flat_map(|pitch| [2.0, 7.0, 20.0, 50.0, 100.0].map(|v| (*pitch, v)))
        {
            let (s, c) = f64::sin_cos(pitch_rad);
            let air = Air::new(In::new(Vector3::new(speed * c, 0.0, speed * s)), In::zero());
            let mut state = MembraneState::at_rest();
            for _ in 0..20_000 {
                let (_, rates) = membrane.evaluate(&air, [0.0; 2], [1.0; 2], &state);
                state = state.plus_scaled(1e-3, &rates);
            }
            let plant = membrane.evaluate(&air, [0.0; 2], [1.0; 2], &state).0.force.vector;
            let off = (settled(&membrane, &air) - plant).norm();
            // Faster than anything here flies, a step of the plant's own size is not small either.
            let near = if speed > 20.0 { 1e-3 } else { 1e-6 };
            assert!(
                off < near * (1.0 + plant.norm()),
                "{pitch_rad} at {speed}: {off} of {}",
                plant.norm()
            );
        }
    }

    #[test]
    fn what_is_missing_is_named() {
        let text = squirrel_sim::vehicle_file::SQUIRREL_TOML;
        let start = text.find("[wing]").unwrap();
        let end = text.find("[battery]").unwrap();
        let bare = VehicleFile::parse(&format!("{}{}", &text[..start], &text[end..]), "bare.toml")
            .unwrap();
        assert!(WingForce::of(&bare, WingModel::Flat).unwrap_err().to_string().contains("[wing]"));
        assert!(WingModel::parse("paper").unwrap_err().to_string().contains("membrane"));
    }
}
