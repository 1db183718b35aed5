//! What the study of dispersed vehicles and days shows, on a few draws of a seed that nothing was
//! chosen on; docs/guide/what-holds.md has it on many.

use squirrel_sim::arm::Arm;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::dispersion::{Dispersion, run};
use squirrel_study::journal::Keep;

fn study(arms: &[Arm], trials: u32) -> Dispersion {
    let plan = Plan::calm(VehicleFile::squirrel(), arms.to_vec(), trials, 11);
    run(&plan, &Keep::default()).unwrap().unwrap()
}

/// No arm is better than ours beyond the interval, in no class of thrust and wind, and none of ours
/// is lost. Whoever sinks deep, it is reported before half of that is lost.
#[test]
fn nobody_is_better_where_nothing_is_as_it_was_told() {
    let study = study(&[Arm::Pc, Arm::TwccFlatFf, Arm::PcPlus, Arm::Indi], 12);
    for row in &study.rows {
        assert_eq!(row.deep_flagged_late, 0, "{row:?}");
        match row.over_twcc_plus {
            Some(over) => assert!(over.low <= 0.0, "{row:?}"),
            None => assert!(row.lost.count == 0 && row.deep_unflagged == 0, "{row:?}"),
        }
    }
    let classes = study.rows.iter().filter(|row| row.arm == "twcc_plus").count();
    assert_eq!((classes, study.rows.len()), (6, 30), "both winds at each ratio");
}

/// A draw is the trial's, whoever flies it: the arm's own row is the same in any company.
#[test]
fn a_draw_is_the_same_for_every_arm() {
    let (alone, beside) = (study(&[Arm::TwccPlus], 3), study(&[Arm::Pc, Arm::TwccPlus], 3));
    let ours = |study: &Dispersion| -> Vec<_> {
        study.rows.iter().filter(|row| row.arm == "twcc_plus").cloned().collect()
    };
    assert_eq!(ours(&alone), ours(&beside));
}

#[test]
fn an_arm_that_plans_is_refused_by_name() {
    let plan = Plan::calm(VehicleFile::squirrel(), vec![Arm::PlanWings], 1, 11);
    let refused = run(&plan, &Keep::default()).unwrap_err().to_string();
    assert!(refused.starts_with("arms = plan_wings: "), "{refused}");
}
