"""Download on spread wings in hover, climb, descent and forward flight, by strip theory.

Written without the simulator's code, to check the effect `rotor_wash`: wings in strips across the span, each strip in cells along
the chord; a cell is washed where it lies in a round, contracted jet. The jet's speed is momentum theory's root, found by bisection.
Run by hand: `python3 benches/wash/strips.py`. Needs NumPy. The figures stand in the tests of
`crates/squirrel-core/src/effects/rotor_wash.rs`.
"""

import numpy as np

RHO_KG_M3 = 1.225
HUBS_M = [(0.085, -0.085), (-0.085, -0.085), (-0.085, 0.085), (0.085, 0.085)]
RADIUS_M = 0.0508
BELOW_M = 0.02
CHORD_M, SPAN_M, MIDDLE_M = 0.2, 0.1, 0.09
BROADSIDE = 1.13


def induced(thrust_n, across_m_s, climb_m_s):
    """Root of `2 rho A v sqrt(V_a^2 + (V_c + v)^2) = T`, by bisection between 0 and 60 m/s."""
    area_m2 = np.pi * RADIUS_M**2
    low, high = 0.0, 60.0
    for _ in range(80):
        v = 0.5 * (low + high)
        if 2 * RHO_KG_M3 * area_m2 * v * np.hypot(across_m_s, climb_m_s + v) < thrust_n:
            low = v
        else:
            high = v
    return v


def normal_pressure(u, v, w):
    """Along -z on a stalled plate that moves with (u, v, w) through the air."""
    speed = np.sqrt(u * u + v * v + w * w)
    sine = w / max(speed, 1e-12)
    coefficient = BROADSIDE / 0.59 * sine * (1 / (0.56 + 0.44 * abs(sine)) - 0.41)
    return 0.5 * RHO_KG_M3 * speed**2 * coefficient


def plate_pressure(u, v, w):
    """The paper's plate, eq. 4."""
    return RHO_KG_M3 * np.sqrt(u * u + v * v + w * w) * w


def download(thrusts_n, velocity_m_s, cells=400):
    """Change of the force along z (N, down), of roll and of pitch moment (N m)."""
    u, v, w = velocity_m_s
    ahead = np.linspace(-0.5, 0.5, cells, endpoint=False) + 0.5 / cells
    x = CHORD_M * ahead
    force = roll = pitch = 0.0
    for side in (-1, 1):
        y = side * MIDDLE_M + SPAN_M * ahead
        grid_x, grid_y = np.meshgrid(x, y)
        cell = CHORD_M * SPAN_M / cells**2
        for (hub_x, hub_y), thrust in zip(HUBS_M, thrusts_n):
            at_disc = induced(thrust, np.hypot(u, v), -w)
            s = BELOW_M / RADIUS_M
            jet = at_disc * (1 + s / np.sqrt(1 + s * s))
            radius = RADIUS_M * np.sqrt(at_disc / jet)
            late = BELOW_M / (jet - w)
            inside = np.hypot(grid_x - hub_x + u * late, grid_y - hub_y + v * late) < radius
            push = -(normal_pressure(u, v, w - jet) - plate_pressure(u, v, w)) * cell
            force += push * inside.sum()
            roll += push * grid_y[inside].sum()
            pitch -= push * grid_x[inside].sum()
    return force, roll, pitch


if __name__ == "__main__":
    hover = 0.548 * 9.80665 / 4
    for name, thrusts, velocity in [
        ("hover", [hover] * 4, (0, 0, 0)),
        ("climb of 3 m/s", [hover] * 4, (0, 0, -3)),
        ("descent of 3 m/s", [hover] * 4, (0, 0, 3)),
        ("7 m/s", [hover] * 4, (7, 0, 0)),
        ("7 m/s, 10 deg down", [hover] * 4, (7 * np.cos(np.radians(10)), 0, -7 * np.sin(np.radians(10)))),
        ("braking, 7 m/s, 30 deg up", [hover] * 4, (7 * np.cos(np.pi / 6), 0, 3.5)),
        ("rolling right", [1.2 * hover, 1.2 * hover, 0.8 * hover, 0.8 * hover], (0, 0, 0)),
        ("sideways, 7 m/s", [hover] * 4, (0, 7, 0)),
    ]:
        force, roll, pitch = download(thrusts, velocity)
        print(f"{name:28} {force:8.4f} N down  {roll:9.5f} N m roll  {pitch:9.5f} N m pitch")
