"""What needs packages that squirrel does not: plots and PyTorch."""

import importlib
import sys
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


def test_several_flights_are_drawn_by_name() -> None:
    plt = pytest.importorskip("matplotlib.pyplot")
    from squirrel import plot

    flights = {arm: squirrel.simulate(scenario="avoid", arm=arm, seed=3) for arm in ("pc", "twcc_plus")}

    def legend(ax) -> list[str]:
        return [text.get_text() for text in ax.get_legend().get_texts()]

    track = plot.track(flights)
    assert legend(track) == ["reference", "pc", "twcc_plus"] and len(track.patches) == 1
    assert legend(plot.tilt(flights)) == ["pc", "twcc_plus", "limit"]
    assert legend(plot.thrust(flights)) == ["pc", "pc, demand", "twcc_plus", "twcc_plus, demand", "limit"]
    with pytest.raises(TypeError, match="log\\['a'\\]: expected a FlightLog, got int"):
        plot.tilt({"a": 1})
    with pytest.raises(ValueError, match="log: no flights given"):
        plot.track({})
    plt.close("all")


def test_what_is_missing_is_named_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    from squirrel import _extra

    monkeypatch.setattr(_extra, "find_spec", lambda package: None)
    log = squirrel.simulate(scenario="hover")
    with pytest.raises(ModuleNotFoundError, match="FlightLog.to_pandas needs pandas: pip install 'squirrel-flight\\[pandas\\]'"):
        log.to_pandas("imu")
    with pytest.raises(ModuleNotFoundError, match="FlightLog.to_polars needs polars: pip install 'squirrel-flight\\[polars\\]'"):
        log.to_polars("imu")
    for module, package, extra in [("plot", "matplotlib", "plot"), ("envs", "gymnasium", "gym"), ("torch", "torch", "torch")]:
        monkeypatch.delitem(sys.modules, f"squirrel.{module}", raising=False)
        line = f"squirrel.{module} needs {package}: pip install 'squirrel-flight\\[{extra}\\]'"
        with pytest.raises(ModuleNotFoundError, match=line):
            importlib.import_module(f"squirrel.{module}")


class Spoken:
    """An array of another library: nothing of NumPy's but what DLPack asks for."""

    def __init__(self, array: np.ndarray) -> None:
        self.array = array

    def __dlpack__(self, **arguments: object) -> object:
        return self.array.__dlpack__(**arguments)

    def __dlpack_device__(self) -> tuple[int, int]:
        return self.array.__dlpack_device__()


class Elsewhere(Spoken):
    """An array on another device."""

    def __dlpack__(self, **arguments: object) -> object:
        raise BufferError("on a device that is not there")


def others() -> list:
    """What makes another library's array of NumPy's, for the libraries that are there."""
    makers = [Spoken]
    for library, name in [("torch", "from_numpy"), ("jax.numpy", "asarray")]:
        try:
            makers.append(getattr(importlib.import_module(library), name))
        except ModuleNotFoundError:
            pass
    return makers


@pytest.mark.parametrize("of", others())
def test_arrays_of_other_libraries_come_in(of) -> None:
    commands = np.random.default_rng(1).uniform(0.2, 0.8, (3, 4)).astype(np.float32)
    vehicle = squirrel.Vehicle.bundled("squirrel")

    def flown(commands: object) -> np.ndarray:
        batch = squirrel.Batch(vehicles=[vehicle] * 3, dtype="float32")
        batch.command(commands)
        batch.step(50)
        return batch.states()

    assert np.array_equal(flown(of(commands)), flown(commands))
    assert np.array_equal(flown(np.from_dlpack(Spoken(commands))), flown(commands))
    with pytest.raises(TypeError, match="Elsewhere: must be on the CPU and detached .on a device that is not there"):
        flown(Elsewhere(commands))
    with pytest.raises(ValueError, match="command: expected a float32 array of shape .3, 4., got shape .3, 2"):
        flown(of(np.ascontiguousarray(commands[:, :2])))


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
