#!/usr/bin/env python3
"""Planning without wings beside TinyMPC 0.0.8 (ADMM over a horizon, C++): time of a solve, and what flies by it, in one run.

    python3 compare.py [--states 200] [--flights 20] [--thrust-to-weight 2.0] [--only tinympc]

Needs requirements.txt and the wheel of squirrel (`cargo xtask wheel` leaves it in target/wheel/dist; `pip install --no-deps`) in one environment;
TinyMPC is compiled, which takes a minute and a half.

The task is what an avoidance leaves behind: anywhere within 3 m of a straight reference and up to 3 m/s off its 5 to 7 m/s, back to it. Position
and velocity in NED, 20 steps of 0.1 s, a point mass without drag. TinyMPC's own example, a quadrotor of twelve states with
quaternions, is not needed: neither of the two plans attitude here. What each knows of the vehicle:

- TinyMPC, box: |a| within g tan(30 deg) north and east, and between free fall and full thrust as if level down: the linearised problem.
  That tilt and thrust limit each other it does not know.
- TinyMPC, cone: thrust over mass as the input, within 30 deg of the vertical by a second-order cone, its vertical part within the limit.
  Its length, the ratio of thrust to weight, has no bound. The binding of 0.0.8 hands cones of inputs to states and the other way round,
  which is undone here; and its test for the end does not look at cones, so it has 50 iterations, after which inputs are up to 0.04 m/s^2 outside.
- Obstacles TinyMPC has none in either, only half-spaces that are the same over the whole horizon.
- squirrel: thrust below the limit in length, roll and pitch of 30 deg each, obstacles (none here). It may use wings; here it must not. Thrust is linear
  between nodes, may not change faster than the attitude loop and the rotors of the vehicle do, and is held for the first step, because
  what is asked for takes so long to come. TinyMPC's inputs are constant over a step and may jump.

What is asked for comes a step late for all. What the rotors push meanwhile is known: squirrel plans from the state now, TinyMPC
from where that push leads in a step, so that being late costs neither anything but reaction. TinyMPC's first input is asked for, and of
squirrel's plan the thrust at which its second step ends; the mean over that step never gets there, because each plan begins at what was asked for last.

States and references change at every call, so that no call begins at the answer of the one before it. TinyMPC prints a line a solve into
nowhere; that is in its time. Its penalty `rho` is part of its cost at the end of the horizon, too, so it is not only a matter of speed:
in the box, of 0.1 to 10, 1 is the fastest and 0.1 tracks best where nothing limits it. Then each flies twice, asked ten times a second for 4 s, from the first
states, hovering's thrust before: as a double integrator that takes any acceleration, and as a point mass whose thrust is cut to what the
vehicle can do: roll and pitch of 30 deg each, and the limit. Both take steps of thrust, which no vehicle does; that squirrel plans without them
costs it here, and gains nothing.
"""

import argparse
import contextlib
import os
import statistics
import time
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# From position, velocity, the acceleration that acts for a step more, and the reference's positions (steps + 2, 3), to the acceleration
# of the step after that, NED.
Planner = Callable[[Array, Array, Array, Array], Array]

GRAVITY = 9.80665
DOWN = np.array([0.0, 0.0, GRAVITY])
SLOPE = np.tan(np.radians(30.0))
STEP_S = 0.1
STEPS = 20
FLIGHT_STEPS = 40


@contextlib.contextmanager
def silent() -> Iterator[None]:
    """The solver prints by itself, past Python."""
    kept, nowhere = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)


def of_tinympc(thrust_to_weight: float, rho: float, cone: bool) -> Planner:
    import tinympc

    identity = np.eye(3)
    a = np.block([[identity, STEP_S * identity], [np.zeros((3, 3)), identity]])
    of_acceleration = np.vstack([0.5 * STEP_S**2 * identity, STEP_S * identity])
    weight, side = np.diag([10.0, 10.0, 100.0] + [1.0] * 3), GRAVITY * SLOPE
    solver = tinympc.TinyMPC()
    if cone:
        # Thrust over mass, its third component up.
        b, offset = of_acceleration * np.array([1.0, 1.0, -1.0]), (of_acceleration @ DOWN).reshape(6, 1)
        solver.setup(a, b, weight, 0.1 * identity, STEPS, rho=rho, fdyn=offset, max_iter=50, abs_pri_tol=0.0, abs_dua_tol=0.0)
        most = thrust_to_weight * GRAVITY
        solver.set_bound_constraints(None, None, np.array([-most, -most, 0.0]), np.array([most, most, most]))
        none, nothing = np.zeros(0, np.int32), np.zeros(0)
        first, size = np.array([0], np.int32), np.array([3], np.int32)
        # Not by the method of this name: it switches on cones of inputs, and puts them where those of states belong.
        solver._solver.set_cone_constraints(none, none, nothing, first, size, np.array([SLOPE]))
        solver.update_settings(en_input_soc=True, en_state_soc=False)
        solver.set_u_ref(np.array([0.0, 0.0, GRAVITY]))
    else:
        solver.setup(a, of_acceleration, weight, 0.1 * identity, STEPS, rho=rho, max_iter=500, abs_pri_tol=1e-3, abs_dua_tol=1e-3)
        up = (thrust_to_weight - 1.0) * GRAVITY
        solver.set_bound_constraints(None, None, np.array([-side, -side, -up]), np.array([side, side, GRAVITY]))

    def plan(position: Array, velocity: Array, acting: Array, reference: Array) -> Array:
        ahead = reference[1:]
        speed = np.diff(ahead, axis=0) / STEP_S
        solver.set_x0(np.concatenate(moved(position, velocity, acting)))
        solver.set_x_ref(np.vstack([ahead[:STEPS].T, speed.T]))
        # What it returns is a view of its own memory.
        first = np.array(solver.solve()["controls"])
        return DOWN + first * np.array([1.0, 1.0, -1.0]) if cone else first

    return plan


def of_squirrel(thrust_to_weight: float) -> Planner:
    import squirrel
    import squirrel.plan

    mass_kg = 0.548
    vehicle = squirrel.Vehicle.bundled("squirrel").edited({"mass.mass_kg": mass_kg, "drag.area_m2": 0.0})

    def plan(position: Array, velocity: Array, acting: Array, reference: Array) -> Array:
        planned = squirrel.plan.trajectory(
            vehicle,
            reference_position_ned_m=reference[: STEPS + 1],
            position_ned_m=position,
            velocity_ned_m_s=velocity,
            thrust_ned_n=mass_kg * (acting - DOWN),
            wing=None,
            thrust_to_weight=thrust_to_weight,
            step_s=STEP_S,
            reserve=0.0,
        )
        return DOWN + planned.thrust_ned_n[2] / mass_kg

    return plan


def moved(position: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array]:
    """A step on."""
    return position + STEP_S * velocity + 0.5 * STEP_S**2 * acceleration, velocity + STEP_S * acceleration


def any_acceleration(acceleration: Array, _: float) -> Array:
    return acceleration


def within_thrust(acceleration: Array, thrust_to_weight: float) -> Array:
    """What a point mass does that is asked for an acceleration: pitch first, then roll, then the length of the thrust."""
    thrust = DOWN - acceleration
    thrust[2] = max(thrust[2], 0.0)
    thrust[0] = np.clip(thrust[0], -SLOPE * thrust[2], SLOPE * thrust[2])
    across = SLOPE * np.hypot(thrust[0], thrust[2])
    thrust[1] = np.clip(thrust[1], -across, across)
    length = np.linalg.norm(thrust)
    if length > thrust_to_weight * GRAVITY:
        thrust *= thrust_to_weight * GRAVITY / length
    return DOWN - thrust


def states(count: int) -> list[tuple[Array, Array, Array, Array]]:
    """Position, velocity, and where and how fast the reference is."""
    draw = np.random.default_rng(1)
    out = []
    for _ in range(count):
        heading, speed = draw.uniform(-np.pi, np.pi), draw.uniform(5.0, 7.0)
        along = speed * np.array([np.cos(heading), np.sin(heading), 0.0])
        start = np.array([*draw.uniform(-50.0, 50.0, 2), draw.uniform(-20.0, -5.0)])
        off = draw.normal(size=3)
        off *= draw.uniform(0.0, 3.0) / np.linalg.norm(off)
        out.append((start + off, along + draw.uniform(-3.0, 3.0, 3) / np.sqrt(3.0), start, along))
    return out


def line(start: Array, along: Array, from_step: int) -> Array:
    return start + STEP_S * np.arange(from_step, from_step + STEPS + 2)[:, None] * along


def times_us(plan: Planner, cases: list[tuple[Array, Array, Array, Array]]) -> list[float]:
    took = []
    for position, velocity, start, along in cases:
        reference = line(start, along, 0)
        before = time.perf_counter()
        plan(position, velocity, np.zeros(3), reference)
        took.append(1e6 * (time.perf_counter() - before))
    return took


def rmse_m(plan: Planner, cases: list[tuple[Array, Array, Array, Array]], plant: Callable[[Array, float], Array], ratio: float) -> float:
    squares = []
    for position, velocity, start, along in cases:
        acting = np.zeros(3)
        for step in range(FLIGHT_STEPS):
            asked = plan(position, velocity, acting, line(start, along, step))
            position, velocity = moved(position, velocity, acting)
            acting = plant(asked, ratio)
            squares.append(float(np.sum((position - start - STEP_S * (step + 1) * along) ** 2)))
    return float(np.sqrt(np.mean(squares)))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--states", type=int, default=200)
    options.add_argument("--flights", type=int, default=20)
    options.add_argument("--thrust-to-weight", type=float, default=2.0)
    options.add_argument("--only", choices=["tinympc", "squirrel"])
    chosen = options.parse_args()
    ratio = chosen.thrust_to_weight
    planners: dict[str, Callable[[], Planner]] = {
        "TinyMPC, box, rho 1": lambda: of_tinympc(ratio, rho=1.0, cone=False),
        "TinyMPC, box, rho 0.1": lambda: of_tinympc(ratio, rho=0.1, cone=False),
        "TinyMPC, cone, rho 1": lambda: of_tinympc(ratio, rho=1.0, cone=True),
        "squirrel": lambda: of_squirrel(ratio),
    }
    cases = states(chosen.states)
    print("| planner | solve, median, us | 90 %, us | RMSE, double integrator, m | RMSE, point mass with limits, m |")
    print("|---|---|---|---|---|")
    for name, make in planners.items():
        if chosen.only and chosen.only not in name.lower():
            continue
        with silent():
            try:
                plan = make()
            except ImportError as error:
                missing = str(error)
            else:
                missing = ""
                times_us(plan, cases[:10])
                took = times_us(plan, cases)
                flown = [rmse_m(plan, cases[: chosen.flights], plant, ratio) for plant in (any_acceleration, within_thrust)]
        if missing:
            print(f"| {name} | left out: {missing} | | | |")
            continue
        late = statistics.quantiles(took, n=10)[-1]
        print(f"| {name} | {statistics.median(took):.0f} | {late:.0f} | {flown[0]:.3f} | {flown[1]:.3f} |", flush=True)


if __name__ == "__main__":
    main()
