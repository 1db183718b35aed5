//! Two vehicle files beside each other: the numbers that differ, and what they mean in flight.

use super::VehicleFile;
use crate::plant::Plant;
use serde::Serialize;
use squirrel_core::dynamics::State;
use squirrel_core::frames::In;
use squirrel_core::math::GRAVITY_M_S2;
use squirrel_core::nalgebra::Vector3;
use std::collections::BTreeMap;

/// Airspeed at which drag is told, m/s.
const SPEED_M_S: f64 = 7.0;
const STEP_S: f64 = 1e-3;

/// A number that differs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// Its field.
    pub field: String,
    /// Its value in the first file, as written; `None` where it has none.
    pub a: Option<String>,
    /// In the second.
    pub b: Option<String>,
    /// The change over the tolerance that the first file states; `None` for lists and where it states
    /// none.
    pub in_sd: Option<f64>,
}

/// What a vehicle does, with its effects, wings folded.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Does {
    /// Mass with what effects add, kg.
    pub mass_kg: f64,
    /// Command of one rotor in hover, in the vehicle's unit, at the reference voltage.
    pub hover_command: f64,
    /// Most thrust over weight.
    pub thrust_to_weight: f64,
    /// Drag in level flight at 7 m/s along body x, N.
    pub drag_at_7_m_s_n: f64,
    /// Most roll acceleration about hover that leaves the sum of thrusts, rad/s^2.
    pub roll_authority_rad_s2: f64,
    /// Most pitch acceleration, likewise.
    pub pitch_authority_rad_s2: f64,
    /// Most yaw acceleration, likewise.
    pub yaw_authority_rad_s2: f64,
    /// Moment in hover with all rotors alike, N m.
    pub hover_moment_n_m: f64,
    /// Lag of rotors that speed up, s.
    pub rotor_lag_s: f64,
}

/// Two files compared.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Compared {
    /// Every number that differs.
    pub numbers: Vec<Difference>,
    /// What the first does.
    pub a: Does,
    /// What the second does.
    pub b: Does,
}

/// Compares two files.
///
/// # Errors
/// One line where a plant refuses its numbers.
pub fn compare(a: &VehicleFile, b: &VehicleFile) -> Result<Compared, String> {
    let table = |file: &'_ VehicleFile| -> BTreeMap<String, (String, Option<String>)> {
        let entry = |(field, p): &(String, super::Provenance)| {
            (field.clone(), (p.value.clone(), p.sd.clone()))
        };
        file.provenance.iter().map(entry).collect()
    };
    let (of_a, of_b) = (table(a), table(b));
    let mut fields: Vec<&String> = of_a.keys().chain(of_b.keys()).collect();
    fields.sort_unstable();
    fields.dedup();
    let number = |text: &str| text.parse::<f64>().ok();
    let mut numbers = Vec::new();
    for field in fields {
        let [own, other] = [of_a.get(field), of_b.get(field)];
        let value =
            |entry: Option<&(String, Option<String>)>| entry.map(|(value, _)| value.clone());
        let (x, y) = (value(own), value(other));
        let same = match (&x, &y) {
            (Some(x), Some(y)) => x == y || number(x).is_some_and(|x| number(y) == Some(x)),
            _ => false,
        };
        if same {
            continue;
        }
        let sd = own.and_then(|(_, sd)| number(sd.as_ref()?)).filter(|sd| *sd > 0.0);
        let change = x.as_deref().and_then(number).zip(y.as_deref().and_then(number));
        let in_sd = change.zip(sd).map(|((x, y), sd)| (y - x) / sd);
        numbers.push(Difference { field: field.clone(), a: x, b: y, in_sd });
    }
    Ok(Compared { numbers, a: does(a)?, b: does(b)? })
}

fn does(file: &VehicleFile) -> Result<Does, String> {
    let plant =
        Plant::new(file.vehicle, file.effects, file.wing.clone(), file.battery.clone(), STEP_S)
            .map_err(|e| format!("{}: {e}", file.name))?;
    let vehicle = plant.vehicle();
    let p = vehicle.parameters();
    let count = vehicle.rotors().len();
    let weight_n = p.mass_kg * GRAVITY_M_S2;
    let wrench = |rad_s: f64, velocity: f64| {
        let mut body = State::at_rest();
        body.position = In::new(Vector3::new(0.0, 0.0, -50.0));
        body.velocity = In::new(Vector3::new(velocity, 0.0, 0.0));
        body.rotor_speed_rad_s[..count].fill(rad_s);
        plant.wrench(&plant.initial_state(body, 1.0), In::zero())
    };
    // Thrust goes with the square of speed.
    let per_square = -wrench(1.0, 0.0).force.vector.z;
    let hover_rad_s = (weight_n / per_square).sqrt();
    let nominal = file.vehicle.parameters();
    let own = nominal.propulsion.thrust_coefficient_n_s2;
    let strength = per_square / (count as f64 * own);
    let hover_command = nominal.propulsion.command_for_thrust(own * hover_rad_s * hover_rad_s);
    let most_n = (count as f64 * file.vehicle.rotor_thrust_max_n() * strength)
        .min(nominal.limits.thrust_max_n * strength);
    let hover_n = weight_n / count as f64;
    let to_spare_n = hover_n.min(most_n / count as f64 - hover_n).max(0.0);
    let arms =
        |axis: usize| vehicle.rotors().iter().map(|r| r.position.vector[axis].abs()).sum::<f64>();
    let factors = vehicle.rotor_factors();
    let lever = p.propulsion.torque_coefficient_n_m_s2 / own
        * (factors[1][..count].iter().sum::<f64>() / factors[0][..count].iter().sum::<f64>());
    let inertia = p.inertia_kg_m2.diagonal();
    let lag = nominal.propulsion.time_constant_up_s + file.effects.rotor_extra_time_constant_s()[0];
    Ok(Does {
        mass_kg: p.mass_kg,
        hover_command,
        thrust_to_weight: most_n / weight_n,
        drag_at_7_m_s_n: wrench(hover_rad_s, 0.0).force.vector.x
            - wrench(hover_rad_s, SPEED_M_S).force.vector.x,
        roll_authority_rad_s2: arms(1) * to_spare_n / inertia.x,
        pitch_authority_rad_s2: arms(0) * to_spare_n / inertia.y,
        yaw_authority_rad_s2: count as f64 * to_spare_n * lever / inertia.z,
        hover_moment_n_m: wrench(hover_rad_s, 0.0).moment.vector.norm(),
        rotor_lag_s: lag,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle_file::SQUIRREL_TOML;

    fn parse(text: &str) -> VehicleFile {
        VehicleFile::parse(text, "file").unwrap()
    }

    #[test]
    fn a_file_is_itself() {
        let squirrel = VehicleFile::squirrel();
        let compared = compare(&squirrel, &squirrel).unwrap();
        assert!(compared.numbers.is_empty());
        assert_eq!(compared.a, compared.b);
        let means = squirrel.means().unwrap();
        assert!((compared.a.hover_command - means.hover_command).abs() < 1e-9);
        assert!((compared.a.thrust_to_weight - means.thrust_to_weight).abs() < 1e-9);
        assert!((compared.a.drag_at_7_m_s_n - means.drag_at_7_m_s_n).abs() < 1e-9);
        let roll = means.roll_authority_n_m / 3.22e-3;
        assert!((compared.a.roll_authority_rad_s2 / roll - 1.0).abs() < 1e-9);
    }

    #[test]
    fn numbers_and_effects_are_compared_by_what_they_do() {
        let heavier =
            SQUIRREL_TOML.replace("value = 0.548, sd = 0.0011", "value = 0.6, sd = 0.0011");
        let heavier = format!(
            "{heavier}\n[effects.linear_drag]\nextra_drag_n_s_per_m = 0.1\n[effects.weak_rotor]\nrotor = 1\nthrust_loss_fraction = 0.1\n"
        );
        let compared = compare(&VehicleFile::squirrel(), &parse(&heavier)).unwrap();
        let fields: Vec<&str> = compared.numbers.iter().map(|d| d.field.as_str()).collect();
        assert_eq!(
            fields,
            [
                "effects.linear_drag.extra_drag_n_s_per_m",
                "effects.weak_rotor.rotor",
                "effects.weak_rotor.thrust_loss_fraction",
                "mass.mass_kg"
            ]
        );
        let mass = &compared.numbers[3];
        assert!((mass.in_sd.unwrap() - 0.052 / 0.0011).abs() < 1e-6, "{mass:?}");
        let (a, b) = (compared.a, compared.b);
        // 0.6 kg on 3.9 rotors' thrust.
        let hover = a.hover_command * (0.6 / 0.548 / 0.975_f64).sqrt();
        assert!((b.hover_command / hover - 1.0).abs() < 1e-9, "{b:?}");
        assert!(
            (b.thrust_to_weight / (a.thrust_to_weight * 0.548 / 0.6 * 0.975) - 1.0).abs() < 1e-9
        );
        assert!((b.drag_at_7_m_s_n - a.drag_at_7_m_s_n - 0.7).abs() < 1e-9);
        assert!(b.hover_moment_n_m > 0.01 && a.hover_moment_n_m < 1e-9);
    }
}
