#!/usr/bin/env python3
"""Writes a small dataflash log in ArduPilot's format, by the format's documents alone, and with `--read` what pymavlink reads of one. Run by hand.

    python3 write.py quad.bin
    pip install pymavlink==2.4.50
    python3 write.py --read quad.bin > quad.dfreader.csv

The flight is made up: numbers that differ in every field and sample, at the rates of a default log. Formats, units and fields are those that
Copter 4.5 describes in its own logs.
"""

import math
import struct
import sys

LETTERS = dict(b="b", B="B", h="h", H="H", i="i", I="I", f="f", d="d", q="q", Q="Q", M="B", c="h", C="H", e="i", E="I", L="i", n="4s", N="16s", Z="64s")
SCALES = dict(c=100, C=100, e=100, E=100, L=10_000_000)
# Type, name, letters, fields, units, multipliers: `#` counts instances, `-` has no unit.
KINDS = [
    (64, "UNIT", "QbZ", "TimeUS,Id,Label", "s--", "F--"),
    (65, "MULT", "Qbd", "TimeUS,Id,Mult", "s--", "F--"),
    (66, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds", "s---", "F---"),
    (67, "PARM", "QNff", "TimeUS,Name,Value,Default", "s---", "F---"),
    (68, "IMU", "QBffffffIIfBBHH", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz", "s#EEEooo--O--zz", "F-000000-----00"),
    (69, "ATT", "QffffffB", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,AEKF", "sddddhh-", "F000000-"),
    (70, "RATE", "Qffffffffffff", "TimeUS,RDes,R,ROut,PDes,P,POut,YDes,Y,YOut,ADes,A,AOut", "skk-kk-kk-oo-", "F?????????00-"),
    (71, "RCOU", "QHHHHHHHHHHHHHH", "TimeUS,C1,C2,C3,C4,C5,C6,C7,C8,C9,C10,C11,C12,C13,C14", "sYYYYYYYYYYYYYY", "F" + "-" * 14),
    (72, "ESC", "QBffffcfcf", "TimeUS,Instance,RPM,RawRPM,Volt,Curr,Temp,CTot,MotTemp,Err", "s#qqvAOaO%", "F-00000000"),
    (73, "BAT", "QBfffffcfBB", "TimeUS,Inst,Volt,VoltR,Curr,CurrTot,EnrgTot,Temp,Res,RemPct,H", "s#vvAaJOw%-", "F-000C0?000"),
    (74, "XKF1", "QBccCfffffffccce", "TimeUS,C,Roll,Pitch,Yaw,VN,VE,VD,dPD,PN,PE,PD,GX,GY,GZ,OH", "s#ddhnnnnmmmkkkm", "F-BBB0000000BBBB"),
    (75, "XKQ", "QBffff", "TimeUS,C,Q1,Q2,Q3,Q4", "s#????", "F-????"),
    (76, "BARO", "QBfffcfIfBf", "TimeUS,I,Alt,AltAMSL,Press,Temp,CRt,SMS,Offset,Health,CPress", "s#mmPOnsm-P", "F-000B0C?-0"),
    (77, "MAG", "QBhhhhhhhhhBI", "TimeUS,I,MagX,MagY,MagZ,OfsX,OfsY,OfsZ,MOX,MOY,MOZ,Health,S", "s#GGGGGGGGG-s", "F-CCCCCCCCC-F"),
    (78, "MSG", "QZ", "TimeUS,Message", "s-", "F-"),
    (79, "GPS", "QBBIHBcLLeffffB", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U", "s#-s-S-DUmnhnh-", "F-C-0BGGB000--"[:15]),
]
PARAMETERS = {
    "FRAME_CLASS": 1, "FRAME_TYPE": 1, "MOT_PWM_MIN": 1050, "MOT_PWM_MAX": 1950, "MOT_THST_EXPO": 0.65, "MOT_THST_HOVER": 0.2, "LOG_BITMASK": 176126,
    # The motors are not on the first outputs, nor in order.
    "SERVO1_FUNCTION": 0, "SERVO2_FUNCTION": 34, "SERVO3_FUNCTION": 33, "SERVO4_FUNCTION": 35, "SERVO5_FUNCTION": 0, "SERVO6_FUNCTION": 36,
}  # fmt: skip
TYPES = {name: (kind, letters) for kind, name, letters, *_ in KINDS}


def message(name: str, *values) -> bytes:
    kind, letters = TYPES[name]
    stored = [
        v.encode() if isinstance(v, str) else round(v * SCALES[c]) if c in SCALES else v
        for c, v in zip(letters, values, strict=True)
    ]
    return b"\xa3\x95" + bytes([kind]) + struct.pack("<" + "".join(LETTERS[c] for c in letters), *stored)


def description(kind: int, name: str, letters: str, fields: str) -> bytes:
    size = 3 + struct.calcsize("<" + "".join({"Z": "64s", **LETTERS}[c] for c in letters))
    return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", kind, size, name.encode(), letters.encode(), fields.encode())


def flight() -> bytes:
    out = [b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", 128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns")]
    out += [description(*kind[:4]) for kind in KINDS]
    us = 1_000_000
    for unit, label in {"s": "s", "d": "deg", "k": "deg/s", "E": "rad/s", "o": "m/s/s", "Y": "us", "q": "rpm", "v": "V", "A": "A", "m": "m", "n": "m/s", "#": "instance"}.items():
        out.append(message("UNIT", us, ord(unit), label))
    for multiplier, value in {"F": 1e-6, "B": 1e-2, "C": 1e-3, "0": 1.0}.items():
        out.append(message("MULT", us, ord(multiplier), value))
    for kind, _, _, _, units, multipliers in KINDS:
        out.append(message("FMTU", us, kind, units, multipliers))
    for name, value in PARAMETERS.items():
        out.append(message("PARM", us, name, value, 0.0))
    out.append(message("MSG", us, "ArduCopter V4.5.7 (made up)"))
    for step in range(400):  # 400 steps of 2.5 ms
        t = step * 0.0025
        us = 2_000_000 + round(t * 1e6)
        wave = lambda hz, k=0.0: math.sin(2 * math.pi * hz * t + k)
        roll, pitch, yaw = 20 * wave(1.1), 15 * wave(0.9, 1), (350 + 30 * t) % 360
        if step % 16 == 0:  # 25 Hz
            for imu in (0, 1):
                gyro = [wave(1.3, k + imu) for k in range(3)]
                force = [wave(0.7, k + imu) for k in range(2)] + [-9.8 + wave(2, imu)]
                out.append(message("IMU", us + imu * 40, imu, *gyro, *force, 0, 0, 40.5, 1, 1, 2000, 1000))
            out.append(message("ATT", us + 90, roll + 1, roll, pitch - 1, pitch, yaw, yaw, 3))
            out.append(message("RATE", us + 100, *[30 * wave(1.7, k) for k in range(12)]))
            for core in (0, 1):
                state = [2 * wave(0.5, k + core) for k in range(7)]
                out.append(message("XKF1", us + 110 + core * 20, core, roll, pitch, yaw, *state, 0.01, -0.02, 0.03, 584.12))
                r, p, y = (math.radians(a) / 2 for a in (roll, pitch, yaw))
                (sr, cr), (sp, cp), (sy, cy) = ((math.sin(a), math.cos(a)) for a in (r, p, y))
                q = (cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy)
                out.append(message("XKQ", us + 111 + core * 20, core, *q))
        if step % 40 == 0:  # 10 Hz
            pulses = [1000, 1500 + round(200 * wave(2)), 1490 + round(190 * wave(2, 1)), 1480, 1500, 1470 + round(480 * wave(1)), 1000, 0, 0, 0, 0, 0, 0, 0]
            out.append(message("RCOU", us + 200, *pulses))
            out.append(message("BAT", us + 210, 0, 15.8 - t / 10, 15.9, 12 + 3 * wave(1), 10 * t, t, 31.25, 0.02, 90, 1))
            out.append(message("BARO", us + 220, 0, 10 + wave(0.3), 594.0, 94000.0, 31.5, 0.1, 1000, 0.0, 1, 94000.0))
            out.append(message("MAG", us + 230, 0, 220 + round(30 * wave(1)), -41, 390, 1, 2, 3, 0, 0, 0, 1, 7))
            out.append(message("GPS", us + 240, 0, 3, 1000 * step, 2300, 14, 0.71, 47.3977418 + t * 1e-5, 8.5455938, 488.21, 1.5, 90.0, -0.1, 0.0, 1))
        if step % 20 == 0:  # 20 Hz, each ESC at its own time; instances count outputs from 0
            for esc in (1, 2, 3, 5):
                out.append(message("ESC", us + 300 + 400 * esc, esc, 6000 + 100 * esc + 500 * wave(2, esc), 0, 15.7, 3.1, 41.25, 1.0, 0.0, 0.0))
    return b"".join(out)


def read(path: str) -> None:
    from pymavlink import DFReader

    log = DFReader.DFReader_binary(path, zero_time_base=True)
    while (m := log.recv_msg()) is not None:
        if m.get_type() in ("FMT", "UNIT", "MULT", "FMTU", "MSG"):
            continue
        fields = ",".join(f"{name}={getattr(m, name)!r}" for name in m._fieldnames)
        print(f"{m.get_type()},{fields}")


if __name__ == "__main__":
    if sys.argv[1] == "--read":
        read(sys.argv[2])
    else:
        with open(sys.argv[1], "wb") as file:
            file.write(flight())
