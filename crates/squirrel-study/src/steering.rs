//! The paper's figure of steering angles and speeds (Fig. 9): the error of each arm over that of
//! `pc`, `R_d` 5 m.
//!
//! Every cell is flown twice: in *paper mode*, where the plant's wing is the network that
//! `twcc_parnn` believes in, as in the paper's simulations, and on the independent plant, the
//! vehicle's own wing. What differs between them is what the paper's figure owes to a plant that
//! agrees with the controller.

mod page;
mod table;

pub use page::page;
pub use table::STUDY;

use crate::campaign::Plan;
use crate::journal::Keep;
use crate::statistics::Estimate;
use crate::tracking::{self, Condition, GUST_M_S, Row};
use serde::Serialize;
use squirrel_sim::flight::FlightError;
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// Steering angles, deg.
pub const ANGLES_DEG: [f64; 5] = [30.0, 60.0, 90.0, 120.0, 150.0];
/// Speeds, m/s.
pub const SPEEDS_M_S: [f64; 4] = [3.0, 5.0, 7.0, 9.0];
/// `R_d`, m.
const RANGE_M: f64 = 5.0;
/// Effective thrust-to-weight ratios: scarce thrust, where wings matter, and plenty. The paper
/// states none.
pub const THRUST_TO_WEIGHT: [f64; 2] = [1.2, 2.0];

/// Whose wing the plant has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Wings {
    /// The network's.
    Paper,
    /// The vehicle's own.
    Independent,
}

impl Wings {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Paper, Self::Independent];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper mode",
            Self::Independent => "independent",
        }
    }
}

/// Arms in one cell of the grid.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cell {
    /// Whose wing the plant has.
    pub wings: Wings,
    /// Effective thrust-to-weight ratio.
    pub thrust_to_weight: f64,
    /// Steering angle, deg.
    pub angle_deg: f64,
    /// Speed, m/s.
    pub speed_m_s: f64,
    /// By arm.
    pub rows: Vec<Row>,
}

/// An arm over all cells of a plant.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mean {
    /// Whose wing the plant has.
    pub wings: Wings,
    /// Effective thrust-to-weight ratio.
    pub thrust_to_weight: f64,
    /// Arm.
    pub arm: &'static str,
    /// Cells in which the error is smaller than that of `pc`.
    pub better: usize,
    /// Cells in which it is smaller than that of `twcc_flat`.
    pub better_than_flat: usize,
    /// Mean over the cells of the error over that of `pc`.
    pub ratio: f64,
    /// The same of errors without height.
    pub ratio_horizontal: f64,
    /// The same by angle, in the order of [`ANGLES_DEG`].
    pub ratio_by_angle: Vec<f64>,
    /// The same by speed, in the order of [`SPEEDS_M_S`].
    pub ratio_by_speed: Vec<f64>,
}

/// The study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Steering {
    /// Name of the vehicle.
    pub vehicle: String,
    /// Trials per arm and cell.
    pub trials: u32,
    /// Seed of all trials.
    pub seed: u64,
    /// By plant, ratio, angle, speed.
    pub cells: Vec<Cell>,
    /// By plant, ratio, arm.
    pub means: Vec<Mean>,
}

/// The error over that of `pc`, with its interval: the gain the other way round.
pub fn ratio(gain: Estimate) -> Estimate {
    let [value, low, high] = [gain.value, gain.high, gain.low].map(|gain| 1.0 / (1.0 + gain));
    Estimate { value, low, high }
}

/// Flies the study; `None` where only a part is flown here.
///
/// # Errors
/// A vehicle that cannot fly or has no weights, or a folder that cannot be written.
pub fn run(plan: &Plan, keep: &Keep<'_>) -> Result<Option<Steering>, FlightError> {
    let conditions = conditions(&plan.vehicle)?;
    let Some(rows) = tracking::run(plan, "steering", &conditions, keep)? else {
        return Ok(None);
    };
    let cells: Vec<Cell> = grid()
        .zip(rows)
        .map(|(place, rows)| {
            let Place { wings, thrust_to_weight, angle_deg, speed_m_s } = place;
            Cell { wings, thrust_to_weight, angle_deg, speed_m_s, rows }
        })
        .collect();
    let mut means = Vec::new();
    for of_plant in cells.chunks(ANGLES_DEG.len() * SPEEDS_M_S.len()) {
        means.extend((0..of_plant[0].rows.len()).map(|arm| average(of_plant, arm)));
    }
    let vehicle = plan.vehicle.name.clone();
    Ok(Some(Steering { vehicle, trials: plan.trials, seed: plan.seed, cells, means }))
}

/// A place in the grid.
struct Place {
    wings: Wings,
    thrust_to_weight: f64,
    angle_deg: f64,
    speed_m_s: f64,
}

fn grid() -> impl Iterator<Item = Place> {
    let ratios = |wings| THRUST_TO_WEIGHT.into_iter().map(move |ratio| (wings, ratio));
    let angles =
        |(wings, ratio)| ANGLES_DEG.into_iter().map(move |angle_deg| (wings, ratio, angle_deg));
    let speeds = |(wings, thrust_to_weight, angle_deg)| {
        SPEEDS_M_S.into_iter().map(move |speed_m_s| Place {
            wings,
            thrust_to_weight,
            angle_deg,
            speed_m_s,
        })
    };
    Wings::ALL.into_iter().flat_map(ratios).flat_map(angles).flat_map(speeds)
}

/// What is flown in each cell.
///
/// # Errors
/// A vehicle without weights.
pub fn conditions(vehicle: &VehicleFile) -> Result<Vec<Condition>, FlightError> {
    let paper = vehicle.with_learned_wing().map_err(FlightError)?;
    let condition = |Place { wings, thrust_to_weight, angle_deg, speed_m_s }| {
        let mut scenario = Scenario::turn("steering", speed_m_s, RANGE_M, angle_deg, angle_deg);
        scenario.thrust_to_weight = Some(thrust_to_weight);
        scenario.wind.gust_sigma_m_s = GUST_M_S;
        let vehicle = if wings == Wings::Paper { paper.clone() } else { vehicle.clone() };
        Condition { vehicle, scenario }
    };
    Ok(grid().map(condition).collect())
}

/// An arm over the cells of one plant and ratio.
fn average(cells: &[Cell], arm: usize) -> Mean {
    let mean = |figure: fn(&Row) -> Estimate, of: &dyn Fn(&Cell) -> bool| {
        let of = cells.iter().filter(|cell| of(cell));
        let ratios: Vec<f64> = of.map(|cell| ratio(figure(&cell.rows[arm])).value).collect();
        crate::statistics::mean(&ratios)
    };
    let by = |of: &dyn Fn(&Cell) -> bool| mean(|row| row.gain, of);
    let smaller = |than: &str| {
        let is_smaller = |cell: &&Cell| {
            let rival = cell.rows.iter().find(|row| row.arm == than);
            rival.is_some_and(|rival| cell.rows[arm].rmse_m < rival.rmse_m)
        };
        cells.iter().filter(is_smaller).count()
    };
    Mean {
        wings: cells[0].wings,
        thrust_to_weight: cells[0].thrust_to_weight,
        arm: cells[0].rows[arm].arm,
        better: smaller("pc"),
        better_than_flat: smaller("twcc_flat"),
        ratio: by(&|_| true),
        ratio_horizontal: mean(|row| row.gain_horizontal, &|_| true),
        ratio_by_angle: ANGLES_DEG
            .iter()
            .map(|angle| by(&|cell| cell.angle_deg == *angle))
            .collect(),
        ratio_by_speed: SPEEDS_M_S
            .iter()
            .map(|speed| by(&|cell| cell.speed_m_s == *speed))
            .collect(),
    }
}

/// What the means say, in words: the shape of the paper's figure, in its own mode and out of it.
pub fn words(study: &Steering) -> Vec<String> {
    let cells = ANGLES_DEG.len() * SPEEDS_M_S.len();
    let parnn = || study.means.iter().filter(|mean| mean.arm == "twcc_parnn");
    let mut words: Vec<String> = parnn()
        .map(|mean| {
            let by_speed: Vec<String> = SPEEDS_M_S
                .iter()
                .zip(&mean.ratio_by_speed)
                .map(|(speed, ratio)| format!("{ratio:.3} at {speed:.0} m/s"))
                .collect();
            format!(
                "{}, T/W {:.1}: twcc_parnn is better than pc in {} of {cells} cells, than twcc_flat in {}; {}.",
                mean.wings.name(),
                mean.thrust_to_weight,
                mean.better,
                mean.better_than_flat,
                by_speed.join(", ")
            )
        })
        .collect();
    let paper = parnn().filter(|mean| mean.wings == Wings::Paper);
    let independent = parnn().filter(|mean| mean.wings == Wings::Independent);
    for (paper, independent) in paper.zip(independent) {
        words.push(format!(
            "With the independent plant the mean of twcc_parnn over pc at T/W {:.1} is {:.3} instead of {:.3} ({:+.3}).",
            paper.thrust_to_weight,
            independent.ratio,
            paper.ratio,
            independent.ratio - paper.ratio
        ));
    }
    words
}
