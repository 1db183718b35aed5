"""Exported vehicles in the simulators that they are for, flown by the commands of a log.

Each target has one function `fly(text, start, speeds_rad_s, dt_s, nominal)`: from a start state it applies one row of commanded
rotor speeds every `dt_s` and returns position and attitude after each. States are those of squirrel: NED, FRD, quaternion w x y z.
"""

import importlib.util
import os
import tempfile
import tomllib
from pathlib import Path

import numpy as np

# crazyflow asks for it before SciPy is there.
os.environ.setdefault("SCIPY_ARRAY_API", "1")

FLIP = np.array([1.0, -1.0, -1.0])


def flipped_quaternion(wxyz):
    """From FRD in NED to FLU in NWU, or back: both turn by half a turn about x."""
    return wxyz * np.array([1.0, 1.0, -1.0, -1.0])


def rotorpy(text, starts, commands, dt_s, nominal):
    """RotorPy's own derivative of the state, by RK4."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "params.py"
        path.write_text(text)
        spec = importlib.util.spec_from_file_location("params", path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    vehicle = module.Vehicle()
    paths = []
    for start, speeds in zip(starts, commands):
        w, x, y, z = flipped_quaternion(start["q"])
        state = np.concatenate(
            [
                start["position"] * FLIP,
                start["velocity"] * FLIP,
                [x, y, z, w],
                start["omega"] * FLIP,
                np.zeros(3),
                start["speed"],
            ]
        )
        path = []
        for command in speeds:
            command = np.clip(command, vehicle.rotor_speed_min, vehicle.rotor_speed_max)
            state = rk4(lambda s: vehicle._s_dot_fn(0.0, s, command), state, dt_s)
            state[6:10] /= np.linalg.norm(state[6:10])
            path.append(np.concatenate([state[:3] * FLIP, flipped_quaternion(state[[9, 6, 7, 8]])]))
        paths.append(path)
    return np.array(paths)


def crazyflow(text, starts, commands, dt_s, nominal):
    """crazyflow's first-principles dynamics on all starts at once, by RK4."""
    from crazyflow.dynamics.first_principles import dynamics

    (drone,) = tomllib.loads(text).values()
    rows = lambda key: np.atleast_2d(np.array(drone[key]))
    inertia = np.array(drone["J"])
    parameters = {
        "mass": np.array([drone["mass"]]),
        "L": np.array([drone["L"]]),
        "prop_inertia": np.array([drone["prop_inertia"]]),
        "gravity_vec": np.array([0.0, 0.0, -9.80665]),
        "J": inertia,
        "J_inv": np.linalg.inv(inertia),
        "rpm2thrust": rows("rpm2thrust"),
        "rpm2torque": rows("rpm2torque"),
        "mixing_matrix": np.array(drone["mixing_matrix"]),
        "drag_matrix": np.array(drone["drag_matrix"]),
        "rotor_dyn_coef": rows("rotor_dyn_coef"),
    }
    rpm = 60.0 / (2.0 * np.pi)
    quaternion = lambda s: flipped_quaternion(s["q"])[[1, 2, 3, 0]]
    state = np.array(
        [
            np.concatenate(
                [s["position"] * FLIP, quaternion(s), s["velocity"] * FLIP, s["omega"] * FLIP, s["speed"] * rpm]
            )
            for s in starts
        ]
    )

    def rates(s, command):
        parts = dynamics(s[:, :3], s[:, 3:7], s[:, 7:10], s[:, 10:13], command, s[:, 13:], **parameters)
        return np.concatenate(parts, axis=1)

    path = []
    for command in np.swapaxes(commands, 0, 1):
        state = rk4(lambda s: rates(s, command * rpm), state, dt_s)
        state[:, 3:7] /= np.linalg.norm(state[:, 3:7], axis=1, keepdims=True)
        path.append(np.concatenate([state[:, :3] * FLIP, flipped_quaternion(state[:, [6, 3, 4, 5]])], axis=1))
    return np.swapaxes(np.array(path), 0, 1)


def mjcf(text, starts, commands, dt_s, nominal):
    """MuJoCo; the control is the thrust of a nominal rotor."""
    import mujoco

    model = mujoco.MjModel.from_xml_string(text)
    substeps = max(1, round(dt_s / 1.2e-3))
    model.opt.timestep = dt_s / substeps
    data = mujoco.MjData(model)
    centre = model.body_ipos[1]
    paths = []
    for start, speeds in zip(starts, commands):
        mujoco.mj_resetData(model, data)
        q = flipped_quaternion(start["q"])
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, q)
        turn = turn.reshape(3, 3)
        omega = start["omega"] * FLIP
        # The body's frame is at the centre of the airframe, squirrel's at the centre of mass.
        data.qpos[:3] = start["position"] * FLIP - turn @ centre
        data.qpos[3:] = q
        data.qvel[:3] = start["velocity"] * FLIP - turn @ np.cross(omega, centre)
        data.qvel[3:] = omega
        if model.na:
            data.act[:] = nominal["thrust"] * start["speed"] ** 2
        path = []
        for command in speeds:
            data.ctrl[:] = nominal["thrust"] * command**2
            for _ in range(substeps):
                mujoco.mj_step(model, data)
            mujoco.mj_kinematics(model, data)
            path.append(np.concatenate([data.xipos[1] * FLIP, flipped_quaternion(data.xquat[1])]))
        paths.append(path)
    return np.array(paths)


def rk4(rates, state, dt_s):
    a = rates(state)
    b = rates(state + 0.5 * dt_s * a)
    c = rates(state + 0.5 * dt_s * b)
    d = rates(state + dt_s * c)
    return state + dt_s / 6.0 * (a + 2.0 * b + 2.0 * c + d)


FLY = {"rotorpy": rotorpy, "crazyflow": crazyflow, "mjcf": mjcf}
