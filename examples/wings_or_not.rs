//! Lesson 2, wings or not: the avoidance manoeuvre in which a drone without wings sinks.
//!
//! The drone flies 7.3 m/s towards an obstacle and turns away from it by 110 to 130 deg, as in the
//! paper's real flights, and its rotors may push with 1.2 times its weight: at 34 deg of tilt all
//! of that goes into holding height. The conventional controller (`pc`) tilts on and pays in
//! height; the paper's (`twcc_flat`) opens the wings and lets the air brake. Look at the height
//! lost, at the error, and at how little is left of either difference where thrust is not scarce.
//!
//! ```sh
//! cargo run --release -p squirrel-examples --example wings_or_not
//! ```
#![allow(clippy::print_stdout, reason = "a lesson is told")]

use squirrel_examples::Outcome;
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Metrics, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;

/// The manoeuvre at a thrust-to-weight ratio.
fn avoid(arm: Arm, thrust_to_weight: f64, seed: u64) -> Outcome<Metrics> {
    let thrust_to_weight = Some(thrust_to_weight);
    let scenario = Scenario { seed, thrust_to_weight, ..Scenario::find("avoid")? };
    let setup =
        Setup { vehicle: VehicleFile::squirrel(), arm, scenario, integrator: Integrator::Rk4 };
    Ok(setup.fly(false, |_| {})?.metrics)
}

fn main() -> Outcome<()> {
    println!("thrust/weight  arm        error m  sinks by m  wings open s");
    for ratio in [1.2, 2.0] {
        for arm in [Arm::Pc, Arm::TwccFlat] {
            let m = avoid(arm, ratio, 3)?;
            let (name, lost_m) = (arm.name(), m.height_lost_m);
            println!(
                "{ratio:>13.1}  {name:<9} {:>8.2}  {lost_m:>10.2}  {:>12.2}",
                m.rmse_m, m.wings_open_s
            );
        }
    }
    Ok(())
}

#[test]
fn who_has_no_wings_sinks_where_thrust_is_scarce() -> Outcome<()> {
    for seed in 1..=3 {
        let [pc, wings] = [avoid(Arm::Pc, 1.2, seed)?, avoid(Arm::TwccFlat, 1.2, seed)?];
        assert!(pc.height_lost_m > 2.0 && pc.wings_open_s == 0.0, "seed {seed}: {pc:?}");
        assert!(wings.height_lost_m < 0.7 * pc.height_lost_m, "seed {seed}: {wings:?}");
        assert!(wings.wings_open_s > 0.0 && wings.rmse_m < pc.rmse_m, "seed {seed}: {wings:?}");
        // With thrust to spare nobody sinks.
        let pc = avoid(Arm::Pc, 2.0, seed)?;
        assert!(pc.height_lost_m < 1.0, "seed {seed}: {pc:?}");
    }
    Ok(())
}
