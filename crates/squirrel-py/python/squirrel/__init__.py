"""A flight stack for multirotors that change shape.

Vehicles (`Vehicle`), flights in closed loop (`simulate`) and logs, whoever wrote them (`FlightLog`, `read_log`), many vehicles at once (`Batch`,
`rollout`), the flight code itself (`Stack`, `squirrel.control`), the base model (`squirrel.dynamics`), learned models of the wing
force (`squirrel.nn`), environments in which policies learn (`Tasks`; `squirrel.envs` for Gymnasium) and policies that fly (`Policy`), what
wings make reachable (`squirrel.plan`), and what a model lacks (`squirrel.gap`). `squirrel.plot` needs matplotlib, `squirrel.torch` PyTorch.

SI units and radians; world NED, body FRD, quaternions Hamilton, body to NED, w x y z. Functions are batched over the first axis.
Arrays that come in may be of any library that speaks DLPack, PyTorch and JAX among them: on the CPU, detached, of the dtype that is asked for;
they are read where they lie. What comes out is NumPy's.
"""

from typing import TYPE_CHECKING

from squirrel import control, dynamics, flight, gap, nn, plan, policy
from squirrel._squirrel import Batch, FlightLog, Policy, Stack, Tasks, Vehicle, __version__, read_log, rollout, simulate

__all__ = [
    "Batch",
    "FlightLog",
    "Policy",
    "Stack",
    "Tasks",
    "Vehicle",
    "__version__",
    "control",
    "dynamics",
    "flight",
    "gap",
    "nn",
    "plan",
    "policy",
    "read_log",
    "rollout",
    "simulate",
]

if not TYPE_CHECKING:

    def __getattr__(name):
        """What needs further packages, imported where it is asked for first."""
        if name in ("envs", "plot", "torch"):
            from importlib import import_module

            return import_module(f"squirrel.{name}")
        raise AttributeError(f"module 'squirrel' has no attribute {name!r}")
