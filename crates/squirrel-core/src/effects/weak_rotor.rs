//! One rotor gives less: `T_i (1 - e)` and `Q_i (1 - e)`, as one that turns slower does.
//!
//! Form `thrust_alone`: `T_i (1 - e)` and `Q_i` as before, as of a chipped or a dirty propeller: it
//! turns as fast and drags as much. Damage takes thrust and never adds any; with a rotor opposite
//! that gained it would be a displaced centre of mass.

use super::{Alteration, Declared, Effect, EffectParameter, Kind, Shown, Words, is};
use crate::math::Real;

const THRUST_ALONE: usize = 1;

/// Which rotor, and the fraction that it lacks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeakRotor<T>(pub(super) [T; 3]);

impl<T: Real> Effect<T> for WeakRotor<T> {
    const NAME: &'static str = "weak_rotor";
    const PARAMETERS: &'static [EffectParameter] = &[
        EffectParameter::new("rotor", Kind::Rotor),
        EffectParameter::signed("thrust_loss_fraction", 0.05, 0.2)
            .declared(Declared::Thrust)
            .positive_in(&["thrust_alone"]),
        // The yaw moment of one form is what refutes the other.
        EffectParameter::form(&["with_torque", "thrust_alone"]).seeking(&["thrust_alone"]),
    ];
    const WORDS: Words = Words {
        what: "thrust of rotor @",
        more: "Rotor @ gives less thrust",
        less: "Rotor @ gives more thrust",
        fly: "roll and pitch doublets, yaw steps and thrust steps in hover; and weigh the vehicle",
    };
    const SHOWN: Shown = Shown::MOMENTS.and(Shown::LASTING);

    fn alter(&self, airframe: &mut Alteration<T>) {
        let [rotor, loss, form] = self.0;
        for (i, (thrust, torque)) in
            airframe.thrust.iter_mut().zip(&mut airframe.torque).enumerate()
        {
            if is(rotor, i + 1) {
                *thrust *= T::one() - loss;
                if !is(form, THRUST_ALONE) {
                    *torque *= T::one() - loss;
                }
            }
        }
    }
}
