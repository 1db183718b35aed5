"""Lesson 4: train a policy in a minute, put it into the network that flies, and fly it in the simulator's closed loop.

Evolution strategies (Salimans et al. 2017), because they need NumPy alone: in each generation every environment flies a policy of
its own, a little off the present one, in pairs that differ in sign and share their episode. Loops as those of CleanRL or
Stable-Baselines3 train on `squirrel.envs` instead.
"""

import time

import numpy as np

import squirrel

PAIRS, GENERATIONS, STEPS, SIGMA, RATE = 128, 160, 250, 0.05, 0.05
SHAPES = [(32, 25), (32,), (32, 32), (32,), (4, 32), (4,)]
SIZES = [int(np.prod(shape)) for shape in SHAPES]
rng = np.random.default_rng(1)
vehicle = squirrel.Vehicle.bundled("squirrel")


def tasks_of(count: int) -> squirrel.Tasks:
    # With sensors: a policy that has only seen true states does not fly on a receiver that speaks ten times a second.
    return squirrel.Tasks(task="track", vehicles=[vehicle], num_envs=count, action="attitude_wing", sensors=True)


def layers(parameters: np.ndarray) -> list[np.ndarray]:
    """Weights and biases, each with the leading axes of the parameters."""
    parts = np.split(parameters, np.cumsum(SIZES)[:-1], axis=-1)
    return [part.reshape(*parameters.shape[:-1], *shape) for part, shape in zip(parts, SHAPES, strict=True)]


def act(weights: list[np.ndarray], seen: np.ndarray) -> np.ndarray:
    w1, b1, w2, b2, w3, b3 = weights
    hidden = np.tanh((w1 @ seen[..., None])[..., 0] + b1)
    hidden = np.tanh((w2 @ hidden[..., None])[..., 0] + b2)
    commanded: np.ndarray = (w3 @ hidden[..., None])[..., 0] + b3
    return commanded


def returns(tasks: squirrel.Tasks, weights: list[np.ndarray], seeds: np.ndarray, steps: int) -> np.ndarray:
    """What each environment's first episode was worth, up to a number of steps."""
    for index, seed in enumerate(seeds):
        tasks.seed(index, int(seed))
    seen = tasks.reset()
    total, flies = np.zeros(len(tasks)), np.ones(len(tasks), bool)
    for _ in range(steps):
        seen, reward, terminated, truncated = tasks.step(act(weights, seen))
        total += reward * flies
        flies &= ~(terminated | truncated)
    return total


mean = np.concatenate([rng.normal(0.0, 1.0 / np.sqrt(s[-1]), int(np.prod(s))) if len(s) == 2 else np.zeros(s) for s in SHAPES])
mean[-SIZES[-1] - SIZES[-2] :] *= 0.1
mean = mean.astype(np.float32)
examination, seeds = tasks_of(200), np.arange(10_000, 10_200)
at_random = returns(examination, layers(mean), seeds, 500).mean()

tasks, momentum, square = tasks_of(2 * PAIRS), np.zeros_like(mean), np.zeros_like(mean)
curve, begin = [], time.perf_counter()
for generation in range(GENERATIONS):
    noise = rng.standard_normal((PAIRS, len(mean)), np.float32)
    both = mean + SIGMA * np.concatenate([noise, -noise])
    shared = np.tile(generation * PAIRS + np.arange(PAIRS), 2)
    worth = returns(tasks, layers(both), shared, STEPS)
    rank = np.argsort(np.argsort(worth)) / (len(worth) - 1) - 0.5
    slope = ((rank[:PAIRS] - rank[PAIRS:]) @ noise) / (2 * PAIRS * SIGMA)
    momentum, square = 0.9 * momentum + 0.1 * slope, 0.99 * square + 0.01 * slope**2
    scale = np.sqrt(square / (1.0 - 0.99 ** (generation + 1))) + 1e-8
    rate = RATE * (1.0 - 0.9 * generation / GENERATIONS)
    mean = (mean + rate * momentum / (1.0 - 0.9 ** (generation + 1)) / scale).astype(np.float32)
    curve.append(float(worth.mean()))
    if generation % 15 == 0 or generation + 1 == GENERATIONS:
        spent = time.perf_counter() - begin
        print(f"generation {generation:4d}: {curve[-1]:6.2f} of {STEPS / 50:.0f} after {spent:5.1f} s")

trained = returns(examination, layers(mean), seeds, 500).mean()
print(f"episodes of 10 s it has not seen are worth {trained:.2f}, at random {at_random:.2f}")

w1, b1, w2, b2, w3, b3 = layers(mean)
squirrel.Policy(first=(w1, b1), second=(w2, b2), output=(w3, b3)).save("track.safetensors")
policy = squirrel.Policy.load("track.safetensors")
flight = squirrel.simulate(vehicle=vehicle, scenario="track", policy=policy, seed=1)
error = np.linalg.norm(flight["truth.position_ned_m"] - flight["reference.position_ned_m"], axis=1)
print(f"in closed loop, by the flight code: {np.sqrt(np.mean(error**2)):.2f} m RMS from a circle at 4 m/s")

try:
    import matplotlib.pyplot as plt
except ModuleNotFoundError:
    pass
else:
    figure, axes = plt.subplots(figsize=(6, 3.5), layout="constrained")
    axes.plot(curve)
    axes.set(xlabel="generation", ylabel=f"worth of {STEPS / 50:.0f} s", title="SquirrelTrack by evolution strategies")
    axes.grid(alpha=0.3)
    figure.savefig("track.png", dpi=120)
assert trained > at_random + 3.0
