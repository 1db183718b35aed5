//! What must hold of controllable accelerations, whatever the wings are.
#![allow(clippy::print_stdout, reason = "the figures that documents quote")]

use super::support::{Dice, G, ROLL_AND_PITCH, any, flat, normal, question, wings};
use nalgebra::{Rotation3, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use squirrel_core::frames::In;
use squirrel_plan::reach::{Question, Reach, Tilt, Wings};
use squirrel_plan::wing::WingForce;

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
                assert!(
                    sum <= h(d).upper_m_s2 + h(other).upper_m_s2 + 1e-9,
                    "{question:?} {d} {other}"
                );
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

/// Braking with height held, of a dense grid over the attitudes whose thrust holds it.
#[test]
fn braking_at_constant_height_is_what_a_grid_finds() {
    const CELLS: u32 = 150;
    for wing in wings() {
        for (question, _) in any(&wing, 5, 10) {
            let Some(level) = Reach::new(&question).unwrap().extremes().braking_level_m_s2 else {
                continue;
            };
            let v = question.velocity.vector;
            let back = -Vector3::new(v.x, v.y, 0.0) / v.x.hypot(v.y);
            let at = |p: u32, q: u32| {
                let n = normal(&question.tilt, [p, q].map(|k| f64::from(k) / f64::from(CELLS)));
                let spread = question.wing.force(question.velocity, In::new(n)).vector;
                let braking = [Vector3::zeros(), spread].into_iter().filter_map(|wing| {
                    let thrust = (question.mass_kg * G + wing.z) / n.z;
                    let holds = (0.0..=question.thrust_max_n).contains(&thrust);
                    holds.then(|| (wing - n * thrust).dot(&back) / question.mass_kg)
                });
                braking.fold(f64::NEG_INFINITY, f64::max)
            };
            let grid = (0..=CELLS).flat_map(|p| (0..=CELLS).map(move |q| at(p, q)));
            let most = grid.fold(f64::NEG_INFINITY, f64::max);
            println!("{:.4} m/s^2, {most:.4} on a grid", level.with_wings);
            // A grid stops short of where thrust ends.
            assert!(
                (-1e-3..1e-2).contains(&(level.with_wings - most)),
                "{question:?}: {level:?} {most}"
            );
        }
    }
}

/// A box around the hull, and the share of random points in it that can be had.
#[test]
fn a_volume_is_what_random_points_find() {
    const POINTS: u32 = 60_000;
    let mut dice = Dice(Pcg64Mcg::seed_from_u64(8));
    // The second has the motion just inside the limit: there wings stall over a few attitudes.
    let cases = [
        (1.3, [6.0, 1.0, 3.0], ROLL_AND_PITCH),
        (3.5, [-0.3, 1.2, 2.1], Tilt::Cone { max_rad: 0.54 }),
    ];
    for (wing, (ratio, velocity, tilt)) in
        wings()[..2].iter().flat_map(|wing| cases.map(|case| (wing, case)))
    {
        let question = question(ratio, velocity, tilt, wing);
        let reach = Reach::new(&question).unwrap();
        let ends = [0, 1, 2].map(|i| {
            let axis = Vector3::ith(i, 1.0);
            [-reach.support(In::new(-axis)).value_m_s2, reach.support(In::new(axis)).value_m_s2]
        });
        let point =
            |dice: &mut Dice| Vector3::from(ends.map(|[low, high]| dice.between(low, high)));
        let inside = (0..POINTS).filter(|_| reach.contains(In::new(point(&mut dice)))).count();
        let size: f64 = ends.iter().map(|[low, high]| high - low).product();
        let (volume, random) =
            (reach.volumes().set_volume_m3_s6.with_wings, size * inside as f64 / f64::from(POINTS));
        println!("{volume:.1} (m/s^2)^3, {random:.1} by random points");
        assert!((volume / random - 1.0).abs() < 0.02, "{volume} for {random}");
    }
}

#[test]
fn a_cone_does_not_care_for_the_heading() {
    for wing in wings() {
        for (question, d) in any(&wing, 40, 9).filter(|(q, _)| matches!(q.tilt, Tilt::Cone { .. }))
        {
            let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), 2.2);
            let turned =
                Question { velocity: In::new(turn * question.velocity.vector), ..question.clone() };
            let [there, here] = [&turned, &question].map(|question| Reach::new(question).unwrap());
            let [a, b] = [there.support(In::new(turn * d)), here.support(In::new(d))];
            assert!(
                (a.value_m_s2 - b.value_m_s2).abs() < 1e-4 * G,
                "{question:?} {d}: {a:?} {b:?}"
            );
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
        assert!(Reach::new(&question).unwrap_err().to_string().starts_with(line), "{line}");
    }
    let still = Reach::new(&Question { velocity: In::zero(), ..good }).unwrap();
    let extremes = still.extremes();
    assert_eq!(extremes.upward_m_s2.ratio(), 1.0);
    assert!(extremes.braking_level_m_s2.is_none() && still.support(In::zero()).value_m_s2 == 0.0);
}
