//! Lesson 13, `squirrel reach`: what wings add to the accelerations that a vehicle can reach.
//!
//! A [`Question`] is mass, thrust, limits of tilt, a velocity and a model of the wings; [`Reach`]
//! answers with the support function: the largest acceleration along a direction, with its thrust,
//! attitude and wings, and a bound that nothing exceeds. Spread wings push against the motion,
//! whatever one wants. In level flight that brakes and hardly lifts; the faster the vehicle sinks,
//! the more they lift, as a parachute does. Look at the descent that doubles what the rotors can do
//! upwards, and at braking with height held, which wings improve only where thrust is scarce: at 30
//! deg of tilt it is `g tan(30 deg)` whatever carries the weight.
//!
//! ```sh
//! cargo run --release -p squirrel-examples --example what_wings_reach
//! squirrel reach --descent-deg 0,37,90 --ratios 1.1,1.3,2 --html reach.html
//! ```
#![allow(clippy::print_stdout, reason = "a lesson is told")]

use squirrel_core::frames::{In, Ned};
use squirrel_core::nalgebra::Vector3;
use squirrel_examples::Outcome;
use squirrel_plan::reach::{Question, Reach, Tilt};
use squirrel_plan::wing::{WingForce, WingModel};
use squirrel_sim::vehicle_file::VehicleFile;

const UPWARD: Vector3<f64> = Vector3::new(0.0, 0.0, -1.0);

/// The squirrel at 7 m/s, so far below the horizon, with so much thrust.
fn reach(descent_deg: f64, thrust_to_weight: f64) -> Outcome<Reach> {
    let vehicle = VehicleFile::squirrel();
    let (sin, cos) = descent_deg.to_radians().sin_cos();
    let velocity: In<Ned, f64> = In::new(Vector3::new(cos, 0.0, sin) * 7.0);
    let max_rad = vehicle.vehicle.parameters().limits.tilt_max_rad;
    Ok(Reach::new(&Question {
        mass_kg: vehicle.vehicle.parameters().mass_kg,
        thrust_max_n: thrust_to_weight * vehicle.vehicle.weight_n(),
        tilt: Tilt::named("box", max_rad, 0.0)?,
        velocity,
        wing: WingForce::of(&vehicle, WingModel::Flat)?,
    })?)
}

fn main() -> Outcome<()> {
    println!("descent deg  ratio  up folded  with wings  pitch deg  braking at height  with wings");
    for descent_deg in [0.0, 37.0] {
        for ratio in [1.1, 1.3, 2.0] {
            let reach = reach(descent_deg, ratio)?;
            let folded = reach.folded(In::new(UPWARD)).value_m_s2;
            let best = reach.support(In::new(UPWARD));
            let pitch_deg = best.normal.vector.x.asin().to_degrees();
            let level = reach.extremes().braking_level_m_s2.ok_or("height cannot be held")?;
            println!(
                "{descent_deg:>11.0}  {ratio:>5.1}  {folded:>9.2}  {:>10.2}  {pitch_deg:>9.1}  {:>17.2}  {:>10.2}",
                best.value_m_s2, level.folded, level.with_wings
            );
        }
    }
    Ok(())
}

#[test]
fn wings_lift_who_sinks_and_brake_who_lacks_thrust() -> Outcome<()> {
    let gain = |descent_deg| {
        let upward = reach(descent_deg, 1.3)?.extremes().upward_m_s2;
        Ok::<_, Box<dyn std::error::Error>>(upward.ratio())
    };
    let [level, sinking] = [gain(0.0)?, gain(37.0)?];
    assert!(level < 1.3 && sinking > 1.9, "{level} {sinking}");
    for (ratio, wings_help) in [(1.1, true), (1.3, false), (2.0, false)] {
        let braking =
            reach(0.0, ratio)?.extremes().braking_level_m_s2.ok_or("height cannot be held")?;
        assert_eq!(braking.ratio() > 1.01, wings_help, "{ratio}: {braking:?}");
    }
    // The bound proves it: no attitude does better.
    let best = reach(37.0, 1.3)?.support(In::new(UPWARD));
    assert!(best.upper_m_s2 - best.value_m_s2 < 1e-6, "{best:?}");
    Ok(())
}
