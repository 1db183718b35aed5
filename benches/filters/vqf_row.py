#!/usr/bin/env python3
"""VQF (Laidig and Seel 2023, PyPI `vqf`) on the flights of `squirrel study filters`, as two more rows of its table.

    squirrel study filters --trials 20 --out filters
    python3 vqf_row.py filters

Needs the wheel of squirrel and `vqf` 2.1.2 in one environment. VQF hears gyro and accelerometer at 300 Hz with its own defaults, and starts level,
as the flights do; it estimates the gyro's bias itself. It has no use for fixes, which the two best filters of the table live on.
"""

import argparse
import json
from pathlib import Path

import numpy as np
from vqf import VQF

import squirrel

SETTLED_S = 5.0


def errors_deg(log: squirrel.FlightLog, bias_rad_s: np.ndarray) -> np.ndarray:
    """Angle between the believed and the true vertical."""
    time_s = log.time_s("imu")
    # Forward, left, up, and an accelerometer that reads +g at rest.
    to_flu = np.array([1.0, -1.0, -1.0])
    gyro = np.ascontiguousarray((log["imu.omega_body_rad_s"] + bias_rad_s) * to_flu)
    force = np.ascontiguousarray(log["imu.specific_force_body_m_s2"] * to_flu)
    w, x, y, z = VQF(float(np.median(np.diff(time_s)))).updateBatch(gyro, force)["quat6D"].T
    believed = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1)
    w, x, y, z = log["truth.q_ned_from_body_wxyz"].T
    down = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1)
    truth_s = log.time_s("truth")
    up = (down * np.array([-1.0, 1.0, 1.0]))[np.clip(np.searchsorted(truth_s, time_s), 0, len(truth_s) - 1)]
    cosine = np.clip(np.sum(believed * up, axis=1), -1.0, 1.0)
    return np.degrees(np.arccos(cosine))[time_s >= SETTLED_S]


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("study", type=Path, help="folder of `squirrel study filters --out`")
    folder = options.parse_args().study
    bias = np.radians(json.loads((folder / "filters.json").read_text())["bias_deg_s"])
    flights = sorted((folder / "flights").glob("*.toml"))
    logs = [squirrel.simulate(scenario=str(path), arm="pc_wings_open") for path in flights]
    for name, left in (("calibrated", np.zeros(3)), ("off", bias)):
        rms = [float(np.sqrt(np.mean(errors_deg(log, left) ** 2))) for log in logs]
        worst = max(float(errors_deg(log, left).max()) for log in logs)
        print(f"vqf, gyro {name}: RMS {np.mean(rms):.2f} deg over {len(rms)} flights ({min(rms):.2f} to {max(rms):.2f}), largest {worst:.1f}")


if __name__ == "__main__":
    main()
