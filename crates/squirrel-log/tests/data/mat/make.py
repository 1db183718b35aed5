"""Makes the MAT-files of the import's tests, and what scipy reads in them.

    pip install scipy==1.17.1 && python make.py

`*.csv` has one number a line: column of the import, row from 1, value. `big_endian.mat` has the bytes of `plain.mat` in the
other order, swapped here by the rules of the format, for scipy writes one order alone and reads both.
"""

import csv
import struct
from pathlib import Path

import numpy as np
from scipy.io import loadmat, savemat

HERE = Path(__file__).parent
N = 7
t = np.arange(N) * 0.004
flight = {
    "t": t.reshape(-1, 1),
    "gyro": np.column_stack([0.1 * np.arange(N), np.full(N, -0.2), np.linspace(0, 1, N)]),
    "across": np.vstack([t, -t]).astype(np.float32),
    "counts": np.arange(N, dtype=np.int16) - 3,
    "big": np.arange(N, dtype=np.uint64) + 2**53 - 3,
    "armed": np.arange(N) > 2,
    "mass": 0.548,
    "cube": np.zeros((3, 1, N)) + np.arange(N),
    "solid": np.zeros((2, 2, N)),
    "note": "text",
    "cells": np.array([1, "a"], dtype=object),
    "wave": np.exp(1j * t),
    "log": {
        "battery": {"voltage": 16.0 - t, "missing": np.array([1.0, np.nan] * 4)[:N]},
        "esc": np.array([(1000.0 + t, 1), (2000.0 + t, 2)], dtype=[("rpm", object), ("id", object)]),
        "empty": np.zeros((0, 0)),
    },
    "slow": {"t": np.array([0.0, 0.01, 0.02]), "x": np.array([[1, 2], [3, 4], [5, 6]], dtype=np.uint8)},
}


def swapped(data):
    """The bytes of an unpacked file in the other byte order."""
    width = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}

    def elements(at, end):
        out = b""
        while at < end:
            (first,) = struct.unpack_from("<I", data, at)
            if first >> 16:
                kind, size = first & 0xFFFF, first >> 16
                body = swap(data[at + 4 : at + 4 + size], width[kind])
                out += struct.pack(">I", first) + body.ljust(4, b"\0")
                at += 8
            else:
                (size,) = struct.unpack_from("<I", data, at + 4)
                start = at + 8
                body = elements(start, start + size) if first == 14 else swap(data[start : start + size], width[first])
                padded = -(-size // 8) * 8
                out += struct.pack(">II", first, size) + body.ljust(padded, b"\0")
                at = start + padded
        return out

    def swap(body, size):
        return b"".join(body[i : i + size][::-1] for i in range(0, len(body), size))

    return data[:124] + bytes([1, 0]) + b"MI" + elements(128, len(data))


def leaves(value, path):
    """Columns of the import: the longer of two sizes is time."""
    if isinstance(value, np.ndarray) and value.dtype.names:
        flat = value.ravel(order="F")
        for i, one in enumerate(flat):
            index = "" if len(flat) == 1 else f"[{i}]"
            for name in value.dtype.names:
                yield from leaves(one[name], f"{path}{index}.{name}")
    elif isinstance(value, np.ndarray) and value.dtype.kind in "iufb":
        value = np.squeeze(value)
        if value.size and value.ndim <= 1:
            yield path, value.ravel()
        elif value.size and value.ndim == 2:
            for i, column in enumerate(value.T if value.shape[0] >= value.shape[1] else value):
                yield f"{path}[{i}]", column


savemat(HERE / "plain.mat", flight)
savemat(HERE / "packed.mat", flight, do_compression=True)
(HERE / "big_endian.mat").write_bytes(swapped((HERE / "plain.mat").read_bytes()))
for name in ["plain", "packed", "big_endian"]:
    with open(HERE / f"{name}.csv", "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        for variable, value in loadmat(HERE / f"{name}.mat").items():
            if not variable.startswith("__"):
                for column, numbers in leaves(value, variable):
                    for row, number in enumerate(numbers, 1):
                        integer = np.issubdtype(number.dtype, np.integer) or number.dtype == bool
                        writer.writerow([column, row, int(number) if integer else repr(float(number))])
    print(name, sum(1 for _ in open(HERE / f"{name}.csv")), "numbers")
