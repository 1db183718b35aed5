"""What a flight amounts to, and the names that say how it is flown."""

from __future__ import annotations

from typing import Literal, TypeAlias, TypedDict

__all__ = ["Action", "Arm", "Commands", "Estimator", "Integrator", "Metrics", "Scenario", "Scheme", "Task"]

Arm: TypeAlias = Literal[
    "pc",
    "pc_wings_open",
    "wiic_no_wings",
    "phantom",
    "phantom_parnn",
    "twcc_flat",
    "twcc_parnn",
    "twcc_oracle",
    "twcc_flat_ff",
    "twcc_parnn_ff",
    "twcc_plus",
    "pc_plus",
    "indi",
    "plan_wings",
    "plan_no_wings",
]
"""Who flies."""

Scenario: TypeAlias = Literal[
    "hover", "avoid", "steer", "track", "forest", "excite_calm", "excite_normal", "excite_rich", "random_spread"
]
"""Scenarios that are built in; others are files."""

Estimator: TypeAlias = Literal["eskf", "mekf", "mahony", "rkf_mtf", "rkf_stf", "kalman", "external", "oracle"]
"""Who tells the flight code attitude, velocity and position."""

Integrator: TypeAlias = Literal["rk4", "rapier"]
"""How the plant of a flight moves."""

Commands: TypeAlias = Literal["attitude", "rotors"]
"""What a controller in Python returns."""

Scheme: TypeAlias = Literal["rk4", "euler"]
"""How batches step."""

Task: TypeAlias = Literal["avoid", "track"]
"""What environments ask for."""

Action: TypeAlias = Literal["motor", "body_rate", "attitude_wing"]
"""What actions of environments mean."""


class Metrics(TypedDict):
    """Figures of one flight, over the measured window; None where there is no such figure.

    Over the whole flight where the window's encounter never came, ``encounters`` being 0.

    Attributes
    ----------
    rmse_m, rmse_horizontal_m : float or None
        Root mean square of the distance to the reference, with and without height.
    rmse_measured_m : float or None
        The same by satellite fix and barometer, as they arrive.
    height_lost_m, height_gained_m : float or None
        Largest sink below and climb above the reference height.
    height_lost_unflagged_m : float or None
        What of the sink was lost before the first of `flags`.
    wings_open_s, wiic_s : float
        Time with wings more than half spread, and in which WIIC flew.
    clearance_m : float or None
        Smallest distance to the surface of an obstacle; negative inside.
    path_m : float or None
        Horizontal way of the whole flight until it touched something.
    displacement_m : list of float
        Where it was then from the start, north and east.
    voltage_mean_v : float or None
        Of the battery.
    window_s : float
        Length of the measured window.
    encounters : int
        Obstacles that were avoided, or tried to.
    contact_s, contact_speed_m_s : float or None
        Time and speed of the first contact with ground or an obstacle.
    not_finite : bool
        A command to a rotor or wing was not finite at any time.
    tilt_max_rad : float or None
        Largest tilt of the whole flight.
    flags : list of str
        What the flight code found not to be as it should, and why its failsafe acted.
    """

    rmse_m: float | None
    rmse_horizontal_m: float | None
    rmse_measured_m: float | None
    height_lost_m: float | None
    height_lost_unflagged_m: float | None
    height_gained_m: float | None
    wings_open_s: float
    wiic_s: float
    clearance_m: float | None
    path_m: float | None
    displacement_m: list[float | None]
    voltage_mean_v: float | None
    window_s: float
    encounters: int
    contact_s: float | None
    contact_speed_m_s: float | None
    not_finite: bool
    tilt_max_rad: float | None
    flags: list[str]
