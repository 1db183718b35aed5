//! The effects of a vehicle: which are present, and what they do together.
//!
//! The one list of all effects is at the end of this file. Sums are kept out of line: the hot loops
//! ask [`Effects::any`] once and leave them alone where there is no effect.

use super::{
    Acts, Alteration, CommandClock, Effect, EffectParameter, FORM, Forms, GustSpectrum, Pendulum,
    Profile, Situation, Slopes, at_rotors, is,
};
use crate::aero::{Airflow, BodyWrench};
use crate::frames::{Body, In};
use crate::lane::{Lane, Register, Row};
use crate::math::Real;
use crate::vehicle::{MAX_ROTORS, ParameterError, Vehicle};

/// A set of parameters found by effect name.
#[derive(Debug)]
pub struct Found<'a, T> {
    /// Keys and ranges.
    pub parameters: &'static [EffectParameter],
    /// The values, in the same order.
    pub values: &'a mut [T],
}

macro_rules! catalogue {
    ($($field:ident: $effect:ident $(=> $module:ident)?,)+) => {
        /// The effects that a vehicle has.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Effects<T: Real> {
            any: bool,
            $($field: Option<super::$field::$effect<T>>,)+
        }

        impl<T: Real> Effects<T> {
            /// Names of all effects of the catalogue.
            pub const NAMES: &'static [&'static str] = &[$(<super::$field::$effect<f64> as Effect<f64>>::NAME,)+];

            /// No effect.
            pub fn none() -> Self {
                Self { any: false, $($field: None,)+ }
            }
            /// Whether any effect is present. The hot loops ask this once and leave the sums below,
            /// which are kept out of line, alone where there is none.
            #[inline(always)]
            pub fn any(&self) -> bool {
                self.any
            }
            /// The parameters of the effect of a name, present or not; `None` for an unknown name.
            /// See [`forms`](super::forms).
            pub fn parameters(name: &str) -> Option<&'static [EffectParameter]> {
                $(if name == <super::$field::$effect<T> as Effect<T>>::NAME {
                    return Some(<super::$field::$effect<T> as Effect<T>>::PARAMETERS);
                })+
                None
            }
            /// What the effect of a name is known by; `None` for an unknown name.
            pub fn profile(name: &str) -> Option<Profile> {
                $(if name == <super::$field::$effect<T> as Effect<T>>::NAME {
                    return Some(Profile::of::<T, super::$field::$effect<T>>());
                })+
                None
            }
            /// Whether the effect of a name is present.
            pub fn has(&self, name: &str) -> bool {
                $((name == <super::$field::$effect<T> as Effect<T>>::NAME && self.$field.is_some()) ||)+ false
            }
            /// The parameters of a present effect by name.
            pub fn get_mut(&mut self, name: &str) -> Option<Found<'_, T>> {
                $(if name == <super::$field::$effect<T> as Effect<T>>::NAME {
                    let values: &mut [T] = &mut self.$field.as_mut()?.0;
                    return Some(Found { parameters: <super::$field::$effect<T> as Effect<T>>::PARAMETERS, values });
                })+
                None
            }
            /// The parameters of an effect by name, which is added with zeros (in its standard
            /// form) if absent; `None` for an unknown name.
            pub fn insert(&mut self, name: &str) -> Option<Found<'_, T>> {
                $(if name == <super::$field::$effect<T> as Effect<T>>::NAME {
                    self.any = true;
                    self.$field.get_or_insert_with(|| super::$field::$effect(core::array::from_fn(|_| T::zero())));
                })+
                self.get_mut(name)
            }

            /// Gusts of the effects; several would be independent, and only the first is given.
            pub fn gust(&self) -> Option<GustSpectrum<T>> {
                $(if let Some(gust) = self.$field.as_ref().and_then(Effect::gust) { return Some(gust); })+
                None
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
            /// Where the accelerometer sits, from the centre of mass, m.
            #[inline(never)]
            pub fn accelerometer_position(&self) -> In<Body, T> {
                let mut sum = In::zero();
                $(if let Some(effect) = &self.$field { sum = sum + effect.accelerometer_position(); })+
                sum
            }
        }

        /// Which effects there are, and in which forms; of one vehicle, or of any of a batch.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        pub struct Present {
            $($field: Forms,)+
        }

        impl Present {
            /// Those that are added to a vehicle.
            pub fn of<T: Real>(effects: &Effects<T>) -> Self {
                Self { $($field: effects.$field.as_ref().map_or_else(Forms::default, |effect| {
                    form_of(<super::$field::$effect<T> as Effect<T>>::PARAMETERS, &effect.0)
                }),)+ }
            }
            /// Those, and what the vehicle has as numbers of its own.
            pub fn on<T: Real>(vehicle: &Vehicle<T>, effects: &Effects<T>) -> Self {
                let mut out = Self::of(effects);
                $(if <super::$field::$effect<T> as Effect<T>>::is_declared(vehicle) {
                    out.$field = out.$field.or(Forms::only(0));
                })+
                out
            }
            /// Those of either.
            #[must_use]
            pub fn or(self, other: Self) -> Self {
                Self { $($field: self.$field.or(other.$field),)+ }
            }
            /// Those that act in flight, in steps and between them; not those that change the
            /// airframe once.
            #[must_use]
            pub fn in_flight(self) -> Self {
                let mut out = Self { payload_swing: self.payload_swing, ..Self::default() };
                $($(out.$module = self.$module;)?)+
                $(if <super::$field::$effect<f64> as Effect<f64>>::ACTS_BETWEEN_STEPS { out.$field = self.$field; })+
                out
            }
            /// The name of an effect that a batch with the others has no place for; first of those
            /// that act in steps.
            pub fn beyond(self, other: Self) -> Option<&'static str> {
                for between in [false, true] {
                    $(if <super::$field::$effect<f64> as Effect<f64>>::ACTS_BETWEEN_STEPS == between
                        && self.$field.are_beyond(other.$field, <super::$field::$effect<f64> as Effect<f64>>::FORMS_APART)
                    {
                        return Some(<super::$field::$effect<f64> as Effect<f64>>::NAME);
                    })+
                }
                None
            }
            /// The name of an effect that acts on sensors alone.
            pub fn of_sensors(self) -> Option<&'static str> {
                $(if <super::$field::$effect<f64> as Effect<f64>>::IS_OF_SENSORS && self.$field.any() {
                    return Some(<super::$field::$effect<f64> as Effect<f64>>::NAME);
                })+
                None
            }
            /// Whether any acts in steps: has an equation in every one, see [`Acts`], or pulls as a
            /// load.
            pub fn act_in_steps(self) -> bool {
                $($(self.$module.any() ||)?)+ self.has_load()
            }
            /// Whether air moves with the vehicle along body z.
            #[inline(always)]
            pub fn has_added_mass(self) -> bool {
                self.added_mass.any()
            }
            /// Whether any acts at the rotors' hubs.
            #[inline(always)]
            pub fn act_at_rotors(self) -> bool {
                $(<super::$field::$effect<f64> as Effect<f64>>::AT_ROTORS.is_some_and(|form| self.$field.has(form)) ||)+ false
            }
            /// Whether a load swings under the vehicle.
            #[inline(always)]
            pub fn has_load(self) -> bool {
                self.payload_swing.any()
            }
        }

        /// What the equations of all effects that [act](Acts) need, made of parameters once; of
        /// effects that are absent, what makes no difference.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Prepared<X: Copy> {
            $($($module: super::$module::Numbers<X>,)?)+
            /// Of all effects together.
            hubs: at_rotors::Numbers<X>,
        }

        impl<T: Real> Prepared<T> {
            /// Of a vehicle's effects.
            pub fn new(effects: &Effects<T>, vehicle: &Vehicle<T>) -> Self {
                let (present, mut slopes, mut rest) = (Present::of(effects), Slopes::none(), *effects);
                $(if let Some(effect) = effects.$field && <super::$field::$effect<T> as Effect<T>>::AT_ROTORS.is_some_and(|form| present.$field.has(form)) {
                    slopes = slopes.plus(effect.at_rotors(vehicle));
                    rest.$field = None;
                })+
                Self { $($($module: rest.$field.unwrap_or_else(|| super::$field::$effect(core::array::from_fn(|_| T::zero()))).prepare(vehicle),)?)+ hubs: at_rotors::Numbers::new(&slopes, vehicle) }
            }
        }

        impl<X: Copy> Prepared<X> {
            /// The same numbers in another form.
            pub fn map<Y: Copy>(&self, f: impl Fn(X) -> Y) -> Prepared<Y> {
                Prepared { $($($module: self.$module.map(&f),)?)+ hubs: self.hubs.map(&f) }
            }
        }

        impl<S: Copy> Prepared<Row<S>> {
            /// Puts the numbers of a vehicle into column `lane`.
            pub fn put(&mut self, lane: usize, numbers: &Prepared<S>) {
                $($(self.$module.put(lane, &numbers.$module);)?)+
                self.hubs.put(lane, &numbers.hubs);
            }
            /// The numbers in column `lane`.
            pub fn take(&self, lane: usize) -> Prepared<S> {
                Prepared { $($($module: self.$module.take(lane),)?)+ hubs: self.hubs.take(lane) }
            }
        }

        impl<L: Register> Prepared<L> {
            /// Registers from column `start` and on.
            #[inline(always)]
            pub fn load(rows: &Prepared<Row<L::Element>>, start: usize) -> Self {
                Self { $($($module: super::$module::Numbers::load(&rows.$module, start),)?)+ hubs: at_rotors::Numbers::load(&rows.hubs, start) }
            }
        }

        impl<L: Lane> Prepared<L> {
            /// Wind of all effects, north and east, m/s.
            ///
            /// * `height_m` - above the origin's level
            #[inline(always)]
            pub fn wind(&self, present: Present, height_m: L) -> [L; 2] {
                let mut sum = [L::of(0.0); 2];
                $($(if present.$module.any() {
                    let [north, east] = self.$module.wind(height_m, present.$module);
                    sum = [sum[0] + north, sum[1] + east];
                })?)+
                sum
            }
            /// Changes steady rotor speeds, rad/s, by the voltage that feeds the rotors.
            #[inline(always)]
            pub fn rotor_targets<const ROTORS: usize>(&self, present: Present, targets: &mut [L; ROTORS], voltage_v: L) {
                $($(if present.$module.any() {
                    self.$module.rotor_targets(targets, voltage_v, present.$module);
                })?)+
            }
            /// Product of the factors on thrust.
            #[inline(always)]
            pub fn thrust_factor(&self, present: Present, flow: &Airflow<L>, height_m: L) -> L {
                let mut product = L::of(1.0);
                $($(if present.$module.any() {
                    product = product * self.$module.thrust_factor(flow, height_m, present.$module);
                })?)+
                product
            }
            /// Mass of the air that moves with the vehicle along body z, kg.
            #[inline(always)]
            pub fn added_mass_kg(&self, present: Present) -> L {
                let mut sum = L::of(0.0);
                $($(if present.$module.any() { sum = sum + self.$module.added_mass_kg(); })?)+
                sum
            }
            /// Whether any effect adds wind.
            #[inline(always)]
            pub fn blow(present: Present) -> bool {
                $($((<super::$module::Numbers<L> as Acts<L>>::BLOWS && present.$module.any()) ||)?)+ false
            }
            /// Whether the wrench of any effect depends on how fast the rotors spin.
            #[inline(always)]
            pub fn feel_rotor_spin(present: Present) -> bool {
                $($((<super::$module::Numbers<L> as Acts<L>>::FEELS_ROTOR_SPIN && present.$module.any()) ||)?)+ false
            }
            /// Sum of forces and moments.
            #[inline(always)]
            pub fn wrench(&self, present: Present, at: &Situation<'_, L>) -> BodyWrench<L> {
                let mut sum = BodyWrench::zero();
                $($(if present.$module.any() { sum = sum.plus(&self.$module.wrench(at, present.$module)); })?)+
                if present.act_at_rotors() {
                    sum = sum.plus(&self.hubs.wrench(at));
                }
                sum
            }
        }
    };
}

/// The form of a present effect.
fn form_of<T: Real>(parameters: &[EffectParameter], values: &[T]) -> Forms {
    let place = parameters.iter().position(|p| p.key == FORM);
    let value = place.and_then(|place| values.get(place));
    Forms::only(value.map_or(0, |value| (0..8).find(|number| is(*value, *number)).unwrap_or(0)))
}

/// The effects of one vehicle, ready to act in its steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Acting<T: Real> {
    any: bool,
    present: Present,
    numbers: Prepared<T>,
    rotor_extra_time_constant_s: [T; 2],
}

impl<T: Real> Acting<T> {
    /// Of a vehicle with these effects.
    ///
    /// * `vehicle` - with what effects change once, see [`Effects::alter`]
    pub fn new(effects: &Effects<T>, vehicle: &Vehicle<T>) -> Self {
        let present = Present::on(vehicle, effects);
        Self {
            any: present.act_in_steps(),
            present,
            numbers: Prepared::new(effects, vehicle),
            rotor_extra_time_constant_s: effects.rotor_extra_time_constant_s(),
        }
    }
    /// Whether any acts. The hot loops ask this once.
    #[inline(always)]
    pub fn any(&self) -> bool {
        self.any
    }
    /// Which there are.
    #[inline(always)]
    pub fn present(&self) -> Present {
        self.present
    }
    /// Their numbers.
    #[inline(always)]
    pub fn numbers(&self) -> &Prepared<T> {
        &self.numbers
    }
    /// What is added to the rotor lag, s: speeding up, slowing down.
    #[inline(always)]
    pub fn rotor_extra_time_constant_s(&self) -> [T; 2] {
        self.rotor_extra_time_constant_s
    }
}

// Module and type of each effect; `=> module` behind one that has an equation in every step, its
// `Numbers` there.
catalogue! {
    accel_bias: AccelBias,
    accel_scale: AccelScale,
    actuation_latency: ActuationLatency,
    added_mass: AddedMass => added_mass,
    angular_damping: AngularDamping => angular_damping,
    axial_inflow: AxialInflow => axial_inflow,
    battery_sag: BatterySag => battery_sag,
    cg_offset: CgOffset => cg_offset,
    clock_skew: ClockSkew,
    clock_step: ClockStep,
    compass_current: CompassCurrent,
    constant_wind: ConstantWind => constant_wind,
    flapping_moment: FlappingMoment => flapping_moment,
    gnss_latency: GnssLatency,
    ground_effect: GroundEffect => ground_effect,
    gust: Gust,
    gyro_scale: GyroScale,
    heading_bias: HeadingBias,
    inertia_error: InertiaError,
    linear_drag: LinearDrag => linear_drag,
    mass_error: MassError,
    motor_lag: MotorLag,
    payload_swing: PayloadSwing,
    quadratic_drag: QuadraticDrag => quadratic_drag,
    rotor_gyro_torque: RotorGyroTorque => rotor_gyro_torque,
    rotor_wash: RotorWash => rotor_wash,
    thrust_coefficient: ThrustCoefficient,
    thrust_misalignment: ThrustMisalignment => thrust_misalignment,
    translational_lift: TranslationalLift => translational_lift,
    vortex_ring: VortexRing => vortex_ring,
    weak_rotor: WeakRotor,
    wing_asymmetry: WingAsymmetry => wing_asymmetry,
    wing_membrane: WingMembrane => wing_membrane,
    wing_moment: WingMoment => wing_moment,
    wing_servo_lag: WingServoLag,
    wing_tangential: WingTangential => wing_tangential,
    yaw_torque_coeff: YawTorqueCoeff,
}
