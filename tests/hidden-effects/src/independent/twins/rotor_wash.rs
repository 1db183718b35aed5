//! The rotors' jets blow on the spread wings below them.
//!
//! Momentum theory (Glauert) has the induced speed `v` of each disc from its thrust,
//! `T = 2 rho A v sqrt(V_a^2 + (V_c + v)^2)`, with the airspeed across the disc `V_a` and the climb
//! `V_c`, which in a descent is not taken below `-v_h`, where the theory ends. Below a disc the jet
//! speeds up as below a disc of sinks: `v (1 + s / sqrt(1 + s^2))` at `s` radii, and by continuity is
//! as much narrower. On its way the air across carries it back.
//!
//! Where a jet covers a wing, that part feels a stalled plate's force in the jet instead of the flat
//! plate's in the undisturbed air; all of that times the gain. The plate is Hoerner's,
//! `C_N = 1.17 sin a / (0.56 + 0.44 |sin a|)`. Form `of_thrust`: a part of the thrust pushes down on
//! open wings, [`OF_THRUST`] of it times the gain.

use super::{Jet, Sight};
use crate::airframe::AIR_DENSITY_KG_M3;
use crate::catalogue::{Entry, HiddenEffect, Kind, entry, signed};
use nalgebra::{Vector2, Vector3};

pub(crate) const ENTRY: Entry =
    entry("rotor_wash", Kind::Wing, &["of_thrust"], &[signed("gain", 0.2, 1.5)])
        .flown_by(acts, &[2]);

/// Part of the thrust that a gain of 1 is in the form `of_thrust`.
pub(crate) const OF_THRUST: f64 = 0.2;

fn acts(effect: &HiddenEffect, at: &Sight) -> [Vector3<f64>; 2] {
    let gain = effect.number("gain");
    let open = at.wings.deployment;
    if effect.form == "of_thrust" {
        let thrust: f64 = at.rotors.all().iter().map(|rotor| rotor.thrust_n).sum();
        let pushed = OF_THRUST * gain * thrust * open.mean();
        return [Vector3::new(0.0, 0.0, pushed), Vector3::zeros()];
    }
    let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
    if open.max() <= 0.0 {
        return [force, moment];
    }
    for rotor in at.rotors.all() {
        let hit = Slipstream::of(rotor, at);
        for (side, open) in [(-1.0, open.x), (1.0, open.y)] {
            let (area_m2, middle) = hit.on_wing(side, at);
            if area_m2 <= 0.0 {
                continue;
            }
            // The flat plate goes down where the vehicle rolls to its side; what the roll does to a
            // jet, and to the plate in it, nobody states.
            let roll = side * at.wings.lateral_arm_m * at.omega.x;
            let own = at.air_body + Vector3::new(0.0, 0.0, roll);
            let blown = at.air_body - Vector3::new(0.0, 0.0, hit.speed_m_s);
            let change = stalled_plate(blown) - at.wings.slope * own.norm() * own.z;
            let pushed = -0.5 * AIR_DENSITY_KG_M3 * area_m2 * open * gain * change;
            force.z += pushed;
            moment += Vector3::new(middle.y, -middle.x, 0.0) * pushed;
        }
    }
    [force, moment]
}

/// `C_N V^2` of a plate that moves so through the air, m^2/s^2.
fn stalled_plate(velocity: Vector3<f64>) -> f64 {
    let square = velocity.norm_squared();
    if square == 0.0 {
        return 0.0;
    }
    let sine = velocity.z / square.sqrt();
    1.17 * sine / (0.56 + 0.44 * sine.abs()) * square
}

/// Induced speed at a disc, m/s.
///
/// * `hover_m_s` - that of the same thrust in still air
fn induced_m_s(hover_m_s: f64, across_m_s: f64, climb_m_s: f64) -> f64 {
    // What is left of the thrust grows with the speed from where it is negative: one root, between
    // nothing and what is enough without any flow across.
    let left = |v: f64| v * across_m_s.hypot(climb_m_s + v) - hover_m_s * hover_m_s;
    let (mut low, mut high) = (0.0, hover_m_s + climb_m_s.abs());
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if left(middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// A jet where it meets the wings.
#[derive(Debug, Clone, Copy)]
struct Slipstream {
    middle: Vector2<f64>,
    radius_m: f64,
    /// Induced, downwards through the vehicle.
    speed_m_s: f64,
}

impl Slipstream {
    fn of(rotor: &Jet, at: &Sight) -> Self {
        let disc_m2 = at.disc_m2();
        let hover = (rotor.thrust_n.max(0.0) / (2.0 * AIR_DENSITY_KG_M3 * disc_m2)).sqrt();
        let across = at.air_body.xy();
        let climb = (-at.air_body.z).max(-hover);
        let induced = induced_m_s(hover, across.norm(), climb);
        let below_m = at.wings.vertical_arm_m - rotor.position.z;
        let depth = below_m / at.propeller_radius_m;
        let speed_m_s = induced * (1.0 + depth / depth.hypot(1.0));
        let (first, last) = (climb + induced, climb + speed_m_s);
        if !(first > 0.0 && last > 0.0) {
            return Self { middle: rotor.position.xy(), radius_m: 0.0, speed_m_s: 0.0 };
        }
        let way_s = below_m / (0.5 * (first + last));
        Self {
            middle: rotor.position.xy() - way_s * across,
            radius_m: at.propeller_radius_m * (first / last).sqrt(),
            speed_m_s,
        }
    }

    /// Area that it covers of the wing on a side, and the middle of that.
    fn on_wing(&self, side: f64, at: &Sight) -> (f64, Vector2<f64>) {
        let wings = &at.wings;
        let half = 0.5 * Vector2::new(wings.chord_m, wings.area_m2 / wings.chord_m);
        let to = Vector2::new(wings.longitudinal_arm_m, side * wings.lateral_arm_m) - self.middle;
        let r = self.radius_m;
        let angle = |x: f64| (x / r).clamp(-1.0, 1.0).asin();
        let (begin, end) = (angle(to.x - half.x), angle(to.x + half.x));
        if !(r > 0.0 && end > begin) {
            return (0.0, Vector2::zeros());
        }
        // Strips across the flight, narrow where the circle is steep.
        let step = (end - begin) / STRIPS as f64;
        let (mut area, mut first) = (0.0, Vector2::zeros());
        for strip in 0..STRIPS {
            let (sine, cosine) = (begin + (strip as f64 + 0.5) * step).sin_cos();
            let low = (-r * cosine).max(to.y - half.y);
            let high = (r * cosine).min(to.y + half.y);
            let part = (high - low).max(0.0) * r * cosine * step;
            area += part;
            first += part * Vector2::new(r * sine, 0.5 * (low + high));
        }
        if area <= 0.0 { (0.0, Vector2::zeros()) } else { (area, self.middle + first / area) }
    }
}

const STRIPS: usize = 24;

#[cfg(test)]
mod tests {
    use super::super::{Rotors, Wings};
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn at(velocity: Vector3<f64>, position: Vector3<f64>, vertical_arm_m: f64) -> Sight {
        let mut rotors = Rotors::default();
        rotors.push(Jet { position, thrust_n: 1.35 });
        Sight {
            air_body: velocity,
            omega: Vector3::zeros(),
            rotors,
            thrust_wrench: [Vector3::zeros(); 2],
            weight_n: 5.4,
            propeller_radius_m: 0.064,
            wings: Wings {
                area_m2: 0.03,
                slope: 1.6,
                lateral_arm_m: 0.12,
                longitudinal_arm_m: 0.0,
                vertical_arm_m,
                chord_m: 0.24,
                deployment: Vector2::repeat(1.0),
                force_z_n: 0.0,
            },
        }
    }

    fn wash(at: &Sight) -> [Vector3<f64>; 2] {
        let parameters = [("gain".to_owned(), crate::catalogue::Value::Number(1.0))].into();
        let effect =
            HiddenEffect { name: "rotor_wash".to_owned(), form: "standard".to_owned(), parameters };
        acts(&effect, at)
    }

    /// Hover: `v = v_h`. Climb: `v = -V_c / 2 + sqrt(V_c^2 / 4 + v_h^2)`. Fast: `v = v_h^2 / V_a`.
    #[test]
    fn induced_speed_is_that_of_the_textbook() {
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-9, "{a} for {b}");
        near(induced_m_s(6.0, 0.0, 0.0), 6.0);
        near(induced_m_s(6.0, 0.0, 3.0), -1.5 + (2.25_f64 + 36.0).sqrt());
        near(induced_m_s(6.0, 0.0, -6.0), 3.0 + 45.0_f64.sqrt());
        assert!((induced_m_s(6.0, 60.0, 0.0) - 0.6).abs() < 1e-3);
        assert!(induced_m_s(0.0, 5.0, 1.0) < 1e-15);
    }

    /// A jet that hits the wing as a whole pushes as a plate across it: `1/2 rho A v^2 1.17`.
    #[test]
    fn a_jet_pushes_down_where_it_hits() {
        let expected = 1.17 * 0.25 * 1.35;
        let [force, moment] = wash(&at(Vector3::zeros(), Vector3::new(0.03, 0.12, 0.0), 0.0));
        // The wing's span is 0.125 m, a little less than the jet's 0.128 m.
        assert!((force.z / expected - 1.0).abs() < 0.01, "{force} for {expected}");
        assert!((moment - force.z * Vector3::new(0.12, -0.03, 0.0)).norm() < 2e-3, "{moment}");
        let [none, _] = wash(&at(Vector3::zeros(), Vector3::new(0.03, 0.3, 0.0), 0.0));
        assert_eq!(none, Vector3::zeros());
        // Far below the disc the jet is twice as fast and half as wide in area.
        let [far, _] = wash(&at(Vector3::zeros(), Vector3::new(0.0, 0.12, 0.0), 0.6));
        assert!((far.z / expected / 2.0 - 1.0).abs() < 0.02, "{far}");
    }

    #[test]
    fn half_a_disc_over_an_edge_is_half_its_area() {
        let sight = at(Vector3::zeros(), Vector3::zeros(), 0.0);
        let jet = Slipstream { middle: Vector2::new(0.12, 0.12), radius_m: 0.05, speed_m_s: 6.0 };
        let (area, middle) = jet.on_wing(1.0, &sight);
        let half = FRAC_PI_2 * 0.05 * 0.05;
        assert!((area / half - 1.0).abs() < 2e-3, "{area} for {half}");
        assert!((middle.x - (0.12 - 4.0 * 0.05 / (3.0 * PI))).abs() < 1e-4, "{middle}");
    }

    #[test]
    fn wind_across_carries_the_jet_back() {
        let [_, ahead] = wash(&at(Vector3::zeros(), Vector3::new(0.0, 0.12, 0.0), 0.06));
        let [_, blown] = wash(&at(Vector3::new(5.0, 0.0, 0.0), Vector3::new(0.0, 0.12, 0.0), 0.06));
        assert!(blown.y > ahead.y + 1e-3, "{blown} after {ahead}: pushed down behind, nose up");
    }
}
