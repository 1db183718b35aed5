"""Makes the ROS 2 bags of the import's tests, and what independent readers read in them.

    pip install rosbags==0.11.0 mcap==1.6.0 mcap-ros2-support==0.6.0 && python make.py

`rosbags` writes the messages and reads them again; `mcap-ros2-support` reads all that it can (little endian), too, and
must agree. `*.csv` has one number a line: topic, path in the message, row from 1, value. A time is its two numbers.
"""

import csv
import math
import shutil
import tempfile
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

HERE = Path(__file__).parent
START_NS = 1_700_000_000_123_456_789

TYPES = {
    "px4_msgs/msg/VehicleAttitude": """
# Attitude, FRD to NED.
uint32 MESSAGE_VERSION = 0
uint64 timestamp        # us
uint64 timestamp_sample
float32[4] q
float32[4] delta_q_reset
uint8 quat_reset_counter""",
    "px4_msgs/msg/VehicleAngularVelocity": """
uint64 timestamp
uint64 timestamp_sample
float32[3] xyz
float32[3] xyz_derivative""",
    "px4_msgs/msg/VehicleAcceleration": """
uint64 timestamp
uint64 timestamp_sample
float32[3] xyz""",
    "px4_msgs/msg/SensorCombined": """
uint64 timestamp
int32 RELATIVE_TIMESTAMP_INVALID = 2147483647
float32[3] gyro_rad
uint32 gyro_integral_dt
int32 accelerometer_timestamp_relative
float32[3] accelerometer_m_s2
uint32 accelerometer_integral_dt
uint8 CLIPPING_X = 1
uint8 accelerometer_clipping
uint8 gyro_clipping""",
    "px4_msgs/msg/VehicleLocalPosition": """
uint64 timestamp
uint64 timestamp_sample
bool xy_valid
bool z_valid
bool v_xy_valid
bool v_z_valid
float32 x
float32 y
float32 z
float32[2] delta_xy
uint8 xy_reset_counter
float32 vx
float32 vy
float32 vz
float32 heading""",
    "px4_msgs/msg/ActuatorMotors": """
uint64 timestamp
uint64 timestamp_sample
uint16 reversible_flags
uint8 ACTUATOR_FUNCTION_MOTOR1 = 101
uint8 NUM_CONTROLS = 12
float32[12] control""",
    "px4_msgs/msg/BatteryStatus": """
uint64 timestamp
bool connected
float32 voltage_v
float32 current_a
float32 remaining
uint8 cell_count
float32[14] voltage_cell_v""",
    "px4_msgs/msg/VehicleOdometry": """
uint64 timestamp
uint64 timestamp_sample
uint8 POSE_FRAME_NED = 1
uint8 pose_frame
float32[3] position
float32[4] q
uint8 VELOCITY_FRAME_NED = 1
uint8 velocity_frame
float32[3] velocity
float32[3] angular_velocity""",
    "mavros_msgs/msg/ESCTelemetryItem": """
std_msgs/Header header
float32 temperature
float32 voltage
float32 current
float32 totalcurrent
int32 rpm
uint16 count""",
    "mavros_msgs/msg/ESCTelemetry": """
std_msgs/Header header
mavros_msgs/ESCTelemetryItem[] esc_telemetry""",
    "mavros_msgs/msg/RCOut": """
std_msgs/Header header
uint16[] channels""",
    "mavros_msgs/msg/ActuatorControl": """
std_msgs/Header header
uint8 PX4_MIX_FLIGHT_CONTROL = 0
uint8 group_mix
float32[8] controls""",
    "odd_msgs/msg/Nothing": "",
    "odd_msgs/msg/Inner": """
bool b
float64 x
int8[<=3] few
string name""",
    "odd_msgs/msg/Odd": """
# Every type, and every alignment.
char DOLLAR=36
string GREETING = "a # b"
bool flag true
int8 i8
uint8 u8 255
int16 i16
uint16 u16
int32 i32
uint32 u32
string<=10 short "no"
int64 i64
byte by
uint64 u64
float32 f32
string text
float64 f64
float64[] none
uint8 after_none
odd_msgs/Nothing nothing
int16[3] three
Inner[2] pair
Inner[] some
string[] words
float32[<=5] up_to_five
builtin_interfaces/Time[2] times
builtin_interfaces/Duration back
geometry_msgs/Vector3[] vectors
uint64 last""",
}

store = get_typestore(Stores.ROS2_HUMBLE)
known = {}
for name, text in TYPES.items():
    known |= get_types_from_msg(text, name)
store.register(known)
T = store.types


def stamp(ns):
    return T["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)


def header(ns, frame):
    return T["std_msgs/msg/Header"](stamp=stamp(ns), frame_id=frame)


def vector(x, y, z):
    return T["geometry_msgs/msg/Vector3"](x=x, y=y, z=z)


def f32(*numbers):
    return np.array(numbers, dtype=np.float32)


def spin(i):
    """Yaw of 0.1 rad a message in ENU and FLU: x, y, z, w."""
    yaw = 0.3 + 0.1 * i
    return 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)


def pose(i):
    x, y, z, w = spin(i)
    return T["geometry_msgs/msg/Pose"](
        position=T["geometry_msgs/msg/Point"](x=1.5 * i, y=-0.25 * i, z=2.0 + i),
        orientation=T["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w),
    )


def twist(i):
    return T["geometry_msgs/msg/Twist"](linear=vector(1.0 + i, 0.5, -0.1), angular=vector(0.0, 0.01, 0.1))


def imu(ns, i):
    x, y, z, w = spin(i)
    return T["sensor_msgs/msg/Imu"](
        header=header(ns, "base_link"),
        orientation=T["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w),
        orientation_covariance=np.arange(9.0),
        angular_velocity=vector(0.1 * i, -0.2, 0.3),
        angular_velocity_covariance=np.zeros(9),
        linear_acceleration=vector(0.01, 0.02 * i, 9.81),
        linear_acceleration_covariance=np.zeros(9),
    )


def battery(ns, i, current=-3.25):
    return T["sensor_msgs/msg/BatteryState"](
        header=header(ns, ""), voltage=15.5 - 0.1 * i, temperature=math.nan, current=current, charge=math.nan,
        capacity=math.nan, design_capacity=math.nan, percentage=0.75, power_supply_status=2, power_supply_health=1,
        power_supply_technology=3, present=True, cell_voltage=f32(*[3.9] * (i % 3)), cell_temperature=f32(),
        location="bay", serial_number="4S-" + "7" * i,
    )  # fmt: skip


def esc(ns, i):
    item = T["mavros_msgs/msg/ESCTelemetryItem"]
    items = [
        item(header=header(ns, ""), temperature=40.0, voltage=15.0, current=2.0, totalcurrent=1.0, rpm=6000 + 10 * i + k, count=i)
        for k in range(4)
    ]
    return T["mavros_msgs/msg/ESCTelemetry"](header=header(ns, "esc"), esc_telemetry=items)


def ros_messages():
    """A flight as mavros gives it, ENU and FLU; the log is 2 ms behind the stamps."""
    for i in range(5):
        ns = START_NS + i * 10_000_000
        t = ns + 2_000_000
        yield "/mavros/imu/data", "sensor_msgs/msg/Imu", t, imu(ns, i)
        yield "/mavros/local_position/odom", "nav_msgs/msg/Odometry", t, T["nav_msgs/msg/Odometry"](
            header=header(ns, "map"), child_frame_id="base_link",
            pose=T["geometry_msgs/msg/PoseWithCovariance"](pose=pose(i), covariance=np.arange(36.0)),
            twist=T["geometry_msgs/msg/TwistWithCovariance"](twist=twist(i), covariance=np.zeros(36)),
        )  # fmt: skip
        yield "/mavros/battery", "sensor_msgs/msg/BatteryState", t, battery(ns, i)
        yield "/mavros/esc_telemetry", "mavros_msgs/msg/ESCTelemetry", t, esc(ns, i)
        yield "/mavros/rc/out", "mavros_msgs/msg/RCOut", t, T["mavros_msgs/msg/RCOut"](
            header=header(ns, ""), channels=np.array([1100 + i, 1200 + i, 1300 + i, 1400 + i, 0, 0, 900, 0], dtype=np.uint16))
        yield "/mavros/actuator_control", "mavros_msgs/msg/ActuatorControl", t, T["mavros_msgs/msg/ActuatorControl"](
            header=header(ns, ""), group_mix=0, controls=f32(*[0.1 * k + i for k in range(8)]))
        yield "/chatter", "std_msgs/msg/String", t, T["std_msgs/msg/String"](data="hello")


def mocap_messages():
    """Pose and twist of a motion capture; the battery has neither stamp nor current."""
    for i in range(5):
        ns = START_NS + i * 10_000_000
        yield "/vrpn/pose", "geometry_msgs/msg/PoseStamped", ns + 5000, T["geometry_msgs/msg/PoseStamped"](
            header=header(ns, "world"), pose=pose(i))
        yield "/vrpn/twist", "geometry_msgs/msg/TwistStamped", ns + 5000, T["geometry_msgs/msg/TwistStamped"](
            header=header(ns, "world"), twist=twist(i))
        yield "/battery", "sensor_msgs/msg/BatteryState", ns + 6000, battery(0, i, math.nan)


def px4_messages():
    """A flight over uXRCE-DDS, NED and FRD, in microseconds of the autopilot."""
    for i in range(5):
        us, t = 61_000_000 + 4000 * i, START_NS + 4_000_000 * i
        nan = math.nan

        def px4(name, **fields):
            topic = "/fmu/out/" + "".join("_" + c.lower() if c.isupper() else c for c in name)[1:]
            return topic, f"px4_msgs/msg/{name}", t, T[f"px4_msgs/msg/{name}"](timestamp=us, **fields)

        yaw = -0.4 + 0.1 * i
        q = f32(math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
        yield px4("VehicleAttitude", timestamp_sample=us - 300, q=q, delta_q_reset=f32(0, 0, 0, 0), quat_reset_counter=0)
        yield px4("VehicleAngularVelocity", timestamp_sample=us - 300, xyz=f32(0.1, 0.2 * i, -0.3), xyz_derivative=f32(0, 0, 0))
        yield px4("VehicleAcceleration", timestamp_sample=us - 300, xyz=f32(0.5, -0.1 * i, -9.8))
        yield px4("SensorCombined", gyro_rad=f32(1, 2, 3), gyro_integral_dt=4000, accelerometer_timestamp_relative=0,
                  accelerometer_m_s2=f32(4, 5, 6), accelerometer_integral_dt=4000, accelerometer_clipping=0, gyro_clipping=0)  # fmt: skip
        yield px4("VehicleLocalPosition", timestamp_sample=us - 300, xy_valid=True, z_valid=True, v_xy_valid=True, v_z_valid=True,
                  x=1.0 + i, y=2.0, z=-3.5, delta_xy=f32(0, 0), xy_reset_counter=0, vx=0.25, vy=-0.5 * i, vz=0.125, heading=yaw)  # fmt: skip
        yield px4("ActuatorMotors", timestamp_sample=us - 300, reversible_flags=0,
                  control=f32(0.4 + 0.01 * i, 0.5, 0.6, 0.7, *[nan] * 8))  # fmt: skip
        yield px4("BatteryStatus", connected=True, voltage_v=16.25 - 0.25 * i, current_a=8.5, remaining=0.9, cell_count=4,
                  voltage_cell_v=f32(*[4.0] * 4, *[nan] * 10))  # fmt: skip
        yield px4("VehicleOdometry", timestamp_sample=us - 300, pose_frame=1, position=f32(7, 8, 9), q=q, velocity_frame=1,
                  velocity=f32(1, 2, 3), angular_velocity=f32(0, 0, 0))  # fmt: skip


def two_imus_messages():
    for i in range(3):
        ns = START_NS + i * 10_000_000
        for topic in ["/front/imu", "/rear/imu"]:
            yield topic, "sensor_msgs/msg/Imu", ns, imu(ns, i)


def odd_messages():
    inner = T["odd_msgs/msg/Inner"]
    for i in range(4):
        def one(k):
            return inner(b=k % 2 == 0, x=0.1 * k - i, few=np.arange(-k, 0, dtype=np.int8)[:3], name="x" * k)

        yield "/odd", "odd_msgs/msg/Odd", 1000 * (i + 1), T["odd_msgs/msg/Odd"](
            flag=i % 2 == 0, i8=-128 + i, u8=255 - i, i16=-32768 + i, u16=65535 - i, i32=-(2**31) + i, u32=2**32 - 1 - i,
            short="abcdefghij"[: i * 3], i64=-(2**63) + 1025 * i, by=7, u64=2**64 - 1 - 3 * i, f32=np.float32(0.1) * i, text="é" * i,
            f64=[1e-300, math.nan, -0.0, 1.7e308][i], none=np.array([], dtype=np.float64), after_none=9 + i,
            nothing=T["odd_msgs/msg/Nothing"](), three=np.array([1, -2, 3 * i], dtype=np.int16), pair=[one(1), one(2 + i)],
            some=[one(k) for k in range(i)], words=["", "a", "bc"][:i], up_to_five=np.arange(i, dtype=np.float32) / 3,
            times=[stamp(START_NS), stamp(1)], back=T["builtin_interfaces/msg/Duration"](sec=-1, nanosec=5),
            vectors=[vector(1.0, math.nan, k / 7) for k in range((i + 1) % 3)], last=2**53 + 2 * i,
        )  # fmt: skip


def write(path, messages, little_endian, compression):
    with open(path, "wb") as file:
        writer = Writer(file, chunk_size=4096, compression=compression)
        writer.start(profile="ros2", library="rosbags 0.11")
        channels = {}
        for topic, kind, log_ns, message in messages:
            if topic not in channels:
                text, _ = store.generate_msgdef(kind, ros_version=2)
                schema = writer.register_schema(kind, "ros2msg", text.encode())
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            data = bytes(store.serialize_cdr(message, kind, little_endian=little_endian))
            writer.add_message(channels[topic], log_ns, data, log_ns + 1000)
        writer.finish()


def leaves(value, path):
    if isinstance(value, (bool, int, float, np.generic)):
        yield path, value
    elif isinstance(value, (list, tuple, np.ndarray)):
        for i, inner in enumerate(value):
            yield from leaves(inner, f"{path}[{i}]")
    elif not isinstance(value, (str, bytes)):
        names = [n for n in (getattr(value, "__slots__", None) or vars(value)) if not n.startswith("_") and not n.isupper()]
        for name in names:
            yield from leaves(getattr(value, name), f"{path}.{name}" if path else name)


def text(value):
    if isinstance(value, (bool, np.bool_)):
        return str(int(value))
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    return repr(float(value))  # a float32 as the double that it is


def read_rosbags(path):
    with open(path, "rb") as file:
        rows = {}
        for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
            row = rows[channel.topic] = rows.get(channel.topic, 0) + 1
            for column, value in leaves(store.deserialize_cdr(message.data, schema.name), ""):
                if not column.endswith("structure_needs_at_least_one_member"):
                    yield channel.topic, column, row, text(value)


def read_mcap_ros2(path):
    with open(path, "rb") as file:
        rows = {}
        for _, channel, _, message in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages(log_time_order=False):
            row = rows[channel.topic] = rows.get(channel.topic, 0) + 1
            for column, value in leaves(message, ""):
                if not column.endswith("structure_needs_at_least_one_member"):
                    yield channel.topic, column, row, text(value)


for name, messages, little, compression in [
    ("ros", ros_messages, True, CompressionType.ZSTD),
    ("mocap", mocap_messages, True, CompressionType.NONE),
    ("px4", px4_messages, True, CompressionType.ZSTD),
    ("two_imus", two_imus_messages, True, CompressionType.ZSTD),
    ("odd", odd_messages, True, CompressionType.NONE),
    ("odd_big_endian", odd_messages, False, CompressionType.NONE),
]:
    path = HERE / f"{name}.mcap"
    write(path, messages(), little, compression)
    read = sorted(read_rosbags(path))
    if little:
        other = sorted(read_mcap_ros2(path))
        differ = [(a, b) for a, b in zip(read, other) if a != b]
        print(name, len(read), "numbers;", "mcap-ros2-support agrees" if read == other else differ[:5] or "LENGTHS DIFFER")
    with open(HERE / f"{name}.csv", "w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(read)
