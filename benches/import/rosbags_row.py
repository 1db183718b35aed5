#!/usr/bin/env python3
"""`squirrel import` of a ROS 2 bag beside `rosbags`, in one run, on one core each.

    cargo build --release -p squirrel-cli
    pip install rosbags==0.11.0 mcap==1.6.0
    taskset -c 0 python3 benches/import/rosbags_row.py target/release/squirrel [--seconds 600] [--compression zstd]

Makes a bag of `--seconds` of an Imu at 500 Hz, an odometry and rotor speeds at 100 Hz and a battery at 10 Hz, as mavros gives
them, numbers with noise as a sensor's are. Both sides take the same fields of the same topics: `rosbags` reads every message
and makes NumPy arrays of them; `squirrel import` finds out by itself which topics say what, turns frames, and with `--out`
also writes the flight log. CPU time of the process, the best of three; MB are those of the bag's file.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

START_NS = 1_700_000_000_000_000_000
store = get_typestore(Stores.ROS2_HUMBLE)
store.register(get_types_from_msg("""std_msgs/Header header
float32 temperature
float32 voltage
float32 current
float32 totalcurrent
int32 rpm
uint16 count""", "mavros_msgs/msg/ESCTelemetryItem"))  # fmt: skip
store.register(get_types_from_msg("""std_msgs/Header header
mavros_msgs/ESCTelemetryItem[] esc_telemetry""", "mavros_msgs/msg/ESCTelemetry"))  # fmt: skip
T = store.types


def header(ns, frame="base_link"):
    stamp = T["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)
    return T["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def messages(seconds, rng):
    vector, quaternion = T["geometry_msgs/msg/Vector3"], T["geometry_msgs/msg/Quaternion"]
    item = T["mavros_msgs/msg/ESCTelemetryItem"]
    for i in range(500 * seconds):
        ns = START_NS + i * 2_000_000
        yaw = 1e-4 * i
        q = quaternion(x=0.0, y=0.0, z=float(np.sin(yaw / 2)), w=float(np.cos(yaw / 2)))
        a = rng.normal(size=12)
        yield "/imu/data", "sensor_msgs/msg/Imu", ns, T["sensor_msgs/msg/Imu"](
            header=header(ns), orientation=q, orientation_covariance=np.zeros(9), angular_velocity=vector(*a[:3]),
            angular_velocity_covariance=np.zeros(9), linear_acceleration=vector(*a[3:6]),
            linear_acceleration_covariance=np.zeros(9))  # fmt: skip
        if i % 5 == 0:
            pose = T["geometry_msgs/msg/Pose"](position=T["geometry_msgs/msg/Point"](*a[6:9]), orientation=q)
            twist = T["geometry_msgs/msg/Twist"](linear=vector(*a[9:12]), angular=vector(*a[:3]))
            yield "/odom", "nav_msgs/msg/Odometry", ns, T["nav_msgs/msg/Odometry"](
                header=header(ns, "map"), child_frame_id="base_link",
                pose=T["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=np.zeros(36)),
                twist=T["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=np.zeros(36)))  # fmt: skip
            items = [item(header=header(ns), temperature=40.0, voltage=15.0, current=float(a[k]), totalcurrent=1.0,
                          rpm=int(6000 + 100 * a[k]), count=i % 65536) for k in range(4)]  # fmt: skip
            yield "/esc", "mavros_msgs/msg/ESCTelemetry", ns, T["mavros_msgs/msg/ESCTelemetry"](
                header=header(ns), esc_telemetry=items)
        if i % 50 == 0:
            yield "/battery", "sensor_msgs/msg/BatteryState", ns, T["sensor_msgs/msg/BatteryState"](
                header=header(ns), voltage=15.5, temperature=0.0, current=-float(abs(a[0])), charge=0.0, capacity=0.0,
                design_capacity=0.0, percentage=0.5, power_supply_status=0, power_supply_health=0,
                power_supply_technology=0, present=True, cell_voltage=np.zeros(4, np.float32),
                cell_temperature=np.zeros(0, np.float32), location="", serial_number="")  # fmt: skip


def write(path, seconds, compression):
    with open(path, "wb") as file:
        writer, channels = Writer(file, compression=compression), {}
        writer.start(profile="ros2")
        for topic, kind, ns, message in messages(seconds, np.random.default_rng(1)):
            if topic not in channels:
                text, _ = store.generate_msgdef(kind, ros_version=2)
                schema = writer.register_schema(kind, "ros2msg", text.encode())
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channels[topic], ns, bytes(store.serialize_cdr(message, kind)), ns)
        writer.finish()


def by_rosbags(path):
    """The same fields, by `rosbags`' decoder on the messages of the bag."""
    rows = {"/imu/data": [], "/odom": [], "/esc": [], "/battery": []}
    with open(path, "rb") as file:
        for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
            m = store.deserialize_cdr(message.data, schema.name)
            s = m.header.stamp
            t = s.sec + s.nanosec * 1e-9
            if channel.topic == "/imu/data":
                w, a = m.angular_velocity, m.linear_acceleration
                row = (t, w.x, w.y, w.z, a.x, a.y, a.z)
            elif channel.topic == "/odom":
                p, q, v = m.pose.pose.position, m.pose.pose.orientation, m.twist.twist.linear
                row = (t, p.x, p.y, p.z, q.x, q.y, q.z, q.w, v.x, v.y, v.z)
            elif channel.topic == "/esc":
                row = (t, *(e.rpm for e in m.esc_telemetry))
            else:
                row = (t, m.voltage, m.current)
            rows[channel.topic].append(row)
    return {topic: np.array(numbers) for topic, numbers in rows.items()}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("squirrel", type=Path)
    parser.add_argument("--seconds", type=int, default=300)
    parser.add_argument("--compression", choices=["none", "zstd"], default="none")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        bag, out = Path(folder, "flight.mcap"), Path(folder, "out.mcap")
        write(bag, arguments.seconds, CompressionType[arguments.compression.upper()])
        mb = bag.stat().st_size / 1e6
        start = time.process_time()
        arrays = by_rosbags(bag)
        rosbags_s = time.process_time() - start
        times = []
        for _ in range(3):
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run([arguments.squirrel, "import", bag, "--out", out], check=True, capture_output=True)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
        samples = sum(len(a) for a in arrays.values())
        print(f"{mb:.1f} MB, {samples} messages, {arguments.compression}")
        print(f"rosbags                    {rosbags_s:7.2f} s  {mb / rosbags_s:7.1f} MB/s")
        print(f"squirrel import, written   {min(times):7.2f} s  {mb / min(times):7.1f} MB/s  {rosbags_s / min(times):.0f} times")


if __name__ == "__main__":
    sys.exit(main())
