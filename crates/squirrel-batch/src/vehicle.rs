//! A vehicle with all that it may have in a batch, and what the batch must be fitted with for it.

use super::error::BatchError;
use squirrel_core::dynamics::whole::{FLAT, MEMBRANE, NONE};
use squirrel_core::effects::{Effects, Present};
use squirrel_core::vehicle::Vehicle;
use squirrel_sim::plant::{BatteryParameters, WingPlant};
use squirrel_sim::vehicle_file::VehicleFile;

/// What flies: airframe, effects, wings, battery, as [`squirrel_sim::plant::Plant::new`] takes them.
#[derive(Debug, Clone)]
pub struct BatchVehicle {
    /// The airframe without effects.
    pub vehicle: Vehicle<f64>,
    /// Effects, each vehicle with sizes of its own.
    pub effects: Effects<f64>,
    /// Wings: none, flat or membrane.
    pub wing: WingPlant,
    /// Battery; without one the voltage stays at the reference.
    pub battery: Option<BatteryParameters>,
}

impl From<&VehicleFile> for BatchVehicle {
    fn from(file: &VehicleFile) -> Self {
        Self {
            vehicle: file.vehicle,
            effects: file.effects,
            wing: file.wing.clone(),
            battery: file.battery.clone(),
        }
    }
}

/// What the blocks of a batch have a place for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Fitted {
    pub(super) wing: u8,
    /// Stretches of the longest table of voltages; 0 for no battery.
    pub(super) stretches: usize,
    pub(super) present: Present,
}

impl Fitted {
    /// What every member needs.
    ///
    /// # Errors
    /// Something that does not act in a batch, or flat wings beside membranes.
    pub(super) fn all(members: &[BatchVehicle]) -> Result<Self, BatchError> {
        let mut fitted = Self { wing: NONE, stretches: 0, present: Present::default() };
        for (vehicle, member) in members.iter().enumerate() {
            let needs = Self::one(member, vehicle)?;
            if fitted.wing != NONE && needs.wing != NONE && fitted.wing != needs.wing {
                return Err(BatchError::Wings { vehicle });
            }
            fitted.wing = fitted.wing.max(needs.wing);
            fitted.stretches = fitted.stretches.max(needs.stretches);
            fitted.present = fitted.present.or(needs.present);
        }
        Ok(fitted)
    }

    /// What one member needs.
    pub(super) fn one(member: &BatchVehicle, vehicle: usize) -> Result<Self, BatchError> {
        let wing = match member.wing {
            WingPlant::None => NONE,
            WingPlant::Flat { .. } => FLAT,
            WingPlant::Membrane { .. } => MEMBRANE,
            WingPlant::Parnn { .. } => return Err(BatchError::Network { vehicle }),
        };
        let stretches =
            member.battery.as_ref().map_or(0, |b| b.ocv_v_of_charge.len().saturating_sub(1));
        let present = Present::on(&member.vehicle, &member.effects);
        if let Some(effect) = present.of_sensors() {
            return Err(BatchError::Effect { vehicle, effect });
        }
        Ok(Self { wing, stretches, present: present.in_flight() })
    }

    /// Whether the base model is all.
    pub(super) fn is_plain(&self) -> bool {
        *self == Self { wing: NONE, stretches: 0, present: Present::default() }
    }

    /// The effects of another member, if it fits.
    ///
    /// # Errors
    /// What there is no place for.
    pub(super) fn fits(
        &self,
        member: &BatchVehicle,
        vehicle: usize,
    ) -> Result<Present, BatchError> {
        let needs = Self::one(member, vehicle)?;
        let what = if needs.wing != NONE && needs.wing != self.wing {
            Some("wing")
        } else if needs.stretches > self.stretches {
            Some("battery")
        } else {
            needs.present.beyond(self.present)
        };
        what.map_or(Ok(needs.present), |what| Err(BatchError::NotFitted { vehicle, what }))
    }
}
