//! Steering angles and speeds as the command line shows them.

use super::{ANGLES_DEG, SPEEDS_M_S, Steering, page, ratio, run, words};
use crate::campaign::Plan;
use crate::journal::Keep;
use crate::sheet::{Cell, Sheet};
use crate::study::{Arms, Found, Shown, Study};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::FlightError;

/// On the command line.
pub const STUDY: Study = Study {
    arms: Arms::Asked(&Arm::ALONE),
    days: true,
    ..Study::new(
        "steering",
        "The paper's figure of steering angles and speeds, in paper mode and on the independent plant",
        (6, "Flights per arm and cell of the grid, on paired seeds"),
        fly,
    )
};

fn fly(plan: &Plan, _: &[f64], keep: &Keep<'_>) -> Result<Option<Found>, FlightError> {
    let Some(study) = run(plan, keep)? else { return Ok(None) };
    let mut found = Found::of(&study)?;
    found.say(format!(
        "Error over that of pc, {} trials an arm and cell on paired seeds from {}, R_d 5 m; means of cells.\n",
        study.trials, study.seed
    ));
    found.shown.push(Shown::Table(means(&study)));
    found.words(words(&study));
    found.csv = cells(&study).csv;
    if keep.folder.is_some() {
        found.page = Some(page(&study, plan)?);
    }
    Ok(Some(found))
}

fn means(study: &Steering) -> Vec<Vec<String>> {
    let mut names: Vec<String> =
        ["plant", "T/W", "arm", "all", "horizontal"].map(str::to_owned).to_vec();
    names.extend(ANGLES_DEG.iter().map(|angle| format!("{angle:.0} deg")));
    names.extend(SPEEDS_M_S.iter().map(|speed| format!("{speed:.0} m/s")));
    let mut table = vec![names];
    for mean in &study.means {
        let ratio = format!("{:.1}", mean.thrust_to_weight);
        let mut cells = vec![mean.wings.name().to_owned(), ratio, mean.arm.to_owned()];
        let ratios = [mean.ratio, mean.ratio_horizontal];
        let all = ratios.iter().chain(&mean.ratio_by_angle).chain(&mean.ratio_by_speed);
        cells.extend(all.map(|ratio| format!("{ratio:.3}")));
        table.push(cells);
    }
    table
}

/// The CSV has every cell of the grid.
fn cells(study: &Steering) -> Sheet {
    let mut sheet = Sheet::default();
    for cell in &study.cells {
        for row in &cell.rows {
            let ratio = ratio(row.gain);
            sheet.row(&[
                ("plant", "plant", Cell::Text(cell.wings.name())),
                ("T/W", "thrust_to_weight", Cell::Number(cell.thrust_to_weight, 1)),
                ("angle deg", "angle_deg", Cell::Number(cell.angle_deg, 0)),
                ("speed m/s", "speed_m_s", Cell::Number(cell.speed_m_s, 0)),
                ("arm", "arm", Cell::Text(row.arm)),
                ("RMSE 3-D m", "rmse_m", Cell::Number(row.rmse_m, 2)),
                ("horiz. m", "rmse_horizontal_m", Cell::Number(row.rmse_horizontal_m, 2)),
                ("ratio", "ratio", Cell::Number(ratio.value, 3)),
                ("95 % interval", "ratio_low,ratio_high", Cell::Interval(Some(ratio), 3)),
                ("lost m", "height_lost_m", Cell::Number(row.height_lost_m, 2)),
                ("gained m", "height_gained_m", Cell::Number(row.height_gained_m, 2)),
                ("wings s", "wings_open_s", Cell::Number(row.wings_open_s, 2)),
            ]);
        }
    }
    sheet
}
