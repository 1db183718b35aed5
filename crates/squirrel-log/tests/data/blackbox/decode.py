#!/usr/bin/env python3
"""A second decoder of blackbox logs, written from Betaflight's "Blackbox Internals" and with none of the crate's code. Run by hand.

    python3 decode.py sitl.bbl > sitl.decoded.csv

For each column of the main frames: how many there are, the CRC-32 of its numbers as little-endian i64, the first and the last. The test of the
import compares all of them. It reads what the log beside it holds: frames without damage.
"""

import struct
import sys
import zlib


class Bytes:
    def __init__(self, data: bytes, at: int) -> None:
        self.data, self.at = data, at

    def byte(self) -> int:
        self.at += 1
        return self.data[self.at - 1]

    def unsigned(self) -> int:
        value = shift = 0
        while True:
            b = self.byte()
            value |= (b & 127) << shift
            shift += 7
            if b < 128:
                return value & 0xFFFFFFFF

    def signed(self) -> int:
        value = self.unsigned()
        return (value >> 1) ^ -(value & 1)


def extend(value: int, bits: int) -> int:
    return value - (1 << bits) if value >> (bits - 1) else value


def tag2_3s32(b: Bytes) -> list[int]:
    lead = b.byte()
    match lead >> 6:
        case 0:
            return [extend(lead >> 4 & 3, 2), extend(lead >> 2 & 3, 2), extend(lead & 3, 2)]
        case 1:
            second = b.byte()
            return [extend(lead & 15, 4), extend(second >> 4, 4), extend(second & 15, 4)]
        case 2:
            return [extend(lead & 63, 6), extend(b.byte() & 63, 6), extend(b.byte() & 63, 6)]
        case _:
            sizes = [(lead >> 2 * i & 3) + 1 for i in range(3)]
            return [extend(sum(b.byte() << 8 * k for k in range(size)), 8 * size) for size in sizes]


def tag8_4s16(b: Bytes) -> list[int]:
    lead, values, nibble = b.byte(), [], None

    def four() -> int:
        nonlocal nibble
        if nibble is None:
            whole = b.byte()
            nibble = whole & 15
            return whole >> 4
        first, nibble = nibble, None
        return first

    for i in range(4):
        count = lead >> 2 * i & 3
        value = 0
        for _ in range((0, 1, 2, 4)[count]):
            value = value << 4 | four()
        values.append(extend(value, (1, 4, 8, 16)[count]) if count else 0)
    return values


def tag8_8svb(b: Bytes, count: int) -> list[int]:
    if count == 1:
        return [b.signed()]
    lead = b.byte()
    return [b.signed() if lead >> i & 1 else 0 for i in range(count)]


def frame(b: Bytes, encodings: list[int]) -> list[int]:
    values: list[int] = []
    while len(values) < len(encodings):
        encoding = encodings[len(values)]
        if encoding == 0:
            values.append(b.signed())
        elif encoding == 1:
            values.append(b.unsigned())
        elif encoding == 3:
            values.append(-extend(b.unsigned() & 0x3FFF, 14))
        elif encoding == 6:
            count = 1
            while count < 8 and encodings[len(values) + count :][:1] == [6]:
                count += 1
            values += tag8_8svb(b, count)
        elif encoding == 7:
            values += tag2_3s32(b)
        elif encoding == 8:
            values += tag8_4s16(b)
        elif encoding == 9:
            values.append(0)
        else:
            raise ValueError(f"encoding {encoding}")
    return values


def wrap(value: int, signed: int) -> int:
    value &= 0xFFFFFFFF
    return extend(value, 32) if signed else value


def main() -> None:
    data = open(sys.argv[1], "rb").read()
    header, at = {}, 0
    while data[at : at + 2] == b"H ":
        end = data.index(b"\n", at)
        name, value = data[at + 2 : end].decode().split(":", 1)
        header[name], at = value, end + 1
    listed = lambda name: [int(x) for x in header[name].split(",")]
    names, signed = header["Field I name"].split(","), listed("Field I signed")
    plan = {ord(kind): (listed(f"Field {kind} predictor"), listed(f"Field {kind} encoding")) for kind in "IP"}
    slow, motor_0 = listed("Field S encoding"), names.index("motor[0]")
    low, intra, inter = listed("motorOutput")[0], int(header["I interval"]), int(header["P interval"])
    b, rows = Bytes(data, at), []
    while b.at < len(data):
        kind = b.byte()
        if kind in plan:
            predictors, encodings = plan[kind]
            last = rows[-1] if rows else None
            before = rows[-2] if len(rows) > 1 and not after_intra else last
            row: list[int] = []
            for i, (predictor, value) in enumerate(zip(predictors, frame(b, encodings))):
                match predictor:
                    case 0:
                        base = 0
                    case 1:
                        base = last[i]
                    case 2:
                        base = 2 * last[i] - before[i]
                    case 3:
                        total = last[i] + before[i]
                        base = int(total / 2) if signed[i] else total // 2
                    case 4:
                        base = int(header["minthrottle"])
                    case 5:
                        base = row[motor_0]
                    case 6:
                        base = last[i] + 1
                        while base % intra % inter:
                            base += 1
                    case 8:
                        base = 1500
                    case 11:
                        base = low
                    case _:
                        raise ValueError(f"predictor {predictor}")
                row.append(wrap(value + base, signed[i]))
            rows.append(row)
            after_intra = kind == ord("I")
        elif kind == ord("S"):
            frame(b, slow)
        elif kind == ord("E"):
            event = b.byte()
            if event == 0:
                b.unsigned()
            elif event == 30:
                b.unsigned(), b.unsigned()
            elif event == 14:
                b.unsigned(), b.unsigned()
            elif event == 15:
                b.unsigned()
            elif event == 255:
                break
            else:
                raise ValueError(f"event {event} at {b.at}")
        else:
            raise ValueError(f"frame {kind:#x} at byte {b.at - 1}, after {len(rows)} frames")
    print("column,count,crc32,first,last")
    for i, name in enumerate(names):
        numbers = [row[i] for row in rows]
        crc = zlib.crc32(b"".join(struct.pack("<q", x) for x in numbers))
        print(f"{name},{len(numbers)},{crc:08x},{numbers[0]},{numbers[-1]}")


if __name__ == "__main__":
    main()
