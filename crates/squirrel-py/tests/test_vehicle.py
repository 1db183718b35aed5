"""Vehicles: load, edit, save, refuse."""

from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT

import squirrel


def test_bundled_vehicles_are_those_of_the_repository() -> None:
    crazyflies = ["crazyflie21_brushed", "crazyflie21_brushed_curve", "crazyflie21_datasheet", "crazyflie2_arpl"]
    for name in ["squirrel", "squirrel_air", *crazyflies]:
        vehicle = squirrel.Vehicle.bundled(name)
        assert vehicle.text == (ROOT / f"vehicles/{name}.toml").read_text()
    with pytest.raises(ValueError, match=r"name = hawk: no such vehicle; known are squirrel, "):
        squirrel.Vehicle.bundled("hawk")


def test_a_flight_takes_a_file_or_the_name_of_a_bundled_vehicle(tmp_path: Path) -> None:
    air = squirrel.Vehicle.bundled("squirrel_air")
    air.save(tmp_path / "mine.toml")
    expected = squirrel.simulate(vehicle=air, scenario="hover").metrics
    for given in ("squirrel_air", tmp_path / "mine.toml", str(tmp_path / "mine.toml")):
        assert squirrel.simulate(vehicle=given, scenario="hover").metrics == expected
    with pytest.raises(FileNotFoundError, match="hawk: no such file, and no bundled vehicle; known are squirrel, "):
        squirrel.simulate(vehicle="hawk", scenario="hover")
    with pytest.raises(TypeError, match="vehicle: expected a Vehicle, a file or a name, got int"):
        squirrel.simulate(vehicle=1, scenario="hover")  # type: ignore[arg-type]


def test_numbers_by_key(vehicle: squirrel.Vehicle) -> None:
    assert vehicle["mass.mass_kg"] == 0.548
    assert vehicle["rotor[1].position_body_m"] == [-0.085, -0.085, 0.0]
    assert vehicle["battery.cells"] == 4
    assert vehicle["wing.model"] == "membrane"
    assert vehicle.source("mass.mass_kg") == "paper, Table I"
    assert {"mass.mass_kg", "rotor[3].yaw_sign"} <= set(vehicle.keys())
    for key in ["mass", "mass.weight_kg", "rotor[4].yaw_sign", "rotor[x].yaw_sign", "", "."]:
        with pytest.raises(KeyError):
            vehicle[key]
    with pytest.raises(KeyError):
        vehicle.source("mass.weight_kg")


def test_an_edit_is_checked_and_keeps_the_text(vehicle: squirrel.Vehicle) -> None:
    edited = vehicle.edited({"mass.mass_kg": 0.6, "effects.battery_sag.voltage_exponent": 0.9})
    assert edited["mass.mass_kg"] == 0.6
    assert edited.source("mass.mass_kg") is None
    assert "mass.mass_kg" in edited.validate()
    assert vehicle["mass.mass_kg"] == 0.548
    assert "[effects.battery_sag]" in edited.text
    moments = np.array([3.3e-3, 4.7e-3, 7.7e-3])
    assert edited.edited({"mass.inertia_kg_m2": moments})["mass.inertia_kg_m2"] == list(moments)
    assert edited.text.splitlines()[0] == vehicle.text.splitlines()[0]
    without = edited.edited({"effects.battery_sag": None, "wing.model": "flat"})
    assert without["wing.model"] == "flat"
    with pytest.raises(KeyError):
        without["effects.battery_sag.voltage_exponent"]


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"mass.mass_kg": -1}, "squirrel: mass.mass_kg = -1: must be finite and > 0"),
        ({"mass.mass_kg": float("nan")}, "squirrel: mass.mass_kg = NaN"),
        ({"mass.weight_kg": 1.0}, "weight_kg"),
        ({"mass.mass_kg": object()}, "mass.mass_kg: expected a number, text, truth value or list, got object"),
        ({"mass.mass_kg": {"value": 1.0}}, "mass.mass_kg: expected a number, text, truth value or list, got dict"),
        ({"mass.weight_kg": None}, "mass.weight_kg: not there"),
        ({"rotor[7].yaw_sign": 1}, r"rotor\[7\].yaw_sign: no table rotor\[7\]"),
        ({"name.first": 1}, "name.first: name is not a table"),
        ({"effects.hurricane.speed_m_s": 1.0}, "hurricane"),
    ],
)
def test_a_bad_edit_names_the_field(vehicle: squirrel.Vehicle, changes: dict[str, object], line: str) -> None:
    with pytest.raises(ValueError, match=line):
        vehicle.edited(changes)


def test_what_is_saved_is_loaded(vehicle: squirrel.Vehicle, tmp_path: Path) -> None:
    path = tmp_path / "heavy.toml"
    vehicle.edited({"mass.mass_kg": 0.6}).save(path)
    assert squirrel.Vehicle.load(path)["mass.mass_kg"] == 0.6
    assert [file.name for file in tmp_path.iterdir()] == ["heavy.toml"]
    with pytest.raises(FileNotFoundError, match="gone/heavy.toml"):
        vehicle.save(tmp_path / "gone/heavy.toml")


def test_files_that_cannot_be_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no.toml"):
        squirrel.Vehicle.load(tmp_path / "no.toml")
    (tmp_path / "bad.toml").write_text("name = 'x'\nwings = 3\n")
    with pytest.raises(ValueError, match=r"bad.toml, line 2: unknown field `wings`"):
        squirrel.Vehicle.load(str(tmp_path / "bad.toml"))
    with pytest.raises(ValueError, match="missing field"):
        squirrel.Vehicle.parse("")


def test_a_first_vehicle_flies_and_says_what_is_guessed() -> None:
    vehicle = squirrel.Vehicle.new(frame="quad-x", mass_kg=0.75, propeller_inch=5.0, name="mine")
    assert vehicle["mass.mass_kg"] == 0.75
    assert 'source = "guess' in vehicle.text
    flight = squirrel.simulate(vehicle=vehicle, scenario="hover", arm="pc", seed=1)
    assert flight.metrics is not None and flight.metrics["rmse_m"] is not None
    assert flight.metrics["rmse_m"] < 0.3
    with pytest.raises(ValueError, match="propeller_inch: missing"):
        squirrel.Vehicle.new(frame="quad-x", mass_kg=0.75)
    with pytest.raises(ValueError, match="frame = tri: no such frame"):
        squirrel.Vehicle.new(frame="tri", mass_kg=0.75, propeller_inch=5.0)
    with pytest.raises(ValueError, match="mass_kg = -1"):
        squirrel.Vehicle.new(frame="quad-x", mass_kg=-1.0, propeller_inch=5.0)
