//! Random avoidance tasks: two seconds at a tenth, one to three trunks in the way.

use nalgebra::{Vector2, Vector3};
use squirrel_plan::trajectory::{Begin, Craft, KeepOut, RESERVE, Task, Wanted};
use squirrel_plan::wing::WingModel;
use squirrel_sim::vehicle_file::VehicleFile;

/// A small deterministic generator.
pub(crate) struct Draw(pub(crate) u64);

impl Draw {
    pub(crate) fn within(&mut self, low: f64, high: f64) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

pub(crate) fn craft(ratio: f64, wing: Option<WingModel>) -> Craft {
    let vehicle = VehicleFile::squirrel();
    Craft::of(&vehicle, ratio * vehicle.vehicle.weight_n(), wing, RESERVE).unwrap()
}

/// Straight on at a speed.
pub(crate) fn straight(craft: &Craft, speed_m_s: f64, keep_out: Vec<KeepOut>) -> Task {
    let velocity = Vector3::new(speed_m_s, 0.0, 0.0);
    let position = Vector3::new(0.0, 0.0, -30.0);
    let begin = Begin { position, velocity, thrust: -craft.hover(), spread: 0.0 };
    let wanted =
        (0..=20).map(|k| Wanted { position: position + velocity * (0.1 * f64::from(k)), velocity });
    Task::new(begin, wanted.collect(), keep_out, 0.1, f64::INFINITY).unwrap()
}

pub(crate) fn random(craft: &Craft, draw: &mut Draw) -> Task {
    let speed = draw.within(4.0, 8.0);
    let count = draw.within(1.0, 3.999) as usize;
    let keep_out = (0..count).map(|_| KeepOut {
        centre: Vector2::new(draw.within(0.9, 1.8) * speed, draw.within(-1.5, 1.5)),
        radius_m: draw.within(0.3, 0.6) + 0.49,
    });
    let keep_out = keep_out.collect();
    straight(craft, speed, keep_out)
}
