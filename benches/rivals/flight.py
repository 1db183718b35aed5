"""Vehicle files and flight logs for all three tools, and the one measure of held-out error.

    E_c = rms LP[ measured - predicted ] / noise_c       c: specific force x y z (m/s^2), angular acceleration x y z (rad/s^2)
    E   = sqrt( mean_c E_c^2 )                           LP: the 12 Hz zero-phase low-pass of `squirrel gap find`

`noise_c` is what the log's own white noise leaves behind the same filter, from third differences of what the IMU said, so that
no model has a part in it. The angular acceleration is a five-point difference of the gyro.
"""

import tomllib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

G_M_S2 = 9.80665
CUTOFF_HZ = 12.0
HALF_LENGTH_S = 0.2
REACH = 2  # samples on each side that the derivative looks at
GAP_PERIODS = 5  # without a sample for so long, a flight is cut

Array = np.ndarray


def read_log(path: Path) -> dict[str, dict[str, Array]]:
    """Sources of a flight log: `{topic: {"time_s": ..., channel: array}}`."""
    rows: dict[str, dict[str, list]] = {}
    with open(path, "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages():
            source = rows.setdefault(channel.topic, {})
            for field in message.DESCRIPTOR.fields:
                value = getattr(message, field.name)
                source.setdefault(field.name, []).append(value if isinstance(value, float) else list(value))
    return {
        topic: {name: np.array(values) for name, values in source.items() if name != "crc32"} for topic, source in rows.items()
    }


def read_vehicle(path: Path, key: str = "value") -> dict:
    """The numbers of a vehicle file, or with `key="sd"` their tolerances; what has none is left out."""

    def plain(x: object) -> object:
        if isinstance(x, dict):
            if "value" in x:
                return x.get(key)
            return {name: plain(value) for name, value in x.items()}
        return [plain(value) for value in x] if isinstance(x, list) else x

    return plain(tomllib.loads(Path(path).read_text()))


def rotations(q_wxyz: Array) -> Array:
    """NED from body, one 3x3 matrix a row."""
    w, x, y, z = q_wxyz.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def lines(at_s: Array, time_s: Array, values: Array) -> Array:
    """Each column on lines between its samples."""
    return np.stack([np.interp(at_s, time_s, column) for column in values.T], 1)


def held(at_s: Array, time_s: Array, values: Array) -> Array:
    """Commands, held until the next one."""
    return values[np.clip(np.searchsorted(time_s, at_s + 1e-9) - 1, 0, len(values) - 1)]


def smooth(x: Array, count: int) -> Array:
    """Moving mean of the columns, the ends held."""
    window = np.ones(count) / count
    return np.stack([np.convolve(np.pad(c, count, "edge"), window, "same")[count:-count] for c in x.T], 1)


@dataclass
class Piece:
    """A stretch of a flight without gaps on the uniform clock of its IMU."""

    t: Array
    period_s: float
    omega: Array
    force: Array
    q: Array
    v: Array
    height: Array
    volt: Array
    log: dict[str, dict[str, Array]]

    @cached_property
    def R(self) -> Array:
        return rotations(self.q)

    @cached_property
    def taps(self) -> Array:
        """Windowed sinc, as `squirrel gap find` has it."""
        half = int(HALF_LENGTH_S / self.period_s + 0.5)
        i = np.arange(-half, half + 1)
        taps = np.sinc(2 * CUTOFF_HZ * self.period_s * i) * (0.54 + 0.46 * np.cos(np.pi * i / half))
        return taps / taps.sum()

    @property
    def edge(self) -> int:
        return len(self.taps) // 2 + REACH

    @cached_property
    def alpha(self) -> Array:
        """Angular acceleration; the first and last two samples have none."""
        kernel = np.array([-1.0, 8.0, 0.0, -8.0, 1.0]) / (12 * self.period_s)
        return np.stack([np.convolve(c, kernel, "same") for c in self.omega.T], 1)

    def low_pass(self, x: Array) -> Array:
        """Without the edges that filter and derivative cost."""
        inner = x[REACH:-REACH]
        size = 1 << (len(inner) + len(self.taps)).bit_length()
        taps = np.fft.rfft(self.taps, size)[:, None]
        full = np.fft.irfft(np.fft.rfft(inner, size, axis=0) * taps, size, axis=0)
        return full[len(self.taps) - 1 : len(inner)]

    @cached_property
    def measured(self) -> Array:
        """Specific force and angular acceleration, low-passed, one column a channel."""
        return self.low_pass(np.hstack([self.force, self.alpha]))

    @cached_property
    def noise(self) -> Array:
        """What white noise of this log leaves behind the filter, by channel."""

        def white(x: Array) -> Array:
            return np.sqrt(np.median(np.diff(x, 3, axis=0) ** 2, axis=0) / 0.4549 / 20)

        kernel = np.convolve(self.taps, np.array([-1.0, 8.0, 0.0, -8.0, 1.0]) / (12 * self.period_s))
        force = white(self.force) * np.linalg.norm(self.taps)
        return np.concatenate([force, white(self.omega) * np.linalg.norm(kernel)])


def motion(log: dict, t: Array, R: Array, force: Array, period_s: float, late_s: float = 0.0) -> tuple[Array, Array]:
    """Velocity and height: strapdown, held by GNSS, whose fixes may be late, and by the barometer where these are slow."""
    gnss = log["gnss"]
    fix_t, fix_v = gnss["time_s"] - late_s, gnss["velocity_ned_m_s"]
    if np.median(np.diff(fix_t)) < 2 * period_s:
        return lines(t, fix_t, fix_v), -np.interp(t, fix_t, gnss["position_ned_m"][:, 2])
    acceleration = np.einsum("nij,nj->ni", R, force) + np.array([0, 0, G_M_S2])
    strapdown = np.cumsum(acceleration, axis=0) * period_s
    drift = smooth(fix_v - lines(fix_t, t, strapdown), 15)
    v = strapdown + lines(t, fix_t, drift)
    climb = np.cumsum(-v[:, 2]) * period_s
    baro = log["baro"]
    offset = smooth((baro["altitude_m"] - np.interp(baro["time_s"], t, climb))[:, None], 250)[:, 0]
    return v, climb + np.interp(t, baro["time_s"], offset)


def read_flight(path: Path) -> list[Piece]:
    """A log in pieces."""
    log = read_log(path)
    imu, attitude, battery = log["imu"], log["attitude"], log["battery"]
    time_s = imu["time_s"]
    period_s = float(np.median(np.diff(time_s)))
    q = attitude["q_ned_from_body_wxyz"].copy()
    sign = np.cumprod(np.where(np.sum(q[1:] * q[:-1], axis=1) < 0, -1.0, 1.0))
    q[1:] *= sign[:, None]
    pieces = []
    for part in np.split(time_s, np.flatnonzero(np.diff(time_s) > GAP_PERIODS * period_s) + 1):
        t = part[0] + period_s * np.arange(int((part[-1] - part[0]) / period_s + 1e-6) + 1)
        if len(t) * period_s < 4 * HALF_LENGTH_S:
            continue
        omega = lines(t, time_s, imu["omega_body_rad_s"])
        force = lines(t, time_s, imu["specific_force_body_m_s2"])
        at = lines(t, attitude["time_s"], q)
        at /= np.linalg.norm(at, axis=1, keepdims=True)
        v, height = motion(log, t, rotations(at), force, period_s)
        quarter_s = max(int(0.25 / period_s), 1)
        volt = smooth(np.interp(t, battery["time_s"], battery["voltage_v"])[:, None], quarter_s)[:, 0]
        pieces.append(Piece(t, period_s, omega, force, at, v, height, volt, log))
    return pieces


def errors(pieces: list[Piece], predicted: list[Array]) -> Array:
    """`E_c` of each channel; `predicted` is specific force and angular acceleration at each sample of each piece."""
    squared, samples = np.zeros(6), 0
    noise = np.sqrt(np.mean([p.noise**2 for p in pieces], axis=0))
    for piece, prediction in zip(pieces, predicted, strict=True):
        left = piece.measured - piece.low_pass(prediction)
        squared += (left**2).sum(0)
        samples += len(left)
    return np.sqrt(squared / samples) / noise


def total(channels: Array) -> float:
    """`E` of some channels."""
    return float(np.sqrt(np.mean(np.square(channels))))
