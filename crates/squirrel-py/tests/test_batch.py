"""Batches of the base model, and what all batches have: bits, threads, refusals. `test_batch_whole.py` has the rest."""

import threading
from collections.abc import Callable

import numpy as np
import pytest
from conftest import thrown

import squirrel


def flown(n: int, dtype: str, steps: list[int], threads: int = 1) -> np.ndarray:
    state, command = thrown(n, dtype)
    batch = squirrel.Batch(vehicles=[squirrel.Vehicle.bundled("squirrel")] * n, whole=False, dtype=dtype, threads=threads)
    batch.reset(state)
    batch.command(command)
    batch.set_wind(state[:, :3])
    for count in steps:
        batch.step(count)
    return batch.states()


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_the_bits_do_not_depend_on_size_threads_or_calls(dtype: str) -> None:
    whole = flown(1000, dtype, [50], threads=2)
    assert whole.dtype == dtype and np.isfinite(whole).all()
    np.testing.assert_array_equal(whole[:7], flown(7, dtype, [50]))
    np.testing.assert_array_equal(whole[:40], flown(40, dtype, [1] * 50))
    np.testing.assert_array_equal(whole, flown(1000, dtype, [20, 30], threads=1))


def test_a_batch_in_float64_is_the_core(vehicle: squirrel.Vehicle) -> None:
    state, command = thrown(5)
    wind = state[:, :3].copy()
    alone = squirrel.dynamics.rk4_step(vehicle, state=state, command=command, dt_s=1e-3, steps=50, wind_ned_m_s=wind)
    np.testing.assert_array_equal(flown(5, "float64", [50]), alone)


def test_the_derivative_is_the_slope_of_a_short_step(vehicle: squirrel.Vehicle) -> None:
    state, command = thrown(5)
    rate = squirrel.dynamics.derivative(vehicle, state=state, command=command)
    dt_s = 1e-6
    after = squirrel.dynamics.rk4_step(vehicle, state=state, command=command, dt_s=dt_s)
    np.testing.assert_allclose((after - state) / dt_s, rate, rtol=1e-3, atol=1e-3)


def test_hover_stands_still(vehicle: squirrel.Vehicle) -> None:
    batch = squirrel.Batch(vehicles=[vehicle], dtype="float64")
    state = np.zeros((1, 17))
    state[:, 6], state[:, 13:] = 1.0, vehicle.hover_command * vehicle["propulsion.speed_max_rad_s"]
    batch.reset(state)
    batch.command(np.full((1, 4), vehicle.hover_command))
    batch.step(1000)
    assert np.abs(batch.states()[0, :6]).max() < 1e-9


def test_a_rollout_is_a_batch_that_is_looked_at(vehicle: squirrel.Vehicle) -> None:
    state, command = thrown(6, "float32")
    commands = np.stack([command, 0.5 * command, command])
    motions = squirrel.rollout(vehicles=[vehicle] * 6, state=state, command=commands, steps_per_command=10)
    assert motions.shape == (3, 6, 17) and motions.dtype == np.float32
    batch = squirrel.Batch(vehicles=[vehicle] * 6)
    batch.reset(state)
    for command, motion in zip(commands, motions, strict=True):
        batch.command(command)
        batch.step(10)
        np.testing.assert_array_equal(batch.states(), motion)
    empty = squirrel.rollout(vehicles=[vehicle] * 6, state=state, command=commands[:0])
    assert empty.shape == (0, 6, 17)


def test_vehicles_differ_and_can_be_replaced(vehicle: squirrel.Vehicle) -> None:
    heavy = vehicle.edited({"mass.mass_kg": 0.7})
    batch = squirrel.Batch(vehicles=[vehicle, heavy, vehicle])
    batch.replace(2, heavy)
    batch.command(np.full((3, 4), 0.5, np.float32))
    batch.step(500)
    light, *others = batch.states()
    np.testing.assert_array_equal(others[0], others[1])
    assert light[2] < others[0][2]


def test_single_vehicles_are_reset(vehicle: squirrel.Vehicle) -> None:
    batch = squirrel.Batch(vehicles=[vehicle] * 20)
    batch.step(100)
    start = squirrel.Batch(vehicles=[vehicle] * 2).states()
    falling = batch.states()
    batch.reset(start, vehicles=np.array([3, 17]))
    now = batch.states()
    np.testing.assert_array_equal(now[[3, 17]], start)
    others = [k for k in range(20) if k not in (3, 17)]
    np.testing.assert_array_equal(now[others], falling[others])
    with pytest.raises(IndexError, match=r"vehicles\[1\] = 20: the batch has 20 vehicles"):
        batch.reset(start, vehicles=[1, 20])
    with pytest.raises(IndexError, match=r"index = 20: the batch has 20 vehicles"):
        batch.replace(20, vehicle)
    np.testing.assert_array_equal(batch.states(), now)


def test_states_are_written_where_told(vehicle: squirrel.Vehicle) -> None:
    batch = squirrel.Batch(vehicles=[vehicle] * 3)
    out = np.empty((3, 17), np.float32)
    assert batch.states(out) is out
    np.testing.assert_array_equal(out, batch.states())
    with pytest.raises(ValueError, match=r"out: expected a float32 array of shape \(3, 17\), got shape \(2, 17\)"):
        batch.states(out[:2])
    with pytest.raises(ValueError, match="out: "):
        batch.states(np.empty((17, 3), np.float32).T)
    out.flags.writeable = False
    with pytest.raises(ValueError, match="out: "):
        batch.states(out)


@pytest.mark.parametrize("n", [3, 1000])
def test_one_call_is_command_step_and_states(n: int, vehicle: squirrel.Vehicle) -> None:
    state, command = (rows.astype(np.float32) for rows in thrown(n))
    one, three = (squirrel.Batch(vehicles=[vehicle] * n) for _ in range(2))
    out = np.empty_like(state)
    for batch in (one, three):
        batch.reset(state)
    # The last are more than are flown without a look at Ctrl-C.
    for steps in (1, 7, 1200 if n == 1000 else 400_000):
        assert one.fly(command, steps, out=out) is out
        three.command(command)
        three.step(steps)
        np.testing.assert_array_equal(out, three.states())
    now = one.states()
    with pytest.raises(ValueError, match=r"out: expected a float32 array"):
        one.fly(command, out=out[:2])
    with pytest.raises(ValueError, match=r"command: expected a float32 array"):
        one.fly(command[:2])
    np.testing.assert_array_equal(one.states(), now)
    assert one.fly(command).shape == (n, 17)


def test_rows_may_lie_anywhere_in_memory(vehicle: squirrel.Vehicle) -> None:
    state, command = thrown(4)
    expected = squirrel.dynamics.derivative(vehicle, state=state, command=command)
    for other in (np.asfortranarray(state), np.repeat(state, 2, axis=0)[::2], state[::-1].copy()[::-1]):
        np.testing.assert_array_equal(squirrel.dynamics.derivative(vehicle, state=other, command=command), expected)


def test_memory_at_odd_addresses_is_refused(vehicle: squirrel.Vehicle) -> None:
    odd = np.frombuffer(bytearray(8 * 4 + 1), np.float64, offset=1).reshape(1, 4)
    assert not odd.flags.aligned
    with pytest.raises(ValueError, match="command: its numbers lie at odd addresses"):
        squirrel.Batch(vehicles=[vehicle], dtype="float64").command(odd)


def command(value: object) -> Callable[[squirrel.Batch], None]:
    return lambda batch: batch.command(value)  # type: ignore[arg-type]


def with_nan() -> np.ndarray:
    array = np.zeros((3, 4), np.float32)
    array[1, 2] = np.nan
    return array


@pytest.mark.parametrize(
    ("call", "line"),
    [
        (command(np.zeros((3, 4))), r"command: expected a float32 array of shape \(3, 4\), got float64 of shape \(3, 4\)"),
        (command(np.zeros((2, 4), np.float32)), r"command: expected a float32 array of shape \(3, 4\), got shape \(2, 4\)"),
        (command(np.zeros(12, np.float32)), r"command: .* got shape \(12,\)"),
        (command([[0.0] * 4] * 3), "command: .* got list"),
        (command(with_nan()), r"command\[1, 2\] = NaN: must be finite"),
        (lambda batch: batch.set_wind(np.full((3, 3), np.inf, np.float32)), r"wind_ned_m_s\[0, 0\] = inf: must be finite"),
        (lambda batch: batch.reset(np.zeros((3, 17), np.float32)), r"state\[0, 6:10\]: norm 0, must be 1 to within 0.001"),
        (lambda batch: batch.reset(np.zeros((3, 17), np.int64)), r"state: expected a float32 array .* got int64"),
    ],
)
def test_a_bad_array_is_named(call: Callable[[squirrel.Batch], None], line: str, vehicle: squirrel.Vehicle) -> None:
    with pytest.raises(ValueError, match=line):
        call(squirrel.Batch(vehicles=[vehicle] * 3))


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ({"vehicles": []}, "vehicles: none given"),
        ({"dt_s": 0.0}, "dt_s = 0: must be finite and > 0"),
        ({"dt_s": float("nan")}, "dt_s = NaN: must be finite and > 0"),
        ({"dt_s": 1.0}, "dt_s = 1 must be at most twice propulsion.time_constant_up_s = 0.0"),
        ({"scheme": "heun"}, "scheme = heun: must be rk4 or euler"),
        ({"dtype": "float16"}, "dtype = float16: must be float32 or float64"),
        ({"threads": 0}, "threads = 0: must be at least 1"),
    ],
)
def test_a_bad_batch_is_named(arguments: dict[str, object], line: str, vehicle: squirrel.Vehicle) -> None:
    with pytest.raises(ValueError, match=line):
        squirrel.Batch(**({"vehicles": [vehicle]} | arguments))  # type: ignore[arg-type]


def test_a_bad_step_of_the_core_is_named(vehicle: squirrel.Vehicle) -> None:
    state, command = thrown(2)
    for dt_s in [0.0, -1.0, float("nan")]:
        with pytest.raises(ValueError, match="dt_s = .*: must be finite and > 0"):
            squirrel.dynamics.rk4_step(vehicle, state=state, command=command, dt_s=dt_s)
    with pytest.raises(ValueError, match=r"state: expected a float64 array of shape \(n, 17\), got float32"):
        squirrel.dynamics.derivative(vehicle, state=state.astype(np.float32), command=command)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"command: expected a float64 array of shape \(2, 4\)"):
        squirrel.dynamics.derivative(vehicle, state=state, command=command[:1])
    with pytest.raises(ValueError, match="voltage_v = NaN: must be finite"):
        squirrel.dynamics.derivative(vehicle, state=state, command=command, voltage_v=float("nan"))


def test_two_threads_may_call_at_once(vehicle: squirrel.Vehicle) -> None:
    batch = squirrel.Batch(vehicles=[vehicle] * 100, dtype="float64", threads=2)
    batch.command(np.full((100, 4), 0.5))

    def steps() -> None:
        for _ in range(50):
            batch.step(10)
            batch.states()

    threads = [threading.Thread(target=steps) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    alone = squirrel.Batch(vehicles=[vehicle] * 100, dtype="float64")
    alone.command(np.full((100, 4), 0.5))
    alone.step(1000)
    np.testing.assert_array_equal(batch.states(), alone.states())


def test_other_threads_run_while_a_batch_steps(vehicle: squirrel.Vehicle) -> None:
    batch = squirrel.Batch(vehicles=[vehicle] * 1000, whole=False, threads=1)
    worker = threading.Thread(target=batch.step, args=[100_000])
    worker.start()
    turns = 0
    while worker.is_alive():
        turns += 1
    # A thread that holds the interpreter's lock would let this one look a few times at most.
    assert turns > 1000
