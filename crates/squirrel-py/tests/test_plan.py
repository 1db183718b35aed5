"""What wings make reachable, and trajectories."""

import numpy as np
import pytest

import squirrel


def test_reach_is_that_of_the_command_line(vehicle: squirrel.Vehicle) -> None:
    reach = squirrel.plan.reach(vehicle, velocity_ned_m_s=np.array([7.0, 0.0, 0.0]), thrust_to_weight=1.1)
    assert reach.upward_m_s2.folded == pytest.approx(0.1 * 9.80665)
    assert reach.upward_m_s2.with_wings == pytest.approx(1.742, abs=1e-3)
    assert reach.braking_level_m_s2 is not None and reach.braking_level_m_s2.ratio == pytest.approx(1.26, abs=5e-3)
    assert reach.hull_volume_m3_s6.ratio == pytest.approx(1.45, rel=0.01) and reach.support is None
    down = squirrel.plan.reach(vehicle, velocity_ned_m_s=(0.0, 0.0, 7.0), tilt="cone")
    assert down.braking_height_free_m_s2 is None and down.thrust_to_weight == pytest.approx(4.02, abs=0.01)


@pytest.mark.parametrize("wing", ["flat", "membrane", "parnn"])
def test_a_support_function_bounds_accelerations(vehicle: squirrel.Vehicle, wing: str) -> None:
    directions = np.random.default_rng(1).normal(size=(40, 3))
    velocity = (5.0, 2.0, 3.0)
    reach = squirrel.plan.reach(
        vehicle,
        velocity_ned_m_s=velocity,
        thrust_to_weight=1.3,
        wing=wing,  # type: ignore[arg-type]
        directions=directions,
    )
    found = reach.support
    assert found is not None and found.spread.any() and not found.spread.all()
    along = np.einsum("ni,ni->n", found.acceleration_ned_m_s2, directions)
    assert np.allclose(along, found.value_m_s2, atol=1e-6) and np.all(found.value_m_s2 >= found.folded_m_s2)
    assert np.all(directions @ found.acceleration_ned_m_s2.T <= found.upper_m_s2[:, None] + 1e-6)
    assert np.allclose(np.linalg.norm(found.normal_ned, axis=1), 1.0)


def test_a_bad_argument_is_named(vehicle: squirrel.Vehicle) -> None:
    ahead = (7.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="wing = paper: no such model; known are flat"):
        squirrel.plan.reach(vehicle, velocity_ned_m_s=ahead, wing="paper")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="tilt = ball"):
        squirrel.plan.reach(vehicle, velocity_ned_m_s=ahead, tilt="ball")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="thrust_to_weight = 0"):
        squirrel.plan.reach(vehicle, velocity_ned_m_s=ahead, thrust_to_weight=0.0)
    with pytest.raises(ValueError, match="velocity_ned_m_s: expected 3 numbers, got 2"):
        squirrel.plan.reach(vehicle, velocity_ned_m_s=(1.0, 2.0))
    with pytest.raises(ValueError, match="velocity_ned_m_s = NaN: must be finite"):
        squirrel.plan.reach(vehicle, velocity_ned_m_s=(float("nan"), 0.0, 0.0))
    with pytest.raises(ValueError, match="directions: expected a float64 array"):
        squirrel.plan.reach(vehicle, velocity_ned_m_s=ahead, directions=np.zeros((2, 2)))


def straight(speed_m_s: float) -> np.ndarray:
    return np.outer(np.arange(21) * 0.1, [speed_m_s, 0.0, 0.0])


def test_a_trajectory_passes_a_trunk_within_the_limits(vehicle: squirrel.Vehicle) -> None:
    trunk = np.array([[9.0, 0.2, 1.0]])
    plan = squirrel.plan.trajectory(
        vehicle, reference_position_ned_m=straight(7.0), obstacles_m=trunk, thrust_to_weight=1.5
    )
    assert plan.status == "solved" and plan.violation_m < 0.01 and plan.iterations > 1
    assert np.linalg.norm(plan.position_ned_m[:, :2] - trunk[0, :2], axis=1).min() > 0.98
    thrust = np.linalg.norm(plan.thrust_ned_n, axis=1)
    assert thrust.max() <= 1.5 * 0.95 * 0.548 * 9.80665 + 1e-3 and (plan.thrust_ned_n[:, 2] < 0.0).all()
    # Linear accelerations between nodes.
    a, v = plan.acceleration_ned_m_s2, plan.velocity_ned_m_s
    assert np.allclose(np.diff(v, axis=0), 0.05 * (a[1:] + a[:-1]), atol=1e-9)


def test_wings_open_to_brake_and_none_plans_without(vehicle: squirrel.Vehicle) -> None:
    stop = np.zeros((21, 3))
    ahead = (7.0, 0.0, 0.0)

    def brake(wing: str | None) -> squirrel.plan.Trajectory:
        return squirrel.plan.trajectory(
            vehicle,
            reference_position_ned_m=stop,
            velocity_ned_m_s=ahead,
            wing=wing,  # type: ignore[arg-type]
            thrust_to_weight=1.2,
        )

    with_wings, without = brake("flat"), brake(None)
    assert with_wings.deployment.max() > 0.9 and without.deployment.max() == 0.0
    assert with_wings.cost < without.cost


def test_a_wind_from_behind_keeps_wings_folded(vehicle: squirrel.Vehicle) -> None:
    def spread(north_m_s: float) -> float:
        plan = squirrel.plan.trajectory(
            vehicle,
            reference_position_ned_m=np.zeros((21, 3)),
            velocity_ned_m_s=(7.0, 0.0, 0.0),
            thrust_to_weight=1.2,
            wind_ned_m_s=(north_m_s, 0.0, 0.0),
        )
        return float(plan.deployment.sum())

    # As fast as the air: nothing for the wings to push against.
    assert spread(-3.0) > 5.0 and spread(7.0) < 1.0


def test_an_impossible_task_has_a_plan_all_the_same(vehicle: squirrel.Vehicle) -> None:
    plan = squirrel.plan.trajectory(
        vehicle, reference_position_ned_m=straight(8.0), obstacles_m=np.array([[1.5, 0.1, 1.0]])
    )
    assert plan.status == "infeasible" and plan.violation_m > 0.1 and np.isfinite(plan.position_ned_m).all()


def test_a_bad_task_is_named(vehicle: squirrel.Vehicle) -> None:
    ahead = straight(5.0)
    broken = ahead.copy()
    broken[3, 1] = np.nan
    for match, arguments in [
        (r"reference_position_ned_m\[3\] = NaN", {"reference_position_ned_m": broken, "reference_velocity_ned_m_s": ahead}),
        ("velocity_ned_m_s = NaN", {"velocity_ned_m_s": (np.nan, 0.0, 0.0)}),
        (r"obstacles_m\[0\].radius_m = 0", {"obstacles_m": np.zeros((1, 3))}),
        ("obstacles_m: expected a float64 array", {"obstacles_m": np.zeros((1, 2))}),
        ("step_s = 0", {"step_s": 0.0}),
        ("deployment = 2", {"deployment": 2.0}),
        ("thrust_max_n", {"thrust_to_weight": 0.9}),
        ("wing = paper", {"wing": "paper"}),
        ("position_ned_m: expected 3 numbers, got 2", {"position_ned_m": (1.0, 2.0)}),
        ("wind_ned_m_s = NaN", {"wind_ned_m_s": (0.0, np.nan, 0.0)}),
        ("n > 2", {"reference_position_ned_m": np.zeros(3)}),
    ]:
        with pytest.raises(ValueError, match=match):
            squirrel.plan.trajectory(vehicle, **({"reference_position_ned_m": ahead} | arguments))  # type: ignore[arg-type]


def test_a_planner_flies_as_an_arm(vehicle: squirrel.Vehicle) -> None:
    log = squirrel.simulate(vehicle=vehicle, scenario="hover", arm="plan_wings")
    assert log.metadata["offboard"].startswith("plans") and np.abs(log["truth.position_ned_m"][-1] - [0, 0, -30]).max() < 0.5
