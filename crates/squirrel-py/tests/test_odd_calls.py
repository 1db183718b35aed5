"""Odd arguments, for every public function: a ValueError or TypeError that names the argument, or an answer; nothing else."""

import inspect
import math
from collections.abc import Callable, Iterator
from datetime import date
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from conftest import thrown

import squirrel
import squirrel.envs

N = 3
NAN, INF = float("nan"), float("inf")


class Odd:
    """What nobody expects."""


def endless() -> Iterator[int]:
    yield from ()


SCALARS: list[Any] = [
    None, True, -1, 0, 1, 2**31, 2**63, 2**64, -(2**64), 10**12, 10**40, -(10**400), 0.5, -0.0, NAN, INF, -INF, 1e308, 5e-324,
    1e38, -1.0, 1 + 2j, "", "x", "\0", "ä" * 50, b"x", [], [1], [[]], (), {}, {"a": 1}, set(), range(3), Odd(), Odd, print, ...,
    np.float32(1.0), np.int64(-1), np.array(1.0), np.datetime64("NaT"), Path("no/such/file"),
    False, 2**63 - 1, -(2**31), -(2**63), -1e308, 1e155, -1e-12,
    np.float64("nan"), np.float16("inf"), np.uint64(2**64 - 1), np.bool_(True), np.array("x"), np.array(None), np.str_("x"),
    "1", "nan", "\n", "squirrel\0", "\u202e", "x" * 10_000, "/", b"\xff", bytearray(b"x"), memoryview(b"x"), frozenset(), (1, 2, 3, 4), [None],
    [NAN], ["x"], [[1.0], [1.0, 2.0]], {1: 2}, Decimal("NaN"), Decimal(1), Fraction(1, 3), date(2026, 1, 1), NotImplemented,
    ValueError("x"), slice(None), lambda: 0,
]  # fmt: skip


def arrays(good: np.ndarray) -> Iterator[Any]:
    """Odd arrays in the place of a good one."""
    for number in (NAN, INF, -INF, 1e38, -1e38, 1e30):
        for at in (0, good.size - 1):
            bad = good.copy()
            if bad.size:
                bad.flat[at] = number
                yield bad
    other = "float32" if good.dtype == np.float64 else "float64"
    for dtype in (other, "float16", "int64", "bool", "complex64", "object", "U4", "V8"):
        yield np.zeros(good.shape, dtype)
    yield good[:0]
    yield good[..., :0]
    yield good[np.newaxis]
    yield good.ravel()
    yield np.concatenate([good, good])
    yield good.astype(good.dtype.newbyteorder())
    yield np.asfortranarray(good)
    yield good[::-1]
    yield good.tolist()
    yield np.zeros(())
    yield good[..., np.newaxis]
    yield good.astype("U8")
    yield good.astype("object")
    yield good * (1 + 1j)
    yield good > 0
    yield memoryview(good.copy())
    yield [good, good]
    yield np.broadcast_to(good.ravel()[:1], (2, *good.shape)) if good.size else good[np.newaxis]
    yield np.zeros((10**6, 0), good.dtype)
    yield np.frombuffer(b"", good.dtype)
    yield np.zeros((2,) * 20, good.dtype)
    yield np.ma.masked_array(good)
    # At odd addresses.
    raw = np.zeros(good.nbytes + 1, np.uint8)
    yield raw[1:].view(good.dtype).reshape(good.shape) if good.size else raw
    frozen = good.copy()
    frozen.flags.writeable = False
    yield frozen


def odd(good: Any) -> Iterator[Any]:
    yield from SCALARS
    if isinstance(good, np.ndarray):
        yield from arrays(good)
    if isinstance(good, (list, range)):
        yield from ([*good, Odd()], [*good, -1], [*good, 10**30], iter(good), endless(), tuple(good) * 2)


class Case:
    """A public callable and arguments that are fine."""

    def __init__(self, name: str, call: Callable[..., Any], /, **good: Any) -> None:
        self.name, self.call, self.good = name, call, good


def cases(vehicle: squirrel.Vehicle, flights: dict[str, squirrel.FlightLog], folder: Path) -> list[Case]:
    state, command = thrown(N)
    f32 = {"state": state.astype(np.float32), "command": command.astype(np.float32)}
    f64 = {"state": state, "command": command}
    three32, three = np.ones((N, 3), np.float32), np.ones((N, 3))
    q = np.tile(np.float32([1, 0, 0, 0]), (N, 1))
    layers = {"first": (32, 25), "second": (32, 32), "output": (4, 32)}
    weights: dict[str, Any] = {k: (np.zeros(s, np.float32), np.zeros(s[0], np.float32)) for k, s in layers.items()}
    policy = squirrel.Policy(**weights)
    batch = squirrel.Batch(vehicles=[vehicle] * N, threads=1)
    tasks = squirrel.Tasks(task="avoid", vehicles=[vehicle], num_envs=N, threads=1)
    stack, law = squirrel.Stack(vehicle, count=N), squirrel.control.Backstepping(vehicle, count=N)
    twcc = squirrel.control.Twcc(vehicle, count=N)
    log = flights["f1"]
    model = squirrel.nn.train({"f1": log}, epochs=1)
    data = {k: v[:4] for k, v in squirrel.nn.windows({"f1": log}).items()}
    policy.save(folder / "policy.safetensors")
    model.save(folder / "model.safetensors")
    log.write(folder / "log.mcap")
    vehicle.save(folder / "vehicle.toml")
    env, envs = squirrel.envs.SquirrelEnv(task="track"), squirrel.envs.SquirrelVectorEnv(task="track", num_envs=N, threads=1)
    env.reset(seed=0), envs.reset(seed=0)
    run = {"scheme": "rk4", "threads": 1}
    new = {"frame": "quad-x", "mass_kg": 0.7, "arm_m": 0.1, "propeller_inch": 5.0, "pitch_inch": 3.0, "cells": 4, "kv_rpm_per_v": 2000.0}
    task = {"task": "avoid", "vehicles": [vehicle], "num_envs": N, "action": "motor", "seed": 1, "episode_s": 1.0, "sensors": False, **run}
    setup = {"arm": "pc", "scenario": "hover", "seed": 1, "thrust_to_weight": 1.5}
    plan = {
        "reference_position_ned_m": np.outer(np.arange(4) * 0.1, [3.0, 0.0, 0.0]),
        "reference_velocity_ned_m_s": np.tile([3.0, 0.0, 0.0], (4, 1)),
        "position_ned_m": (0.0, 0.0, 0.0),
        "velocity_ned_m_s": (3.0, 0.0, 0.0),
        "thrust_ned_n": (0.0, 0.0, -5.4),
        "deployment": 0.0,
        "obstacles_m": np.array([[8.0, 0.2, 1.0]]),
        "wing": "flat",
        "thrust_to_weight": 1.3,
        "step_s": 0.1,
        "speed_max_m_s": 9.0,
        "reserve": 0.05,
        "wind_ned_m_s": (0.0, 0.0, 0.0),
    }
    frame = {
        "time_us": 10,
        "omega_body_rad_s": three32,
        "specific_force_body_m_s2": three32,
        "q_ned_from_body_wxyz": q,
        "position_ned_m": three32,
        "velocity_ned_m_s": three32,
        "altitude_m": np.ones(N, np.float32),
        "wing_force_ned_n": three32,
    }
    c = Case
    return [
        c("Vehicle.load", squirrel.Vehicle.load, path=str(folder / "vehicle.toml")),
        c("Vehicle.bundled", squirrel.Vehicle.bundled, name="squirrel"),
        c("Vehicle.new", squirrel.Vehicle.new, **new, capacity_ah=1.5, hover_thrust_fraction=0.4, name="mine"),
        c("Vehicle.parse", squirrel.Vehicle.parse, text=vehicle.text, name="text"),
        c("Vehicle.edited", vehicle.edited, changes={"mass.mass_kg": 0.6}),
        c("edited, mass_kg", lambda mass_kg: vehicle.edited({"mass.mass_kg": mass_kg}), mass_kg=0.6),
        c("Vehicle.save", vehicle.save, path=str(folder / "out.toml")),
        c("Vehicle.source", vehicle.source, key="mass.mass_kg"),
        c("Vehicle[]", lambda key: vehicle[key], key="mass.mass_kg"),
        c("in Vehicle", lambda key: key in vehicle, key="mass.mass_kg"),
        c("==", lambda other: vehicle == other, other=vehicle),
        c("simulate", squirrel.simulate, vehicle=vehicle, **setup, estimator="external", integrator="rk4", policy=policy),
        c("simulate, by a function", squirrel.simulate, controller=lambda sight, time_s: (5.4, 0.0, 0.0, 0.0), controller_hz=10, controller_commands="attitude"),
        c("read_log", squirrel.read_log, path=str(folder / "log.mcap"), map=None, topics=None),
        c("FlightLog.read", squirrel.FlightLog.read, path=str(folder / "log.mcap")),
        c("FlightLog.write", log.write, path=str(folder / "out.mcap")),
        c("FlightLog.time_s", log.time_s, source="imu"),
        c("FlightLog[]", lambda channel: log[channel], channel="imu.omega_body_rad_s"),
        c("FlightLog.to_pandas", log.to_pandas, source="imu"),
        c("FlightLog.to_polars", log.to_polars, source="imu"),
        c("Batch", squirrel.Batch, vehicles=[vehicle] * N, whole=True, dt_s=1e-3, dtype="float32", registers=None, **run),
        c("Batch.command", batch.command, command=f32["command"]),
        c("Batch.command_wings", batch.command_wings, command=np.ones((N, 2), np.float32)),
        # Many steps take long and end by Ctrl-C: 10**12 is not odd here.
        c("Batch.step", lambda steps: batch.step(few(steps)), steps=1),
        c("Batch.fly", lambda command, steps, out: batch.fly(command, few(steps), out=out), **{"command": f32["command"], "steps": 1, "out": f32["state"].copy()}),
        c("Batch.states", batch.states, out=f32["state"].copy()),
        c("Batch.reset", batch.reset, state=f32["state"], vehicles=[0, 1, 2]),
        c("Batch.set_charge", batch.set_charge, charge=np.ones(N, np.float32), vehicles=[0, 1, 2]),
        c("Batch.set_wind", batch.set_wind, wind_ned_m_s=three32),
        c("Batch.set_air", batch.set_air, wind_ned_m_s=three, gust_sigma_m_s=np.ones(N), seed=[1, 2, 3], vehicles=[0, 1, 2]),
        c("Batch.replace", batch.replace, index=1, vehicle=vehicle),
        c("Batch.restore", batch.restore, state=batch.state()),
        c("rollout", rollout, vehicles=[vehicle] * N, whole=True, state=state, command=command[np.newaxis], wing_command=np.ones((1, N, 2)), steps_per_command=1, dt_s=1e-3, wind_ned_m_s=three, **run),
        c("derivative", squirrel.dynamics.derivative, vehicle=vehicle, **f64, wind_ned_m_s=three, voltage_v=14.0),
        c("rk4_step", lambda steps, **rest: squirrel.dynamics.rk4_step(steps=few(steps), **rest), vehicle=vehicle, **f64, dt_s=1e-3, steps=1, wind_ned_m_s=three, voltage_v=14.0),
        c("Policy", squirrel.Policy, **weights),
        c("Policy.load", squirrel.Policy.load, path=str(folder / "policy.safetensors")),
        c("Policy.save", policy.save, path=str(folder / "out.safetensors")),
        c("Policy()", policy, observation=np.zeros((N, 25), np.float32)),
        c("Stack", squirrel.Stack, vehicle=vehicle, **setup, count=N),
        c("Stack.step", stack.step, **frame),
        c("Backstepping", squirrel.control.Backstepping, vehicle=vehicle, count=N),
        c("Backstepping.step", law.step, q_ned_from_body_wxyz=q, omega_body_rad_s=three32, angle_rad=three32, rate_rad_s=three32, acceleration_rad_s2=three32, dt_s=0.01, hold_integral=False),
        c("Twcc", squirrel.control.Twcc, vehicle=vehicle, arm="pc", count=N),
        c("Twcc.step", twcc.step, position_ned_m=three32, velocity_ned_m_s=three32, q_ned_from_body_wxyz=q, reference_position_ned_m=three32, reference_velocity_ned_m_s=three32, reference_acceleration_ned_m_s2=three32, reference_yaw_rad=0.1, wing_force_ned_n=three32, dt_s=0.1),
        c("Tasks", squirrel.Tasks, **task, registers=None),
        c("Tasks.seed", tasks.seed, index=0, seed=1),
        c("Tasks.reset", tasks.reset, mask=[True] * N),
        c("Tasks.step", tasks.step, actions=np.zeros((N, 4), np.float32)),
        c("Tasks.obstacles", tasks.obstacles, index=0),
        c("SquirrelEnv", squirrel.envs.SquirrelEnv, **{k: task[k] for k in ("task", "vehicles", "action", "episode_s", "sensors", "scheme")}, render_mode=None),
        c("SquirrelEnv.reset", env.reset, seed=1),
        c("SquirrelEnv.step", env.step, action=np.zeros(4, np.float32)),
        c("SquirrelVectorEnv", squirrel.envs.SquirrelVectorEnv, **{k: task[k] for k in ("task", "num_envs", "vehicles", "action", "episode_s", "sensors", "scheme", "threads")}, render_mode=None),
        c("SquirrelVectorEnv.reset", envs.reset, seed=1, options=None),
        c("SquirrelVectorEnv.step", envs.step, actions=np.zeros((N, 4), np.float32)),
        c("load", squirrel.nn.load, path=str(folder / "model.safetensors")),
        c("forward", squirrel.nn.forward, model=model, **{k: data[k] for k in ("rows", "velocity_body_m_s", "q_ned_from_body_wxyz")}),
        c("windows", squirrel.nn.windows, flights={"f1": log}, vehicle=vehicle),
        c("train", lambda epochs, **rest: squirrel.nn.train(epochs=min(epochs, 1) if isinstance(epochs, (int, np.integer)) and epochs > 0 else epochs, **rest), flights={"f1": log}, model="flat_plate", vehicle=vehicle, validation=None, epochs=1, batch=256, rate=1e-3, clip=5.0, patience=2, seed=1),
        c("Model.save", model.save, path=str(folder / "out.model")),
        c("Model.with_tensors", model.with_tensors, tensors=model.tensors()),
        c("reach", squirrel.plan.reach, vehicle=vehicle, velocity_ned_m_s=(5.0, 0.0, 0.0), thrust_to_weight=1.2, wing="flat", tilt="box", yaw_rad=0.0, directions=np.eye(3)),
        c("trajectory", squirrel.plan.trajectory, vehicle=vehicle, **plan),
        c("gap.check", squirrel.gap.check, vehicle=vehicle, flights={}, held_out=None),
        c("gap.find", squirrel.gap.find, vehicle=vehicle, flights={}),
        c("gap.name", squirrel.gap.name, vehicle=vehicle, flights={}, baseline=None),
        c("gap.shrink", squirrel.gap.shrink, vehicle=vehicle, flights={}, held_out={"f1": log}, baseline=None),
        c("gap.run", squirrel.gap.run, vehicle=vehicle, flights={}, held_out=None, baseline=None, fit=False, out=None),
    ]  # fmt: skip


def few(steps: Any) -> Any:
    """As many as are odd, and not as many as take long."""
    return steps if not isinstance(steps, (int, np.integer)) or steps < 0 or steps >= 2**64 else min(steps, 2)


def rollout(*, steps_per_command: Any, **rest: Any) -> np.ndarray:
    return squirrel.rollout(steps_per_command=few(steps_per_command), **rest)


# What a call may also raise: a key or a number of a thing that is not there, or a file.
LOOKUPS = {"key", "source", "channel", "index", "vehicle", "vehicles", "out", "path", "map", "scenario"}
# Where what is wrong has a better name than the argument.
BETTER = {
    "changes": ["a", "argument 'changes'"],
    "mass_kg": ["mass.mass_kg"],
    "text": ["line 1", "missing field"],
    "flights": ["flight"],
    "held_out": ["flight", "held_out"],
    "baseline": ["flight"],
    "tensors": ["tensors", "argument"],
    "topics": ["topic"],
    "options": ["reset_mask", "mask"],
    "action": ["actions"],
    # Two that do not fit each other: either may be meant.
    "vehicles": ["state: ", "charge: ", "wind_ned_m_s: ", "command: "],
    "state": ["command: "],
    "rows": ["velocity_body_m_s: "],
    "reference_position_ned_m": ["reference_velocity_ned_m_s: "],
}


def words(error: BaseException) -> str:
    return " ".join([str(error), *getattr(error, "__notes__", [])])


def complaint_of_the_rest(case: Case) -> str | None:
    """What a call with fine arguments says, where something else is missing."""
    try:
        case.call(**case.good)
    except ValueError as error:
        return words(error)
    return None


def complaint(case: Case, name: str, value: Any, usual: str | None) -> str | None:
    """What is wrong with how a call takes an odd argument."""

    def shown() -> str:
        # The text of a large array takes long.
        text = f"array of {value.dtype}, {value.shape}" if isinstance(value, np.ndarray) else repr(value)
        return f"{case.name}({name}={text:.60})"

    try:
        case.call(**(case.good | {name: value}))
    except (ValueError, TypeError, LookupError, OSError) as error:
        said = words(error)
        if said == usual:
            return None
        if isinstance(error, (LookupError, OSError)) and not isinstance(error, ValueError):
            return None if name in LOOKUPS else f"{shown()}: {type(error).__name__} {said:.200}"
        # What is in a file is named by the file, line breaks in its name spelt out.
        file = [str(value).replace("\n", "\\n").replace("\u202e", r"\u{202e}")] if name in ("path", "map") else []
        if any(word in said for word in (name, *BETTER.get(name, []), *file)):
            return None
        return f"{shown()}: does not name it: {type(error).__name__} {said:.200}"
    except Exception as error:
        return f"{shown()}: {type(error).__name__} {error!s:.200}"
    except BaseException as error:  # A panic of Rust is none of the others.
        if isinstance(error, KeyboardInterrupt):
            raise
        return f"{shown()}: {type(error).__name__} {error!s:.200}"
    return None


def test_odd_arguments_are_named(vehicle: squirrel.Vehicle, flights: dict[str, squirrel.FlightLog], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    count, complaints = 0, []
    for case in cases(vehicle, flights, tmp_path):
        usual = complaint_of_the_rest(case)
        assert usual is None or case.name.startswith("gap."), f"{case.name}: {usual}"
        for name, good in case.good.items():
            for value in odd(good):
                count += 1
                said = complaint(case, name, value, usual)
                if said is not None:
                    complaints.append(said)
    assert not complaints, f"{len(complaints)} of {count}:\n" + "\n".join(complaints[:80])
    assert count > 20_000


def test_every_public_function_is_called(vehicle: squirrel.Vehicle, flights: dict[str, squirrel.FlightLog], tmp_path: Path) -> None:
    """And with every argument that it has."""
    called: dict[str, set[str]] = {}
    for case in cases(vehicle, flights, tmp_path):
        called.setdefault(case.name.partition(",")[0], set()).update(case.good)
    modules = [squirrel, squirrel.control, squirrel.dynamics, squirrel.gap, squirrel.nn, squirrel.plan]
    missing = []

    def look(name: str, thing: Any) -> None:
        parameters = {p for p in inspect.signature(thing).parameters if p != "self"}
        if parameters and not parameters <= called.get(name, set()):
            missing.append((name, parameters - called.get(name, set())))

    for module in modules:
        for name in module.__all__:
            thing = getattr(module, name)
            if inspect.isclass(thing) and issubclass(thing, tuple(results())):
                continue
            if inspect.isclass(thing):
                if name not in ("Vehicle", "FlightLog", "Model", "Metrics"):
                    look(name, thing)
                for method in vars(thing):
                    if not method.startswith("_") and callable(getattr(thing, method)):
                        look(f"{name}.{method}", getattr(thing, method))
            elif callable(thing):
                look(f"gap.{name}" if module is squirrel.gap else name, thing)
    assert not missing


def results() -> list[type]:
    """Dataclasses that calls return; nobody makes them."""
    found = [getattr(module, name) for module in (squirrel.gap, squirrel.plan) for name in module.__all__]
    return [thing for thing in found if inspect.isclass(thing)]


def test_negative_and_huge_numbers_are_lines_of_our_own(vehicle: squirrel.Vehicle) -> None:
    for number in (-1, 2**64, -(10**400)):
        calls: list[tuple[str, Callable[[Any], Any]]] = [
            ("seed", lambda seed: squirrel.simulate(seed=seed)),
            ("steps", lambda steps: squirrel.Batch(vehicles=[vehicle]).step(steps)),
            ("threads", lambda threads: squirrel.Batch(vehicles=[vehicle], threads=threads)),
            ("num_envs", lambda num_envs: squirrel.Tasks(task="avoid", vehicles=[vehicle], num_envs=num_envs)),
            ("count", lambda count: squirrel.Stack(vehicle, count=count)),
            ("vehicles", lambda one: squirrel.Batch(vehicles=[vehicle]).reset(np.zeros((1, 17), np.float32), vehicles=[one])),
        ]
        for name, call in calls:
            with pytest.raises(ValueError) as error:
                call(number)
            assert str(error.value).startswith(name) and ": must be " in str(error.value)
    for count in (10**12, 2**63):
        for call in (
            lambda n: squirrel.Tasks(task="avoid", vehicles=[vehicle], num_envs=n),
            lambda n: squirrel.Stack(vehicle, count=n),
            lambda n: squirrel.envs.SquirrelVectorEnv(task="avoid", num_envs=n),
        ):
            with pytest.raises(ValueError, match="must be at most 1000000"):
                call(count)


def test_arguments_have_their_own_names(vehicle: squirrel.Vehicle) -> None:
    for arguments, line in [
        ({"estimator": "x"}, r"^estimator = x: no such estimator; known are eskf, "),
        ({"thrust_to_weight": -1}, r"^thrust_to_weight = -1: must be > 1"),
        ({"thrust_to_weight": NAN}, r"^thrust_to_weight = NaN: must be > 1"),
        ({"integrator": "x"}, r"^integrator = x"),
        ({"arm": "x"}, r"^arm = x"),
        ({"scenario": "x"}, r"scenario"),
    ]:
        with pytest.raises(ValueError, match=line):
            squirrel.simulate(**arguments)  # type: ignore[arg-type]


def test_wind_that_would_make_nan_is_refused(vehicle: squirrel.Vehicle) -> None:
    batch = squirrel.Batch(vehicles=[vehicle])
    for speed in (1e38, -1e38, 1001.0):
        with pytest.raises(ValueError, match=r"wind_ned_m_s\[0, 1\] = .*must be -1000 to 1000"):
            batch.set_wind(np.float32([[0.0, speed, 0.0]]))
        with pytest.raises(ValueError, match=r"wind_ned_m_s\[0, 1\]"):
            batch.set_air(np.array([[0.0, speed, 0.0]]))
    batch.set_wind(np.float32([[0.0, 60.0, 0.0]]))
    batch.step(100)
    assert np.isfinite(batch.states()).all()


def test_keys_and_equality_of_vehicles(vehicle: squirrel.Vehicle) -> None:
    assert "mass.mass_kg" in vehicle and "wing.model" in vehicle and "mass.weight_kg" not in vehicle
    assert 3 not in vehicle and None not in vehicle and "mass" not in vehicle
    assert list(vehicle) == vehicle.keys() and len(vehicle) == len(vehicle.keys())
    assert dict(vehicle)["mass.mass_kg"] == 0.548
    twin = squirrel.Vehicle.bundled("squirrel")
    assert vehicle == twin and hash(vehicle) == hash(twin) and len({vehicle, twin}) == 1
    heavy = vehicle.edited({"mass.mass_kg": 0.6})
    assert heavy != vehicle and heavy != "vehicle" and heavy == vehicle.edited({"mass.mass_kg": 0.6})
    loop: list[Any] = []
    loop.append(loop)
    with pytest.raises(ValueError, match="mass.mass_kg: expected"):
        vehicle.edited({"mass.mass_kg": loop})


def test_metrics_are_what_their_type_says() -> None:
    metrics = squirrel.simulate(scenario="hover").metrics
    assert metrics is not None
    hints = squirrel.flight.Metrics.__annotations__
    assert set(metrics) == set(hints)
    assert isinstance(metrics["not_finite"], bool) and isinstance(metrics["encounters"], int)
    assert all(isinstance(flag, str) for flag in metrics["flags"]) and len(metrics["displacement_m"]) == 2
    assert isinstance(metrics["rmse_m"], float) and math.isfinite(metrics["rmse_m"])


@pytest.mark.parametrize("action", ["motor", "attitude_wing"])
def test_environments_are_drawn_and_written(action: str) -> None:
    env = gymnasium.make("SquirrelAvoid-v0", render_mode="rgb_array", action=action)
    env.reset(seed=1)
    first = env.render()
    assert isinstance(first, np.ndarray) and first.shape == (240, 240, 3) and first.dtype == np.uint8
    assert len(np.unique(first.reshape(-1, 3), axis=0)) >= 5
    for _ in range(10):
        env.step(env.action_space.sample())
    assert (env.render() != first).any()
    written = gymnasium.make("SquirrelAvoid-v0", render_mode="ansi")
    written.reset(seed=1)
    text = written.render()
    assert isinstance(text, str) and "V" in text and "from reference" in text
    envs = gymnasium.make_vec("SquirrelTrack-v0", num_envs=3, render_mode="ansi")
    envs.reset(seed=1)
    assert len(envs.render()) == 3
    with pytest.raises(ValueError, match="render_mode = human: must be rgb_array or ansi"):
        squirrel.envs.SquirrelEnv(task="avoid", render_mode="human")
    for mode in (np.array([]), np.array(["ansi", "human"]), 1):
        with pytest.raises(TypeError, match="^render_mode: expected str or None, got "):
            squirrel.envs.SquirrelEnv(task="avoid", render_mode=mode)  # type: ignore[arg-type]


def test_an_error_is_one_line_whatever_is_given() -> None:
    calls: list[Callable[[str], Any]] = [
        lambda name: squirrel.simulate(scenario="hover", estimator=name),
        lambda name: squirrel.simulate(scenario="hover", integrator=name),
        lambda name: squirrel.simulate(scenario="hover", arm=name),
        lambda name: squirrel.envs.SquirrelEnv(task="avoid", render_mode=name),
    ]
    for call in calls:
        # As Rust spells it, or as Python does.
        with pytest.raises(ValueError, match=r" = a\\nb\\u(\{202e\}|202e): ") as error:
            call("a\nb\u202e")
        assert "\n" not in str(error.value) and "\u202e" not in str(error.value)
    for read in (squirrel.Vehicle.load, squirrel.read_log, squirrel.Policy.load, squirrel.nn.load):
        with pytest.raises(OSError, match=r"\\u\{1b\}\[2J\\u\{2066\}") as gone:
            read("no/\x1b[2J\u2066such")
        assert str(gone.value).isprintable()
