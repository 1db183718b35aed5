"""Lesson 3: one altitude controller on a thousand vehicles of thirty different masses."""

import numpy as np

import squirrel

COUNT, HEIGHT_M, PERIODS, PERIOD_S = 1000, 10.0, 300, 0.05

base = squirrel.Vehicle.bundled("squirrel")
masses_kg = np.linspace(0.45, 0.75, 30)
kinds = [base.edited({"mass.mass_kg": float(mass)}) for mass in masses_kg]
kind = np.arange(COUNT) % len(kinds)
batch = squirrel.Batch(vehicles=[kinds[k] for k in kind], dt_s=1e-3)
steps = round(PERIOD_S / batch.dt_s)

# Rotors turn as they would have to for the mass that the controller believes in.
state = batch.states()
state[:, 13:] = base.hover_command * base["propulsion.speed_max_rad_s"]
batch.reset(state)
integral_m_s = np.zeros(COUNT)
for _ in range(PERIODS):
    error_m = HEIGHT_M + state[:, 2]
    integral_m_s += PERIOD_S * np.clip(error_m, -1.0, 1.0)
    # NED: a positive third velocity sinks.
    command = base.hover_command + 0.06 * np.clip(error_m, -2.0, 2.0) + 0.08 * state[:, 5] + 0.02 * integral_m_s
    batch.command(np.repeat(np.clip(command, 0.0, 1.0)[:, None], 4, axis=1).astype(np.float32))
    batch.step(steps)
    state = batch.states(state)

height_m = -state[:, 2]
print(f"after {PERIODS * PERIOD_S:.0f} s: mean height {height_m.mean():.2f} m, {height_m.min():.2f} to {height_m.max():.2f} m")
print(f"lightest {height_m[kind == 0].mean():.2f} m, heaviest {height_m[kind == len(kinds) - 1].mean():.2f} m")
assert np.abs(height_m - HEIGHT_M).max() < 0.5
