//! What the air would do to the wings if they were spread: the force behind WOEG's flag and WIIC's
//! law.
//!
//! Every model sees the velocity over ground in the body frame, because there is no airspeed sensor
//! (docs/equations.md T6), and speaks whether the wings are spread or not. The network saw speeds
//! and angles of attack up to some size in training, always ten rows a tenth of a second apart;
//! asked about anything else it would guess. Then the flat plate, which needs no training, stands
//! in, and [`Guard`] says why.

use crate::aero::flat_plate;
use crate::frames::{Body, In, Ned, Rotation};
use crate::rnn::parnn::{
    Domain, Estimate, History, INPUTS, Parnn, SPEED_SCALE_M_S, STEP_S, features,
};
use nalgebra::Vector3;

/// Where the estimate of the wing force comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "no allocation in flight code; there is one of these in a stack"
)]
pub enum ForceModel {
    /// The paper's flat plate.
    FlatPlate,
    /// Given from outside: what the simulator's wing would do.
    Given,
    /// The paper's network on top of the flat plate; the flat plate alone where [`Guard`] says so.
    Parnn(Parnn),
}

/// Whether the network's estimate may be used, and why not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Guard {
    /// All of the window is inside what was trained: the network's estimate is used.
    Inside = 0,
    /// There are not ten rows yet since the start, or since a tick of the outer loop was missed.
    #[default]
    WindowNotFull = 1,
    /// A speed in the window is outside what was trained.
    Speed = 2,
    /// An angle of attack in the window is outside what was trained.
    AngleOfAttack = 3,
}

/// Every term of one estimate by the network.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParnnTerms {
    /// Whether `estimate` is used.
    pub guard: Guard,
    /// What the network says, also outside of what was trained; `None` before the window is full.
    pub estimate: Option<Estimate>,
}

/// Whether the network was trained on windows like this one.
fn guard(domain: &Domain, window: &[[f32; INPUTS]]) -> Guard {
    // A comparison with NaN is false: what is not a number is outside.
    let within = |x: f32, [low, high]: [f32; 2]| (low..=high).contains(&x);
    if !window.iter().all(|row| within(row[0] * SPEED_SCALE_M_S, domain.speed_m_s)) {
        Guard::Speed
    } else if !window.iter().all(|row| within(row[1], domain.alpha_rad)) {
        Guard::AngleOfAttack
    } else {
        Guard::Inside
    }
}

impl ForceModel {
    /// Force of the air on the wings as if they were spread, N, and the terms behind it where the
    /// network was asked.
    ///
    /// * `history` - what the network saw before; moves on by one row
    /// * `velocity_body` - over ground, m/s
    /// * `given` - for [`ForceModel::Given`]; the flat plate stands in while there is none
    /// * `area_m2` - of the flat plate
    /// * `dt_s` - time since the last estimate
    pub(super) fn estimate(
        &self,
        history: &mut History,
        ned_from_body: &Rotation<Ned, Body, f32>,
        velocity_body: In<Body, f32>,
        given: Option<In<Ned, f32>>,
        area_m2: f32,
        dt_s: f32,
    ) -> (In<Ned, f32>, Option<ParnnTerms>) {
        let plate =
            || *ned_from_body * flat_plate::force(velocity_body, In::new(Vector3::z()), area_m2);
        match self {
            Self::FlatPlate => (plate(), None),
            Self::Given => (given.unwrap_or_else(plate), None),
            Self::Parnn(parnn) => {
                let terms = ask(parnn, history, velocity_body, dt_s);
                let force = match terms {
                    ParnnTerms { guard: Guard::Inside, estimate: Some(estimate) } => {
                        *ned_from_body * estimate.force
                    }
                    _ => plate(),
                };
                (force, Some(terms))
            }
        }
    }
}

fn ask(parnn: &Parnn, history: &mut History, velocity: In<Body, f32>, dt_s: f32) -> ParnnTerms {
    // Rows of a window are equally far apart; after a missed tick, or time that stood still, they
    // would not be.
    if !((dt_s - STEP_S).abs() < 0.5 * STEP_S) {
        *history = History::new();
    }
    history.push(features(velocity));
    match history.window() {
        None => ParnnTerms { guard: Guard::WindowNotFull, estimate: None },
        Some(window) => ParnnTerms {
            guard: guard(&parnn.domain, window),
            estimate: Some(parnn.estimate(window, velocity)),
        },
    }
}

#[cfg(test)]
pub(crate) mod fixtures {
    use super::*;
    use crate::rnn::elman::Elman;

    /// A network that says `alpha_w = 0`, `gamma = 1` to the last bit.
    pub(crate) fn silent() -> Parnn {
        let mut net = Elman::filled(0.0);
        net.output.bias = [0.0, 0.541_324_85];
        let domain = Domain { speed_m_s: [0.0, 12.0], alpha_rad: [-1.5, 1.5] };
        Parnn { net, area_m2: 0.04, domain }
    }

    /// One that has much to say.
    pub(crate) fn loud() -> Parnn {
        let mut parnn = silent();
        for (k, tensor) in parnn.net.tensors_mut().into_iter().enumerate() {
            for (i, weight) in tensor.iter_mut().enumerate() {
                *weight += 0.3 * ((1 + k + 7 * i) as f32).sin();
            }
        }
        parnn
    }
}

#[cfg(test)]
mod tests {
    use super::fixtures::{loud, silent};
    use super::*;
    use crate::rnn::head::Correction;
    use crate::rnn::parnn::WINDOW;

    const NOSE_UP: [f32; 3] = [6.0, 0.5, 2.0];

    /// The estimates of a model for velocities in the body frame, one a tenth of a second.
    fn estimates(parnn: &Parnn, velocities: &[[f32; 3]]) -> Vec<(In<Ned, f32>, ParnnTerms)> {
        let mut history = History::new();
        let attitude = Rotation::from_euler(0.2, 0.4, 1.0);
        let model = ForceModel::Parnn(*parnn);
        let ask = |v: &[f32; 3]| {
            model.estimate(&mut history, &attitude, In::new(Vector3::from(*v)), None, 0.04, STEP_S)
        };
        velocities.iter().map(ask).map(|(force, terms)| (force, terms.unwrap())).collect()
    }

    fn plate(v: [f32; 3]) -> In<Ned, f32> {
        Rotation::<Ned, Body, f32>::from_euler(0.2, 0.4, 1.0)
            * flat_plate::force(In::new(Vector3::from(v)), In::new(Vector3::z()), 0.04)
    }

    #[test]
    fn the_silent_network_is_silent_to_the_last_bit() {
        let said = Correction::from_outputs(silent().net.window(&[[0.5_f32, 0.3]; WINDOW]));
        assert_eq!(said, Correction { alpha_w_rad: 0.0, gamma: 1.0 });
    }

    #[test]
    fn the_flat_plate_stands_in_while_the_window_fills() {
        let all = estimates(&loud(), &[NOSE_UP; WINDOW + 1]);
        for (k, (force, terms)) in all.iter().enumerate() {
            if k + 1 < WINDOW {
                assert_eq!(
                    *terms,
                    ParnnTerms { guard: Guard::WindowNotFull, estimate: None },
                    "{k}"
                );
                assert_eq!(*force, plate(NOSE_UP));
            } else {
                assert_eq!(terms.guard, Guard::Inside, "{k}");
                let network = Rotation::<Ned, Body, f32>::from_euler(0.2, 0.4, 1.0)
                    * terms.estimate.unwrap().force;
                assert_eq!(*force, network);
                assert_ne!(*force, plate(NOSE_UP), "the network has something to say");
            }
        }
    }

    /// One row outside is one window too many: the guard holds until it has left the window.
    #[test]
    fn outside_what_was_trained_the_flat_plate_stands_in() {
        for (outside, reason) in [
            ([12.5, 0.0, 1.0], Guard::Speed),
            ([0.0, 0.0, 5.0], Guard::AngleOfAttack),
            ([0.0, 0.0, -5.0], Guard::AngleOfAttack),
            ([f32::NAN, 0.0, 0.0], Guard::Speed),
            ([f32::INFINITY, 0.0, 0.0], Guard::Speed),
        ] {
            let mut velocities = [NOSE_UP; 2 * WINDOW + 1];
            velocities[WINDOW] = outside;
            let all = estimates(&loud(), &velocities);
            assert_eq!(all[WINDOW - 1].1.guard, Guard::Inside);
            for k in WINDOW..2 * WINDOW {
                assert_eq!(all[k].1.guard, reason, "{k}: {outside:?}");
                let said = all[k].1.estimate.unwrap();
                assert!(
                    said.force.vector.iter().all(|f| f.is_finite()),
                    "{k}: {outside:?}: {said:?}"
                );
                if k > WINDOW {
                    assert_eq!(all[k].0, plate(NOSE_UP), "{k}: {outside:?}");
                }
            }
            assert_eq!(all[2 * WINDOW].1.guard, Guard::Inside, "{outside:?}");
        }
    }

    #[test]
    fn a_missed_tick_empties_the_window() {
        let model = ForceModel::Parnn(loud());
        for dt_s in [0.2, 0.0, 1.0, f32::NAN] {
            let mut history = History::new();
            let mut guard_after = |dt_s| {
                let velocity = In::new(Vector3::from(NOSE_UP));
                let (_, terms) =
                    model.estimate(&mut history, &Rotation::identity(), velocity, None, 0.04, dt_s);
                terms.unwrap().guard
            };
            for _ in 0..WINDOW {
                guard_after(STEP_S);
            }
            assert_eq!(guard_after(STEP_S), Guard::Inside);
            assert_eq!(guard_after(dt_s), Guard::WindowNotFull, "{dt_s}");
            let refill: Vec<_> = (1..WINDOW).map(|_| guard_after(STEP_S)).collect();
            assert_eq!(refill[WINDOW - 3..], [Guard::WindowNotFull, Guard::Inside], "{dt_s}");
        }
    }
}
