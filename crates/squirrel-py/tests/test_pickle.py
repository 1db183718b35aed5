"""Everything public is pickled and copied, and flies on alike, bit for bit."""

import copy
import dataclasses
import inspect
import pickle
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import gymnasium
import numpy as np
import pytest
from conftest import thrown

import squirrel
import squirrel.envs

STEPS = 100
WAYS: list[Callable] = [copy.copy, copy.deepcopy] + [
    lambda thing, protocol=protocol: pickle.loads(pickle.dumps(thing, protocol))
    for protocol in range(2, pickle.HIGHEST_PROTOCOL + 1)
]


def gusty(vehicle: squirrel.Vehicle) -> squirrel.Vehicle:
    """Wings, battery, gusts, a load, and commands that are late."""
    return vehicle.edited(
        {
            "effects.gust.sigma_m_s": 0.8,
            "effects.payload_swing.mass_kg": 0.05,
            "effects.payload_swing.length_m": 0.5,
            "effects.actuation_latency.latency_s": 0.02,
        }
    )


@pytest.mark.parametrize("way", WAYS)
def test_what_never_changes(way: Callable, vehicle: squirrel.Vehicle, flights: dict[str, squirrel.FlightLog]) -> None:
    heavy = vehicle.edited({"mass.mass_kg": 0.6})
    again = way(heavy)
    assert again == heavy and hash(again) == hash(heavy) and again != vehicle
    assert (again.text, again.name, again.keys()) == (heavy.text, heavy.name, heavy.keys())
    log = flights["f1"]
    kept = way(log)
    assert kept.metadata == log.metadata and kept.keys() == log.keys() and kept.metrics == log.metrics
    for channel in log:
        np.testing.assert_array_equal(kept[channel], log[channel])
    policy = random_policy()
    seen = np.random.default_rng(1).normal(size=(STEPS, 25)).astype(np.float32)
    assert way(policy) == policy and way(policy).hash == policy.hash
    np.testing.assert_array_equal(way(policy)(seen), policy(seen))


def test_a_vehicle_with_weights_of_its_own_and_its_flights(vehicle: squirrel.Vehicle) -> None:
    again = pickle.loads(pickle.dumps(gusty(vehicle)))
    one, two = (squirrel.simulate(vehicle=v, scenario="hover", arm="twcc_parnn", seed=3) for v in (gusty(vehicle), again))
    for channel in one:
        np.testing.assert_array_equal(one[channel], two[channel])


def test_a_model(flights: dict[str, squirrel.FlightLog]) -> None:
    model = squirrel.nn.train(flights, epochs=2)
    data = squirrel.nn.windows(flights)
    arguments = {name: data[name] for name in ("rows", "velocity_body_m_s", "q_ned_from_body_wxyz")}
    for way in WAYS:
        again = way(model)
        assert again.card == model.card
        np.testing.assert_array_equal(again.history, model.history)
        np.testing.assert_array_equal(
            squirrel.nn.forward(again, **arguments), squirrel.nn.forward(model, **arguments)
        )


def random_policy() -> squirrel.Policy:
    rng = np.random.default_rng(0)
    shapes = {"first": (32, 25), "second": (32, 32), "output": (4, 32)}
    numbers = lambda shape: (0.2 * rng.normal(size=shape)).astype(np.float32)  # noqa: E731
    return squirrel.Policy(**{name: (numbers(shape), numbers(shape[0])) for name, shape in shapes.items()})


def batch_of(vehicle: squirrel.Vehicle, dtype: str) -> squirrel.Batch:
    """One that has flown a while, with a vehicle that was replaced."""
    state, _ = thrown(20, dtype)
    state[:, 2] -= 30.0
    vehicles = [vehicle, gusty(vehicle)] * 10
    batch = squirrel.Batch(vehicles=vehicles, dtype=dtype, scheme="rk4", threads=1)
    batch.reset(state)
    batch.set_air(np.ones((20, 3)), gust_sigma_m_s=np.full(20, 0.9), seed=range(20))
    batch.set_charge(np.linspace(0.1, 1.0, 20).astype(dtype))
    batch.replace(3, vehicle.edited({"mass.mass_kg": 0.6}))
    fly(batch, 0, 37)
    return batch


def fly(batch: squirrel.Batch, first: int, steps: int) -> list[np.ndarray]:
    """Everything that can be seen of each step."""
    seen = []
    for k in range(first, first + steps):
        rng = np.random.default_rng(k)
        batch.command(rng.uniform(0.4, 0.8, (len(batch), 4)).astype(batch.dtype))
        batch.command_wings(rng.uniform(0.0, 1.0, (len(batch), 2)).astype(batch.dtype))
        batch.step(3)
        seen += [batch.states(), batch.deployments(), batch.battery()]
    return seen


def same(one: list[np.ndarray], two: list[np.ndarray]) -> None:
    for a, b in zip(one, two, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_a_batch_flies_on(vehicle: squirrel.Vehicle, dtype: str) -> None:
    batch = batch_of(vehicle, dtype)
    state = batch.state()
    copies = [way(batch) for way in WAYS]
    wanted = fly(batch, 37, STEPS)
    for again in copies:
        assert (repr(again), again.dtype, again.threads) == (repr(batch), batch.dtype, batch.threads)
        assert again.state() == state
        same(fly(again, 37, STEPS), wanted)
    # Back to where it was, and once more.
    batch.restore(state)
    assert batch.state() == state
    same(fly(batch, 37, STEPS), wanted)
    # A branch that does something else leaves the first alone.
    batch.restore(state)
    other = copy.deepcopy(batch)
    fly(other, 1000, 10)
    same(fly(batch, 37, STEPS), wanted)


def test_a_batch_of_the_base_model_flies_on(vehicle: squirrel.Vehicle) -> None:
    octo = squirrel.Vehicle.new(frame="octo-x", mass_kg=3.0, propeller_inch=10.0)
    for one, rotors in ((vehicle, 4), (octo, 8)):
        batch = squirrel.Batch(vehicles=[one] * 40, whole=False, scheme="euler", dt_s=0.002)
        batch.set_wind(np.ones((40, 3), np.float32))
        command = np.full((40, rotors), one.hover_command, np.float32)
        batch.fly(command, 20)
        again = pickle.loads(pickle.dumps(batch))
        for _ in range(STEPS):
            np.testing.assert_array_equal(again.fly(command, 1), batch.fly(command, 1))


def test_a_state_of_something_else_is_refused(vehicle: squirrel.Vehicle) -> None:
    batch = squirrel.Batch(vehicles=[vehicle] * 3)
    state = batch.state()
    others = [
        squirrel.Batch(vehicles=[vehicle] * 2),
        squirrel.Batch(vehicles=[vehicle] * 3, dtype="float64"),
        squirrel.Batch(vehicles=[vehicle] * 3, dt_s=0.002),
        squirrel.Batch(vehicles=[vehicle] * 3, whole=False),
    ]
    for other in others:
        with pytest.raises(ValueError, match="state: of another batch"):
            other.restore(state)
    for wrong in (b"", state[:-1], state + b"\0", b"\0" * len(state)):
        with pytest.raises(ValueError, match="state: "):
            batch.restore(wrong)
    assert batch.state() == state
    with pytest.raises(TypeError) as error:
        batch.restore("state")  # type: ignore[arg-type]
    assert "state" in "".join(error.value.__notes__)


@pytest.mark.parametrize("way", WAYS)
def test_flight_code_flies_on(way: Callable, vehicle: squirrel.Vehicle) -> None:
    for arm in ("twcc_flat", "twcc_parnn", "twcc_plus", "pc"):
        stack = squirrel.Stack(vehicle, arm=arm, scenario="hover", count=3)
        frames(stack, 0, 60)
        again = way(stack)
        for one, two in zip(frames(again, 60, STEPS), frames(stack, 60, STEPS), strict=True):
            same(list(one.values()), list(two.values()))


def frames(stack: squirrel.Stack, first: int, steps: int) -> list[dict[str, np.ndarray]]:
    out = []
    for k in range(first, first + steps):
        rng = np.random.default_rng(k)
        q = np.array([1.0, 0.0, 0.0, 0.0]) + 0.05 * rng.normal(size=(3, 4))
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        fix = {} if k % 20 else {name: rng.normal(size=(3, 3)).astype(np.float32) for name in ("position_ned_m", "velocity_ned_m_s")}
        out.append(
            stack.step(
                time_us=k * 3333,
                omega_body_rad_s=rng.normal(size=(3, 3)).astype(np.float32),
                specific_force_body_m_s2=(rng.normal(size=(3, 3)) - [0.0, 0.0, 9.8]).astype(np.float32),
                q_ned_from_body_wxyz=q.astype(np.float32),
                altitude_m=rng.normal(size=3).astype(np.float32) if k % 7 == 0 else None,
                **fix,
            )
        )
    return out


@pytest.mark.parametrize("way", WAYS)
def test_laws_fly_on(way: Callable, vehicle: squirrel.Vehicle) -> None:
    rng = np.random.default_rng(0)
    q = np.tile(np.float32([1.0, 0.0, 0.0, 0.0]), (2, 1))
    three = [rng.normal(size=(2, 3)).astype(np.float32) for _ in range(STEPS + 20)]
    attitude, outer = squirrel.control.Backstepping(vehicle, count=2), squirrel.control.Twcc(vehicle, arm="twcc_parnn", count=2)

    def inner(law: squirrel.control.Backstepping, k: int) -> dict[str, np.ndarray]:
        return law.step(q_ned_from_body_wxyz=q, omega_body_rad_s=three[k], angle_rad=0.1 * three[k - 1], dt_s=0.003)

    def tick(law: squirrel.control.Twcc, k: int) -> dict[str, np.ndarray]:
        return law.step(
            position_ned_m=three[k], velocity_ned_m_s=three[k - 1], q_ned_from_body_wxyz=q, reference_position_ned_m=three[k - 2]
        )

    for law, step in ((attitude, inner), (outer, tick)):
        for k in range(20):
            step(law, k)  # type: ignore[arg-type]
        again = way(law)
        for k in range(20, STEPS + 20):
            one, two = step(again, k), step(law, k)  # type: ignore[arg-type]
            same(list(one.values()), list(two.values()))


@pytest.mark.parametrize("action", ["motor", "body_rate", "attitude_wing"])
@pytest.mark.parametrize("sensors", [False, True])
def test_environments_fly_on(action: str, sensors: bool, vehicle: squirrel.Vehicle) -> None:
    calm = vehicle.edited({"effects.gust.sigma_m_s": 0.8})
    envs = squirrel.envs.SquirrelVectorEnv(
        task="avoid", num_envs=150, vehicles=[vehicle, calm], action=action, sensors=sensors, episode_s=1.5, threads=1
    )
    envs.reset(seed=5)
    act(envs, 0, 70)
    envs.reset(options={"reset_mask": np.arange(150) % 7 == 0})
    act(envs, 70, 9)
    copies = [copy.deepcopy(envs), pickle.loads(pickle.dumps(envs))]
    # A copy of a copy is no different.
    copies.append(pickle.loads(pickle.dumps(copies[1])))
    wanted = act(envs, 79, STEPS)
    assert any(ended.any() for ended in wanted[2::4]), "some episodes end, and others begin"
    for again in copies:
        same(act(again, 79, STEPS), wanted)


def act(envs: squirrel.envs.SquirrelVectorEnv, first: int, steps: int) -> list[np.ndarray]:
    seen: list[np.ndarray] = []
    for k in range(first, first + steps):
        actions = np.random.default_rng(k).uniform(-0.3, 0.3, envs.action_space.shape).astype(np.float32)
        seen += envs.step(actions)[:4]
    return seen


def test_a_single_environment_and_its_wrappers_fly_on(vehicle: squirrel.Vehicle) -> None:
    env = gymnasium.make("SquirrelTrack-v0", vehicles=[vehicle], episode_s=0.8)
    env.reset(seed=3)
    actions = np.random.default_rng(0).uniform(-0.3, 0.3, (60, 4)).astype(np.float32)
    for action in actions[:20]:
        env.step(action)
    for again in (copy.deepcopy(env), pickle.loads(pickle.dumps(env))):
        branch = copy.deepcopy(env)
        for action in actions[20:]:
            one, two = again.step(action), branch.step(action)
            np.testing.assert_array_equal(one[0], two[0])
            assert one[1:4] == two[1:4]
            if one[2] or one[3]:
                # What comes next is drawn from the same stream.
                np.testing.assert_array_equal(again.reset()[0], branch.reset()[0])


def test_make_keeps_the_specification(vehicle: squirrel.Vehicle) -> None:
    # Warnings are errors here.
    env = gymnasium.make("SquirrelAvoid-v0", vehicles=[vehicle], action="motor")
    assert env.spec is not None and env.spec.kwargs["vehicles"] == [vehicle]
    twin = gymnasium.make(env.spec)
    np.testing.assert_array_equal(twin.reset(seed=1)[0], env.reset(seed=1)[0])
    assert pickle.loads(pickle.dumps(env.spec)).kwargs["vehicles"] == [vehicle]


def make_env() -> gymnasium.Env:
    import squirrel.envs

    return squirrel.envs.SquirrelEnv(task="avoid")


def test_environments_in_processes_that_are_spawned() -> None:
    one = gymnasium.vector.AsyncVectorEnv([make_env] * 2, context="spawn")
    two = gymnasium.vector.SyncVectorEnv([make_env] * 2)
    try:
        np.testing.assert_array_equal(one.reset(seed=1)[0], two.reset(seed=1)[0])
        for k in range(5):
            actions = np.random.default_rng(k).uniform(-0.3, 0.3, (2, 4)).astype(np.float32)
            for a, b in zip(one.step(actions)[:4], two.step(actions)[:4], strict=True):
                np.testing.assert_array_equal(a, b)
    finally:
        one.close()


def flown_on(batch: squirrel.Batch, vehicle: squirrel.Vehicle) -> tuple[squirrel.Batch, squirrel.FlightLog]:
    fly(batch, 37, 20)
    return batch, squirrel.simulate(vehicle=vehicle, scenario="hover", seed=2)


def test_objects_go_to_another_process_and_back(vehicle: squirrel.Vehicle) -> None:
    batch = batch_of(vehicle, "float32")
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        there, log = pool.submit(flown_on, batch, vehicle).result()
    here, wanted = flown_on(batch, vehicle)
    assert there.state() == here.state() and log.metrics == wanted.metrics
    same(fly(there, 57, 20), fly(here, 57, 20))
    for channel in wanted:
        np.testing.assert_array_equal(log[channel], wanted[channel])


RESULTS = [
    class_
    for module in (squirrel.gap, squirrel.plan)
    for class_ in (getattr(module, name) for name in module.__all__)
    if dataclasses.is_dataclass(class_)
]


@pytest.mark.parametrize("class_", RESULTS)
def test_what_calls_return(class_: type, vehicle: squirrel.Vehicle) -> None:
    # Nobody checks what a result holds.
    held = {field.name: (k, vehicle, [float(k)]) for k, field in enumerate(dataclasses.fields(class_))}
    thing = class_(**held)
    for way in WAYS:
        again = way(thing)
        assert type(again) is class_ and vars(again) == held


def test_no_public_class_is_left_out() -> None:
    """Of those above; who adds a class adds its test."""
    modules = [squirrel, squirrel.control, squirrel.dynamics, squirrel.envs, squirrel.gap, squirrel.nn, squirrel.plan, squirrel.policy]
    public = {
        thing.__name__
        for module in modules
        for thing in (getattr(module, name) for name in module.__all__)
        if inspect.isclass(thing) and thing not in RESULTS
    }
    tested = {"Vehicle", "FlightLog", "Policy", "Model", "Batch", "Stack", "Backstepping", "Twcc", "Tasks", "SquirrelEnv", "SquirrelVectorEnv"}
    assert public == tested and len(RESULTS) > 10


@pytest.mark.parametrize("class_", ["Vehicle", "FlightLog", "Policy", "Model", "Batch", "Stack", "Backstepping", "Twcc", "Tasks", "Other"])
def test_a_damaged_pickle_is_a_line(class_: str) -> None:
    for state in ((), (b"",), (b"\1\2\3",), (1, 2, 3), ("a", "b", "c")):
        with pytest.raises(ValueError):
            squirrel._squirrel.again(class_, state)
