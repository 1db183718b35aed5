//! The catalogue of physical effects that a vehicle may have on top of the base model.
//!
//! One effect, one file: equation, parameters with unit and plausible range, name. The name is the table
//! `[effects.<name>]` of a vehicle file. Every effect is an increment on the base model; zero means absent. Where an
//! effect acts is a method of [`Effect`] that it overrides; the dynamics call [`Effects`], which sums over those present.
//! A new effect is a file and a line in the `catalogue!` below.
//!
//! Effects that only change numbers of the airframe (mass, inertia, what a rotor gives) do so once, through
//! [`Effects::alter`]; the others act in every derivative.

mod angular_damping;
mod axial_inflow;
mod battery_sag;
mod cg_offset;
mod constant_wind;
mod flapping_moment;
mod ground_effect;
mod inertia_error;
mod linear_drag;
mod mass_error;
mod motor_lag;
mod quadratic_drag;
mod thrust_coefficient;
mod thrust_misalignment;
mod translational_lift;
mod weak_rotor;
mod yaw_torque_coeff;

pub use angular_damping::AngularDamping;
pub use axial_inflow::AxialInflow;
pub use battery_sag::BatterySag;
pub use cg_offset::CgOffset;
pub use constant_wind::ConstantWind;
pub use flapping_moment::FlappingMoment;
pub use ground_effect::GroundEffect;
pub use inertia_error::InertiaError;
pub use linear_drag::LinearDrag;
pub use mass_error::MassError;
pub use motor_lag::MotorLag;
pub use quadratic_drag::QuadraticDrag;
pub use thrust_coefficient::ThrustCoefficient;
pub use thrust_misalignment::ThrustMisalignment;
pub use translational_lift::TranslationalLift;
pub use weak_rotor::WeakRotor;
pub use yaw_torque_coeff::YawTorqueCoeff;

use crate::aero::Air;
use crate::frames::{Body, In, Ned, Wrench};
use crate::math::Real;
use crate::vehicle::{MAX_ROTORS, ParameterError, PerRotor, Vehicle};
use nalgebra::Matrix3;

/// What a parameter of an effect is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A size in the unit that the key ends with; zero means absent.
    Size {
        /// Smallest size worth reporting.
        smallest: f64,
        /// Largest plausible size.
        largest: f64,
        /// Whether it may be negative; its size is then its absolute value.
        signed: bool,
    },
    /// Number of a rotor, from 1 in command order.
    Rotor,
    /// One of a few names; the value is its index.
    OneOf(&'static [&'static str]),
}

/// One parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectParameter {
    /// Key in files, with its unit: `extra_time_constant_s`.
    pub key: &'static str,
    /// What it is.
    pub kind: Kind,
}

impl EffectParameter {
    /// A size that is not negative.
    const fn size(key: &'static str, smallest: f64, largest: f64) -> Self {
        Self { key, kind: Kind::Size { smallest, largest, signed: false } }
    }
    /// A size with a sign.
    const fn signed(key: &'static str, smallest: f64, largest: f64) -> Self {
        Self { key, kind: Kind::Size { smallest, largest, signed: true } }
    }
}

/// What an effect that makes a force may look at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Situation<'a, T: Real> {
    /// Motion through the air.
    pub air: &'a Air<T>,
    /// Height above the origin's level, m.
    pub height_m: T,
    /// Thrust of all rotors, N, effects on thrust included.
    pub thrust_n: T,
    /// Force of rotors, drag and wings, N, before effects that add to it.
    pub force: In<Body, T>,
}

/// Numbers of the airframe that effects change once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alteration<T: Real> {
    /// Mass, kg.
    pub mass_kg: T,
    /// Inertia, kg m^2.
    pub inertia_kg_m2: Matrix3<T>,
    /// Factor on the thrust of each rotor.
    pub thrust: PerRotor<T>,
    /// Factor on the reaction torque of each rotor.
    pub torque: PerRotor<T>,
}

/// A physical effect: what it is called, its numbers, and where it acts.
pub trait Effect<T: Real>: Copy {
    /// Standard name; the id in vehicle files and verdicts.
    const NAME: &'static str;
    /// The parameters, in the order in which the effect stores them.
    const PARAMETERS: &'static [EffectParameter];

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
    /// Changes numbers of the airframe.
    #[inline(always)]
    fn alter(&self, _airframe: &mut Alteration<T>) {}
    /// Factor on the thrust of all rotors, and so on their roll and pitch moments.
    ///
    /// * `height_m` - above the origin's level
    #[inline(always)]
    fn thrust_factor(&self, _air: &Air<T>, _height_m: T) -> T {
        T::one()
    }
    /// Where the effect puts the accelerometer, from the centre of mass, m.
    #[inline(always)]
    fn accelerometer_position(&self) -> In<Body, T> {
        In::zero()
    }
    /// Force and moment that the effect adds.
    #[inline(always)]
    fn wrench(&self, _situation: &Situation<'_, T>) -> Wrench<Body, T> {
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
            any: bool,
            $($field: Option<$effect<T>>,)+
        }

        impl<T: Real> Effects<T> {
            /// Names of all effects of the catalogue.
            pub const NAMES: &'static [&'static str] = &[$(<$effect<f64> as Effect<f64>>::NAME,)+];

            /// No effect.
            pub fn none() -> Self {
                Self { any: false, $($field: None,)+ }
            }
            /// Whether any effect is present. The hot loops ask this once and leave the sums below, which are kept out of line,
            /// alone where there is none.
            #[inline(always)]
            pub fn any(&self) -> bool {
                self.any
            }
            /// Whether the effect of a name is present.
            pub fn has(&self, name: &str) -> bool {
                $((name == <$effect<T> as Effect<T>>::NAME && self.$field.is_some()) ||)+ false
            }
            /// The parameters of a present effect by name.
            pub fn get_mut(&mut self, name: &str) -> Option<Found<'_, T>> {
                $(if name == <$effect<T> as Effect<T>>::NAME {
                    let values: &mut [T] = &mut self.$field.as_mut()?.0;
                    return Some(Found { parameters: <$effect<T> as Effect<T>>::PARAMETERS, values });
                })+
                None
            }
            /// The parameters of an effect by name, which is added with zeros if absent; `None` for an unknown name.
            pub fn insert(&mut self, name: &str) -> Option<Found<'_, T>> {
                $(if name == <$effect<T> as Effect<T>>::NAME {
                    self.any = true;
                    self.$field.get_or_insert_with(|| $effect(core::array::from_fn(|_| T::zero())));
                })+
                self.get_mut(name)
            }

            /// Wind of all present effects, m/s.
            #[inline(never)]
            pub fn wind(&self) -> In<Ned, T> {
                let mut sum = In::zero();
                $(if let Some(effect) = &self.$field { sum = sum + effect.wind(); })+
                sum
            }
            /// Product of the factors on steady rotor speed.
            #[inline(never)]
            pub fn rotor_speed_ratio(&self, battery_voltage_v: T, reference_voltage_v: T) -> T {
                let mut product = T::one();
                $(if let Some(effect) = &self.$field {
                    product *= effect.rotor_speed_ratio(battery_voltage_v, reference_voltage_v);
                })+
                product
            }
            /// Sum of what is added to the rotor lag, s.
            #[inline(never)]
            pub fn rotor_extra_time_constant_s(&self) -> T {
                let mut sum = T::zero();
                $(if let Some(effect) = &self.$field { sum += effect.rotor_extra_time_constant_s(); })+
                sum
            }
            /// The vehicle with the numbers that effects change.
            ///
            /// # Errors
            /// Effects leave a mass or an inertia that no body has.
            pub fn alter(&self, vehicle: &Vehicle<T>) -> Result<Vehicle<T>, ParameterError> {
                let p = vehicle.parameters();
                let mut airframe = Alteration {
                    mass_kg: p.mass_kg,
                    inertia_kg_m2: p.inertia_kg_m2,
                    thrust: [T::one(); MAX_ROTORS],
                    torque: [T::one(); MAX_ROTORS],
                };
                $(if let Some(effect) = &self.$field { effect.alter(&mut airframe); })+
                vehicle.altered(&airframe)
            }
            /// Product of the factors on thrust.
            #[inline(never)]
            pub fn thrust_factor(&self, air: &Air<T>, height_m: T) -> T {
                let mut product = T::one();
                $(if let Some(effect) = &self.$field { product *= effect.thrust_factor(air, height_m); })+
                product
            }
            /// Where the accelerometer sits, from the centre of mass, m.
            #[inline(never)]
            pub fn accelerometer_position(&self) -> In<Body, T> {
                let mut sum = In::zero();
                $(if let Some(effect) = &self.$field { sum = sum + effect.accelerometer_position(); })+
                sum
            }
            /// Sum of forces and moments.
            #[inline(never)]
            pub fn wrench(&self, situation: &Situation<'_, T>) -> Wrench<Body, T> {
                let mut sum = Wrench::zero();
                $(if let Some(effect) = &self.$field { sum = sum + effect.wrench(situation); })+
                sum
            }
        }
    };
}

catalogue! {
    angular_damping: AngularDamping,
    axial_inflow: AxialInflow,
    battery_sag: BatterySag,
    cg_offset: CgOffset,
    constant_wind: ConstantWind,
    flapping_moment: FlappingMoment,
    ground_effect: GroundEffect,
    inertia_error: InertiaError,
    linear_drag: LinearDrag,
    mass_error: MassError,
    motor_lag: MotorLag,
    quadratic_drag: QuadraticDrag,
    thrust_coefficient: ThrustCoefficient,
    thrust_misalignment: ThrustMisalignment,
    translational_lift: TranslationalLift,
    weak_rotor: WeakRotor,
    yaw_torque_coeff: YawTorqueCoeff,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::fixtures::squirrel;
    use nalgebra::Vector3;

    const HEIGHT_M: f64 = 0.3;

    fn air() -> Air<f64> {
        Air::new(In::new(Vector3::new(3.0, -2.0, 1.0)), In::new(Vector3::new(0.4, -0.3, 0.2)))
    }
    fn situation(air: &Air<f64>) -> Situation<'_, f64> {
        Situation { air, height_m: HEIGHT_M, thrust_n: 5.0, force: In::new(Vector3::new(0.2, 0.1, -5.0)) }
    }
    fn vehicle() -> Vehicle<f64> {
        Vehicle::new(squirrel()).unwrap()
    }
    /// Every way in which effects can act, as one list of numbers.
    fn actions(effects: &Effects<f64>) -> Vec<f64> {
        let air = air();
        let wrench = effects.wrench(&situation(&air));
        let altered = effects.alter(&vehicle()).unwrap();
        let rotors = altered.rotor_wrench_per_speed_squared();
        let mut all = vec![
            effects.rotor_speed_ratio(13.0, 14.8),
            effects.rotor_extra_time_constant_s(),
            effects.thrust_factor(&air, HEIGHT_M),
            altered.inverse_mass(),
        ];
        for list in [rotors.thrust, rotors.roll, rotors.pitch, rotors.yaw] {
            all.extend(list);
        }
        all.extend(altered.inertia_inverse().iter());
        for v in [wrench.force.vector, wrench.moment.vector, effects.wind().vector] {
            all.extend(v.iter());
        }
        all
    }
    fn sized(name: &str, size: fn(f64, f64) -> f64) -> Effects<f64> {
        let mut effects = Effects::none();
        let found = effects.insert(name).unwrap();
        for (value, parameter) in found.values.iter_mut().zip(found.parameters) {
            *value = match parameter.kind {
                Kind::Size { smallest, largest, .. } => size(smallest, largest),
                Kind::Rotor => 2.0,
                Kind::OneOf(_) => 1.0,
            };
        }
        effects
    }

    /// Zero means absent, for every effect of the catalogue.
    #[test]
    fn an_effect_of_size_zero_changes_nothing() {
        for name in Effects::<f64>::NAMES {
            assert_eq!(actions(&sized(name, |_, _| 0.0)), actions(&Effects::none()), "{name}");
        }
    }

    /// A present effect acts somewhere, so that no file can name one that does nothing.
    #[test]
    fn every_effect_acts_at_its_smallest_size() {
        for name in Effects::<f64>::NAMES {
            assert_ne!(actions(&sized(name, |smallest, _| smallest)), actions(&Effects::none()), "{name}");
        }
        assert!(Effects::<f64>::none().insert("phlogiston").is_none());
    }

    #[test]
    fn ranges_are_ranges_and_the_largest_sizes_are_flyable() {
        for name in Effects::<f64>::NAMES {
            let mut effects = sized(name, |_, largest| largest);
            assert!(actions(&effects).iter().all(|x| x.is_finite()), "{name}");
            for parameter in effects.get_mut(name).unwrap().parameters {
                if let Kind::Size { smallest, largest, .. } = parameter.kind {
                    assert!(smallest > 0.0 && smallest < largest, "{name}.{}", parameter.key);
                }
            }
        }
    }

    /// One number for each effect that makes a force or changes the airframe, worked out by hand from its equation.
    #[test]
    fn sizes_and_signs_by_hand() {
        let with = |name: &str, values: &[f64]| {
            let mut effects = Effects::<f64>::none();
            effects.insert(name).unwrap().values.copy_from_slice(values);
            effects
        };
        let air = air();
        let close = |a: f64, b: f64, what: &str| {
            assert!((a - b).abs() < 1e-12 * b.abs().max(1.0), "{what}: {a} for {b}");
        };
        let wrench = |name: &str, values: &[f64]| with(name, values).wrench(&situation(&air));
        let factor = |name: &str, values: &[f64]| with(name, values).thrust_factor(&air, HEIGHT_M);
        let altered = |name: &str, values: &[f64]| with(name, values).alter(&vehicle()).unwrap();

        let drag = wrench("linear_drag", &[0.1]).force.vector;
        assert!((drag - Vector3::new(-0.3, 0.2, 0.0)).norm() < 1e-12);
        close(
            wrench("quadratic_drag", &[0.01]).force.vector.x,
            -0.5 * 1.225 * 0.01 * 14.0_f64.sqrt() * 3.0,
            "drag area",
        );
        // R = 0.4 m at 0.3 m: 1 / (1 - 0.16 / 1.44).
        close(factor("ground_effect", &[0.4]), 1.125, "ground effect");
        close(
            with("ground_effect", &[0.4]).thrust_factor(&air, 0.0),
            4.0 / 3.0,
            "height floored at half the radius",
        );
        close(
            factor("translational_lift", &[1e-3]),
            1.0 + 1e-3 * 13.0 / (1.0 + 0.004 * 13.0),
            "translational lift",
        );
        close(factor("axial_inflow", &[0.03]), 1.03, "descending air lifts");
        // Centre of mass ahead: thrust acts behind it and pitches the nose down.
        close(wrench("cg_offset", &[0.01, 0.0]).moment.vector.y, -0.05, "cg ahead");
        close(wrench("cg_offset", &[0.0, 0.01]).moment.vector.x, 0.05, "cg to the right");
        let tilted = wrench("thrust_misalignment", &[0.02, -0.01]).force.vector;
        assert!((tilted - Vector3::new(-0.1, 0.05, 0.0)).norm() < 1e-12);
        let flap = wrench("flapping_moment", &[2e-3]).moment.vector;
        assert!((flap - Vector3::new(4e-3, 6e-3, 0.0)).norm() < 1e-12, "forward flight pitches up");
        let damped = wrench("angular_damping", &[0.01]).moment.vector;
        assert!((damped - Vector3::new(-4e-3, 3e-3, -1e-3)).norm() < 1e-12);

        close(1.0 / altered("mass_error", &[0.1]).inverse_mass(), 0.548 * 1.1, "mass");
        close(
            1.0 / altered("inertia_error", &[1.0, 0.2]).inertia_inverse()[(1, 1)],
            4.68e-3 * 1.2,
            "inertia about y",
        );
        let nominal = *vehicle().rotor_wrench_per_speed_squared();
        let strong = *altered("thrust_coefficient", &[0.1]).rotor_wrench_per_speed_squared();
        close(strong.roll[0] / nominal.roll[0], 1.1, "thrust scales roll");
        close(strong.yaw[0] / nominal.yaw[0], 1.0, "and not yaw");
        let weak = *altered("weak_rotor", &[3.0, 0.2]).rotor_wrench_per_speed_squared();
        close(weak.thrust[2] / nominal.thrust[2], 0.8, "the third rotor");
        close(weak.yaw[2] / nominal.yaw[2], 0.8, "and its torque");
        close(weak.thrust[1] / nominal.thrust[1], 1.0, "no other");
        let twisted = *altered("yaw_torque_coeff", &[-0.3]).rotor_wrench_per_speed_squared();
        close(twisted.yaw[1] / nominal.yaw[1], 0.7, "yaw torque");
    }

    #[test]
    fn an_impossible_alteration_is_refused() {
        let mut effects = Effects::<f64>::none();
        effects.insert("mass_error").unwrap().values[0] = -1.0;
        assert!(effects.alter(&vehicle()).unwrap_err().to_string().starts_with("mass.mass_kg = 0"));
    }
}
