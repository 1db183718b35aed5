//! Plans with wings and without as the command line shows them.

use super::{ARMS, FOLLOWED_M, KINDS, Planning, THRUST_TO_WEIGHT, run, tasks};
use crate::campaign::Plan;
use crate::journal::{Keep, Part};
use crate::sheet::{Cell, Sheet};
use crate::study::{Arms, Found, Study, Timed, Work};
use squirrel_plan::trajectory::Planner;
use squirrel_sim::flight::FlightError;
use std::hint::black_box;

/// On the command line.
pub const STUDY: Study = Study {
    arms: Arms::Fixed(&ARMS),
    days: true,
    ..Study::new(
        "planning",
        "What wings buy where both plan: avoidance tasks, planned with wings and without, and flown",
        (200, "Tasks of each kind at each ratio, on paired seeds"),
        fly,
    )
};

fn fly(plan: &Plan, _: &[f64], keep: &Keep<'_>) -> Result<Option<Found>, FlightError> {
    let Some(study) = run(plan, keep)? else { return Ok(None) };
    let mut found = Found::of(&study)?;
    found.say(format!(
        "Plans of 2 s at 0.1 s for {} tasks of each kind, seeds from {}, each followed once on the full plant.",
        study.trials, study.seed
    ));
    found.say(format!(
        "Numbers of plans; Wilson's 95 % interval in %. Followed: within {FOLLOWED_M} m RMSE of the plan."
    ));
    found.say(
        "Gain: distance to what was wanted of the planner without wings over the arm's, minus 1, in %, paired.\n",
    );
    found.csv = found.sheet(sheet(&study));
    if keep.part != Part::Merged {
        found.timed = Some(timed(plan)?);
    }
    Ok(Some(found))
}

/// The tasks again; how long their plans take is no part of the figures that are kept.
fn timed(plan: &Plan) -> Result<Timed, FlightError> {
    let mut rows = Vec::new();
    for (kind, ratio) in KINDS.iter().flat_map(|kind| THRUST_TO_WEIGHT.map(|ratio| (*kind, ratio)))
    {
        for arm in ARMS {
            let work = |(craft, task)| -> Work {
                Box::new(move || drop(black_box(Planner::default().plan(&craft, &task, None))))
            };
            let place = vec![kind.to_owned(), format!("{ratio:.1}"), arm.name().to_owned()];
            rows.push((place, tasks(plan, arm, kind, ratio)?.into_iter().map(work).collect()));
        }
    }
    let words = "A plan from nothing on one core of this machine, ms.";
    Ok(Timed { words, columns: vec!["task", "T/W", "arm"], rows })
}

fn sheet(study: &Planning) -> Sheet {
    let mut sheet = Sheet::default();
    for row in &study.rows {
        sheet.row(&[
            ("task", "task", Cell::Text(row.kind)),
            ("T/W", "thrust_to_weight", Cell::Number(row.thrust_to_weight, 1)),
            ("arm", "arm", Cell::Text(row.arm)),
            ("solved", "solved", Cell::Number(f64::from(row.solved.count), 0)),
            ("95 %", "solved_low,solved_high", Cell::PercentInterval(Some(row.solved.share), 0)),
            ("clear", "clear", Cell::Number(f64::from(row.clear.count), 0)),
            ("followed", "followed", Cell::Number(f64::from(row.followed.count), 0)),
            ("tracking m", "tracking_rmse_m", Cell::Number(row.tracking_rmse_m[0], 3)),
            ("worst m", "tracking_rmse_max_m", Cell::Number(row.tracking_rmse_m[1], 2)),
            ("to wanted m", "wanted_rmse_m", Cell::Number(row.wanted_rmse_m, 3)),
            ("gain", "gain_over_no_wings", Cell::Percent(row.gain_over_no_wings.value, 1)),
            ("95 %", "gain_low,gain_high", Cell::PercentInterval(Some(row.gain_over_no_wings), 1)),
            ("sink m", "height_lost_m", Cell::Number(row.height_lost_m, 2)),
            ("wings s", "wings_open_s", Cell::Number(row.wings_open_s, 2)),
            ("problems", "iterations", Cell::Number(row.iterations, 1)),
        ]);
    }
    sheet
}
