//! The effects of `squirrel_core::effects` on registers, all forms of each in one equation.
//!
//! Which effects there are is decided for a whole batch ([`Present`]); what is absent is not computed, and a vehicle without an
//! effect that others have has its zero. What only changes numbers of the airframe is done by `squirrel_core` once, when a
//! vehicle is put in; latency and gusts act between steps (`extra`), servo lag in `servo`, sag in `dynamics`.

use super::error::BatchError;
use super::maths::{all, exp, ln, size};
use super::rows::rows;
use super::simd::{Lanes, Paths};
use super::wing::{Air, Plate, Wrench};
use squirrel_core::effects::{Effects, FORM, Pendulum, PendulumState, forms};
use squirrel_core::frames::In;
use squirrel_core::math::{AIR_DENSITY_KG_M3, GRAVITY_M_S2};
use squirrel_core::nalgebra::{Vector2, Vector3};
use squirrel_core::vehicle::Vehicle;

/// Effects that a batch of vehicles without sensors cannot show.
const OF_SENSORS: [&str; 8] = [
    "accel_bias",
    "accel_scale",
    "clock_skew",
    "clock_step",
    "compass_current",
    "gnss_latency",
    "gyro_scale",
    "heading_bias",
];
/// Roughness beyond which the logarithmic law means nothing, m.
const ROUGHNESS_MAX_M: f64 = 4.0;

rows! {
    /// Sizes of the effects of a vehicle; see the effect of each name.
    Sizes {
        added_mass,
        damping [2],
        inflow [2],
        sag_exponent, sag_load_gain, sag_linear, per_reference_voltage, per_speed_max,
        cg [3],
        wind [2],
        /// Factor of the wind: the first, and the second times `ln(max(h, floor) / z0)`.
        profile [2], profile_floor, per_roughness,
        flapping, flapping_per_speed,
        ground_radius, ground_floor, ground_gain, ground_per_radius,
        drag [3],
        areas [3],
        rotor_inertia,
        misalignment [2],
        lift, lift_limit, lift_linear,
        /// Left and right.
        wing_loss [2],
        wing_gain, wing_offset, wing_filled, wing_per_full_speed,
        load_weight, load_weight_per_length, load_stiffness, load_decay, load_cosine, load_sine, load_trail,
    }
}

rows! {
    /// Where the load hangs, north and east of the vehicle.
    Payload { offset [2], velocity [2] }
}

/// Which effects some vehicle of a batch has, where they act in every step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[allow(clippy::struct_excessive_bools, reason = "one for each place where effects act")]
pub(super) struct Present {
    pub(super) added_mass: bool,
    pub(super) angular_damping: bool,
    pub(super) axial_inflow: bool,
    pub(super) battery_sag: bool,
    pub(super) cg_offset: bool,
    pub(super) constant_wind: bool,
    pub(super) log_profile: bool,
    pub(super) flapping_moment: bool,
    pub(super) ground_effect: bool,
    pub(super) ground_exponential: bool,
    pub(super) linear_drag: bool,
    pub(super) payload_swing: bool,
    pub(super) quadratic_drag: bool,
    pub(super) rotor_gyro_torque: bool,
    pub(super) thrust_misalignment: bool,
    pub(super) translational_lift: bool,
    pub(super) wing_asymmetry: bool,
    pub(super) wing_membrane: bool,
    pub(super) gust: bool,
    pub(super) actuation_latency: bool,
}

/// A flag of [`Present`], by the name of its effect or form.
type Flag = (&'static str, fn(&mut Present) -> &mut bool);

const FLAGS: [Flag; 20] = [
    ("added_mass", |p| &mut p.added_mass),
    ("angular_damping", |p| &mut p.angular_damping),
    ("axial_inflow", |p| &mut p.axial_inflow),
    ("battery_sag", |p| &mut p.battery_sag),
    ("cg_offset", |p| &mut p.cg_offset),
    ("constant_wind", |p| &mut p.constant_wind),
    ("constant_wind.log_profile", |p| &mut p.log_profile),
    ("flapping_moment", |p| &mut p.flapping_moment),
    ("ground_effect", |p| &mut p.ground_effect),
    ("ground_effect.exponential", |p| &mut p.ground_exponential),
    ("linear_drag", |p| &mut p.linear_drag),
    ("payload_swing", |p| &mut p.payload_swing),
    ("quadratic_drag", |p| &mut p.quadratic_drag),
    ("rotor_gyro_torque", |p| &mut p.rotor_gyro_torque),
    ("thrust_misalignment", |p| &mut p.thrust_misalignment),
    ("translational_lift", |p| &mut p.translational_lift),
    ("wing_asymmetry", |p| &mut p.wing_asymmetry),
    ("wing_membrane", |p| &mut p.wing_membrane),
    ("gust", |p| &mut p.gust),
    ("actuation_latency", |p| &mut p.actuation_latency),
];

/// Sizes and form of an effect that is present.
struct Found {
    sizes: Vec<f64>,
    form: &'static str,
}

impl Found {
    /// * `name` - of an effect
    fn new(effects: &Effects<f64>, name: &str) -> Option<Self> {
        // Reading by name is a method of those that may be changed.
        let mut copy = *effects;
        let found = copy.get_mut(name)?;
        let names = forms(found.parameters);
        let chosen =
            found.parameters.iter().position(|p| p.key == FORM).map_or(0, |i| found.values[i] as usize);
        let form = names.get(chosen).copied().unwrap_or("");
        let exists = |p: &squirrel_core::effects::EffectParameter| form.is_empty() || p.exists_in(form);
        // A size that the form does not have is zero.
        let sizes = found.parameters.iter().zip(found.values.iter());
        Some(Self { sizes: sizes.map(|(p, x)| if exists(p) { *x } else { 0.0 }).collect(), form })
    }
}

impl Present {
    /// What a vehicle has.
    ///
    /// # Errors
    /// An effect that does not act in a batch.
    pub(super) fn of(effects: &Effects<f64>, vehicle: usize) -> Result<Self, BatchError> {
        if let Some(effect) = OF_SENSORS.into_iter().find(|name| effects.has(name)) {
            return Err(BatchError::Effect { vehicle, effect });
        }
        let mut present = Self::default();
        for (name, flag) in FLAGS {
            let (effect, form) = name.split_once('.').unwrap_or((name, ""));
            *flag(&mut present) =
                Found::new(effects, effect).is_some_and(|found| form.is_empty() || found.form == form);
        }
        Ok(present)
    }

    /// What either has.
    pub(super) fn or(mut self, mut other: Self) -> Self {
        for (_, flag) in FLAGS {
            *flag(&mut self) |= *flag(&mut other);
        }
        self
    }

    /// The name of an effect that `self` has and `other` lacks.
    pub(super) fn beyond(mut self, mut other: Self) -> Option<&'static str> {
        FLAGS.into_iter().find(|(_, flag)| *flag(&mut self) && !*flag(&mut other)).map(|(name, _)| name)
    }

    /// Whether any acts in the derivative or on the rotors.
    pub(super) fn any_in_steps(self) -> bool {
        let mut between = Self { gust: true, actuation_latency: true, ..Self::default() };
        let mut present = self;
        FLAGS.into_iter().any(|(_, flag)| *flag(&mut present) && !*flag(&mut between))
    }
}

impl<S: Paths> Sizes<S> {
    /// The sizes of a vehicle's effects; zero, and what makes no difference, for those that it does not have.
    pub(super) fn new(effects: &Effects<f64>, vehicle: &Vehicle<f64>, dt_s: f64) -> Self {
        let mut s = Sizes::<f64>::absent();
        let values = |name: &str| Found::new(effects, name).map(|found| (found.sizes, found.form));
        if let Some((v, _)) = values("added_mass") {
            s.added_mass = v[0];
        }
        if let Some((v, _)) = values("angular_damping") {
            s.damping = [v[0], v[1]];
        }
        if let Some((v, _)) = values("axial_inflow") {
            s.inflow = [v[0], v[1]];
        }
        if let Some((v, form)) = values("battery_sag") {
            let propulsion = &vehicle.parameters().propulsion;
            s.per_reference_voltage = propulsion.reference_voltage_v;
            s.per_speed_max = propulsion.speed_max_rad_s;
            (s.sag_exponent, s.sag_load_gain) = (v[0], v[1]);
            s.sag_linear = if form == "linear" { 1.0 } else { 0.0 };
        }
        if let Some((v, _)) = values("cg_offset") {
            s.cg = [v[0], v[1], v[2]];
        }
        if let Some((v, form)) = values("constant_wind") {
            s.wind = [v[0], v[1]];
            if form == "log_profile" && v[2] > 0.0 {
                let z0 = v[2].min(ROUGHNESS_MAX_M);
                s.profile = [0.0, 1.0 / (10.0 / z0).ln()];
                (s.profile_floor, s.per_roughness) = (2.0 * z0, 1.0 / z0);
            }
        }
        if let Some((v, form)) = values("flapping_moment") {
            s.flapping = v[0];
            if form == "saturating" {
                // A scale of 0 saturates at once.
                s.flapping = if v[1] > 0.0 { v[0] } else { 0.0 };
                s.flapping_per_speed = if v[1] > 0.0 { 1.0 / v[1] } else { 0.0 };
            }
        }
        if let Some((v, form)) = values("ground_effect") {
            if form == "exponential" {
                s.ground_gain = if v[0] > 0.0 { v[1] } else { 0.0 };
                s.ground_per_radius = if v[0] > 0.0 { 1.0 / v[0] } else { 0.0 };
            } else {
                s.ground_radius = v[0];
                s.ground_floor = if v[0] > 0.0 { 0.5 * v[0] } else { 1.0 };
            }
        }
        if let Some((v, form)) = values("linear_drag") {
            s.drag = if form == "anisotropic" {
                [v[0] * (1.0 + v[1]), v[0] * (1.0 - v[1]), v[2]]
            } else {
                [v[0], v[0], 0.0]
            };
        }
        if let Some((v, form)) = values("quadratic_drag") {
            let areas = if form == "anisotropic" {
                [v[0] * (1.0 + v[1]), v[0] * (1.0 - v[1]), v[2]]
            } else {
                [v[0]; 3]
            };
            s.areas = areas.map(|area| 0.5 * AIR_DENSITY_KG_M3 * area);
        }
        if let Some((v, _)) = values("rotor_gyro_torque") {
            s.rotor_inertia = v[0];
        }
        if let Some((v, _)) = values("thrust_misalignment") {
            s.misalignment = [v[0], v[1]];
        }
        if let Some((v, form)) = values("translational_lift") {
            (s.lift, s.lift_linear) = (v[0], v[1]);
            s.lift_limit = if form == "saturating" { 0.004 } else { 0.0 };
        }
        if let Some((v, _)) = values("wing_asymmetry") {
            s.wing_loss = if v[0] == 0.0 { [v[1], 0.0] } else { [0.0, v[1]] };
        }
        if let Some((v, form)) = values("wing_membrane") {
            (s.wing_gain, s.wing_offset) = (v[0], v[1]);
            if form == "speed_dependent" && v[2] > 0.0 {
                (s.wing_filled, s.wing_per_full_speed) = (0.0, 1.0 / v[2]);
            }
        }
        if let Some(load) = effects.pendulum() {
            s.hang(&load, dt_s);
        }
        s.cast()
    }
}

impl Sizes<f64> {
    fn absent() -> Self {
        Self {
            per_reference_voltage: 1.0,
            per_speed_max: 1.0,
            profile: [1.0, 0.0],
            profile_floor: 1.0,
            per_roughness: 1.0,
            ground_floor: 1.0,
            wing_filled: 1.0,
            ..Self::all(0.0)
        }
    }

    /// What a load does in a step, which is linear in where it hangs, asked of the core.
    fn hang(&mut self, load: &Pendulum<f64>, dt_s: f64) {
        let stiffness = GRAVITY_M_S2 / load.length_m;
        let mut state = PendulumState { offset_m: Vector2::zeros(), velocity_m_s: Vector2::new(1.0, 0.0) };
        load.lead(&mut state, In::new(Vector3::zeros()), dt_s);
        let decay = 0.5 * load.damping_per_s;
        self.load_sine = state.offset_m.x;
        self.load_cosine = state.velocity_m_s.x + decay * self.load_sine;
        (self.load_stiffness, self.load_decay) = (stiffness, decay);
        self.load_trail = -1.0 / stiffness;
        self.load_weight = load.mass_kg * GRAVITY_M_S2;
        self.load_weight_per_length = self.load_weight / load.length_m;
    }
}

/// What effects may look at.
#[derive(Clone, Copy)]
pub(super) struct Situation<'a, L> {
    pub(super) air: &'a Air<L>,
    /// Body axes by columns, NED.
    pub(super) columns: &'a [[L; 3]; 3],
    pub(super) height: L,
    pub(super) inverse_mass: L,
    /// Sum of rotor speeds about +z, and its rate.
    pub(super) spin: [L; 2],
    pub(super) plate: &'a Plate<L>,
    pub(super) deployment: &'a [L; 2],
    pub(super) load: &'a Payload<L>,
}

impl<L: Lanes> Sizes<L> {
    /// Wind that effects add, north and east.
    #[inline(always)]
    pub(super) fn wind(&self, present: Present, height: L) -> [L; 2] {
        let mut factor = self.profile[0];
        if present.log_profile {
            factor = factor + self.profile[1] * ln(height.upper(self.profile_floor) * self.per_roughness);
        }
        [self.wind[0] * factor, self.wind[1] * factor]
    }

    /// Steady rotor speed that the voltage leaves of a target.
    #[inline(always)]
    pub(super) fn sag<const ROTORS: usize>(&self, targets: &[L; ROTORS], voltage: L) -> [L; ROTORS] {
        let (one, mut sagged) = (all::<L>(1.0), *targets);
        let ratio = (voltage / self.per_reference_voltage).upper(L::zero());
        let linear = (one + self.sag_exponent * (ratio - one)).upper(L::zero());
        let logarithm = ln(ratio);
        for i in 0..ROTORS {
            let load = targets[i] / self.per_speed_max - all(0.5);
            let exponent = self.sag_exponent * (one + self.sag_load_gain * load);
            let factor = self.sag_linear.where_positive(linear, exp(exponent * logarithm));
            sagged[i] = targets[i] * factor;
        }
        sagged
    }

    /// Factor on the thrust of all rotors.
    #[inline(always)]
    pub(super) fn thrust_factor(&self, present: Present, air: &Air<L>, height: L) -> L {
        let one = all::<L>(1.0);
        let mut factor = one;
        let [u, v, w] = air.velocity;
        if present.axial_inflow {
            factor = factor * (one + self.inflow[0] * w + self.inflow[1] * w * size(w));
        }
        if present.ground_effect {
            let ratio = self.ground_radius / height.upper(self.ground_floor);
            factor = factor * (one / (one - ratio * ratio * all(1.0 / 16.0)));
        }
        if present.ground_exponential {
            let ratio = height.upper(L::zero()) * self.ground_per_radius;
            factor = factor * (one + self.ground_gain * exp(L::zero() - ratio));
        }
        if present.translational_lift {
            let across = u * u + v * v;
            let rise =
                self.lift * across / (one + across * self.lift_limit) + self.lift_linear * across.root();
            factor = factor * (one + rise);
        }
        factor
    }

    /// Rotors, and all the rest, with everything that effects do to them.
    #[inline(always)]
    pub(super) fn act(
        &self,
        present: Present,
        rotors: &Wrench<L>,
        rest: &Wrench<L>,
        at: &Situation<'_, L>,
    ) -> Wrench<L> {
        let one = all::<L>(1.0);
        let air = at.air;
        let ([u, v, _], [p, q, r]) = (air.velocity, air.omega);
        let factor = self.thrust_factor(present, air, at.height);
        let lift = rotors.force[2] * factor;
        let base = [rest.force[0], rest.force[1], lift + rest.force[2]];
        let mut force = base;
        let mut moment = [
            rotors.moment[0] * factor + rest.moment[0],
            rotors.moment[1] * factor + rest.moment[1],
            rotors.moment[2] + rest.moment[2],
        ];
        if present.angular_damping {
            let [linear, quadratic] = self.damping;
            moment[0] = moment[0] - (p * linear + p * size(p) * quadratic);
            moment[1] = moment[1] - (q * linear + q * size(q) * quadratic);
            moment[2] = moment[2] - (r * linear + r * size(r) * quadratic) * all(0.5);
        }
        if present.cg_offset {
            let [x, y, z] = self.cg;
            moment[0] = moment[0] - (y * base[2] - z * base[1]);
            moment[1] = moment[1] - (z * base[0] - x * base[2]);
            moment[2] = moment[2] - (x * base[1] - y * base[0]);
        }
        if present.flapping_moment {
            let slope = self.flapping / (one + (u * u + v * v).root() * self.flapping_per_speed);
            moment[0] = moment[0] - v * slope;
            moment[1] = moment[1] + u * slope;
        }
        if present.linear_drag {
            for i in 0..3 {
                force[i] = force[i] - self.drag[i] * air.velocity[i];
            }
        }
        if present.quadratic_drag {
            for i in 0..3 {
                force[i] = force[i] - self.areas[i] * air.velocity[i] * air.speed;
            }
        }
        if present.rotor_gyro_torque {
            let [spin, rate] = at.spin;
            moment[0] = moment[0] - q * spin * self.rotor_inertia;
            moment[1] = moment[1] + p * spin * self.rotor_inertia;
            moment[2] = moment[2] - rate * self.rotor_inertia;
        }
        if present.thrust_misalignment {
            force[0] = force[0] + lift * self.misalignment[0];
            force[1] = force[1] + lift * self.misalignment[1];
        }
        if present.wing_asymmetry || present.wing_membrane {
            let flat = at.plate.normal_forces(air, at.deployment);
            let filled = (self.wing_filled + air.speed * self.wing_per_full_speed).lower(one);
            let gain = self.wing_gain * filled;
            let turned = at.plate.per_speed * air.speed * u * self.wing_offset * (one + gain);
            let mut more = flat;
            for side in 0..2 {
                more[side] =
                    flat[side] * gain + turned * at.deployment[side] - flat[side] * self.wing_loss[side];
            }
            let wrench = at.plate.wrench(more);
            force[2] = force[2] + wrench.force[2];
            moment[0] = moment[0] + wrench.moment[0];
        }
        if present.payload_swing {
            let [north, east] = at.load.offset;
            let pull =
                [north * self.load_weight_per_length, east * self.load_weight_per_length, self.load_weight];
            for i in 0..3 {
                let column = at.columns[i];
                force[i] = force[i] + (column[0] * pull[0] + column[1] * pull[1] + column[2] * pull[2]);
            }
        }
        if present.added_mass {
            let turning = p * v - q * u;
            let gravity = at.columns[2][2] * all(GRAVITY_M_S2);
            let rate =
                (force[2] * at.inverse_mass + gravity - turning) / (one + self.added_mass * at.inverse_mass);
            force[2] = force[2] - self.added_mass * rate;
        }
        Wrench { force, moment }
    }

    /// Moves the load on by a step, in which the vehicle accelerates evenly.
    #[inline(always)]
    pub(super) fn swing(&self, load: &mut Payload<L>, acceleration: [L; 2]) {
        for i in 0..2 {
            let trail = acceleration[i] * self.load_trail;
            let (x, v) = (load.offset[i] - trail, load.velocity[i]);
            load.offset[i] = trail + x * self.load_cosine + (v + x * self.load_decay) * self.load_sine;
            load.velocity[i] =
                v * self.load_cosine - (v * self.load_decay + x * self.load_stiffness) * self.load_sine;
        }
    }
}
