"""Makes the cut-outs in this folder from the whole data sets: `python cut.py SETS`, where SETS holds nanobench, arpl-motorlag, ...

Standard library only. README.md says what is kept.
"""

import csv
import sys
from pathlib import Path

HERE = Path(__file__).parent

# Seconds from the first row: a take-off or a landing and what lies beside it.
NANOBENCH = {
    "nanobench/B2_circle_medium_rep1": (7.38, 23.38),
    "nanobench/B3_figure8_fast_rep1": (3.48, 18.48),
    "nanobench/B8_star_slow_rep1": (22.27, 38.27),
    "nanobench/B9_trefoil_slow_rep1": (3.4, 20.4),
}
# Columns and their decimals.
NANOBENCH_COLUMNS = (
    {name: 5 for name in ["px", "py", "pz", "qx", "qy", "qz", "qw", "vx", "vy", "vz"]}
    | {f"imu_{what}_{axis}": 4 for what in ["acc", "gyro"] for axis in "xyz"}
    | {f"motor_motor_m{i}": 0 for i in (1, 2, 3, 4)}
    | {f"att_stateEstimate_{name}": 5 for name in ["qx", "qy", "qz", "qw"]}
    | {"pwr_pm_vbat": 4}
)
# Seconds of the log's own clock.
ARPL = {"log10": (46.0, 51.0), "log16": (31.2, 36.2)}
ARPL_COLUMNS = (
    {"t_s": 4}
    | {f"acc.{axis}": 4 for axis in "xyz"}
    | {f"gyro.{axis}": 2 for axis in "xyz"}
    | {f"motor.m{i}": 0 for i in (1, 2, 3, 4)}
)
# Whole flights: what lasts shows in the mean of all of one.
CRAZYPAD = [
    "normal_flight__E8_log00",
    "normal_flight__E8_log01",
    "normal_flight__E8_log02",
    "normal_flight__E8_log06",
    "normal_flight__E9_log00",
    "normal_flight__E9_log03",
    "normal_flight__E9_log04",
    "cut_M3_3.5mm_3.5mm_40mm__E8_log02",
    "cut_M3_3mm__E8_log02",
    "add_weight_W1_at_M3_M4__E8_log02",
    "pair_cut_M2_3.5mm_3.0mm_40.5mm_M1_3.5mm_3.0mm_40.5mm__E9_log05",
    "pair_cut_M2_0.5mm_46.5mm_M1_0.5mm_46.5mm__E9_log02",
]


def text(number, decimals):
    """A number with so many decimals and no zeros at its end."""
    rounded = f"{float(number):.{decimals}f}"
    rounded = rounded.rstrip("0").rstrip(".") if "." in rounded else rounded
    return "0" if rounded == "-0" else rounded


def write_csv(path, header, rows):
    path.parent.mkdir(exist_ok=True)
    with open(path, "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(header)
        out.writerows(rows)


def nanobench(sets, flight, from_s, until_s):
    with open(sets / f"{flight}.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    start_s = float(rows[0]["t"])
    kept = [row for row in rows if from_s <= float(row["t"]) - start_s < until_s]
    numbers = ([text(row[name], n) for name, n in NANOBENCH_COLUMNS.items()] for row in kept)
    times = (f"{float(row['t']) - start_s:.4f}" for row in kept)
    write_csv(HERE / f"{flight}.csv", ["t", *NANOBENCH_COLUMNS], ([t, *row] for t, row in zip(times, numbers)))


def arpl(sets, flight, from_s, until_s):
    with open(sets / f"arpl-motorlag/{flight}.csv", newline="") as file:
        kept = [row for row in csv.DictReader(file) if from_s <= float(row["t_s"]) < until_s]
    rows = ([text(row[name], n) for name, n in ARPL_COLUMNS.items()] for row in kept)
    write_csv(HERE / f"arpl-motorlag/{flight}.csv", ARPL_COLUMNS, rows)


def crazypad(sets, flight):
    """As recorded."""
    path = HERE / f"crazypad-dev/{flight}.bin"
    path.parent.mkdir(exist_ok=True)
    path.write_bytes((sets / f"crazypad-dev/{flight}.bin").read_bytes())


def main():
    sets = Path(sys.argv[1])
    for flight, (from_s, until_s) in NANOBENCH.items():
        nanobench(sets, flight, from_s, until_s)
    for flight, (from_s, until_s) in ARPL.items():
        arpl(sets, flight, from_s, until_s)
    for flight in CRAZYPAD:
        crazypad(sets, flight)


if __name__ == "__main__":
    main()
