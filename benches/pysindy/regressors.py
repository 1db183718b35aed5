"""Logs of a case of the blind bench, the nominal model, and one regressor a parameter of the catalogue.

The model is written here once more, in NumPy, with every effect of the catalogue as an increment. A regressor is the change of
the model's output over a change of one parameter by its smallest size worth reporting, so that a coefficient of 1 is that size
for all of them. Left and right side go through the same low-pass; each channel is in units of its own noise.
"""

import tomllib
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from scipy.signal import butter, filtfilt, lfilter

G = 9.81
RHO = 1.225
RATE_HZ = 300.0
CUTOFF_HZ = 12.0
EVERY = 10  # samples of 300 Hz in one of 30 Hz
GNSS_WINDOW = 3  # fixes over which a velocity changes
E3 = np.array([0.0, 0.0, 1.0])

# Effect, key of the model, smallest size worth reporting. Several lines of one effect are its parameters.
CATALOGUE = (
    [("linear_drag", "linear_drag", 0.04), ("quadratic_drag", "quadratic_drag", 0.008)]
    + [("constant_wind", f"wind_{i}", 1.5) for i in range(2)]
    + [("ground_effect", "ground_radius2", 0.25**2), ("battery_sag", "sag", 0.4)]
    + [("thrust_coefficient", "thrust", 0.04), ("motor_lag", "motor_lag", 0.015)]
    + [("weak_rotor", f"weak_{i}", 0.05) for i in range(8)]
    + [("mass_error", "mass", 0.04)]
    + [("inertia_error", f"inertia_{i}", 0.12) for i in range(3)]
    + [("cg_offset", f"cg_{i}", 0.003) for i in range(2)]
    + [("thrust_misalignment", f"tilt_{i}", np.radians(1.0)) for i in range(2)]
    + [("translational_lift", "lift", 6e-4), ("axial_inflow", "inflow", 0.012)]
    + [("flapping_moment", "flapping", 1e-3), ("rotor_gyro_torque", "rotor_inertia", 4e-6)]
    + [("yaw_torque_coeff", "yaw_torque", 0.12), ("angular_damping", "damping", 4e-3)]
    + [("actuation_latency", "latency", 0.015), ("clock_skew", "skew", 4e-4)]
    + [("wing_membrane", "wing_gain", 0.12), ("wing_membrane", "wing_angle", np.radians(1.5))]
    + [("wing_asymmetry", f"wing_loss_{i}", 0.12) for i in range(2)]
    + [("wing_servo_lag", "wing_lag", 0.12), ("added_mass", "added_mass", 0.03)]
    + [("accel_bias", f"bias_{i}", 0.15) for i in range(3)]
    + [("heading_bias", "heading", np.radians(5.0)), ("gnss_latency", "gnss_latency", 0.08)]
    + [("payload_swing", f"payload_{length}", 0.03) for length in (0.35, 0.5, 0.7, 0.9)]
)


def read_log(path):
    """Sources of a flight log: `{topic: {"time_s": ..., channel: array}}`."""
    rows = {}
    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages():
            source = rows.setdefault(channel.topic, {})
            for field in message.DESCRIPTOR.fields:
                value = getattr(message, field.name)
                source.setdefault(field.name, []).append(value if isinstance(value, float) else list(value))
    return {
        topic: {name: np.array(values) for name, values in source.items() if name != "crc32"}
        for topic, source in rows.items()
    }


def read_vehicle(path):
    """The numbers of a vehicle file, without their tolerances."""

    def plain(x):
        if isinstance(x, dict):
            return plain(x["value"]) if "value" in x else {key: plain(value) for key, value in x.items()}
        return [plain(value) for value in x] if isinstance(x, list) else x

    return plain(tomllib.loads(Path(path).read_text()))


def rotations(q):
    w, x, y, z = q.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def lagged(target, tau_s):
    """First-order lag of samples that are held, from rest at the first."""
    keep = np.exp(-1.0 / (RATE_HZ * tau_s))
    state = lfilter([1 - keep], [1, -keep], target, axis=0, zi=keep * target[:1])[0]
    return state


def low_pass(x):
    b, a = butter(4, CUTOFF_HZ / (RATE_HZ / 2))
    return filtfilt(b, a, x, axis=0)


def held(time_s, source_time_s, values):
    index = np.clip(np.searchsorted(source_time_s, time_s + 1e-9) - 1, 0, len(values) - 1)
    return values[index]


def smooth(x, count):
    window = np.ones(count) / count
    return np.apply_along_axis(lambda c: np.convolve(np.pad(c, count, "edge"), window, "same")[count:-count], 0, x)


class Flight:
    """One log on the clock of the inertial unit, with reconstructed velocity and height."""

    def __init__(self, path, vehicle):
        log = read_log(path)
        self.t = t = log["imu"]["time_s"]
        self.p = vehicle
        self.omega, self.force = log["imu"]["omega_body_rad_s"], log["imu"]["specific_force_body_m_s2"]
        self.R = rotations(held(t, log["attitude"]["time_s"], log["attitude"]["q_ned_from_body_wxyz"]))
        self.u = held(t, log["rotor"]["time_s"], log["rotor"]["command"])
        self.wing = held(t, log["wing"]["time_s"], log["wing"]["command"])
        self.volt = smooth(np.interp(t, log["battery"]["time_s"], log["battery"]["voltage_v"])[:, None], 75)[:, 0]
        gnss = log["gnss"]
        self.gnss_t, self.gnss_v = gnss["time_s"], gnss["velocity_ned_m_s"]
        self.acc = np.einsum("nij,nj->ni", self.R, self.force) + G * E3
        self.strapdown = np.cumsum(self.acc, axis=0) / RATE_HZ
        at = lambda x, when: np.stack([np.interp(when, t, c) for c in x.T], 1)
        drift = smooth(self.gnss_v - at(self.strapdown, self.gnss_t), 15)
        drift = np.stack([np.interp(t, self.gnss_t, c) for c in drift.T], 1)
        self.v = self.strapdown + drift
        climb = np.cumsum(-self.v[:, 2]) / RATE_HZ
        baro = log["baro"]
        offset = smooth((baro["altitude_m"] - np.interp(baro["time_s"], t, climb))[:, None], 250)[:, 0]
        self.height = climb + np.interp(t, baro["time_s"], offset)

    def at_fixes(self, x, late_s=0.0):
        """Changes over `GNSS_WINDOW` fixes of a quantity that is known all the time."""
        fixes = np.stack([np.interp(self.gnss_t - late_s, self.t, c) for c in x.T], 1)
        return fixes[GNSS_WINDOW:] - fixes[:-GNSS_WINDOW]

    def model(self, **e):
        """Specific force and angular acceleration with effects, and the change of velocity at fixes."""
        e = {key: e.get(key, 0.0) for _, key, _ in CATALOGUE}
        p, t = self.p, self.t
        m, J, prop, wing = p["mass"]["mass_kg"], np.array(p["mass"]["inertia_kg_m2"]), p["propulsion"], p["wing"]
        late = t - e["latency"] - e["skew"] * t
        u, w_command = held(late, t, self.u), held(late, t, self.wing)
        speed = u * prop["speed_max_rad_s"] * ((self.volt / prop["reference_voltage_v"]) ** e["sag"])[:, None]
        speed = lagged(speed, prop["time_constant_s"] + e["motor_lag"])
        turn = np.array([[0, 0, e["heading"]]])
        body = lambda ned: np.einsum("nji,nj->ni", self.R, ned - np.cross(turn, ned))
        V = body(self.v - np.array([e["wind_0"], e["wind_1"], 0.0]))
        T = prop["thrust_coefficient_n_s2"] * (1 + e["thrust"]) * speed**2
        horizontal = V[:, 0] ** 2 + V[:, 1] ** 2
        gain = (1 + e["lift"] * horizontal / (1 + 0.004 * horizontal)) * (1 + e["inflow"] * V[:, 2])
        height = np.maximum(self.height, 0.15)
        gain = gain / (1 - np.minimum(e["ground_radius2"] / (16 * height**2), 0.25))
        weak = np.array([1 - e[f"weak_{i}"] for i in range(T.shape[1])])
        T = T * gain[:, None] * weak
        Q = prop["torque_coefficient_n_m_s2"] * (1 + e["yaw_torque"]) * speed**2 * weak
        total = T.sum(1)
        x, y, s = (np.array(c) for c in zip(*[(*r["position_body_m"][:2], r["yaw_sign"]) for r in p["rotor"]]))
        airspeed = np.linalg.norm(V, axis=1, keepdims=True)
        F = -total[:, None] * np.array([e["tilt_0"], e["tilt_1"], 1.0])
        linear, area = np.array(p["drag"]["linear_n_s_per_m"]), p["drag"]["area_m2"] + e["quadratic_drag"]
        F = F - (linear + e["linear_drag"] * np.array([1, 1, 0])) * V - 0.5 * RHO * area * airspeed * V
        deployment = lagged(w_command, wing["time_constant_s"] + e["wing_lag"])
        slope = 0.5 * RHO * wing["area_per_side_m2"] * wing["normal_force_slope"] * (1 + e["wing_gain"])
        N = slope * airspeed * (V[:, 2:] + e["wing_angle"] * V[:, :1]) * deployment
        N = N * np.array([1 - e["wing_loss_0"], 1 - e["wing_loss_1"]])
        F[:, 2] -= N.sum(1)
        M = np.stack([-T @ y, T @ x, Q @ s], 1)
        M[:, 0] += wing["lateral_arm_m"] * (N[:, 0] - N[:, 1])
        cg = np.array([[e["cg_0"], e["cg_1"], 0.0]])
        M = M - np.cross(cg, F)
        M += e["flapping"] * np.stack([-V[:, 1], V[:, 0], 0 * total], 1)
        M -= e["damping"] * self.omega * np.array([1, 1, 0.5])
        if e["rotor_inertia"]:
            H = -(speed @ s)
            gyro = np.cross(self.omega, np.broadcast_to(E3, V.shape)) * H[:, None]
            M -= e["rotor_inertia"] * (gyro + np.gradient(low_pass(H), t)[:, None] * E3)
        f = F / (m * (1 + e["mass"]))
        if e["added_mass"]:
            sink = low_pass(self.force)[:, 2] + G * self.R[:, 2, 2] - np.cross(self.omega, body(self.v))[:, 2]
            f[:, 2] -= e["added_mass"] / m * sink
        for length in (0.35, 0.5, 0.7, 0.9):
            if e[f"payload_{length}"]:
                f = f + e[f"payload_{length}"] / m * body(self.pendulum(length))
        inertia = J * np.array([1 + e[f"inertia_{i}"] for i in range(3)])
        alpha = (M - np.cross(self.omega, J * self.omega)) / inertia
        bias = np.array([e[f"bias_{i}"] for i in range(3)])
        felt = self.acc - np.einsum("nij,j->ni", self.R, bias)
        felt = felt - np.cross(turn, felt)
        change = self.at_fixes(np.cumsum(felt, axis=0) / RATE_HZ, e["gnss_latency"])
        return f + bias, alpha, change

    def pendulum(self, length):
        """Acceleration of the vehicle times its mass per mass of a load on a tether, NED."""
        k, s, v, out = G / length, np.zeros(2), np.zeros(2), np.zeros((len(self.t), 3))
        out[:, 2] = G
        for i, a in enumerate(low_pass(self.acc)[:, :2]):
            v = v + (-k * s - 0.2 * v - a) / RATE_HZ
            s = s + v / RATE_HZ
            out[i, :2] = k * s
        return out

    def rows(self):
        """Left side and library of this flight: `(y, X)`, in units of each channel's noise."""
        alpha = np.stack([np.gradient(c, self.t) for c in self.omega.T], 1)
        edge = slice(150, -150, EVERY)
        cut = lambda f, a, k: [low_pass(f)[edge], low_pass(a)[edge], k[10:-10]]
        measured = cut(self.force, alpha, self.gnss_v[GNSS_WINDOW:] - self.gnss_v[:-GNSS_WINDOW])
        nominal = cut(*self.model())
        left = [a - b for a, b in zip(measured, nominal)]
        noise = [np.median(np.abs(np.diff(x, axis=0)), axis=0) / 0.954 + 1e-9 for x in left]
        stack = lambda parts: np.concatenate([(x / n).T.ravel() for x, n in zip(parts, noise)])
        columns = []
        for _, key, size in CATALOGUE:
            changed = cut(*self.model(**{key: size}))
            columns.append(stack([a - b for a, b in zip(changed, nominal)]))
        starts = np.concatenate([np.tile(np.linspace(0, 1, len(x)), 3) for x in left])
        return stack(left), np.stack(columns, 1), starts
