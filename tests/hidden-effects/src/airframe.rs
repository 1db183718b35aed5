//! The vehicles of the cases: drawn layouts, their numbers with tolerances, and the vehicle file
//! that states them.

use crate::catalogue::CLASS_MASS_KG;
use crate::draw::Draw;
use nalgebra::Vector3;
use std::fmt::Write as _;

/// Most rotors of a layout.
pub const MAX_ROTORS: usize = 8;

/// Tolerances of the nominal numbers, one standard deviation; a share where no unit stands.
pub mod tolerance {
    /// Mass.
    pub const MASS: f64 = 0.002;
    /// Each moment of inertia.
    pub const INERTIA: f64 = 0.01;
    /// Each coordinate of a rotor.
    pub const ARM: f64 = 0.005;
    /// Thrust coefficient: of the propulsion, and each rotor once more with half of it.
    pub const THRUST: f64 = 0.01;
    /// Torque coefficient, likewise.
    pub const TORQUE: f64 = 0.01;
    /// Rotor lag.
    pub const ROTOR_LAG: f64 = 0.08;
    /// Linear drag, N s/m, each axis.
    pub const DRAG_N_S_PER_M: f64 = 0.003;
    /// Drag area.
    pub const DRAG_AREA: f64 = 0.1;
    /// Area, slope and arm of the wings, each.
    pub const WING: f64 = 0.01;
    /// Servo lag.
    pub const SERVO_LAG: f64 = 0.1;
    /// How far ahead and below the wings are, m, each.
    pub const PLACE_M: f64 = 0.001;
    /// Accelerometer bias, m/s^2, each axis.
    pub const ACCEL_BIAS_M_S2: f64 = 0.02;
    /// Heading, rad.
    pub const HEADING_RAD: f64 = 0.5 * std::f64::consts::PI / 180.0;
    /// Gyroscope bias, rad/s, each axis.
    pub const GYRO_BIAS_RAD_S: f64 = 0.001;
}

/// One rotor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotor {
    /// Hub, body frame, m.
    pub position_body_m: Vector3<f64>,
    /// Sign of the reaction torque about +z.
    pub yaw_sign: f64,
    /// Thrust over squared speed, N s^2.
    pub thrust_coefficient_n_s2: f64,
    /// Torque over squared speed, N m s^2.
    pub torque_coefficient_n_m_s2: f64,
}

/// Numbers of a vehicle: those of its file, or those of the individual that flies.
#[derive(Debug, Clone, PartialEq)]
pub struct Airframe {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Principal moments of inertia, kg m^2.
    pub inertia_kg_m2: Vector3<f64>,
    /// Rotors in command order.
    pub rotors: Vec<Rotor>,
    /// Top speed of a rotor, rad/s; a command is a share of it.
    pub speed_max_rad_s: f64,
    /// Rotor lag, s.
    pub rotor_time_constant_s: f64,
    /// Voltage at which the thrust coefficient holds, V.
    pub reference_voltage_v: f64,
    /// Linear drag, N s/m, body axes.
    pub drag_n_s_per_m: Vector3<f64>,
    /// Drag area, m^2.
    pub drag_area_m2: f64,
    /// Area of one wing, m^2.
    pub wing_area_m2: f64,
    /// Normal force slope of the wings.
    pub wing_slope: f64,
    /// From the centre line to a wing's centre of pressure, m.
    pub wing_arm_m: f64,
    /// Servo lag, s.
    pub servo_time_constant_s: f64,
    /// Propellers and wings in more detail, where the file has it.
    pub planform: Option<Planform>,
}

/// How large propellers and wings are beside each other, and where the wings are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planform {
    /// Radius of a propeller, m.
    pub propeller_radius_m: f64,
    /// How far ahead of the middle the wings' centres are, m.
    pub longitudinal_arm_m: f64,
    /// How far below it, m.
    pub vertical_arm_m: f64,
    /// Length of a wing along the flight, m.
    pub chord_m: f64,
}

/// Errors of the sensors of one individual that stay within their tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorErrors {
    /// Accelerometer, m/s^2.
    pub accel_bias_m_s2: Vector3<f64>,
    /// Gyroscope, rad/s.
    pub gyro_bias_rad_s: Vector3<f64>,
    /// Heading of the attitude estimate, rad.
    pub heading_rad: f64,
}

/// Where the rotors of the smallest class sit, m (x forward, y right), and how each reacts.
fn layout(draw: &mut Draw) -> Vec<([f64; 2], f64)> {
    match draw.index(5) {
        // Long X; diagonal pairs one after the other.
        0 => {
            vec![
                ([0.12, 0.085], 1.0),
                ([-0.12, -0.085], 1.0),
                ([0.12, -0.085], -1.0),
                ([-0.12, 0.085], -1.0),
            ]
        }
        // Square X numbered clockwise from the front left, as in the hobby's older tables.
        1 => vec![([0.1, -0.1], -1.0), ([0.1, 0.1], 1.0), ([-0.1, 0.1], -1.0), ([-0.1, -0.1], 1.0)],
        // Wide: arms longer to the sides.
        2 => {
            vec![
                ([0.08, 0.135], -1.0),
                ([-0.08, -0.135], -1.0),
                ([0.08, -0.135], 1.0),
                ([-0.08, 0.135], 1.0),
            ]
        }
        // Square X numbered from the back right.
        3 => vec![([-0.1, 0.1], 1.0), ([0.1, 0.1], -1.0), ([-0.1, -0.1], -1.0), ([0.1, -0.1], 1.0)],
        // Hexa X.
        _ => (0..6)
            .map(|k| {
                let angle = (30.0 + 60.0 * f64::from(k)).to_radians();
                ([0.14 * angle.cos(), 0.14 * angle.sin()], if k % 2 == 0 { 1.0 } else { -1.0 })
            })
            .collect(),
    }
}

impl Airframe {
    /// A vehicle: mostly of 0.45 to 0.8 kg, at times of 0.4 to 1.6 kg, everything scaled with it.
    pub fn draw(draw: &mut Draw) -> Self {
        let layout = layout(draw);
        let mass_kg = if draw.uniform(0.0, 1.0) < 0.85 {
            draw.uniform(0.45, 0.8)
        } else {
            draw.uniform(0.4, 1.6)
        };
        let mass_kg = round(mass_kg);
        let scale = mass_kg / CLASS_MASS_KG;
        let length = scale.cbrt();
        let about =
            |draw: &mut Draw, x: f64, share: f64| round(x * draw.uniform(1.0 - share, 1.0 + share));
        let speed_max_rad_s = about(draw, 2200.0 / length, 0.15);
        let hover_share = draw.uniform(0.5, 0.58);
        let hover_speed = hover_share * speed_max_rad_s;
        let thrust = round(mass_kg * GRAVITY_M_S2 / layout.len() as f64 / hover_speed.powi(2));
        let torque = round(thrust * draw.uniform(0.0115, 0.015) * length);
        let stretch = draw.uniform(0.95, 1.08) * length;
        let rotors = layout.iter().map(|([x, y], yaw_sign)| Rotor {
            position_body_m: Vector3::new(round(x * stretch), round(y * stretch), 0.0),
            yaw_sign: *yaw_sign,
            thrust_coefficient_n_s2: thrust,
            torque_coefficient_n_m_s2: torque,
        });
        let size = mass_kg * stretch * stretch / CLASS_MASS_KG;
        let (slim, broad) = (about(draw, 3.22e-3 * size, 0.08), about(draw, 4.68e-3 * size, 0.08));
        // The axis across the longer arms has the larger moment.
        let wide = layout[0].0[0].abs() < layout[0].0[1].abs();
        let (roll, pitch) = if wide { (broad, slim) } else { (slim, broad) };
        let inertia = [roll, pitch, round((roll + pitch) * draw.uniform(0.9, 0.95))];
        let drag = about(draw, 0.08 * length * length, 0.15);
        Self {
            rotors: rotors.collect(),
            mass_kg,
            inertia_kg_m2: Vector3::from(inertia),
            speed_max_rad_s,
            rotor_time_constant_s: about(draw, 0.025, 0.15),
            reference_voltage_v: 15.8,
            drag_n_s_per_m: Vector3::new(drag, drag, 0.0),
            drag_area_m2: about(draw, 0.008 * length * length, 0.15),
            wing_area_m2: about(draw, 0.03 * length * length, 0.1),
            wing_slope: about(draw, 1.6, 0.1),
            wing_arm_m: about(draw, 0.12 * length, 0.08),
            servo_time_constant_s: about(draw, 0.08, 0.15),
            planform: None,
        }
    }

    /// One individual: every number off by its tolerance.
    pub fn individual(&self, draw: &mut Draw) -> (Self, SensorErrors) {
        use tolerance as t;
        let mut real = self.clone();
        let off = |draw: &mut Draw, x: f64, share: f64| x * (1.0 + draw.normal(share));
        real.mass_kg = off(draw, self.mass_kg, t::MASS);
        real.inertia_kg_m2 = self.inertia_kg_m2.map(|j| off(draw, j, t::INERTIA));
        let (thrust, torque) = (draw.normal(0.5 * t::THRUST), draw.normal(0.5 * t::TORQUE));
        for rotor in &mut real.rotors {
            rotor.position_body_m = rotor.position_body_m.map(|x| off(draw, x, t::ARM));
            rotor.thrust_coefficient_n_s2 *= 1.0 + thrust + draw.normal(0.5 * t::THRUST);
            rotor.torque_coefficient_n_m_s2 *= 1.0 + torque + draw.normal(0.5 * t::TORQUE);
        }
        real.rotor_time_constant_s = off(draw, self.rotor_time_constant_s, t::ROTOR_LAG);
        // No airframe is driven by its drag.
        real.drag_n_s_per_m =
            self.drag_n_s_per_m.map(|d| (d + draw.normal(t::DRAG_N_S_PER_M)).max(0.0));
        real.drag_area_m2 = off(draw, self.drag_area_m2, t::DRAG_AREA);
        real.wing_area_m2 = off(draw, self.wing_area_m2, t::WING);
        real.wing_slope = off(draw, self.wing_slope, t::WING);
        real.wing_arm_m = off(draw, self.wing_arm_m, t::WING);
        real.servo_time_constant_s = off(draw, self.servo_time_constant_s, t::SERVO_LAG);
        let errors = SensorErrors {
            accel_bias_m_s2: Vector3::from(draw.normal3(t::ACCEL_BIAS_M_S2)),
            gyro_bias_rad_s: Vector3::from(draw.normal3(t::GYRO_BIAS_RAD_S)),
            heading_rad: draw.normal(t::HEADING_RAD),
        };
        if let Some(planform) = &mut real.planform {
            let arm = planform.longitudinal_arm_m;
            planform.longitudinal_arm_m = arm + draw.normal(t::PLACE_M);
            planform.vertical_arm_m += draw.normal(t::PLACE_M);
        }
        (real, errors)
    }

    /// The same vehicle with propellers and wings of a detail that is drawn.
    #[must_use]
    pub fn detailed(mut self, draw: &mut Draw) -> Self {
        let usual = self.planform();
        let length = (self.mass_kg / CLASS_MASS_KG).cbrt();
        self.planform = Some(Planform {
            propeller_radius_m: 0.5
                * round(2.0 * usual.propeller_radius_m * draw.uniform(0.8, 1.2)),
            longitudinal_arm_m: round(length * draw.uniform(-0.01, 0.01)),
            vertical_arm_m: round(length * draw.uniform(0.01, 0.07)),
            chord_m: round(usual.chord_m * draw.uniform(0.75, 1.15)),
        });
        self
    }

    /// Propellers and wings as a file without their detail means them: propellers of three quarters
    /// of the room that they have, wings twice as long as wide beside the middle.
    pub fn planform(&self) -> Planform {
        let hubs = self.rotors.iter().map(|rotor| rotor.position_body_m);
        let mut apart = f64::INFINITY;
        for (i, one) in hubs.clone().enumerate() {
            for other in hubs.clone().skip(i + 1) {
                apart = apart.min((one - other).norm());
            }
        }
        self.planform.unwrap_or(Planform {
            propeller_radius_m: 0.375 * apart,
            longitudinal_arm_m: 0.0,
            vertical_arm_m: 0.0,
            chord_m: (2.0 * self.wing_area_m2).sqrt(),
        })
    }

    /// Speed of the air through the propellers that carries the weight, m/s.
    pub fn hover_induced_m_s(&self) -> f64 {
        let radius_m = self.planform().propeller_radius_m;
        let discs_m2 = self.rotors.len() as f64 * std::f64::consts::PI * radius_m.powi(2);
        (self.mass_kg * GRAVITY_M_S2 / (2.0 * AIR_DENSITY_KG_M3 * discs_m2)).sqrt()
    }

    /// A machine of a fleet that one file stands for: mass, thrust, inertia, drag and the place of
    /// the centre of mass are each off by up to a tenth (the place: of the longest arm), evenly.
    #[must_use]
    pub fn of_a_fleet(&self, draw: &mut Draw) -> Self {
        let mut off = |x: f64| x * (1.0 + draw.uniform(-FLEET, FLEET));
        let mut other = self.clone();
        other.mass_kg = off(self.mass_kg);
        let inertia = self.inertia_kg_m2.map(&mut off);
        // No body has more about one axis than about the other two.
        other.inertia_kg_m2 =
            Vector3::new(inertia.x, inertia.y, inertia.z.min(0.98 * (inertia.x + inertia.y)));
        other.drag_n_s_per_m = self.drag_n_s_per_m.map(&mut off);
        other.drag_area_m2 = off(self.drag_area_m2);
        let thrust = off(1.0);
        let arm = self.rotors.iter().map(|rotor| rotor.position_body_m.norm()).fold(0.0, f64::max);
        let centre = Vector3::new(off(arm) - arm, off(arm) - arm, 0.0);
        for rotor in &mut other.rotors {
            rotor.thrust_coefficient_n_s2 *= thrust;
            rotor.position_body_m -= centre;
        }
        other
    }

    /// Thrust of a rotor at the speed at which all together carry the weight, over that at top
    /// speed.
    pub fn hover_command(&self) -> f64 {
        let squared: f64 = self.rotors.iter().map(|r| r.thrust_coefficient_n_s2).sum();
        (self.mass_kg * GRAVITY_M_S2 / squared).sqrt() / self.speed_max_rad_s
    }

    /// The vehicle file, with tolerances.
    pub fn to_toml(&self) -> String {
        use tolerance as t;
        let mut text = String::from(
            "# Numbers and tolerances (1 sd) of a vehicle as its maker states them.\nname = \"bench\"\n",
        );
        let number = |text: &mut String, key: &str, value: f64, sd: f64| {
            let _ =
                writeln!(text, "{key} = {{ value = {value:e}, sd = {:e}, {SOURCE} }}", round(sd));
        };
        let triple = |text: &mut String, key: &str, value: Vector3<f64>, sd: Vector3<f64>| {
            let list =
                |v: Vector3<f64>| format!("[{:e}, {:e}, {:e}]", round(v.x), round(v.y), round(v.z));
            let _ = writeln!(
                text,
                "{key} = {{ value = {}, sd = {}, {SOURCE} }}",
                list(value),
                list(sd)
            );
        };
        text += "\n[mass]\n";
        number(&mut text, "mass_kg", self.mass_kg, t::MASS * self.mass_kg);
        triple(&mut text, "inertia_kg_m2", self.inertia_kg_m2, t::INERTIA * self.inertia_kg_m2);
        for rotor in &self.rotors {
            let mut sd = t::ARM * rotor.position_body_m.abs();
            sd.z = 1e-3;
            text += "\n[[rotor]]\n";
            triple(&mut text, "position_body_m", rotor.position_body_m, sd);
            let _ = writeln!(text, "yaw_sign = {}", rotor.yaw_sign);
        }
        text += "\n[propulsion]\ncommand = \"speed_fraction\"\n";
        let _ =
            writeln!(text, "speed_max_rad_s = {{ value = {:e}, {SOURCE} }}", self.speed_max_rad_s);
        let rotor = &self.rotors[0];
        let (thrust, torque) = (rotor.thrust_coefficient_n_s2, rotor.torque_coefficient_n_m_s2);
        number(&mut text, "thrust_coefficient_n_s2", thrust, t::THRUST * thrust);
        number(&mut text, "torque_coefficient_n_m_s2", torque, t::TORQUE * torque);
        let lag = self.rotor_time_constant_s;
        number(&mut text, "time_constant_s", lag, t::ROTOR_LAG * lag);
        let _ = writeln!(
            text,
            "reference_voltage_v = {{ value = {:e}, {SOURCE} }}",
            self.reference_voltage_v
        );
        if let Some(planform) = self.planform {
            let diameter = 2.0 * planform.propeller_radius_m;
            let _ = writeln!(text, "propeller_diameter_m = {{ value = {diameter:e}, {SOURCE} }}");
        }
        text += "\n[drag]\n";
        triple(
            &mut text,
            "linear_n_s_per_m",
            self.drag_n_s_per_m,
            Vector3::repeat(t::DRAG_N_S_PER_M),
        );
        number(&mut text, "area_m2", self.drag_area_m2, t::DRAG_AREA * self.drag_area_m2);
        text += "\n[wing]\nmodel = \"flat\"\n";
        number(&mut text, "area_per_side_m2", self.wing_area_m2, t::WING * self.wing_area_m2);
        number(&mut text, "normal_force_slope", self.wing_slope, t::WING * self.wing_slope);
        number(&mut text, "lateral_arm_m", self.wing_arm_m, t::WING * self.wing_arm_m);
        if let Some(planform) = self.planform {
            number(&mut text, "longitudinal_arm_m", planform.longitudinal_arm_m, t::PLACE_M);
            number(&mut text, "vertical_arm_m", planform.vertical_arm_m, t::PLACE_M);
            let _ = writeln!(text, "chord_m = {{ value = {:e}, {SOURCE} }}", planform.chord_m);
        }
        let lag = self.servo_time_constant_s;
        number(&mut text, "time_constant_s", lag, t::SERVO_LAG * lag);
        let most = thrust * self.speed_max_rad_s.powi(2) * self.rotors.len() as f64;
        text += "\n[limits]\n";
        let _ = writeln!(text, "tilt_max_rad = {{ value = 0.65, {SOURCE} }}");
        let _ = writeln!(text, "thrust_max_n = {{ value = {:e}, {SOURCE} }}", round(most));
        text
    }
}

/// Gravity, m/s^2.
pub const GRAVITY_M_S2: f64 = 9.80665;
/// Density of the air, kg/m^3.
pub const AIR_DENSITY_KG_M3: f64 = 1.225;

/// By how much the machines of a fleet are off their file.
const FLEET: f64 = 0.1;

const SOURCE: &str = "source = \"stated by the maker\"";

/// Five significant digits: what a data sheet has.
fn round(x: f64) -> f64 {
    format!("{x:.4e}").parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use squirrel_sim::vehicle_file::VehicleFile;

    #[test]
    fn every_vehicle_file_says_what_was_drawn() {
        let mut hexas = 0;
        for seed in 0..60 {
            let airframe = Airframe::draw(&mut Draw::new(seed));
            let file = VehicleFile::parse(&airframe.to_toml(), "vehicle.toml").unwrap();
            let p = file.vehicle.parameters();
            assert_eq!(p.mass_kg, airframe.mass_kg);
            assert_eq!(p.rotor_count, airframe.rotors.len());
            for (said, drawn) in file.vehicle.rotors().iter().zip(&airframe.rotors) {
                assert!((said.position.vector - drawn.position_body_m).norm() < 1e-12);
                assert_eq!(said.yaw_sign, drawn.yaw_sign);
            }
            assert_eq!(p.inertia_kg_m2.diagonal(), airframe.inertia_kg_m2);
            assert_eq!(p.drag.linear_n_s_per_m, airframe.drag_n_s_per_m);
            assert_eq!(
                p.propulsion.thrust_coefficient_n_s2,
                airframe.rotors[0].thrust_coefficient_n_s2
            );
            hexas += usize::from(airframe.rotors.len() == 6);
        }
        assert!((5..25).contains(&hexas), "{hexas} of 60 are hexas");
    }

    #[test]
    fn layouts_balance_and_hover_is_in_the_middle_of_the_commands() {
        for seed in 0..60 {
            let airframe = Airframe::draw(&mut Draw::new(seed));
            let sum: Vector3<f64> = airframe.rotors.iter().map(|r| r.position_body_m).sum();
            assert!(sum.norm() < 1e-9);
            assert_eq!(airframe.rotors.iter().map(|r| r.yaw_sign).sum::<f64>(), 0.0);
            assert!((0.49..0.59).contains(&airframe.hover_command()));
            let j = airframe.inertia_kg_m2;
            assert!(j.x + j.y >= j.z, "a body of that inertia exists: {j}");
        }
    }

    #[test]
    fn individuals_scatter_by_the_stated_tolerance() {
        let airframe = Airframe::draw(&mut Draw::new(4));
        let (mut mass, mut thrust) = (Vec::new(), Vec::new());
        for seed in 0..400 {
            let (real, _) = airframe.individual(&mut Draw::new(seed));
            mass.push(real.mass_kg / airframe.mass_kg - 1.0);
            thrust.push(
                real.rotors[0].thrust_coefficient_n_s2 / airframe.rotors[0].thrust_coefficient_n_s2
                    - 1.0,
            );
        }
        let sd = |x: &[f64]| (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt();
        assert!((0.85..1.15).contains(&(sd(&mass) / tolerance::MASS)));
        assert!(sd(&thrust) < tolerance::THRUST, "rotors stay inside what the file states");
    }
}
