"""What wings make reachable, and trajectories that use it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from squirrel._squirrel import plan_reach, plan_trajectory

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from squirrel._squirrel import Vehicle

__all__ = ["Compared", "Reach", "Support", "Trajectory", "reach", "trajectory"]


@dataclass(frozen=True, kw_only=True)
class Compared:
    """A number with folded wings and with a choice of folded or spread.

    Attributes
    ----------
    folded, with_wings : float
        NaN where folded wings cannot do it at all.
    ratio : float
        The second over the first; NaN unless that is above zero.
    """

    folded: float
    with_wings: float
    ratio: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Support:
    """The largest acceleration along each of n directions, and how to get it.

    Attributes
    ----------
    folded_m_s2 : ndarray of float64, shape (n,)
        With folded wings.
    value_m_s2 : ndarray of float64, shape (n,)
        With a choice of folded or spread.
    upper_m_s2 : ndarray of float64, shape (n,)
        Nothing goes beyond this.
    thrust_n : ndarray of float64, shape (n,)
    normal_ned : ndarray of float64, shape (n, 3)
        Unit vectors against the thrust, body z.
    acceleration_ned_m_s2 : ndarray of float64, shape (n, 3)
        The whole acceleration.
    spread : ndarray of bool, shape (n,)
        Whether the wings are.
    """

    folded_m_s2: NDArray[np.float64]
    value_m_s2: NDArray[np.float64]
    upper_m_s2: NDArray[np.float64]
    thrust_n: NDArray[np.float64]
    normal_ned: NDArray[np.float64]
    acceleration_ned_m_s2: NDArray[np.float64]
    spread: NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True, eq=False)
class Reach:
    """What wings change at a velocity and a thrust-to-weight ratio.

    Attributes
    ----------
    thrust_to_weight : float
        Limit of thrust over weight.
    upward_m_s2 : Compared
        Largest acceleration upwards; below zero, height cannot be held.
    braking_height_free_m_s2 : Compared or None
        Largest one against the horizontal motion, whatever becomes of the height; None without such a motion.
    braking_level_m_s2 : Compared or None
        The same with no vertical acceleration; None where that cannot be had either way.
    set_volume_m3_s6 : Compared
        Volume of the set of accelerations, (m/s^2)^3.
    hull_volume_m3_s6 : Compared
        Volume of its convex hull.
    support : Support or None
        Along the directions that were asked for.
    """

    thrust_to_weight: float
    upward_m_s2: Compared
    braking_height_free_m_s2: Compared | None
    braking_level_m_s2: Compared | None
    set_volume_m3_s6: Compared
    hull_volume_m3_s6: Compared
    support: Support | None

    def _repr_html_(self) -> str:
        from squirrel import _html

        return _html.reach(self)


def reach(
    vehicle: Vehicle,
    *,
    velocity_ned_m_s: Sequence[float] | NDArray[np.float64],
    thrust_to_weight: float | None = None,
    wing: Literal["flat", "membrane", "parnn"] = "flat",
    tilt: Literal["box", "cone"] = "box",
    yaw_rad: float | None = None,
    directions: NDArray[np.float64] | None = None,
) -> Reach:
    """What spread wings add to the accelerations that a vehicle can reach.

    Parameters
    ----------
    vehicle : Vehicle
        With wings.
    velocity_ned_m_s : sequence of 3 floats
        Relative to the air.
    thrust_to_weight : float, optional
        Limit of thrust over weight; the vehicle's if left out.
    wing : {"flat", "membrane", "parnn"}
        What spread wings do: the paper's flat plate, for which the set is exact, or what the vehicle file has.
    tilt : {"box", "cone"}
        Whether the vehicle's largest tilt bounds roll and pitch each, or the angle to the vertical.
    yaw_rad : float, optional
        Heading of the box; that of the velocity if left out.
    directions : ndarray of float64, shape (n, 3), optional
        Along which the support function is wanted (NED, of any length).

    Returns
    -------
    Reach

    Raises
    ------
    ValueError
        Names the argument, what was expected and what came; the vehicle lacks what the model of the wings needs.

    Examples
    --------
    >>> import squirrel
    >>> vehicle = squirrel.Vehicle.bundled("squirrel")
    >>> reach = squirrel.plan.reach(vehicle, velocity_ned_m_s=(7.0, 0.0, 0.0), thrust_to_weight=1.1)
    >>> round(reach.upward_m_s2.folded, 2), round(reach.upward_m_s2.with_wings, 2)
    (0.98, 1.74)
    """
    velocity = _three("velocity_ned_m_s", velocity_ned_m_s)
    case, support = plan_reach(vehicle, velocity, thrust_to_weight, wing, tilt, yaw_rad, directions)
    return Reach(
        thrust_to_weight=case["thrust_to_weight"],
        upward_m_s2=_compared(case["upward_m_s2"]),
        braking_height_free_m_s2=_optional(case["braking_height_free_m_s2"]),
        braking_level_m_s2=_optional(case["braking_level_m_s2"]),
        set_volume_m3_s6=_compared(case["set_volume_m3_s6"]),
        hull_volume_m3_s6=_compared(case["hull_volume_m3_s6"]),
        support=None if support is None else Support(**support),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Trajectory:
    """A planned motion of n nodes.

    Attributes
    ----------
    status : {"solved", "feasible", "infeasible"}
        Whether every constraint holds and nothing nearby is better; every constraint holds; or the plan violates them least.
    cost : float
    violation_m : float
        How deep it is in an obstacle, at worst; 0 outside.
    overspeed_m_s : float
        How much faster it is than it may be, at worst.
    iterations : int
        Convex problems that were solved.
    time_s : ndarray of float64, shape (n,)
    position_ned_m, velocity_ned_m_s, acceleration_ned_m_s2 : ndarray of float64, shape (n, 3)
    thrust_ned_n : ndarray of float64, shape (n, 3)
        Force of the rotors; it points upwards, so its last column is below zero. Linear between nodes.
    deployment : ndarray of float64, shape (n,)
        Of both wings, 0 folded to 1 spread.
    """

    status: Literal["solved", "feasible", "infeasible"]
    cost: float
    violation_m: float
    overspeed_m_s: float
    iterations: int
    time_s: NDArray[np.float64]
    position_ned_m: NDArray[np.float64]
    velocity_ned_m_s: NDArray[np.float64]
    acceleration_ned_m_s2: NDArray[np.float64]
    thrust_ned_n: NDArray[np.float64]
    deployment: NDArray[np.float64]


def trajectory(
    vehicle: Vehicle,
    *,
    reference_position_ned_m: NDArray[np.float64],
    reference_velocity_ned_m_s: NDArray[np.float64] | None = None,
    position_ned_m: Sequence[float] | NDArray[np.float64] | None = None,
    velocity_ned_m_s: Sequence[float] | NDArray[np.float64] | None = None,
    thrust_ned_n: Sequence[float] | NDArray[np.float64] | None = None,
    deployment: float = 0.0,
    obstacles_m: NDArray[np.float64] | None = None,
    wing: Literal["flat", "membrane", "parnn"] | None = "flat",
    thrust_to_weight: float | None = None,
    step_s: float = 0.1,
    speed_max_m_s: float = float("inf"),
    reserve: float = 0.05,
    wind_ned_m_s: Sequence[float] | NDArray[np.float64] = (0.0, 0.0, 0.0),
) -> Trajectory:
    """A trajectory near a reference and out of obstacles, heading north, by successive convexification.

    Parameters
    ----------
    vehicle : Vehicle
    reference_position_ned_m : ndarray of float64, shape (n, 3)
        Where to be near to at each node, from now on.
    reference_velocity_ned_m_s : ndarray of float64, shape (n, 3), optional
        Differences of the positions if left out.
    position_ned_m, velocity_ned_m_s : sequence of 3 floats, optional
        Where it begins; the reference's first if left out.
    thrust_ned_n : sequence of 3 floats, optional
        Force of the rotors there; that of hovering if left out.
    deployment : float
        Of the wings there, 0 folded to 1 spread.
    obstacles_m : ndarray of float64, shape (k, 3), optional
        North, east and radius of upright cylinders that the vehicle's centre must stay out of: what the vehicle is wide, and what
        is to spare, belongs to the radius.
    wing : {"flat", "membrane", "parnn"} or None
        What is believed of spread wings; None plans without them.
    thrust_to_weight : float, optional
        Limit of thrust over weight; the vehicle's if left out.
    step_s : float
        From node to node, 0.01 to 1.
    speed_max_m_s : float
        Limit of the horizontal speed.
    reserve : float
        Part of thrust and tilt that is left to whoever follows the plan.
    wind_ned_m_s : sequence of 3 floats
        Where the air moves to.

    Returns
    -------
    Trajectory
        Always, also where the constraints cannot all be held.

    Raises
    ------
    ValueError
        Names the argument, what was expected and what came.

    Examples
    --------
    >>> import numpy as np
    >>> import squirrel
    >>> ahead = np.outer(np.arange(21) * 0.1, [6.0, 0.0, 0.0])
    >>> plan = squirrel.plan.trajectory(
    ...     squirrel.Vehicle.bundled("squirrel"),
    ...     reference_position_ned_m=ahead,
    ...     obstacles_m=np.array([[8.0, 0.2, 1.0]]),
    ... )
    >>> plan.status
    'solved'
    """
    positions = _rows("reference_position_ned_m", reference_position_ned_m, least=3)
    if not 0.01 <= _number("step_s", step_s) <= 1.0:
        raise ValueError(f"step_s = {step_s}: must be 0.01 to 1")
    if reference_velocity_ned_m_s is None:
        # What is too large is refused below.
        with np.errstate(all="ignore"):
            reference_velocity_ned_m_s = np.ascontiguousarray(np.gradient(positions, step_s, axis=0))
    reference_velocity_ned_m_s = _rows("reference_velocity_ned_m_s", reference_velocity_ned_m_s)
    if len(reference_velocity_ned_m_s) != len(positions):
        raise ValueError(f"reference_velocity_ned_m_s: {len(reference_velocity_ned_m_s)} rows, must be {len(positions)}")
    if obstacles_m is not None:
        obstacles_m = _rows("obstacles_m", obstacles_m)
    start = positions[0] if position_ned_m is None else position_ned_m
    velocity = reference_velocity_ned_m_s[0] if velocity_ned_m_s is None else velocity_ned_m_s
    facts, nodes = plan_trajectory(
        vehicle,
        reference_position_ned_m,
        reference_velocity_ned_m_s,
        _three("position_ned_m", start),
        _three("velocity_ned_m_s", velocity),
        None if thrust_ned_n is None else _three("thrust_ned_n", thrust_ned_n),
        deployment,
        np.zeros((0, 3)) if obstacles_m is None else obstacles_m,
        wing,
        thrust_to_weight,
        step_s,
        speed_max_m_s,
        reserve,
        _three("wind_ned_m_s", wind_ned_m_s),
    )
    return Trajectory(**facts, **nodes)


def _three(name: str, numbers: Sequence[float] | NDArray[np.float64]) -> list[float]:
    try:
        given = list(numbers)
    except TypeError:
        raise TypeError(f"{name}: expected 3 numbers, got {type(numbers).__name__}") from None
    if len(given) != 3:
        raise ValueError(f"{name}: expected 3 numbers, got {len(given)}")
    return [_number(name, x) for x in given]


def _number(name: str, number: Any) -> float:
    try:
        return float(number)
    except OverflowError:
        raise ValueError(f"{name}: too large for a number of double precision") from None
    except (TypeError, ValueError):
        raise TypeError(f"{name}: expected a number, got {type(number).__name__}") from None


def _rows(name: str, array: Any, least: int = 0) -> NDArray[np.float64]:
    fits = isinstance(array, np.ndarray) and array.dtype == np.float64 and array.ndim == 2 and array.shape[1] == 3
    if not fits or len(array) < least:
        got = f"{array.dtype} of shape {array.shape}" if isinstance(array, np.ndarray) else type(array).__name__
        raise ValueError(f"{name}: expected a float64 array of shape (n, 3){', n > 2' if least > 2 else ''}, got {got}")
    for row, column in np.argwhere(~np.isfinite(array))[:1]:
        value = array[row, column]
        raise ValueError(f"{name}[{row}] = {'NaN' if np.isnan(value) else value}: must be finite")
    return array


def _compared(both: dict[str, Any]) -> Compared:
    # JSON has no NaN.
    return Compared(**{name: float("nan") if x is None else x for name, x in both.items()})


def _optional(both: dict[str, Any] | None) -> Compared | None:
    return None if both is None else _compared(both)
