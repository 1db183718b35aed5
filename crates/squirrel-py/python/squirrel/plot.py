"""What people look at: track, tilt, thrust, residuals, predicted force. Needs matplotlib (``squirrel-flight[plot]``).

Every function draws on axes and returns them; it makes new ones if none are given.
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Circle

from squirrel._squirrel import forward, windows

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from squirrel._squirrel import FlightLog, Model, Vehicle
    from squirrel.gap import Finding

__all__ = ["force_prediction", "residuals", "thrust", "tilt", "track"]


def track(log: FlightLog, *, ax: Axes | None = None) -> Axes:
    """Draw the track from above, beside the reference, with the obstacles.

    Parameters
    ----------
    log : FlightLog
        With ``truth.position_ned_m`` or, if it lacks that, ``gnss.position_ned_m``.
    ax : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    ax = ax or plt.figure().add_subplot()
    flown = log["truth.position_ned_m"] if "truth.position_ned_m" in log else log["gnss.position_ned_m"]
    if "reference.position_ned_m" in log:
        wanted = log["reference.position_ned_m"]
        ax.plot(wanted[:, 1], wanted[:, 0], "--", label="reference")
    ax.plot(flown[:, 1], flown[:, 0], label="flown")
    for north_m, east_m, radius_m in json.loads(log.metadata.get("obstacles_json", "[]")):
        ax.add_patch(Circle((east_m, north_m), radius_m, alpha=0.3))
    ax.set(xlabel="east m", ylabel="north m", aspect="equal")
    ax.legend()
    return ax


def tilt(log: FlightLog, *, ax: Axes | None = None) -> Axes:
    """Draw the angle between body and world down over time.

    Parameters
    ----------
    log : FlightLog
        With ``attitude.q_ned_from_body_wxyz``.
    ax : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    ax = ax or plt.figure().add_subplot()
    q = log["attitude.q_ned_from_body_wxyz"]
    cosine = 1.0 - 2.0 * (q[:, 1] ** 2 + q[:, 2] ** 2)
    ax.plot(log.time_s("attitude"), np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))), label="tilt")
    if "tilt_max_rad" in log.metadata:
        # The limit holds for roll and for pitch; both at once tilt further.
        one_axis = math.cos(float(log.metadata["tilt_max_rad"]))
        ax.axhline(math.degrees(math.acos(one_axis**2)), linestyle="--", label="limit")
    ax.set(xlabel="time s", ylabel="tilt deg")
    ax.legend()
    return ax


def thrust(log: FlightLog, *, ax: Axes | None = None) -> Axes:
    """Draw collective thrust, demanded and given by the mixer, over time.

    Parameters
    ----------
    log : FlightLog
        With ``control.inner``.
    ax : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    ax = ax or plt.figure().add_subplot()
    time_s = log.time_s("control.inner")
    ax.plot(time_s, log["control.inner.thrust_demand_n"], "--", label="demand")
    ax.plot(time_s, log["control.inner.thrust_n"], label="mixer")
    if "thrust_max_n" in log.metadata:
        ax.axhline(float(log.metadata["thrust_max_n"]), linestyle="--", label="limit")
    ax.set(xlabel="time s", ylabel="thrust N")
    ax.legend()
    return ax


def residuals(finding: Finding, *, ax: Axes | None = None) -> Axes:
    """Draw the residual force of each flight as bars.

    Parameters
    ----------
    finding : squirrel.gap.Finding
    ax : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    ax = ax or plt.figure().add_subplot()
    flights = finding.residual.per_flight
    for k, axis in enumerate("xyz"):
        heights = [of.force_body_rms_n[k] for of in flights.values()]
        ax.bar([i + 0.27 * (k - 1) for i in range(len(flights))], heights, width=0.25, label=axis)
    ax.set_xticks(range(len(flights)), list(flights))
    ax.set(ylabel="residual force, body, N rms")
    ax.legend(title="axis")
    return ax


def force_prediction(model: Model, log: FlightLog, *, vehicle: Vehicle | None = None, ax: Axes | None = None) -> Axes:
    """Draw what a model says of the wing force along the body's normal, over what the flight says.

    Parameters
    ----------
    model : squirrel.nn.Model
    log : FlightLog
        With spread wings.
    vehicle : Vehicle, optional
        That flew; the paper's squirrel if left out.
    ax : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    ax = ax or plt.figure().add_subplot()
    data = windows({"flight": log}, vehicle=vehicle)
    predicted = forward(
        model,
        rows=data["rows"],
        velocity_body_m_s=data["velocity_body_m_s"],
        q_ned_from_body_wxyz=data["q_ned_from_body_wxyz"],
    )
    measured = data["label_body_n"][:, 2]
    ends = [float(min(measured.min(), predicted[:, 2].min())), float(max(measured.max(), predicted[:, 2].max()))]
    ax.plot(measured, predicted[:, 2], ".", label=model.card["model"])
    ax.plot(ends, ends, "--", label="measured")
    ax.set(xlabel="measured force along the normal N", ylabel="predicted N", aspect="equal")
    ax.legend()
    return ax
