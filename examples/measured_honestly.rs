//! Lesson 4, measured honestly: what is a difference between two controllers worth?
//!
//! Three habits of every study here. *Paired seeds*: each arm flies the same obstacle, gusts and
//! noise, so that luck cancels in the difference. *A phantom*: an arm that decides like `twcc_flat`
//! on a plant that has no wings; what it gains, wings do not give. *An interval*: resampled from
//! the pairs, to see what of a difference may be luck still. Look at the ratio of 2: `twcc_flat`
//! beats `pc`, and most of that is not the wings'.
//!
//! ```sh
//! cargo run --release -p squirrel-examples --example measured_honestly
//! ```
#![allow(clippy::print_stdout, reason = "a lesson is told")]

use squirrel_examples::{Outcome, percent};
use squirrel_sim::arm::Arm;
use squirrel_sim::flight::{Integrator, Setup};
use squirrel_sim::scenario::Scenario;
use squirrel_sim::vehicle_file::VehicleFile;
use squirrel_study::statistics::{Estimate, gain, paired};

const SEEDS: std::ops::Range<u64> = 0..12;

/// Tracking error of each seed, m: the avoidance manoeuvre in gusts.
fn errors_m(arm: Arm, thrust_to_weight: f64) -> Outcome<Vec<f64>> {
    let vehicle = VehicleFile::squirrel();
    let mut errors_m = Vec::new();
    for seed in SEEDS {
        let thrust_to_weight = Some(thrust_to_weight);
        let mut scenario = Scenario { seed, thrust_to_weight, ..Scenario::find("avoid")? };
        scenario.wind.gust_sigma_m_s = 0.5;
        let setup = Setup { vehicle: vehicle.clone(), arm, scenario, integrator: Integrator::Rk4 };
        errors_m.push(setup.fly(false, |_| {})?.metrics.rmse_m);
    }
    Ok(errors_m)
}

/// Gains at one thrust-to-weight ratio.
struct Gains {
    /// `twcc_flat` over `pc`, seed by seed.
    paired: Estimate,
    /// The same errors with seeds that do not match: what the interval would be on seeds of one's
    /// own.
    unpaired: Estimate,
    /// `phantom` over `pc`.
    phantom: Estimate,
    /// `twcc_flat` over `phantom`: what wings are worth.
    wings: Estimate,
}

fn gains(thrust_to_weight: f64) -> Outcome<Gains> {
    let [pc, phantom, flat] =
        [Arm::Pc, Arm::Phantom, Arm::TwccFlat].map(|arm| errors_m(arm, thrust_to_weight));
    let [pc, phantom, flat] = [pc?, phantom?, flat?];
    let mut shifted = flat.clone();
    shifted.rotate_left(1);
    Ok(Gains {
        paired: paired(&pc, &flat, gain),
        unpaired: paired(&pc, &shifted, gain),
        phantom: paired(&pc, &phantom, gain),
        wings: paired(&phantom, &flat, gain),
    })
}

fn main() -> Outcome<()> {
    for ratio in [1.2, 2.0] {
        let Gains { paired, unpaired, phantom, wings } = gains(ratio)?;
        println!("thrust-to-weight {ratio}, {} seeds, gain with its 95 % interval", SEEDS.count());
        println!("  twcc_flat over pc       {}", percent(paired));
        println!("  the same, not paired    {}", percent(unpaired));
        println!("  phantom over pc         {}", percent(phantom));
        println!("  twcc_flat over phantom  {}\n", percent(wings));
    }
    Ok(())
}

#[test]
fn scarce_thrust_is_where_wings_pay_and_pairs_show_it() -> Outcome<()> {
    let scarce = gains(1.2)?;
    assert!(scarce.wings.low > 0.1, "{}", percent(scarce.wings));
    assert!(scarce.phantom.value.abs() < 0.05, "{}", percent(scarce.phantom));
    let width = |gain: Estimate| gain.high - gain.low;
    assert!(
        width(scarce.paired) < width(scarce.unpaired),
        "{} not paired",
        percent(scarce.unpaired)
    );

    // With thrust to spare the law alone is better than `pc`, and a comparison of two arms would
    // call that the wings.
    let plenty = gains(2.0)?;
    assert!(plenty.phantom.low > 0.0, "{}", percent(plenty.phantom));
    assert!(plenty.wings.high < plenty.paired.value, "{}", percent(plenty.wings));
    Ok(())
}
