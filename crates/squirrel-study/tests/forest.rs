//! What the forest shows.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::forest::{run, words};
use squirrel_study::journal::Keep;

/// A hundred and five trials of every arm.
#[test]
fn the_better_controller_comes_through_and_the_papers_arms_owe_nothing_to_wings() {
    let plan = Plan::of_all_arms(VehicleFile::squirrel(), 105, 1);
    let study = run(&plan, 2.0, &Keep::default(), || ()).unwrap().unwrap();
    let row = |arm: &str| study.rows.iter().find(|row| row.arm == arm).unwrap();
    assert_eq!(study.rows.len(), 9);
    let papers = ["pc", "pc_wings_open", "wiic_no_wings", "twcc_flat", "twcc_parnn", "twcc_oracle"];
    let best = papers.iter().map(|arm| row(arm).in_band.share.value).fold(0.0, f64::max);
    let ours = row("twcc_plus").in_band.share;
    assert!(ours.value >= 1.5 * best && ours.low > best, "{ours:?}, the paper's best {best}");

    // The law without wings comes through the plane, at heights where no forest is.
    let climbing = row("wiic_no_wings");
    assert!(climbing.through.share.low > row("pc").through.share.high && climbing.height_gained_m > 20.0);
    assert!(climbing.in_band.share.value < 0.1);
    for arm in ["twcc_flat", "twcc_parnn"] {
        let over = row(arm).over_phantom.unwrap();
        assert!(over.low < 0.0 && over.high < 0.2, "{arm}: {over:?}");
    }
    let said = words(&study);
    assert!(
        said[0].starts_with("twcc_flat") && said[0].contains("does not owe its success to wings"),
        "{said:?}"
    );
    for row in &study.rows {
        assert!(row.in_band.count <= row.through.count && row.ends.len() == 105);
        assert!(row.path_m <= 400.1 && row.displacement_m <= row.path_m, "{row:?}");
    }
}
