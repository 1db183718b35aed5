"""Lesson 3: one altitude controller on a thousand vehicles, no two of which weigh the same."""

import numpy as np

import squirrel

COUNT, HEIGHT_M, PERIODS, STEPS = 1000, 10.0, 100, 50

base = squirrel.Vehicle.bundled("squirrel")
masses_kg = np.linspace(0.45, 0.75, 30)
kinds = [base.edited({"mass.mass_kg": float(mass)}) for mass in masses_kg]
batch = squirrel.Batch(vehicles=[kinds[k % len(kinds)] for k in range(COUNT)], dt_s=1e-3)

state = batch.states()
state[:, 13:] = base.hover_command * 3000.0
batch.reset(state)
integral = np.zeros(COUNT, np.float32)
for _ in range(PERIODS):
    error_m = HEIGHT_M + state[:, 2]
    integral = np.clip(integral + 0.05 * error_m, -20.0, 20.0)
    # NED: a positive third velocity sinks.
    command = base.hover_command + 0.02 * error_m + 0.04 * state[:, 5] + 0.004 * integral
    batch.command(np.repeat(np.clip(command, 0.0, 1.0)[:, None], 4, axis=1).astype(np.float32))
    batch.step(STEPS)
    state = batch.states(state)

height_m = -state[:, 2]
seconds = PERIODS * STEPS * batch.dt_s
print(f"after {seconds:.0f} s: mean height {height_m.mean():.2f} m, from {height_m.min():.2f} to {height_m.max():.2f} m")
lightest, heaviest = (height_m[masses_kg.size * np.arange(COUNT // masses_kg.size) + k].mean() for k in (0, -1 + masses_kg.size))
print(f"lightest {lightest:.2f} m, heaviest {heaviest:.2f} m")
