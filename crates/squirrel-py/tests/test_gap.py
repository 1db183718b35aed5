"""The gap workflow."""

import dataclasses
from pathlib import Path

import pytest

import squirrel


@pytest.fixture(scope="module")
def sagging(vehicle: squirrel.Vehicle) -> dict[str, squirrel.FlightLog]:
    """Flights whose rotors slow down with the battery, which the bundled vehicle file does not know."""
    flown = vehicle.edited({"effects.battery_sag.voltage_exponent": 0.9})
    fly = squirrel.simulate
    return {f"f{k}": fly(vehicle=flown, scenario="excite_rich", arm="pc", seed=k) for k in (1, 2, 3)}


def test_find_says_where(vehicle: squirrel.Vehicle, sagging: dict[str, squirrel.FlightLog]) -> None:
    finding = squirrel.gap.find(vehicle=vehicle, flights=sagging)
    assert list(finding.residual.per_flight) == ["f1", "f2", "f3"]
    assert finding.residual.force_body_rms_n[2] > 5 * finding.residual.force_body_rms_n[1]
    noise = [place.noise for place in finding.where]
    assert noise == sorted(noise, reverse=True) and {place.flight for place in finding.where} <= set(sagging)
    assert "force_body_z_n" in {place.channel for place in finding.where}


def test_check_says_what_flights_could_show(
    vehicle: squirrel.Vehicle, sagging: dict[str, squirrel.FlightLog]
) -> None:
    flights = {name: sagging[name] for name in ("f1", "f2")}
    found = squirrel.gap.check(vehicle=vehicle, flights=flights, held_out={"f3": sagging["f3"]})
    assert [flight["is_held_out"] for flight in found["flights"]] == [False, False, True]
    assert all(flight["problem"] is None and flight["usable_s"] > 30 for flight in found["flights"])
    sag = next(effect for effect in found["effects"] if effect["name"] == "battery_sag")
    assert sag["shown"] == "can" and sag["numbers"][0]["smallest_shown"] < 0.9
    with pytest.raises(ValueError, match="none given"):
        squirrel.gap.check(vehicle=vehicle, flights={})


def test_effects_are_those_that_a_vehicle_file_may_name(vehicle: squirrel.Vehicle) -> None:
    listed = {effect["name"]: effect for effect in squirrel.gap.effects()}
    assert list(listed) == sorted(listed)
    sag = listed["battery_sag"]
    assert sag["forms"][0] == "power" and sag["parameters"][0]["range"] == [0.4, 1.0]
    with pytest.raises(ValueError, match=r"no such effect") as unknown:
        vehicle.edited({"effects.no_such_effect.size": 1.0})
    assert all(name in str(unknown.value) for name in listed)


def test_run_names_what_is_missing(
    vehicle: squirrel.Vehicle, sagging: dict[str, squirrel.FlightLog], tmp_path: Path
) -> None:
    held_out = {"f3": sagging["f3"]}
    flights = {name: log for name, log in sagging.items() if name not in held_out}
    verdict = squirrel.gap.run(vehicle=vehicle, flights=flights, held_out=held_out, out=tmp_path / "gap")
    assert verdict.verdict == "named" and [effect.name for effect in verdict.effects] == ["battery_sag"]
    exponent = verdict.effects[0].parameters["voltage_exponent"]
    assert isinstance(exponent.low, float) and exponent.low < 0.9 < exponent.high
    assert verdict.gap is not None and verdict.gap.removed_fraction > 0.99
    (flown,) = verdict.closed_loop
    assert flown.flight == "f3" and flown.after_ned_m[2] < 0.1 * flown.before_ned_m[2]
    with pytest.raises(dataclasses.FrozenInstanceError):
        verdict.words = ""  # type: ignore[misc]

    assert verdict.patched is not None and verdict.model_patch is not None
    assert squirrel.Vehicle.load(verdict.model_patch).text == verdict.patched.text
    assert verdict.patched["effects.battery_sag.voltage_exponent"] == pytest.approx(exponent.value, rel=1e-3)
    assert sorted(file.name for file in (tmp_path / "gap").iterdir()) == ["report.html", "vehicle.toml"]


def test_a_fit_moves_the_numbers_of_a_file_that_lacks_nothing(vehicle: squirrel.Vehicle) -> None:
    roll, pitch, yaw = vehicle["mass.inertia_kg_m2"]

    def fitted(flown: squirrel.Vehicle) -> float:
        fly = squirrel.simulate
        flights = {f"f{k}": fly(vehicle=flown, scenario="excite_rich", arm="pc", seed=k) for k in (4, 5)}
        verdict = squirrel.gap.run(vehicle=vehicle, flights=flights, fit=True)
        assert verdict.verdict == "none" and verdict.patched is not None
        assert squirrel.gap.run(vehicle=vehicle, flights=flights).patched is None
        inertia: float = verdict.patched["mass.inertia_kg_m2"][0]
        return inertia

    heavier = vehicle.edited({"mass.inertia_kg_m2": [1.015 * roll, pitch, yaw]})
    # Noise moves both alike, by up to a percent; the tolerance of the file takes a tenth of the rest.
    assert fitted(heavier) / fitted(vehicle) == pytest.approx(1.015, abs=0.003)


def test_a_bad_argument_is_named(vehicle: squirrel.Vehicle) -> None:
    with pytest.raises(ValueError, match="flights: none given"):
        squirrel.gap.name(vehicle=vehicle, flights={})
    with pytest.raises(ValueError, match="held_out: none given"):
        squirrel.gap.shrink(vehicle=vehicle, flights={}, held_out={})
    with pytest.raises(ValueError, match="flights: expected names .* got 1 of"):
        squirrel.gap.find(vehicle=vehicle, flights={1: None})  # type: ignore[dict-item]


def test_a_notebook_sees_the_verdict() -> None:
    effect = squirrel.gap.NamedEffect(
        name="battery_sag",
        form="standard",
        evidence_nats=12.5,
        parameters={"voltage_exponent": squirrel.gap.Parameter(value=0.9, low=0.8, high=1.0)},
    )
    verdict = squirrel.gap.Verdict(
        verdict="named", effects=(effect,), moved=(), alternatives=(), where=(), goes_with=None, fly_next=None, gap=None,
        leftover=None, closed_loop=(), model_patch=None, baseline=None, words="a < b", set_aside=(), notes=(), patched=None,
    )  # fmt: skip
    html = verdict._repr_html_()
    assert "Verdict: named" in html and "a &lt; b" in html and "battery_sag.voltage_exponent" in html and "0.8 to 1" in html
