"""What notebooks show: small tables."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from squirrel._squirrel import FlightLog, Vehicle
    from squirrel.gap import Verdict
    from squirrel.plan import Compared, Reach

__all__ = ["log", "reach", "vehicle", "verdict"]

Row = tuple[Any, ...]


def _cell(cell: Any) -> str:
    return f"{cell:.5g}" if isinstance(cell, float) else "" if cell is None else str(cell)


def _table(title: str, rows: Iterable[Row], head: Row = ()) -> str:
    """A title, and rows whose first cell says what they are."""
    lines = [f"<b>{escape(title)}</b>", "<table>"]
    if head:
        lines.append("<tr>" + "".join(f"<th>{escape(_cell(cell))}</th>" for cell in head) + "</tr>")
    for first, *rest in rows:
        cells = "".join(f"<td>{escape(_cell(cell))}</td>" for cell in rest)
        lines.append(f"<tr><th style='text-align:left'>{escape(_cell(first))}</th>{cells}</tr>")
    return "\n".join([*lines, "</table>"])


def vehicle(vehicle: Vehicle) -> str:
    """A vehicle: its first numbers, and how many have no source."""
    bare = vehicle.validate()
    rows: list[Row] = [("rotors", vehicle.rotor_count)]
    keys = ["mass.mass_kg", "propulsion.command", "limits.thrust_max_n", "wing.model", "battery.cells", "battery.capacity_ah"]
    rows += [(key, vehicle[key]) for key in keys if key in vehicle]
    rows.append(("hover command", vehicle.hover_command))
    effects = sorted({key.split(".")[1] for key in vehicle if key.startswith("effects.")})
    rows.append(("effects", ", ".join(effects) or "none"))
    rows.append(("numbers", f"{len(vehicle)}, {len(bare)} without a source"))
    return _table(f"Vehicle {vehicle.name}", rows)


def log(log: FlightLog) -> str:
    """A log: what flew, what came of it, and what was recorded."""
    said = [(key, log.metadata[key]) for key in ("vehicle", "arm", "scenario", "seed", "gains") if key in log.metadata]
    parts = [_table(f"FlightLog, {len(log)} channels", said)]
    if log.metrics is not None:
        plain = [(key, value) for key, value in log.metrics.items() if value not in (None, [], False)]
        parts.append(_table("metrics", plain))
    rows = []
    for source in log.sources:
        time_s = log.time_s(source)
        span_s = float(time_s[-1] - time_s[0]) if time_s.size else 0.0
        channels = sorted(key.removeprefix(f"{source}.") for key in log if key.rpartition(".")[0] == source)
        rows.append((source, time_s.size, span_s, ", ".join(channels)))
    parts.append(_table("sources", rows, ("", "samples", "s", "channels")))
    return "\n".join(parts)


def verdict(verdict: Verdict) -> str:
    """A verdict: the words, and the numbers of what is named."""
    parts = [f"<b>Verdict: {escape(verdict.verdict)}</b>", f"<p>{escape(verdict.words)}</p>"]
    rows = [
        (f"{effect.name}.{key}", number.value, f"{_cell(number.low)} to {_cell(number.high)}", effect.evidence_nats)
        for effect in verdict.effects
        for key, number in effect.parameters.items()
    ]
    if rows:
        parts.append(_table("named", rows, ("", "value", "95 %", "evidence, nats")))
    if verdict.gap is not None:
        gap = verdict.gap
        parts.append(_table("held-out flights", [("before", gap.before), ("after", gap.after), ("removed", gap.removed_fraction)]))
    return "\n".join(parts)


def reach(reach: Reach) -> str:
    """What wings change: folded, with wings, and their ratio."""

    def row(name: str, both: Compared | None) -> Row:
        return (name, "not to be had") if both is None else (name, both.folded, both.with_wings, both.ratio)

    rows = [
        row("upward, m/s²", reach.upward_m_s2),
        row("braking, height free, m/s²", reach.braking_height_free_m_s2),
        row("braking, level, m/s²", reach.braking_level_m_s2),
        row("volume of the set, (m/s²)³", reach.set_volume_m3_s6),
        row("volume of its hull, (m/s²)³", reach.hull_volume_m3_s6),
    ]
    return _table(f"Reach at T/W {reach.thrust_to_weight:.4g}", rows, ("", "folded", "with wings", "ratio"))
