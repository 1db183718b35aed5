//! A vehicle file for other simulators, and what is lost on the way.
//!
//! A target has some of the terms of a vehicle: `Keeps` says which and how. From that its force
//! and moment are computed here and compared with the plant's own, so that what a target cannot
//! express is named with the error that remains.

mod ardupilot;
mod crazyflow;
mod flat;
mod loss;
mod mjcf;
mod px4;
mod rotorpy;
mod sdf;

pub use loss::{Error, Lost, Remains};

use super::VehicleFile;
use flat::Flat;
use serde::Serialize;

/// Where a vehicle goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Target {
    /// Gazebo: a model with `MulticopterMotorModel`.
    Sdf,
    /// ArduPilot's own simulator: a frame file.
    ArdupilotJson,
    /// PX4: control allocation, hover, and the vehicle of simulation in hardware (SIH).
    Px4Params,
    /// `MuJoCo`.
    Mjcf,
    /// `RotorPy`: a module with `quad_params`.
    Rotorpy,
    /// crazyflow: a table of its first-principles dynamics.
    Crazyflow,
}

impl Target {
    /// Every target with its name.
    pub const ALL: [(&'static str, Self); 6] = [
        ("sdf", Self::Sdf),
        ("ardupilot-json", Self::ArdupilotJson),
        ("px4-params", Self::Px4Params),
        ("mjcf", Self::Mjcf),
        ("rotorpy", Self::Rotorpy),
        ("crazyflow", Self::Crazyflow),
    ];

    /// The target of a name.
    ///
    /// # Errors
    /// One line with the names that there are.
    pub fn parse(name: &str) -> Result<Self, String> {
        let found = Self::ALL.iter().find(|(own, _)| *own == name);
        found.map(|(_, target)| *target).ok_or_else(|| {
            let names: Vec<&str> = Self::ALL.iter().map(|(own, _)| *own).collect();
            format!("{name}: no such target; known are {}", names.join(", "))
        })
    }

    /// As [`Self::parse`] takes it.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, target)| *target == self).map_or("", |(name, _)| name)
    }

    fn keeps(self) -> Keeps {
        match self {
            Self::Sdf => sdf::KEEPS,
            Self::ArdupilotJson => ardupilot::KEEPS,
            Self::Px4Params => px4::KEEPS,
            Self::Mjcf => mjcf::KEEPS,
            Self::Rotorpy => rotorpy::KEEPS,
            Self::Crazyflow => crazyflow::KEEPS,
        }
    }
}

/// Drag along the axes that a target has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Axes {
    None,
    /// One number for all, that of x and y.
    Alike,
    /// One for x and y, none along z.
    Plane,
    /// One for x and y, and one along z.
    PlaneAndZ,
    Each,
}

impl Axes {
    fn of(self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let plane = 0.5 * (x + y);
        match self {
            Self::None => [0.0; 3],
            Self::Alike => [plane; 3],
            Self::Plane => [plane, plane, 0.0],
            Self::PlaneAndZ => [plane, plane, z],
            Self::Each => [x, y, z],
        }
    }
}

/// Where drag pulls in a target; here it is at the centre of the airframe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Pulls {
    AtCentreOfMass,
    AtCentre,
    /// What is linear at the hubs, what is quadratic at the centre of mass.
    LinearAtHubs,
}

/// What a target has of a vehicle. All have mass, inertia and places of rotors.
#[derive(Debug, Clone, Copy)]
#[allow(clippy::struct_excessive_bools, reason = "each is a term that a target has or has not")]
struct Keeps {
    /// Rotors that differ in thrust.
    rotors_apart: bool,
    /// Lags of rotor speed: none, one, or one each for speeding up and slowing down.
    lags: u8,
    linear: Axes,
    /// Drag with the square of speed; a target without takes what it has at 5 m/s as linear drag.
    quadratic: Axes,
    pulls: Pulls,
    axial: bool,
    lift: bool,
    flapping: bool,
    wind: bool,
    tilt: bool,
    gyro: bool,
    damping: bool,
}

impl Keeps {
    /// Linear drag as the target has it, N s/m.
    fn linear_of(&self, flat: &Flat) -> [f64; 3] {
        let as_line = |axis: usize| match self.quadratic {
            Axes::None => {
                flat.linear[axis] + flat::per_square(flat.area_m2[axis]) * flat::SPEED_M_S
            }
            _ => flat.linear[axis],
        };
        self.linear.of([as_line(0), as_line(1), as_line(2)])
    }
    /// Drag area as the target has it, m^2.
    fn area_of(&self, flat: &Flat) -> [f64; 3] {
        self.quadratic.of(flat.area_m2)
    }
    /// Lags up and down as the target has them, s.
    fn lag_of(&self, flat: &Flat) -> [f64; 2] {
        if self.lags == 2 { flat.lag_s } else { [0.5 * (flat.lag_s[0] + flat.lag_s[1]); 2] }
    }
}

/// A vehicle for another simulator.
#[derive(Debug, Clone, Serialize)]
pub struct Exported {
    /// The file.
    #[serde(skip)]
    pub text: String,
    /// Where it goes.
    pub target: Target,
    /// What the target cannot express, each with its size.
    pub lost: Vec<Lost>,
    /// Force and moment of the plant less those of the target.
    pub remains: Remains,
    /// Speed of a rotor in hover, rad/s.
    pub hover_rotor_speed_rad_s: f64,
    /// Thrust in hover over the most thrust.
    pub hover_thrust_fraction: f64,
}

/// Writes a vehicle as a target reads it.
///
/// # Errors
/// One line: the plant refuses the numbers, or the target has no such vehicle.
pub fn export(file: &VehicleFile, target: Target) -> Result<Exported, String> {
    let flat = Flat::of(file)?;
    let keeps = target.keeps();
    if matches!(target, Target::Mjcf | Target::Sdf) {
        check_inertia(&flat)?;
    }
    let text = match target {
        Target::Sdf => sdf::text(&flat, &keeps),
        Target::ArdupilotJson => ardupilot::text(&flat, &keeps)?,
        Target::Px4Params => px4::text(&flat, &keeps),
        Target::Mjcf => mjcf::text(&flat, &keeps),
        Target::Rotorpy => rotorpy::text(&flat, &keeps)?,
        Target::Crazyflow => crazyflow::text(&flat, &keeps)?,
    };
    Ok(Exported {
        text,
        target,
        lost: loss::lost(file, &flat, &keeps)?,
        remains: loss::remains(&flat, &keeps),
        hover_rotor_speed_rad_s: flat.hover_rad_s,
        hover_thrust_fraction: flat.hover_thrust_fraction(),
    })
}

/// No body has a moment of inertia above the sum of the other two; a number with its error may.
/// `MuJoCo` and Gazebo refuse it.
fn check_inertia(flat: &Flat) -> Result<(), String> {
    let moments = flat.inertia_kg_m2.symmetric_eigenvalues();
    let (most, sum) = (moments.max(), moments.sum());
    if most <= sum - most {
        return Ok(());
    }
    let others = sum - most;
    Err(format!(
        "mass.inertia_kg_m2: its largest moment, {most:.3e}, is above the sum of the others, {others:.3e}, which no body has and this target refuses"
    ))
}

/// A number in a file: nine digits, and a point or an exponent.
fn digits(x: f64) -> String {
    let x: f64 = format!("{x:.8e}").parse().unwrap_or(x);
    // No minus before nothing.
    format!("{:?}", x + 0.0)
}

/// Text of a file that is safe inside XML and comments.
fn plain_name(name: &str) -> String {
    let kept = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' };
    let name: String = name.chars().map(kept).collect();
    if name.is_empty() { "vehicle".to_owned() } else { name }
}

#[cfg(test)]
mod tests;
