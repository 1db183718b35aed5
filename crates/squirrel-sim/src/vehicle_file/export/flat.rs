//! A vehicle as most simulators see one: a rigid body, rotors whose thrust goes with the square of
//! speed, drag. What effects do is in the numbers where it can be.

use crate::plant::{Plant, WingPlant};
use crate::vehicle_file::VehicleFile;
use squirrel_core::aero::induced;
use squirrel_core::effects::{Effects, FORM, Kind, Present};
use squirrel_core::frames::In;
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::nalgebra::{Matrix3, Vector3};
use squirrel_core::vehicle::{Drag, Propulsion};

/// Airspeed at which what is curved is taken as straight, m/s.
pub(super) const SPEED_M_S: f64 = 5.0;
/// Where `translational_lift` saturates, s^2/m^2.
const LIFT_SATURATION: f64 = 0.004;
/// Step of a plant that is only asked for its wrench, s.
const STEP_S: f64 = 1e-3;

/// One rotor.
#[derive(Debug, Clone, Copy)]
pub(super) struct FlatRotor {
    /// Hub from the centre of mass, body FRD, m.
    pub(super) position: [f64; 3],
    /// Hub from the point that the vehicle file's positions refer to, m.
    pub(super) from_centre: [f64; 3],
    /// Sign of the reaction torque about +z.
    pub(super) yaw_sign: f64,
    /// Thrust over speed squared, N s^2.
    pub(super) thrust: f64,
    /// Reaction torque over speed squared, N m s^2.
    pub(super) torque: f64,
}

/// See the module. SI, body FRD.
#[derive(Debug, Clone)]
pub(super) struct Flat {
    pub(super) name: String,
    pub(super) mass_kg: f64,
    pub(super) inertia_kg_m2: Matrix3<f64>,
    /// From the centre of the airframe to the centre of mass, m.
    pub(super) cg: [f64; 3],
    pub(super) size_m: [f64; 3],
    pub(super) rotors: Vec<FlatRotor>,
    pub(super) propulsion: Propulsion<f64>,
    pub(super) propeller_radius_m: f64,
    /// Speed of each rotor in hover, all alike, rad/s.
    pub(super) hover_rad_s: f64,
    /// Speed of the air through the rotors in hover, m/s.
    pub(super) induced_m_s: f64,
    /// Lags of rotor speed, up and down, s.
    pub(super) lag_s: [f64; 2],
    /// N s/m along each axis.
    pub(super) linear: [f64; 3],
    /// Drag area along each axis, m^2.
    pub(super) area_m2: [f64; 3],
    /// Thrust gained over speed along body z, s/m.
    pub(super) axial: f64,
    /// Thrust gained over speed across the rotors squared, s^2/m^2, as at 5 m/s.
    pub(super) lift: f64,
    /// Moment over speed across the rotors, N m s/m, as at 5 m/s.
    pub(super) flapping: f64,
    /// Whether an effect acts at the rotors' hubs.
    pub(super) acts_at_rotors: bool,
    /// Steady wind, north and east, m/s.
    pub(super) wind: [f64; 2],
    /// Tilt of the thrust, rad.
    pub(super) tilt: [f64; 2],
    /// Inertia of a rotor about its axis, kg m^2.
    pub(super) rotor_inertia: f64,
    /// Moment over angular rate about x and y, half of it about z, N m s.
    pub(super) damping: f64,
    pub(super) tilt_max_rad: f64,
    pub(super) battery: Option<crate::plant::BatteryParameters>,
    /// Whether thrust feels the battery.
    pub(super) sags: bool,
    plant: Plant,
}

/// A number of an effect; 0 where it is absent or has another form.
pub(super) fn number(effects: &Effects<f64>, name: &str, key: &str) -> f64 {
    let mut effects = *effects;
    let form = form(&effects, name);
    let Some(found) = effects.get_mut(name) else { return 0.0 };
    let place = found.parameters.iter().position(|p| p.key == key && p.exists_in(form));
    place.map_or(0.0, |place| found.values[place])
}

/// The form of an effect; empty where it has none.
pub(super) fn form(effects: &Effects<f64>, name: &str) -> &'static str {
    let mut effects = *effects;
    let Some(found) = effects.get_mut(name) else { return "" };
    found
        .parameters
        .iter()
        .zip(found.values.iter())
        .find_map(|(p, value)| match p.kind {
            Kind::OneOf(names) if p.key == FORM => names.get(*value as usize).copied(),
            _ => None,
        })
        .unwrap_or("")
}

/// The effects without one.
pub(super) fn without(effects: &Effects<f64>, name: &str) -> Effects<f64> {
    let (mut all, mut out) = (*effects, Effects::none());
    for other in Effects::<f64>::NAMES.iter().filter(|other| **other != name && effects.has(other))
    {
        if let (Some(from), Some(to)) = (all.get_mut(other), out.insert(other)) {
            to.values.copy_from_slice(from.values);
        }
    }
    out
}

pub(super) fn plant(file: &VehicleFile, effects: &Effects<f64>) -> Result<Plant, String> {
    Plant::new(file.vehicle, *effects, WingPlant::None, None, STEP_S)
        .map_err(|e| format!("{}: {e}", file.name))
}

impl Flat {
    pub(super) fn of(file: &VehicleFile) -> Result<Self, String> {
        let effects = &file.effects;
        let plant = plant(file, effects)?;
        let vehicle = *plant.vehicle();
        let p = vehicle.parameters();
        let of = |name: &str, key: &str| number(effects, name, key);
        let cg = ["cg_x_m", "cg_y_m", "cg_z_m"].map(|key| of("cg_offset", key));
        let [thrust, torque] = vehicle.rotor_factors();
        let rotors: Vec<FlatRotor> = (0..p.rotor_count)
            .map(|i| {
                let from_centre: [f64; 3] = p.rotors[i].position.vector.into();
                FlatRotor {
                    position: [0, 1, 2].map(|axis| from_centre[axis] - cg[axis]),
                    from_centre,
                    yaw_sign: p.rotors[i].yaw_sign,
                    thrust: p.propulsion.thrust_coefficient_n_s2 * thrust[i],
                    torque: p.propulsion.torque_coefficient_n_m_s2 * torque[i],
                }
            })
            .collect();
        let weight_n = p.mass_kg * GRAVITY_M_S2;
        let hover_rad_s = (weight_n / rotors.iter().map(|r| r.thrust).sum::<f64>()).sqrt();
        let extra_s = effects.rotor_extra_time_constant_s();
        Ok(Self {
            name: file.name.clone(),
            mass_kg: p.mass_kg,
            inertia_kg_m2: p.inertia_kg_m2,
            cg,
            size_m: file.size_body_m,
            propulsion: p.propulsion,
            propeller_radius_m: p.propulsion.propeller_radius_m,
            hover_rad_s,
            induced_m_s: induced::in_hover(&vehicle),
            lag_s: [
                p.propulsion.time_constant_up_s + extra_s[0],
                p.propulsion.time_constant_down_s + extra_s[1],
            ],
            linear: linear(p.drag.linear_n_s_per_m.into(), effects),
            area_m2: area(p.drag.area_m2, effects),
            axial: p.propulsion.air.axial_inflow_s_per_m + of("axial_inflow", "gain_s_per_m"),
            lift: lift(p.propulsion.air.translational_lift_s2_per_m2, effects),
            flapping: p.propulsion.air.flapping_moment_n_m_s_per_m + flapping(effects),
            acts_at_rotors: Present::of(effects).act_at_rotors(),
            wind: ["wind_north_m_s", "wind_east_m_s"].map(|key| of("constant_wind", key)),
            tilt: ["tilt_x_rad", "tilt_y_rad"].map(|key| of("thrust_misalignment", key)),
            rotor_inertia: of("rotor_gyro_torque", "rotor_inertia_kg_m2"),
            damping: of("angular_damping", "damping_n_m_s_per_rad"),
            tilt_max_rad: p.limits.tilt_max_rad,
            battery: file.battery.clone(),
            sags: effects.has("battery_sag"),
            rotors,
            plant,
        })
    }

    pub(super) fn weight_n(&self) -> f64 {
        self.mass_kg * GRAVITY_M_S2
    }
    /// Mean thrust and torque over speed squared of the rotors.
    pub(super) fn mean_rotor(&self) -> [f64; 2] {
        let count = self.rotors.len() as f64;
        [
            self.rotors.iter().map(|r| r.thrust).sum::<f64>() / count,
            self.rotors.iter().map(|r| r.torque).sum::<f64>() / count,
        ]
    }
    pub(super) fn speed_max_rad_s(&self) -> f64 {
        match &self.propulsion.thrust_curve {
            Some(_) => self.propulsion.target_speed_rad_s(match self.propulsion.command {
                squirrel_core::vehicle::CommandKind::PwmMicroseconds => 2000.0,
                _ => 1.0,
            }),
            None => self.propulsion.speed_max_rad_s,
        }
    }
    /// Thrust in hover over the most.
    pub(super) fn hover_thrust_fraction(&self) -> f64 {
        (self.hover_rad_s / self.speed_max_rad_s()).powi(2)
    }
    /// Part of thrust that goes with the square of the command; the rest goes with it.
    pub(super) fn square_fraction(&self) -> f64 {
        let volts = self.propulsion.reference_voltage_v;
        self.propulsion.thrust_curve.map_or(1.0, |curve| {
            let [_, line, square, _] = curve.coefficients();
            let (line, square) = (line * volts, square * volts * volts);
            (square / (line + square)).clamp(0.0, 1.0)
        })
    }
    /// Force and moment of the plant, body FRD, about the centre of mass, without gravity.
    pub(super) fn plant_wrench(&self, velocity: [f64; 3]) -> [[f64; 3]; 2] {
        wrench(&self.plant, velocity, self.hover_rad_s, self.rotors.len())
    }
}

/// Force and moment of a plant whose rotors all have one speed, body FRD, in air at rest but for
/// its own wind.
pub(super) fn wrench(
    plant: &Plant,
    velocity: [f64; 3],
    rad_s: f64,
    rotors: usize,
) -> [[f64; 3]; 2] {
    let mut body = squirrel_core::dynamics::State::at_rest();
    body.velocity = In::new(Vector3::from(velocity));
    // High enough for no ground to be felt.
    body.position = In::new(Vector3::new(0.0, 0.0, -50.0));
    body.rotor_speed_rad_s[..rotors].fill(rad_s);
    let wrench = plant.wrench(&plant.initial_state(body, 1.0), In::zero());
    [wrench.force.vector.into(), wrench.moment.vector.into()]
}

fn linear(own: [f64; 3], effects: &Effects<f64>) -> [f64; 3] {
    let of = |key: &str| number(effects, "linear_drag", key);
    let (extra, uneven) = (of("extra_drag_n_s_per_m"), of("anisotropy"));
    [
        own[0] + extra * (1.0 + uneven),
        own[1] + extra * (1.0 - uneven),
        own[2] + of("extra_drag_z_n_s_per_m"),
    ]
}

fn area(own_m2: f64, effects: &Effects<f64>) -> [f64; 3] {
    let of = |key: &str| number(effects, "quadratic_drag", key);
    let (extra, uneven) = (of("extra_drag_area_m2"), of("anisotropy"));
    let z = if form(effects, "quadratic_drag") == "anisotropic" {
        of("extra_drag_area_z_m2")
    } else {
        extra
    };
    [own_m2 + extra * (1.0 + uneven), own_m2 + extra * (1.0 - uneven), own_m2 + z]
}

fn lift(own: f64, effects: &Effects<f64>) -> f64 {
    let square = number(effects, "translational_lift", "gain_s2_per_m2");
    let line = number(effects, "translational_lift", "gain_s_per_m");
    let saturated = 1.0 / (1.0 + LIFT_SATURATION * SPEED_M_S * SPEED_M_S);
    let extra = match form(effects, "translational_lift") {
        "linear" => line / SPEED_M_S,
        "quadratic" | "at_rotors" => square,
        _ => square * saturated,
    };
    own * saturated + extra
}

fn flapping(effects: &Effects<f64>) -> f64 {
    let of = |key: &str| number(effects, "flapping_moment", key);
    let scale = of("speed_scale_m_s");
    let slower = if scale > 0.0 { 1.0 + SPEED_M_S / scale } else { 1.0 };
    of("gain_n_m_s_per_m") / slower
}

/// Half of the density of air times a drag area, N s^2/m^2.
pub(super) fn per_square(area_m2: f64) -> f64 {
    Drag { linear_n_s_per_m: Vector3::zeros(), area_m2 }.per_square()
}
