//! Scenarios: what to fly, in which air, among which obstacles. A TOML file or one of the built-in
//! ones.

mod conditions;
mod excite;
mod faults;
mod forest;
mod runs;
mod wind;

pub use conditions::Conditions;
pub(crate) use conditions::SAG;
pub use excite::ExciteTable;
pub use faults::{FaultKind, FaultTable};
pub use forest::ForestTable;
pub use runs::RunsTable;
pub use wind::WindTable;

use crate::plant::WindParameters;
use serde::{Deserialize, Serialize};
use squirrel_core::frames::In;
use squirrel_core::guidance::mission::{Mission, Steering, TurnSide};
use squirrel_core::guidance::sensing::Sensing;
use squirrel_core::guidance::trajectory::Trajectory;
use squirrel_core::nalgebra::Vector3;
use squirrel_core::vehicle::MAX_ROTORS;
use squirrel_core::vehicle::ParameterError;
use squirrel_log::files::read_text;
use std::collections::BTreeMap;
use std::path::Path;

/// Thinner obstacles are nothing that a vehicle could hit, m. It stands here and not in the world,
/// which is there with the feature `rapier` alone.
pub const OBSTACLE_RADIUS_MIN_M: f64 = 1e-3;

/// A flight to fly. Units are in the names; heights are positive up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Name.
    pub name: String,
    /// Seed of everything random: sensors, gusts, steering angles.
    #[serde(default)]
    pub seed: u64,
    /// Longest flight, s.
    pub duration_s: f64,
    /// Height of the mission above the ground, m.
    pub height_m: f64,
    /// Effective thrust-to-weight ratio: what all rotors together may be asked for over the weight.
    /// Overrides `limits.thrust_max_n` and `limits.rotor_thrust_max_n` of the vehicle.
    #[serde(default)]
    pub thrust_to_weight: Option<f64>,
    /// Fastest that a controller may fly horizontally to catch up with its reference, for those
    /// whose law has a limit: not the paper's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub speed_max_m_s: Option<f64>,
    /// Charge of the battery at the start, 0..1.
    #[serde(default = "full")]
    pub battery_charge: f64,
    /// Errors are measured from the first encounter for this long, s; 0 for the whole flight.
    #[serde(default)]
    pub measured_window_s: f64,
    /// What the day brings.
    #[serde(default, skip_serializing_if = "Conditions::is_calm")]
    pub conditions: Conditions,
    /// Obstacles are solid; otherwise they are only seen, as in the paper's flights.
    #[serde(default)]
    pub solid_obstacles: bool,
    /// Vertical cylinders: `[north_m, east_m, radius_m]`.
    #[serde(default)]
    pub obstacles: Vec<[f64; 3]>,
    /// More of them, drawn from the seed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub forest: Option<ForestTable>,
    /// What to fly.
    pub mission: MissionTable,
    /// Moving air.
    #[serde(default)]
    pub wind: WindTable,
    /// What fails in flight.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub faults: BTreeMap<FaultKind, FaultTable>,
}

fn full() -> f64 {
    1.0
}

/// What to fly.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum MissionTable {
    /// Hold the start.
    Hover {},
    /// Fly straight, steer away from obstacles.
    Avoid {
        /// Direction of the first run, clockwise from north.
        course_rad: f64,
        /// Target speed.
        speed_m_s: f64,
        /// Time to reach it from the start.
        ramp_s: f64,
        /// Time to reach it after a turn.
        turn_ramp_s: f64,
        /// `R_d`.
        range_m: f64,
        /// Half of the field of view.
        half_view_rad: f64,
        /// Smallest steering angle, positive to the right.
        steering_min_rad: f64,
        /// Largest steering angle.
        steering_max_rad: f64,
        /// Steer to either side, drawn at each encounter.
        both_sides: bool,
        /// Steer away from the obstacle's axis; not beside `both_sides`.
        #[serde(default)]
        turns_away: bool,
    },
    /// Circle about the start.
    Circle {
        /// Radius.
        radius_m: f64,
        /// Speed.
        speed_m_s: f64,
    },
    /// Manoeuvres for identification.
    Excite(ExciteTable),
    /// Random runs with spread wings.
    Runs(RunsTable),
}

/// Names of the built-in scenarios.
pub const BUILT_IN: [&str; 9] = [
    "hover",
    "avoid",
    "steer",
    "track",
    "forest",
    "excite_calm",
    "excite_normal",
    "excite_rich",
    "random_spread",
];

impl Scenario {
    /// A built-in scenario by name, or a TOML file by path.
    ///
    /// # Errors
    /// One line that names the file, field and value.
    pub fn find(name_or_path: &str) -> Result<Self, String> {
        if let Some(scenario) = Self::built_in(name_or_path) {
            return Ok(scenario);
        }
        if Path::new(name_or_path).extension().is_none_or(|e| e != "toml") {
            let names = BUILT_IN.join(", ");
            return Err(format!(
                "scenario = {name_or_path}: no such scenario; known are {names}, or a .toml file"
            ));
        }
        let text =
            read_text(Path::new(name_or_path)).map_err(|e| format!("{name_or_path}: {e}"))?;
        Self::parse(&text, name_or_path)
    }

    /// From TOML.
    ///
    /// # Errors
    /// One line that names `file`, field and value.
    pub fn parse(text: &str, file: &str) -> Result<Self, String> {
        let scenario: Self = toml::from_str(text).map_err(|e| {
            let place = squirrel_log::toml_text::place(text, &e);
            format!("{file}, line {}: {} (in `{}`)", place.line, place.message, place.text)
        })?;
        scenario.check().map_err(|problem| format!("{file}: {problem}"))?;
        Ok(scenario)
    }

    /// As TOML; parsing it gives the same scenario, bit for bit.
    ///
    /// # Panics
    /// Never: every field has a TOML form.
    #[allow(clippy::expect_used, reason = "a struct of numbers and strings always serialises")]
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("a scenario is representable")
    }

    fn base(name: &str, duration_s: f64, mission: MissionTable) -> Self {
        Self {
            name: name.to_owned(),
            seed: 0,
            duration_s,
            height_m: 30.0,
            thrust_to_weight: None,
            speed_max_m_s: None,
            battery_charge: 1.0,
            measured_window_s: 0.0,
            solid_obstacles: false,
            obstacles: Vec::new(),
            forest: None,
            mission,
            conditions: Conditions::Calm,
            wind: WindTable::default(),
            faults: BTreeMap::new(),
        }
    }

    fn built_in(name: &str) -> Option<Self> {
        match name {
            "hover" => Some(Self::base("hover", 10.0, MissionTable::Hover {})),
            "track" => Some(Self::base(
                "track",
                20.0,
                MissionTable::Circle { radius_m: 6.0, speed_m_s: 4.0 },
            )),
            // The paper's real flights: 7.3 m/s, R_d 4 m, 110 to 130 deg. At this thrust-to-weight
            // ratio the paper's gain and its sinking wingless drone appear together.
            "avoid" => Some(Self {
                thrust_to_weight: Some(1.25),
                ..Self::turn("avoid", 7.3, 4.0, 110.0, 130.0)
            }),
            // The paper's simulated study: R_d 5 m, one angle.
            "steer" => Some(Self::turn("steer", 7.0, 5.0, 120.0, 120.0)),
            "forest" => Some(Self::through_forest()),
            "random_spread" => {
                Some(Self::base(name, runs::DURATION_S, MissionTable::Runs(RunsTable::built_in())))
            }
            _ => {
                let (height_m, table) = ExciteTable::built_in(name)?;
                let mission = MissionTable::Excite(table);
                Some(Self { height_m, ..Self::base(name, excite::DURATION_S, mission) })
            }
        }
    }

    /// One obstacle on a straight run, and a turn of `min_deg` to `max_deg` to the right away from
    /// it.
    pub fn turn(name: &str, speed_m_s: f64, range_m: f64, min_deg: f64, max_deg: f64) -> Self {
        let mission = MissionTable::Avoid {
            course_rad: 0.0,
            speed_m_s,
            ramp_s: 4.0,
            turn_ramp_s: 2.0,
            range_m,
            half_view_rad: 15.0_f64.to_radians(),
            steering_min_rad: min_deg.to_radians(),
            steering_max_rad: max_deg.to_radians(),
            both_sides: false,
            turns_away: false,
        };
        Self {
            measured_window_s: 6.0,
            // Far enough for the run to have settled at its speed.
            obstacles: vec![[4.5 * speed_m_s, 0.0, 0.5]],
            ..Self::base(name, 13.0, mission)
        }
    }

    /// The paper's simulated forest: 7 m/s, `R_d` 5 m, turns of 110 to 130 deg to either side until
    /// 400 m are flown.
    fn through_forest() -> Self {
        let mut scenario = Self::turn("forest", 7.0, 5.0, 110.0, 130.0);
        if let MissionTable::Avoid { both_sides, .. } = &mut scenario.mission {
            *both_sides = true;
        }
        Self {
            duration_s: 200.0,
            measured_window_s: 0.0,
            thrust_to_weight: Some(2.0),
            speed_max_m_s: Some(7.0),
            solid_obstacles: true,
            obstacles: Vec::new(),
            forest: Some(ForestTable::built_in()),
            ..scenario
        }
    }

    /// Obstacles given one by one, and those of the forest: north, east, radius, m.
    pub fn all_obstacles(&self) -> Vec<[f64; 3]> {
        let mut all = self.obstacles.clone();
        all.extend(self.forest.iter().flat_map(|forest| forest.trunks(self.seed)));
        all
    }

    /// # Errors
    /// `field = value: reason`.
    pub fn check(&self) -> Result<(), String> {
        let positive = [("duration_s", self.duration_s), ("height_m", self.height_m)];
        for (field, x) in positive {
            if !(x.is_finite() && x > 0.0 && x <= 1e5) {
                return Err(format!("{field} = {x}: must be > 0 and <= 1e5"));
            }
        }
        if let Some(ratio) = self.thrust_to_weight
            && !(ratio > 1.0 && ratio <= 100.0)
        {
            return Err(format!("thrust_to_weight = {ratio}: must be > 1 and <= 100"));
        }
        if let Some(speed) = self.speed_max_m_s
            && !(speed > 0.0 && speed <= 100.0)
        {
            return Err(format!("speed_max_m_s = {speed}: must be > 0 and <= 100"));
        }
        if !(0.0..=1.0).contains(&self.battery_charge) {
            return Err(format!("battery_charge = {}: must be 0 to 1", self.battery_charge));
        }
        if !(0.0..=1e5).contains(&self.measured_window_s) {
            return Err(format!(
                "measured_window_s = {}: must be 0 to 1e5",
                self.measured_window_s
            ));
        }
        for (i, [north, east, radius]) in self.obstacles.iter().enumerate() {
            let has_place = north.abs() <= 1e5 && east.abs() <= 1e5;
            if !(has_place && (OBSTACLE_RADIUS_MIN_M..=100.0).contains(radius)) {
                return Err(format!(
                    "obstacles[{i}] = [{north}, {east}, {radius}]: must be finite, the radius {OBSTACLE_RADIUS_MIN_M} to 100"
                ));
            }
        }
        if let Some(forest) = &self.forest {
            forest.check().map_err(|problem| format!("forest.{problem}"))?;
        }
        self.wind.check()?;
        for (kind, table) in &self.faults {
            table.check(*kind, MAX_ROTORS)?;
        }
        match &self.mission {
            MissionTable::Excite(table) => table.check().map_err(|e| format!("mission.{e}"))?,
            MissionTable::Runs(table) => table.check().map_err(|e| format!("mission.{e}"))?,
            MissionTable::Avoid { both_sides: true, turns_away: true, .. } => {
                return Err("mission.turns_away = true: beside both_sides = true; the side is drawn, or away from the obstacle".to_owned());
            }
            _ => {}
        }
        let mission = self.mission().map_err(|e| format!("mission.{e}"))?;
        mission.check().map_err(|e| format!("mission.{e}"))
    }

    /// Charge of the battery at the start, 0..1.
    pub fn start_charge(&self) -> f64 {
        match &self.mission {
            MissionTable::Excite(table) if self.seed.is_multiple_of(2) => table.even_seed_charge,
            _ => self.battery_charge,
        }
    }

    /// The manoeuvres of an excitation flight in plain words, one a line; `None` for other
    /// scenarios.
    ///
    /// # Errors
    /// As [`Self::mission`].
    pub fn pilot_card(&self) -> Result<Option<String>, ParameterError> {
        let MissionTable::Excite(table) = &self.mission else { return Ok(None) };
        let programme = table.programme(self.height_m, self.seed)?;
        Ok(Some(excite::card(&programme, self.height_m)))
    }

    /// The mission for the flight code.
    ///
    /// # Errors
    /// Numbers of an excitation flight that cannot be flown.
    pub fn mission(&self) -> Result<Mission, ParameterError> {
        let start = In::new(Vector3::new(0.0, 0.0, -self.height_m as f32));
        let mission = match self.mission {
            MissionTable::Hover {} => Mission::Hover { position: start },
            MissionTable::Avoid {
                course_rad,
                speed_m_s,
                ramp_s,
                turn_ramp_s,
                range_m,
                half_view_rad,
                steering_min_rad,
                steering_max_rad,
                both_sides,
                turns_away,
            } => Mission::Avoid {
                run: Trajectory::new(start, course_rad as f32, speed_m_s as f32, ramp_s as f32),
                sensing: Sensing {
                    range_m: range_m as f32,
                    half_view_rad: half_view_rad as f32,
                    speed_min_m_s: 1.0,
                },
                steering: Steering {
                    min_rad: steering_min_rad as f32,
                    max_rad: steering_max_rad as f32,
                    ramp_s: turn_ramp_s as f32,
                    side: match (turns_away, both_sides) {
                        (true, _) => TurnSide::Away,
                        (false, true) => TurnSide::Drawn,
                        (false, false) => TurnSide::Angle,
                    },
                    seed: (self.seed ^ (self.seed >> 32)) as u32,
                },
            },
            MissionTable::Circle { radius_m, speed_m_s } => Mission::Circle {
                centre: In::new(start.vector - Vector3::new(radius_m as f32, 0.0, 0.0)),
                radius_m: radius_m as f32,
                speed_m_s: speed_m_s as f32,
            },
            MissionTable::Excite(ref table) => {
                Mission::Excite(table.programme(self.height_m, self.seed)?)
            }
            MissionTable::Runs(ref table) => {
                Mission::Excite(table.programme(self.height_m, self.seed)?)
            }
        };
        Ok(mission)
    }

    /// The moving air, with what the conditions bring.
    pub fn wind(&self) -> WindParameters {
        self.conditions.air(&self.wind, self.seed).parameters()
    }
}

/// The pilot's card of a built-in excitation scenario at seed 0: what to fly, when, how fast and
/// how high, one manoeuvre a line. `None` for other names.
pub fn pilot_card(name: &str) -> Option<String> {
    Scenario::built_in(name)?.pilot_card().ok()?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn built_in_scenarios_survive_toml_bit_for_bit() {
        for name in BUILT_IN {
            let scenario = Scenario::find(name).unwrap();
            scenario.check().unwrap();
            assert_eq!(Scenario::parse(&scenario.to_toml(), name).unwrap(), scenario);
        }
    }

    #[test]
    fn errors_name_file_field_and_value() {
        let text = Scenario::find("avoid").unwrap().to_toml();
        let error =
            |from: &str, to: &str| Scenario::parse(&text.replace(from, to), "s.toml").unwrap_err();
        assert_eq!(
            error("speed_m_s = 7.3", "speed_m_s = -1.0"),
            "s.toml: mission.speed_m_s = -1: must be finite and > 0"
        );
        assert!(
            error("duration_s = 13.0", "duration_s = nan").starts_with("s.toml: duration_s = NaN")
        );
        assert_eq!(
            error("0.0, 0.5]", "0.0, 0.0005]"),
            "s.toml: obstacles[0] = [32.85, 0, 0.0005]: must be finite, the radius 0.001 to 100"
        );
        assert!(error("range_m", "rnage_m").contains("s.toml, line"));
        assert!(
            error("both_sides = false\nturns_away = false", "both_sides = true\nturns_away = true")
                .starts_with("s.toml: mission.turns_away = true: beside both_sides = true"),
        );
        assert!(Scenario::find("loop").unwrap_err().contains("avoid"));
        assert!(Scenario::find("missing.toml").unwrap_err().starts_with("missing.toml"));
    }
}
