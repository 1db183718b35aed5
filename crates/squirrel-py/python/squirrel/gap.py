"""What a model lacks: where flights and vehicle file disagree, which effect is missing, and what it is worth."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from squirrel._squirrel import gap_check, gap_diagnose, gap_effects, gap_find

if TYPE_CHECKING:
    import os

    from squirrel._squirrel import FlightLog, Vehicle

__all__ = [
    "Alternative",
    "ClosedLoop",
    "Finding",
    "FlightResidual",
    "Gap",
    "Left",
    "Moved",
    "NamedEffect",
    "Parameter",
    "Place",
    "Residual",
    "RotorHealth",
    "SetAside",
    "Since",
    "Verdict",
    "check",
    "effects",
    "find",
    "name",
    "run",
    "shrink",
]

Vector = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Place:
    """A second of a flight in which a channel disagrees.

    Attributes
    ----------
    flight : str
    t0_s, t1_s : float
        Start and end in the flight.
    channel : str
        Of the residual: ``force_body_z_n``.
    condition : str
        What flew there.
    share : float
        Part of the channel's squared residual over all flights.
    noise : float
        Root mean square of the residual here over what noise alone would leave.
    """

    flight: str
    t0_s: float
    t1_s: float
    channel: str
    condition: str
    share: float
    noise: float


@dataclass(frozen=True, kw_only=True)
class FlightResidual:
    """Root mean square of measured less modelled force (N) and moment (N m) of one flight, body frame.

    Attributes
    ----------
    force_body_rms_n, moment_body_rms_n_m : tuple of float
    samples : int
        That have a residual.
    duration_s : float
        What they amount to.
    """

    force_body_rms_n: Vector
    moment_body_rms_n_m: Vector
    samples: int
    duration_s: float


@dataclass(frozen=True, kw_only=True)
class Residual:
    """Root mean square of measured less modelled force (N) and moment (N m), body frame.

    Attributes
    ----------
    force_body_rms_n, moment_body_rms_n_m : tuple of float
        Over all flights.
    per_flight : dict of str to FlightResidual
    """

    force_body_rms_n: Vector
    moment_body_rms_n_m: Vector
    per_flight: dict[str, FlightResidual]


@dataclass(frozen=True, kw_only=True)
class Finding:
    """Where and by how much flights disagree with a vehicle.

    Attributes
    ----------
    residual : Residual
    where : tuple of Place
        The worst first.
    notes : tuple of str
        What the logs lack, and what was taken instead.
    """

    residual: Residual
    where: tuple[Place, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A number with its 95 % interval; a choice (an axis, a side) has its word at both ends.

    Attributes
    ----------
    value, low, high : float or str
    """

    value: float | str
    low: float | str
    high: float | str


@dataclass(frozen=True, kw_only=True)
class NamedEffect:
    """An effect that the vehicle file lacks.

    Attributes
    ----------
    name : str
        In the catalogue.
    form : str
        Which published form of it.
    evidence_nats : float
        Of the set with it over the set without it.
    parameters : dict of str to Parameter
        By key, as vehicle files write them.
    """

    name: str
    form: str
    evidence_nats: float
    parameters: dict[str, Parameter]


@dataclass(frozen=True, kw_only=True)
class Alternative:
    """Another explanation.

    Attributes
    ----------
    effects : tuple of str
    evidence_nats : float
        Over no effect at all.
    """

    effects: tuple[str, ...]
    evidence_nats: float


@dataclass(frozen=True, kw_only=True)
class Gap:
    """What the explanation is worth on flights that it never saw.

    Attributes
    ----------
    held_out_flights : tuple of str
    before, after : float
        Error over that of the noise floor, without and with the named effects; 1 is nothing but noise.
    best_rival : float or None
        The same with the best other name.
    removed_fraction : float
        Part of what was above the floor that the named effects remove.
    best_rival_removed_fraction : float or None
    """

    held_out_flights: tuple[str, ...]
    before: float
    after: float
    best_rival: float | None
    removed_fraction: float
    best_rival_removed_fraction: float | None


@dataclass(frozen=True, kw_only=True)
class ClosedLoop:
    """A held-out flight of squirrel's own flight code, flown again.

    Attributes
    ----------
    flight : str
    before_ned_m, after_ned_m : tuple of float
        Root mean square of simulated less measured position, without and with the effects.
    """

    flight: str
    before_ned_m: Vector
    after_ned_m: Vector


@dataclass(frozen=True, kw_only=True)
class Moved:
    """A number of the vehicle that moved with the named effects: theirs hold with it.

    Attributes
    ----------
    name : str
        ``mass_error.mass_fraction``, ``weak_rotor[2].thrust_loss_fraction``, ``rotor[0].position_body_m[1]``.
    value : float
        By how much, in the unit of the name.
    sd : float
        Standard deviation that the flights leave it.
    tolerance : float
        What the vehicle file allows it, one standard deviation.
    """

    name: str
    value: float
    sd: float
    tolerance: float


@dataclass(frozen=True, kw_only=True)
class Left:
    """What the names leave of the flights that they were fitted to.

    Attributes
    ----------
    share_removed : float
        Part of the mean square above noise, in units of noise, that the names remove, over all channels.
    share_left : float
        What is left above noise, as part of what was measured about its mean, rms, in the channels that stand out; 0 where
        none does.
    channels : tuple of str
        The channels that stand out, the worst first.
    goes_with : str or None
        What it goes with, where something predicts it.
    """

    share_removed: float
    share_left: float
    channels: tuple[str, ...]
    goes_with: str | None


@dataclass(frozen=True, kw_only=True)
class SetAside:
    """A flight that nothing is said about, because its data contradict themselves.

    Attributes
    ----------
    flight, channel : str
        Names of both.
    words : str
        What is wrong and what to change, in one line.
    """

    flight: str
    channel: str
    words: str


@dataclass(frozen=True, kw_only=True)
class RotorHealth:
    """How one rotor is against good flights of the same machine, whatever has a name.

    Attributes
    ----------
    rotor : int
        Number, from 1, in the order of commands.
    thrust_loss_fraction : Parameter
        Part of its thrust that it lacks, with its 95 % interval if every rotor may be off.
    usual : float
        By how much it differs from one good flight to another, one standard deviation.
    """

    rotor: int
    thrust_loss_fraction: Parameter
    usual: float


@dataclass(frozen=True, kw_only=True)
class Since:
    """What flights are compared with: good ones of the same machine.

    Attributes
    ----------
    flights : tuple of str
        Names of the good flights.
    rotors : tuple of RotorHealth
        In the order of commands; empty where the flights do not show them.
    """

    flights: tuple[str, ...]
    rotors: tuple[RotorHealth, ...]


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """The answer of the workflow.

    Attributes
    ----------
    verdict : str
        Exactly one of the answers.
    effects : tuple of NamedEffect
        What is missing, the most certain first.
    moved : tuple of Moved
        What moved with the effects, the farthest first.
    alternatives : tuple of Alternative
        The best first.
    where : tuple of Place
        Where the flights disagree with the vehicle as it was, the worst first.
    goes_with, fly_next : str or None
        What a leftover goes with; what to fly to know more.
    gap : Gap or None
        On held-out flights.
    leftover : Left or None
        What the names leave; None where nothing was looked for, or only what lasts.
    closed_loop : tuple of ClosedLoop
    model_patch : str or None
        Path of the vehicle file with the effects, where one was written.
    baseline : Since or None
        What the flights were compared with, where that is good flights of the same machine.
    words : str
        All of it in plain words.
    set_aside : tuple of SetAside
        Flights that took no part, of those to fit and of those held out.
    notes : tuple of str
    patched : Vehicle or None
        The vehicle with the effects in it; None where there are none that a file can take, and nothing was fitted.
    """

    verdict: Literal[
        "none",
        "named",
        "named_incomplete",
        "named_form_differs",
        "ambiguous",
        "outside_catalogue",
        "not_identifiable",
        "data_problem",
    ]
    effects: tuple[NamedEffect, ...]
    moved: tuple[Moved, ...]
    alternatives: tuple[Alternative, ...]
    where: tuple[Place, ...]
    goes_with: str | None
    fly_next: str | None
    gap: Gap | None
    leftover: Left | None
    closed_loop: tuple[ClosedLoop, ...]
    model_patch: str | None
    baseline: Since | None
    words: str
    set_aside: tuple[SetAside, ...]
    notes: tuple[str, ...]
    patched: Vehicle | None

    def _repr_html_(self) -> str:
        from squirrel import _html

        return _html.verdict(self)


def effects() -> list[dict[str, Any]]:
    """List the effects that a vehicle file may name, and that this workflow looks for.

    Returns
    -------
    list of dict
        Of each effect ``name``, ``what`` it is, the manoeuvre to ``fly`` that shows it, its ``forms`` (the standard one first), and
        its ``parameters``: ``key``, ``forms`` that have it, ``names`` to choose from, the plausible ``range`` on a vehicle of
        0.548 kg, what that ``grows_with``, and whether it is ``signed``.
    """
    return gap_effects()


def check(
    *, vehicle: Vehicle, flights: dict[str, FlightLog], held_out: dict[str, FlightLog] | None = None
) -> dict[str, Any]:
    """Say what flights are worth before any verdict: their data, and from which size on they show each effect.

    Parameters
    ----------
    vehicle : Vehicle
        What is believed; its numbers have tolerances.
    flights : dict of str to FlightLog
        From which effects are to be named.
    held_out : dict of str to FlightLog, optional
        For the proof: their data alone are looked at.

    Returns
    -------
    dict
        As ``squirrel gap check --json`` writes it: ``words``, ``flights`` (length, rate and largest gap of each channel, held
        samples, commands at their ends, and the ``problem`` for which one is set aside), ``effects`` (whether each is
        ``shown``, by which ``numbers`` from which size on, what it is ``not_told_from``, what to ``fly``), ``fly_next``
        and ``notes``.

    Raises
    ------
    ValueError
        One line that names the flight or the field, and the value.
    """
    return gap_check(vehicle, flights, _given(held_out))


def find(*, vehicle: Vehicle, flights: dict[str, FlightLog]) -> Finding:
    """Say where and by how much flights disagree with a vehicle.

    Parameters
    ----------
    vehicle : Vehicle
        What is believed.
    flights : dict of str to FlightLog
        By name.

    Returns
    -------
    Finding

    Raises
    ------
    ValueError
        One line that names the flight, the channel and the value.
    """
    found = gap_find(vehicle, flights)
    return Finding(residual=_residual(found["residual"]), where=_places(found["where"]), notes=tuple(found["notes"]))


def name(
    *, vehicle: Vehicle, flights: dict[str, FlightLog], baseline: dict[str, FlightLog] | None = None
) -> Verdict:
    """Say which effect a vehicle file lacks.

    Parameters
    ----------
    vehicle : Vehicle
        What is believed; its numbers have tolerances.
    flights : dict of str to FlightLog
        That the explanation is fitted to.
    baseline : dict of str to FlightLog, optional
        Good flights of the same machine: what is named is what has changed since.

    Returns
    -------
    Verdict

    Raises
    ------
    ValueError
        One line that names the flight or the field, and the value.
    """
    return _verdict(*gap_diagnose(vehicle, flights, {}, _given(baseline), False, False, None))


def shrink(
    *,
    vehicle: Vehicle,
    flights: dict[str, FlightLog],
    held_out: dict[str, FlightLog],
    baseline: dict[str, FlightLog] | None = None,
) -> Verdict:
    """Say what the missing effect is worth on flights that the fit never sees.

    Parameters
    ----------
    vehicle : Vehicle
        What is believed; its numbers have tolerances.
    flights : dict of str to FlightLog
        That the explanation is fitted to.
    held_out : dict of str to FlightLog
        For the proof, in open and in closed loop.
    baseline : dict of str to FlightLog, optional
        Good flights of the same machine: what is named is what has changed since.

    Returns
    -------
    Verdict
        With `Verdict.gap`.

    Raises
    ------
    ValueError
        One line that names the flight or the field, and the value.
    """
    if isinstance(held_out, dict) and not held_out:
        raise ValueError("held_out: none given; shrink needs flights that the fit never sees")
    return _verdict(*gap_diagnose(vehicle, flights, held_out, _given(baseline), False, True, None))


def run(
    *,
    vehicle: Vehicle,
    flights: dict[str, FlightLog],
    held_out: dict[str, FlightLog] | None = None,
    baseline: dict[str, FlightLog] | None = None,
    fit: bool = False,
    out: str | os.PathLike[str] | None = None,
) -> Verdict:
    """Find, name, add and shrink.

    Parameters
    ----------
    vehicle : Vehicle
        What is believed; its numbers have tolerances.
    flights : dict of str to FlightLog
        That the explanation is fitted to.
    held_out : dict of str to FlightLog, optional
        For the proof.
    baseline : dict of str to FlightLog, optional
        Good flights of the same machine: what is named is what has changed since.
    fit : bool, optional
        Whether `Verdict.patched` has the file's own numbers where these flights have them, each inside its tolerance,
        beside the names and also where nothing is missing.
    out : str or os.PathLike, optional
        Folder for ``report.html`` and the patched ``vehicle.toml``; nothing is written if left out.

    Returns
    -------
    Verdict

    Raises
    ------
    OSError
        The folder cannot be written to.
    ValueError
        One line that names the flight or the field, and the value.
    """
    return _verdict(*gap_diagnose(vehicle, flights, _given(held_out), _given(baseline), fit, True, out))


def _given(flights: dict[str, FlightLog] | None) -> dict[str, FlightLog]:
    return {} if flights is None else flights


def _places(places: list[dict[str, Any]]) -> tuple[Place, ...]:
    return tuple(Place(**place) for place in places)


def _rms(residual: dict[str, Any]) -> dict[str, Any]:
    return residual | {key: tuple(residual[key]) for key in ("force_body_rms_n", "moment_body_rms_n_m")}


def _residual(residual: dict[str, Any]) -> Residual:
    per_flight = {flight: FlightResidual(**_rms(of)) for flight, of in residual["per_flight"].items()}
    return Residual(**_rms(residual) | {"per_flight": per_flight})


def _effect(effect: dict[str, Any]) -> NamedEffect:
    parameters = {key: Parameter(**number) for key, number in effect.pop("parameters").items()}
    return NamedEffect(parameters=parameters, **effect)


def _gap(gap: dict[str, Any]) -> Gap:
    return Gap(held_out_flights=tuple(gap.pop("held_out_flights")), **gap)


def _left(left: dict[str, Any]) -> Left:
    return Left(
        share_removed=left["share_removed"],
        share_left=left["share_left"],
        channels=tuple(left["channels"]),
        goes_with=left["goes_with"],
    )


def _since(since: dict[str, Any]) -> Since:
    rotors = (
        RotorHealth(**rotor | {"thrust_loss_fraction": Parameter(**rotor["thrust_loss_fraction"])})
        for rotor in since["rotors"]
    )
    return Since(flights=tuple(since["flights"]), rotors=tuple(rotors))


def _flown(flown: dict[str, Any]) -> ClosedLoop:
    before, after = tuple(flown["before_ned_m"]), tuple(flown["after_ned_m"])
    return ClosedLoop(flight=flown["flight"], before_ned_m=before, after_ned_m=after)


def _verdict(verdict: dict[str, Any], patched: Vehicle | None) -> Verdict:
    return Verdict(
        verdict=verdict["verdict"],
        effects=tuple(_effect(effect) for effect in verdict["effects"]),
        moved=tuple(Moved(**number) for number in verdict["moved"]),
        alternatives=tuple(
            Alternative(effects=tuple(other["effects"]), evidence_nats=other["evidence_nats"])
            for other in verdict["alternatives"]
        ),
        where=_places(verdict["where"]),
        goes_with=verdict["goes_with"],
        fly_next=verdict["fly_next"],
        gap=_gap(verdict["gap"]) if verdict["gap"] else None,
        leftover=_left(verdict["leftover"]) if verdict["leftover"] else None,
        closed_loop=tuple(_flown(flown) for flown in verdict["closed_loop"]),
        model_patch=verdict["model_patch"],
        baseline=_since(verdict["baseline"]) if verdict["baseline"] else None,
        words=verdict["words"],
        set_aside=tuple(SetAside(**flight) for flight in verdict["set_aside"]),
        notes=tuple(verdict["notes"]),
        patched=patched,
    )
