//! The shape of a vehicle file, table by table; unknown keys are refused.

use crate::quantity::Quantity;
use serde::Deserialize;
use std::collections::BTreeMap;

type Number = Quantity<f64>;
type Triple = Quantity<[f64; 3]>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct VehicleTable {
    pub(super) name: String,
    #[serde(default)]
    pub(super) size_body_m: Option<Triple>,
    pub(super) mass: MassTable,
    pub(super) rotor: Vec<RotorTable>,
    pub(super) propulsion: PropulsionTable,
    #[serde(default)]
    pub(super) drag: DragTable,
    pub(super) wing: Option<WingTable>,
    pub(super) battery: Option<BatteryTable>,
    pub(super) limits: LimitsTable,
    pub(super) control: Option<ControlTable>,
    #[serde(default)]
    pub(super) estimation: EstimationTable,
    #[serde(default)]
    pub(super) sensors: crate::sensors::SensorParameters,
    #[serde(default)]
    pub(super) effects: BTreeMap<String, BTreeMap<String, EffectValue>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct EstimationTable {
    pub(super) filter: Option<String>,
}

/// A parameter of an effect: a number, or a name where there are only a few.
#[derive(Deserialize)]
#[serde(untagged, expecting = "a number, { value, sd, source }, or a name")]
pub(super) enum EffectValue {
    Number(Number),
    Name(String),
}

impl std::fmt::Display for EffectValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(q) => write!(f, "{}", q.0),
            Self::Name(name) => write!(f, "\"{name}\""),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MassTable {
    pub(super) mass_kg: Number,
    pub(super) inertia_kg_m2: Quantity<InertiaValue>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "three principal moments or a 3x3 matrix")]
pub(super) enum InertiaValue {
    Diagonal([f64; 3]),
    Full([[f64; 3]; 3]),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RotorTable {
    pub(super) position_body_m: Triple,
    pub(super) yaw_sign: Number,
    pub(super) thrust_fraction: Option<Number>,
    pub(super) torque_fraction: Option<Number>,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "snake_case")]
pub(super) enum CommandName {
    SpeedFraction,
    PwmUs,
    Duty,
    ThrustN,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PropulsionTable {
    pub(super) command: CommandName,
    pub(super) speed_max_rad_s: Number,
    pub(super) thrust_coefficient_n_s2: Number,
    pub(super) torque_coefficient_n_m_s2: Number,
    pub(super) time_constant_s: Option<Number>,
    pub(super) time_constant_up_s: Option<Number>,
    pub(super) time_constant_down_s: Option<Number>,
    pub(super) propeller_diameter_m: Option<Number>,
    pub(super) axial_inflow_s_per_m: Option<Number>,
    pub(super) translational_lift_s2_per_m2: Option<Number>,
    pub(super) flapping_moment_n_m_s_per_m: Option<Number>,
    pub(super) vortex_ring_fraction: Option<Number>,
    pub(super) reference_voltage_v: Number,
    pub(super) pwm_to_thrust_n: Option<Quantity<[f64; 4]>>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
pub(super) struct DragTable {
    pub(super) linear_n_s_per_m: Option<Triple>,
    pub(super) area_m2: Option<Number>,
}

#[derive(Deserialize, Clone, Copy, PartialEq)]
#[serde(rename_all = "snake_case")]
pub(super) enum WingName {
    None,
    Flat,
    Membrane,
    Parnn,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WingTable {
    pub(super) model: Option<WingName>,
    pub(super) area_per_side_m2: Option<Number>,
    pub(super) normal_force_slope: Option<Number>,
    pub(super) lateral_arm_m: Option<Number>,
    pub(super) longitudinal_arm_m: Option<Number>,
    pub(super) vertical_arm_m: Option<Number>,
    pub(super) chord_m: Option<Number>,
    pub(super) time_constant_s: Option<Number>,
    pub(super) dead_time_s: Option<Number>,
    pub(super) rate_max_per_s: Option<Number>,
    pub(super) parnn_weights: Option<String>,
    #[serde(default)]
    pub(super) membrane: BTreeMap<String, Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BatteryTable {
    pub(super) cells: Quantity<u32>,
    pub(super) capacity_ah: Number,
    pub(super) r0_ohm: Number,
    pub(super) r1_ohm: Number,
    pub(super) tau1_s: Number,
    pub(super) ocv_v_of_charge: Quantity<Vec<[f64; 2]>>,
    pub(super) efficiency: Option<Number>,
    pub(super) idle_current_a: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LimitsTable {
    pub(super) tilt_max_rad: Number,
    pub(super) thrust_max_n: Number,
    pub(super) rotor_thrust_max_n: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ControlTable {
    pub(super) thrust_min_n: Number,
    /// How the flight code believes rotor speed to follow the voltage; if left out, as the effect
    /// `battery_sag` of the file says.
    pub(super) voltage_exponent: Option<Number>,
    pub(super) attitude: AttitudeTable,
    pub(super) position: PositionTable,
    pub(super) wing: WingControlTable,
    pub(super) plus: Option<PlusTable>,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "snake_case")]
pub(super) enum FormName {
    Euler,
    Quaternion,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AttitudeTable {
    pub(super) form: FormName,
    pub(super) c1_per_s: Triple,
    pub(super) c2_per_s: Triple,
    pub(super) lambda_per_s2: Triple,
    pub(super) integral_max_rad_s: Number,
    pub(super) rotor_lead: Option<Number>,
    pub(super) filter_frequency_rad_s: Number,
    pub(super) filter_damping: Number,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "snake_case")]
pub(super) enum AngleLawName {
    SmallAngle,
    Exact,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PositionTable {
    pub(super) angle_law: AngleLawName,
    pub(super) position_per_s: Triple,
    pub(super) velocity_per_s: Triple,
    pub(super) integral_per_s2: Triple,
    pub(super) derivative: Triple,
    pub(super) velocity_feed_forward: Number,
    pub(super) acceleration_max_horizontal_m_s2: Number,
    pub(super) acceleration_max_vertical_m_s2: Number,
    pub(super) integral_max_m: Number,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "snake_case")]
pub(super) enum WingTestName {
    Normal,
    Acceleration,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "snake_case")]
pub(super) enum ThrustLawName {
    Literal,
    Exact,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "snake_case")]
pub(super) enum TriggerName {
    Angle,
    AngleOrThrust,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WingControlTable {
    pub(super) test: WingTestName,
    pub(super) thrust_law: ThrustLawName,
    pub(super) trigger: TriggerName,
    pub(super) open_above_n: Number,
    pub(super) close_below_n: Number,
    pub(super) dwell_s: Number,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PlusTable {
    pub(super) delay_s: Number,
    pub(super) vertical_weight: Number,
    pub(super) height_band_m: Number,
    pub(super) sink_band_m: Option<Number>,
    pub(super) thrust_share: Number,
    #[serde(default = "approach_share")]
    pub(super) approach_share: Number,
    pub(super) open_above_m_s2: Number,
    pub(super) acceleration_max_horizontal_m_s2: Number,
    pub(super) acceleration_max_vertical_m_s2: Number,
    pub(super) integral_max_m: Option<Number>,
    /// What the file's effects say, if it is left out.
    pub(super) wing_download_n: Option<Number>,
    #[serde(default)]
    pub(super) tilt_limit: TiltLimitName,
}

#[derive(Deserialize, Clone, Copy, Default)]
#[serde(rename_all = "snake_case")]
pub(super) enum TiltLimitName {
    Box,
    #[default]
    Cone,
}

/// Files of before this number have it not.
fn approach_share() -> Number {
    Quantity(0.5)
}
