//! Random flights with spread wings: what networks learn from, and the four sets of Table II that
//! they are judged by.
//!
//! | kind | flown as in training, but |
//! |---|---|
//! | `training` | - |
//! | `t1` | faster than anything trained on, in wind |
//! | `t2` | - |
//! | `t3` | in wind |
//! | `t4` | slowly |
//!
//! Networks see ground speed, as in the paper (docs/equations.md T6), so that wind is an error of
//! what they see. All of it is what `squirrel fly --arm pc_wings_open --scenario random_spread`
//! flies, with the scenario's numbers changed.

use squirrel_core::frames::{In, Ned, Rotation};
use squirrel_core::nalgebra::Vector3;
use squirrel_nn::NnError;
use squirrel_nn::labels;
use squirrel_nn::windows::Window;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{FlightError, Integrator, Setup};
use squirrel_sim::scenario::{MissionTable, Scenario};
use squirrel_sim::vehicle_file::VehicleFile;

/// Length of each flight, s.
pub const FLIGHT_S: u32 = 30;
/// Top speed of the reference in training, m/s, so that flights come to the paper's 8 m/s.
const TRAINED_M_S: f64 = 8.0;
/// Top speed of the reference in `t1`, m/s, so that flights come to the paper's 10.7 m/s.
const FAST_M_S: f64 = 11.0;
/// Top speed of the reference in `t4`, m/s.
const SLOW_M_S: f64 = 4.0;
/// Mean wind where there is wind, m/s, in a direction of the seed's.
const WIND_M_S: f64 = 2.0;
/// Between the winds of two seeds.
const GOLDEN_ANGLE_RAD: f64 = 2.399_963;
/// Standard deviation of gusts where there is wind, m/s.
const GUST_M_S: f64 = 0.5;

/// A kind of flights.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// What is learned from.
    Training,
    /// Faster, in wind.
    T1,
    /// As in training.
    T2,
    /// In wind.
    T3,
    /// Slowly.
    T4,
}

/// Why windows could not be flown; one line.
#[derive(Debug, thiserror::Error)]
pub enum WingFlightError {
    /// The flight itself.
    #[error(transparent)]
    Flight(#[from] FlightError),
    /// Its windows.
    #[error(transparent)]
    Windows(#[from] NnError),
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 5] = [Self::Training, Self::T1, Self::T2, Self::T3, Self::T4];
    /// The sets that models are judged by.
    pub const TESTS: [Self; 4] = [Self::T1, Self::T2, Self::T3, Self::T4];

    /// Name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Training => "training",
            Self::T1 => "t1",
            Self::T2 => "t2",
            Self::T3 => "t3",
            Self::T4 => "t4",
        }
    }

    /// What is different from training, in words.
    pub fn about(self) -> &'static str {
        match self {
            Self::Training => "what is learned from",
            Self::T1 => "faster, in wind",
            Self::T2 => "as in training",
            Self::T3 => "in wind",
            Self::T4 => "slowly",
        }
    }

    /// The scenario of a flight.
    ///
    /// # Errors
    /// Never in a program that has the built-in scenario.
    pub fn scenario(self, seed: u64) -> Result<Scenario, FlightError> {
        let mut scenario = Scenario::find("random_spread").map_err(FlightError)?;
        scenario.seed = seed;
        scenario.duration_s = f64::from(FLIGHT_S);
        if let MissionTable::Runs(runs) = &mut scenario.mission {
            runs.speed_m_s = match self {
                Self::T1 => FAST_M_S,
                Self::T4 => SLOW_M_S,
                Self::Training | Self::T2 | Self::T3 => TRAINED_M_S,
            };
        }
        if matches!(self, Self::T1 | Self::T3) {
            // Of flights one after the other the wind comes from all sides.
            let side = Rotation::<Ned, Ned, f64>::from_euler(
                0.0,
                0.0,
                GOLDEN_ANGLE_RAD * (seed % 1024) as f64,
            );
            scenario.wind.mean_ned_m_s = (side * In::new(Vector3::x() * WIND_M_S)).vector.into();
            scenario.wind.gust_sigma_m_s = GUST_M_S;
        }
        Ok(scenario)
    }

    /// Flies and keeps the windows.
    ///
    /// # Errors
    /// A vehicle that cannot fly or has no wings.
    pub fn fly(self, vehicle: &VehicleFile, seed: u64) -> Result<Vec<Window>, WingFlightError> {
        let scenario = self.scenario(seed)?;
        let setup = Setup {
            vehicle: vehicle.clone(),
            arm: Arm::PcWingsOpen,
            scenario,
            integrator: Integrator::Rk4,
        };
        let name = format!("{} {seed}", self.name());
        let log = setup.fly(true, |_| {})?.log.unwrap_or_default();
        Ok(labels::windows(vehicle, &name, &log)?)
    }
}
