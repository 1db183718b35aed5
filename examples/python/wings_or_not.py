"""Lesson 1: does opening the wings help? One manoeuvre, three controllers, as arrays."""

import numpy as np

import squirrel

ARMS: list[squirrel.flight.Arm] = ["pc", "twcc_flat", "phantom"]

print(f"{'arm':<12}{'error m':>9}{'height lost m':>15}{'largest tilt deg':>18}{'wings open s':>14}")
for arm in ARMS:
    # Little more thrust than weight: here wings can do what rotors cannot. `phantom` believes in wings that are not there.
    log = squirrel.simulate(scenario="avoid", arm=arm, seed=1, thrust_to_weight=1.25)
    error_m = np.linalg.norm(log["truth.position_ned_m"] - log["reference.position_ned_m"], axis=1)
    q = log["truth.q_ned_from_body_wxyz"]
    tilt_rad = np.arccos(np.clip(1.0 - 2.0 * (q[:, 1] ** 2 + q[:, 2] ** 2), -1.0, 1.0))
    metrics = log.metrics
    assert metrics is not None
    rms_m = np.sqrt(np.mean(error_m**2))
    print(
        f"{arm:<12}{rms_m:>9.2f}{metrics['height_lost_m']:>15.2f}"
        f"{np.degrees(tilt_rad.max()):>18.1f}{metrics['wings_open_s']:>14.2f}"
    )
