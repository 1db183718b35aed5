"""Residual force of one NanoBench flight, from scratch: an independent check of `gap find`.

    python residual_numpy.py flight.csv vehicle.toml

Shares no code with the workspace: own reading of the CSV and of its frames, own rotor lag (exact, from command to
command), own drag, own filter. Prints one JSON object with `force_body_rms_n` (N, body FRD), `samples` and
`duration_s`. Covers what the vehicle needs: a duty command without thrust curve, drag, no wings, no effects.
"""

import csv
import json
import math
import sys
import tomllib

import numpy as np

G_M_S2 = 9.80665
RHO_KG_M3 = 1.225


def number(entry):
    """A number of a vehicle file, plain or with its provenance."""
    return entry["value"] if isinstance(entry, dict) else entry


def read_flight(path):
    """Columns of the rows in flight, as arrays."""
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    names = ["t", "pz", "qx", "qy", "qz", "qw", "vx", "vy", "vz", "imu_acc_x", "imu_acc_y", "imu_acc_z"]
    names += [f"motor_motor_m{i}" for i in (1, 2, 3, 4)]
    column = {name: np.array([float(row[name] or "nan") for row in rows]) for name in names}
    pwm = np.stack([column[f"motor_motor_m{i}"] for i in (1, 2, 3, 4)], axis=1)
    fly = (column["pz"] > 0.4) & (pwm <= 65535).all(axis=1)
    return {name: values[fly] for name, values in column.items()}, pwm[fly]


def rotation_matrices(q_wxyz):
    """World from body, one 3x3 matrix a row."""
    w, x, y, z = q_wxyz.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def rotor_speeds(grid_s, time_s, target_rad_s, tau_s):
    """Speeds on the grid: towards the target in force, exactly, starting settled."""
    first = max(np.searchsorted(time_s, grid_s[0], side="right") - 1, 0)
    now_s, speed, command = grid_s[0], target_rad_s[first].copy(), first
    out = np.empty((len(grid_s), target_rad_s.shape[1]))
    for k, until_s in enumerate(grid_s):
        while now_s < until_s:
            next_s = time_s[command + 1] if command + 1 < len(time_s) else math.inf
            step_s = min(next_s, until_s) - now_s
            speed = target_rad_s[command] + (speed - target_rad_s[command]) * math.exp(-step_s / tau_s)
            now_s += step_s
            if next_s <= until_s:
                now_s, command = next_s, command + 1
        out[k] = speed
    return out


def low_pass_taps(rate_hz, cutoff_hz=12.0, half_length_s=0.2):
    h = math.floor(half_length_s * rate_hz + 0.5)
    i = np.arange(-h, h + 1)
    taps = 2 * cutoff_hz / rate_hz * np.sinc(2 * cutoff_hz * i / rate_hz) * np.hamming(2 * h + 1)
    return taps / taps.sum(), h


def pieces(time_s, period_s):
    cuts = np.flatnonzero(np.diff(time_s) > 5 * period_s) + 1
    return [(part[0], part[-1]) for part in np.split(time_s, cuts)]


def main(flight, vehicle):
    with open(vehicle, "rb") as file:
        v = tomllib.load(file)
    assert v["propulsion"]["command"] == "duty" and not v.get("wing") and not v.get("effects")
    mass_kg = number(v["mass"]["mass_kg"])
    propulsion = {key: number(entry) for key, entry in v["propulsion"].items() if key != "command"}
    linear, area_m2 = np.array(number(v["drag"]["linear_n_s_per_m"])), number(v["drag"]["area_m2"])

    column, pwm = read_flight(flight)
    t = column["t"] - column["t"][0]
    period_s = float(np.median(np.diff(t)))
    # The accelerometer is in g, forward-left-up; Vicon's world is north-west-up.
    flip = np.array([1.0, -1.0, -1.0])
    specific_force = np.stack([column[f"imu_acc_{a}"] for a in "xyz"], axis=1) * G_M_S2 * flip
    attitude = np.stack([column[f"q{a}"] for a in "wxyz"], axis=1)
    for k in range(1, len(attitude)):
        if attitude[k] @ attitude[k - 1] < 0:
            attitude[k] *= -1
    velocity_nwu = np.stack([column[f"v{a}"] for a in "xyz"], axis=1)
    target = np.clip(pwm / 65535.0, 0.0, 1.0) * propulsion["speed_max_rad_s"]

    residual = []
    for start_s, end_s in pieces(t, period_s):
        grid = start_s + period_s * np.arange(int((end_s - start_s) / period_s + 1e-6) + 1)

        def line(values):
            return np.stack([np.interp(grid, t, one) for one in values.T], axis=1)

        speed = rotor_speeds(grid, t, target, propulsion["time_constant_s"])
        q = line(attitude)
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        velocity_flu = np.einsum("kji,kj->ki", rotation_matrices(q), line(velocity_nwu))
        air = velocity_flu * flip
        airspeed = np.linalg.norm(air, axis=1, keepdims=True)
        model = -(linear * air + 0.5 * RHO_KG_M3 * area_m2 * airspeed * air)
        model[:, 2] -= propulsion["thrust_coefficient_n_s2"] * (speed**2).sum(axis=1)
        raw = mass_kg * line(specific_force) - model

        taps, h = low_pass_taps(1.0 / period_s)
        # The moment's derivative needs two samples more at each end, and force and moment count the same samples.
        raw = raw[2:-2]
        if len(raw) > 2 * h:
            residual.append(np.stack([np.convolve(one, taps, mode="valid") for one in raw.T], axis=1))
    residual = np.concatenate(residual)
    rms = np.sqrt((residual**2).mean(axis=0))
    print(
        json.dumps(
            {
                "force_body_rms_n": rms.tolist(),
                "samples": len(residual),
                "duration_s": len(residual) * period_s,
            }
        )
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
