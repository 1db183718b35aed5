//! Gains for a vehicle whose file has none, by the rule of `squirrel vehicle new`.

use super::super::{VehicleFile, VehicleFileError};
use super::gains::{self, Airframe};

impl VehicleFile {
    /// The same vehicle with `[control]` by rule where its file has none; the text says so.
    ///
    /// # Errors
    /// As [`Self::parse`].
    pub fn with_gains_by_rule(&self) -> Result<Self, VehicleFileError> {
        if self.control.is_some() {
            return Ok(self.clone());
        }
        let p = self.vehicle.parameters();
        let (inertia, rotor) = (&p.inertia_kg_m2, &p.propulsion);
        let arms = self.vehicle.rotors().iter().map(|r| r.position.vector.xy().norm());
        let airframe = Airframe {
            weight_n: self.vehicle.weight_n(),
            thrust_max_n: p.limits.thrust_max_n,
            lag_s: rotor.time_constant_s(),
            torque_per_thrust_m: rotor.torque_coefficient_n_m_s2 / rotor.thrust_coefficient_n_s2,
            arm_m: arms.sum::<f64>() / self.vehicle.rotors().len() as f64,
            inertia_z_kg_m2: inertia[(2, 2)],
            tilt_max_rad: p.limits.tilt_max_rad,
            restoring: [0, 1].map(|axis| inertia[(2, 2)] / inertia[(axis, axis)]),
        };
        let text = format!("{}\n{}", self.text.trim_end(), gains::toml(&airframe));
        Self::parse_with(&text, &self.name, self.weights.clone())
    }
}
