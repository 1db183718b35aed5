"""Sparse regression (ensemble SINDy) on the cases of the blind bench, beside the verdicts of squirrel on the same cases.

    cargo xtask gap-bench --set single --cases 58 --seed 1 --keep /tmp/single
    cargo xtask gap-bench --set none --cases 60 --seed 1 --keep /tmp/none
    python compare.py /tmp/single /tmp/none [--json FILE]

Every choice is in favour of SINDy: its library is the catalogue itself, with numbers in front that are the smallest sizes worth
reporting; the threshold, its unit and the share of the ensemble that must agree are those with the most right first names
among all that keep false alarms on these same cases at 1 % or less.
"""

import argparse
import json
import sys
import warnings
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from math import sqrt
from pathlib import Path

import numpy as np
import pysindy

from regressors import CATALOGUE, Flight, read_vehicle

EFFECTS = [effect for effect, _, _ in CATALOGUE]
BLOCKS = 12  # of a flight; the ensemble draws among them
MODELS = 20
SHARE = 0.6  # of the blocks in one member
ROWS = 17_000  # of two flights of 40 s, for the size of a column
THRESHOLDS = {"size": np.geomspace(0.1, 6.0, 10), "noise": np.geomspace(0.03, 2.0, 10)}
UNITS = {"size": "reportable sizes", "noise": "normalised"}
INCLUSIONS = [0.5, 0.8, 1.0]
FALSE_ALARMS_MAX = 0.01


def blocks(case):
    """The regression of a case in blocks, each rotated to as many rows as there are columns: same squares, less work."""
    vehicle = read_vehicle(case / "vehicle.toml")
    out = []
    for path in sorted((case / "train").glob("*.mcap")):
        y, X, at = Flight(path, vehicle).rows()
        for block in range(BLOCKS):
            inside = np.minimum((at * BLOCKS).astype(int), BLOCKS - 1) == block
            out.append(np.linalg.qr(np.column_stack([X[inside], y[inside]]), mode="r"))
    return out


def draws(parts):
    """The data of each member of the ensemble, compressed again, and the root mean square of each column."""
    draw = np.random.default_rng(1)
    count = round(SHARE * len(parts))
    chosen = [draw.choice(len(parts), count, replace=False) for _ in range(MODELS)]
    data = [np.linalg.qr(np.concatenate([parts[i] for i in c]), mode="r") for c in chosen]
    rms = np.sqrt((np.concatenate(parts)[:, :-1] ** 2).sum(0) / ROWS)
    return data, np.where(rms > 0, rms, 1.0)


def ensemble(data, rms, threshold, unit):
    """Coefficients of the members, one a row, in units of noise."""
    scale = rms if unit == "noise" else np.ones_like(rms)
    members = []
    for rows in data:
        sindy = pysindy.STLSQ(threshold=threshold, alpha=0.05)
        sindy.fit(rows[:, :-1] / scale, rows[:, -1:])
        members.append(sindy.coef_[0] / scale * rms)
    return np.array(members)


def names(members, inclusion):
    """Effects of the ensemble, the largest first: by the size of the median coefficient in units of noise."""
    kept = (members != 0).mean(0) >= inclusion
    median = np.where(kept, np.median(members, axis=0), 0.0)
    weight = {}
    for effect, x in zip(EFFECTS, median):
        if x != 0:
            weight[effect] = weight.get(effect, 0.0) + x * x
    return sorted(weight, key=lambda effect: -weight[effect])


def solve(case):
    """What SINDy says at every setting."""
    # A threshold that leaves nothing is an answer here.
    warnings.filterwarnings("ignore", message="Sparsity parameter is too big")
    data, rms = draws(blocks(case))
    said = {}
    for unit, thresholds in THRESHOLDS.items():
        for threshold in thresholds:
            members = ensemble(data, rms, float(threshold), unit)
            for inclusion in INCLUSIONS:
                said[unit, float(threshold), inclusion] = names(members, inclusion)
    return said


def cases(folder):
    """Of each case its folder, the hidden names, and squirrel's verdict."""
    out = []
    for answer in sorted((folder / "answers").glob("*.json")):
        hidden = {effect["name"] for effect in json.loads(answer.read_text())["effects"]}
        verdict = folder / "results" / answer.stem / "verdict.json"
        verdict = json.loads(verdict.read_text()) if verdict.exists() else {"verdict": "failed", "effects": []}
        out.append((folder / "cases" / answer.stem, hidden, verdict))
    return out


def wilson(right, n):
    """Share in percent with its 95 % interval."""
    z, p = 1.96, right / n
    middle, half = p + z * z / (2 * n), z * sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    low, high = ((middle + sign * half) / (1 + z * z / n) for sign in (-1, 1))
    return f"{100 * p:5.1f} ({100 * max(low, 0.0):.1f} to {100 * high:.1f})"


def squirrel_first(hidden, verdict):
    sure = verdict["verdict"] in ("named", "named_form_differs", "ambiguous")
    return sure and bool(verdict["effects"]) and verdict["effects"][0]["name"] in hidden


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("single", type=Path, help="folder of cases that hide one effect")
    parser.add_argument("none", type=Path, help="folder of cases that hide nothing")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--jobs", type=int, default=1)
    arguments = parser.parse_args()
    single, none = cases(arguments.single), cases(arguments.none)
    if not single or not none:
        sys.exit(f"{arguments.single}, {arguments.none}: no answers; make them with `cargo xtask gap-bench --keep`")
    with ProcessPoolExecutor(arguments.jobs) as pool:
        said = list(pool.map(solve, [case for case, _, _ in single + none]))

    def figures(setting):
        right = sum(bool(s[setting]) and s[setting][0] in hidden for s, (_, hidden, _) in zip(said, single))
        alarms = sum(bool(s[setting]) for s in said[len(single) :])
        return right, alarms

    ours = (
        sum(squirrel_first(hidden, verdict) for _, hidden, verdict in single),
        sum(verdict["verdict"] != "none" for _, _, verdict in none),
    )
    lines = [("squirrel", ours, "")]
    for unit, thresholds in THRESHOLDS.items():
        settings = [(unit, float(threshold), inclusion) for threshold, inclusion in product(thresholds, INCLUSIONS)]
        quiet = [s for s in settings if figures(s)[1] <= FALSE_ALARMS_MAX * len(none)]
        for name, among in (("at most 1 % false alarms", quiet), ("any false alarms", settings)):
            if among:
                best = max(among, key=lambda s: figures(s)[0])
                note = f"threshold {best[1]:.3g}, kept by {100 * best[2]:.0f} %"
                lines.append((f"SINDy, {UNITS[unit]}, {name}", figures(best), note))
    print(f"{len(single)} cases with one effect, {len(none)} with none; pysindy {pysindy.__version__}\n")
    print(f"{'':52} {'first name right %':>22} {'false alarms %':>22}")
    for name, (right, alarms), note in lines:
        print(f"{name:52} {wilson(right, len(single)):>22} {wilson(alarms, len(none)):>22}  {note}")
    if arguments.json:
        rows = [
            {"who": name, "first_right": right, "false_alarms": alarms, "setting": note}
            for name, (right, alarms), note in lines
        ]
        result = {"single": len(single), "none": len(none), "rows": rows}
        arguments.json.write_text(json.dumps(result, indent=2) + "\n")


if __name__ == "__main__":
    main()
