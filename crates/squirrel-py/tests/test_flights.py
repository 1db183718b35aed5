"""Flights and their logs."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT

import squirrel


def test_equal_arguments_give_equal_bits(tmp_path: Path) -> None:
    one, two = (squirrel.simulate(scenario="avoid", arm="twcc_flat", seed=3) for _ in range(2))
    one.write(tmp_path / "one.mcap")
    two.write(tmp_path / "two.mcap")
    assert (tmp_path / "one.mcap").read_bytes() == (tmp_path / "two.mcap").read_bytes()
    other = squirrel.simulate(scenario="avoid", arm="twcc_flat", seed=4)
    assert (other["truth.position_ned_m"] != one["truth.position_ned_m"]).any()


def test_a_log_comes_back_from_its_file(tmp_path: Path) -> None:
    flown = squirrel.simulate(scenario="hover", arm="pc")
    assert flown.metrics is not None
    assert flown.metrics["rmse_m"] is not None and 0.0 < flown.metrics["rmse_m"] < 1.0
    flown.write(tmp_path / "hover.mcap")
    read = squirrel.FlightLog.read(tmp_path / "hover.mcap")
    assert read.metrics is None
    assert read.keys() == flown.keys() and len(read) == len(read.keys())
    assert read.metadata["arm"] == "pc"
    for channel in read.keys():
        np.testing.assert_array_equal(read[channel], flown[channel])
    assert read["imu.omega_body_rad_s"].shape == (read.time_s("imu").size, 3)
    assert read["baro.altitude_m"].shape == read.time_s("baro").shape
    assert "imu.omega_body_rad_s" in read and "imu.omega" not in read
    with pytest.raises(KeyError, match=r"imu.omega: not in this log"):
        read["imu.omega"]
    with pytest.raises(KeyError, match=r"source sonar: not in this log, which has attitude"):
        read.time_s("sonar")


def test_arrays_are_the_callers_own() -> None:
    log = squirrel.simulate(scenario="hover")
    log["truth.position_ned_m"][:] = 0.0
    assert (log["truth.position_ned_m"] != 0.0).any()


def test_data_frames() -> None:
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    log = squirrel.simulate(scenario="hover")
    one, two = log.to_pandas("imu"), log.to_polars("imu")
    assert isinstance(one, pandas.DataFrame) and isinstance(two, polars.DataFrame)
    assert one.index.name == "time_s" and two.columns[0] == "time_s"
    np.testing.assert_array_equal(one["omega_body_rad_s_2"], log["imu.omega_body_rad_s"][:, 2])
    np.testing.assert_array_equal(two["omega_body_rad_s_2"], log["imu.omega_body_rad_s"][:, 2])
    np.testing.assert_array_equal(log.to_pandas("baro")["altitude_m"], log["baro.altitude_m"])


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ({"arm": "hawk"}, "arm = hawk: no such arm; known are pc, "),
        ({"scenario": "loop"}, "scenario = loop: no such scenario; known are hover, "),
        ({"integrator": "leapfrog"}, "integrator = leapfrog"),
        ({"thrust_to_weight": -1.0}, "thrust_to_weight = -1"),
        ({"thrust_to_weight": float("nan")}, "thrust_to_weight = NaN"),
        ({"estimator": "hawk"}, "estimator = hawk: no such estimator; known are eskf, "),
    ],
)
def test_a_bad_argument_is_named(arguments: dict[str, object], line: str) -> None:
    with pytest.raises(ValueError, match=line):
        squirrel.simulate(**arguments)  # type: ignore[arg-type]


def test_files_that_cannot_be_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError, match="no.toml"):
        squirrel.simulate(scenario=str(tmp_path / "no.toml"))
    with pytest.raises(FileNotFoundError, match="no.mcap"):
        squirrel.FlightLog.read(tmp_path / "no.mcap")
    (tmp_path / "text.mcap").write_text("not a log")
    with pytest.raises(ValueError, match="text.mcap: not an MCAP file"):
        squirrel.FlightLog.read(tmp_path / "text.mcap")
    squirrel.simulate(scenario="hover").write(tmp_path / "whole.mcap")
    (tmp_path / "cut.mcap").write_bytes((tmp_path / "whole.mcap").read_bytes()[:-5000])
    with pytest.raises(ValueError, match="cut.mcap: truncated at byte"):
        squirrel.FlightLog.read(tmp_path / "cut.mcap")


LONG = """
import sys, squirrel
scenario = "name = 'long'\\nduration_s = 1e5\\nheight_m = 10.0\\n[mission]\\nkind = 'hover'\\n"
open("long.toml", "w").write(scenario)
print("flies", flush=True)
squirrel.simulate(scenario="long.toml")
"""

ROLLOUT = """
import numpy as np, squirrel
batch = squirrel.Batch(vehicles=[squirrel.Vehicle.bundled("squirrel")] * 1000, threads=1)
print("flies", flush=True)
batch.step(10**9)
"""

GAP = """
import squirrel
log = squirrel.simulate(scenario="excite_rich", arm="pc")
vehicle = squirrel.Vehicle.bundled("squirrel").edited({"mass.mass_kg": 0.6})
print("flies", flush=True)
squirrel.gap.run(vehicle=vehicle, flights={f"f{k}": log for k in range(20)}, out="gap")
"""

TRAINING = """
import squirrel
flights = {f"f{k}": squirrel.simulate(scenario="random_spread", arm="pc_wings_open", seed=k) for k in (1, 2)}
print("flies", flush=True)
squirrel.nn.train(flights, epochs=100_000)
"""


def is_interrupted(program: str, folder: Path) -> bool:
    """Sends Ctrl-C into a program; whether that ended it before its work was done."""
    folder.mkdir()
    with subprocess.Popen(
        [sys.executable, "-c", program], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as child:
        assert child.stdout is not None and child.stderr is not None
        assert child.stdout.readline() == "flies\n"
        # Into the call; before it, Python ends by itself.
        time.sleep(0.3)
        child.send_signal(signal.SIGINT)
        # A guard against a hang: without an answer to the signal most of the calls take longer.
        child.wait(timeout=120.0)
        said = child.stderr.read()
    assert "panic" not in said
    return "KeyboardInterrupt" in said and not (folder / "gap").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="sends SIGINT")
@pytest.mark.parametrize("program", [LONG, ROLLOUT, GAP, TRAINING], ids=["simulate", "Batch.step", "gap.run", "nn.train"])
def test_ctrl_c_ends_a_long_call(program: str, tmp_path: Path) -> None:
    """And nothing prints but Python: what works on another thread stops in silence."""
    # The gap workflow takes a second alone, and may be over before a busy machine sends the signal: then once more.
    assert any(is_interrupted(program, tmp_path / str(k)) for k in range(5))


def test_logs_of_others_are_read(tmp_path: Path) -> None:
    """Own logs, an autopilot's and a ROS 2 bag, by their content."""
    flown = squirrel.simulate(scenario="hover", arm="pc")
    flown.write(tmp_path / "hover")
    assert squirrel.read_log(tmp_path / "hover").keys() == flown.keys()
    data = ROOT / "crates/squirrel-log/tests/data"
    px4 = squirrel.read_log(data / "ulog/sample_cut.ulg")
    assert px4["imu.omega_body_rad_s"].shape[1] == 3
    bag = squirrel.read_log(data / "ros/mocap.mcap")
    assert bag.keys()
    with pytest.raises(FileNotFoundError):
        squirrel.read_log(tmp_path / "no.ulg")
    (tmp_path / "text.txt").write_text("hello")
    with pytest.raises(ValueError, match="text.txt: import reads"):
        squirrel.read_log(tmp_path / "text.txt")


CRAZYFLIES = ["crazyflie21_brushed", "crazyflie21_brushed_curve", "crazyflie21_datasheet", "crazyflie2_arpl"]


@pytest.mark.parametrize("name", CRAZYFLIES)
def test_bundled_vehicles_without_gains_fly_by_rule_and_say_so(name: str) -> None:
    vehicle = squirrel.Vehicle.bundled(name)
    assert "control.thrust_min_n" not in vehicle
    log = squirrel.simulate(vehicle=vehicle, scenario="hover", arm="pc", seed=1)
    assert log.metadata["gains"].startswith("by rule") and "by rule: " in log.metadata["vehicle_toml"]
    assert log.metrics is not None and log.metrics["rmse_m"] is not None and log.metrics["rmse_m"] < 1.0, log.metrics
    assert "gains" not in squirrel.simulate(scenario="hover").metadata
    squirrels = squirrel.Vehicle.bundled("squirrel")
    tasks = squirrel.Tasks(task="track", vehicles=[squirrels, vehicle], num_envs=8)
    assert tasks.gains_by_rule == [1]
    tasks.reset()
    for _ in range(25):
        _, reward, terminated, _ = tasks.step(np.tile(np.float32([0, 0, 0, -1]), (8, 1)))
    assert np.isfinite(reward).all() and not terminated.all()


def test_notebooks_see_tables(vehicle: squirrel.Vehicle) -> None:
    log = squirrel.simulate(scenario="hover")
    reach = squirrel.plan.reach(vehicle, velocity_ned_m_s=(7.0, 0.0, 0.0), thrust_to_weight=1.1)
    for thing, words in [
        (vehicle, ["Vehicle squirrel", "0.548", "without a source"]),
        (log, ["FlightLog", "rmse_m", "imu", "omega_body_rad_s"]),
        (reach, ["Reach at T/W 1.1", "with wings", "upward"]),
    ]:
        html = thing._repr_html_()
        assert html.count("<table>") == html.count("</table>") >= 1 and html.count("<tr>") == html.count("</tr>")
        assert all(word in html for word in words), html
    odd = vehicle.edited({"name": "<script>"})
    assert "<script>" not in odd._repr_html_() and "&lt;script&gt;" in odd._repr_html_()
