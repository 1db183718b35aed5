"""Whether an exported vehicle flies in the other simulator as it does here, and a patched one better than the one without.

For each case a vehicle has one effect that the target can express. It flies here; the same commands fly the export of the
vehicle without the effect, and of the vehicle with it, from states of the flight, a second at a time and clear of the ground.
Told is the root mean square of the distance to the flight here, where a radian of attitude counts as a metre, and what of it
the patch removes. A draw that the target refuses by name is no case that it can express: it is told, and drawn anew.

    python compare.py --squirrel target/release/squirrel --cases 100 --json export.json
"""

import argparse
import json
import re
import subprocess
import tempfile
import tomllib
from pathlib import Path

import numpy as np
from mcap_protobuf.reader import read_protobuf_messages
from targets import FLY

WINDOW_S = 1.0
WINDOWS = 16
CLEAR_M = 1.0
RATE_HZ = 300
# A moment of inertia above the sum of the others, which an `inertia_error` can leave.
REFUSED_BY_NAME = "which no body has"
# The flights are flown by firm gains with room for a lasting moment: control is not what is compared, and those of the rule
# let a centre of mass that is 10 mm off turn this vehicle over.
FIRM = {
    "c1_per_s": "[9.0, 9.0, 5.0]",
    "c2_per_s": "[14.0, 14.0, 7.0]",
    "lambda_per_s2": "[8.0, 8.0, 2.0]",
    "integral_max_rad_s": "2.0",
}
BASE = ["--frame", "quad-x", "--mass-kg", "0.6", "--propeller-inch", "5"]

# Sizes of docs/guide/effects.md, and who can express them.
ALL = ("rotorpy", "crazyflow", "mjcf")
EFFECTS = [
    ("mass_error", ALL, lambda r: {"mass_fraction": signed(r, 0.04, 0.2)}),
    ("thrust_coefficient", ALL, lambda r: {"thrust_fraction": signed(r, 0.04, 0.15)}),
    ("yaw_torque_coeff", ALL, lambda r: {"torque_fraction": signed(r, 0.12, 0.4)}),
    ("inertia_error", ALL, lambda r: {"axis": str(r.choice(["x", "y", "z"])), "inertia_fraction": signed(r, 0.12, 0.4)}),
    ("cg_offset", ALL, lambda r: {"cg_x_m": signed(r, 0.003, 0.012), "cg_y_m": signed(r, 0.003, 0.012)}),
    ("motor_lag", ALL, lambda r: {"extra_time_constant_s": r.uniform(0.015, 0.06)}),
    ("linear_drag", ("rotorpy", "crazyflow"), lambda r: {"extra_drag_n_s_per_m": signed(r, 0.04, 0.25)}),
    ("quadratic_drag", ("rotorpy", "mjcf"), lambda r: {"extra_drag_area_m2": r.uniform(0.008, 0.05)}),
    ("axial_inflow", ("rotorpy",), lambda r: {"gain_s_per_m": signed(r, 0.012, 0.06)}),
    ("translational_lift", ("rotorpy",), lambda r: {"gain_s2_per_m2": signed(r, 0.0006, 0.003), "form": "quadratic"}),
    ("flapping_moment", ("rotorpy",), lambda r: {"gain_n_m_s_per_m": signed(r, 0.001, 0.006)}),
    ("weak_rotor", ("crazyflow", "mjcf"), lambda r: {"rotor": int(r.integers(1, 5)), "thrust_loss_fraction": signed(r, 0.05, 0.2)}),
    ("rotor_gyro_torque", ("crazyflow",), lambda r: {"rotor_inertia_kg_m2": r.uniform(4e-6, 2e-5)}),
    ("constant_wind", ("mjcf",), lambda r: {"wind_north_m_s": signed(r, 1.5, 6.0), "wind_east_m_s": signed(r, 1.5, 6.0)}),
    ("thrust_misalignment", ("mjcf",), lambda r: {"tilt_x_rad": signed(r, 0.017, 0.07), "tilt_y_rad": signed(r, 0.017, 0.07)}),
]


def signed(random, least, most):
    return float(random.uniform(least, most) * random.choice([-1.0, 1.0]))


def table(name, parameters):
    value = lambda x: f'"{x}"' if isinstance(x, str) else repr(x)
    return f"\n[effects.{name}]\n" + "".join(f"{key} = {value(x)}\n" for key, x in parameters.items())


class Refused(Exception):
    """What the program says of arguments that it does not take."""


class Bench:
    def __init__(self, squirrel, folder):
        self.squirrel, self.folder = Path(squirrel).resolve(), Path(folder)
        self.base = self.folder / "base.toml"
        self.run("vehicle", "new", *BASE, "--name", "base", "--out", self.base)
        text = self.base.read_text()
        for key, value in FIRM.items():
            text, found = re.subn(rf"^{key} = .*$", f'{key} = {{ value = {value}, source = "the bench" }}', text, flags=re.MULTILINE)
            assert found == 1, key
        self.base.write_text(text)
        propulsion = tomllib.loads(self.base.read_text())["propulsion"]
        self.nominal = {
            "thrust": propulsion["thrust_coefficient_n_s2"]["value"],
            "top": propulsion["speed_max_rad_s"]["value"],
        }

    def run(self, *arguments):
        done = subprocess.run([self.squirrel, *map(str, arguments)], cwd=self.folder, capture_output=True, text=True)
        if done.returncode != 0:
            raise Refused(f"{arguments}: {done.stderr}")

    def export(self, vehicle, target):
        out, told = self.folder / "export", self.folder / "export.json"
        self.run("vehicle", "export", vehicle, "--to", target, "--out", out, "--json", told)
        return out.read_text(), json.loads(told.read_text())

    def flight(self, vehicle, seed):
        log = self.folder / "flight.mcap"
        self.run("fly", "--vehicle", vehicle, "--arm", "pc", "--scenario", "excite_normal", "--seed", seed, "--out", log)
        truth, rotor = [], []
        for message in read_protobuf_messages(str(log), topics=["truth", "rotor"]):
            body = message.proto_msg
            if message.topic == "rotor":
                rotor.append([*body.command, *body.speed_rad_s])
            else:
                truth.append([*body.position_ned_m, *body.velocity_ned_m_s, *body.q_ned_from_body_wxyz, *body.omega_body_rad_s])
        count = min(len(truth), len(rotor))
        return np.array(truth[:count]), np.array(rotor[:count])

    def windows(self, truth, rotor):
        """Start states, commanded speeds and where the vehicle was after each of them."""
        length = int(WINDOW_S * RATE_HZ)
        begins = np.linspace(RATE_HZ, len(truth) - length - 2, WINDOWS).astype(int)
        begins = [k for k in begins if truth[k : k + length, 2].max() < -CLEAR_M]
        if not begins:
            raise RuntimeError("no second of the flight is clear of the ground")
        starts = [
            {
                "position": truth[k, :3],
                "velocity": truth[k, 3:6],
                "q": truth[k, 6:10],
                "omega": truth[k, 10:13],
                "speed": rotor[k, 4:],
            }
            for k in begins
        ]
        commands = np.array([np.clip(rotor[k : k + length, :4], 0.0, 1.0) * self.nominal["top"] for k in begins])
        paths = np.array([truth[k + 1 : k + 1 + length][:, [0, 1, 2, 6, 7, 8, 9]] for k in begins])
        return starts, commands, paths

    def error(self, target, text, windows):
        starts, commands, paths = windows
        flown = FLY[target](text, starts, commands, 1.0 / RATE_HZ, self.nominal)
        squares = np.sum((flown[..., :3] - paths[..., :3]) ** 2, axis=2)
        cosine = np.abs(np.sum(flown[..., 3:] * paths[..., 3:], axis=2)) / np.linalg.norm(flown[..., 3:], axis=2)
        angles = 2.0 * np.arccos(np.clip(cosine, 0.0, 1.0))
        return float(np.sqrt(np.mean(squares + angles**2)))


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--squirrel", default="target/release/squirrel")
    options.add_argument("--cases", type=int, default=100)
    options.add_argument("--first", type=int, default=1, help="the number of the first case that is flown")
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--json")
    given = options.parse_args()
    random = np.random.default_rng(given.seed)
    told = {"agreement": {}, "refused": [], "cases": []}
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(given.squirrel, folder)
        windows = bench.windows(*bench.flight(bench.base, 1))
        for target in FLY:
            text, _ = bench.export(bench.base, target)
            told["agreement"][target] = bench.error(target, text, windows)
            print(f"{target}: the vehicle itself, {1e3 * told['agreement'][target]:.2f} mm off after up to 1 s")
        kinds = [(name, target, draw) for name, targets, draw in EFFECTS for target in targets]
        for case in range(given.cases):
            name, target, draw = kinds[case % len(kinds)]
            true = bench.folder / "true.toml"
            while True:
                parameters = draw(random)
                true.write_text(bench.base.read_text() + table(name, parameters))
                try:
                    after, lost = bench.export(true, target)
                    break
                except Refused as why:
                    if REFUSED_BY_NAME not in str(why):
                        raise
                    told["refused"].append({"effect": name, "target": target, "parameters": parameters})
                    print(f"{case + 1:3} {target:10} {name:20} refused by name, drawn anew", flush=True)
            if case + 1 < given.first:
                continue
            windows = bench.windows(*bench.flight(true, 100 + case))
            before, _ = bench.export(bench.base, target)
            errors = [bench.error(target, text, windows) for text in (before, after)]
            removed = 1.0 - errors[1] / errors[0]
            row = {"effect": name, "target": target, "parameters": parameters, "before_m": errors[0], "after_m": errors[1]}
            row |= {"removed_fraction": removed, "lost": [entry["what"] for entry in lost["lost"]]}
            told["cases"].append(row)
            print(f"{case + 1:3} {target:10} {name:20} {1e3 * errors[0]:8.2f} mm, patched {1e3 * errors[1]:8.2f} mm: {100 * removed:5.1f} %", flush=True)
    good = sum(case["removed_fraction"] >= 0.5 for case in told["cases"])
    told["half_removed"] = good
    print(f"half of the error or more removed in {good} of {len(told['cases'])}")
    if given.json:
        Path(given.json).write_text(json.dumps(told, indent=1) + "\n")


if __name__ == "__main__":
    main()
