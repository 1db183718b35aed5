"""Whole vehicles in batches: wings, batteries, effects, gusts; their bits, and what is refused."""

from collections.abc import Callable

import numpy as np
import pytest
from conftest import thrown

import squirrel

BASE = squirrel.Vehicle.bundled("squirrel")
EFFECTS = {
    "effects.battery_sag.voltage_exponent": 0.9,
    "effects.gust.sigma_m_s": 0.8,
    "effects.linear_drag.extra_drag_n_s_per_m": 0.1,
    "effects.actuation_latency.latency_s": 0.02,
}
LOADED = BASE.edited(EFFECTS)
# Without wings, battery and effects.
BARE = squirrel.Vehicle.bundled("crazyflie2_arpl")


def whole(n: int, dtype: str = "float32", **settings: object) -> squirrel.Batch:
    """Vehicles of which every second has effects, each with air, charge and wing commands of its own."""
    state, command = thrown(n, dtype)
    batch = squirrel.Batch(vehicles=[[BASE, LOADED][k % 2] for k in range(n)], dtype=dtype, **settings)  # type: ignore[arg-type]
    batch.reset(state)
    batch.command(command)
    batch.command_wings(np.abs(command[:, :2]))
    batch.set_charge(np.linspace(0.3, 0.9, 7).astype(dtype)[np.arange(n) % 7])
    batch.set_air(state[:, :3].astype(np.float64), gust_sigma_m_s=np.full(n, 1.2), seed=range(n))
    return batch


def flown(batch: squirrel.Batch, steps: list[int]) -> np.ndarray:
    for count in steps:
        batch.step(count)
    return np.concatenate([batch.states(), batch.deployments(), batch.battery()], axis=1)


@pytest.mark.parametrize("scheme", ["rk4", "euler"])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_the_bits_do_not_depend_on_size_threads_calls_or_registers(dtype: str, scheme: str) -> None:
    many = flown(whole(1000, dtype, scheme=scheme, threads=2), [500])
    assert many.dtype == dtype and np.isfinite(many).all()
    assert (many[:, 17:19] > 0.1).all(), "wings are open"
    np.testing.assert_array_equal(many, flown(whole(1000, dtype, scheme=scheme, threads=1), [180, 320]))
    np.testing.assert_array_equal(many[:1], flown(whole(1, dtype, scheme=scheme), [500]))
    np.testing.assert_array_equal(many[:20], flown(whole(20, dtype, scheme=scheme), [1] * 500))
    for registers in ["scalar", "portable"]:
        np.testing.assert_array_equal(many[:20], flown(whole(20, dtype, scheme=scheme, registers=registers), [500]))


def test_what_a_vehicle_has_acts() -> None:
    n = 3
    believed = flown(whole(n), [500])
    bare = squirrel.Batch(vehicles=[BASE] * n, whole=False)
    state, command = thrown(n, "float32")
    bare.reset(state)
    bare.command(command)
    bare.set_wind(state[:, :3].copy())
    bare.step(500)
    assert (np.abs(bare.states()[:, :3] - believed[:, :3]).max(axis=1) > 0.03).all()


def test_the_base_model_is_what_a_vehicle_without_more_flies() -> None:
    """Nothing is asked for, and nothing is lost: to the bit, as with all that others have left out."""
    state, command = thrown(5, "float32")
    motions = []
    for flies_whole in (True, False):
        batch = squirrel.Batch(vehicles=[BARE] * 5, whole=flies_whole)
        batch.reset(state)
        batch.command(command)
        batch.step(100)
        motions.append(batch.states())
    np.testing.assert_array_equal(*motions)


def test_batteries_drain_and_are_charged() -> None:
    batch = squirrel.Batch(vehicles=[BASE] * 3)
    full = batch.battery()
    assert full.shape == (3, 3) and (full[:, 0] == 1.0).all() and (full[:, 1] > 16.0).all()
    batch.command(np.full((3, 4), 0.7, np.float32))
    batch.step(5000)
    now = batch.battery()
    assert (now[:, 0] < 0.999).all() and (now[:, 1] < full[:, 1] - 0.1).all() and (now[:, 2] > 1.0).all()
    batch.set_charge(np.array([0.25], np.float32), vehicles=[1])
    assert batch.battery()[:, 0].tolist() == [now[0, 0], 0.25, now[2, 0]]
    batch.reset(batch.states()[:1], vehicles=[2])
    assert batch.battery()[2, 0] == 1.0


def test_wings_open_and_fold() -> None:
    batch = squirrel.Batch(vehicles=[BASE] * 2)
    assert (batch.deployments() == 0.0).all()
    batch.command_wings(np.array([[1.0, 0.0], [2.0, 0.5]], np.float32))
    batch.step(2000)
    np.testing.assert_allclose(batch.deployments(), [[1.0, 0.0], [1.0, 0.5]], atol=1e-3)


def test_gusts_are_those_of_the_seed() -> None:
    def position(vehicle: squirrel.Vehicle, **air: object) -> np.ndarray:
        batch = squirrel.Batch(vehicles=[vehicle] * 2, dtype="float64")
        if air:
            batch.set_air(np.zeros((2, 3)), **air)  # type: ignore[arg-type]
        batch.step(1000)
        return batch.states()[:, :3]

    blown = position(BASE, gust_sigma_m_s=np.array([1.0, 1.0]), seed=[5, 5])
    np.testing.assert_array_equal(blown[0], blown[1])
    other = position(BASE, gust_sigma_m_s=np.array([1.0, 1.0]), seed=[5, 6])
    np.testing.assert_array_equal(other[0], blown[0])
    assert (other[1] != blown[1]).any()
    # The effect blows without being asked, by the vehicle's number.
    gusty = BASE.edited({"effects.gust.sigma_m_s": 1.0})
    own = position(gusty)
    assert (own[0] != own[1]).any() and (own[0] != position(BASE)[0]).any()
    np.testing.assert_array_equal(own, position(gusty, seed=[0, 1]))


def test_a_domain_is_drawn_anew() -> None:
    flat = BASE.edited({"wing.model": "flat"})
    batch = squirrel.Batch(vehicles=[BASE] * 3)
    batch.set_charge(np.full(3, 0.5, np.float32))
    batch.command(np.full((3, 4), 0.6, np.float32))
    batch.replace(1, BASE.edited({"mass.mass_kg": 0.7, "battery.r0_ohm": 0.2}))
    batch.step(1000)
    height_m, battery = -batch.states()[:, 2], batch.battery()
    assert height_m[1] < height_m[0] == height_m[2] and battery[1, 1] < battery[0, 1] == battery[2, 1]
    with pytest.raises(ValueError, match=r"vehicles\[1\]: wing: the batch was made without"):
        batch.replace(1, flat)
    with pytest.raises(ValueError, match=r"vehicles\[1\]: battery_sag: the batch was made without"):
        batch.replace(1, LOADED)


def test_a_rollout_opens_wings() -> None:
    state, command = thrown(4, "float32")
    wings = np.stack([np.zeros((4, 2)), np.ones((4, 2))]).astype(np.float32)
    commands = np.stack([command, command])
    motions = squirrel.rollout(vehicles=[BASE] * 4, state=state, command=commands, wing_command=wings, steps_per_command=100)
    batch = squirrel.Batch(vehicles=[BASE] * 4)
    batch.reset(state)
    batch.command(command)
    batch.step(100)
    np.testing.assert_array_equal(batch.states(), motions[0])
    batch.command_wings(wings[1])
    batch.step(100)
    np.testing.assert_array_equal(batch.states(), motions[1])
    folded = squirrel.rollout(vehicles=[BASE] * 4, state=state, command=commands, steps_per_command=100)
    assert (folded[1] != motions[1]).any()
    with pytest.raises(ValueError, match=r"wing_command: expected a float32 array of shape \(2, 4, 2\), got shape \(1, 4, 2\)"):
        squirrel.rollout(vehicles=[BASE] * 4, state=state, command=commands, wing_command=wings[:1])


@pytest.mark.parametrize(
    ("vehicles", "line"),
    [
        (
            [BASE.edited({"wing.model": "parnn"})],
            r"vehicles\[0\]: wing.model = parnn: .*; whole=False flies the base model",
        ),
        ([BASE, BASE.edited({"wing.model": "flat"})], r"vehicles\[1\]: wing.model: flat and membrane .*whole=False"),
        ([BASE.edited({"effects.gnss_latency.latency_s": 0.1})], r"effects.gnss_latency: acts on sensors .*whole=False"),
    ],
)
def test_what_does_not_fly_in_a_batch_is_refused(vehicles: list[squirrel.Vehicle], line: str) -> None:
    with pytest.raises(ValueError, match=line):
        squirrel.Batch(vehicles=vehicles)
    assert len(squirrel.Batch(vehicles=vehicles, whole=False)) == len(vehicles)


@pytest.mark.parametrize(
    ("call", "line"),
    [
        (lambda batch: batch.battery(), "the batch has no battery: "),
        (lambda batch: batch.deployments(), "the batch has no wings: "),
        (lambda batch: batch.command_wings(np.zeros((3, 2), np.float32)), "the batch has no wings: "),
        (lambda batch: batch.set_charge(np.zeros(3, np.float32)), "the batch has no battery: "),
        (lambda batch: batch.set_air(np.zeros((3, 3))), "the base model has no gusts"),
    ],
)
def test_a_call_that_would_do_nothing_is_refused(call: Callable[[squirrel.Batch], object], line: str) -> None:
    with pytest.raises(ValueError, match=line):
        call(squirrel.Batch(vehicles=[BASE] * 3, whole=False))
    with pytest.raises(ValueError, match=line):
        call(squirrel.Batch(vehicles=[BARE] * 3))


@pytest.mark.parametrize(
    ("call", "line"),
    [
        (lambda batch: batch.command_wings(np.zeros((3, 4), np.float32)), r"command: expected a float32 array of shape \(3, 2\)"),
        (lambda batch: batch.command_wings(np.full((3, 2), np.nan, np.float32)), r"command\[0, 0\] = NaN: must be finite"),
        (lambda batch: batch.set_charge(np.array([0.5, 1.5, 0.5], np.float32)), r"charge\[1\] = 1.5: must be 0 to 1"),
        (lambda batch: batch.set_charge(np.zeros(3)), r"charge: expected a float32 array of shape \(3,\), got float64"),
        (lambda batch: batch.set_air(np.zeros((2, 3))), r"wind_ned_m_s: expected a float64 array of shape \(3, 3\)"),
        (
            lambda batch: batch.set_air(np.zeros((3, 3)), gust_sigma_m_s=np.array([0.0, -1.0, 0.0])),
            r"gust_sigma_m_s\[1\] = -1: must be >= 0",
        ),
        (lambda batch: batch.set_air(np.zeros((3, 3)), seed=[1]), "seed: expected 3, got 1"),
    ],
)
def test_a_bad_argument_is_named(call: Callable[[squirrel.Batch], object], line: str) -> None:
    with pytest.raises(ValueError, match=line):
        call(squirrel.Batch(vehicles=[BASE] * 3))


def test_a_vehicle_that_is_not_there_is_named() -> None:
    batch = squirrel.Batch(vehicles=[BASE] * 3)
    with pytest.raises(IndexError, match=r"vehicles\[0\] = 3: the batch has 3 vehicles"):
        batch.set_charge(np.zeros(1, np.float32), vehicles=[3])
    with pytest.raises(IndexError, match=r"vehicles\[0\] = 3: the batch has 3 vehicles"):
        batch.set_air(np.zeros((1, 3)), vehicles=[3])


def test_six_rotors_fly_the_base_model_alone() -> None:
    more = "".join(f"[[rotor]]\nposition_body_m = [{x}, 0.0, 0.0]\nyaw_sign = {sign}\n" for x, sign in [(0.1, 1), (-0.1, -1)])
    hexa = squirrel.Vehicle.parse(f"{BASE.text}\n{more}")
    assert hexa.rotor_count == 6
    with pytest.raises(ValueError, match="vehicles: 6 rotors; wings, batteries and effects .* whole=False flies the base model"):
        squirrel.Batch(vehicles=[hexa])
    batch = squirrel.Batch(vehicles=[hexa], whole=False)
    assert batch.states().shape == (1, 19)
