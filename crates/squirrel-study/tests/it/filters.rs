//! What estimators of attitude are worth in flight.

use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::filters::{Filters, run};
use squirrel_study::journal::Keep;

fn study(trials: u32) -> Filters {
    let plan = Plan::calm(VehicleFile::squirrel(), Vec::new(), trials, 1);
    run(&plan, &Keep::default()).unwrap().unwrap()
}

/// The paper's filter bears accelerations if the gyro is calibrated, the plain one never does, and
/// the default does in any case.
#[test]
fn the_default_needs_no_calibration_and_the_papers_filter_does() {
    let study = study(50);
    let rms = |filter: &str, calibrated: bool| {
        let row = study
            .rows
            .iter()
            .find(|row| row.filter == filter && row.calibrated == calibrated)
            .unwrap();
        row.inclination_rms_deg
    };
    assert!(
        rms("eskf", false).high <= 1.0 && rms("eskf", true).high <= 1.0,
        "{:?}",
        rms("eskf", false)
    );
    assert!(rms("rkf_mtf", true).high <= 1.2, "{:?}", rms("rkf_mtf", true));
    assert!(rms("rkf_mtf", false).low > 2.0, "{:?}", rms("rkf_mtf", false));
    assert!(rms("kalman", false).low > 4.0, "{:?}", rms("kalman", false));
    for row in &study.in_loop {
        assert!(row.ratio.value <= 1.15 && row.lost == 0, "{row:?}");
        assert!(row.flagged <= 2, "what is well is not reported: {row:?}");
    }
    assert_eq!(study.in_loop.len(), 4);
    assert!(rms("mahony", true).low > rms("mekf", true).high);
}

#[test]
fn one_thread_and_two_give_the_same_numbers() {
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    assert_eq!(pool(1).install(|| study(2)), pool(2).install(|| study(2)));
}

#[test]
fn no_trials_is_an_error() {
    let plan = Plan::calm(VehicleFile::squirrel(), Vec::new(), 0, 1);
    assert!(run(&plan, &Keep::default()).unwrap_err().to_string().starts_with("trials = 0"));
}
