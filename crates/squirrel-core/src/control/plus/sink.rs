//! A sink that thrust cannot end as fast as the reference does: flown as fast as it can, and late.

use super::super::Reference;
use super::super::position::MeasuredMotion;
use super::super::twcc::OuterAirframe;
use super::Plus;
use crate::math::{GRAVITY_M_S2, lower, sqrt, upper};

/// Acceleration to spare that is believed at least, m/s^2: a sink that hardly can be ended is flown
/// slowly and not never.
const SPARE_MIN_M_S2: f32 = 0.2;

impl Plus {
    /// What to follow instead of a reference whose sink is faster than thrust can end it where it
    /// comes to rest, with [`Self::approach_share`] of what rotors have to spare. `None` where it
    /// can be flown. The way down takes longer then, and goes no deeper (docs/equations.md E.10).
    ///
    /// * `rest_down_m` - where the reference comes to rest
    /// * `excited_n` - what an excitation takes of the thrust, N
    pub(crate) fn ending_sink(
        &self,
        airframe: &OuterAirframe,
        motion: &MeasuredMotion,
        reference: &Reference,
        rest_down_m: f32,
        excited_n: f32,
    ) -> Option<Reference> {
        let down_m = motion.position.vector.z;
        let error_m = reference.position.vector.z - down_m;
        if reference.position.vector.z > rest_down_m {
            return None;
        }
        let most_n = airframe.envelope.thrust_max_n - motion.residual.short_n - excited_n;
        let spare = most_n / airframe.mass_kg - GRAVITY_M_S2 as f32;
        let brake = self.approach_share * upper(spare, SPARE_MIN_M_S2);
        let (per_s, ahead_m_s) = (self.position.position_per_s.z, reference.velocity.vector.z);
        let fastest = lower(
            stopping(error_m, brake, per_s) + ahead_m_s,
            sqrt(2.0 * brake * upper(rest_down_m - down_m, 0.0)),
        );
        (per_s * error_m + ahead_m_s > fastest).then(|| {
            let mut ending = *reference;
            ending.position.vector.z = lower(down_m, rest_down_m);
            ending.velocity.vector.z = fastest;
            ending.acceleration.vector.z = lower(reference.acceleration.vector.z, -brake);
            ending
        })
    }
}

/// Speed towards a place at rest that is left by this deceleration when it is reached, with a
/// proportional law's lag nearby: in one direction what
/// [`approach_max_m_s2`](super::PositionGains::approach_max_m_s2) is across.
fn stopping(error_m: f32, brake_m_s2: f32, per_s: f32) -> f32 {
    let near_m = brake_m_s2 / (per_s * per_s);
    if error_m > near_m { sqrt(brake_m_s2 * (2.0 * error_m - near_m)) } else { per_s * error_m }
}

#[cfg(test)]
mod tests {
    use super::super::super::position::fixtures::{at, still};
    use super::super::super::twcc::fixtures::airframe;
    use super::super::tests::plus;
    use super::*;
    use crate::frames::In;
    use crate::guidance::excite::{Leg, Multisine, Programme};
    use crate::guidance::mission::{Mission, MissionState};
    use nalgebra::Vector3;

    /// 9.3 m down in 4 s, with 3.1 m/s^2 at both ends.
    fn descent() -> Mission {
        let leg = Leg {
            duration_s: 12.0,
            move_s: 4.0,
            ramp_s: 1.0,
            to: In::new(Vector3::new(0.0, 0.0, -1.5)),
            ..Leg::UNUSED
        };
        let still = Multisine::new([0.0; 3], 0.0, 0).unwrap();
        let start = In::new(Vector3::new(0.0, 0.0, -10.8));
        Mission::Excite(Programme::new(start, &[leg], still).unwrap())
    }

    /// Deepest and last height, m down, of a mass that follows a tenth of a second late with no
    /// more lift than it has, and whether anything else than the mission was followed.
    fn flown(lift_to_weight: f32, ends: bool) -> (f32, f32, bool) {
        let (plus, mission, mut airframe) = (plus(), descent(), airframe());
        airframe.envelope.thrust_max_n = lift_to_weight * airframe.mass_kg * GRAVITY_M_S2 as f32;
        let (mut motion, mut governed) = (still(), false);
        motion.position.vector.z = -10.8;
        let (mut deepest, mut command) = (-10.8_f32, 0.0_f32);
        for tick in 0..120u64 {
            let reference = mission.reference(&MissionState::default(), tick * 100_000);
            let rest = mission.rest_down_m(tick * 100_000).unwrap();
            let ending =
                plus.ending_sink(&airframe, &motion, &reference, rest, 0.0).filter(|_| ends);
            governed |= ending.is_some();
            let goal = ending.unwrap_or(reference);
            let (z, v) = (motion.position.vector.z, motion.velocity.vector.z);
            let wanted = 0.8 * (goal.position.vector.z - z) + goal.velocity.vector.z - v;
            let late = command;
            command = 1.6 * wanted + goal.acceleration.vector.z;
            let a = upper(late, -(lift_to_weight - 1.0) * GRAVITY_M_S2 as f32);
            motion.position.vector.z += 0.1 * (v + 0.05 * a);
            motion.velocity.vector.z += 0.1 * a;
            deepest = upper(deepest, motion.position.vector.z);
        }
        (deepest, motion.position.vector.z, governed)
    }

    /// As scarce as thrust is, the way down ends where it should, and takes longer.
    #[test]
    fn a_sink_goes_no_deeper_than_the_reference_rests() {
        for ratio in [1.1, 1.15, 1.25] {
            let (deepest, last, governed) = flown(ratio, true);
            let (through, ..) = flown(ratio, false);
            assert!(governed && deepest < -1.2, "{ratio}: {deepest}");
            assert!(through > -0.9, "{ratio}: without it {through}");
            assert!(ratio < 1.2 || last > -1.7, "{ratio}: it arrives, {last}");
        }
    }

    /// With thrust enough, and on the way up, the reference is followed as it is.
    #[test]
    fn what_can_be_flown_is_left_alone() {
        let (mission, mut airframe, mut motion) = (descent(), airframe(), still());
        airframe.envelope.thrust_max_n = 2.0 * airframe.mass_kg * GRAVITY_M_S2 as f32;
        for tick in 0..120u64 {
            let reference = mission.reference(&MissionState::default(), tick * 100_000);
            let rest = mission.rest_down_m(tick * 100_000).unwrap();
            motion.position = reference.position;
            let ending = plus().ending_sink(&airframe, &motion, &reference, rest, 0.0);
            assert_eq!(ending, None, "{tick}");
        }
        let climbing = at(0.0, 0.0, -1.0);
        assert_eq!(plus().ending_sink(&airframe, &still(), &climbing, -5.0, 0.0), None);
    }

    /// Near by it is the proportional law, far away a constant deceleration, and smooth between.
    #[test]
    fn the_speed_that_stops_joins_the_proportional_one() {
        let near_m = 2.0 / 0.64;
        assert_eq!(stopping(1.0, 2.0, 0.8), 0.8);
        assert!((stopping(near_m + 1e-3, 2.0, 0.8) - 0.8 * near_m).abs() < 2e-3);
        let slope = (stopping(10.01, 2.0, 0.8) - stopping(9.99, 2.0, 0.8)) / 0.02;
        assert!((slope * stopping(10.0, 2.0, 0.8) - 2.0).abs() < 0.01, "v dv/ds = a");
    }
}
