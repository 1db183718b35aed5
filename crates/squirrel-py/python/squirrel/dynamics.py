"""The base model: rotors with lag, drag, rigid body, effects; for many motions at once (float64)."""

from squirrel._squirrel import derivative, rk4_step

__all__ = ["derivative", "rk4_step"]
