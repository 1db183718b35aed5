//! The controllable accelerations against dense sampling, against the table of docs/equations.md F, and against what must hold.
#![allow(clippy::unwrap_used, reason = "a test may panic")]
#![allow(clippy::print_stdout, reason = "the figures that documents quote")]

use nalgebra::{Rotation3, Vector3};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;
use squirrel_core::frames::In;
use squirrel_plan::reach::{Question, Reach, Tilt, Wings};
use squirrel_plan::wing::{WingForce, WingModel};
use squirrel_sim::vehicle_file::VehicleFile;
use std::f64::consts::{PI, TAU};

const G: f64 = 9.80665;
const MASS_KG: f64 = 0.548;
const LIMIT_RAD: f64 = PI / 6.0;
const ROLL_AND_PITCH: Tilt = Tilt::Box { roll_max_rad: LIMIT_RAD, pitch_max_rad: LIMIT_RAD, yaw_rad: 0.0 };

fn flat() -> WingForce {
    WingForce::Flat { area_m2: 0.04 }
}

fn question(ratio: f64, velocity: [f64; 3], tilt: Tilt, wing: &WingForce) -> Question {
    let (thrust_max_n, velocity) = (ratio * MASS_KG * G, In::new(Vector3::from(velocity)));
    Question { mass_kg: MASS_KG, thrust_max_n, tilt, velocity, wing: wing.clone() }
}

struct Dice(Pcg64Mcg);

impl Dice {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }
    fn direction(&mut self) -> Vector3<f64> {
        let (z, turn) = (self.between(-1.0, 1.0), self.between(0.0, TAU));
        let r = (1.0 - z * z).sqrt();
        Vector3::new(r * turn.cos(), r * turn.sin(), z)
    }
    /// Any flight: up to 11 m/s in any direction, one in ten along the direction that is asked for.
    fn case(&mut self, wing: &WingForce) -> (Question, Vector3<f64>) {
        let d = self.direction();
        let along = self.between(0.0, 1.0) < 0.1;
        let v = if along { d } else { self.direction() } * self.between(0.0, 11.0);
        let tilt = if self.between(0.0, 1.0) < 0.5 {
            Tilt::Cone { max_rad: self.between(0.1, 1.2) }
        } else {
            Tilt::Box {
                roll_max_rad: self.between(0.1, 1.2),
                pitch_max_rad: self.between(0.1, 1.2),
                yaw_rad: self.between(-PI, PI),
            }
        };
        (question(self.between(1.05, 4.0), v.into(), tilt, wing), d)
    }
}

/// The same tilt sets, written another way: the attitude of a point of the unit square.
fn normal(tilt: &Tilt, [p, q]: [f64; 2]) -> Vector3<f64> {
    let (roll, pitch, yaw) = match *tilt {
        Tilt::Box { roll_max_rad, pitch_max_rad, yaw_rad } => {
            ((2.0 * p - 1.0) * roll_max_rad, (2.0 * q - 1.0) * pitch_max_rad, yaw_rad)
        }
        Tilt::Cone { max_rad } => (0.0, p * max_rad, q * TAU),
    };
    Rotation3::from_euler_angles(roll, pitch, yaw) * Vector3::z()
}

/// Best of both thrusts at an attitude, folded or spread.
fn sample(question: &Question, d: Vector3<f64>, at: [f64; 2]) -> f64 {
    let n = normal(&question.tilt, at);
    let wing = question.wing.force(question.velocity, In::new(n)).vector.dot(&d).max(0.0);
    let thrust = (-n.dot(&d) * question.thrust_max_n).max(0.0);
    G * d.z + (wing + thrust) / question.mass_kg
}

/// The largest acceleration of a dense grid, and of denser ones around its best point.
fn sampled(question: &Question, d: Vector3<f64>, cells: u32, rounds: u32) -> f64 {
    let grid = |cells: u32| (0..=cells).flat_map(move |i| (0..=cells).map(move |j| [i, j].map(f64::from)));
    let value = |at: [f64; 2]| (sample(question, d, at), at);
    let best = |places: &mut dyn Iterator<Item = [f64; 2]>| {
        places.map(value).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap()
    };
    let (mut most, mut at) = best(&mut grid(cells).map(|ij| ij.map(|k| k / f64::from(cells))));
    let mut width = 2.0 / f64::from(cells);
    for _ in 0..rounds {
        // A cone goes round: the second number may leave the square.
        let least = if matches!(question.tilt, Tilt::Cone { .. }) { -1.0 } else { 0.0 };
        let around = |ij: [f64; 2]| {
            let [p, q] = [0, 1].map(|k| at[k] + width * (ij[k] / 8.0 - 0.5));
            [p.clamp(0.0, 1.0), q.clamp(least, 1.0 - least)]
        };
        let (found, there) = best(&mut grid(8).map(around));
        if found > most {
            (most, at) = (found, there);
        }
        width *= 0.6;
    }
    most
}

/// Largest distance of found from sampled, and of the bound from found, over the larger of the value and g.
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
        assert!(dense <= support.upper_m_s2 + rounding * scale, "{case}: {dense} above {support:?}");
        assert!((support.acceleration.vector.dot(&d) - support.value_m_s2).abs() < 1e-6 * scale, "{case}");
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
    let [gap, bound] = gaps(&wing, 500, 30, 12, 2);
    assert!(gap <= 1e-3 && bound <= 1e-3, "{gap:.1e} {bound:.1e}");
}

#[test]
fn a_learned_wing_reaches_what_dense_sampling_finds() {
    let wing = WingForce::of(&VehicleFile::squirrel(), WingModel::Parnn).unwrap();
    let [gap, bound] = gaps(&wing, 500, 30, 12, 3);
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
        assert!((found - value).abs() <= allowed, "{name}, T/W {ratio}: {value} printed, {found:.4} found");
    }
}

#[test]
fn the_table_at_seven_metres_a_second_comes_out() {
    let descent = 37.0_f64.to_radians();
    let level = [7.0, 0.0, 0.0];
    let down = [0.0, 0.0, 7.0];
    let slanted = [7.0 * descent.cos(), 0.0, 7.0 * descent.sin()];
    let reach = |ratio, velocity| Reach::new(&question(ratio, velocity, ROLL_AND_PITCH, &flat())).unwrap();
    let up = |velocity| move |ratio| reach(ratio, velocity).extremes().upward_m_s2;
    row("upward, folded", ["0.98", "2.94", "9.81", "19.6"], |ratio| up(level)(ratio).folded);
    row("upward, level", ["1.74", "3.61", "10.27", "19.9"], |ratio| up(level)(ratio).with_wings);
    row("upward, descending", ["3.97", "5.90", "12.7", "22.4"], |ratio| up(slanted)(ratio).with_wings);
    row("upward, vertical descent", ["5.36", "7.32", "14.2", "24.0"], |ratio| up(down)(ratio).with_wings);
    let hull = |velocity| move |ratio| reach(ratio, velocity).volumes().hull_volume_m3_s6.ratio();
    row("hull, level", ["1.45", "1.37", "1.22", "1.14"], hull(level));
    row("hull, vertical descent", ["2.56", "2.26", "1.74", "1.46"], hull(down));
    let free = |ratio| reach(ratio, level).extremes().braking_height_free_m_s2.unwrap();
    row("braking, height free, folded", ["5.4", "6.4", "9.8", "14.7"], |ratio| free(ratio).folded);
    row("braking, height free, flat", ["6.5", "7.5", "10.9", "15.8"], |ratio| free(ratio).with_wings);
    let held = |ratio| reach(ratio, level).extremes().braking_level_m_s2.unwrap();
    row("braking at a_z = 0, folded", ["4.49", "5.66", "5.66", "5.66"], |ratio| held(ratio).folded);
    row("braking at a_z = 0, flat", ["5.66", "5.66", "5.66", "5.66"], |ratio| held(ratio).with_wings);
}

/// Questions and a direction for each model of the wings.
fn any(wing: &WingForce, count: u32, seed: u64) -> impl Iterator<Item = (Question, Vector3<f64>)> {
    let mut dice = Dice(Pcg64Mcg::seed_from_u64(seed));
    (0..count).map(move |_| dice.case(wing))
}

fn wings() -> [WingForce; 3] {
    WingModel::ALL.map(|model| WingForce::of(&VehicleFile::squirrel(), model).unwrap())
}

#[test]
fn a_support_function_is_convex_and_homogeneous() {
    for wing in wings() {
        let mut dice = Dice(Pcg64Mcg::seed_from_u64(5));
        for (question, d) in any(&wing, 20, 4) {
            let reach = Reach::new(&question).unwrap();
            let h = |d: Vector3<f64>| reach.support(In::new(d));
            for _ in 0..10 {
                let other = dice.direction() * dice.between(0.1, 3.0);
                let (value, sum) = (h(d).value_m_s2, h(d + other).value_m_s2);
                assert!(sum <= h(d).upper_m_s2 + h(other).upper_m_s2 + 1e-9, "{question:?} {d} {other}");
                assert!(
                    (h(2.5 * d).value_m_s2 - 2.5 * value).abs() < 1e-9 * value.abs().max(G),
                    "{question:?} {d}"
                );
            }
        }
    }
}

#[test]
fn folded_wings_stay_a_choice() {
    for wing in wings() {
        for (question, d) in any(&wing, 30, 6) {
            let reach = Reach::new(&question).unwrap();
            let [folded, spread, both] =
                [reach.folded(In::new(d)), reach.spread(In::new(d)), reach.support(In::new(d))];
            assert_eq!(both.value_m_s2, folded.value_m_s2.max(spread.value_m_s2));
            assert_eq!((folded.wings, spread.wings), (Wings::Folded, Wings::Spread));
            for (p, q, share) in [(0.1, 0.7, 0.2), (0.9, 0.4, 0.8), (0.5, 0.5, 0.99)] {
                let n = normal(&question.tilt, [p, q]);
                let thrust = -n * share * question.thrust_max_n;
                let wing = question.wing.force(question.velocity, In::new(n)).vector;
                for force in [thrust, thrust + wing] {
                    let a = Vector3::z() * G + force / question.mass_kg;
                    assert!(reach.contains(In::new(a)), "{question:?} {p} {q} {share}");
                    assert!(a.dot(&d) <= both.upper_m_s2 + 1e-3 * G, "{question:?} {d}");
                }
                let beyond = both.acceleration.vector + d * 0.01;
                assert!(!reach.contains(In::new(beyond)), "{question:?} {d}");
            }
        }
    }
}

#[test]
fn a_set_lies_in_its_hull_and_grows_with_wings() {
    for wing in wings() {
        for (question, _) in any(&wing, 4, 7) {
            let volumes = Reach::new(&question).unwrap().volumes();
            let [set, hull] = [volumes.set_volume_m3_s6, volumes.hull_volume_m3_s6];
            let at_most = |a: f64, b: f64| a <= 1.003 * b;
            assert!(
                at_most(set.folded, hull.folded) && at_most(set.with_wings, hull.with_wings),
                "{volumes:?}"
            );
            assert!(
                at_most(set.folded, set.with_wings) && at_most(hull.folded, hull.with_wings),
                "{volumes:?}"
            );
        }
    }
}

/// A box around the hull, and the share of random points in it that can be had.
#[test]
fn a_volume_is_what_random_points_find() {
    const POINTS: u32 = 40_000;
    let mut dice = Dice(Pcg64Mcg::seed_from_u64(8));
    for wing in &wings()[..2] {
        let question = question(1.3, [6.0, 1.0, 3.0], ROLL_AND_PITCH, wing);
        let reach = Reach::new(&question).unwrap();
        let ends = [0, 1, 2].map(|i| {
            let axis = Vector3::ith(i, 1.0);
            [-reach.support(In::new(-axis)).value_m_s2, reach.support(In::new(axis)).value_m_s2]
        });
        let point = |dice: &mut Dice| Vector3::from(ends.map(|[low, high]| dice.between(low, high)));
        let inside = (0..POINTS).filter(|_| reach.contains(In::new(point(&mut dice)))).count();
        let size: f64 = ends.iter().map(|[low, high]| high - low).product();
        let (volume, random) =
            (reach.volumes().set_volume_m3_s6.with_wings, size * inside as f64 / f64::from(POINTS));
        println!("{volume:.1} (m/s^2)^3, {random:.1} by random points");
        assert!((volume / random - 1.0).abs() < 0.03, "{volume} for {random}");
    }
}

#[test]
fn a_cone_does_not_care_for_the_heading() {
    for wing in wings() {
        for (question, d) in any(&wing, 40, 9).filter(|(q, _)| matches!(q.tilt, Tilt::Cone { .. })) {
            let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), 2.2);
            let turned = Question { velocity: In::new(turn * question.velocity.vector), ..question.clone() };
            let [there, here] = [&turned, &question].map(|question| Reach::new(question).unwrap());
            let [a, b] = [there.support(In::new(turn * d)), here.support(In::new(d))];
            assert!((a.value_m_s2 - b.value_m_s2).abs() < 1e-4 * G, "{question:?} {d}: {a:?} {b:?}");
        }
    }
}

#[test]
fn what_cannot_be_asked_is_named() {
    let good = question(1.3, [7.0, 0.0, 0.0], ROLL_AND_PITCH, &flat());
    let cone = |max_rad| Tilt::Cone { max_rad };
    let cases = [
        (Question { mass_kg: 0.0, ..good.clone() }, "mass_kg = 0"),
        (Question { thrust_max_n: f64::NAN, ..good.clone() }, "thrust_max_n = NaN"),
        (
            Question { velocity: In::new(Vector3::new(1.0, f64::NAN, 0.0)), ..good.clone() },
            "velocity_ned_m_s = NaN",
        ),
        (Question { tilt: cone(2.0), ..good.clone() }, "tilt.max_rad = 2"),
        (Question { tilt: cone(f64::NAN), ..good.clone() }, "tilt.max_rad = NaN"),
        (Question { wing: WingForce::Flat { area_m2: -1.0 }, ..good.clone() }, "wing.area_m2 = -1"),
    ];
    for (question, line) in cases {
        assert!(Reach::new(&question).unwrap_err().starts_with(line), "{line}");
    }
    let still = Reach::new(&Question { velocity: In::zero(), ..good }).unwrap();
    let extremes = still.extremes();
    assert_eq!(extremes.upward_m_s2.ratio(), 1.0);
    assert!(extremes.braking_level_m_s2.is_none() && still.support(In::zero()).value_m_s2 == 0.0);
}
