"""squirrel, PySINDy and mujoco.sysid on the same cases: held-out error, names, claims where nothing is hidden, processor time.

    python compare.py run SQUIRREL FOLDER... --out results.jsonl [--minutes 60]
    python compare.py nanobench SQUIRREL VEHICLE LOGS --out results.jsonl
    python compare.py table results.jsonl

FOLDER is what `hidden-effects make` wrote. `run` takes the folders in turns, so that it can be cut short, and goes on where it
was cut.
"""

import argparse
import json
import os
import random
import sys
import tempfile
import time
from collections.abc import Callable
from math import sqrt
from pathlib import Path

# One thread for each tool; NumPy reads it when it is loaded.
os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import numpy as np

import mujoco_sysid
import ours
import physics
import sindy
from flight import Piece, errors, read_flight, read_vehicle, total

SURE = ("named", "named_form_differs", "named_incomplete", "ambiguous")
RIVALS = ("mujoco", "sindy polynomial", "sindy catalogue")
TOOLS = ("squirrel", "squirrel, names alone", *RIVALS)


def squirrel(program: Path, vehicle: Path, train: list[Path], held_out: Path, pieces: list[Piece]) -> dict[str, dict]:
    """The patched vehicle file as it is handed over, and the vehicle file with the named effects and nothing else."""
    verdict, patch, cpu_s = ours.solve(program, vehicle, train)
    with tempfile.TemporaryDirectory() as name:
        file = Path(name) / "vehicle.toml"
        file.write_text(patch or vehicle.read_text())
        patched = read_vehicle(file)
        checked = ours.found(program, file, held_out, Path(name), pieces)
    sizes = ours.sizes_of(patched.get("effects", {}))
    channels = errors(pieces, [physics.predict(piece, patched, sizes) for piece in pieces])
    if patch and any(line.startswith("form = ") for line in patch.splitlines()):
        # A form that physics.py does not have.
        channels = checked
    named = ours.named_of(verdict) if verdict["verdict"].startswith("named") else {}
    alone = errors(pieces, [physics.predict(piece, read_vehicle(vehicle), named) for piece in pieces])
    names = [effect["name"] for effect in verdict["effects"]] if verdict["verdict"] in SURE else []
    said = {"names": names, "claims": len(names), "cpu_s": cpu_s, "verdict": verdict["verdict"], "patch": bool(patch)}
    return {
        "squirrel": {**said, "channels": channels.tolist(), "gap_find": checked.tolist()},
        "squirrel, names alone": {**said, "channels": alone.tolist()},
    }


def timed(fit: Callable[[], object], pieces: list[Piece]) -> dict:
    """A rival's fit, without the time that reading the logs takes, and what it predicts."""
    start = time.process_time()
    fitted = fit()
    cpu_s = time.process_time() - start
    claims, names = fitted.claims()
    channels = errors(pieces, [fitted.predict(piece) for piece in pieces])
    return {"names": names, "claims": claims, "cpu_s": cpu_s, "channels": channels.tolist()}


def case(program: Path, vehicle: Path, train: list[Path], held_out: Path) -> dict[str, dict]:
    """All tools on one case."""
    p, sd = read_vehicle(vehicle), read_vehicle(vehicle, "sd")
    pieces = read_flight(held_out)
    nominal = errors(pieces, [physics.predict(piece, p) for piece in pieces])
    out = {"nominal": {"channels": nominal.tolist()}}
    out.update(squirrel(program, vehicle, train, held_out, pieces))
    flights = [piece for path in train for piece in read_flight(path)]
    out["sindy polynomial"] = timed(lambda: sindy.Fit(sindy.Polynomial, p, flights), pieces)
    for piece in flights:
        # No tool profits from what another has worked out.
        for name in ("taps", "R", "alpha", "measured", "noise"):
            piece.__dict__.pop(name, None)
    out["sindy catalogue"] = timed(lambda: sindy.Fit(sindy.Catalogue, p, flights), pieces)
    out["mujoco"] = timed(lambda: mujoco_sysid.Fit(p, sd, flights), pieces)
    return out


def answers(folders: list[Path]) -> list[tuple[Path, dict]]:
    """Cases with what they hide, the sets spread evenly over the list."""
    spread = []
    for folder in folders:
        files = sorted((folder / "answers").glob("*.json"))
        if not files:
            sys.exit(f"{folder}: no answers; make them with `hidden-effects make`")
        random.Random(1).shuffle(files)
        for i, file in enumerate(files):
            spread.append(((i + 0.5) / len(files), folder / "cases" / file.stem, json.loads(file.read_text())))
    return [(path, answer) for _, path, answer in sorted(spread, key=lambda x: (x[0], str(x[1])))]


def nanobench(logs: list[Path]) -> list[tuple[str, list[Path], Path]]:
    """Each flight alone and twenty triples drawn at random, another flight held out."""
    draw = random.Random(1)
    alone = [(f"nano-{log.stem}", [log], logs[(i + 1) % len(logs)]) for i, log in enumerate(logs)]
    triples = []
    for number in range(20):
        *train, held_out = draw.sample(logs, 4)
        triples.append((f"nano3-{number:02}", train, held_out))
    return alone + triples


def run(jobs: list[tuple[str, dict, Path, list[Path], Path]], program: Path, out: Path, minutes: float) -> None:
    """One line of JSON a case."""
    out.parent.mkdir(parents=True, exist_ok=True)
    done = {json.loads(line)["case"] for line in out.read_text().splitlines()} if out.exists() else set()
    start = time.monotonic()
    for name, answer, vehicle, train, held_out in jobs:
        if name in done:
            continue
        if time.monotonic() - start > 60 * minutes:
            break
        try:
            tools = case(program, vehicle, train, held_out)
        except (RuntimeError, ValueError, np.linalg.LinAlgError) as error:
            print(f"{name}: {error}", file=sys.stderr)
            continue
        with open(out, "a") as file:
            file.write(json.dumps({"case": name, **answer, "tools": tools}) + "\n")
        figures = "  ".join(f"{tool} {total(np.array(tools[tool]['channels'])):.2f}" for tool in ("nominal", *TOOLS))
        print(f"{name} {answer['set']}: {figures}", flush=True)


def wilson(right: int, n: int) -> str:
    """Share in percent with its 95 % interval."""
    if n == 0:
        return "-"
    z, p = 1.96, right / n
    middle, half = p + z * z / (2 * n), z * sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    low, high = ((middle + sign * half) / (1 + z * z / n) for sign in (-1, 1))
    return f"{100 * p:.0f} ({100 * max(low, 0.0):.0f} to {100 * high:.0f})"


def median(values: list[float]) -> str:
    """With a 95 % interval by order statistics."""
    x, n = np.sort(values), len(values)
    half = 0.98 * sqrt(n)
    low, high = x[max(int(n / 2 - half), 0)], x[min(int(n / 2 + half), n - 1)]
    return f"{np.median(x):.3g} ({low:.3g} to {high:.3g})"


SETS = ("single", "two", "none", "nanobench", "nanobench, three")
PARTS = {"all": slice(0, 6), "force": slice(0, 3), "moment": slice(3, 6)}


def error(line: dict, tool: str, part: str = "all") -> float:
    """`E` of a tool on a case."""
    return total(np.array(line["tools"][tool]["channels"])[PARTS[part]])


def row(cases: list[dict], tool: str) -> str:
    """A tool's line of the table."""
    n = len(cases)
    said = [(c["tools"][tool], {h["name"] for h in c["effects"]}) for c in cases]
    ratios = [[error(c, tool, part) / error(c, "nominal", part) for c in cases] for part in PARTS]
    first = sum(bool(t["names"]) and t["names"][0] in hidden for t, hidden in said)
    wrong = sum(bool(set(t["names"]) - hidden) or (not hidden and t["claims"] > 0) for t, hidden in said)
    silent = sum(t["claims"] == 0 for t, _ in said)
    # Products of inputs are not names.
    names = [wilson(first, n), wilson(wrong, n)] if tool != "sindy polynomial" else ["", ""]
    cells = [*(median(r) for r in ratios), *names, wilson(silent, n), f"{np.median([t['cpu_s'] for t, _ in said]):.2f}"]
    return f"| {tool} | {' | '.join(cells)} |"


def table(lines: list[dict]) -> None:
    """The tables of the README."""
    for group in (*SETS, "all of the bench"):
        cases = [c for c in lines if c["set"] == group or (group not in SETS and not c["set"].startswith("nano"))]
        if not cases:
            continue
        print(f"\n{group}, {len(cases)} cases\n")
        if group in SETS:
            print(
                "| | error over nominal | of force | of moment | first name right % | wrong name % | claims nothing % | CPU s |"
            )
            print("|---|---|---|---|---|---|---|---|")
            print("\n".join(row(cases, tool) for tool in TOOLS))
        print("\n| lower error than, % of cases | " + " | ".join((*RIVALS, "all three")) + " |\n|---|---|---|---|---|")
        for us in TOOLS[:2]:
            for part in PARTS:
                wins = [sum(error(c, us, part) < error(c, r, part) for c in cases) for r in RIVALS]
                wins.append(sum(error(c, us, part) < min(error(c, r, part) for r in RIVALS) for c in cases))
                print(f"| {us}, {part} | {' | '.join(wilson(w, len(cases)) for w in wins)} |")
    checks = [
        total(np.array(c["tools"]["squirrel"]["gap_find"])) / error(c, "squirrel")
        for c in lines
        if "gap_find" in c["tools"]["squirrel"]
    ]
    print(f"\n`gap find` over physics.py, patched vehicle: {median(checks)}, {min(checks):.2f} to {max(checks):.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    bench = commands.add_parser("run")
    bench.add_argument("squirrel", type=Path)
    bench.add_argument("folders", type=Path, nargs="+")
    nano = commands.add_parser("nanobench")
    nano.add_argument("squirrel", type=Path)
    nano.add_argument("vehicle", type=Path)
    nano.add_argument("logs", type=Path)
    for command in (bench, nano):
        command.add_argument("--out", type=Path, required=True)
        command.add_argument("--minutes", type=float, default=1e6)
    commands.add_parser("table").add_argument("results", type=Path, nargs="+")
    o = parser.parse_args()
    if o.command == "table":
        table([json.loads(line) for path in o.results for line in path.read_text().splitlines()])
    elif o.command == "run":
        jobs = [
            (path.name, {"set": answer["set"], "effects": answer["effects"]}, path / "vehicle.toml")
            + (sorted((path / "train").glob("*.mcap")), path / "held-out" / "flight00.mcap")
            for path, answer in answers(o.folders)
        ]
        run(jobs, o.squirrel, o.out, o.minutes)
    else:
        hidden = [{"name": "battery_sag"}]
        jobs = [
            (name, {"set": "nanobench" if len(train) == 1 else "nanobench, three", "effects": hidden}, o.vehicle, train, held_out)
            for name, train, held_out in nanobench(sorted(o.logs.glob("*.mcap")))
        ]
        run(jobs, o.squirrel, o.out, o.minutes)


if __name__ == "__main__":
    main()
