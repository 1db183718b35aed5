"""Policies from NumPy and PyTorch to flight."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import squirrel

Layer = tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]
SHAPES = {"first": (32, 25), "second": (32, 32), "output": (4, 32)}


def layers(seed: int = 0) -> dict[str, Layer]:
    generator = np.random.default_rng(seed)

    def layer(shape: tuple[int, int]) -> Layer:
        weight = generator.normal(0.0, shape[1] ** -0.5, shape)
        return weight.astype(np.float32), generator.normal(0.0, 0.1, shape[0]).astype(np.float32)

    return {name: layer(shape) for name, shape in SHAPES.items()}


def by_hand(tilt_max_rad: float) -> dict[str, Layer]:
    """A controller that anybody would write, where tanh is nearly linear: acceleration from errors; wings folded."""
    small, position_per_s2, velocity_per_s = 0.1, 1.5, 2.2
    zero = {name: (np.zeros(shape, np.float32), np.zeros(shape[0], np.float32)) for name, shape in SHAPES.items()}
    tilt = 1.0 / (9.81 * tilt_max_rad)
    for axis, action, gain in ((0, 1, -tilt), (1, 0, tilt), (2, 2, -1.0 / 9.81)):
        zero["first"][0][axis, axis] = small * gain * position_per_s2 * 2.0
        zero["first"][0][axis, 3 + axis] = small * gain * velocity_per_s * 5.0
        zero["second"][0][axis, axis] = 1.0
        zero["output"][0][action, axis] = 1.0 / small
    zero["output"][1][3] = -1.0
    return zero


def test_a_policy_is_its_equation_up_to_the_rounding_of_tanh() -> None:
    weights = layers()
    policy = squirrel.Policy(**weights)
    seen = np.random.default_rng(1).normal(0.0, 1.5, (1000, 25)).astype(np.float32)
    exact = seen.astype(np.float64)
    for name in SHAPES:
        weight, bias = (array.astype(np.float64) for array in weights[name])
        exact = exact @ weight.T + bias
        if name != "output":
            exact = np.tanh(exact)
    actions = policy(seen)
    assert actions.shape == (1000, 4) and actions.dtype == np.float32
    # The quotient of polynomials that flies is within 6 units of the last place of tanh.
    np.testing.assert_allclose(actions, exact, atol=3e-6)
    np.testing.assert_array_equal(policy(seen[7:9]), actions[7:9])
    np.testing.assert_array_equal(policy(np.asfortranarray(seen)), actions)
    assert policy(seen[:0]).shape == (0, 4)


def test_a_policy_comes_back_from_its_file_and_flies(tmp_path: Path, vehicle: squirrel.Vehicle) -> None:
    policy = squirrel.Policy(**by_hand(vehicle["limits.tilt_max_rad"]))
    policy.save(tmp_path / "hand.safetensors")
    read = squirrel.Policy.load(tmp_path / "hand.safetensors")
    seen = np.ones((3, 25), np.float32)
    np.testing.assert_array_equal(read(seen), policy(seen))
    assert read.hash == policy.hash and "hand.safetensors" in repr(read)

    flown = squirrel.simulate(scenario="track", policy=read)
    chance = squirrel.simulate(scenario="track", policy=squirrel.Policy(**layers()))
    assert flown.metrics is not None and chance.metrics is not None
    assert flown.metrics["rmse_m"] < 2.5 and chance.metrics["rmse_m"] > 5.0 * flown.metrics["rmse_m"]
    assert flown.metadata["policy_hash"] == policy.hash and flown.metadata["arm"] == "pc"
    commands = flown["offboard.roll_rad_pitch_rad_thrust_n_wing"]
    assert commands.shape[1] == 4 and (commands[:, 3] == 0.0).all()


def test_what_cannot_be_a_policy_is_named(tmp_path: Path) -> None:
    good = layers()
    weight, bias = good["second"]
    for wrong, line in (
        ((weight.T[:31], bias), r"second\[0\]: expected a float32 array of shape \(32, 32\), got shape \(31, 32\)"),
        ((weight, bias.astype(np.float64)), r"second\[1\]: expected a float32 array of shape \(32,\), got float64"),
        ((weight, np.full(32, np.nan, np.float32)), r"second\[1\]\[0\] = NaN: must be finite"),
    ):
        with pytest.raises(ValueError, match=line):
            squirrel.Policy(**(good | {"second": wrong}))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"observation: expected a float32 array of shape \(n, 25\)"):
        squirrel.Policy(**good)(np.zeros((2, 24), np.float32))
    with pytest.raises(FileNotFoundError, match="no.safetensors"):
        squirrel.Policy.load(tmp_path / "no.safetensors")
    (tmp_path / "bad.safetensors").write_bytes(b"nonsense")
    with pytest.raises(ValueError, match="bad.safetensors: not a whole safetensors file"):
        squirrel.Policy.load(tmp_path / "bad.safetensors")


def test_a_sequential_of_pytorch_becomes_a_policy() -> None:
    torch = pytest.importorskip("torch")
    from squirrel.torch import policy_from_sequential

    torch.manual_seed(0)
    nn = torch.nn
    module = nn.Sequential(nn.Linear(25, 32), nn.Tanh(), nn.Linear(32, 32), nn.Tanh(), nn.Linear(32, 4))
    seen = torch.randn(50, 25)
    np.testing.assert_allclose(policy_from_sequential(module)(seen.numpy()), module(seen).detach().numpy(), atol=3e-6)
    with pytest.raises(ValueError, match="module: layers Linear, ReLU: must be Linear, Tanh, Linear, Tanh, Linear"):
        policy_from_sequential(nn.Sequential(nn.Linear(25, 32), nn.ReLU()))
