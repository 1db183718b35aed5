#!/usr/bin/env python3
"""Every field of every topic of ULog files, sample for sample, as `pyulog` reads it and as `squirrel import` does.

    cargo build --release -p squirrel-cli
    pip install pyulog==1.3.0 mcap-protobuf-support==0.6.0
    python3 benches/import/ulog_fields.py target/release/squirrel FILE.ulg...

A map takes all numbers of one instance of one topic; the flight log that comes out is read back and held against pyulog's
arrays, bit for bit: a double holds every type of ULog but integers beyond 2^53, which would be told. NaN counts as NaN, whatever
its bits. Padding is no field. What makes no flight log is left out and told: fields that are infinite, and topics whose time
repeats or runs backwards. Then the file is imported without a map, and the channels that need no turn and no scale are compared.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from mcap_protobuf.reader import read_protobuf_messages
from pyulog import ULog


def imported(squirrel, path, topic, instance, names, folder):
    """The columns as an array, or the line that says why not."""
    quoted = ", ".join(f'"{name}"' for name in names)
    map_, out = Path(folder, "map.toml"), Path(folder, "out.mcap")
    map_.write_text(
        f'[[source]]\ntopic = "{topic}"\ninstance = {instance}\ntime = {{ column = "timestamp", unit = "us" }}\n'
        f'channels = {{ "truth.all" = {{ columns = [{quoted}] }} }}\n'
    )
    done = subprocess.run([squirrel, "import", "--map", map_, path, "--out", out], capture_output=True, text=True)
    if done.returncode != 0:
        return None, done.stderr.strip()
    rows = [message.proto_msg.all for message in read_protobuf_messages(str(out), topics=["truth"])]
    rows = [row if hasattr(row, "__len__") else [row] for row in rows]
    return np.array([list(row) for row in rows], dtype=np.float64), ""


def differ(read, expected):
    """For each column how many numbers differ; all, if there are not as many."""
    if read.shape != expected.shape:
        return np.full(expected.shape[1], len(expected))
    bits = lambda x: x.view(np.uint64)
    plus_zero = expected + 0.0  # one zero
    same = (bits(read) == bits(plus_zero)) | (bits(read) == bits(expected)) | (np.isnan(read) & np.isnan(expected))
    return np.count_nonzero(~same, axis=0)


# Channels of an import without a map that are the fields as they are.
PLAIN = ["imu.omega_body_rad_s", "imu.specific_force_body_m_s2", "battery.voltage_v", "battery.current_a", "baro.altitude_m"]


def without_map(squirrel, path, log):
    """How many numbers of the plain channels are compared, and the names of those that are not the same."""
    with tempfile.TemporaryDirectory() as folder:
        out, told = Path(folder, "out.mcap"), Path(folder, "told.json")
        subprocess.run([squirrel, "import", path, "--out", out, "--json", told], check=True, capture_output=True)
        messages = list(read_protobuf_messages(str(out)))
        told = {channel["channel"]: channel["columns"] for channel in json.loads(told.read_text())["channels"]}
    fields = {f"{data.name}.{name}": data.data[name] for data in log.data_list if data.multi_id == 0 for name in data.data}
    compared, wrong = 0, []
    for channel in (channel for channel in PLAIN if channel in told):
        source, field = channel.split(".")
        expected = np.column_stack([fields[name].astype(np.float64) for name in told[channel]])
        rows = [getattr(m.proto_msg, field) for m in messages if m.topic == source]
        read = np.array([list(row) if hasattr(row, "__len__") else [row] for row in rows], dtype=np.float64)
        # Channels that share an axis are NaN where only the other has a sample.
        read = read[~np.isnan(read).any(axis=1)]
        compared += expected.size
        if differ(read, expected).any():
            wrong.append(channel)
    return compared, wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("squirrel", type=Path)
    parser.add_argument("files", type=Path, nargs="+")
    arguments = parser.parse_args()
    squirrel, bad = arguments.squirrel.resolve(), 0
    for path in arguments.files:
        topics = fields = samples = 0
        log = ULog(str(path))
        for data in log.data_list:
            where = f"{path.name}: {data.name} {data.multi_id}"
            columns = {name: np.asarray(column).astype(np.float64) for name, column in data.data.items()}
            infinite = [name for name, column in columns.items() if np.isinf(column).any()]
            if infinite:
                print(f"{where}: left out, infinite: {', '.join(infinite)}")
            names = [name for name in columns if "_padding" not in name and name not in infinite]
            for name in names:
                if data.data[name].dtype.kind in "iu" and np.abs(columns[name]).max() > 2.0**53:
                    print(f"{where}.{name}: beyond 2^53")
            if not np.all(np.diff(columns["timestamp"]) > 0):
                print(f"{where}: left out, its time repeats or runs backwards: {len(names)} fields")
                continue
            expected = np.column_stack([columns[name] for name in names])
            with tempfile.TemporaryDirectory() as folder:
                read, why = imported(squirrel, path, data.name, data.multi_id, names, folder)
            if read is None:
                bad += 1
                print(f"{where}: not imported: {why}")
                continue
            topics, fields, samples = topics + 1, fields + len(names), samples + expected.size
            for name, count in zip(names, differ(read, expected)):
                if count:
                    bad += 1
                    print(f"{where}.{name}: {count} of {len(expected)} samples differ")
        print(f"{path.name}: {topics} topics, {fields} fields, {samples} numbers compared")
        compared, wrong = without_map(squirrel, path, log)
        bad += len(wrong)
        print(f"{path.name} without a map: {compared} numbers compared{''.join(f', {name} DIFFERS' for name in wrong)}")
    print("all are the same" if bad == 0 else f"{bad} are not the same")
    return 0 if bad == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
