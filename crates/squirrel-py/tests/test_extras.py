"""What needs packages that squirrel does not: plots and PyTorch."""

from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT

import squirrel

SHIPPED = ROOT / "vehicles/squirrel-parnn.safetensors"


def test_plots_draw(vehicle: squirrel.Vehicle, flights: dict[str, squirrel.FlightLog], tmp_path: Path) -> None:
    plt = pytest.importorskip("matplotlib.pyplot")
    from squirrel import plot

    log = squirrel.simulate(scenario="avoid", seed=3)
    finding = squirrel.gap.find(vehicle=vehicle, flights=flights)
    axes = [
        plot.track(log),
        plot.tilt(log),
        plot.thrust(log),
        plot.residuals(finding),
        plot.force_prediction(squirrel.nn.load(SHIPPED), flights["f1"]),
    ]
    labels = [ax.get_ylabel() for ax in axes]
    assert labels == ["north m", "tilt deg", "thrust N", "residual force, body, N rms", "predicted N"]
    assert all(ax.has_data() for ax in axes)
    # One circle a trunk, and none beyond: the paper's field has one.
    assert len(axes[0].patches) == 1
    own = plt.figure().add_subplot()
    assert plot.tilt(log, ax=own) is own
    own.figure.savefig(tmp_path / "tilt.png")
    plt.close("all")


def test_the_torch_module_is_the_network_that_flies(
    flights: dict[str, squirrel.FlightLog], tmp_path: Path
) -> None:
    torch = pytest.importorskip("torch")
    from squirrel.torch import ParRnn

    module = ParRnn.load(SHIPPED)
    data = squirrel.nn.windows(flights)
    # Standing still, and far beyond what was trained, where the normal is turned onto the motion.
    odd = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0, 5], [0, 0, -5], [-3, 1, 20], [1e-3, 0, 9]], np.float32)
    rows = np.concatenate([data["rows"], np.ones((len(odd), 10, 2), np.float32)])
    velocity = np.concatenate([data["velocity_body_m_s"], odd])
    ours = squirrel.nn.forward(squirrel.nn.load(SHIPPED), rows=rows, velocity_body_m_s=velocity)
    theirs = module(torch.from_numpy(rows), torch.from_numpy(velocity))
    np.testing.assert_allclose(theirs.detach().numpy(), ours, rtol=2e-5, atol=2e-6)

    theirs.square().sum().backward()
    assert all(bool(p.grad.isfinite().all()) and bool((p.grad != 0).any()) for p in module.parameters())
    module.to_model().save(tmp_path / "same.safetensors")
    assert (tmp_path / "same.safetensors").read_bytes() == SHIPPED.read_bytes()
    with pytest.raises(ValueError, match="model = vanilla_plane: must be parnn"):
        ParRnn(squirrel.nn.train(flights, model="vanilla_plane", epochs=1))
