//! A vehicle file from frame, mass and propeller alone flies, also where the machine's centre of
//! mass is not where the file has it.

use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_sim::vehicle_file::new::{Frame, Given, Said};

/// The file of a machine, and what is appended to it.
fn machine(frame: Frame, mass_kg: f64, propeller_inch: f64, more: &str) -> VehicleFile {
    let said = |value: f64| Some(Said { value, source: "test".to_owned() });
    let given = Given {
        name: "machine".to_owned(),
        frame: Some(frame),
        mass_kg: said(mass_kg),
        propeller_inch: said(propeller_inch),
        ..Given::default()
    };
    let file = given.vehicle_file().unwrap();
    VehicleFile::parse(&format!("{}\n{more}", file.text), "machine").unwrap()
}

fn rmse_m(vehicle: VehicleFile, scenario: &str) -> f64 {
    let mut scenario = Scenario::find(scenario).unwrap();
    scenario.seed = 5;
    let setup = Setup { vehicle, arm: Arm::PcPlus, scenario, integrator: Integrator::Rk4 };
    setup.fly(false, |_| {}).unwrap().metrics.rmse_m
}

/// A battery that slipped by a tenth of the arm turned such machines over: the loop's integral was
/// one vehicle's number, and the gains that slow rotors allow without a lead were too soft. Flights
/// begin in the air with an integral of nothing, and a small machine turns fast: most of the error
/// is of the first second.
#[test]
fn a_centre_of_mass_beside_the_middle_is_held() {
    for (frame, mass_kg, propeller_inch, most_m, most_times) in [
        (Frame::QuadX, 0.03, 1.8, 0.7, 1.6),
        (Frame::QuadX, 0.75, 5.0, 0.25, 1.1),
        (Frame::HexaX, 2.5, 12.0, 0.12, 1.1),
    ] {
        let straight = || machine(frame, mass_kg, propeller_inch, "");
        let arm_m = straight().vehicle.rotors()[0].position.vector.xy().norm();
        let off_m = 0.1 * arm_m * std::f64::consts::FRAC_1_SQRT_2;
        let effect = format!("[effects.cg_offset]\ncg_x_m = {off_m}\ncg_y_m = {off_m}\n");
        let off = || machine(frame, mass_kg, propeller_inch, &effect);
        let hover_m = rmse_m(off(), "hover");
        assert!(hover_m < most_m, "{mass_kg} kg, hover: {hover_m} m");
        let (off_m, straight_m) = (rmse_m(off(), "track"), rmse_m(straight(), "track"));
        assert!(
            off_m < most_times * straight_m,
            "{mass_kg} kg, circle: {off_m} m of {straight_m} m"
        );
    }
}
