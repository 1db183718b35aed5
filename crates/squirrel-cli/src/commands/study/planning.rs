//! `squirrel study planning`: what wings buy where both plan.

use super::Common;
use super::sheet::{Cell, Sheet};
use crate::output::{self, Table, say};
use squirrel_plan::trajectory::Planner;
use squirrel_study::campaign::Plan;
use squirrel_study::planning::{self, ARMS, FOLLOWED_M, KINDS, Planning, THRUST_TO_WEIGHT};
use std::time::Instant;

/// Options of the study.
#[derive(Debug, clap::Args)]
pub(crate) struct Options {
    /// Tasks of each kind at each ratio, on paired seeds.
    #[arg(long, default_value_t = 200)]
    trials: u32,
    #[command(flatten)]
    pub(super) common: Common,
}

impl Options {
    pub(super) fn run(&self) -> Result<(), String> {
        let common = &self.common;
        let vehicle = common.begin("planning", self.trials, [])?;
        let plan = Plan { vehicle, arms: ARMS.to_vec(), trials: self.trials, seed: common.seed };
        let command = common.command("planning", &[("trials", self.trials.to_string())]);
        let keep = common.keep(&command);
        let bar = output::progress(planning::flights(&plan, &keep), "flights");
        let study = planning::run(&plan, &keep, || bar.inc(1));
        let Some(study) = common.ended(&bar, study)? else { return Ok(()) };
        say(&format!(
            "Plans of 2 s at 0.1 s for {} tasks of each kind, seeds from {}, each followed once on the full plant.",
            study.trials, study.seed
        ));
        say(&format!(
            "Numbers of plans; Wilson's 95 % interval in %. Followed: within {FOLLOWED_M} m RMSE of the plan."
        ));
        say(
            "Gain: distance to what was wanted of the planner without wings over the arm's, minus 1, in %, paired.\n",
        );
        let csv = sheet(&study).print();
        if !common.merged {
            times(&plan)?;
        }
        common.end("planning", &csv, &study).map(drop)
    }
}

/// How long a plan takes on one core of this machine; no part of the figures that are kept.
#[allow(clippy::disallowed_methods, reason = "how long it takes is the question")]
fn times(plan: &Plan) -> Result<(), String> {
    say("\nA plan from nothing on one core of this machine, ms.\n");
    let mut table = Table::new(&["task", "T/W", "arm", "median", "p90", "longest"]);
    for (kind, ratio) in KINDS.iter().flat_map(|kind| THRUST_TO_WEIGHT.map(|ratio| (*kind, ratio))) {
        for arm in ARMS {
            let tasks = planning::tasks(plan, arm, kind, ratio).map_err(|e| e.to_string())?;
            let mut took_ms: Vec<f64> = Vec::with_capacity(tasks.len());
            for (craft, task) in &tasks {
                let begin = Instant::now();
                std::hint::black_box(Planner::default().plan(craft, task, None));
                took_ms.push(begin.elapsed().as_secs_f64() * 1e3);
            }
            took_ms.sort_by(f64::total_cmp);
            let at = |share: f64| took_ms[((took_ms.len() - 1) as f64 * share).round() as usize];
            let mut cells = vec![kind.to_owned(), format!("{ratio:.1}"), arm.name().to_owned()];
            cells.extend([0.5, 0.9, 1.0].map(|share| format!("{:.1}", at(share))));
            table.row(cells);
        }
    }
    table.print();
    Ok(())
}

fn sheet(study: &Planning) -> Sheet {
    let mut sheet = Sheet::new(&[
        ("task", "task"),
        ("T/W", "thrust_to_weight"),
        ("arm", "arm"),
        ("solved", "solved"),
        ("95 %", "solved_low,solved_high"),
        ("clear", "clear"),
        ("followed", "followed"),
        ("tracking m", "tracking_rmse_m"),
        ("worst m", "tracking_rmse_max_m"),
        ("to wanted m", "wanted_rmse_m"),
        ("gain", "gain_over_no_wings"),
        ("95 %", "gain_low,gain_high"),
        ("sink m", "height_lost_m"),
        ("wings s", "wings_open_s"),
        ("problems", "iterations"),
    ]);
    for row in &study.rows {
        sheet.row(&[
            Cell::Text(row.kind),
            Cell::Number(row.thrust_to_weight, 1),
            Cell::Text(row.arm),
            Cell::Number(f64::from(row.solved.count), 0),
            Cell::PercentInterval(Some(row.solved.share), 0),
            Cell::Number(f64::from(row.clear.count), 0),
            Cell::Number(f64::from(row.followed.count), 0),
            Cell::Number(row.tracking_rmse_m[0], 3),
            Cell::Number(row.tracking_rmse_m[1], 2),
            Cell::Number(row.wanted_rmse_m, 3),
            Cell::Percent(row.gain_over_no_wings.value, 1),
            Cell::PercentInterval(Some(row.gain_over_no_wings), 1),
            Cell::Number(row.height_lost_m, 2),
            Cell::Number(row.wings_open_s, 2),
            Cell::Number(row.iterations, 1),
        ]);
    }
    sheet
}
