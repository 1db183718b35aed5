"""The paper's force model as a PyTorch module, with the same weights file, and policies from PyTorch to flight.

Needs PyTorch (``squirrel-flight[torch]``).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from squirrel._extra import needed

needed("squirrel.torch", "torch", "torch")

import torch
from torch import nn

from squirrel._squirrel import Model, Policy
from squirrel._squirrel import load as load_model

if TYPE_CHECKING:
    import os

    import numpy as np
    import numpy.typing as npt

__all__ = ["ParRnn", "policy_from_sequential"]

AIR_DENSITY_KG_M3 = 1.225
SPEED_LOWEST_M_S = 0.3
IN_PLANE_LOWEST_M_S = 0.05


class ParRnn(nn.Module):
    """A recurrent network that corrects the flat plate: the model ``parnn`` of `squirrel.nn`, differentiable.

    Parameters
    ----------
    model : squirrel.nn.Model
        Weights to start from.

    Raises
    ------
    ValueError
        The model is another one.
    """

    def __init__(self, model: Model) -> None:
        super().__init__()
        if model.card["model"] != "parnn":
            raise ValueError(f"model = {model.card['model']}: must be parnn")
        self._model = model
        self.area_m2: float = model.card["area_m2"]
        # A dot has another meaning in the names of PyTorch's parameters.
        for name, tensor in model.tensors().items():
            self.register_parameter(name.replace(".", "_"), nn.Parameter(torch.from_numpy(tensor)))

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> ParRnn:
        """Read a weights file of squirrel.

        Parameters
        ----------
        path : str or os.PathLike
            Safetensors file.

        Returns
        -------
        ParRnn
        """
        return cls(load_model(path))

    def to_model(self) -> Model:
        """Hand the weights back, to save, fly and compare them.

        Returns
        -------
        squirrel.nn.Model
            `Model.save` writes the same kind of file.
        """
        named = {name: self.get_parameter(name.replace(".", "_")) for name in self._model.tensors()}
        return self._model.with_tensors({name: tensor.detach().cpu().numpy() for name, tensor in named.items()})

    def outputs(self, rows: torch.Tensor) -> torch.Tensor:
        """Outputs of the network at the end of windows.

        Parameters
        ----------
        rows : torch.Tensor, shape (n, steps, 2)
            Speed over 10 m/s and angle of attack in rad, oldest first.

        Returns
        -------
        torch.Tensor, shape (n, 2)
        """
        first = rows.new_zeros(rows.shape[0], self.first_bias.shape[0])
        second = torch.zeros_like(first)
        for row in rows.unbind(1):
            first = torch.tanh(row @ self.first_input + first @ self.first_hidden + self.first_bias)
            second = torch.tanh(first @ self.second_input + second @ self.second_hidden + self.second_bias)
        return second @ self.output_weight + self.output_bias

    def forward(self, rows: torch.Tensor, velocity_body_m_s: torch.Tensor) -> torch.Tensor:
        """Force of the air on the spread wings.

        Parameters
        ----------
        rows : torch.Tensor, shape (n, steps, 2)
            As for `outputs`.
        velocity_body_m_s : torch.Tensor, shape (n, 3)
            At the last row.

        Returns
        -------
        torch.Tensor, shape (n, 3)
            N, body frame.
        """
        outputs = self.outputs(rows)
        alpha_w = 0.5 * math.pi * torch.tanh(outputs[:, 0])
        gamma = nn.functional.softplus(outputs[:, 1])
        speed = velocity_body_m_s.norm(dim=1)
        moves = speed >= SPEED_LOWEST_M_S
        # Where nothing moves there is no force; the numbers below must only be finite.
        normal = torch.where(moves, velocity_body_m_s[:, 2], torch.ones_like(speed))
        along = torch.where(moves[:, None], velocity_body_m_s[:, :2], torch.ones_like(velocity_body_m_s[:, :2]))
        in_plane = along.square().sum(1).clamp_min(1e-30).sqrt()
        direction = along / in_plane.clamp_min(IN_PLANE_LOWEST_M_S)[:, None]
        length = (normal.square() + in_plane.square()).sqrt()

        sine = normal * alpha_w.cos() + in_plane * alpha_w.sin()
        cosine = in_plane * alpha_w.cos() - normal * alpha_w.sin()
        clipped = cosine < 0.0
        towards = torch.where(sine < 0.0, -length, length)
        size = -AIR_DENSITY_KG_M3 * self.area_m2 * length * torch.where(clipped, towards, sine) * gamma
        along_wing = size * torch.where(clipped, in_plane / towards, alpha_w.sin())
        along_normal = size * torch.where(clipped, normal / towards, alpha_w.cos())
        force = torch.cat([along_wing[:, None] * direction, along_normal[:, None]], dim=1)
        return torch.where(moves[:, None], force, torch.zeros_like(force))


def policy_from_sequential(module: nn.Sequential) -> Policy:
    """Make a policy that flies of a module that was trained.

    Parameters
    ----------
    module : torch.nn.Sequential
        ``Linear(25, 32), Tanh(), Linear(32, 32), Tanh(), Linear(32, 4)``.

    Returns
    -------
    squirrel.Policy
        With the module's weights as float32.

    Raises
    ------
    ValueError
        The layers are others, or a weight is not finite.
    """
    layers = list(module)
    kinds = [type(layer).__name__ for layer in layers]
    if kinds != ["Linear", "Tanh", "Linear", "Tanh", "Linear"]:
        raise ValueError(f"module: layers {', '.join(kinds)}: must be Linear, Tanh, Linear, Tanh, Linear")

    def layer(linear: nn.Linear) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
        if linear.bias is None:
            raise ValueError(f"module: {linear}: must have a bias")
        weight, bias = (tensor.detach().cpu().float().numpy() for tensor in (linear.weight, linear.bias))
        return weight, bias

    first, second, output = (layer(linear) for linear in layers[::2])
    return Policy(first=first, second=second, output=output)
