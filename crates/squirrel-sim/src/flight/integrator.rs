//! What moves the body: RK4 in the open, rapier near contact; or rapier throughout.
//!
//! rapier's step is of first order, RK4's of fourth (the figures are in `world`), so free flight
//! stays with RK4 unless asked otherwise. A flight with nothing solid in it never needs the world.

use super::{FlightError, Setup};
use crate::plant::{Plant, PlantState};
use crate::setting::SettingError;
use squirrel_core::frames::{In, Ned};
use squirrel_core::vehicle::PerRotor;

/// Who integrates the rigid body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Integrator {
    /// RK4; rapier near the ground and solid obstacles.
    Rk4,
    /// rapier throughout: first order, for comparison.
    Rapier,
}

impl Integrator {
    /// Name on the command line and in logs.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rk4 => "rk4",
            Self::Rapier => "rapier",
        }
    }
    /// The integrator of a name.
    ///
    /// # Errors
    /// One line that lists the names.
    pub fn parse(name: &str) -> Result<Self, SettingError> {
        [Self::Rk4, Self::Rapier].into_iter().find(|i| i.name() == name).ok_or_else(|| {
            SettingError::Name {
                field: "integrator",
                name: name.to_owned(),
                what: "integrator",
                known: "rk4, rapier".to_owned(),
            }
        })
    }
}

/// Whether a step touched something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Contact {
    /// In the open.
    Free,
    /// Ground or obstacle.
    Touching,
}

/// Moves plants through the world of a setup.
#[cfg(feature = "rapier")]
pub(super) struct Mover {
    integrator: Integrator,
    world: crate::world::World,
}

#[cfg(feature = "rapier")]
impl Mover {
    /// * `obstacles` - all of the scenario's
    pub(super) fn new(setup: &Setup, obstacles: &[[f64; 3]]) -> Result<Self, FlightError> {
        use crate::world::{Cylinder, World, WorldParameters};
        /// Trunks reach well above any mission.
        const TRUNK_HEIGHT_M: f64 = 200.0;
        let solid = if setup.scenario.solid_obstacles { obstacles } else { &[] };
        let obstacles = solid
            .iter()
            .map(|&[north_m, east_m, radius_m]| Cylinder {
                north_m,
                east_m,
                radius_m,
                height_m: TRUNK_HEIGHT_M,
            })
            .collect();
        let parameters = WorldParameters {
            size_body_m: setup.vehicle.size_body_m,
            obstacles,
            ground: true,
            restitution: 0.2,
            friction: 0.6,
        };
        let world = World::new(&setup.vehicle.vehicle, &parameters)
            .map_err(|e| FlightError(e.to_string()))?;
        Ok(Self { integrator: setup.integrator, world })
    }

    pub(super) fn step(
        &mut self,
        plant: &Plant,
        state: &mut PlantState,
        rotor_command: &PerRotor<f64>,
        wing_command: [f64; 2],
        wind: In<Ned, f64>,
    ) -> Result<Contact, FlightError> {
        let dt_s = plant.dt_s();
        if self.integrator == Integrator::Rk4 && !self.world.is_near(&state.body, dt_s) {
            plant.step(state, rotor_command, wing_command, wind);
            return Ok(Contact::Free);
        }
        let mut touching = false;
        let world = &mut self.world;
        plant
            .step_with(state, rotor_command, wing_command, wind, |body, wrench| {
                let (next, contact) = world.step(body, wrench, dt_s)?;
                touching = contact.touching;
                Ok(next)
            })
            .map_err(|e: crate::world::WorldError| FlightError(e.to_string()))?;
        Ok(if touching { Contact::Touching } else { Contact::Free })
    }
}

/// Without rapier there is nothing to touch.
#[cfg(not(feature = "rapier"))]
pub(super) struct Mover;

#[cfg(not(feature = "rapier"))]
impl Mover {
    pub(super) fn new(setup: &Setup, _obstacles: &[[f64; 3]]) -> Result<Self, FlightError> {
        if setup.integrator == Integrator::Rapier || setup.scenario.solid_obstacles {
            return Err(FlightError(
                "this build has no world: it lacks the feature `rapier`".to_owned(),
            ));
        }
        Ok(Self)
    }

    #[allow(clippy::unnecessary_wraps, clippy::unused_self, reason = "same shape as with a world")]
    pub(super) fn step(
        &mut self,
        plant: &Plant,
        state: &mut PlantState,
        rotor_command: &PerRotor<f64>,
        wing_command: [f64; 2],
        wind: In<Ned, f64>,
    ) -> Result<Contact, FlightError> {
        plant.step(state, rotor_command, wing_command, wind);
        Ok(Contact::Free)
    }
}
