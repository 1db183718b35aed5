//! Lesson 6, `squirrel study steering`: the paper's figure of steering angles and speeds.
//!
//! Each cell of angle, speed and thrust is flown on two plants: in *paper mode* the plant's wing is
//! the very network that `twcc_parnn` believes in, as in the paper's simulations; the *independent*
//! plant has the vehicle's own membrane. A controller that is tested on its own model should do
//! best there. Look at whether it does, and at what the network is worth over the flat plate
//! (`twcc_flat`).
//!
//! ```sh
//! cargo run --release -p squirrel-examples --example study_steering
//! squirrel study steering      # the whole of it
//! ```
#![allow(clippy::print_stdout, reason = "a lesson is told")]

use squirrel_examples::Outcome;
use squirrel_sim::arm::Arm;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::campaign::Plan;
use squirrel_study::journal::Keep;
use squirrel_study::steering::{self, ANGLES_DEG, SPEEDS_M_S, Steering};

fn study() -> Outcome<Steering> {
    let arms = vec![Arm::TwccFlat, Arm::TwccParnn];
    let plan = Plan::calm(VehicleFile::squirrel(), arms, 1, 1);
    Ok(steering::run(&plan, &Keep::default())?.ok_or("a part of a study")?)
}

fn main() -> Outcome<()> {
    let study = study()?;
    println!("error over that of pc, mean of {} cells", ANGLES_DEG.len() * SPEEDS_M_S.len());
    let speeds: Vec<String> = SPEEDS_M_S.iter().map(|speed| format!("{speed:>3.0} m/s")).collect();
    println!("plant        ratio  arm          mean  {}", speeds.join("  "));
    for mean in study.means.iter().filter(|mean| mean.arm != "pc") {
        let (wings, ratio, arm) = (mean.wings.name(), mean.thrust_to_weight, mean.arm);
        let by_speed: Vec<String> =
            mean.ratio_by_speed.iter().map(|ratio| format!("{ratio:>7.3}")).collect();
        println!(
            "{wings:<12} {ratio:>5.1}  {arm:<10} {:>6.3}  {}",
            mean.ratio,
            by_speed.join("  ")
        );
    }
    println!();
    for words in steering::words(&study) {
        println!("{words}");
    }
    Ok(())
}

#[test]
fn the_learned_model_is_worth_little_more_than_the_plate() -> Outcome<()> {
    let study = study()?;
    let ratio = |wings, thrust_to_weight: f64, arm: &str| {
        let is = |m: &&steering::Mean| {
            m.wings == wings && m.thrust_to_weight == thrust_to_weight && m.arm == arm
        };
        study.means.iter().find(is).map(|mean| mean.ratio).ok_or("the arm did not fly")
    };
    for wings in steering::Wings::ALL {
        let [flat, parnn] = [ratio(wings, 1.2, "twcc_flat")?, ratio(wings, 1.2, "twcc_parnn")?];
        assert!(parnn < 1.0 && flat < 1.0, "{}: {flat}, {parnn}", wings.name());
        assert!((parnn - flat).abs() < 0.1, "{}: {flat}, {parnn}", wings.name());
    }
    Ok(())
}
