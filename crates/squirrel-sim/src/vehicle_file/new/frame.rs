//! Where the rotors of a frame sit and which way they turn, in the field's numbering.

use serde::{Deserialize, Serialize};

/// One rotor of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Hub ahead of the centre and to its right, as fractions of the arm.
    pub ahead_right: [f64; 2],
    /// Sign of the reaction torque about +z (down): 1 for a rotor that turns counter-clockwise seen
    /// from above.
    pub yaw_sign: f64,
}

/// How the rotors of a multirotor are laid out and numbered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Frame {
    /// Four rotors, the nose between two; numbered as PX4 and ArduPilot do.
    QuadX,
    /// The same, numbered as Betaflight does.
    QuadXBetaflight,
    /// The same, clockwise from the front right: Crazyflie, and ArduPilot's `CW_X`.
    QuadXCrazyflie,
    /// Four rotors, one at the nose; PX4, ArduPilot.
    QuadPlus,
    /// Six rotors, the nose between two; PX4, ArduPilot.
    HexaX,
    /// Six rotors, one at the nose; PX4, ArduPilot.
    HexaPlus,
    /// Eight rotors, the nose between two; PX4, ArduPilot.
    OctoX,
    /// Eight rotors, one at the nose; PX4, ArduPilot.
    OctoPlus,
}

/// Angle of a hub from the nose, clockwise seen from above, deg, and whether the rotor turns
/// counter-clockwise.
type Hub = (f64, bool);

const CCW: bool = true;
const CW: bool = false;
const QUAD_X: &[Hub] = &[(45.0, CCW), (-135.0, CCW), (-45.0, CW), (135.0, CW)];
const QUAD_X_BETAFLIGHT: &[Hub] = &[(135.0, CW), (45.0, CCW), (-135.0, CCW), (-45.0, CW)];
const QUAD_X_CRAZYFLIE: &[Hub] = &[(45.0, CCW), (135.0, CW), (-135.0, CCW), (-45.0, CW)];
const QUAD_PLUS: &[Hub] = &[(90.0, CCW), (-90.0, CCW), (0.0, CW), (180.0, CW)];
const HEXA_X: &[Hub] =
    &[(90.0, CW), (-90.0, CCW), (-30.0, CW), (150.0, CCW), (30.0, CCW), (-150.0, CW)];
const HEXA_PLUS: &[Hub] =
    &[(0.0, CW), (180.0, CCW), (-120.0, CW), (60.0, CCW), (-60.0, CCW), (120.0, CW)];
const OCTO_X: &[Hub] = &[
    (22.5, CW),
    (-157.5, CW),
    (67.5, CCW),
    (157.5, CCW),
    (-22.5, CCW),
    (-112.5, CCW),
    (-67.5, CW),
    (112.5, CW),
];
const OCTO_PLUS: &[Hub] = &[
    (0.0, CW),
    (180.0, CW),
    (45.0, CCW),
    (135.0, CCW),
    (-45.0, CCW),
    (-135.0, CCW),
    (-90.0, CW),
    (90.0, CW),
];

impl Frame {
    /// Every frame with its name.
    pub const ALL: [(&'static str, Self); 8] = [
        ("quad-x", Self::QuadX),
        ("quad-x-betaflight", Self::QuadXBetaflight),
        ("quad-x-crazyflie", Self::QuadXCrazyflie),
        ("quad-plus", Self::QuadPlus),
        ("hexa-x", Self::HexaX),
        ("hexa-plus", Self::HexaPlus),
        ("octo-x", Self::OctoX),
        ("octo-plus", Self::OctoPlus),
    ];

    /// The frame of a name.
    ///
    /// # Errors
    /// One line with the names that there are.
    pub fn parse(name: &str) -> Result<Self, String> {
        let found = Self::ALL.iter().find(|(own, _)| *own == name);
        found.map(|(_, frame)| *frame).ok_or_else(|| {
            let names: Vec<&str> = Self::ALL.iter().map(|(own, _)| *own).collect();
            format!("{name}: no such frame; known are {}", names.join(", "))
        })
    }

    /// As [`Self::parse`] takes it.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, frame)| *frame == self).map_or("", |(name, _)| name)
    }

    /// Who numbers rotors this way.
    pub fn numbering(self) -> &'static str {
        match self {
            Self::QuadXBetaflight => "Betaflight",
            Self::QuadXCrazyflie => "Crazyflie",
            _ => "PX4 and ArduPilot",
        }
    }

    /// The rotors, in command order.
    pub fn places(self) -> Vec<Place> {
        let hubs = match self {
            Self::QuadX => QUAD_X,
            Self::QuadXBetaflight => QUAD_X_BETAFLIGHT,
            Self::QuadXCrazyflie => QUAD_X_CRAZYFLIE,
            Self::QuadPlus => QUAD_PLUS,
            Self::HexaX => HEXA_X,
            Self::HexaPlus => HEXA_PLUS,
            Self::OctoX => OCTO_X,
            Self::OctoPlus => OCTO_PLUS,
        };
        let place = |&(angle_deg, ccw): &Hub| {
            let (sin, cos) = angle_deg.to_radians().sin_cos();
            // Hubs on an axis are on it, not 1e-17 beside it.
            let clean = |x: f64| (x * 1e9).round() * 1e-9;
            Place { ahead_right: [clean(cos), clean(sin)], yaw_sign: if ccw { 1.0 } else { -1.0 } }
        };
        hubs.iter().map(place).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_frame_hovers_without_a_moment() {
        for (name, frame) in Frame::ALL {
            assert_eq!(Frame::parse(name), Ok(frame));
            assert_eq!(frame.name(), name);
            let places = frame.places();
            let sum = |of: &dyn Fn(&Place) -> f64| places.iter().map(of).sum::<f64>();
            for moment in [
                sum(&|p| p.ahead_right[0]),
                sum(&|p| p.ahead_right[1]),
                sum(&|p| p.yaw_sign),
                // Yaw does not roll or pitch.
                sum(&|p| p.yaw_sign * p.ahead_right[0]),
                sum(&|p| p.yaw_sign * p.ahead_right[1]),
            ] {
                assert!(moment.abs() < 1e-8, "{name}: {moment}");
            }
            // Neighbours turn against each other.
            let mut around: Vec<(f64, f64)> = places
                .iter()
                .map(|p| (p.ahead_right[1].atan2(p.ahead_right[0]), p.yaw_sign))
                .collect();
            around.sort_by(|a, b| a.0.total_cmp(&b.0));
            for pair in around.windows(2) {
                assert_eq!(pair[0].1, -pair[1].1, "{name}: {around:?}");
            }
        }
    }

    #[test]
    fn the_shipped_crazyflie_has_its_numbering() {
        let text = squirrel_vehicles::CRAZYFLIE21_BRUSHED;
        let shipped = crate::vehicle_file::VehicleFile::parse(text, "file").unwrap();
        for (place, rotor) in Frame::QuadXCrazyflie.places().iter().zip(shipped.vehicle.rotors()) {
            assert_eq!(place.yaw_sign, rotor.yaw_sign);
            for axis in 0..2 {
                assert_eq!(place.ahead_right[axis].signum(), rotor.position.vector[axis].signum());
            }
        }
    }
}
