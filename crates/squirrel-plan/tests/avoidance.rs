//! Random avoidance tasks: 2 s at 0.1 s, one to three cylinders in the way.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use nalgebra::{Vector2, Vector3};
use squirrel_plan::trajectory::{Begin, Craft, KeepOut, Planner, RESERVE, Status, Task, Wanted};
use squirrel_plan::wing::WingModel;
use squirrel_sim::vehicle_file::VehicleFile;
use std::time::Instant;

struct Draw(u64);
impl Draw {
    fn within(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn task(craft: &Craft, draw: &mut Draw) -> Task {
    let speed = draw.within(4.0, 8.0);
    let velocity = Vector3::new(speed, 0.0, 0.0);
    let position = Vector3::new(0.0, 0.0, -30.0);
    let begin = Begin { position, velocity, thrust: -craft.hover(), spread: 0.0 };
    let wanted =
        (0..=20).map(|k| Wanted { position: position + velocity * (0.1 * f64::from(k)), velocity }).collect();
    let count = draw.within(1.0, 3.999) as usize;
    let keep_out = (0..count)
        .map(|_| KeepOut {
            centre: Vector2::new(draw.within(0.9, 1.8) * speed, draw.within(-1.5, 1.5)),
            radius_m: draw.within(0.3, 0.6) + 0.19 + 0.3,
        })
        .collect();
    Task::new(begin, wanted, keep_out, 0.1, f64::INFINITY).unwrap()
}

#[test]
fn most_tasks_are_solved_in_time() {
    let vehicle = VehicleFile::squirrel();
    for ratio in [1.2, 1.5, 2.0] {
        for wing in [None, Some(WingModel::Flat), Some(WingModel::Membrane)] {
            let craft = Craft::of(&vehicle, ratio * vehicle.vehicle.weight_n(), wing, RESERVE).unwrap();
            let mut draw = Draw(1);
            let mut times = Vec::new();
            let (mut solved, mut feasible, mut iterations, mut cost) = (0, 0, 0, 0.0);
            for _ in 0..200 {
                let task = task(&craft, &mut draw);
                let start = Instant::now();
                let plan = Planner::default().plan(&craft, &task, None);
                times.push(start.elapsed().as_secs_f64() * 1e3);
                solved += usize::from(plan.status == Status::Solved);
                feasible += usize::from(plan.status == Status::Feasible);
                iterations += plan.iterations;
                cost += plan.cost;
            }
            times.sort_by(f64::total_cmp);
            println!(
                "T/W {ratio} {wing:?}: solved {solved}, feasible {feasible}, median {:.1} ms, p90 {:.1}, max {:.1}, {:.1} iterations, cost {:.3}",
                times[100],
                times[180],
                times[199],
                f64::from(iterations) / 200.0,
                cost / 200.0
            );
        }
    }
}
