//! What an autopilot's own parameters say of its vehicle.
//!
//! - PX4: `CA_ROTOR*` (places in body FRD, `KM` > 0 for a rotor that turns counter-clockwise), or of
//!   before 1.13 the number of the airframe, `SYS_AUTOSTART`; `THR_MDL_FAC`, `MPC_THR_HOVER`,
//!   `BAT1_N_CELLS`, `BAT1_CAPACITY`.
//! - ArduPilot: `FRAME_CLASS` and `FRAME_TYPE`, `MOT_THST_HOVER`, `MOT_THST_EXPO`, `BATT_CAPACITY`.
//! - Betaflight: `mixer` (or `mixerMode`) 3, a quadrotor in X.

use super::{Frame, Given, Said, SaidRotor};
use squirrel_core::vehicle::MAX_ROTORS;
use std::collections::BTreeMap;

/// Parameters of a log by name.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LogParameters(pub BTreeMap<String, f64>);

/// What `CA_ROTOR*_KM` is where nobody has set it.
const PX4_DEFAULT_KM: f64 = 0.05;
/// What `MPC_THR_HOVER` is where nobody has set or learnt it.
const PX4_DEFAULT_HOVER: f64 = 0.5;

impl LogParameters {
    /// Fills in what is not given yet; what is given goes first.
    ///
    /// * `log` - what sources call it
    ///
    /// # Errors
    /// One line: a frame that is not known here.
    pub fn fill(&self, given: &mut Given, log: &str) -> Result<(), String> {
        if self.0.contains_key("CA_ROTOR_COUNT") || self.0.contains_key("MPC_THR_HOVER") {
            self.px4(given, log)
        } else if self.0.contains_key("FRAME_CLASS") {
            self.ardupilot(given, log)
        } else if let Some(mixer) = self.get("mixer").or_else(|| self.get("mixerMode")) {
            if mixer != 3.0 && given.frame.is_none() {
                return Err(format!(
                    "{log}: mixer = {mixer}: only 3, a quadrotor in X, is known; give --frame"
                ));
            }
            given.frame = given.frame.or(Some(Frame::QuadXBetaflight));
            Ok(())
        } else {
            Err(format!(
                "{log}: no parameter of PX4 (CA_ROTOR_COUNT), ArduPilot (FRAME_CLASS) or Betaflight (mixer) in it"
            ))
        }
    }

    fn get(&self, name: &str) -> Option<f64> {
        self.0.get(name).copied().filter(|x| x.is_finite())
    }

    fn said(&self, name: &str, log: &str, factor: f64) -> Option<Said> {
        let value = self.get(name).filter(|x| *x > 0.0)?;
        Some(Said { value: value * factor, source: format!("{name} = {value} in {log}") })
    }

    fn px4(&self, given: &mut Given, log: &str) -> Result<(), String> {
        if given.frame.is_none() && given.rotors.is_none() {
            match self.get("CA_ROTOR_COUNT").filter(|count| *count > 0.0) {
                Some(count) => self.px4_rotors(given, log, count)?,
                None => given.frame = Some(self.px4_airframe(log)?),
            }
        }
        let hover = self.said("MPC_THR_HOVER", log, 1.0);
        fill(
            &mut given.hover_thrust_fraction,
            hover.filter(|said| !is_unset(said.value, PX4_DEFAULT_HOVER)),
        );
        if let Some(square) = self.get("THR_MDL_FAC") {
            let source = format!("THR_MDL_FAC in {log}");
            fill(&mut given.thrust_square_fraction, Some(Said { value: square, source }));
        }
        let cells =
            ["BAT1_N_CELLS", "BAT_N_CELLS"].iter().find_map(|name| self.said(name, log, 1.0));
        fill(&mut given.cells, cells);
        let capacity = ["BAT1_CAPACITY", "BAT_CAPACITY"];
        fill(&mut given.capacity_ah, capacity.iter().find_map(|name| self.said(name, log, 1e-3)));
        Ok(())
    }

    /// The rotors one by one. Control allocation needs places only in relation to each other, so an
    /// arm that is given scales them.
    fn px4_rotors(&self, given: &mut Given, log: &str, count: f64) -> Result<(), String> {
        if count > MAX_ROTORS as f64 {
            return Err(format!(
                "{log}: CA_ROTOR_COUNT = {count}: at most {MAX_ROTORS} rotors are known"
            ));
        }
        let mut rotors = Vec::new();
        let mut levers = Vec::new();
        for i in 0..count as usize {
            let of = |key: &str| self.get(&format!("CA_ROTOR{i}_{key}")).unwrap_or(0.0);
            let lever = self.get(&format!("CA_ROTOR{i}_KM")).unwrap_or(PX4_DEFAULT_KM);
            levers.push(lever.abs());
            rotors.push(SaidRotor {
                position_body_m: [of("PX"), of("PY"), of("PZ")],
                // Counter-clockwise seen from above reacts about +z, which is down.
                yaw_sign: if lever >= 0.0 { 1.0 } else { -1.0 },
            });
        }
        let arms = || rotors.iter().map(|r| r.position_body_m[0].hypot(r.position_body_m[1]));
        if let Some((i, arm)) = arms().enumerate().find(|(_, arm)| *arm < 5e-3) {
            return Err(format!(
                "{log}: CA_ROTOR{i}_PX, CA_ROTOR{i}_PY: {arm} m from the centre; give --frame and --arm-m"
            ));
        }
        let mut source = format!("CA_ROTOR* in {log}");
        if let Some(arm) = &given.arm_m {
            let scale = arm.value * count / arms().sum::<f64>();
            for rotor in &mut rotors {
                rotor.position_body_m = rotor.position_body_m.map(|x| x * scale);
            }
            source = format!("{source}, scaled to {}", arm.source);
        }
        if levers.iter().any(|lever| !is_unset(*lever, PX4_DEFAULT_KM)) {
            let value = levers.iter().sum::<f64>() / count;
            let source = format!("mean of CA_ROTOR*_KM in {log}");
            fill(&mut given.torque_per_thrust_m, Some(Said { value, source }));
        }
        given.rotors = Some((rotors, source));
        Ok(())
    }

    fn px4_airframe(&self, log: &str) -> Result<Frame, String> {
        let number = self.get("SYS_AUTOSTART").unwrap_or(0.0);
        match number as u32 / 1000 {
            4 => Ok(Frame::QuadX),
            5 => Ok(Frame::QuadPlus),
            6 => Ok(Frame::HexaX),
            7 => Ok(Frame::HexaPlus),
            8 => Ok(Frame::OctoX),
            9 => Ok(Frame::OctoPlus),
            _ => Err(format!(
                "{log}: SYS_AUTOSTART = {number}: no frame that is known; give --frame"
            )),
        }
    }

    fn ardupilot(&self, given: &mut Given, log: &str) -> Result<(), String> {
        if given.frame.is_none() {
            let [class, kind] =
                ["FRAME_CLASS", "FRAME_TYPE"].map(|name| self.get(name).unwrap_or(1.0));
            given.frame = Some(match (class as i64, kind as i64) {
                (1, 0) => Frame::QuadPlus,
                (1, 1) => Frame::QuadX,
                (1, 12) => Frame::QuadXBetaflight,
                (1, 14) => Frame::QuadXCrazyflie,
                (2, 0) => Frame::HexaPlus,
                (2, 1) => Frame::HexaX,
                (3, 0) => Frame::OctoPlus,
                (3, 1) => Frame::OctoX,
                _ => {
                    return Err(format!(
                        "{log}: FRAME_CLASS = {class}, FRAME_TYPE = {kind}: no frame that is known; give --frame"
                    ));
                }
            });
        }
        fill(&mut given.hover_thrust_fraction, self.said("MOT_THST_HOVER", log, 1.0));
        if let Some(square) = self.get("MOT_THST_EXPO").filter(|x| (0.0..=1.0).contains(x)) {
            let source = format!("MOT_THST_EXPO in {log}");
            fill(&mut given.thrust_square_fraction, Some(Said { value: square, source }));
        }
        fill(&mut given.capacity_ah, self.said("BATT_CAPACITY", log, 1e-3));
        given.pwm_commands = true;
        Ok(())
    }
}

/// Whether a number is what nobody has set; logs have them in single precision.
fn is_unset(value: f64, default: f64) -> bool {
    (value - default).abs() < 1e-6
}

fn fill(place: &mut Option<Said>, said: Option<Said>) {
    if place.is_none() {
        *place = said;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[allow(clippy::unnecessary_wraps, reason = "every field of what is given is optional")]
    fn said(value: f64) -> Option<Said> {
        Some(Said { value, source: "test".to_owned() })
    }

    fn parameters(of: &[(&str, f64)]) -> LogParameters {
        LogParameters(of.iter().map(|(name, x)| ((*name).to_owned(), *x)).collect())
    }

    #[test]
    fn px4s_rotors_and_hover_throttle_are_taken() {
        // The X500 as PX4's airframe 4019 has it.
        let log = parameters(&[
            ("CA_ROTOR_COUNT", 4.0),
            ("CA_ROTOR0_PX", 0.175),
            ("CA_ROTOR0_PY", 0.175),
            ("CA_ROTOR0_KM", 0.05),
            ("CA_ROTOR1_PX", -0.175),
            ("CA_ROTOR1_PY", -0.175),
            ("CA_ROTOR1_KM", 0.05),
            ("CA_ROTOR2_PX", 0.175),
            ("CA_ROTOR2_PY", -0.175),
            ("CA_ROTOR2_KM", -0.05),
            ("CA_ROTOR3_PX", -0.175),
            ("CA_ROTOR3_PY", 0.175),
            ("CA_ROTOR3_KM", -0.05),
            ("MPC_THR_HOVER", 0.36),
            ("THR_MDL_FAC", 0.3),
            ("BAT1_N_CELLS", 4.0),
            ("BAT1_CAPACITY", 5000.0),
        ]);
        let mut given = Given {
            name: "x500".to_owned(),
            mass_kg: said(2.0),
            propeller_inch: said(10.0),
            ..Given::default()
        };
        log.fill(&mut given, "log.ulg").unwrap();
        let file = given.vehicle_file().unwrap();
        let p = file.vehicle.parameters();
        assert_eq!(p.rotor_count, 4);
        for (rotor, place) in file.vehicle.rotors().iter().zip(Frame::QuadX.places()) {
            assert_eq!(rotor.yaw_sign, place.yaw_sign);
            assert_eq!(rotor.position.vector.x.signum(), place.ahead_right[0].signum());
            assert_eq!(rotor.position.vector.y.signum(), place.ahead_right[1].signum());
        }
        let means = file.means().unwrap();
        assert!((means.thrust_to_weight * 0.36 - 1.0).abs() < 0.01, "{means:?}");
        // 0.3 u^2 + 0.7 u = 0.36.
        let u = (0.7_f64.powi(2) + 4.0 * 0.3 * 0.36).sqrt();
        assert!((means.hover_command - (u - 0.7) / 0.6).abs() < 0.01, "{means:?}");
        assert_eq!(file.battery.unwrap().capacity_ah, 5.0);
        // An arm that is given scales the places.
        let mut scaled = Given { arm_m: said(0.5), ..Given::default() };
        log.fill(&mut scaled, "log.ulg").unwrap();
        let (rotors, _) = scaled.rotors.unwrap();
        assert!((rotors[0].position_body_m[0] - 0.5 / 2.0_f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn ardupilots_frame_and_hover_throttle_are_taken() {
        let log = parameters(&[
            ("FRAME_CLASS", 2.0),
            ("FRAME_TYPE", 1.0),
            ("MOT_THST_HOVER", 0.3),
            ("MOT_THST_EXPO", 0.65),
            ("BATT_CAPACITY", 10_000.0),
        ]);
        let mut given = Given {
            name: "hexa".to_owned(),
            mass_kg: said(3.0),
            propeller_inch: said(13.0),
            cells: said(6.0),
            ..Given::default()
        };
        log.fill(&mut given, "1.bin").unwrap();
        let file = given.vehicle_file().unwrap();
        assert_eq!(file.vehicle.rotors().len(), 6);
        assert!((file.means().unwrap().thrust_to_weight * 0.3 - 1.0).abs() < 0.01);
        assert!(file.text.contains("pwm_us"));
    }

    #[test]
    fn what_is_not_known_is_said() {
        let given = || Given { mass_kg: said(1.0), propeller_inch: said(5.0), ..Given::default() };
        for (log, word) in [
            (parameters(&[("FRAME_CLASS", 7.0)]), "FRAME_CLASS = 7"),
            (
                parameters(&[("MPC_THR_HOVER", 0.4), ("SYS_AUTOSTART", 2100.0)]),
                "SYS_AUTOSTART = 2100",
            ),
            (parameters(&[("CA_ROTOR_COUNT", 12.0)]), "CA_ROTOR_COUNT = 12"),
            (parameters(&[("CA_ROTOR_COUNT", 4.0)]), "CA_ROTOR0_PX"),
            (parameters(&[("mixer", 26.0)]), "mixer = 26"),
            (parameters(&[]), "no parameter"),
        ] {
            let error = log.fill(&mut given(), "x.log").unwrap_err();
            assert!(error.contains(word) && error.starts_with("x.log"), "{error}");
        }
    }
}
