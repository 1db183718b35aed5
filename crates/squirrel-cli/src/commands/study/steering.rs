//! `squirrel study steering`: the paper's figure of steering angles and speeds.

use super::sheet::{Cell, Sheet};
use super::{Flown, write_page};
use crate::output::{self, Table, say};
use squirrel_study::pages;
use squirrel_study::steering::{self, ANGLES_DEG, SPEEDS_M_S, Steering};

/// Options of the study.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Flights per arm and cell of the grid, on paired seeds.
    #[arg(long, default_value_t = 6)]
    trials: u32,
    #[command(flatten)]
    pub(super) flown: Flown,
}

impl Options {
    pub(super) fn run(&self) -> Result<(), String> {
        let (plan, command) = self.flown.plan("steering", self.trials, &[])?;
        let common = &self.flown.common;
        let keep = common.keep(&command);
        let bar = output::progress(steering::flights(&plan, &keep).map_err(|e| e.to_string())?, "flights");
        let study = steering::run(&plan, &keep, || bar.inc(1));
        let Some(study) = common.ended(&bar, study)? else { return Ok(()) };

        say(&format!(
            "Error over that of pc, {} trials an arm and cell on paired seeds from {}, R_d 5 m; means of cells.
",
            study.trials, study.seed
        ));
        means(&study);
        say("");
        for word in steering::words(&study) {
            say(&word);
        }
        let csv = cells(&study);
        let Some(folder) = common.end("steering", &csv, &study)? else { return Ok(()) };
        let page = pages::steering(&study, &plan).map_err(|e| e.to_string())?;
        write_page(folder, "steering", &page)
    }
}

fn means(study: &Steering) {
    let mut names = vec![
        "plant".to_owned(),
        "T/W".to_owned(),
        "arm".to_owned(),
        "all".to_owned(),
        "horizontal".to_owned(),
    ];
    names.extend(ANGLES_DEG.iter().map(|angle| format!("{angle:.0} deg")));
    names.extend(SPEEDS_M_S.iter().map(|speed| format!("{speed:.0} m/s")));
    let mut table = Table::new(&names.iter().map(String::as_str).collect::<Vec<_>>());
    for mean in &study.means {
        let ratio = format!("{:.1}", mean.thrust_to_weight);
        let mut cells = vec![mean.wings.name().to_owned(), ratio, mean.arm.to_owned()];
        let ratios = [mean.ratio, mean.ratio_horizontal];
        let all = ratios.iter().chain(&mean.ratio_by_angle).chain(&mean.ratio_by_speed);
        cells.extend(all.map(|ratio| format!("{ratio:.3}")));
        table.row(cells);
    }
    table.print();
}

/// The CSV has every cell of the grid.
fn cells(study: &Steering) -> String {
    let mut sheet = Sheet::new(&[
        ("plant", "plant"),
        ("T/W", "thrust_to_weight"),
        ("angle deg", "angle_deg"),
        ("speed m/s", "speed_m_s"),
        ("arm", "arm"),
        ("RMSE 3-D m", "rmse_m"),
        ("horiz. m", "rmse_horizontal_m"),
        ("ratio", "ratio"),
        ("95 % interval", "ratio_low,ratio_high"),
        ("lost m", "height_lost_m"),
        ("gained m", "height_gained_m"),
        ("wings s", "wings_open_s"),
    ]);
    for cell in &study.cells {
        for row in &cell.rows {
            let ratio = steering::ratio(row.gain);
            sheet.row(&[
                Cell::Text(cell.wings.name()),
                Cell::Number(cell.thrust_to_weight, 1),
                Cell::Number(cell.angle_deg, 0),
                Cell::Number(cell.speed_m_s, 0),
                Cell::Text(row.arm),
                Cell::Number(row.rmse_m, 2),
                Cell::Number(row.rmse_horizontal_m, 2),
                Cell::Number(ratio.value, 3),
                Cell::Interval(Some(ratio), 3),
                Cell::Number(row.height_lost_m, 2),
                Cell::Number(row.height_gained_m, 2),
                Cell::Number(row.wings_open_s, 2),
            ]);
        }
    }
    sheet.csv()
}
