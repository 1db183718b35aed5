//! The controllable accelerations against dense sampling and against the table of docs/equations.md
//! F.6.
#![allow(clippy::print_stdout, reason = "the figures that documents quote")]

use super::support::{Dice, G, ROLL_AND_PITCH, flat, question, sampled};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use squirrel_core::frames::In;
use squirrel_plan::reach::Reach;
use squirrel_plan::wing::{WingForce, WingModel};
use squirrel_sim::vehicle_file::VehicleFile;

/// Largest distance of found from sampled, and of the bound from found, over the larger of the
/// value and g.
fn gaps(wing: &WingForce, cases: u32, cells: u32, rounds: u32, seed: u64) -> [f64; 2] {
    let mut dice = Dice(Pcg64Mcg::seed_from_u64(seed));
    let mut worst = [0.0_f64; 2];
    for case in 0..cases {
        let (question, d) = dice.case(wing);
        let support = Reach::new(&question).unwrap().support(In::new(d));
        let dense = sampled(&question, d, cells, rounds);
        let scale = dense.abs().max(G);
        // The bound is of the force between nodes, the sample of the force itself.
        let rounding = if matches!(wing, WingForce::Flat { .. }) { 1e-9 } else { 2e-4 };
        assert!(
            dense <= support.upper_m_s2 + rounding * scale,
            "{case}: {dense} above {support:?}"
        );
        assert!(
            (support.acceleration.vector.dot(&d) - support.value_m_s2).abs() < 1e-6 * scale,
            "{case}"
        );
        worst[0] = worst[0].max((support.value_m_s2 - dense).abs() / scale);
        worst[1] = worst[1].max((support.upper_m_s2 - support.value_m_s2) / scale);
    }
    println!("sampled {:.1e}, bound {:.1e}", worst[0], worst[1]);
    worst
}

#[test]
fn a_flat_wing_reaches_what_dense_sampling_finds() {
    let [gap, bound] = gaps(&flat(), 500, 80, 24, 1);
    assert!(gap <= 1e-4 && bound <= 1e-9, "{gap:.1e} {bound:.1e}");
}

#[test]
fn a_membrane_reaches_what_dense_sampling_finds() {
    let wing = WingForce::of(&VehicleFile::squirrel(), WingModel::Membrane).unwrap();
    let [gap, bound] = gaps(&wing, 200, 30, 12, 2);
    assert!(gap <= 1e-3 && bound <= 1e-3, "{gap:.1e} {bound:.1e}");
}

#[test]
fn a_learned_wing_reaches_what_dense_sampling_finds() {
    let wing = WingForce::of(&VehicleFile::squirrel(), WingModel::Parnn).unwrap();
    let [gap, bound] = gaps(&wing, 500, 48, 16, 3);
    assert!(gap <= 1e-3 && bound <= 1e-3, "{gap:.1e} {bound:.1e}");
}

/// A row of the table: what is printed for T/W 1.1, 1.3, 2 and 3, and what comes out.
fn row(name: &str, printed: [&str; 4], found: impl Fn(f64) -> f64) {
    for (ratio, printed) in [1.1, 1.3, 2.0, 3.0].into_iter().zip(printed) {
        let decimals = printed.split_once('.').map_or(0, |(_, digits)| digits.len());
        let (value, found): (f64, f64) = (printed.parse().unwrap(), found(ratio));
        let coarse = 0.5 * 0.1_f64.powi(i32::try_from(decimals).unwrap());
        let allowed = if coarse > 0.01 * value { 0.01 * value + coarse } else { 0.01 * value };
        println!("{name:32} T/W {ratio}: {value} printed, {found:.3} found");
        assert!(
            (found - value).abs() <= allowed,
            "{name}, T/W {ratio}: {value} printed, {found:.4} found"
        );
    }
}

#[test]
fn the_table_at_seven_metres_a_second_comes_out() {
    let descent = 37.0_f64.to_radians();
    let level = [7.0, 0.0, 0.0];
    let down = [0.0, 0.0, 7.0];
    let slanted = [7.0 * descent.cos(), 0.0, 7.0 * descent.sin()];
    let reach =
        |ratio, velocity| Reach::new(&question(ratio, velocity, ROLL_AND_PITCH, &flat())).unwrap();
    let up = |velocity| move |ratio| reach(ratio, velocity).extremes().upward_m_s2;
    row("upward, folded", ["0.98", "2.94", "9.81", "19.6"], |ratio| up(level)(ratio).folded);
    row("upward, level", ["1.74", "3.61", "10.27", "19.9"], |ratio| up(level)(ratio).with_wings);
    row("upward, descending", ["3.97", "5.90", "12.7", "22.4"], |ratio| {
        up(slanted)(ratio).with_wings
    });
    row("upward, vertical descent", ["5.36", "7.32", "14.2", "24.0"], |ratio| {
        up(down)(ratio).with_wings
    });
    let hull = |velocity| move |ratio| reach(ratio, velocity).volumes().hull_volume_m3_s6.ratio();
    row("hull, level", ["1.45", "1.37", "1.22", "1.14"], hull(level));
    row("hull, vertical descent", ["2.56", "2.26", "1.74", "1.46"], hull(down));
    let free = |ratio| reach(ratio, level).extremes().braking_height_free_m_s2.unwrap();
    row("braking, height free, folded", ["5.4", "6.4", "9.8", "14.7"], |ratio| free(ratio).folded);
    row("braking, height free, flat", ["6.5", "7.5", "10.9", "15.8"], |ratio| {
        free(ratio).with_wings
    });
    let held = |ratio| reach(ratio, level).extremes().braking_level_m_s2.unwrap();
    row("braking at a_z = 0, folded", ["4.49", "5.66", "5.66", "5.66"], |ratio| held(ratio).folded);
    row("braking at a_z = 0, flat", ["5.66", "5.66", "5.66", "5.66"], |ratio| {
        held(ratio).with_wings
    });
}

/// What is left of climbing and of braking is rounding there, and no measure of what wings add.
#[test]
fn where_thrust_is_just_the_weight_there_is_no_ratio() {
    for speed_m_s in [3.0, 5.0, 7.0, 9.0] {
        let question = question(1.0, [speed_m_s, 0.0, 0.0], ROLL_AND_PITCH, &flat());
        let found = Reach::new(&question).unwrap().extremes();
        let level = found.braking_level_m_s2.unwrap();
        for both in [found.upward_m_s2, level] {
            assert!(both.ratio().is_nan(), "{speed_m_s} m/s: {both:?}");
            assert!(both.with_wings > 0.01, "{speed_m_s} m/s: {both:?}");
        }
    }
}
