#!/usr/bin/env python3
"""JAX and PyTorch beside squirrel-nn on the recurrent network 2-8-8-2 over windows of ten, f32, one core.

    python3 compare.py [--rounds 5] [--out figures.json]        needs requirements.txt and cargo

All do the same work: the output after the last row; forward of 1 and of 1000 windows; an epoch over 5000 windows in
batches of 64, shuffled, mean squared error, Adam. JAX has the whole epoch in one compiled scan; PyTorch has its fused
Adam and one thread, which is its fastest here. Rounds alternate between the three, and a ratio is taken within a round.
"""

import argparse
import json
import os
import pathlib
import statistics
import subprocess
import time

os.environ.update(JAX_PLATFORMS="cpu", CUDA_VISIBLE_DEVICES="", OMP_WAIT_POLICY="PASSIVE")

import jax
import jax.numpy as jnp
import numpy as np
import optax
import torch

ROOT = pathlib.Path(__file__).resolve().parents[2]
WINDOWS, BATCH, BULK = 5000, 64, 1000
rng = np.random.default_rng(0)
X = rng.uniform(-1, 1, (WINDOWS, 10, 2)).astype(np.float32)
Y = np.tanh(X.sum(1) * 0.3)


def clock_us(call, seconds):
    """Median time of a call over as many calls as fit."""
    call()
    times, end = [], time.perf_counter() + seconds
    while len(times) < 5 or time.perf_counter() < end:
        start = time.perf_counter()
        call()
        times.append((time.perf_counter() - start) * 1e6)
    return statistics.median(times)


class Torch:
    def __init__(self):
        torch.set_num_threads(1)
        self.x, self.y = torch.from_numpy(X), torch.from_numpy(Y)
        self.rnn = torch.nn.RNN(2, 8, num_layers=2, batch_first=True)
        self.read = torch.nn.Linear(8, 2)
        parameters = [*self.rnn.parameters(), *self.read.parameters()]
        self.adam = torch.optim.Adam(parameters, lr=1e-3, fused=True)

    def net(self, x):
        return self.read(self.rnn(x)[0][:, -1])

    def forward(self, count):
        x = self.x[:count]

        def call():
            with torch.inference_mode():
                self.net(x)

        return call

    def epoch(self):
        for members in torch.randperm(WINDOWS).split(BATCH):
            self.adam.zero_grad(set_to_none=True)
            torch.nn.functional.mse_loss(self.net(self.x[members]), self.y[members]).backward()
            self.adam.step()


class Jax:
    def __init__(self):
        draw = lambda *shape: jnp.asarray(rng.uniform(-0.35, 0.35, shape).astype(np.float32))
        self.parameters = [draw(2, 8), draw(8, 8), draw(8), draw(8, 8), draw(8, 8), draw(8), draw(8, 2), draw(2)]
        self.x, self.y = jnp.asarray(X), jnp.asarray(Y)
        adam = optax.adam(1e-3)
        self.state = adam.init(self.parameters)
        self.key = jax.random.PRNGKey(0)

        def net(parameters, x):
            w1, u1, b1, w2, u2, b2, wo, bo = parameters

            def step(hidden, row):
                first = jnp.tanh(row @ w1 + hidden[0] @ u1 + b1)
                return (first, jnp.tanh(first @ w2 + hidden[1] @ u2 + b2)), None

            nothing = jnp.zeros((x.shape[0], 8), jnp.float32)
            (_, second), _ = jax.lax.scan(step, (nothing, nothing), x.transpose(1, 0, 2))
            return second @ wo + bo

        def update(carry, members):
            parameters, state = carry
            x, y = self.x[members], self.y[members]
            slope = jax.grad(lambda p: jnp.mean((net(p, x) - y) ** 2))(parameters)
            change, state = adam.update(slope, state, parameters)
            return (optax.apply_updates(parameters, change), state), None

        def epoch(parameters, state, key):
            order = jax.random.permutation(key, WINDOWS)
            whole = WINDOWS // BATCH * BATCH
            carry, _ = jax.lax.scan(update, (parameters, state), order[:whole].reshape(-1, BATCH))
            return update(carry, order[whole:])[0]

        self.net, self.fused_epoch = jax.jit(net), jax.jit(epoch)

    def forward(self, count):
        x = self.x[:count]
        return lambda: self.net(self.parameters, x).block_until_ready()

    def epoch(self):
        self.key, key = jax.random.split(self.key)
        self.parameters, self.state = self.fused_epoch(self.parameters, self.state, key)
        jax.block_until_ready(self.parameters)


def squirrel():
    """Medians of criterion, us, by bench and path of registers."""
    bench = ["cargo", "bench", "--quiet", "-p", "squirrel-nn", "--bench", "rnn", "--"]
    options = ["--warm-up-time", "0.3", "--measurement-time", "1", "--noplot"]
    subprocess.run(bench + options, cwd=ROOT, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "criterion"
    found = {}
    for group in ("rnn_forward", "rnn_epoch"):
        for file in sorted((target / group).glob("*/new/estimates.json")):
            found[file.parts[-3]] = json.loads(file.read_text())["median"]["point_estimate"] / 1000
    return found


def main():
    options = argparse.ArgumentParser()
    options.add_argument("--rounds", type=int, default=5)
    options.add_argument("--out", type=pathlib.Path)
    options = options.parse_args()
    rivals = {"jax": Jax(), "torch": Torch()}
    rounds = []
    for _ in range(options.rounds):
        figures = {"squirrel": squirrel()}
        for name, rival in rivals.items():
            figures[name] = {
                "1_window": clock_us(rival.forward(1), 0.3),
                "1000_windows": clock_us(rival.forward(BULK), 0.5),
                "epoch": clock_us(rival.epoch, 1.0),
            }
        rounds.append(figures)
    if options.out:
        options.out.write_text(json.dumps(rounds, indent=1) + "\n")
    print(f"{'median us':34}{'squirrel':>10}{'jax':>10}{'torch':>10}   times faster: median (worst round)")
    for ours in rounds[0]["squirrel"]:
        work = next(w for w in ("1_window", "1000_windows", "epoch") if ours.startswith(w) or w == "epoch")
        row = f"{work + ': ' + ours if work == 'epoch' else ours:34}"
        row += f"{statistics.median(r['squirrel'][ours] for r in rounds):10.2f}"
        ratios = ""
        for name in rivals:
            row += f"{statistics.median(r[name][work] for r in rounds):10.1f}"
            times = [r[name][work] / r["squirrel"][ours] for r in rounds]
            ratios += f"   {name} {statistics.median(times):.1f} ({min(times):.1f})"
        print(row + ratios)


main()
