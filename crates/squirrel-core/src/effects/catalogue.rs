//! The effects of a vehicle: which are present, and what they do together.
//!
//! The one list of all effects is at the end of this file. Sums are kept out of line: the hot loops ask [`Effects::any`] once
//! and leave them alone where there is no effect.

use super::{
    AccelBias, AccelScale, ActuationLatency, AddedMass, Alteration, AngularDamping, AxialInflow, BatterySag,
    CgOffset, ClockSkew, ClockStep, CommandClock, CompassCurrent, ConstantWind, Effect, EffectParameter,
    FlappingMoment, GnssLatency, GroundEffect, Gust, GustSpectrum, GyroScale, HeadingBias, InertiaError,
    LinearDrag, MassError, MotorLag, PayloadSwing, Pendulum, QuadraticDrag, RotorGyroTorque, Situation,
    Supply, ThrustCoefficient, ThrustMisalignment, TranslationalLift, WeakRotor, WingAsymmetry, WingMembrane,
    WingServoLag, YawTorqueCoeff,
};
use crate::aero::Air;
use crate::frames::{Body, In, Ned, Wrench};
use crate::math::Real;
use crate::vehicle::{MAX_ROTORS, ParameterError, PerRotor, Vehicle};

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
            /// The parameters of the effect of a name, present or not; `None` for an unknown name. See [`forms`](super::forms).
            pub fn parameters(name: &str) -> Option<&'static [EffectParameter]> {
                $(if name == <$effect<T> as Effect<T>>::NAME {
                    return Some(<$effect<T> as Effect<T>>::PARAMETERS);
                })+
                None
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
            /// The parameters of an effect by name, which is added with zeros (in its standard form) if absent; `None` for an unknown name.
            pub fn insert(&mut self, name: &str) -> Option<Found<'_, T>> {
                $(if name == <$effect<T> as Effect<T>>::NAME {
                    self.any = true;
                    self.$field.get_or_insert_with(|| $effect(core::array::from_fn(|_| T::zero())));
                })+
                self.get_mut(name)
            }

            /// Wind of all present effects at a height above the origin's level, m/s.
            #[inline(never)]
            pub fn wind(&self, height_m: T) -> In<Ned, T> {
                let mut sum = In::zero();
                $(if let Some(effect) = &self.$field { sum = sum + effect.wind(height_m); })+
                sum
            }
            /// Gusts of the effects; several would be independent, and only the first is given.
            pub fn gust(&self) -> Option<GustSpectrum<T>> {
                $(if let Some(gust) = self.$field.as_ref().and_then(Effect::gust) { return Some(gust); })+
                None
            }
            /// Changes steady rotor speeds, rad/s, by what feeds the rotors.
            #[inline(never)]
            pub fn rotor_target(&self, target_rad_s: &mut PerRotor<T>, supply: &Supply<T>) {
                $(if let Some(effect) = &self.$field { effect.rotor_target(target_rad_s, supply); })+
            }
            /// What is added to the rotor lag, s: speeding up, slowing down.
            #[inline(never)]
            pub fn rotor_extra_time_constant_s(&self) -> [T; 2] {
                let mut sum = [T::zero(); 2];
                $(if let Some(effect) = &self.$field { for (sum, lag) in sum.iter_mut().zip(effect.rotor_extra_time_constant_s()) { *sum += lag; } })+
                sum
            }
            /// What is added to the lag of wing deployment, s: opening, closing.
            #[inline(never)]
            pub fn wing_extra_time_constant_s(&self) -> [T; 2] {
                let mut sum = [T::zero(); 2];
                $(if let Some(effect) = &self.$field { for (sum, lag) in sum.iter_mut().zip(effect.wing_extra_time_constant_s()) { *sum += lag; } })+
                sum
            }
            /// Time by which commands of rotors and wings act late, s.
            #[inline(never)]
            pub fn command_latency_s(&self) -> T {
                let mut sum = T::zero();
                $(if let Some(effect) = &self.$field { sum += effect.command_latency_s(); })+
                sum
            }
            /// The clock that stamps commands.
            pub fn command_clock(&self) -> CommandClock<T> {
                let mut clock = CommandClock::right();
                $(if let Some(effect) = &self.$field { effect.command_clock(&mut clock); })+
                clock
            }
            /// What the accelerometer reads too much along each axis, as a fraction.
            #[inline(never)]
            pub fn accel_scale(&self) -> In<Body, T> {
                let mut sum = In::zero();
                $(if let Some(effect) = &self.$field { sum = sum + effect.accel_scale(); })+
                sum
            }
            /// What the gyroscope reads too much about each axis, as a fraction.
            #[inline(never)]
            pub fn gyro_scale(&self) -> In<Body, T> {
                let mut sum = In::zero();
                $(if let Some(effect) = &self.$field { sum = sum + effect.gyro_scale(); })+
                sum
            }
            /// Bias of the accelerometer at a time since the flight began, m/s^2.
            #[inline(never)]
            pub fn specific_force_bias(&self, time_s: T) -> In<Body, T> {
                let mut sum = In::zero();
                $(if let Some(effect) = &self.$field { sum = sum + effect.specific_force_bias(time_s); })+
                sum
            }
            /// Bias of the measured heading at a time since the flight began, rad.
            ///
            /// * `rotor_load` - power of the rotors over that in hover, see [`Vehicle::rotor_load`]
            #[inline(never)]
            pub fn heading_bias_rad(&self, time_s: T, rotor_load: T) -> T {
                let mut sum = T::zero();
                $(if let Some(effect) = &self.$field { sum += effect.heading_bias_rad(time_s) + effect.heading_per_load_rad() * rotor_load; })+
                sum
            }
            /// What is added to the latency of the satellite receiver, s.
            #[inline(never)]
            pub fn gnss_latency_s(&self) -> T {
                let mut sum = T::zero();
                $(if let Some(effect) = &self.$field { sum += effect.gnss_latency_s(); })+
                sum
            }
            /// The load that swings under the vehicle.
            #[inline(never)]
            pub fn pendulum(&self) -> Option<Pendulum<T>> {
                $(if let Some(load) = self.$field.as_ref().and_then(Effect::pendulum) { return Some(load); })+
                None
            }
            /// Mass of the air that moves with the vehicle along body z, kg.
            #[inline(never)]
            pub fn added_mass_kg(&self) -> T {
                let mut sum = T::zero();
                $(if let Some(effect) = &self.$field { sum += effect.added_mass_kg(); })+
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
            /// Whether the wrench of any effect depends on how fast the rotors spin.
            #[inline(always)]
            pub(crate) fn feel_rotor_spin(&self) -> bool {
                $(self.$field.as_ref().is_some_and(Effect::feels_rotor_spin) ||)+ false
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
    accel_bias: AccelBias,
    accel_scale: AccelScale,
    actuation_latency: ActuationLatency,
    added_mass: AddedMass,
    angular_damping: AngularDamping,
    axial_inflow: AxialInflow,
    battery_sag: BatterySag,
    cg_offset: CgOffset,
    clock_skew: ClockSkew,
    clock_step: ClockStep,
    compass_current: CompassCurrent,
    constant_wind: ConstantWind,
    flapping_moment: FlappingMoment,
    gnss_latency: GnssLatency,
    ground_effect: GroundEffect,
    gust: Gust,
    gyro_scale: GyroScale,
    heading_bias: HeadingBias,
    inertia_error: InertiaError,
    linear_drag: LinearDrag,
    mass_error: MassError,
    motor_lag: MotorLag,
    payload_swing: PayloadSwing,
    quadratic_drag: QuadraticDrag,
    rotor_gyro_torque: RotorGyroTorque,
    thrust_coefficient: ThrustCoefficient,
    thrust_misalignment: ThrustMisalignment,
    translational_lift: TranslationalLift,
    weak_rotor: WeakRotor,
    wing_asymmetry: WingAsymmetry,
    wing_membrane: WingMembrane,
    wing_servo_lag: WingServoLag,
    yaw_torque_coeff: YawTorqueCoeff,
}
