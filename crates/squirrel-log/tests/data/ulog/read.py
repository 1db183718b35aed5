#!/usr/bin/env python3
"""What pyulog reads of a ULog file, to compare the import with. Run by hand.

    pip install pyulog==1.3.0
    python3 read.py sample_cut.ulg > sample_cut.pyulog.csv

For each column of each topic: how many there are, and the CRC-32 of its numbers as little-endian doubles. `--all` also writes columns that the
test does not ask for.
"""

import sys
import zlib

import numpy as np
from pyulog import ULog

TOPICS = ["sensor_combined", "vehicle_attitude", "vehicle_local_position", "battery_status", "actuator_outputs", "vehicle_magnetometer"]


def main() -> None:
    log = ULog(sys.argv[1])
    print("topic,column,count,crc32")
    for data in log.data_list:
        if data.multi_id == 0 and (data.name in TOPICS or "--all" in sys.argv):
            for name, numbers in data.data.items():
                doubles = np.asarray(numbers, dtype="<f8") + 0.0  # one zero
                doubles[np.isnan(doubles)] = np.nan  # one NaN
                crc = zlib.crc32(doubles.tobytes())
                print(f"{data.name},{name},{len(numbers)},{crc:08x}")
    for name, value in log.initial_parameters.items():
        if name in ("MAV_TYPE", "PWM_MIN", "PWM_MAX", "SYS_AUTOSTART"):
            print(f"parameter,{name},1,{float(value)!r}")


if __name__ == "__main__":
    main()
