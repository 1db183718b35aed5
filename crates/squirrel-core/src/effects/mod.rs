//! The catalogue of physical effects that a vehicle may have on top of the base model.
//!
//! One effect, one file: equation, parameters with unit and plausible range, name. The name is the table
//! `[effects.<name>]` of a vehicle file. Every effect is an increment on the base model; zero means absent. Where an
//! effect acts is a method of [`Effect`] that it overrides; the dynamics call [`Effects`], which sums over those present.
//! A new effect is a file and a line in the `catalogue!` below.

mod battery_sag;
mod constant_wind;
mod linear_drag;
mod motor_lag;
mod quadratic_drag;

pub use battery_sag::BatterySag;
pub use constant_wind::ConstantWind;
pub use linear_drag::LinearDrag;
pub use motor_lag::MotorLag;
pub use quadratic_drag::QuadraticDrag;

use crate::aero::Air;
use crate::frames::{Body, In, Ned, Wrench};
use crate::math::Real;

/// One parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectParameter {
    /// Key in files, with its unit: `extra_time_constant_s`.
    pub key: &'static str,
    /// Smallest size worth reporting.
    pub smallest: f64,
    /// Largest plausible size.
    pub largest: f64,
    /// Whether the parameter may be negative; its size is then its absolute value.
    pub signed: bool,
}

/// A physical effect: what it is called, its numbers, and where it acts.
pub trait Effect<T: Real>: Copy {
    /// Standard name; the id in vehicle files and verdicts.
    const NAME: &'static str;
    /// The parameters in the order of [`Effect::values`].
    const PARAMETERS: &'static [EffectParameter];
    /// The effect with all parameters zero: present, without consequence.
    fn absent() -> Self;
    /// The parameters as one list.
    fn values(&mut self) -> &mut [T];

    /// Wind that the effect adds, m/s.
    #[inline(always)]
    fn wind(&self) -> In<Ned, T> {
        In::zero()
    }
    /// Factor on the steady rotor speed at a battery voltage, V.
    #[inline(always)]
    fn rotor_speed_ratio(&self, _battery_voltage_v: T, _reference_voltage_v: T) -> T {
        T::one()
    }
    /// What the effect adds to the rotor lag, s.
    #[inline(always)]
    fn rotor_extra_time_constant_s(&self) -> T {
        T::zero()
    }
    /// Force and moment that the effect adds.
    #[inline(always)]
    fn wrench(&self, _air: &Air<T>) -> Wrench<Body, T> {
        Wrench::zero()
    }
}

/// A set of parameters found by effect name.
#[derive(Debug)]
pub struct Found<'a, T> {
    /// Keys and ranges.
    pub parameters: &'static [EffectParameter],
    /// The values, in the same order.
    pub values: &'a mut [T],
}

macro_rules! catalogue {
    ($($field:ident: $effect:ident,)+) => {
        /// The effects that a vehicle has.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Effects<T: Real> {
            $(#[doc = concat!("[`", stringify!($effect), "`]")] pub $field: Option<$effect<T>>,)+
        }

        impl<T: Real> Effects<T> {
            /// Names of all effects of the catalogue.
            pub const NAMES: &'static [&'static str] = &[$(<$effect<f64> as Effect<f64>>::NAME,)+];

            /// No effect.
            pub fn none() -> Self {
                Self { $($field: None,)+ }
            }
            /// The parameters of a present effect by name.
            pub fn get_mut(&mut self, name: &str) -> Option<Found<'_, T>> {
                $(if name == <$effect<T> as Effect<T>>::NAME {
                    let values = self.$field.as_mut()?.values();
                    return Some(Found { parameters: <$effect<T> as Effect<T>>::PARAMETERS, values });
                })+
                None
            }
            /// The parameters of an effect by name, which is added with zeros if absent; `None` for an unknown name.
            pub fn insert(&mut self, name: &str) -> Option<Found<'_, T>> {
                $(if name == <$effect<T> as Effect<T>>::NAME {
                    self.$field.get_or_insert_with(<$effect<T> as Effect<T>>::absent);
                })+
                self.get_mut(name)
            }

            /// Wind of all present effects, m/s.
            #[inline(always)]
            pub fn wind(&self) -> In<Ned, T> {
                let mut sum = In::zero();
                $(if let Some(effect) = &self.$field { sum = sum + effect.wind(); })+
                sum
            }
            /// Product of the factors on steady rotor speed.
            #[inline(always)]
            pub fn rotor_speed_ratio(&self, battery_voltage_v: T, reference_voltage_v: T) -> T {
                let mut product = T::one();
                $(if let Some(effect) = &self.$field {
                    product *= effect.rotor_speed_ratio(battery_voltage_v, reference_voltage_v);
                })+
                product
            }
            /// Sum of what is added to the rotor lag, s.
            #[inline(always)]
            pub fn rotor_extra_time_constant_s(&self) -> T {
                let mut sum = T::zero();
                $(if let Some(effect) = &self.$field { sum += effect.rotor_extra_time_constant_s(); })+
                sum
            }
            /// Sum of forces and moments.
            #[inline(always)]
            pub fn wrench(&self, air: &Air<T>) -> Wrench<Body, T> {
                let mut sum = Wrench::zero();
                $(if let Some(effect) = &self.$field { sum = sum + effect.wrench(air); })+
                sum
            }
        }
    };
}

catalogue! {
    linear_drag: LinearDrag,
    quadratic_drag: QuadraticDrag,
    constant_wind: ConstantWind,
    battery_sag: BatterySag,
    motor_lag: MotorLag,
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn air(x: f64, y: f64, z: f64) -> Air<f64> {
        let velocity = In::new(Vector3::new(x, y, z));
        Air { velocity, speed: velocity.vector.norm(), omega: In::zero() }
    }

    /// Zero means absent, for every effect of the catalogue.
    #[test]
    fn an_effect_of_size_zero_changes_nothing() {
        for name in Effects::<f64>::NAMES {
            let mut effects = Effects::<f64>::none();
            effects.insert(name).unwrap();
            assert_eq!(effects.wrench(&air(3.0, -2.0, 1.0)), Wrench::zero(), "{name}");
            assert_eq!(effects.wind(), In::zero(), "{name}");
            assert_eq!(effects.rotor_speed_ratio(13.0, 14.8), 1.0, "{name}");
            assert_eq!(effects.rotor_extra_time_constant_s(), 0.0, "{name}");
        }
    }

    /// A present effect acts somewhere, so that no file can name one that does nothing.
    #[test]
    fn every_effect_acts_at_its_smallest_size() {
        for name in Effects::<f64>::NAMES {
            let mut effects = Effects::<f64>::none();
            let found = effects.insert(name).unwrap();
            for (value, parameter) in found.values.iter_mut().zip(found.parameters) {
                assert!(parameter.smallest > 0.0 && parameter.smallest < parameter.largest, "{name}");
                *value = parameter.smallest;
            }
            let acts = effects.wrench(&air(3.0, -2.0, 1.0)) != Wrench::zero()
                || effects.wind() != In::zero()
                || effects.rotor_speed_ratio(13.0, 14.8) != 1.0
                || effects.rotor_extra_time_constant_s() != 0.0;
            assert!(acts, "{name}");
        }
        assert!(Effects::<f64>::none().insert("phlogiston").is_none());
    }
}
