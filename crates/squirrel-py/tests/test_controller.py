"""Functions of Python that fly."""

from typing import get_args

import numpy as np
import pytest
from test_policy import layers

import squirrel
from squirrel import flight

SEEN = {
    "position_ned_m": 3,
    "velocity_ned_m_s": 3,
    "q_ned_from_body_wxyz": 4,
    "omega_body_rad_s": 3,
    "specific_force_body_m_s2": 3,
    "reference_position_ned_m": 3,
    "reference_velocity_ned_m_s": 3,
    "reference_acceleration_ned_m_s2": 3,
}
WEIGHT_N = squirrel.Vehicle.bundled("squirrel")["mass.mass_kg"] * 9.80665


def hold(sight: dict, time_s: float) -> tuple:
    """A few lines of position control, heading north."""
    wrong = sight["reference_position_ned_m"] - sight["position_ned_m"]
    wanted = 1.5 * wrong + 2.0 * (sight["reference_velocity_ned_m_s"] - sight["velocity_ned_m_s"])
    wanted = np.clip(wanted + sight["reference_acceleration_ned_m_s2"], -4.0, 4.0)
    return WEIGHT_N * (1.0 - wanted[2] / 9.8), wanted[1] / 9.8, -wanted[0] / 9.8, 0.0


def test_a_controller_flies_the_track_and_equal_ones_give_equal_bits() -> None:
    flown = [squirrel.simulate(scenario="track", seed=3, controller=hold) for _ in range(2)]
    assert flown[0].metrics["rmse_m"] < 1.0
    channels = ["truth.position_ned_m", "actuators.rotor_command"]
    assert all(np.array_equal(flown[0][name], flown[1][name]) for name in channels if name in flown[0])
    assert np.array_equal(flown[0]["truth.position_ned_m"], flown[1]["truth.position_ned_m"])
    assert flown[0].metadata["controller"] == "a Python function commands attitude at 50 Hz"
    level = squirrel.simulate(scenario="track", seed=3, controller=lambda sight, time_s: [WEIGHT_N, 0.0, 0.0, 0.0])
    assert level.metrics["rmse_m"] > 2.0 * flown[0].metrics["rmse_m"]


@pytest.mark.parametrize("rate_hz", [10, 50, 300])
def test_it_is_asked_at_its_rate_and_sees_what_the_flight_code_knows(rate_hz: int) -> None:
    asked = []

    def look(sight: dict, time_s: float) -> tuple:
        assert {name: array.shape for name, array in sight.items()} == {name: (n,) for name, n in SEEN.items()}
        assert all(array.dtype == np.float32 for array in sight.values())
        asked.append(time_s)
        return hold(sight, time_s)

    log = squirrel.simulate(scenario="hover", controller=look, controller_hz=rate_hz)
    np.testing.assert_allclose(np.diff(asked), 1.0 / rate_hz, atol=1.1e-3)
    duration_s = log.time_s("truth")[-1]
    assert len(asked) == pytest.approx(rate_hz * (duration_s - asked[0]), abs=1.5)


def test_rotor_commands_reach_the_rotors() -> None:
    def climb(sight: dict, time_s: float) -> np.ndarray:
        return np.array([1.0, 1.0, 1.0, 1.0, 0.0] if time_s < 0.3 else [0.0, 0.0, 0.0, 0.0, 0.0])

    log = squirrel.simulate(scenario="hover", controller=climb, controller_hz=300, controller_commands="rotors")
    time_s, velocity = log.time_s("truth"), log["truth.velocity_ned_m_s"][:, 2]
    at = int(np.searchsorted(time_s, 0.3))
    assert velocity[at] < -1.0, "all rotors at full: it climbs"
    later = int(np.searchsorted(time_s, 0.8))
    fallen = velocity[later] - velocity[int(np.searchsorted(time_s, 0.6))]
    assert fallen == pytest.approx(0.2 * 9.8, rel=0.25), "no rotor turns: it falls"


def raises(sight: dict, time_s: float) -> tuple:
    raise KeyError("mine")


@pytest.mark.parametrize(
    ("arguments", "error", "line"),
    [
        ({"controller": 3}, ValueError, "controller: expected a function, got int"),
        ({"controller": hold, "controller_hz": 70}, ValueError, "controller_hz = 70: must divide 300, the rate of the flight code"),
        ({"controller": hold, "controller_hz": 0}, ValueError, "controller_hz = 0: must divide 300"),
        ({"controller": hold, "controller_hz": -1}, ValueError, "controller_hz = -1: must be 0 to "),
        ({"controller": hold, "controller_commands": "thrust"}, ValueError, "controller_commands = thrust: must be attitude or rotors"),
        ({"controller": raises}, KeyError, "mine"),
        ({"controller": lambda sight, time_s: None}, ValueError, "controller: at .* s: must return numbers: thrust_n, roll_rad, pitch_rad, wing"),
        ({"controller": lambda sight, time_s: (1.0, 2.0)}, ValueError, "controller: at .* s: returned 2 numbers, must be 4: thrust_n"),
        ({"controller": lambda sight, time_s: (1.0, float("nan"), 0.0, 0.0)}, ValueError, "controller: at .* s: roll_rad = NaN: must be finite"),
        (
            {"controller": hold, "controller_commands": "rotors"},
            ValueError,
            "controller: at .* s: returned 4 numbers, must be 5: rotor 0, rotor 1, rotor 2, rotor 3, wing",
        ),
    ],
)
def test_what_is_wrong_is_named(arguments: dict, error: type[Exception], line: str) -> None:
    with pytest.raises(error, match=line):
        squirrel.simulate(scenario="hover", **arguments)


def test_what_it_raises_says_when() -> None:
    with pytest.raises(KeyError) as raised:
        squirrel.simulate(scenario="hover", controller=raises)
    assert raised.value.__notes__[0].startswith("controller: raised at 0.")


def test_a_policy_and_a_controller_do_not_share_a_vehicle() -> None:
    policy = squirrel.Policy(**layers())
    with pytest.raises(ValueError, match="controller: flies alone, without policy"):
        squirrel.simulate(scenario="hover", controller=hold, policy=policy)


@pytest.mark.parametrize(
    ("argument", "names"),
    [("arm", flight.Arm), ("scenario", flight.Scenario), ("estimator", flight.Estimator)],
)
def test_the_names_in_the_types_are_those_that_are_known(argument: str, names: object) -> None:
    with pytest.raises(ValueError, match="known are ") as raised:
        squirrel.simulate(**{argument: "nobody"})
    known = str(raised.value).partition("known are ")[2].removesuffix(", or a .toml file").split(", ")
    assert list(get_args(names)) == known
