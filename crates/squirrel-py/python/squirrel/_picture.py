"""What environments look like from above: a picture, or text. NumPy draws it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

__all__ = ["picture", "text"]

Numbers = NDArray[np.float32]

PIXELS = 240
"""Of each side."""
SPAN_M = 24.0
"""Seen from side to side; the vehicle is in the middle, north is up."""
GRID_M = 5.0
HEIGHT_M = 6.0
"""Above and below the reference, of the bar on the right."""
COLUMNS, ROWS = 48, 24

GROUND, LINE, TRUNK = (243, 244, 240), (222, 224, 218), (120, 84, 52)
WANTED, BODY, FRONT = (42, 111, 187), (40, 40, 40), (210, 70, 40)


def _heading(state: Numbers) -> float:
    w, x, y, z = (float(q) for q in state[6:10])
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def picture(state: Numbers, wanted: Numbers, obstacles: Numbers) -> NDArray[np.uint8]:
    """Draw one environment.

    Parameters
    ----------
    state : ndarray of float32, shape (17,)
        As `squirrel.Tasks.states` gives it.
    wanted : ndarray of float32, shape (3,)
        Where the vehicle should be, NED, m.
    obstacles : ndarray of float32, shape (n, 3)
        North, east, radius, m.

    Returns
    -------
    ndarray of uint8, shape (240, 240, 3)
    """
    scale = SPAN_M / PIXELS
    along = (np.arange(PIXELS) + 0.5) * scale - 0.5 * SPAN_M
    # A vehicle that is lost may be no number any more.
    middle = np.nan_to_num(state[:2].astype(np.float64), posinf=0.0, neginf=0.0)
    north, east = np.meshgrid(middle[0] - along, middle[1] + along, indexing="ij")
    image = np.empty((PIXELS, PIXELS, 3), np.uint8)
    image[:] = GROUND
    image[(north % GRID_M < scale) | (east % GRID_M < scale)] = LINE

    def disc(at_north: float, at_east: float, radius: float, color: tuple[int, int, int], inner: float = 0.0) -> None:
        away = np.hypot(north - at_north, east - at_east)
        image[(away <= radius) & (away >= inner)] = color

    for o in obstacles:
        disc(float(o[0]), float(o[1]), float(o[2]), TRUNK)
    disc(float(wanted[0]), float(wanted[1]), 0.45, WANTED, 0.3)
    heading = _heading(state)
    for corner in range(4):
        angle = heading + math.pi * (0.25 + 0.5 * corner)
        color = FRONT if corner in (0, 3) else BODY
        disc(middle[0] + 0.35 * math.cos(angle), middle[1] + 0.35 * math.sin(angle), 0.2, color)
    disc(middle[0], middle[1], 0.15, BODY)
    # Too low or too high: a bar from the middle of the right side.
    above = float(np.nan_to_num(wanted[2] - state[2]))
    end = round(PIXELS / 2 * (1.0 - max(-1.0, min(1.0, above / HEIGHT_M))))
    low, high = sorted((PIXELS // 2, end))
    image[low : high + 1, -6:] = FRONT
    image[PIXELS // 2, -10:] = WANTED
    return image


def text(state: Numbers, wanted: Numbers, obstacles: Numbers) -> str:
    """Write one environment: a map (V vehicle, + reference, O trunk; north is up) and a line of numbers.

    Parameters
    ----------
    state, wanted, obstacles
        As for `picture`.

    Returns
    -------
    str
    """
    lines = [[" "] * COLUMNS for _ in range(ROWS)]

    def put(north: float, east: float, mark: str) -> None:
        row = ROWS // 2 - (north - float(state[0])) * ROWS / SPAN_M
        column = COLUMNS // 2 + (east - float(state[1])) * COLUMNS / SPAN_M
        if 0.0 <= row < ROWS and 0.0 <= column < COLUMNS:
            lines[int(row)][int(column)] = mark

    for o in obstacles:
        put(float(o[0]), float(o[1]), "O")
    put(float(wanted[0]), float(wanted[1]), "+")
    put(float(state[0]), float(state[1]), "V")
    speed = float(np.linalg.norm(state[3:6]))
    away = float(np.linalg.norm(wanted - state[:3]))
    edge = "+" + "-" * COLUMNS + "+"
    numbers = f"height {-state[2]:.2f} m  speed {speed:.2f} m/s  from reference {away:.2f} m"
    return "\n".join([edge, *(f"|{''.join(line)}|" for line in lines), edge, numbers]) + "\n"
