"""Ctrl-C: loops look for it every bounded number of turns, and waiting callers at once."""

import signal
import sys
from collections.abc import Callable

import numpy as np
import pytest
from conftest import thrown

import squirrel
from squirrel._squirrel import looks as looked

N = 20_000
TURNS = 1024
"""Of a loop between two looks, at most."""


def looks(call: Callable[[], object]) -> int:
    before = looked()
    call()
    return looked() - before


def test_loops_look_every_so_many_turns(vehicle: squirrel.Vehicle) -> None:
    """Work over looks, whatever the machine: a turn takes some microseconds."""
    state, command = thrown(N)
    many = {"state": state, "command": command}
    q = np.tile(np.float32([1, 0, 0, 0]), (N, 1))
    three = np.zeros((N, 3), np.float32)
    one = {name: array[:1] for name, array in many.items()}
    batch = squirrel.Batch(vehicles=[vehicle] * N)
    policy = squirrel.Policy(
        **{
            name: (np.zeros(shape, np.float32), np.zeros(shape[0], np.float32))
            for name, shape in {"first": (32, 25), "second": (32, 32), "output": (4, 32)}.items()
        }
    )
    numbers = range(N)
    calls: dict[str, tuple[Callable[[], object], int, int]] = {
        "Batch": (lambda: squirrel.Batch(vehicles=[vehicle] * N), N, TURNS),
        "Batch, base": (lambda: squirrel.Batch(vehicles=[vehicle] * N, whole=False), N, TURNS),
        "Batch.reset": (lambda: batch.reset(state.astype(np.float32)), N, TURNS),
        "Batch.reset, some": (lambda: batch.reset(state.astype(np.float32), vehicles=numbers), 2 * N, TURNS),
        "Batch.set_charge": (lambda: batch.set_charge(np.ones(N, np.float32)), N, TURNS),
        "Batch.set_wind": (lambda: batch.set_wind(three), N, TURNS),
        "Batch.set_air": (lambda: batch.set_air(np.zeros((N, 3))), N, TURNS),
        "Batch.state": (batch.state, N, TURNS),
        "Batch.restore": (lambda: batch.restore(batch.state()), N, TURNS),
        "Batch.step": (lambda: batch.step(500), 500 * N, 1_000_000),
        "derivative": (lambda: squirrel.dynamics.derivative(vehicle, **many), N, TURNS),
        "rk4_step, many": (lambda: squirrel.dynamics.rk4_step(vehicle, dt_s=1e-3, **many), N, TURNS),
        "rk4_step, long": (lambda: squirrel.dynamics.rk4_step(vehicle, dt_s=1e-3, steps=N, **one), N, TURNS),
        "Tasks": (lambda: squirrel.Tasks(task="avoid", vehicles=[vehicle], num_envs=2000), 2000, 128),
        "Tasks.reset": (squirrel.Tasks(task="avoid", vehicles=[vehicle], num_envs=2000).reset, 2000, 128),
        "Policy": (lambda: policy(np.zeros((5 * N, 25), np.float32)), 5 * N, 16_384),
        "Stack": (lambda: squirrel.Stack(vehicle, count=N), N, TURNS),
        "Twcc": (lambda: squirrel.control.Twcc(vehicle, count=N), N, TURNS),
        "Stack.step": (lambda: squirrel.Stack(vehicle, count=N).step(time_us=1), 2 * N, TURNS),
        "Backstepping.step": (
            lambda: squirrel.control.Backstepping(vehicle, count=N).step(
                q_ned_from_body_wxyz=q, omega_body_rad_s=three, angle_rad=three, dt_s=0.01
            ),
            N,
            TURNS,
        ),
        "Twcc.step": (
            lambda: squirrel.control.Twcc(vehicle, count=N).step(
                position_ned_m=three, velocity_ned_m_s=three, q_ned_from_body_wxyz=q, reference_position_ned_m=three
            ),
            N,
            TURNS,
        ),
        # Steps of the flight code at 300 Hz.
        "simulate": (lambda: squirrel.simulate(scenario="hover", vehicle=vehicle), 300 * 5, 128),
    }
    for name, (call, work, at_most) in calls.items():
        assert looks(call) >= work // at_most - 1 > 0, name


def test_who_waits_for_another_thread_looks_meanwhile(vehicle: squirrel.Vehicle, flights: dict[str, squirrel.FlightLog]) -> None:
    """Each takes more than the time between two looks on any machine."""
    calls: dict[str, Callable[[], object]] = {
        "gap.find": lambda: squirrel.gap.find(vehicle=vehicle, flights=flights),
        "gap.name": lambda: squirrel.gap.name(vehicle=vehicle, flights=flights),
        "gap.check": lambda: squirrel.gap.check(vehicle=vehicle, flights=flights),
        "gap.run": lambda: squirrel.gap.run(vehicle=vehicle, flights=flights),
        "train": lambda: squirrel.nn.train(flights, epochs=20),
    }
    for name, call in calls.items():
        assert looks(call) > 0, name


def test_flights_are_copied_one_by_one(vehicle: squirrel.Vehicle, flights: dict[str, squirrel.FlightLog]) -> None:
    many = {f"{name} {i}": flight for i in range(20) for name, flight in flights.items()}
    assert looks(lambda: squirrel.nn.windows(many)) >= len(many)
    assert looks(lambda: squirrel.gap.find(vehicle=vehicle, flights=many)) >= len(many)


ENDLESS: dict[str, Callable[[squirrel.Vehicle], object]] = {
    "Batch.step": lambda v: squirrel.Batch(vehicles=[v]).step(10**15),
    "Batch.fly": lambda v: squirrel.Batch(vehicles=[v]).fly(np.zeros((1, 4), np.float32), 10**15),
    "rk4_step": lambda v: squirrel.dynamics.rk4_step(v, dt_s=1e-3, steps=10**15, **{k: x[:1] for k, x in zip(("state", "command"), thrown(1), strict=True)}),
    "rollout": lambda v: squirrel.rollout(
        vehicles=[v], state=thrown(1)[0], command=np.zeros((3, 1, 4)), steps_per_command=10**15
    ),
    "train": lambda v: squirrel.nn.train({"f": squirrel.simulate(scenario="random_spread", arm="pc_wings_open")}, epochs=100_000),
}


@pytest.mark.skipif(sys.platform == "win32", reason="needs a timer that signals")
@pytest.mark.parametrize("name", ENDLESS)
def test_what_would_take_years_ends(name: str, vehicle: squirrel.Vehicle) -> None:
    """A loop that did not look would never come back; how soon it does is counted above."""

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, 2.0)
    try:
        with pytest.raises(KeyboardInterrupt):
            ENDLESS[name](vehicle)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def test_a_batch_that_was_interrupted_flies_on(vehicle: squirrel.Vehicle) -> None:
    batch = squirrel.Batch(vehicles=[vehicle] * 10)
    batch.step(3)
    assert np.isfinite(batch.states()).all()
