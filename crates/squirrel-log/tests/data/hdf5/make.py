"""Makes the HDF5 files of the import's tests, and what h5py reads in them.

    pip install h5py==3.16.0 && python make.py

`flight.h5` is laid out as h5py does by default, `latest.h5` as the library's latest version does (other headers, groups and
indices of chunks). `*.csv` has one number a line: column of the import, row from 1, value.
"""

import csv
from pathlib import Path

import h5py
import numpy as np

HERE = Path(__file__).parent
N = 40
t = np.arange(N) * 0.004
records = np.zeros(N, dtype=[("voltage", ">f4"), ("note", "S3"), ("cells", "<u2"), ("armed", "?")])
records["voltage"], records["cells"], records["armed"] = 16 - t, 4, t > 0.1


def fill(file):
    file["t"] = t
    file["imu/gyro"] = np.column_stack([np.sin(t), np.cos(t), t]).astype(np.float32)
    file.create_dataset("imu/packed", data=np.outer(t, [1, 2, 3]), chunks=(16, 3), compression="gzip", shuffle=True, fletcher32=True)
    file.create_dataset("imu/grows", data=t.astype(np.float16), chunks=(7,), maxshape=(None,), compression="gzip")
    file.create_dataset("imu/filled", shape=(N,), dtype=">i4", chunks=(8,), fillvalue=-7)
    file["imu/filled"][8:20] = np.arange(12)
    file["big"] = (np.arange(N) + 2**53 - 3).astype(">u8")
    file["armed"] = t > 0.05
    file["battery"] = records
    file["wide"] = np.arange(3 * N).reshape(3, N).astype("<i2")
    # Refused when asked for: packed by a filter of h5py alone, and a column that would take 8 GB.
    file.create_dataset("lzf", data=t, compression="lzf")
    file.create_dataset("endless", shape=(10**9,), chunks=(1000,), dtype="f8")
    # No columns: text, lists of different lengths, an image a row, an attribute, a link that leads nowhere, and one in a circle.
    file["names"] = [f"row {i}" for i in range(N)]
    lists = file.create_dataset("lists", (N,), dtype=h5py.vlen_dtype(np.int32))
    lists[0] = [1, 2, 3]
    file["images"] = np.zeros((N, 2, 2), np.uint8)
    file["t"].attrs["unit"] = "s"
    file["imu/lost"] = h5py.SoftLink("/nowhere")
    file["imu/elsewhere"] = h5py.ExternalLink("other.h5", "/t")
    file["imu/round"] = file["/"]


def columns(item, path):
    if isinstance(item, h5py.Group):
        for name in item:
            if name not in ("round", "lost", "elsewhere", "lzf", "endless"):
                yield from columns(item[name], f"{path}.{name}" if path else name)
        return
    values = item[()]
    if values.dtype.names:
        for name in values.dtype.names:
            if values[name].dtype.kind in "iufb":
                yield f"{path}.{name}", values[name]
    elif values.dtype.kind in "iufb" and values.ndim == 1:
        yield path, values
    elif values.dtype.kind in "iufb" and values.ndim == 2:
        for i, column in enumerate(values.T if values.shape[0] > values.shape[1] else values):
            yield f"{path}[{i}]", column


for name, libver in [("flight", "earliest"), ("latest", "latest")]:
    with h5py.File(HERE / f"{name}.h5", "w", libver=libver) as file:
        fill(file)
    with h5py.File(HERE / f"{name}.h5") as file, open(HERE / f"{name}.csv", "w", newline="") as out:
        writer = csv.writer(out, lineterminator="\n")
        for column, numbers in columns(file, ""):
            for row, number in enumerate(numbers, 1):
                writer.writerow([column, row, repr(float(number)) if numbers.dtype.kind == "f" else int(number)])
    print(name, (HERE / f"{name}.h5").stat().st_size, "bytes", sum(1 for _ in open(HERE / f"{name}.csv")), "numbers")
