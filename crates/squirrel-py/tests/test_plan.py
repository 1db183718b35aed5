"""What wings make reachable."""

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
