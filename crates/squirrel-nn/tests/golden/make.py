#!/usr/bin/env python3
"""Writes models.json: forces, losses and gradients of all networks by PyTorch, in f64, for the tests of squirrel-nn.

    python3 make.py          needs numpy and torch (made with torch 2.15.0)

An independent statement of the models: torch.nn.RNN, torch.autograd, and the head as the paper prints it, in world
vectors with angles by arc sine and a clipped sum (docs/equations.md T4, T5), where the Rust code works with ratios of
velocities in the body frame. Inputs and weights are rounded to f32, so that both sides start from the same numbers.
"""

import json
import math
import pathlib

import numpy as np
import torch

AIR_DENSITY = 1.225
AREA = np.float32(0.04)
WINDOWS = 21  # a block of sixteen and a part of one
torch.set_default_dtype(torch.float64)
rng = np.random.default_rng(2504)


def f32(values):
    """Rounded to f32, as f64."""
    return np.asarray(values, np.float32).astype(np.float64)


def windows():
    for _ in range(WINDOWS):
        speed = rng.uniform(0.5, 9.0)
        # Many close to 90 degrees, so that the angle is clipped in some.
        alpha = math.asin(rng.uniform(-1.0, 1.0))
        heading = rng.uniform(-math.pi, math.pi)
        along = speed * math.cos(alpha)
        velocity = [along * math.cos(heading), along * math.sin(heading), speed * math.sin(alpha)]
        rows = np.stack([rng.uniform(0.03, 1.0, 10), rng.uniform(-1.5, 1.5, 10)], 1)
        quaternion = rng.normal(size=4)
        yield {
            "rows": f32(rows),
            "velocity_body_m_s": f32(velocity),
            "q_ned_from_body_wxyz": f32(quaternion / np.linalg.norm(quaternion)),
            "label_body_n": f32(rng.normal(size=3)),
        }


def rotation(q):
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def network(outputs):
    """A network, and its parameters in the order of squirrel-nn: matrices [inputs, outputs], one bias a layer."""
    rnn = torch.nn.RNN(2, 8, num_layers=2, nonlinearity="tanh", batch_first=True)
    read = torch.nn.Linear(8, outputs)
    order = []
    with torch.no_grad():
        for layer in ("l0", "l1"):
            getattr(rnn, f"bias_hh_{layer}").zero_()
            order += [getattr(rnn, f"{kind}_{layer}") for kind in ("weight_ih", "weight_hh", "bias_ih")]
        order += [read.weight, read.bias]
        for tensor in order:
            tensor.copy_(torch.from_numpy(f32(rng.uniform(-0.6, 0.6, tuple(tensor.shape)))))
    return rnn, read, order


def flat(tensors):
    """Matrices transposed, all in one list."""
    return np.concatenate([t.detach().numpy().T.reshape(-1) for t in tensors])


def forces(model, outputs, velocity, ned_from_body):
    """In the frame that the model speaks."""
    if model in ("vanilla", "vanilla_body"):
        return outputs
    v = torch.einsum("nij,nj->ni", ned_from_body, velocity)
    n = ned_from_body[:, :, 2]
    speed = v.norm(dim=1)
    sine = (v * n).sum(1) / speed
    in_plane = v - (v * n).sum(1, keepdim=True) * n
    e_t = in_plane / in_plane.norm(dim=1, keepdim=True)
    pressure = AIR_DENSITY * float(AREA) * speed**2
    if model == "vanilla_plane":
        world = -pressure[:, None] * (outputs[:, :1] * e_t + outputs[:, 1:] * n)
    else:
        alpha = torch.asin(sine)
        alpha_est = torch.clamp(alpha + math.pi / 2 * torch.tanh(outputs[:, 0]), -math.pi / 2, math.pi / 2)
        beta = (alpha_est - alpha)[:, None]
        gamma = torch.nn.functional.softplus(outputs[:, 1])
        size = pressure * torch.sin(alpha_est) * gamma
        world = -size[:, None] * (torch.cos(beta) * n + torch.sin(beta) * e_t)
    return torch.einsum("nji,nj->ni", ned_from_body, world)


def main():
    data = list(windows())
    rows = torch.from_numpy(np.stack([w["rows"] for w in data]))
    velocity = torch.from_numpy(np.stack([w["velocity_body_m_s"] for w in data]))
    ned_from_body = torch.from_numpy(np.stack([rotation(w["q_ned_from_body_wxyz"]) for w in data]))
    label = torch.from_numpy(np.stack([w["label_body_n"] for w in data]))
    models = {}
    for model, outputs in [
        ("parnn", 2),
        ("parnn_window_1", 2),
        ("vanilla", 3),
        ("vanilla_body", 3),
        ("vanilla_plane", 2),
    ]:
        rnn, read, parameters = network(outputs)
        seen = rows[:, -1:] if model == "parnn_window_1" else rows
        said = read(rnn(seen)[0][:, -1])
        force = forces(model, said, velocity, ned_from_body)
        target = torch.einsum("nij,nj->ni", ned_from_body, label) if model == "vanilla" else label
        loss = ((force - target) ** 2).sum(1).mean()
        loss.backward()
        models[model] = {
            "parameters": flat(parameters),
            "forces_n": force.detach().numpy(),
            "loss_n2": float(loss.detach()),
            "gradient": flat([p.grad for p in parameters]),
        }
    text = json.dumps(
        {"torch": torch.__version__.split("+")[0], "area_m2": float(AREA), "windows": data, "models": models},
        default=lambda array: array.tolist(),
    )
    target = pathlib.Path(__file__).with_name("models.json")
    target.write_text(text.replace("}, {", "},\n{").replace('"parameters"', '\n"parameters"') + "\n")


main()
