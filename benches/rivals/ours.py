"""squirrel on a case: `gap run` on the training flights alone, `gap find` of what it hands over on the held-out one."""

import json
import os
import re
import resource
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from flight import Array, Piece, read_vehicle

# Key of the model in physics.py for a parameter of the catalogue.
KEYS = {
    "linear_drag.extra_drag_n_s_per_m": "linear_drag",
    "quadratic_drag.extra_drag_area_m2": "quadratic_drag",
    "constant_wind.wind_north_m_s": "wind_0",
    "constant_wind.wind_east_m_s": "wind_1",
    "battery_sag.voltage_exponent": "sag",
    "thrust_coefficient.thrust_fraction": "thrust",
    "motor_lag.extra_time_constant_s": "motor_lag",
    "mass_error.mass_fraction": "mass",
    "cg_offset.cg_x_m": "cg_0",
    "cg_offset.cg_y_m": "cg_1",
    "thrust_misalignment.tilt_x_rad": "tilt_0",
    "thrust_misalignment.tilt_y_rad": "tilt_1",
    "translational_lift.gain_s2_per_m2": "lift",
    "axial_inflow.gain_s_per_m": "inflow",
    "flapping_moment.gain_n_m_s_per_m": "flapping",
    "rotor_gyro_torque.rotor_inertia_kg_m2": "rotor_inertia",
    "yaw_torque_coeff.torque_fraction": "yaw_torque",
    "angular_damping.damping_n_m_s_per_rad": "damping",
    "actuation_latency.latency_s": "latency",
    "wing_membrane.gain": "wing_gain",
    "wing_membrane.angle_of_attack_offset_rad": "wing_angle",
    "wing_servo_lag.extra_time_constant_s": "wing_lag",
    "added_mass.mass_kg": "added_mass",
    "heading_bias.bias_rad": "heading",
    "gnss_latency.latency_s": "gnss_latency",
    "accel_bias.bias_x_m_s2": "bias_0",
    "accel_bias.bias_y_m_s2": "bias_1",
    "accel_bias.bias_z_m_s2": "bias_2",
}
AXIS = {"x": 0, "y": 1, "z": 2, "left": 0, "right": 1}


def model_key(name: str) -> str | None:
    """`effect.parameter`, `effect[which].parameter` or `rotor[0].position_body_m[1]` as a key of physics.py."""
    if name in KEYS:
        return KEYS[name]
    patterns = (
        (r"weak_rotor\[(\d+)\]", lambda m: f"weak_{int(m[1]) - 1}"),
        (r"inertia_error\[([xyz])\]", lambda m: f"inertia_{AXIS[m[1]]}"),
        (r"wing_asymmetry\[(left|right)\]", lambda m: f"wing_loss_{AXIS[m[1]]}"),
    )
    for pattern, key in patterns:
        if match := re.match(pattern, name):
            return key(match)
    return None


def sizes_of(effects: dict[str, dict]) -> dict[str, float]:
    """Effects of a vehicle file as sizes of physics.py; those that it does not have are left out."""
    sizes: dict[str, float] = {}
    for name, given in effects.items():
        if name == "ground_effect":
            sizes["ground_radius2"] = given["effective_radius_m"] ** 2
        elif name == "payload_swing":
            sizes[f"payload_{given['length_m']:.4f}"] = given["mass_kg"]
        elif name == "clock_skew":
            sizes["skew"] = 1e-6 * given["skew_ppm"]
        else:
            which = next((str(given[key]) for key in ("rotor", "axis", "side") if key in given), None)
            for key, number in given.items():
                place = f"{name}[{which}].{key}" if which is not None else f"{name}.{key}"
                if (model := model_key(place)) and isinstance(number, int | float):
                    sizes[model] = float(number)
    return sizes


def named_of(verdict: dict) -> dict[str, float]:
    """The named effects alone."""
    values = ({key: number["value"] for key, number in effect["parameters"].items()} for effect in verdict["effects"])
    return sizes_of(dict(zip((effect["name"] for effect in verdict["effects"]), values, strict=True)))


def run(squirrel: Path, arguments: list[str]) -> float:
    """One call; its processor time, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "RAYON_NUM_THREADS": "1"}
    done = subprocess.run([squirrel, *arguments], env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(done.stderr.strip().splitlines()[-1] if done.stderr.strip() else "squirrel failed")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def found(squirrel: Path, vehicle: Path, flight: Path, folder: Path, pieces: list[Piece]) -> Array:
    """`E_c` by `gap find`: its residual is a force and a moment, ours are divided by the mass and inertia that go with it."""
    out = folder / "find.json"
    run(squirrel, ["gap", "find", "--vehicle", str(vehicle), "--flights", str(flight), "--json", str(out)])
    residual = json.loads(out.read_text())["residual"]
    numbers = read_vehicle(vehicle)
    effects = numbers.get("effects", {})
    m = numbers["mass"]["mass_kg"] * (1 + effects.get("mass_error", {}).get("mass_fraction", 0.0))
    J = np.array(numbers["mass"]["inertia_kg_m2"])
    if "inertia_error" in effects:
        J[AXIS[effects["inertia_error"]["axis"]]] *= 1 + effects["inertia_error"]["inertia_fraction"]
    noise = np.sqrt(np.mean([p.noise**2 for p in pieces], axis=0))
    force, moment = np.array(residual["force_body_rms_n"]), np.array(residual["moment_body_rms_n_m"])
    return np.concatenate([force / m, moment / J]) / noise


def solve(squirrel: Path, vehicle: Path, train: list[Path]) -> tuple[dict, str | None, float]:
    """The verdict, the text of the patched vehicle file where there is one, and processor time, s."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        arguments = ["gap", "run", "--fit", "--vehicle", str(vehicle), "--out", name, "--json", str(folder / "verdict.json")]
        seconds = run(squirrel, [*arguments, "--flights", *map(str, train)])
        verdict = json.loads((folder / "verdict.json").read_text())
        patch = verdict.get("model_patch")
        return verdict, Path(patch).read_text() if patch else None, seconds
