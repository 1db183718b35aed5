"""What the gap workflow says of flights that PyFlyt flew in Bullet: its plant, its cascade of PID controllers, none of the code here.

Two of PyFlyt's machines, flown from one random place to the next. Bullet takes steps of about a millisecond; sensors are read once
in a control period, in its middle, beside the command that acts from its beginning: such a log has commands half a period late.

    python bullet.py --squirrel target/release/squirrel --seed 1 --json bullet.json
"""

import warnings

import numpy as np
from common import AIR_KG_M3, GRAVITY_M_S2, Lost, asked, bench, vehicle_file
from PyFlyt.core import Aviary
from scipy.spatial.transform import Rotation

CONTROL_HZ = 240
# PyFlyt's rotors and Bullet's bodies take Euler's steps.
PHYSICS_HZ = 960
FLIGHT_S = 32.0
LOG_FROM_S = 2.0
FLIGHTS = 3
START_M = np.array([0.0, 0.0, 10.0])
# PyFlyt multiplies rotor speeds by 1 + n N(4, 1) in each step.
NOISE = 5e-5
NOISE_MEAN = 4.0

# Half the width of the space flown in, m, limit of the controller's speed, m/s, lag of the rotors, s, propellers, m, and cells.
MACHINES = {
    "cf2x": {"size": 1.5, "speed": 1.2, "lag": 0.03, "diameter": 0.046, "cells": 1},
    "primitive_drone": {"size": 5.0, "speed": 4.0, "lag": 0.04, "diameter": 0.25, "cells": 4},
}

# What is hidden, and the names that are right for it.
EFFECTS = {
    "none": [],
    "mass": ["mass_error"],
    "thrust": ["thrust_coefficient"],
    "yaw torque": ["yaw_torque_coeff"],
    "inertia": ["inertia_error"],
    "centre of mass": ["cg_offset"],
    "motor lag": ["motor_lag"],
    "drag of the frame": ["quadratic_drag"],
    "damping": ["angular_damping"],
    "weak rotor": ["weak_rotor"],
    "tilted thrust": ["thrust_misalignment"],
    "wind": ["constant_wind"],
    "battery": ["battery_sag"],
}


def plant(name, seed):
    """A machine of PyFlyt in the air, and what flies it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        options = {"drone_model": name, "control_hz": CONTROL_HZ}
        world = Aviary(START_M[None], np.zeros((1, 3)), drone_type="quadx", drone_options=options, physics_hz=PHYSICS_HZ, seed=seed)
    world.setTimeStep(1.0 / PHYSICS_HZ)
    drone = world.drones[0]
    drone.motors.noise_ratio = np.full(4, NOISE)
    drone.motors.tau = np.full(4, MACHINES[name]["lag"])
    drone.drag_coef_pqr = 0.0
    drone.lim_lin_pos = np.full(2, MACHINES[name]["speed"])
    return world, drone


def numbers(name):
    """PyFlyt's numbers, as a vehicle file has them."""
    world, drone = plant(name, 0)
    mass, _, inertia, *_ = world.getDynamicsInfo(drone.Id, -1)
    # The mean of the noise makes rotors faster.
    share = 1.0 / PHYSICS_HZ / MACHINES[name]["lag"]
    faster = share / (share - NOISE_MEAN * NOISE)
    thrust, torque = drone.motors.thrust_coef.ravel(), drone.motors.torque_coef.ravel()
    known = {
        "mass": mass,
        "inertia": inertia,
        "rotors": [(np.array(world.getLinkState(drone.Id, i)[0]) - START_M, np.sign(torque[i])) for i in range(4)],
        "top": drone.motors.max_rpm[0],
        "thrust": thrust[0] * faster**2,
        "torque": abs(torque[0]) * faster**2,
        "area": 2.0 * drone.body.drag_consts[0, 0] / AIR_KG_M3,
        **{key: MACHINES[name][key] for key in ("lag", "diameter", "cells")},
    }
    world.disconnect()
    return known


def hide(effect, known, speed, rng):
    """What is other than the vehicle file says."""
    sign, angle, arm = rng.choice([-1.0, 1.0]), rng.uniform(0.0, 2.0 * np.pi), np.linalg.norm(known["rotors"][0][0])
    level = np.array([np.cos(angle), np.sin(angle), 0.0])
    match effect:
        case "none":
            return {}
        case "mass":
            return {"mass": 1.0 + rng.uniform(0.06, 0.15)}
        case "thrust":
            return {"thrust": np.full(4, 1.0 + sign * rng.uniform(0.06, 0.12))}
        case "yaw torque":
            return {"torque": 1.0 + sign * rng.uniform(0.25, 0.4)}
        case "inertia":
            inertia = np.ones(3)
            inertia[rng.integers(2)] += rng.uniform(0.25, 0.4)
            return {"inertia": inertia}
        case "centre of mass":
            return {"shift": arm * rng.uniform(0.02, 0.06) * level}
        case "motor lag":
            return {"lag": rng.uniform(0.02, 0.04)}
        case "drag of the frame":
            return {"drag": rng.uniform(0.06, 0.15) * known["mass"] * 3.0 / speed}
        case "damping":
            return {"damping": rng.uniform(0.5, 2.0) * known["inertia"][0]}
        case "weak rotor":
            thrust = np.ones(4)
            thrust[rng.integers(4)] -= rng.uniform(0.06, 0.15)
            return {"thrust": thrust}
        case "tilted thrust":
            return {"tilt": rng.uniform(0.02, 0.05) * level}
        case "wind":
            return {"wind": rng.uniform(0.5, 1.0) * speed * level}
        case "battery":
            return {"exponent": rng.uniform(0.4, 0.8)}


def put_in(world, drone, known, hidden):
    """Changes a plant."""
    motors, nothing = drone.motors, np.zeros(3)
    inertia = np.array(known["inertia"]) * hidden.get("inertia", 1.0)
    world.changeDynamics(drone.Id, -1, mass=known["mass"] * hidden.get("mass", 1.0), localInertiaDiagonal=list(inertia))
    motors.thrust_coef = motors.thrust_coef * hidden.get("thrust", np.ones(4))[:, None]
    motors.torque_coef = motors.torque_coef * hidden.get("torque", 1.0)
    motors.thrust_unit = motors.thrust_unit + hidden.get("tilt", nothing)[:, None]
    motors.tau = motors.tau + hidden.get("lag", 0.0)
    drone.body.drag_consts = drone.body.drag_consts + hidden.get("drag", 0.0)
    drone.drag_coef_pqr = hidden.get("damping", 0.0)
    if "wind" in hidden:
        world.register_wind_field_function(lambda _, places: np.tile(hidden["wind"], (len(places), 1)))
    if "shift" in hidden:
        update = motors.physics_update

        # Forces of rotors that stand beside their places turn the body so much more.
        def shifted(pwm, rotation=None):
            update(pwm, rotation)
            speeds = motors.throttle * motors.max_rpm
            force = (motors.thrust_coef[:, 0] * speeds * np.abs(speeds))[:, None] * motors.thrust_unit[:, :, 0]
            world.applyExternalTorque(drone.Id, -1, np.cross(hidden["shift"], force.sum(axis=0)), world.LINK_FRAME)

        motors.physics_update = shifted


def fly(name, known, hidden, seed, number, rng):
    """One flight as rows of `COLUMNS`; sensors are in the middle of the rotors."""
    world, drone = plant(name, seed)
    put_in(world, drone, known, hidden)
    size, cells, shift = MACHINES[name]["size"], MACHINES[name]["cells"], hidden.get("shift", np.zeros(3))
    top, until, rows = drone.motors.max_rpm.copy(), 0.0, []
    noise = lambda sd: sd * rng.standard_normal(3)
    moving = lambda: [np.array(x) for x in (*world.getBasePositionAndOrientation(drone.Id), *world.getBaseVelocity(drone.Id))]
    world.set_mode(7)
    for k in range(int(FLIGHT_S * CONTROL_HZ)):
        t = k / CONTROL_HZ
        if t >= until:
            level, heading, height = rng.uniform(-1.0, 1.0, 2) * size, rng.uniform(-1.5, 1.5), rng.uniform(-0.5, 0.5) * size
            world.set_setpoint(0, np.array([*level, heading, START_M[2] + height]))
            until = t + rng.uniform(1.0, 3.0)
        voltage = cells * (4.1 - 0.1 * number - 0.5 * t / FLIGHT_S)
        drone.motors.max_rpm = top * (voltage / (3.7 * cells)) ** hidden.get("exponent", 0.0)
        place, attitude, velocity, turning = moving()
        world.step()
        place_after, _, velocity_after, turning_after = moving()
        if not (place_after[2] > 1.0 and np.linalg.norm(velocity_after) < 40.0):
            world.disconnect()
            raise Lost
        if t < LOG_FROM_S:
            continue
        w = 0.5 * (turning + turning_after)
        turned = Rotation.from_rotvec(0.5 * w / CONTROL_HZ) * Rotation.from_quat(attitude)
        rate, faster = turned.inv().apply(w), turned.inv().apply(turning_after - turning) * CONTROL_HZ
        felt = turned.inv().apply((velocity_after - velocity) * CONTROL_HZ + [0.0, 0.0, GRAVITY_M_S2])
        felt = felt + np.cross(faster, shift) + np.cross(rate, np.cross(rate, shift)) + noise(0.05)
        x = 0.5 * (place + place_after) + turned.apply(shift) + noise(0.002)
        v = 0.5 * (velocity + velocity_after) + turned.apply(np.cross(rate, shift)) + noise(0.01)
        q = (turned * Rotation.from_rotvec(noise(0.003))).as_quat()
        rows.append([t, *x, *v, *q, *(rate + noise(0.003)), *felt, *drone.pwm, voltage + 0.005 * rng.standard_normal()])
    world.disconnect()
    return rows


def case(arguments, name, effect, rng, folder):
    """What the workflow says of one machine with one effect."""
    known = numbers(name)
    hidden = hide(effect, known, MACHINES[name]["speed"], rng)
    vehicle_file(arguments.squirrel, "PyFlyt", known, folder / "plant.toml")
    flights = [(f"flight{i}", fly(name, known, hidden, FLIGHTS * arguments.seed + i, i, rng)) for i in range(FLIGHTS)]
    return asked(arguments.squirrel, folder, flights)


if __name__ == "__main__":
    bench(__doc__, MACHINES, EFFECTS, case)
