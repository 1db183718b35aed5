//! Gains of the flight code from the numbers of an airframe, by a stated rule.
//!
//! The laws ask for accelerations, so inertia and mass are in them already; what bounds their gains
//! is how late a rotor answers, of which the lead leaves a third. Those of the attitude are the
//! fastest that have the margins of [`super::super::margins`], which `squirrel vehicle check`
//! shows. Their integral holds a centre of mass that is [`CENTRE_OFF_SHARE`] of the arm beside the
//! middle. The outer loop, which must stay slower, is `vehicles/squirrel.toml`'s, scaled by the
//! root of the time in which a rotor and the command filter answer. Yaw is turned by reaction
//! torque alone: its gains are capped by the acceleration that is to be had.

use super::super::margins::gains_for_margins;

/// What the rule looks at.
#[derive(Debug, Clone, Copy)]
pub(super) struct Airframe {
    pub(super) weight_n: f64,
    pub(super) thrust_max_n: f64,
    pub(super) lag_s: f64,
    /// Reaction torque of a rotor over its thrust, m.
    pub(super) torque_per_thrust_m: f64,
    /// Mean distance of the hubs from the middle, m.
    pub(super) arm_m: f64,
    pub(super) inertia_z_kg_m2: f64,
    pub(super) tilt_max_rad: f64,
    /// Largest moment of inertia over those about x and y.
    pub(super) restoring: [f64; 2],
}

/// Gains that the rule chooses; what is the same for all vehicles is in [`toml`].
#[derive(Debug, Clone, Copy)]
struct Gains {
    c1_per_s: [f64; 3],
    c2_per_s: [f64; 3],
    lambda_per_s2: [f64; 3],
    integral_max_rad_s: f64,
    filter_frequency_rad_s: f64,
    position_per_s: [f64; 3],
    velocity_per_s: [f64; 3],
    acceleration_horizontal_m_s2: f64,
    acceleration_vertical_m_s2: f64,
}

/// Rotor lag of the vehicle whose gains are scaled, and the other delays in its inner loop, s.
const REFERENCE: (f64, f64) = (0.04, 0.03);
/// Lead of the torque demand, see `squirrel_core::control::lead`.
const ROTOR_LEAD: f64 = 3.0;
/// How far beside the middle a centre of mass may be, in arms: a battery that slipped.
const CENTRE_OFF_SHARE: f64 = 0.15;
/// What is late beside the rotors: half a step of the flight code, and a gyro, s.
const DELAY_S: f64 = 0.004;
/// Fastest `c1` of roll and pitch, and of yaw at the acceleration below, 1/s.
const FASTEST_PER_S: [f64; 2] = [12.0, 4.0];
/// Yaw acceleration of that vehicle about hover, rad/s^2.
const REFERENCE_YAW: f64 = 7.6;

impl Airframe {
    /// Most yaw acceleration about hover, rad/s^2.
    fn yaw_acceleration_rad_s2(&self) -> f64 {
        let Self { weight_n, thrust_max_n, .. } = *self;
        let to_spare_n = weight_n.min(thrust_max_n - weight_n).max(0.05 * weight_n);
        self.torque_per_thrust_m * to_spare_n / self.inertia_z_kg_m2
    }

    /// Roll (0) or pitch (1) acceleration of the weight at a centre of mass that is as far off as
    /// may be, rad/s^2.
    fn centre_off_rad_s2(&self, axis: usize) -> f64 {
        let inertia_kg_m2 = self.inertia_z_kg_m2 / self.restoring[axis];
        CENTRE_OFF_SHARE * self.arm_m * self.weight_n / inertia_kg_m2
    }
}

fn by_rule(airframe: &Airframe) -> Gains {
    let (lag_s, other_s) = REFERENCE;
    let quick = ((lag_s + other_s) / (airframe.lag_s + other_s)).clamp(0.5, 1.5);
    let slow = quick.sqrt().min(1.0);
    let yaw = (airframe.yaw_acceleration_rad_s2() / REFERENCE_YAW).sqrt().clamp(0.3, 1.5);
    let [roll_pitch, yaw_fastest] = FASTEST_PER_S;
    let axes = [
        (airframe.restoring[0], roll_pitch),
        (airframe.restoring[1], roll_pitch),
        (1.0, yaw_fastest * yaw),
    ]
    .map(|(restoring, fastest)| {
        gains_for_margins(airframe.lag_s, ROTOR_LEAD, DELAY_S, restoring, fastest)
    });
    let integral_max_rad_s =
        [0, 1].map(|i| airframe.centre_off_rad_s2(i) / (axes[i][1] * axes[i][2]));
    let of = |k: usize| axes.map(|axis| axis[k]);
    let outer = |of: [f64; 3]| of.map(|gain| gain * slow);
    let g = squirrel_core::math::GRAVITY_M_S2;
    let thrust_to_weight = airframe.thrust_max_n / airframe.weight_n;
    Gains {
        c1_per_s: of(0),
        c2_per_s: of(1),
        lambda_per_s2: of(2),
        integral_max_rad_s: integral_max_rad_s[0].max(integral_max_rad_s[1]),
        filter_frequency_rad_s: 14.0 * quick,
        position_per_s: outer([1.6, 1.6, 0.8]),
        velocity_per_s: outer([2.5, 2.5, 1.6]),
        acceleration_horizontal_m_s2: 0.9 * g * airframe.tilt_max_rad.tan(),
        acceleration_vertical_m_s2: (0.4 * g * (thrust_to_weight - 1.0)).clamp(0.5, 3.0),
    }
}

/// The table `[control]` of a vehicle file.
pub(super) fn toml(airframe: &Airframe) -> String {
    let Gains {
        c1_per_s,
        c2_per_s,
        lambda_per_s2,
        integral_max_rad_s,
        filter_frequency_rad_s,
        position_per_s,
        velocity_per_s,
        acceleration_horizontal_m_s2,
        acceleration_vertical_m_s2,
    } = by_rule(airframe);
    let one = super::text::rounded;
    let three = |of: [f64; 3]| format!("{:?}", of.map(one));
    let rule = "by rule: the fastest with the margins of squirrel vehicle check";
    let scaled = "by rule: squirrel.toml's, scaled by the time in which a rotor answers";
    let same = "as squirrel.toml";
    format!(
        "[control]
thrust_min_n = {{ value = {thrust_min:?}, source = \"a tenth of the weight\" }}

[control.attitude]
form = \"quaternion\"
c1_per_s = {{ value = {c1}, source = \"{rule}\" }}
c2_per_s = {{ value = {c2}, source = \"{rule}\" }}
lambda_per_s2 = {{ value = {lambda}, source = \"{rule}\" }}
integral_max_rad_s = {{ value = {integral_max:?}, source = \"by rule: holds a centre of mass 0.15 arms beside the middle\" }}
rotor_lead = {{ value = {ROTOR_LEAD:?}, source = \"by rule: leaves a third of the rotors' lag\" }}
filter_frequency_rad_s = {{ value = {filter:?}, source = \"{scaled}\" }}
filter_damping = {{ value = 1.0, source = \"{same}\" }}

[control.position]
angle_law = \"exact\"
position_per_s = {{ value = {position}, source = \"{scaled}\" }}
velocity_per_s = {{ value = {velocity}, source = \"{scaled}\" }}
integral_per_s2 = {{ value = [0.15, 0.15, 0.15], source = \"{same}\" }}
derivative = {{ value = [0.05, 0.05, 0.05], source = \"{same}\" }}
velocity_feed_forward = {{ value = 0.0, source = \"{same}\" }}
acceleration_max_horizontal_m_s2 = {{ value = {horizontal:?}, source = \"what nine tenths of the tilt limit give\" }}
acceleration_max_vertical_m_s2 = {{ value = {vertical:?}, source = \"by rule: 0.4 of the thrust above the weight\" }}
integral_max_m = {{ value = 2.0, source = \"{same}\" }}

[control.plus]
delay_s = {{ value = {delay:?}, source = \"the command filter's: twice its damping over its frequency\" }}
vertical_weight = {{ value = 0.5, source = \"{same}\" }}
height_band_m = {{ value = 1.5, source = \"{same}\" }}
sink_band_m = {{ value = 0.2, source = \"{same}\" }}
thrust_share = {{ value = 0.5, source = \"{same}\" }}
approach_share = {{ value = 0.5, source = \"{same}\" }}
open_above_m_s2 = {{ value = 0.3, source = \"{same}\" }}
acceleration_max_horizontal_m_s2 = {{ value = 30.0, source = \"{same}\" }}
acceleration_max_vertical_m_s2 = {{ value = {plus_vertical:?}, source = \"twice that of [control.position]\" }}
integral_max_m = {{ value = 30.0, source = \"{same}\" }}

# Without wings these do nothing; the table has to be there.
[control.wing]
test = \"normal\"
thrust_law = \"exact\"
trigger = \"angle\"
open_above_n = 0.1
close_below_n = 0.05
dwell_s = 0.3
",
        thrust_min = one(0.1 * airframe.weight_n),
        c1 = three(c1_per_s),
        c2 = three(c2_per_s),
        lambda = three(lambda_per_s2),
        integral_max = one(integral_max_rad_s),
        filter = one(filter_frequency_rad_s),
        position = three(position_per_s),
        velocity = three(velocity_per_s),
        horizontal = one(acceleration_horizontal_m_s2),
        vertical = one(acceleration_vertical_m_s2),
        delay = one(2.0 / filter_frequency_rad_s),
        plus_vertical = one(2.0 * acceleration_vertical_m_s2),
    )
}
