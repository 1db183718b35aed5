//! The catalogue of physical effects that a vehicle may have on top of the base model.
//!
//! One effect, one file: equation, parameters with unit and plausible range, name. The name is the
//! table `[effects.<name>]` of a vehicle file. Every effect is an increment on the base model; zero
//! means absent. Where an effect acts is a method that it overrides: of [`Effect`] what it does
//! once, on sensors, commands and servos; of [`Acts`] its equation in every step, written on lanes
//! once for flight alone and in batches. How it is spoken of and what it is known by stand with it.
//! The dynamics call [`Acting`] and [`Prepared`], which sum over those present. A new effect is a
//! file, its `mod` below and a line in the `catalogue!` of `catalogue.rs`.
//!
//! An effect may have several published forms: then its last parameter is `form`, and a parameter
//! may exist in some forms only. Without `form` in a file it is the first, the standard form.
//!
//! Effects that only change numbers of the airframe (mass, inertia, what a rotor gives) do so once,
//! through [`Effects::alter`]; those on sensors, commands and servos act where these are simulated;
//! the others act in every derivative.

mod accel_bias;
mod accel_scale;
mod actuation_latency;
mod added_mass;
mod angular_damping;
mod at_rotors;
mod axial_inflow;
mod battery_sag;
mod catalogue;
mod cg_offset;
mod clock;
mod clock_skew;
mod clock_step;
mod compass_current;
mod constant_wind;
mod flapping_moment;
mod gnss_latency;
mod ground_effect;
mod gust;
mod gyro_scale;
mod heading_bias;
mod inertia_error;
mod linear_drag;
mod mass_error;
mod motor_lag;
mod payload_swing;
mod profile;
mod quadratic_drag;
mod rotor_gyro_torque;
mod rotor_wash;
mod thrust_coefficient;
mod thrust_misalignment;
mod translational_lift;
mod vortex_ring;
mod weak_rotor;
mod wing_asymmetry;
mod wing_membrane;
mod wing_moment;
mod wing_servo_lag;
mod wing_tangential;
mod yaw_torque_coeff;

pub use actuation_latency::ActuationLatency;
pub use at_rotors::Slopes;
pub use battery_sag::BatterySag;
pub use catalogue::{Acting, Effects, Found, Prepared, Present};
pub use cg_offset::CgOffset;
pub use clock::CommandClock;
pub use constant_wind::ConstantWind;
pub use gust::{GUST_SCALE_LENGTH_M, GUST_TIME_CONSTANT_S, Gust, GustSpectrum};
pub use linear_drag::LinearDrag;
pub use mass_error::MassError;
pub use payload_swing::{Pendulum, PendulumState, Swing, Tether};
pub use profile::{
    Declared, Fitted, Mimic, Profile, Ratio, Response, Shown, SideOf, Timing, Tolerance, Words,
};
pub use quadratic_drag::QuadraticDrag;
pub use thrust_coefficient::ThrustCoefficient;
pub use weak_rotor::WeakRotor;
pub use wing_asymmetry::WingAsymmetry;
pub use wing_membrane::WingMembrane;

use crate::aero::{Airflow, BodyWrench, flat_plate};
use crate::frames::{Body, Frame, In};
use crate::lane::Lane;
use crate::math::{Real, real, sqrt};
pub use crate::vehicle::Alteration;
use crate::vehicle::Vehicle;
use nalgebra::Vector3;

/// What a parameter of an effect is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A size in the unit that the key ends with; zero means absent.
    Size {
        /// Smallest size worth reporting, on the vehicle of the paper.
        smallest: f64,
        /// Largest plausible size, on the same.
        largest: f64,
        /// Whether it may be negative; its size is then its absolute value.
        signed: bool,
        /// What both sizes grow with from one vehicle to another.
        scale: Scale,
    },
    /// Number of a rotor, from 1 in command order.
    Rotor,
    /// One of a few names; the value is its index.
    OneOf(&'static [&'static str]),
}

/// What the plausible sizes of a parameter grow with: the same part of a vehicle's own numbers is
/// as much on a nano quadrotor as on a large one. Lengths, times and speeds of the catalogue are
/// those of the air, and stay, but for the speed that a rotor feels: it counts beside that of its
/// blades.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// A fraction, an angle, a time or a speed.
    Fixed,
    /// Forces, with the weight.
    Mass,
    /// Moments that go with rates, with the mean inertia.
    Inertia,
    /// Lengths on the airframe, with the mean arm.
    Arm,
    /// Moments of forces.
    MassTimesArm,
    /// Gains of thrust over a speed, with the inverse of the blade tips' in hover: the same at the
    /// same advance ratio. Not below the reference vehicle's: most files do not say how large
    /// propellers are, and what is taken then is too large rather than too small.
    PerTipSpeed,
    /// The same over a speed squared.
    PerTipSpeedSquared,
}

/// Mass, kg, mean inertia about roll and pitch, kg m^2, mean arm, m, and speed of the blade tips in
/// hover, m/s, of the vehicle that sizes are written for: the paper's (Table I; its propellers are
/// assumed to have 4 inches).
const REFERENCE: [f64; 4] = [0.548, 3.95e-3, 0.1202, 76.02];

impl Scale {
    /// How many times the reference vehicle's sizes those of a vehicle are.
    fn of(self, vehicle: &Vehicle<f64>) -> f64 {
        let p = vehicle.parameters();
        let [mass_kg, inertia_kg_m2, arm_m, tip_m_s] = REFERENCE;
        let rotors = vehicle.rotors();
        let arms = rotors.iter().map(|rotor| rotor.position.vector.xy().norm());
        let mass = p.mass_kg / mass_kg;
        let arm = arms.sum::<f64>() / (rotors.len().max(1) as f64 * arm_m);
        let slower = || {
            let propulsion = &p.propulsion;
            let per_rotor_n = vehicle.weight_n() / rotors.len().max(1) as f64;
            let hover_rad_s = sqrt(per_rotor_n / propulsion.thrust_coefficient_n_s2);
            (tip_m_s / (propulsion.propeller_radius_m * hover_rad_s)).max(1.0)
        };
        match self {
            Self::Fixed => 1.0,
            Self::Mass => mass,
            Self::Inertia => {
                0.5 * (p.inertia_kg_m2[(0, 0)] + p.inertia_kg_m2[(1, 1)]) / inertia_kg_m2
            }
            Self::Arm => arm,
            Self::MassTimesArm => mass * arm,
            Self::PerTipSpeed => slower(),
            Self::PerTipSpeedSquared => slower() * slower(),
        }
    }
}

/// Plausible sizes of a parameter on one vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SizeRange {
    /// Smallest size worth reporting.
    pub smallest: f64,
    /// Largest plausible size.
    pub largest: f64,
    /// Whether it may be negative.
    pub signed: bool,
    /// What both sizes grow with.
    pub scale: Scale,
}

/// One parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffectParameter {
    /// Key in files, with its unit: `extra_time_constant_s`.
    pub key: &'static str,
    /// What it is.
    pub kind: Kind,
    /// The forms of the effect in which it exists; `None` for all.
    pub forms: Option<&'static [&'static str]>,
    /// How far it may be off without being worth a name.
    pub tolerance: Tolerance,
    /// Whether it is never larger than its largest plausible size, whatever flights ask for.
    pub is_capped: bool,
    /// Of a form: those that are looked for by themselves beside the standard one, because what one
    /// explains says nothing of the other.
    pub sought: &'static [&'static str],
    /// Of a size with a sign: forms in which nothing makes it negative.
    pub positive_in: &'static [&'static str],
}

/// Key of the parameter that chooses the form of an effect.
pub const FORM: &str = "form";

impl EffectParameter {
    const fn new(key: &'static str, kind: Kind) -> Self {
        let tolerance = Tolerance::PartOfSmallest;
        Self { key, kind, forms: None, tolerance, is_capped: false, sought: &[], positive_in: &[] }
    }
    /// A size that is not negative.
    const fn size(key: &'static str, smallest: f64, largest: f64) -> Self {
        Self::new(key, Kind::Size { smallest, largest, signed: false, scale: Scale::Fixed })
    }
    /// A size with a sign.
    const fn signed(key: &'static str, smallest: f64, largest: f64) -> Self {
        Self::new(key, Kind::Size { smallest, largest, signed: true, scale: Scale::Fixed })
    }
    /// The choice of a form, the standard one first.
    const fn form(names: &'static [&'static str]) -> Self {
        Self::new(FORM, Kind::OneOf(names))
    }
    /// The same, with sizes that grow with the vehicle.
    const fn growing_with(mut self, with: Scale) -> Self {
        if let Kind::Size { smallest, largest, signed, .. } = self.kind {
            self.kind = Kind::Size { smallest, largest, signed, scale: with };
        }
        self
    }
    const fn only_in(mut self, forms: &'static [&'static str]) -> Self {
        self.forms = Some(forms);
        self
    }
    /// The same, changing a number of the vehicle file.
    const fn declared(self, number: Declared) -> Self {
        self.within(Tolerance::Declared(number))
    }
    /// The same with a tolerance.
    const fn within(mut self, tolerance: Tolerance) -> Self {
        self.tolerance = tolerance;
        self
    }
    /// The same, never larger than plausible.
    const fn capped(mut self) -> Self {
        self.is_capped = true;
        self
    }
    /// The same choice of a form, some of them looked for by themselves.
    const fn seeking(mut self, forms: &'static [&'static str]) -> Self {
        self.sought = forms;
        self
    }
    /// The same size, never negative in some forms.
    const fn positive_in(mut self, forms: &'static [&'static str]) -> Self {
        self.positive_in = forms;
        self
    }
    /// Its plausible sizes on a vehicle in a form; `None` for what counts or chooses.
    pub fn range_in(&self, form: &str, vehicle: &Vehicle<f64>) -> Option<SizeRange> {
        let range = self.range(vehicle)?;
        Some(SizeRange { signed: range.signed && !self.positive_in.contains(&form), ..range })
    }
    /// Its plausible sizes on a vehicle in any form; `None` for what counts or chooses.
    pub fn range(&self, vehicle: &Vehicle<f64>) -> Option<SizeRange> {
        let Kind::Size { smallest, largest, signed, scale } = self.kind else { return None };
        let times = scale.of(vehicle);
        Some(SizeRange { smallest: smallest * times, largest: largest * times, signed, scale })
    }
    /// The number of the base model that it adds to, with its field in vehicle files, where the sum
    /// cannot be less than nothing: a drag, an area, a lag.
    pub fn base_number(&self, vehicle: &Vehicle<f64>) -> Option<(&'static str, f64)> {
        let p = vehicle.parameters();
        let Tolerance::Declared(number) = self.tolerance else { return None };
        Some(match number {
            Declared::LinearDrag(0) => ("drag.linear_n_s_per_m[0]", p.drag.linear_n_s_per_m.x),
            Declared::LinearDrag(1) => ("drag.linear_n_s_per_m[1]", p.drag.linear_n_s_per_m.y),
            Declared::LinearDrag(_) => ("drag.linear_n_s_per_m[2]", p.drag.linear_n_s_per_m.z),
            Declared::DragArea => ("drag.area_m2", p.drag.area_m2),
            Declared::RotorLag => ("propulsion.time_constant_s", p.propulsion.time_constant_up_s),
            Declared::WingLag => {
                ("wing.time_constant_s", p.wing.map_or(0.0, |wing| wing.time_constant_s))
            }
            _ => return None,
        })
    }
    /// Whether it exists in a form.
    pub fn exists_in(&self, form: &str) -> bool {
        self.forms.is_none_or(|forms| forms.contains(&form))
    }
}

/// The forms that a list of parameters offers, the standard one first; empty for an effect with one
/// form.
pub fn forms(parameters: &[EffectParameter]) -> &'static [&'static str] {
    match parameters.iter().find(|p| p.key == FORM).map(|p| p.kind) {
        Some(Kind::OneOf(names)) => names,
        _ => &[],
    }
}

/// Whether the value of a parameter that counts or chooses is `number`.
#[inline(always)]
fn is<T: Real>(value: T, number: usize) -> bool {
    value == real(number as f64)
}

/// A lag, s, that is shorter upwards by a fraction and longer downwards. A negative one shortens
/// the base model's own: what the two leave below 0 is no lag.
#[inline(always)]
fn up_and_down<T: Real>(lag_s: T, asymmetry: T) -> [T; 2] {
    [lag_s * (T::one() - asymmetry), lag_s * (T::one() + asymmetry)]
}

/// What an effect that makes a force may look at.
#[derive(Debug, Clone, Copy)]
pub struct Situation<'a, L> {
    /// Motion through the air.
    pub flow: &'a Airflow<L>,
    /// Angular rate of the airframe, rad/s, whether the air turns or not.
    pub omega: &'a [L; 3],
    /// Thrust of all rotors, N, effects on thrust included.
    pub thrust_n: L,
    /// Speed of each, rad/s.
    pub rotor_speed: &'a [L],
    /// What effects make of the thrust of each.
    pub thrust_factor: L,
    /// Force of rotors, drag and wings, body frame, N, before effects that add to it.
    pub force: [L; 3],
    /// Sum of the rotor speeds about +z, each with the sign of its spin, rad/s, and its rate,
    /// rad/s^2; 0 where no effect [feels it](Acts::FEELS_ROTOR_SPIN).
    pub rotor_spin: [L; 2],
    /// Force of its wings alone, likewise, N.
    pub wing_force: [L; 3],
    /// The vehicle's wings; without area where it has none.
    pub wings: &'a flat_plate::Pair<L>,
    /// Deployment of the left and the right wing, 0..1.
    pub deployment: [L; 2],
}

/// A physical effect: what it is called, its numbers, and where it acts.
pub trait Effect<T: Real>: Copy {
    /// Standard name; the id in vehicle files and verdicts.
    const NAME: &'static str;
    /// The parameters, in the order in which the effect stores them.
    const PARAMETERS: &'static [EffectParameter];
    /// How it is spoken of.
    const WORDS: Words;
    /// What it is known by.
    const SHOWN: Shown;
    /// How what it does grows with its numbers.
    const RESPONSE: Response = Response::Linear;
    /// Which fits may move its numbers without naming it.
    const FITTED: Fitted = Fitted::Always;
    /// What is no effect and makes the same.
    const MIMIC: Mimic = Mimic::Nothing;
    /// The ratio that flights show instead of what it changes.
    const SIDE_OF: Option<SideOf> = None;
    /// What time it is about.
    const TIMING: Option<Timing> = None;
    /// Whether it makes moments and next to no force.
    const IS_OF_MOMENTS: bool = false;
    /// Whether only a vehicle with wings can have it.
    const IS_OF_WINGS: bool = false;
    /// Whether it acts only in a state that most flights never come to, so that flights which do not
    /// show it lack nothing.
    const IS_OF_A_STATE: bool = false;
    /// Whether it fades with height, so that the zero of the barometer matters to it.
    const FEELS_HEIGHT: bool = false;
    /// Whether it acts on sensors and stamps alone, which a flight without them does not show.
    const IS_OF_SENSORS: bool = false;
    /// Whether it acts between steps, on commands or on the air.
    const ACTS_BETWEEN_STEPS: bool = false;
    /// Whether each form beyond the standard one is an equation of its own, that a batch has a
    /// place for or not.
    const FORMS_APART: bool = false;
    /// The number of its form that acts at the rotors' hubs, by [`Effect::at_rotors`] alone: its own
    /// equation has the vehicle's numbers then.
    const AT_ROTORS: Option<usize> = None;

    /// Whether a vehicle has some of it as a number of its own, to which the effect adds.
    #[inline(always)]
    fn is_declared(_vehicle: &Vehicle<T>) -> bool {
        false
    }
    /// Gusts that the effect adds to the air.
    #[inline(always)]
    fn gust(&self) -> Option<GustSpectrum<T>> {
        None
    }
    /// What the effect adds to the rotor lag, s: speeding up, slowing down.
    #[inline(always)]
    fn rotor_extra_time_constant_s(&self) -> [T; 2] {
        [T::zero(); 2]
    }
    /// What the effect adds to the lag of wing deployment, s: opening, closing.
    #[inline(always)]
    fn wing_extra_time_constant_s(&self) -> [T; 2] {
        [T::zero(); 2]
    }
    /// Time by which commands of rotors and wings act late, s.
    #[inline(always)]
    fn command_latency_s(&self) -> T {
        T::zero()
    }
    /// Changes the clock that stamps commands.
    #[inline(always)]
    fn command_clock(&self, _clock: &mut CommandClock<T>) {}
    /// What the accelerometer reads too much along each axis, as a fraction.
    #[inline(always)]
    fn accel_scale(&self) -> In<Body, T> {
        nothing()
    }
    /// What the gyroscope reads too much about each axis, as a fraction.
    #[inline(always)]
    fn gyro_scale(&self) -> In<Body, T> {
        nothing()
    }
    /// Bias of the accelerometer, m/s^2.
    ///
    /// * `time_s` - since the flight began
    #[inline(always)]
    fn specific_force_bias(&self, _time_s: T) -> In<Body, T> {
        nothing()
    }
    /// Bias of the measured heading, rad.
    ///
    /// * `time_s` - since the flight began
    #[inline(always)]
    fn heading_bias_rad(&self, _time_s: T) -> T {
        T::zero()
    }
    /// Error of the measured heading while the rotors take the power of hover, rad; in proportion
    /// to [`rotor_load`](crate::vehicle::Vehicle::rotor_load).
    #[inline(always)]
    fn heading_per_load_rad(&self) -> T {
        T::zero()
    }
    /// What the effect adds to the latency of the satellite receiver, s.
    #[inline(always)]
    fn gnss_latency_s(&self) -> T {
        T::zero()
    }
    /// A load that swings under the vehicle.
    #[inline(always)]
    fn pendulum(&self) -> Option<Pendulum<T>> {
        None
    }
    /// What its form at the rotors' hubs does there.
    fn at_rotors(&self, _vehicle: &Vehicle<T>) -> Slopes<T> {
        Slopes::none()
    }
    /// Changes numbers of the airframe.
    #[inline(always)]
    fn alter(&self, _airframe: &mut Alteration<T>) {}
    /// Where the effect puts the accelerometer, from the centre of mass, m.
    #[inline(always)]
    fn accelerometer_position(&self) -> In<Body, T> {
        nothing()
    }
}

/// Which forms of an effect there are, a bit each; none where the effect is absent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Forms(u8);

impl Forms {
    /// One form, by its number; 0 for the standard one, and for an effect that has no forms.
    #[inline(always)]
    pub fn only(form: usize) -> Self {
        Self(1 << (form & 7))
    }
    /// Whether the effect is there in any form.
    #[inline(always)]
    pub fn any(self) -> bool {
        self.0 != 0
    }
    /// Whether a form is there.
    #[inline(always)]
    pub fn has(self, form: usize) -> bool {
        self.0 & Self::only(form).0 != 0
    }
    /// Those of either.
    #[inline(always)]
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
    /// Whether a batch that has the others has no place for these.
    ///
    /// * `apart` - see [`Effect::FORMS_APART`]
    fn are_beyond(self, other: Self, apart: bool) -> bool {
        let special = self.0 & !Self::only(0).0;
        self.any() && (!other.any() || apart && special & !other.0 != 0)
    }
}

/// What an effect does in every step: its equation, over the numbers that its `prepare` makes of
/// its parameters once.
///
/// On registers the vehicles of a batch may have it in several forms: `forms` are those that any of
/// them has, and the numbers of a form that a vehicle does not have make no difference to it.
pub trait Acts<L: Lane>: Copy {
    /// Whether its wrench depends on how fast the rotors spin, which is dear to sum up.
    const FEELS_ROTOR_SPIN: bool = false;
    /// Whether it [adds wind](Acts::wind).
    const BLOWS: bool = false;

    /// Wind that the effect adds, north and east, m/s.
    ///
    /// * `height_m` - above the origin's level
    #[inline(always)]
    fn wind(&self, _height_m: L, _forms: Forms) -> [L; 2] {
        [absent(); 2]
    }
    /// Changes the steady rotor speeds, rad/s.
    #[inline(always)]
    fn rotor_targets<const ROTORS: usize>(
        &self,
        _targets: &mut [L; ROTORS],
        _voltage_v: L,
        _forms: Forms,
    ) {
    }
    /// Factor on the thrust of all rotors, and so on their roll and pitch moments.
    ///
    /// * `height_m` - above the origin's level
    #[inline(always)]
    fn thrust_factor(&self, _flow: &Airflow<L>, _height_m: L, _forms: Forms) -> L {
        L::of(1.0)
    }
    /// Mass of the air that moves with the vehicle along body z, kg.
    #[inline(always)]
    fn added_mass_kg(&self) -> L {
        absent()
    }
    /// Force and moment that the effect adds.
    #[inline(always)]
    fn wrench(&self, _at: &Situation<'_, L>, _forms: Forms) -> BodyWrench<L> {
        BodyWrench { force: [absent(); 3], moment: [absent(); 3] }
    }
}

/// Zero with the sign that changes no sum: the compiler drops `x + -0.0`, but not `x + 0.0`, which
/// turns -0 into 0. So an effect that does not act somewhere costs nothing there.
#[inline(always)]
fn nothing<F: Frame, T: Real>() -> In<F, T> {
    In::new(Vector3::repeat(-T::zero()))
}

/// The same for a lane.
#[inline(always)]
fn absent<L: Lane>() -> L {
    L::of(-0.0)
}

#[cfg(test)]
mod tests;
