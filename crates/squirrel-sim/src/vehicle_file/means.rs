//! What the numbers of a vehicle file mean together: throttle of hover, forces at 7 m/s, authority.
//!
//! Forces are the plant's own, with the effects of the file, in still air.

use super::VehicleFile;
use super::hovering::hovering_body;
use crate::plant::{MembraneState, Plant, PlantState, WingPlant};
use serde::Serialize;
use squirrel_core::aero::{Air, induced};
use squirrel_core::dynamics::{State, VectorSpace};
use squirrel_core::frames::{In, Wrench};
use squirrel_core::nalgebra::Vector3;

/// Airspeed at which forces are told, m/s: that of the paper's flights.
const SPEED_M_S: f64 = 7.0;
/// Angle of attack at which wings are told: the paper's limit of tilt, rad.
const ANGLE_RAD: f64 = std::f64::consts::FRAC_PI_6;
/// Step and steps in which a membrane fills.
const FILL: (f64, usize) = (1e-3, 3000);

/// See the module.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Means {
    /// Command of one rotor in hover, in the vehicle's unit.
    pub hover_command: f64,
    /// Most thrust of all rotors over the weight.
    pub thrust_to_weight: f64,
    /// Induced speed of the rotors in hover.
    pub hover_induced_speed_m_s: f64,
    /// Drag in level flight at 7 m/s, wings folded.
    pub drag_at_7_m_s_n: f64,
    /// What spread wings take from thrust in hover; `None` without wings.
    pub wing_download_in_hover_n: Option<f64>,
    /// Force of filled, spread wings along -z at 7 m/s and 30 deg, the rotors standing; `None`
    /// without wings.
    pub wing_force_at_30_deg_n: Option<f64>,
    /// Most roll moment about hover that leaves the sum of thrusts.
    pub roll_authority_n_m: f64,
    /// Most pitch moment, likewise.
    pub pitch_authority_n_m: f64,
    /// Most yaw moment, likewise.
    pub yaw_authority_n_m: f64,
}

impl VehicleFile {
    /// What its numbers mean.
    ///
    /// # Errors
    /// One line where the plant refuses them.
    pub fn means(&self) -> Result<Means, String> {
        let vehicle = self.vehicle;
        let plant =
            Plant::new(vehicle, self.effects, self.wing.clone(), self.battery.clone(), FILL.0)?;
        let p = vehicle.parameters();
        let count = vehicle.rotors().len() as f64;
        let (hover_n, most_n) = (vehicle.weight_n() / count, vehicle.rotor_thrust_max_n());
        let to_spare_n = hover_n.min(most_n - hover_n).max(0.0);
        let authority = |axis: usize| {
            vehicle.rotors().iter().map(|r| r.position.vector[axis].abs()).sum::<f64>() * to_spare_n
        };
        let hovering = plant.initial_state(hovering_body(&vehicle), 1.0);
        let force = |state: &PlantState| plant.wrench(state, In::zero()).force.vector;
        let mut moving = hovering;
        moving.body.velocity = In::new(Vector3::new(SPEED_M_S, 0.0, 0.0));
        let mut spread = hovering;
        for servo in &mut spread.servo {
            servo.deployment = 1.0;
        }
        let wings = !matches!(self.wing, WingPlant::None);
        Ok(Means {
            hover_command: p.propulsion.command_for_thrust(hover_n),
            thrust_to_weight: p.limits.thrust_max_n.min(count * most_n) / vehicle.weight_n(),
            hover_induced_speed_m_s: induced::in_hover(&vehicle),
            drag_at_7_m_s_n: -force(&moving).x,
            wing_download_in_hover_n: wings.then(|| force(&spread).z - force(&hovering).z),
            wing_force_at_30_deg_n: wings.then(|| self.filled_wing_force_n(&plant, &spread)),
            roll_authority_n_m: authority(1),
            pitch_authority_n_m: authority(0),
            yaw_authority_n_m: count * to_spare_n * p.propulsion.torque_coefficient_n_m_s2
                / p.propulsion.thrust_coefficient_n_s2,
        })
    }

    /// Along -z, N.
    fn filled_wing_force_n(&self, plant: &Plant, spread: &PlantState) -> f64 {
        let velocity = Vector3::new(ANGLE_RAD.cos(), 0.0, ANGLE_RAD.sin()) * SPEED_M_S;
        let mut state = *spread;
        state.body = State { velocity: In::new(velocity), ..State::at_rest() };
        if let WingPlant::Membrane { membrane, .. } = &self.wing {
            let air = Air::new(In::new(velocity), In::zero());
            let mut filled = MembraneState::at_rest();
            for _ in 0..FILL.1 {
                let (_, rate): (Wrench<_, f64>, _) =
                    membrane.evaluate(&air, [0.0; 2], [1.0; 2], &filled);
                filled = filled.plus_scaled(FILL.0, &rate);
            }
            state.membrane = filled;
        }
        -plant.wing_force(&state, In::zero(), [1.0; 2]).vector.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle_file::SQUIRREL_TOML;

    #[test]
    fn the_squirrels_numbers_by_hand() {
        let means = VehicleFile::squirrel().means().unwrap();
        // Weight 5.374 N: 1.3435 N a rotor, of 5.4 N at full speed.
        assert!((means.hover_command - (1.3435_f64 / 5.4).sqrt()).abs() < 1e-3, "{means:?}");
        assert!((means.thrust_to_weight - 4.019).abs() < 1e-2);
        assert!((means.hover_induced_speed_m_s - 8.22).abs() < 0.02);
        // 0.01 m^2 at 7 m/s.
        assert!((means.drag_at_7_m_s_n - (0.5 * 1.225 * 0.01 * 49.0)).abs() < 1e-6);
        assert_eq!(means.wing_download_in_hover_n, Some(0.0), "no rotor_wash in the file");
        assert!((means.roll_authority_n_m - 4.0 * 0.085 * 1.3435).abs() < 1e-3);
        assert!((means.yaw_authority_n_m - 0.011 * 5.374).abs() < 1e-3);
        let washed = format!("{SQUIRREL_TOML}\n[effects.rotor_wash]\ngain = 1.0\n");
        let washed = VehicleFile::parse(&washed, "file").unwrap().means().unwrap();
        let download = washed.wing_download_in_hover_n.unwrap();
        assert!((download / 1.484 - 1.0).abs() < 0.05, "benches/wash/strips.py: {download}");
    }

    #[test]
    fn a_flat_wing_pushes_as_the_paper_says() {
        let flat = SQUIRREL_TOML.replace("model = \"membrane\"", "model = \"flat\"");
        let means = VehicleFile::parse(&flat, "file").unwrap().means().unwrap();
        let paper = 1.225 * 0.04 * 49.0 * 0.5;
        assert!((means.wing_force_at_30_deg_n.unwrap() / paper - 1.0).abs() < 1e-9, "{means:?}");
    }
}
