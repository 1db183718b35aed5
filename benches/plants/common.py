"""What the benches of foreign plants share: the vehicle file, the way from rows to a verdict, and how that is judged."""

import argparse
import json
import re
import subprocess
import tempfile
from pathlib import Path

import numpy as np

GRAVITY_M_S2 = 9.81
AIR_KG_M3 = 1.225
FRD = np.array([1.0, -1.0, -1.0])

COLUMNS = "t,px,py,pz,vx,vy,vz,qx,qy,qz,qw,gx,gy,gz,ax,ay,az,m1,m2,m3,m4,vbat"
MAP = """[[source]]
time = { column = "t", unit = "s" }
[source.channels]
"imu.omega_body_rad_s" = { columns = ["gx", "gy", "gz"], body = "flu" }
"imu.specific_force_body_m_s2" = { columns = ["ax", "ay", "az"], body = "flu" }
"attitude.q_ned_from_body_wxyz" = { columns = ["qx", "qy", "qz", "qw"], order = "xyzw", world = "nwu", body = "flu", direction = "world_from_body" }
"gnss.position_ned_m" = { columns = ["px", "py", "pz"], world = "nwu" }
"gnss.velocity_ned_m_s" = { columns = ["vx", "vy", "vz"], world = "nwu" }
"rotor.command" = { columns = ["m1", "m2", "m3", "m4"], rotors = [1, 2, 3, 4] }
"battery.voltage_v" = { columns = ["vbat"] }
"""


class Lost(Exception):
    """The plant's own controller does not hold the machine with what was hidden."""


def vehicle_file(squirrel, source, numbers, path):
    """A first file of the program with the plant's numbers, each with the tolerance of a careful bench.

    `numbers`: mass, inertia, rotors (place ahead, to the left and up, and the sense of rotation seen from below), top, thrust, torque
    (coefficients), lag, diameter, area (of drag), cells.
    """
    new = ["vehicle", "new", "--frame", "quad-x", "--mass-kg", str(numbers["mass"]), "--propeller-inch", "5", "--name", "plant", "--out", str(path)]
    subprocess.run([squirrel, *new], check=True, capture_output=True)
    head, rest = path.read_text().split("[[rotor]]", 1)
    arm = float(np.linalg.norm(numbers["rotors"][0][0]))
    rotors = ""
    for place, turns in numbers["rotors"]:
        position = [float(x) for x in place * FRD + 0.0]
        rotors += f'[[rotor]]\nposition_body_m = {{ value = {position}, sd = {[0.003 * arm] * 3}, source = "{source}" }}\nyaw_sign = {-int(turns)}\n\n'
    text = head + rotors + rest[rest.index("[propulsion]") :]

    def put(key, value, sd=None):
        nonlocal text
        spread = "" if sd is None else f", sd = {sd}"
        text, found = re.subn(rf"^{key} = .*$", f'{key} = {{ value = {value}{spread}, source = "{source}" }}', text, flags=re.MULTILINE)
        assert found == 1, key

    def close(key, value, share):
        put(key, value, share * value)

    mass, inertia = numbers["mass"], [float(x) for x in numbers["inertia"]]
    close("mass_kg", mass, 0.003)
    put("inertia_kg_m2", inertia, [0.02 * x for x in inertia])
    close("speed_max_rad_s", float(numbers["top"]), 0.002)
    close("thrust_coefficient_n_s2", numbers["thrust"], 0.008)
    close("torque_coefficient_n_m_s2", numbers["torque"], 0.02)
    close("time_constant_s", numbers["lag"], 0.05)
    put("propeller_diameter_m", numbers["diameter"], 0.001)
    put("linear_n_s_per_m", [0.0] * 3, [0.02 * mass] * 3)
    close("area_m2", numbers["area"], 0.1)
    put("reference_voltage_v", 3.7 * numbers["cells"], 0.1)
    text = re.sub(r"^cells = .*$", f"cells = {numbers['cells']}", text, flags=re.MULTILINE)
    put("thrust_max_n", 4 * numbers["thrust"] * numbers["top"] ** 2)
    put("thrust_min_n", 0.1 * mass * GRAVITY_M_S2)
    path.write_text(text)


def asked(squirrel, folder, flights):
    """What the workflow says of a folder's `plant.toml` and flights, by name and rows of `COLUMNS`; the last is held out."""
    (folder / "map.toml").write_text(MAP)
    logs = []
    for name, rows in flights:
        csv, log = folder / f"{name}.csv", folder / f"{name}.mcap"
        np.savetxt(csv, rows, delimiter=",", header=COLUMNS, comments="", fmt="%.7g")
        subprocess.run([squirrel, "import", "--map", folder / "map.toml", csv, "--out", log], check=True, capture_output=True)
        logs.append(log)
    told = folder / "gap.json"
    run = ["gap", "run", "--vehicle", folder / "plant.toml", "--flights", *logs[:-1], "--held-out", logs[-1]]
    done = subprocess.run([squirrel, *run, "--out", folder / "gap", "--json", told], capture_output=True, text=True)
    if not told.exists():
        raise RuntimeError(done.stderr)
    return json.loads(told.read_text())


def judged(verdict, right):
    """`right`: these names and no other, or none where nothing is hidden. `flagged`: no name without a doubt. Else `wrong`."""
    names = [effect["name"] for effect in verdict["effects"]]
    kind = verdict["verdict"]
    if not right:
        return "right" if kind in ("none", "not_identifiable") and not names else "wrong" if kind.startswith("named") else "flagged"
    if kind.startswith("named"):
        return "right" if names == right else "first" if names[0] in right else "wrong"
    return "missed" if kind == "none" else "flagged"


def bench(words, machines, effects, case, more=()):
    """The command line: every machine with every effect, a line each, and how many are right.

    `case(arguments, machine, effect, rng, folder)` gives a verdict. `more`: further options, with what argparse wants.
    """
    parser = argparse.ArgumentParser(description=words, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--squirrel", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=1)
    for option, wants in more:
        parser.add_argument(option, **wants)
    parser.add_argument("--machine", choices=machines, action="append")
    parser.add_argument("--effect", choices=effects, action="append")
    parser.add_argument("--keep", type=Path, help="folder for the cases")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    arguments.squirrel, results = arguments.squirrel.resolve(), []
    with tempfile.TemporaryDirectory() as temporary:
        for name in arguments.machine or machines:
            for effect in arguments.effect or effects:
                folder = Path(arguments.keep or temporary) / f"{name}-{effect.replace(' ', '-')}-{arguments.seed}"
                folder.mkdir(parents=True, exist_ok=True)
                rng = np.random.default_rng([arguments.seed, list(machines).index(name), list(effects).index(effect)])
                try:
                    verdict = case(arguments, name, effect, rng, folder)
                except Lost:
                    print(f"{name:17} {effect:23} not flown: the controller loses it", flush=True)
                    continue
                gap = verdict["gap"] or {}
                row = {"machine": name, "hidden": effect, "verdict": verdict["verdict"], "names": [e["name"] for e in verdict["effects"]]}
                row |= {"is": judged(verdict, effects[effect]), "removed": gap.get("removed_fraction")}
                results.append(row)
                removed = "" if row["removed"] is None else f"{100 * row['removed']:6.1f} %"
                print(f"{name:17} {effect:23} {row['is']:8} {row['verdict']:19} {removed:9} {', '.join(row['names'])}", flush=True)
    count = {kind: sum(row["is"] == kind for row in results) for kind in ("right", "first", "flagged", "missed", "wrong")}
    print(f"{len(results)} cases: " + ", ".join(f"{kind} {n}" for kind, n in count.items()))
    if arguments.json:
        names = [option.lstrip("-").replace("-", "_") for option, _ in more]
        given = {name: getattr(arguments, name) for name in names}
        arguments.json.write_text(json.dumps({"seed": arguments.seed, **given, "count": count, "cases": results}, indent=1) + "\n")
