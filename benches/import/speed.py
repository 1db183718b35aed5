#!/usr/bin/env python3
"""How fast logs are read by `squirrel import` beside pyulog, pymavlink and rosbags, in one run on one core.

    cargo build --release -p squirrel-cli
    cargo build --release -p squirrel-log --example read_speed
    pip install pyulog==1.3.0 pymavlink==2.4.50 rosbags==0.11.0 mcap==1.6.0
    taskset -c 0 python3 benches/import/speed.py target/release --ulog sample.ulg --usd E8_log00.bin --blackbox sitl.bbl

Makes a large log of each kind: of a ULog and of a micro-SD log the same messages again and again at later times, a dataflash log by
`crates/squirrel-log/tests/data/ardupilot/write.py`, a bag by `rosbags_row.py`. A blackbox log has differences in it and is read as it
is: give a long one (`fly_sitl.py` flies as long as it is told). All times are CPU time of the process, the best of three. `read` is the
import in memory (`read_speed`), `import` the whole command with the flight log written, which is mostly packing.
"""

import argparse
import importlib.util
import resource
import struct
import subprocess
import sys
import tempfile
import time
import zlib
from pathlib import Path

from mcap.writer import CompressionType

ROOT = Path(__file__).resolve().parents[2]
CRAZYPAD = ROOT / "vehicles/maps/crazypad.toml"


def module(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def long_ulog(source, size):
    """Its definitions once, its messages until the size is reached; the time stands first in each."""
    data, at, head, rows = source.read_bytes(), 16, bytearray(source.read_bytes()[:16]), []
    while at + 3 <= len(data):
        length, kind = struct.unpack_from("<HB", data, at)
        record = data[at : at + 3 + length]
        if len(record) < 3 + length:
            break
        if kind == ord("D"):
            rows.append((record[:5], struct.unpack_from("<Q", record, 5)[0], record[13:]))
        elif kind not in (ord("B"), ord("S")):
            head += record
        at += 3 + length
    times = [t for _, t, _ in rows]
    span, out, shift = max(times) - min(t for t in times if t) + 20_000, [bytes(head)], 0
    written = len(head)
    while written < size:
        for start, t, rest in rows:
            out.append(start + struct.pack("<Q", t + shift) + rest)
        written += sum(len(rest) + 13 for _, _, rest in rows)
        shift += span
    return b"".join(out)


def long_usd(source, size):
    """Version 1 (u32, ms) or 2 (u64, us): the id of an event, its time, its numbers."""
    data = source.read_bytes()
    version, count = struct.unpack_from("<HH", data, 1)
    clock, at, sizes = "<I" if version == 1 else "<Q", 5, {}
    sizes_of = {"b": 1, "B": 1, "h": 2, "H": 2, "e": 2, "i": 4, "I": 4, "f": 4, "q": 8, "Q": 8, "d": 8}

    def name(at):
        end = data.index(0, at)
        return data[at:end].decode(), end + 1

    for _ in range(count):
        (event,) = struct.unpack_from("<H", data, at)
        _, at = name(at + 2)
        (variables,) = struct.unpack_from("<H", data, at)
        at, total = at + 2, 2 + struct.calcsize(clock)
        for _ in range(variables):
            variable, at = name(at)
            total += sizes_of[variable[-2]]
        sizes[event] = total
    head, rows = data[:at], []
    while at < len(data) - 4:
        (event,) = struct.unpack_from("<H", data, at)
        (t,) = struct.unpack_from(clock, data, at + 2)
        rows.append((data[at : at + 2], t, data[at + 2 + struct.calcsize(clock) : at + sizes[event]]))
        at += sizes[event]
    span = max(t for _, t, _ in rows) - min(t for _, t, _ in rows) + (10 if version == 1 else 10_000)
    repeats = size // (len(data) - len(head)) + 1
    out = [head] + [event + struct.pack(clock, t + k * span) + rest for k in range(repeats) for event, t, rest in rows]
    body = b"".join(out)
    return body + struct.pack("<I", zlib.crc32(body))


def dataflash(size):
    """A second of the made-up flight after another, at the rates of a fast log: its messages in turn at later times."""
    writer = module(ROOT / "crates/squirrel-log/tests/data/ardupilot/write.py")
    flight = writer.flight()
    lengths = {kind: 3 + struct.calcsize("<" + "".join(writer.LETTERS[c] for c in letters)) for kind, _, letters, *_ in writer.KINDS}
    lengths[0x80], at, rows, head = 89, 0, [], bytearray()
    while at < len(flight):
        length = lengths[flight[at + 2]]
        record = flight[at : at + length]
        if flight[at + 2] == 0x80 or struct.unpack_from("<Q", record, 3)[0] < 2_000_000:
            head += record
        else:
            rows.append((record[:3], struct.unpack_from("<Q", record, 3)[0], record[11:]))
        at += length
    out, written, shift = [bytes(head)], len(head), 0
    while written < size:
        out += [start + struct.pack("<Q", t + shift) + rest for start, t, rest in rows]
        written += sum(11 + len(rest) for _, _, rest in rows)
        shift += 1_000_000
    return b"".join(out)


def of_pyulog(path):
    from pyulog import ULog

    ULog(str(path))


def of_pymavlink(path):
    from pymavlink import DFReader

    log = DFReader.DFReader_binary(str(path), zero_time_base=True)
    while log.recv_msg() is not None:
        pass


def cpu_s(call):
    """Of this process and of those that it starts."""
    spent = lambda: sum(u.ru_utime + u.ru_stime for u in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))
    before = spent()
    call()
    return spent() - before


def row(built, kind, path, bar, other, extra=()):
    out, mb = path.with_suffix(".out.mcap"), path.stat().st_size / 1e6
    map_ = [argument for argument in extra if str(argument).endswith(".toml")]
    best = lambda command: min(cpu_s(lambda: subprocess.run(command, check=True, capture_output=True)) for _ in range(3))
    read_s = best([built / "examples/read_speed", path, *map_])
    import_s = best([built / "squirrel", "import", *extra, path, "--out", out])
    text = f"{kind:14} {mb:6.1f} MB   read {mb / read_s:7.1f} MB/s (bar {bar})   import {mb / import_s:7.1f} MB/s"
    if other:
        name, call = other
        other_s = cpu_s(lambda: call(path))
        text += f"   {name} {mb / other_s:6.2f} MB/s: {other_s / read_s:.0f} and {other_s / import_s:.0f} times"
    print(text, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("built", type=Path, help="the folder of what was built, target/release")
    parser.add_argument("--ulog", type=Path, required=True)
    parser.add_argument("--usd", type=Path, required=True)
    parser.add_argument("--blackbox", type=Path, required=True)
    parser.add_argument("--mb", type=int, default=60)
    given = parser.parse_args()
    built, size = given.built.resolve(), given.mb * 1_000_000
    rosbags = module(Path(__file__).with_name("rosbags_row.py"))
    with tempfile.TemporaryDirectory() as folder:
        path = lambda name: Path(folder, name)
        path("px4.ulg").write_bytes(long_ulog(given.ulog, size))
        row(built, "ULog", path("px4.ulg"), 100, ("pyulog", of_pyulog))
        path("ardupilot.bin").write_bytes(dataflash(size))
        row(built, "dataflash", path("ardupilot.bin"), 100, ("pymavlink", of_pymavlink))
        path("usd.bin").write_bytes(long_usd(given.usd, size))
        row(built, "micro-SD", path("usd.bin"), 100, None, ["--map", CRAZYPAD])
        rosbags.write(path("bag.mcap"), given.mb * 10, CompressionType.NONE)
        row(built, "MCAP, CDR", path("bag.mcap"), 100, ("rosbags", rosbags.by_rosbags))
        path("betaflight.bbl").write_bytes(given.blackbox.read_bytes())
        row(built, "blackbox", path("betaflight.bbl"), 30, None)


if __name__ == "__main__":
    sys.exit(main())
