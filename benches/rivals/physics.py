"""The nominal model of a vehicle file in NumPy, with every effect of the catalogue as an increment.

It predicts specific force and angular acceleration along a flight from the logged motion and commands (docs/equations.md). All
three tools start from it: SINDy takes its columns by finite differences of it, MuJoCo its rotor speeds and wing forces, and the
vehicle file that squirrel hands over is evaluated with it, too, as a check of `squirrel gap find`.
"""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from flight import G_M_S2, Array, Piece, held, motion, rotations

RHO_KG_M3 = 1.225
E3 = np.array([0.0, 0.0, 1.0])
STEP_S = 1.2e-3  # of the lags
SWING_1_S = 0.2  # damping of a load on a tether
TETHERS_M = (0.35, 0.5, 0.7, 0.9)

# Effect, key of the model, smallest size worth reporting on 0.55 kg. Several lines of one effect are its parameters.
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
    + [("payload_swing", f"payload_{length}", 0.03) for length in TETHERS_M]
)
# Sizes that are masses, forces or moments grow with the vehicle.
OF_WEIGHT = {"linear_drag", "quadratic_drag", "added_mass", *(f"payload_{length}" for length in TETHERS_M)}
OF_INERTIA = {"flapping", "rotor_inertia", "damping"}
CLASS_MASS_KG, CLASS_INERTIA_KG_M2 = 0.55, 4e-3


def size_on(vehicle: dict, key: str, size: float) -> float:
    """A reportable size on this vehicle."""
    if key in OF_WEIGHT:
        return size * vehicle["mass"]["mass_kg"] / CLASS_MASS_KG
    if key in OF_INERTIA:
        return size * float(np.mean(vehicle["mass"]["inertia_kg_m2"][:2])) / CLASS_INERTIA_KG_M2
    return size


def behind(piece: Piece, source: str, tau_s: float, e: Mapping[str, float], scale: Array | float = 1.0) -> Array:
    """What a first-order lag makes of held commands, settled at the first; `scale` is of each sample, or of all."""
    steps = max(int(np.ceil(piece.period_s / STEP_S)), 1)
    dt_s = piece.period_s / steps
    t = piece.t[0] + dt_s * np.arange(1 - steps, steps * (len(piece.t) - 1) + 1) - 0.5 * dt_s
    late = t - e["latency"] + e["skew"] * (t - piece.t[0])
    log = piece.log[source]
    target = np.clip(held(late, log["time_s"], log["command"]), 0.0, 1.0)
    target = target * np.repeat(np.broadcast_to(scale, (len(piece.t), 1)), steps, axis=0)
    keep = np.exp(-dt_s / max(tau_s, 1e-4))
    return lfilter([1 - keep], [1, -keep], target, axis=0, zi=keep * target[:1])[0][steps - 1 :: steps]


def rotor_speeds(piece: Piece, p: dict, e: Mapping[str, float]) -> Array:
    """Of each rotor behind its lag, rad/s."""
    prop = p["propulsion"]
    top = prop["speed_max_rad_s"] * (piece.volt / prop["reference_voltage_v"]) ** e["sag"]
    return behind(piece, "rotor", prop["time_constant_s"] + e["motor_lag"], e, top[:, None])


def wing_forces(piece: Piece, p: dict, V: Array, e: Mapping[str, float]) -> Array:
    """Normal force of the left and the right wing, N, upwards along -z."""
    wing = p.get("wing")
    if wing is None or "wing" not in piece.log:
        return np.zeros((len(piece.t), 2))
    deployment = behind(piece, "wing", wing["time_constant_s"] + e["wing_lag"], e)
    slope = 0.5 * RHO_KG_M3 * wing["area_per_side_m2"] * wing["normal_force_slope"] * (1 + e["wing_gain"])
    speed = np.linalg.norm(V, axis=1, keepdims=True)
    roll = piece.omega[:, :1] * wing["lateral_arm_m"] * np.array([-1.0, 1.0])
    N = slope * speed * (V[:, 2:] + roll + e["wing_angle"] * V[:, :1]) * deployment
    return N * np.array([1 - e["wing_loss_0"], 1 - e["wing_loss_1"]])


def airspeed(piece: Piece, e: Mapping[str, float]) -> Array:
    """Velocity through the air, body frame."""
    return np.einsum("nji,nj->ni", piece.R, piece.v - np.array([e["wind_0"], e["wind_1"], 0.0]))


def pendulum(piece: Piece, length_m: float) -> Array:
    """Force of a load on a tether per mass of the load, NED."""
    k, s, v = G_M_S2 / length_m, np.zeros(2), np.zeros(2)
    out = np.zeros((len(piece.t), 3))
    out[:, 2] = G_M_S2
    acceleration = np.einsum("nij,nj->ni", piece.R, piece.force)
    for i, a in enumerate(acceleration[:, :2]):
        v = v + (-k * s - SWING_1_S * v - a) * piece.period_s
        s = s + v * piece.period_s
        out[i, :2] = k * s
    return out


def unbiased(piece: Piece, e: Mapping[str, float]) -> Piece:
    """The motion with what a heading error and late fixes make of it taken away."""
    if not (e["heading"] or e["gnss_latency"]):
        return piece
    half = -0.5 * e["heading"]
    w, x, y, z = piece.q.T
    c, s = np.cos(half), np.sin(half)
    q = np.stack([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w], 1)
    v, height = motion(piece.log, piece.t, rotations(q), piece.force, piece.period_s, e["gnss_latency"])
    return replace(piece, q=q, v=v, height=height)


def predict(piece: Piece, p: dict, given: Mapping[str, float] | None = None) -> Array:
    """Specific force and angular acceleration at each sample, body frame, with effects of the given sizes."""
    e: Mapping[str, float] = defaultdict(float, given or {})
    piece = unbiased(piece, e)
    m, J = p["mass"]["mass_kg"] * (1 + e["mass"]), np.array(p["mass"]["inertia_kg_m2"])
    J = J * (1 + np.array([e[f"inertia_{i}"] for i in range(3)]))
    prop, drag, omega = p["propulsion"], p["drag"], piece.omega
    speed, V = rotor_speeds(piece, p, e), airspeed(piece, e)
    horizontal = V[:, 0] ** 2 + V[:, 1] ** 2
    gain = (1 + e["lift"] * horizontal / (1 + 0.004 * horizontal)) * (1 + e["inflow"] * V[:, 2])
    if e["ground_radius2"]:
        least = max(abs(e["ground_radius2"]), 1e-6) ** 0.5 / 2
        gain = gain / (1 - e["ground_radius2"] / (16 * np.maximum(piece.height, least) ** 2))
    rotors = range(speed.shape[1])
    weak = np.array([1 - e[f"weak_{i}"] for i in rotors])
    own = [np.array([r.get(f"{what}_fraction", 1.0) for r in p["rotor"]]) for what in ("thrust", "torque")]
    T = prop["thrust_coefficient_n_s2"] * (1 + e["thrust"]) * speed**2 * gain[:, None] * weak * own[0]
    torque = np.array([1 + e[f"torque_{i}"] for i in rotors]) * weak * own[1]
    Q = prop["torque_coefficient_n_m_s2"] * (1 + e["yaw_torque"]) * speed**2 * torque
    x = np.array([r["position_body_m"][0] + e[f"arm_{i}_0"] for i, r in enumerate(p["rotor"])])
    y = np.array([r["position_body_m"][1] + e[f"arm_{i}_1"] for i, r in enumerate(p["rotor"])])
    s = np.array([r["yaw_sign"] for r in p["rotor"]])
    F = -T.sum(1)[:, None] * np.array([e["tilt_0"], e["tilt_1"], 1.0])
    linear = np.array(drag["linear_n_s_per_m"]) + e["linear_drag"] * np.array([1, 1, 0])
    linear = linear + np.array([e[f"drag_{i}"] for i in range(3)])
    area = drag["area_m2"] + e["quadratic_drag"]
    F = F - linear * V - 0.5 * RHO_KG_M3 * area * np.linalg.norm(V, axis=1, keepdims=True) * V
    N = wing_forces(piece, p, V, e)
    F[:, 2] -= N.sum(1)
    M = np.stack([-T @ y, T @ x, Q @ s], 1)
    M[:, 0] += p.get("wing", {}).get("lateral_arm_m", 0.0) * (N[:, 0] - N[:, 1])
    M -= np.cross(np.array([[e["cg_0"], e["cg_1"], 0.0]]), F)
    M += e["flapping"] * np.stack([-V[:, 1], V[:, 0], 0 * V[:, 0]], 1)
    M -= e["damping"] * omega * np.array([1, 1, 0.5])
    if e["rotor_inertia"]:
        H = -(speed @ s)
        M -= e["rotor_inertia"] * (
            np.cross(omega, np.broadcast_to(E3, V.shape)) * H[:, None] + np.gradient(H, piece.period_s)[:, None] * E3
        )
    f = F / m
    if e["added_mass"]:
        sink = piece.force[:, 2] + G_M_S2 * piece.R[:, 2, 2]
        sink = sink - np.cross(omega, np.einsum("nji,nj->ni", piece.R, piece.v))[:, 2]
        f[:, 2] -= e["added_mass"] / m * sink
    for key, mass_kg in list(e.items()):
        if key.startswith("payload_") and mass_kg:
            load = pendulum(piece, float(key.removeprefix("payload_")))
            f = f + mass_kg / m * np.einsum("nji,nj->ni", piece.R, load)
    # The accelerometer stays where it was: beside the centre of mass it feels the vehicle turn about it.
    lever = np.broadcast_to(-np.array([e["cg_0"], e["cg_1"], 0.0]), V.shape)
    f = f + np.cross(piece.alpha, lever) + np.cross(omega, np.cross(omega, lever))
    f = f + np.array([e[f"bias_{i}"] for i in range(3)])
    return np.hstack([f, (M - np.cross(omega, J * omega)) / J])
