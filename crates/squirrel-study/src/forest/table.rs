//! The forest as the command line shows it.

use super::{BAND_M, Row, page, run, words};
use crate::campaign::Plan;
use crate::journal::Keep;
use crate::sheet::{Cell, Sheet};
use crate::study::{Arms, Choice, Found, Study};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::FlightError;

/// On the command line.
pub const STUDY: Study = Study {
    arms: Arms::Asked(&Arm::ALONE),
    options: &[Choice {
        name: "thrust-to-weight",
        help: "Effective thrust-to-weight ratio",
        default: 2.0,
        whole: false,
    }],
    days: true,
    ..Study::new(
        "forest",
        "Who comes through the paper's forest, in its height band and at all, and who owes it to wings",
        (105, "Flights per arm, on paired seeds"),
        fly,
    )
};

fn fly(plan: &Plan, options: &[f64], keep: &Keep<'_>) -> Result<Option<Found>, FlightError> {
    let ratio = options[0];
    let Some(study) = run(plan, ratio, keep)? else { return Ok(None) };
    let mut found = Found::of(&study)?;
    found.say(format!(
        "The paper's forest: {} flights of {} an arm on paired seeds from {}, thrust-to-weight {ratio:.2}.",
        study.trials, study.vehicle, study.seed
    ));
    found.say(format!(
        "Through: 400 m without contact; in band: and never {BAND_M} m above or below. Wilson's 95 % intervals, in %."
    ));
    for (words, rows, speed, side) in [
        (
            "Over phantom: in band, less that of the controller without wings on the same trials, in points.\n",
            &study.rows,
            "as it is",
            "drawn",
        ),
        (
            "\nThe same, with the limit of speed that ours has for the paper's laws too.\n",
            &study.limited,
            "limited",
            "drawn",
        ),
        (
            "\nThe same with that limit, turning away from the trunk instead of to a side that was drawn.\n",
            &study.away,
            "limited",
            "away",
        ),
    ] {
        found.say(words);
        let table = found.sheet(sheet(rows, speed, side));
        // One heading for all.
        let heading = usize::from(!found.csv.is_empty());
        found.csv.extend(table.split_inclusive('\n').skip(heading));
    }
    found.words(words(&study));
    if keep.folder.is_some() {
        found.page = Some(page(&study, plan)?);
    }
    Ok(Some(found))
}

fn sheet(rows: &[Row], speed: &str, side: &str) -> Sheet {
    let mut sheet = Sheet::default();
    for row in rows {
        sheet.row(&[
            ("arm", "arm", Cell::Text(row.arm)),
            ("speed", "speed", Cell::Text(speed)),
            ("side", "side", Cell::Text(side)),
            ("through", "through", Cell::Number(f64::from(row.through.count), 0)),
            ("95 %", "through_low,through_high", Cell::PercentInterval(Some(row.through.share), 0)),
            ("in band", "in_band", Cell::Number(f64::from(row.in_band.count), 0)),
            ("95 %", "in_band_low,in_band_high", Cell::PercentInterval(Some(row.in_band.share), 0)),
            (
                "over phantom",
                "over_phantom_low,over_phantom_high",
                Cell::PercentInterval(row.over_phantom, 0),
            ),
            (
                "over pc_plus",
                "over_pc_plus_low,over_pc_plus_high",
                Cell::PercentInterval(row.over_pc_plus, 0),
            ),
            ("path m", "path_m", Cell::Number(row.path_m, 0)),
            ("from start m", "displacement_m", Cell::Number(row.displacement_m, 0)),
            ("climb m", "height_gained_m", Cell::Number(row.height_gained_m, 1)),
            ("sink m", "height_lost_m", Cell::Number(row.height_lost_m, 1)),
            ("met", "encounters", Cell::Number(row.encounters, 1)),
            ("wings s", "wings_open_s", Cell::Number(row.wings_open_s, 1)),
        ]);
    }
    sheet
}
