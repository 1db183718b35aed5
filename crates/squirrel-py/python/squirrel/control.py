"""Control laws of the flight code, for many vehicles at once (float32, the bits that fly)."""

from squirrel._squirrel import Backstepping, Twcc

__all__ = ["Backstepping", "Twcc"]
