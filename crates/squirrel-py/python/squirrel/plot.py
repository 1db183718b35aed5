"""What people look at: track, tilt, thrust, residuals, predicted force. Needs matplotlib (``squirrel-flight[plot]``).

Every function draws on axes and returns them; it makes new ones if none are given. Several flights are given by name:

>>> import squirrel
>>> from squirrel import plot
>>> flights = {arm: squirrel.simulate(scenario="avoid", arm=arm) for arm in ("pc", "twcc_plus")}
>>> ax = plot.track(flights)
>>> [text.get_text() for text in ax.get_legend().get_texts()]
['reference', 'pc', 'twcc_plus']
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

from squirrel._extra import needed

needed("squirrel.plot", "matplotlib", "plot")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Circle

from squirrel._squirrel import FlightLog, forward, windows

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from squirrel._squirrel import Model, Vehicle
    from squirrel.gap import Finding

__all__ = ["force_prediction", "residuals", "thrust", "tilt", "track"]


def _named(log: FlightLog | Mapping[str, FlightLog], alone: str) -> dict[str, FlightLog]:
    if isinstance(log, FlightLog):
        return {alone: log}
    flights = dict(log)
    if not flights:
        raise ValueError("log: no flights given")
    for name, flight in flights.items():
        if not isinstance(flight, FlightLog):
            raise TypeError(f"log[{name!r}]: expected a FlightLog, got {type(flight).__name__}")
    return flights


def _levels(ax: Axes, levels: list[float]) -> None:
    # Flights of one vehicle have one limit, which is drawn once.
    for i, level in enumerate(sorted(set(levels))):
        ax.axhline(level, linestyle="--", color="grey", label="limit" if i == 0 else None)


def track(log: FlightLog | Mapping[str, FlightLog], *, ax: Axes | None = None) -> Axes:
    """Draw the track from above, beside the reference, with the obstacles.

    Parameters
    ----------
    log : FlightLog or mapping of str to FlightLog
        With ``truth.position_ned_m`` or, if it lacks that, ``gnss.position_ned_m``. Of several flights the names are the labels; a
        reference or an obstacle that they have in common is drawn once.
    ax : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    ax = ax or plt.figure().add_subplot()
    flights = _named(log, "flown")
    wanted: list[NDArray[np.float64]] = []
    for flight in flights.values():
        if "reference.position_ned_m" in flight:
            way = flight["reference.position_ned_m"]
            if not any(np.array_equal(way, other) for other in wanted):
                ax.plot(way[:, 1], way[:, 0], "--", color="grey", label=None if wanted else "reference")
                wanted.append(way)
    trunks = set()
    for name, flight in flights.items():
        flown = flight["truth.position_ned_m"] if "truth.position_ned_m" in flight else flight["gnss.position_ned_m"]
        ax.plot(flown[:, 1], flown[:, 0], label=name)
        trunks |= {tuple(trunk) for trunk in json.loads(flight.metadata.get("obstacles_json", "[]"))}
    for north_m, east_m, radius_m in sorted(trunks):
        ax.add_patch(Circle((east_m, north_m), radius_m, alpha=0.3))
    ax.set(xlabel="east m", ylabel="north m", aspect="equal")
    ax.legend()
    return ax


def tilt(log: FlightLog | Mapping[str, FlightLog], *, ax: Axes | None = None) -> Axes:
    """Draw the angle between body and world down over time.

    Parameters
    ----------
    log : FlightLog or mapping of str to FlightLog
        With ``attitude.q_ned_from_body_wxyz``; of several flights the names are the labels.
    ax : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    ax = ax or plt.figure().add_subplot()
    limits = []
    for name, flight in _named(log, "tilt").items():
        q = flight["attitude.q_ned_from_body_wxyz"]
        cosine = 1.0 - 2.0 * (q[:, 1] ** 2 + q[:, 2] ** 2)
        ax.plot(flight.time_s("attitude"), np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))), label=name)
        if "tilt_max_rad" in flight.metadata:
            # The limit holds for roll and for pitch; both at once tilt further.
            one_axis = math.cos(float(flight.metadata["tilt_max_rad"]))
            limits.append(math.degrees(math.acos(one_axis**2)))
    _levels(ax, limits)
    ax.set(xlabel="time s", ylabel="tilt deg")
    ax.legend()
    return ax


def thrust(log: FlightLog | Mapping[str, FlightLog], *, ax: Axes | None = None) -> Axes:
    """Draw collective thrust, demanded and given by the mixer, over time.

    Parameters
    ----------
    log : FlightLog or mapping of str to FlightLog
        With ``control.inner``; of several flights the names are the labels.
    ax : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    ax = ax or plt.figure().add_subplot()
    limits = []
    several = not isinstance(log, FlightLog)
    for name, flight in _named(log, "mixer").items():
        time_s = flight.time_s("control.inner")
        (given,) = ax.plot(time_s, flight["control.inner.thrust_n"], label=name)
        demand = f"{name}, demand" if several else "demand"
        ax.plot(time_s, flight["control.inner.thrust_demand_n"], "--", color=given.get_color(), alpha=0.6, label=demand)
        if "thrust_max_n" in flight.metadata:
            limits.append(float(flight.metadata["thrust_max_n"]))
    _levels(ax, limits)
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
