//! What a day brings to a flight: nothing, or what every flight outdoors meets.

use super::WindTable;
use crate::sensors::SensorParameters;
use crate::setting::SettingError;
use crate::vehicle_file::VehicleFile;
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64Mcg;
use serde::{Deserialize, Serialize};
use squirrel_core::effects::Effects;

/// The day of a flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Conditions {
    /// What scenario and vehicle file say, and nothing else.
    #[default]
    Calm,
    /// On top of it wind with turbulence where `[wind]` says nothing, rotors that feel the battery
    /// sag, and fixes that come late.
    Outdoors,
}

/// Numbers of a day.
struct Day {
    wind_6m_m_s: f64,
    gnss_latency_s: f64,
    voltage_exponent: f64,
}

/// | number | value | source |
/// |---|---|---|
/// | mean wind at 6 m, and at all heights | 3 m/s | a gentle breeze: Beaufort 2 ends at 3.3 m/s |
/// | turbulence | of that wind | MIL-F-8785C, low altitude: 0.3 m/s vertical, 0.5 m/s horizontal at 30 m |
/// | GNSS latency | 0.12 s | u-blox M8 and M9 on flight controllers: 0.1 to 0.2 s; that of the suites |
/// | rotor speed over voltage, exponent | 0.9 | a motor between no load (1) and full load (about 0.8) |
/// | voltage | the vehicle's `[battery]` | its resistances and its charge; none without one |
const OUTDOORS: Day = Day { wind_6m_m_s: 3.0, gnss_latency_s: 0.12, voltage_exponent: 0.9 };

impl Conditions {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Calm, Self::Outdoors];

    /// Name in scenario files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Calm => "calm",
            Self::Outdoors => "outdoors",
        }
    }

    /// The conditions of a name.
    ///
    /// # Errors
    /// One line that lists the names.
    pub fn parse(name: &str) -> Result<Self, SettingError> {
        Self::ALL.into_iter().find(|one| one.name() == name).ok_or_else(|| SettingError::Name {
            field: "conditions",
            name: name.to_owned(),
            what: "conditions",
            known: Self::ALL.map(Self::name).join(", "),
        })
    }

    #[allow(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
    pub(super) fn is_calm(&self) -> bool {
        *self == Self::Calm
    }

    /// The air of a flight: where it says nothing, a breeze whose direction the seed draws.
    pub(super) fn air(self, table: &WindTable, seed: u64) -> WindTable {
        const DIRECTION: u64 = 0x3C6E_F372_FE94_F82B;
        if self == Self::Calm || *table != WindTable::default() {
            return table.clone();
        }
        // Two normal numbers point anywhere.
        let mut rng = Pcg64Mcg::seed_from_u64(seed ^ DIRECTION);
        let [north, east]: [f64; 2] = std::array::from_fn(|_| StandardNormal.sample(&mut rng));
        let share = OUTDOORS.wind_6m_m_s / north.hypot(east).max(1e-9);
        WindTable {
            mean_ned_m_s: [north * share, east * share, 0.0],
            gust_mil_wind_6m_m_s: Some(OUTDOORS.wind_6m_m_s),
            ..WindTable::default()
        }
    }

    /// Effects of a vehicle on this day: with a battery whose sag its file does not speak of,
    /// rotors feel it.
    pub(crate) fn effects(self, vehicle: &VehicleFile) -> Effects<f64> {
        let mut effects = vehicle.effects;
        let is_said = effects.has(SAG);
        if self == Self::Outdoors
            && vehicle.battery.is_some()
            && !is_said
            && let Some(sag) = effects.insert(SAG)
        {
            sag.values[0] = OUTDOORS.voltage_exponent;
        }
        effects
    }

    /// Sensors of a vehicle on this day: fixes are as late as outdoors, or later where its file
    /// says so, and the log has the voltage. The flight code's filter knows the latency.
    pub(crate) fn sensors(self, mut sensors: SensorParameters) -> SensorParameters {
        if self == Self::Outdoors {
            let latency_s = &mut sensors.gnss.timing.latency_s;
            *latency_s = latency_s.max(OUTDOORS.gnss_latency_s);
            sensors.logged.battery.get_or_insert_default();
        }
        sensors
    }
}

/// The effect that a day brings.
pub(crate) const SAG: &str = "battery_sag";

#[cfg(test)]
mod tests {
    use super::super::Scenario;
    use super::*;
    use crate::plant::GustModel;
    use crate::sensors::SensorParameters;

    fn outdoors(seed: u64) -> Scenario {
        let scenario = Scenario::find("hover").unwrap();
        Scenario { seed, conditions: Conditions::Outdoors, ..scenario }
    }

    #[test]
    fn a_day_outdoors_has_a_breeze_from_anywhere() {
        let mut sum = [0.0; 2];
        for seed in 0..400 {
            let air = outdoors(seed).wind();
            let [north, east, down] = air.mean_ned_m_s;
            assert!((north.hypot(east) - 3.0).abs() < 1e-12 && down == 0.0);
            assert_eq!(air.gust, GustModel::Mil { wind_6m_m_s: 3.0 });
            assert_eq!(air, outdoors(seed).wind());
            sum = [sum[0] + north / 400.0, sum[1] + east / 400.0];
        }
        assert!(sum[0].hypot(sum[1]) < 0.4, "{sum:?}");
    }

    #[test]
    fn what_scenario_and_vehicle_say_stays() {
        let mut scenario = outdoors(1);
        scenario.wind.mean_ned_m_s = [0.0, 5.0, 0.0];
        assert_eq!(scenario.wind().mean_ned_m_s, [0.0, 5.0, 0.0]);
        let mut vehicle = VehicleFile::squirrel();
        assert_eq!(Conditions::Calm.effects(&vehicle), vehicle.effects);
        assert!(Conditions::Outdoors.effects(&vehicle).has("battery_sag"));
        vehicle.effects.insert("battery_sag").unwrap().values[0] = 0.5;
        assert_eq!(Conditions::Outdoors.effects(&vehicle), vehicle.effects);
        let mut bare = VehicleFile::squirrel();
        bare.battery = None;
        assert!(!Conditions::Outdoors.effects(&bare).has("battery_sag"));

        let mut sensors = SensorParameters::default();
        sensors.logged.battery = None;
        assert_eq!(Conditions::Calm.sensors(sensors), sensors);
        let late = Conditions::Outdoors.sensors(sensors);
        assert!(late.gnss.timing.latency_s == 0.12 && late.logged.battery.is_some());
        sensors.gnss.timing.latency_s = 0.2;
        assert_eq!(Conditions::Outdoors.sensors(sensors).gnss.timing.latency_s, 0.2);
    }

    #[test]
    fn a_scenario_file_says_the_day_and_calm_ones_do_not() {
        let calm = Scenario::find("hover").unwrap().to_toml();
        assert!(!calm.contains("conditions"));
        let scenario = outdoors(3);
        assert_eq!(Scenario::parse(&scenario.to_toml(), "s.toml").unwrap(), scenario);
        let error =
            Scenario::parse(&format!("conditions = \"sunny\"\n{calm}"), "s.toml").unwrap_err();
        assert!(error.starts_with("s.toml, line 1: unknown variant `sunny`"), "{error}");
        assert_eq!(
            Conditions::parse("sunny").unwrap_err().to_string(),
            "conditions = sunny: no such conditions; known are calm, outdoors"
        );
    }
}
