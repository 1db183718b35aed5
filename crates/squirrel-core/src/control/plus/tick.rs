//! One tick: foresee, ask for an acceleration, choose, decide about the wings.

use super::super::position::{MeasuredMotion, PositionGains, heading_frame};
use super::super::twcc::{
    Mode, OuterAirframe, Reason, TwccParameters, TwccState, TwccTerms, WingPolicy,
};
use super::super::woeg::WingFlag;
use super::super::{AttitudeThrust, Reference};
use super::choice::{Believed, Demand, between, saved};
use super::lean::Lean;
use super::{HARM_SHARE, Plus};
use crate::aero::angle_of_attack;
use crate::frames::{Body, In, Ned, Rotation};
use crate::math::GRAVITY_M_S2;
use nalgebra::Vector3;

impl TwccParameters {
    /// One tick.
    // Apart, so that what it needs of the stack is not laid out in every step.
    #[inline(never)]
    #[allow(clippy::too_many_arguments, reason = "those of the tick that it is")]
    pub(in super::super) fn update_plus(
        &self,
        plus: &Plus,
        state: &mut TwccState,
        airframe: &OuterAirframe,
        motion: &MeasuredMotion,
        ned_from_body: &Rotation<Ned, Body, f32>,
        reference: &Reference,
        dt_s: f32,
    ) -> TwccTerms {
        let heading = |v: &Vector3<f32>| {
            let forward_right = heading_frame(v, motion.heading_rad);
            Vector3::new(forward_right.x, forward_right.y, v.z)
        };
        // Until what is commanded now acts, the last command does.
        let now = AttitudeThrust {
            roll_rad: motion.roll_rad,
            pitch_rad: motion.pitch_rad,
            thrust_n: 0.0,
        };
        let through_air = |velocity: In<Ned, f32>| heading(&(velocity - motion.wind).vector);
        let believed = Believed {
            airframe,
            velocity: through_air(motion.velocity),
            residual: plus.believes(&motion.residual, heading),
        };
        let (mut ahead, mut goal) = (*motion, *reference);
        if let Some(last) = state.last {
            let wings = f32::from(state.mode != Mode::Primary);
            let meanwhile = between(&now, &last, 0.5);
            let a = believed.acceleration(&meanwhile, wings);
            let back = heading_frame(&a, -motion.heading_rad);
            let change = Vector3::new(back.x, back.y, a.z) * plus.delay_s;
            ahead.position.vector += (motion.velocity.vector + change * 0.5) * plus.delay_s;
            ahead.velocity.vector += change;
            goal.position.vector += (reference.velocity.vector
                + reference.acceleration.vector * (0.5 * plus.delay_s))
                * plus.delay_s;
            goal.velocity.vector += reference.acceleration.vector * plus.delay_s;
        }
        let gains = PositionGains {
            approach_max_m_s2: plus.approach_m_s2(&believed, reference),
            ..plus.position
        };
        let position =
            gains.update(&mut state.position, airframe.mass_kg, &ahead, &goal, state.clamped, dt_s);
        let request = &position.request;
        let demand = Demand {
            believed: Believed { velocity: through_air(ahead.velocity), ..believed },
            acceleration: heading(&position.acceleration.vector),
            weight: plus.weight(
                &believed,
                ahead.position.vector.z - goal.position.vector.z,
                ahead.velocity.vector.z - goal.velocity.vector.z,
            ),
            lean: Lean::of(plus.tilt_limit, airframe),
        };
        let folded = demand.best(request, 0.0);
        let (mut best, mut reason, mut helpful_n) = (folded, Reason::PolicyFixed, 0.0);
        if self.policy == WingPolicy::Coordinated {
            let spread = demand.best(request, 1.0);
            let saved = saved(&folded, &spread);
            helpful_n = airframe.mass_kg * saved;
            let pushed_n = HARM_SHARE * airframe.mass_kg * GRAVITY_M_S2 as f32;
            let harm = motion.residual.wings_n > pushed_n;
            let keep = state.mode != Mode::Primary && !harm;
            let open = saved > if keep { 0.0 } else { plus.open_above_m_s2 };
            let wanted = if open { Mode::WingsOpen } else { Mode::Primary };
            state.mode_age_s = state.mode_age_s.map(|age| age + dt_s);
            reason = if open { Reason::WingsComeCloser } else { Reason::InsideLimits };
            if wanted != state.mode {
                // Those that harm cost height in every tenth of a second.
                if !harm && state.mode_age_s.is_some_and(|age| age < self.dwell_s) {
                    reason = Reason::Dwell;
                } else {
                    state.mode = wanted;
                    state.mode_age_s = Some(0.0);
                }
            }
            if state.mode != Mode::Primary {
                best = spread;
            }
        }
        let wing_command = f32::from(state.mode != Mode::Primary);
        let meanwhile = between(&now, &best.command, plus.thrust_share(airframe));
        let AttitudeThrust { thrust_n, .. } =
            demand.at(meanwhile.roll_rad, meanwhile.pitch_rad, wing_command).command;
        let command = AttitudeThrust { thrust_n, ..best.command };
        state.last = Some(command);
        // A residual of this size is what a search of so many rounds leaves.
        let clamped = best.cost > 0.01 || position.acceleration != position.acceleration_demand;
        state.clamped = clamped;
        let force = demand.believed.wing_force(&best.command);
        let back = heading_frame(&force, -motion.heading_rad);
        let wing_force = In::new(Vector3::new(back.x, back.y, force.z));
        state.flag = state.mode != Mode::Primary;
        TwccTerms {
            position,
            wing_force,
            parnn: None,
            angle_of_attack_rad: angle_of_attack(ned_from_body.inverse() * motion.velocity),
            wing: WingFlag { helpful_n, flag: state.flag },
            mode: state.mode,
            reason,
            command,
            wing_command,
            clamped,
        }
    }
}
