"""`mujoco.sysid` on a case: an MJCF model of the vehicle file, fitted to windows of the training flights from measured states.

The model is a free body in NED and FRD axes. Actuators on sites: one a rotor (force along its axis and the reaction moment
through `gear`), one a wing side, and six with a velocity bias for what of the drag and damping is of the body's axes; the rest of
the drag is MuJoCo's own fluid on a sphere, which knows the wind. Controls are rotor thrusts behind lag, delay and voltage and the
wings' nominal forces: a `custom_rollout` makes them from the logged commands, so that time constants and delay are parameters
like any other.

Residual: accelerometer and gyro of each window against the log, in units of their noise, by `modify_residual`. Optimiser:
MuJoCo's own, `x_scale="jac"`. A parameter may go as far as the catalogue's largest plausible size; the tolerances of the vehicle
file are rows of the residual, as regularisation, and serve to read the answer: a claim is a number beyond three tolerances with
zero outside the package's own 95 % interval.
"""

import io
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco import sysid

import physics
from flight import G_M_S2, Array, Piece, lines, smooth

WINDOW_S = 0.4
RATE_HZ = 100.0  # of rollouts; the faster log is averaged
WINDOWS = 60  # in all, spread over the training flights
ITERATIONS = 15
RADIUS_M = 0.03  # of the sphere that carries the fluid's forces


@dataclass
class Number:
    """A parameter of the fit: how it stands in the catalogue, its tolerance, and how far it may go."""

    name: str
    effect: str
    sd: float
    most: float


def numbers(p: dict, sd: dict) -> list[Number]:
    """What is fitted, as increments on the vehicle file; where the file has no tolerance, a quarter of a reportable size."""
    m, J = p["mass"]["mass_kg"], p["mass"]["inertia_kg_m2"]
    weight, turn = m / physics.CLASS_MASS_KG, float(np.mean(J[:2])) / physics.CLASS_INERTIA_KG_M2
    arm = float(np.hypot(*p["rotor"][0]["position_body_m"][:2]))
    prop, drag = sd["propulsion"], sd["drag"]
    share = prop["thrust_coefficient_n_s2"] / p["propulsion"]["thrust_coefficient_n_s2"]
    torque = prop["torque_coefficient_n_m_s2"] / p["propulsion"]["torque_coefficient_n_m_s2"]
    tau = p["propulsion"]["time_constant_s"]
    out = [Number("mass", "mass_error", sd["mass"]["mass_kg"] / m, 0.2)]
    out += [Number(f"inertia_{i}", "inertia_error", sd["mass"]["inertia_kg_m2"][i] / J[i], 0.4) for i in range(3)]
    out += [Number(f"cg_{i}", "cg_offset", 0.005 * arm, 0.1 * arm) for i in range(2)]
    out += [Number(f"thrust_{i}", "weak_rotor", 1.12 * share, 0.3) for i in range(len(p["rotor"]))]
    out += [Number("yaw_torque", "yaw_torque_coeff", torque, 0.4)]
    out += [Number(f"tilt_{i}", "thrust_misalignment", np.radians(0.25), np.radians(4)) for i in range(2)]
    out += [Number("linear_drag", "linear_drag", drag["linear_n_s_per_m"][0], 0.25 * weight)]
    out += [Number("drag_z", "linear_drag", drag["linear_n_s_per_m"][2], 0.25 * weight)]
    out += [Number("quadratic_drag", "quadratic_drag", max(drag["area_m2"], 5e-4 * weight), 0.05 * weight)]
    out += [Number(f"wind_{i}", "constant_wind", 0.375, 6.0) for i in range(2)]
    out += [Number("damping", "angular_damping", 1e-3 * turn, 0.03 * turn)]
    out += [Number("motor_lag", "motor_lag", prop["time_constant_s"], max(0.06, tau))]
    out += [Number("latency", "actuation_latency", 3.75e-3, 0.06)]
    out += [Number("sag", "battery_sag", 0.1, 1.0)]
    out += [Number(f"bias_{i}", "accel_bias", 0.02, 0.6) for i in range(3)]
    if "wing" in p:
        gain = sd["wing"]["area_per_side_m2"] / p["wing"]["area_per_side_m2"]
        out += [Number(f"wing_{i}", "wing_membrane", 1.5 * gain, 0.5) for i in range(2)]
        out += [Number("wing_lag", "wing_servo_lag", sd["wing"]["time_constant_s"], 0.5)]
    return out


def mjcf(p: dict, dt_s: float) -> mujoco.MjSpec:
    """The nominal vehicle. World NED, body FRD: gravity points along +z."""
    prop, drag, J = p["propulsion"], p["drag"], p["mass"]["inertia_kg_m2"]
    ratio = prop["torque_coefficient_n_m_s2"] / prop["thrust_coefficient_n_s2"]
    rotors, actuators = "", ""
    for i, r in enumerate(p["rotor"]):
        x, y, z = r["position_body_m"]
        rotors += f'<site name="rotor{i}" pos="{x} {y} {z}"/>'
        gear = f"0 0 -1 0 0 {r['yaw_sign'] * ratio}"
        actuators += f'<general name="rotor{i}" site="rotor{i}" gear="{gear}" gainprm="1"/>'
    arm = p.get("wing", {}).get("lateral_arm_m", 0.0)
    for i, y in enumerate((-arm, arm)):
        rotors += f'<site name="wing{i}" pos="0 {y} 0"/>'
        actuators += f'<general name="wing{i}" site="wing{i}" gear="0 0 -1 0 0 0" gainprm="1"/>'
    # With a gain of 0 a bias in the velocity would be taken for a damping ratio; the control of these stays 0.
    for i in range(3):
        push, turn = ["0"] * 6, ["0"] * 6
        push[i], turn[3 + i] = "1", "1"
        for name, gear in ((f"drag{i}", push), (f"damp{i}", turn)):
            actuators += (
                f'<general name="{name}" site="imu" gear="{" ".join(gear)}" gainprm="1" biastype="affine" biasprm="0 0 0"/>'
            )
    # MuJoCo has no half in front of the square.
    blunt = drag["area_m2"] / (2 * np.pi * RADIUS_M**2)
    viscosity = drag["linear_n_s_per_m"][0] / (6 * np.pi * RADIUS_M)
    return mujoco.MjSpec.from_string(f"""<mujoco><option timestep="{dt_s}" gravity="0 0 {G_M_S2}" density="{physics.RHO_KG_M3}"
        viscosity="{viscosity}" integrator="Euler"><flag contact="disable"/></option>
        <worldbody><body name="body"><freejoint/>
        <inertial pos="0 0 0" mass="{p["mass"]["mass_kg"]}" diaginertia="{J[0]} {J[1]} {J[2]}"/>
        <geom name="air" type="sphere" size="{RADIUS_M}" fluidshape="ellipsoid" fluidcoef="{blunt} 0 0 0 0"/>
        <site name="imu"/>{rotors}</body></worldbody><actuator>{actuators}</actuator>
        <sensor><accelerometer name="accelerometer" site="imu"/><gyro name="gyro" site="imu"/></sensor></mujoco>""")


def controls(piece: Piece, p: dict, e: dict[str, float]) -> Array:
    """Rotor thrusts and wing forces as the nominal model has them, behind the lags and delay of `e`."""
    still = defaultdict(float, {k: e[k] for k in ("motor_lag", "sag", "wing_lag") if k in e})
    thrust = p["propulsion"]["thrust_coefficient_n_s2"] * physics.rotor_speeds(piece, p, still) ** 2
    wings = physics.wing_forces(piece, p, physics.airspeed(piece, still), still)
    # The delay on lines, so that it has a derivative.
    late = lines(piece.t - e.get("latency", 0.0), piece.t, np.hstack([thrust, wings]))
    return np.hstack([late, np.zeros((len(piece.t), 6))])


class Fit:
    """A fitted model."""

    def __init__(self, p: dict, sd: dict, train: list[Piece]) -> None:
        self.p, self.numbers = p, numbers(p, sd)
        self.rotors = len(p["rotor"])
        stride = max(round(1 / (RATE_HZ * train[0].period_s)), 1)
        self.stride, self.dt_s = stride, stride * train[0].period_s
        self.spec = mjcf(p, self.dt_s)
        self.params = sysid.ParameterDict()
        tau = p["propulsion"]["time_constant_s"]
        lowest = {"motor_lag": 2e-3 - tau, "latency": 0.0, "wing_lag": 5e-3 - p.get("wing", {}).get("time_constant_s", 0.0)}
        lowest["linear_drag"] = -p["drag"]["linear_n_s_per_m"][0]
        lowest["quadratic_drag"] = -p["drag"]["area_m2"]
        for n in self.numbers:
            low = lowest.get(n.name, -n.most)
            # Scaled by the tolerance: the optimiser's steps of finite differences are absolute for small numbers.
            self.params.add(sysid.Parameter(n.name, 0.0, min(low, -1e-9) / n.sd, n.most / n.sd))
        self.params.move_off_bounds()
        self.train, self.windows = train, self.cut(train)
        self.solve()

    def value(self, params: sysid.ParameterDict) -> dict[str, float]:
        return {n.name: float(params[n.name].value[0]) * n.sd for n in self.numbers}

    def build(self, params: sysid.ParameterDict, spec: mujoco.MjSpec | None = None) -> mujoco.MjModel:
        """The model with its numbers moved."""
        spec, e, p = spec or self.spec, self.value(params), self.p
        body = spec.body("body")
        body.mass = p["mass"]["mass_kg"] * (1 + e["mass"])
        # Below 1 um the compiler builds a simpler body, without a derivative; 0.02 mm matters to nobody.
        body.ipos = [e["cg_0"], e["cg_1"], 2e-5]
        ratio = p["propulsion"]["torque_coefficient_n_m_s2"] / p["propulsion"]["thrust_coefficient_n_s2"]
        for i, r in enumerate(p["rotor"]):
            actuator = spec.actuator(f"rotor{i}")
            actuator.gainprm[0] = 1 + e[f"thrust_{i}"]
            actuator.gear = [-e["tilt_0"], -e["tilt_1"], -1, 0, 0, r["yaw_sign"] * ratio * (1 + e["yaw_torque"])]
        for i in range(2):
            spec.actuator(f"wing{i}").gainprm[0] = 1 + e.get(f"wing_{i}", 0.0)
        linear = np.array(p["drag"]["linear_n_s_per_m"])
        fluid = linear[0] + e["linear_drag"]
        own = linear + [e["linear_drag"], e["linear_drag"], e["drag_z"]] - fluid
        spec.option.viscosity = fluid / (6 * np.pi * RADIUS_M)
        spec.option.wind = [e["wind_0"], e["wind_1"], 0.0]
        spec.geom("air").fluid_coefs[0] = (p["drag"]["area_m2"] + e["quadratic_drag"]) / (2 * np.pi * RADIUS_M**2)
        for i in range(3):
            spec.actuator(f"drag{i}").biasprm[2] = -own[i]
            spec.actuator(f"damp{i}").biasprm[2] = -e["damping"] * (0.5 if i == 2 else 1.0)
        model = spec.compile()
        # The compiler refuses inertias that no body has, which steps of a fit may pass through.
        model.body_inertia[1] *= [1 + e[f"inertia_{i}"] for i in range(3)]
        mujoco.mj_setConst(model, mujoco.MjData(model))
        return model

    def mean(self, x: Array) -> Array:
        """One sample of `stride`, each the mean of those that it stands for: centred, but for controls."""
        n = len(x) // self.stride * self.stride
        return x[:n].reshape(-1, self.stride, x.shape[1]).mean(1)

    def cut(self, train: list[Piece]) -> list[tuple[int, int]]:
        """Piece and first sample of each window."""
        size = int(WINDOW_S / self.dt_s)
        all_starts = []
        for k, piece in enumerate(train):
            n = len(piece.t) // self.stride - 1
            all_starts += [(k, start) for start in range(20, n - size - 20, size)]
        self.size = size
        every = max(len(all_starts) / WINDOWS, 1.0)
        return [all_starts[int(i * every)] for i in range(int(len(all_starts) / every))]

    def sequences(self) -> list[sysid.SystemTrajectory]:
        """Windows as the package wants them: initial state, control, measured sensors."""
        model, mapping = self.build(self.params), None
        out = []
        measured, states = [], []
        for piece in self.train:
            # The middle of the samples that one of the rollout stands for.
            middle = piece.t[0] + piece.period_s * (self.stride - 1) / 2 + self.dt_s * np.arange(len(piece.t) // self.stride)
            # Rates are compared half a step earlier: where Euler's steps, which hold an acceleration ahead, put them.
            rates = lines(middle - self.dt_s / 2, piece.t, smooth(piece.omega, self.stride))
            measured.append(np.hstack([self.mean(piece.force), rates]))
            quiet = piece.low_pass(piece.omega)
            edge = (len(piece.omega) - len(quiet)) // 2
            omega = piece.omega.copy()
            omega[edge : edge + len(quiet)] = quiet
            q = lines(middle, piece.t, piece.q)
            q /= np.linalg.norm(q, axis=1, keepdims=True)
            states.append((q, np.hstack([lines(middle, piece.t, piece.v), lines(middle - self.dt_s / 2, piece.t, omega)])))
        mapping = sysid.TimeSeries.compute_all_sensor_mapping(model)
        for k, start in self.windows:
            q, v = states[k]
            qpos = np.concatenate([[0, 0, 0], q[start]])
            initial = sysid.create_initial_state(model, qpos, v[start])
            times = self.dt_s * np.arange(self.size)
            control = sysid.TimeSeries(times, np.zeros((self.size, model.nu)))
            sensors = sysid.TimeSeries(times, measured[k][start : start + self.size], mapping)
            out.append(sysid.SystemTrajectory(model, control, sensors, initial, None))
        return out

    def rollout(self, *, models: list, control_signal: Sequence, param_dicts: list, **given: object) -> Sequence:
        """The package's own rollout, with controls that follow lags, delay and voltage of each column."""
        filled, cache = [], {}
        for column, params in enumerate(param_dicts):
            e = self.value(params)
            key = tuple(e.get(k, 0.0) for k in ("motor_lag", "latency", "sag", "wing_lag"))
            if key not in cache:
                cache[key] = [self.mean(controls(piece, self.p, e)) for piece in self.train]
            for i, (k, start) in enumerate(self.windows):
                times = control_signal[column * len(self.windows) + i].times
                filled.append(sysid.TimeSeries(times, cache[key][k][start : start + self.size]))
        return sysid.sysid_rollout(models=models, control_signal=filled, **given)

    def solve(self) -> None:
        """Least squares by the package."""
        windows = self.sequences()
        raw = [np.hstack([p.force, p.omega]) for p in self.train]
        noise = np.sqrt(np.mean([np.median(np.diff(x, 3, axis=0) ** 2, axis=0) / 9.1 for x in raw], axis=0) / self.stride)
        noise = np.maximum(noise, 1e-4)

        def modify(params: object, predicted: object, measured: object, *_: object, **__: object) -> tuple:
            # The sensors of a step are those of the state before it.
            rows = measured.data[: len(predicted.data)]
            bias = np.array([self.value(params)[f"bias_{i}"] for i in range(3)])
            difference = predicted.data - rows
            difference[:, :3] += bias
            return difference / noise, measured, measured

        def residual(x: Array, params: sysid.ParameterDict, **_: object) -> tuple:
            rows, predicted, records = sysid.model_residual(
                x,
                params,
                self.build,
                windows,
                modify_residual=modify,
                custom_rollout=self.rollout,
                n_threads=1,
                resample_true=False,
            )
            # One column a point of finite differences, its windows below one another.
            rows = rows.T.reshape(x.shape[1], -1).T if x.ndim > 1 else rows
            # The tolerances as regularisation: without them the mass and all forces can grow together.
            rows = np.concatenate([rows, x])
            return [rows], [predicted], [records]

        found, result = sysid.optimize(
            initial_params=self.params,
            residual_fn=residual,
            optimizer="mujoco",
            verbose=False,
            max_iters=ITERATIONS,
            x_scale="jac",
            eps=1e-3,
            xtol=1e-3,
            output=io.StringIO(),
        )
        self.params = found
        x = found.as_vector()
        at_end = residual(x, found.copy())[0]
        _, half = sysid.calculate_intervals(at_end, np.asarray(result.jac))
        self.half = np.asarray(half)
        self.params.update_from_vector(x)
        self.e = self.value(self.params)

    def predict(self, piece: Piece) -> Array:
        """Specific force and angular acceleration at each sample from the measured state, by `mj_forward`."""
        model = self.build(self.params)
        data, u = mujoco.MjData(model), controls(piece, self.p, self.e)
        out = np.empty((len(piece.t), 6))
        for k in range(len(piece.t)):
            data.qpos[3:7], data.qvel[:3], data.qvel[3:6] = piece.q[k], piece.v[k], piece.omega[k]
            data.ctrl[:] = u[k]
            mujoco.mj_forward(model, data)
            out[k, :3], out[k, 3:] = data.sensordata[:3], data.qacc[3:6]
        out[:, :3] += [self.e[f"bias_{i}"] for i in range(3)]
        return out

    def claims(self) -> tuple[int, list[str]]:
        """Parameters beyond three tolerances whose interval excludes the nominal, and their effects, the clearest first."""
        x = np.abs(self.params.as_vector())
        sure = (x > 3) & (x > self.half)
        score = x / np.sqrt(1 + (self.half / 1.96) ** 2)
        weight: dict[str, float] = {}
        for n, ok, s in zip(self.numbers, sure, score, strict=True):
            if ok:
                weight[n.effect] = max(weight.get(n.effect, 0.0), float(s))
        thrusts = [ok for n, ok in zip(self.numbers, sure, strict=True) if n.effect == "weak_rotor"]
        if len(thrusts) > 1 and sum(thrusts) > len(thrusts) / 2:
            # All rotors alike are the coefficient.
            weight["thrust_coefficient"] = weight.pop("weak_rotor")
        wings = [ok for n, ok in zip(self.numbers, sure, strict=True) if n.effect == "wing_membrane"]
        if sum(wings) == 1:
            weight["wing_asymmetry"] = weight.pop("wing_membrane")
        return int(sure.sum()), sorted(weight, key=lambda name: -weight[name])
