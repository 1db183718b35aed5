"""Lesson 5: train by PPO of Stable-Baselines3 on the same environments, and fly what came out.

Needs `pip install stable-baselines3`, which brings PyTorch; says so and ends where it is missing.
"""

import importlib
import sys
import time

import numpy as np

import squirrel
import squirrel.envs  # the environments are known to Gymnasium from here on

try:
    sb3 = importlib.import_module("stable_baselines3")
    make_vec_env = importlib.import_module("stable_baselines3.common.env_util").make_vec_env
    evaluate_policy = importlib.import_module("stable_baselines3.common.evaluation").evaluate_policy
    nn = importlib.import_module("torch").nn
except ModuleNotFoundError as missing:
    print(f"skipped: {missing.name} is not installed (pip install stable-baselines3)")
    sys.exit()

# With sensors: a policy that has only seen true states does not fly on a receiver that speaks ten times a second.
envs = make_vec_env("SquirrelTrack-v0", n_envs=16, seed=1, env_kwargs={"sensors": True})
examination = make_vec_env("SquirrelTrack-v0", n_envs=16, seed=10_000, env_kwargs={"sensors": True})

# Two hidden layers of 32 with tanh, which is what the flight code has room for.
model = sb3.PPO(
    "MlpPolicy", envs, n_steps=256, batch_size=1024, gamma=0.98, learning_rate=1e-3, policy_kwargs={"net_arch": [32, 32]}, seed=1, device="cpu"
)
untrained, _ = evaluate_policy(model, examination, n_eval_episodes=32)
begin = time.perf_counter()
model.learn(600_000)
trained, _ = evaluate_policy(model, examination, n_eval_episodes=32)
print(f"episodes are worth {trained:.2f}, untrained {untrained:.2f}, after {time.perf_counter() - begin:.0f} s")

actor = model.policy
module = nn.Sequential(*actor.mlp_extractor.policy_net, actor.action_net)
torch_bridge = importlib.import_module("squirrel.torch")
torch_bridge.policy_from_sequential(module).save("ppo.safetensors")
flight = squirrel.simulate(
    vehicle=squirrel.Vehicle.bundled("squirrel"), scenario="track", policy=squirrel.Policy.load("ppo.safetensors"), seed=1
)
error = np.linalg.norm(flight["truth.position_ned_m"] - flight["reference.position_ned_m"], axis=1)
print(f"in closed loop, by the flight code: {np.sqrt(np.mean(error**2)):.2f} m RMS from a circle at 4 m/s")
assert trained > untrained + 3.0
