"""What wings make reachable: the accelerations that thrust, attitude and wings can make at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from squirrel._squirrel import plan_reach

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from squirrel._squirrel import Vehicle

__all__ = ["Compared", "Reach", "Support", "reach"]


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
    velocity = [float(v) for v in velocity_ned_m_s]
    if len(velocity) != 3:
        raise ValueError(f"velocity_ned_m_s: expected 3 numbers, got {len(velocity)}")
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


def _compared(both: dict[str, Any]) -> Compared:
    # JSON has no NaN.
    return Compared(**{name: float("nan") if x is None else x for name, x in both.items()})


def _optional(both: dict[str, Any] | None) -> Compared | None:
    return None if both is None else _compared(both)
