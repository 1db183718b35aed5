"""Learned models of the wing force."""

from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT

import squirrel

SHIPPED = ROOT / "vehicles/squirrel-parnn.safetensors"


def test_weights_come_back_from_their_file(tmp_path: Path) -> None:
    model = squirrel.nn.load(SHIPPED)
    assert model.card["model"] == "parnn" and model.card["vehicle"] == "squirrel"
    assert model.tensors()["first.input"].shape == (2, 8) and model.history.shape == (0, 2)
    model.with_tensors(model.tensors()).save(tmp_path / "same.safetensors")
    assert (tmp_path / "same.safetensors").read_bytes() == SHIPPED.read_bytes()


def test_weights_that_cannot_be_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no.safetensors"):
        squirrel.nn.load(tmp_path / "no.safetensors")
    (tmp_path / "bad.safetensors").write_bytes(b"nonsense")
    with pytest.raises(ValueError, match="bad.safetensors"):
        squirrel.nn.load(tmp_path / "bad.safetensors")
    model = squirrel.nn.load(SHIPPED)
    tensors = model.tensors()
    with pytest.raises(ValueError, match="tensors: third.bias: the model has no such tensor"):
        model.with_tensors(tensors | {"third.bias": np.zeros(8, np.float32)})
    with pytest.raises(ValueError, match=r"first.bias: expected a float32 array of shape \(8,\), got shape \(9,\)"):
        model.with_tensors(tensors | {"first.bias": np.zeros(9, np.float32)})
    with pytest.raises(ValueError, match=r"first.bias\[0\] = NaN: must be finite"):
        model.with_tensors(tensors | {"first.bias": np.full(8, np.nan, np.float32)})
    del tensors["first.bias"]
    with pytest.raises(ValueError, match="tensors: first.bias: missing"):
        model.with_tensors(tensors)


def test_training_learns_and_gives_equal_bits(flights: dict[str, squirrel.FlightLog], tmp_path: Path) -> None:
    models = [squirrel.nn.train(flights, validation=["f2"], epochs=40, seed=5) for _ in range(2)]
    for k, model in enumerate(models):
        model.save(tmp_path / f"{k}.safetensors")
    assert (tmp_path / "0.safetensors").read_bytes() == (tmp_path / "1.safetensors").read_bytes()
    history = models[0].history
    assert history.shape == (40, 2) and history[-1, 1] < 0.9 * history[0, 1]

    data = squirrel.nn.windows({"f2": flights["f2"]})
    inputs = {key: data[key] for key in ("rows", "velocity_body_m_s")}
    forces = squirrel.nn.forward(models[0], **inputs)
    error = np.sqrt(np.square(forces - data["label_body_n"]).sum(1).mean())
    # The weights are those of the best epoch.
    np.testing.assert_allclose(error, history[:, 1].min(), rtol=1e-3)
    np.testing.assert_array_equal(forces[:3], squirrel.nn.forward(models[0], **{k: v[:3] for k, v in inputs.items()}))


def test_vanilla_asks_for_the_attitude(flights: dict[str, squirrel.FlightLog]) -> None:
    model = squirrel.nn.train(flights, model="vanilla", epochs=1)
    data = squirrel.nn.windows(flights)
    assert np.isnan(model.history[:, 1]).all()
    with pytest.raises(ValueError, match="q_ned_from_body_wxyz: missing; the model vanilla speaks NED"):
        squirrel.nn.forward(model, rows=data["rows"], velocity_body_m_s=data["velocity_body_m_s"])


def test_a_bad_argument_is_named(flights: dict[str, squirrel.FlightLog]) -> None:
    with pytest.raises(ValueError, match="validation: .*f3"):
        squirrel.nn.train(flights, validation=["f3"])
    with pytest.raises(ValueError, match="epochs"):
        squirrel.nn.train(flights, epochs=0)
    with pytest.raises(ValueError, match="model = hawk: must be one of parnn"):
        squirrel.nn.train(flights, model="hawk")
    with pytest.raises(ValueError, match="flights: expected names .* and FlightLogs, got f of"):
        squirrel.nn.windows({"f": 3})  # type: ignore[dict-item]
    folded = {"folded": squirrel.simulate(scenario="hover", arm="pc")}
    with pytest.raises(ValueError, match="folded: wing.command: never above"):
        squirrel.nn.train(folded)
    model = squirrel.nn.load(SHIPPED)
    rows = np.zeros((2, 10, 2), np.float32)
    with pytest.raises(ValueError, match=r"velocity_body_m_s: expected a float32 array of shape \(2, 3\)"):
        squirrel.nn.forward(model, rows=rows, velocity_body_m_s=np.zeros((3, 3), np.float32))
