//! Gazebo: a model of SDF 1.9 with one `gz::sim::systems::MulticopterMotorModel` a rotor, body FLU.
//!
//! Drag of a rotor there goes with its speed: the number is right at the speed of hover.

use super::flat::Flat;
use super::{Axes, Keeps, Pulls, digits};
use std::fmt::Write;

pub(super) const KEEPS: Keeps = Keeps {
    rotors_apart: true,
    lags: 2,
    linear: Axes::Plane,
    quadratic: Axes::None,
    pulls: Pulls::LinearAtHubs,
    axial: false,
    lift: false,
    flapping: false,
    wind: false,
    tilt: false,
    gyro: false,
    damping: false,
};

/// A rotor's share of the mass: small enough to leave that of the body what it is.
const ROTOR_SHARE: f64 = 1e-3;

pub(super) fn text(flat: &Flat, keeps: &Keeps) -> String {
    let name = super::plain_name(&flat.name);
    let d = digits;
    let count = flat.rotors.len() as f64;
    let rotor_kg = ROTOR_SHARE * flat.mass_kg;
    // Rotors are links of their own: the body has the rest of mass and inertia.
    let mut j = flat.inertia_kg_m2;
    for rotor in &flat.rotors {
        let [x, y, z] = rotor.position;
        for (axis, moment) in [y * y + z * z, x * x + z * z, x * x + y * y].into_iter().enumerate()
        {
            j[(axis, axis)] -= rotor_kg * moment;
        }
        for (r, c, product) in [(0, 1, x * y), (0, 2, x * z), (1, 2, y * z)] {
            j[(r, c)] += rotor_kg * product;
        }
    }
    let mut out = String::new();
    let _ = writeln!(
        out,
        "<?xml version=\"1.0\"?>\n\
         <!-- Body FLU, SI. Made by squirrel vehicle export, target sdf. -->\n\
         <sdf version=\"1.9\">\n  <model name=\"{name}\">\n    \
         <link name=\"base_link\">\n      <inertial>\n        \
         <pose>{} {} {} 0 0 0</pose>\n        <mass>{}</mass>\n        <inertia>\n          \
         <ixx>{}</ixx><ixy>{}</ixy><ixz>{}</ixz>\n          \
         <iyy>{}</iyy><iyz>{}</iyz><izz>{}</izz>\n        </inertia>\n      </inertial>",
        d(flat.cg[0]),
        d(-flat.cg[1]),
        d(-flat.cg[2]),
        d(flat.mass_kg - count * rotor_kg),
        d(j[(0, 0)]),
        d(-j[(0, 1)]),
        d(-j[(0, 2)]),
        d(j[(1, 1)]),
        d(j[(1, 2)]),
        d(j[(2, 2)]),
    );
    let [length, width, height] = flat.size_m;
    for kind in ["collision", "visual"] {
        let _ = writeln!(
            out,
            "      <{kind} name=\"base_{kind}\"><geometry><box><size>{} {} {}</size></box></geometry></{kind}>",
            d(length),
            d(width),
            d(height)
        );
    }
    let _ = writeln!(out, "    </link>");
    let radius = flat.propeller_radius_m;
    for (i, rotor) in flat.rotors.iter().enumerate() {
        let [x, y, z] = rotor.from_centre;
        let thin = rotor_kg * radius * radius / 12.0;
        let _ = writeln!(
            out,
            "    <link name=\"rotor_{i}\">\n      <pose>{} {} {} 0 0 0</pose>\n      <inertial><mass>{}</mass><inertia>\
             <ixx>{4}</ixx><ixy>0</ixy><ixz>0</ixz><iyy>{4}</iyy><iyz>0</iyz><izz>{5}</izz></inertia></inertial>\n      \
             <visual name=\"disc\"><geometry><cylinder><radius>{6}</radius><length>0.002</length></cylinder></geometry></visual>\n    \
             </link>\n    <joint name=\"rotor_{i}_joint\" type=\"revolute\">\n      <parent>base_link</parent>\n      \
             <child>rotor_{i}</child>\n      <axis><xyz>0 0 1</xyz><limit><lower>-1e16</lower><upper>1e16</upper></limit></axis>\n    \
             </joint>",
            d(x),
            d(-y),
            d(-z),
            d(rotor_kg),
            d(thin),
            d(2.0 * thin),
            d(radius),
        );
    }
    let drag = keeps.linear_of(flat)[0] / (count * flat.hover_rad_s);
    let [up, down] = keeps.lag_of(flat).map(|lag| lag.max(1e-4));
    for (i, rotor) in flat.rotors.iter().enumerate() {
        let turning = if rotor.yaw_sign > 0.0 { "ccw" } else { "cw" };
        let _ = writeln!(
            out,
            "    <plugin filename=\"gz-sim-multicopter-motor-model-system\" name=\"gz::sim::systems::MulticopterMotorModel\">\n      \
             <robotNamespace>{name}</robotNamespace>\n      <jointName>rotor_{i}_joint</jointName>\n      \
             <linkName>rotor_{i}</linkName>\n      <turningDirection>{turning}</turningDirection>\n      \
             <timeConstantUp>{}</timeConstantUp>\n      <timeConstantDown>{}</timeConstantDown>\n      \
             <maxRotVelocity>{}</maxRotVelocity>\n      <motorConstant>{}</motorConstant>\n      \
             <momentConstant>{}</momentConstant>\n      <commandSubTopic>command/motor_speed</commandSubTopic>\n      \
             <motorNumber>{i}</motorNumber>\n      <rotorDragCoefficient>{}</rotorDragCoefficient>\n      \
             <rollingMomentCoefficient>0</rollingMomentCoefficient>\n      \
             <rotorVelocitySlowdownSim>10</rotorVelocitySlowdownSim>\n      <motorType>velocity</motorType>\n    </plugin>",
            d(up),
            d(down),
            d(flat.speed_max_rad_s()),
            d(rotor.thrust),
            d(rotor.torque / rotor.thrust),
            d(drag),
        );
    }
    let _ = writeln!(out, "  </model>\n</sdf>");
    out
}
