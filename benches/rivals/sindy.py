"""PySINDy on a case: what the nominal model leaves, by sparse regression on a library.

    (measured - nominal) / noise = Theta xi         channel by channel, both sides behind the 12 Hz low-pass, 30 Hz

Two libraries. `polynomial` is what the package offers: all products of two of the nominal forces and moments, velocity, rates,
voltage, height and wing force, one sparse vector a channel. `catalogue` is what it could be given at best: one column a parameter
of squirrel's own catalogue, by finite differences of the nominal model, so that lags and latencies have columns too, with one
number in front for all channels. The threshold and ridge of STLSQ are those with the least error in cross-validation over blocks
of the training flights, nothing among them.
"""

import warnings
from collections import defaultdict
from collections.abc import Callable
from itertools import product

import numpy as np
import pysindy

import physics
from flight import Array, Piece

RATE_HZ = 30.0
BLOCKS = 6  # of a flight
THRESHOLDS = {"polynomial": np.geomspace(0.1, 3.0, 6), "catalogue": np.geomspace(0.1, 3.0, 8)}
RIDGES = (0.05, 1.0)

warnings.filterwarnings("ignore", message="Sparsity parameter is too big")


def inputs(piece: Piece, p: dict, nominal: Array) -> Array:
    """What the polynomial library is made of, each of size one or so."""
    still = defaultdict(float)
    V, N = physics.airspeed(piece, still), nominal[:, 3:]
    wings = physics.wing_forces(piece, p, V, still) / p["mass"]["mass_kg"]
    voltage = 10 * (piece.volt / p["propulsion"]["reference_voltage_v"] - 1)
    height = 1 / np.maximum(piece.height, 0.3) ** 2
    thrust = nominal[:, 2] / 9.81
    return np.column_stack([V / 3, piece.omega, nominal[:, :2], thrust, N / 10, voltage, height, wings])


NAMES = ["u", "v", "w", "p", "q", "r", "fx", "fy", "fz", "mx", "my", "mz", "volt", "1/h2", "left", "right"]


class Polynomial:
    """Products of two of the inputs; a model a channel."""

    name = "polynomial"
    channels = 6

    def __init__(self, vehicle: dict, _: list[Piece]) -> None:
        self.p = vehicle
        self.library = pysindy.PolynomialLibrary(degree=2, include_bias=True)

    def columns(self, piece: Piece) -> list[Array]:
        x = inputs(piece, self.p, physics.predict(piece, self.p))
        theta = np.asarray(self.library.fit_transform(x))
        return [theta] * 6

    def terms(self) -> list[str]:
        return self.library.get_feature_names(NAMES)


class Catalogue:
    """Effects of the catalogue in their smallest sizes worth reporting; one model for all channels."""

    name = "catalogue"
    channels = 1

    def __init__(self, vehicle: dict, pieces: list[Piece]) -> None:
        self.p = vehicle
        rotors = len(vehicle["rotor"])
        keys = [(effect, key, physics.size_on(vehicle, key, size)) for effect, key, size in physics.CATALOGUE]
        keys = [k for k in keys if not k[1].startswith("weak_") or int(k[1][5:]) < rotors]
        if "wing" not in vehicle:
            keys = [k for k in keys if not k[0].startswith("wing_")]
        self.keys = keys

    def columns(self, piece: Piece) -> list[Array]:
        nominal = physics.predict(piece, self.p)
        changed = [physics.predict(piece, self.p, {key: size}) - nominal for _, key, size in self.keys]
        return [np.stack([c[:, i] for c in changed], 1) for i in range(6)]

    def terms(self) -> list[str]:
        return [effect for effect, _, _ in self.keys]


class Fit:
    """A library with coefficients."""

    def __init__(self, kind: Callable[[dict, list[Piece]], Polynomial | Catalogue], p: dict, train: list[Piece]) -> None:
        self.p, self.library = p, kind(p, train)
        self.noise = np.sqrt(np.mean([piece.noise**2 for piece in train], axis=0))
        groups = self.blocks(train)
        whole = [np.linalg.qr(np.concatenate(group), mode="r") for group in groups]
        rms = [np.sqrt((r[:, :-1] ** 2).sum(0)) for r in whole]
        self.scale = [np.where(x > 0, x, 1.0) for x in rms]
        self.rows = [sum(len(b) for b in group) for group in groups]
        self.settings, self.coefficients = [], []
        for model, (group, rows) in enumerate(zip(groups, whole, strict=True)):
            thirds = [[b for i, b in enumerate(group) if i % 3 == out] for out in range(3)]
            folds = [
                (np.linalg.qr(np.concatenate([b for j in range(3) if j != i for b in thirds[j]]), mode="r"), thirds[i])
                for i in range(3)
            ]
            settings = [*product(THRESHOLDS[self.library.name], RIDGES), (np.inf, 0.0)]
            best = min(settings, key=lambda setting: self.left_out(folds, model, *setting))
            self.settings.append((float(best[0]), best[1]))
            self.coefficients.append(self.sparse(rows, model, *best))

    def blocks(self, train: list[Piece]) -> list[list[Array]]:
        """For each model the rows of each block, rotated to as many as there are columns: same squares, less work."""
        groups: list[list[Array]] = [[] for _ in range(self.library.channels)]
        for piece in train:
            left = (piece.measured - piece.low_pass(physics.predict(piece, self.p))) / self.noise
            every = max(round(1 / (RATE_HZ * piece.period_s)), 1)
            theta = [piece.low_pass(c)[::every] / self.noise[i] for i, c in enumerate(self.library.columns(piece))]
            for part in np.array_split(np.arange(len(theta[0])), BLOCKS):
                rows = [np.column_stack([theta[i][part], left[::every][part, i]]) for i in range(6)]
                if self.library.channels == 1:
                    rows = [np.concatenate(rows)]
                for group, block in zip(groups, rows, strict=True):
                    # A block with fewer rows than columns is small as it is.
                    group.append(np.linalg.qr(block, mode="r") if len(block) > block.shape[1] else block)
        return groups

    def sparse(self, rows: Array, model: int, threshold: float, ridge: float) -> Array:
        """Coefficients by STLSQ: polynomial terms as normalised columns, effects in reportable sizes."""
        if not np.isfinite(threshold):
            return np.zeros(rows.shape[1] - 1)
        # The threshold of a normalised column is the root mean square that its term has, in units of noise.
        scale = self.scale[model] / np.sqrt(max(self.rows[model], 1)) if self.library.name == "polynomial" else 1.0
        optimizer = pysindy.STLSQ(threshold=threshold, alpha=ridge, max_iter=20)
        optimizer.fit(rows[:, :-1] / scale, rows[:, -1:])
        return optimizer.coef_[0] / scale

    def left_out(self, folds: list[tuple[Array, list[Array]]], model: int, threshold: float, ridge: float) -> float:
        """Squared error on one third of the blocks after another, by the other two."""
        error = 0.0
        for rest, out in folds:
            xi = np.append(self.sparse(rest, model, threshold, ridge), -1.0)
            error += sum(float(((block @ xi) ** 2).sum()) for block in out)
        return error

    def predict(self, piece: Piece) -> Array:
        """Specific force and angular acceleration."""
        xi = self.coefficients * 6 if self.library.channels == 1 else self.coefficients
        add = [c @ x for c, x in zip(self.library.columns(piece), xi, strict=True)]
        return physics.predict(piece, self.p) + np.stack(add, 1)

    def claims(self) -> tuple[int, list[str]]:
        """Number of terms, and for the catalogue the effects of half a reportable size or more, the largest share first."""
        terms = sum(int((xi != 0).sum()) for xi in self.coefficients)
        if self.library.channels != 1:
            return terms, []
        xi, names = self.coefficients[0], self.library.terms()
        weight: dict[str, float] = {}
        for name, x, rms in zip(names, xi, self.scale[0], strict=True):
            if abs(x) >= 0.5:
                weight[name] = weight.get(name, 0.0) + (x * rms) ** 2
        return terms, sorted(weight, key=lambda name: -weight[name])
