//! Random avoidance tasks: how many are solved, how much work it is, and that what is planned is a
//! motion that the vehicle can make.

use super::tasks::{Draw, craft, random};
use nalgebra::Vector3;
use squirrel_plan::trajectory::{Craft, Plan, Planner, Status, Task};
use squirrel_plan::wing::WingModel;

/// The flat plate and the drag of the shipped squirrel, written down a second time.
fn acceleration(v: Vector3<f64>, rotors: Vector3<f64>, wing: f64) -> Vector3<f64> {
    let n = -rotors / rotors.norm();
    let plate = n * (-1.225 * 0.04 * v.norm() * n.dot(&v));
    let drag = v * (-0.5 * 1.225 * 0.01 * v.norm());
    (rotors + plate * wing + drag) / 0.548 + Vector3::z() * 9.80665
}

/// What the plan's forces do, in steps of a millisecond.
fn flown(plan: &Plan, task: &Task) -> Vec<Vector3<f64>> {
    let (mut p, mut v) = (task.begin().position, task.begin().velocity);
    let mut path = vec![p];
    for step in 0..2000 {
        let point = plan.track.at(f64::from(step) * 1e-3 + 5e-4).unwrap();
        let middle = v + acceleration(v, point.thrust, point.wing) * 5e-4;
        let a = acceleration(middle, point.thrust, point.wing);
        p += v * 1e-3 + a * 5e-7;
        v += a * 1e-3;
        path.push(p);
    }
    path
}

/// Every limit of the vehicle, at the nodes and, where nodes do not speak for what is between them,
/// there.
fn check(craft: &Craft, task: &Task, plan: &Plan) {
    let points = plan.track.points();
    for pair in points.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        let u = -b.thrust;
        assert!(u.norm() <= craft.thrust_max_n + 1e-4 && u.z >= craft.thrust_min_n - 1e-4, "{u}");
        let pitch_rad = u.x.atan2(u.z);
        let roll_rad = -u.y.atan2(u.x.hypot(u.z));
        assert!(
            pitch_rad.abs() <= craft.tilt_max_rad + 1e-4
                && roll_rad.abs() <= craft.tilt_max_rad + 1e-4
        );
        let change = b.thrust - a.thrust;
        let sideways = craft.tilt_rate_max_rad_s * craft.hover().z * 0.1;
        assert!(change.x.abs() <= sideways + 1e-4 && change.y.abs() <= sideways + 1e-4, "{change}");
        assert!(
            (b.wing - a.wing).abs() <= craft.wing_rate_max_per_s * 0.1 + 1e-5
                && (0.0..=1.0).contains(&b.wing)
        );
    }
    assert_eq!(
        points[1].thrust, points[0].thrust,
        "what is commanded now acts a tenth of a second later"
    );
    let path = flown(plan, task);
    let end = points.last().unwrap().position;
    // Between nodes the wings' force is not as straight as the plan takes it to be.
    assert!((path.last().unwrap() - end).norm() < 0.1, "{} for {end}", path.last().unwrap());
    for keep in task.keep_out() {
        let near = path.iter().map(|p| (p.xy() - keep.centre).norm()).fold(f64::INFINITY, f64::min);
        assert!(near > keep.radius_m - 0.04, "{near} from the axis of {keep:?}");
    }
}

/// The middle and the largest of what plans took.
fn middle_and_most(mut counts: Vec<u32>) -> (u32, u32) {
    counts.sort_unstable();
    (counts[counts.len() / 2], counts[counts.len() - 1])
}

/// Work is counted: the same on a fast machine and on a busy one; `benches/plan.rs` has the time.
/// Measured: 6 problems and 65 to 73 iterations in the middle; at most 18 to 22 and 257 to 330 with
/// wings, 13 or 14 and 177 to 189 without.
#[test]
fn ninety_five_of_a_hundred_are_solved_within_a_bounded_number_of_iterations() {
    // Most where thrust is scarce: that is where plans are hard.
    for (ratio, tasks) in [(1.2, 200), (1.5, 60), (2.0, 60)] {
        for wing in [Some(WingModel::Flat), None] {
            let (craft, mut draw) = (craft(ratio, wing), Draw(1));
            let (mut problems, mut iterations, mut solved) = (Vec::new(), Vec::new(), 0);
            for _ in 0..tasks {
                let task = random(&craft, &mut draw);
                let plan = Planner::default().plan(&craft, &task, None);
                problems.push(plan.iterations);
                iterations.push(plan.solver_iterations);
                if plan.status == Status::Solved {
                    solved += 1;
                    check(&craft, &task, &plan);
                }
            }
            let (problems, iterations) = (middle_and_most(problems), middle_and_most(iterations));
            println!(
                "T/W {ratio}, wings {wing:?}: {solved} of {tasks} solved; {problems:?} problems, {iterations:?} iterations, middle and most"
            );
            assert!(100 * solved >= 95 * tasks, "{solved} of {tasks} at {ratio}");
            // Half as much again as was measured: room for another target's rounding, none for
            // twice the work.
            let most = if wing.is_some() { (33, 480) } else { (21, 280) };
            assert!(problems.0 <= 9 && problems.1 <= most.0, "{problems:?} problems at {ratio}");
            assert!(
                iterations.0 <= 105 && iterations.1 <= most.1,
                "{iterations:?} iterations at {ratio}"
            );
        }
    }
}
