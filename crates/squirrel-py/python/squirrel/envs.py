"""Gymnasium environments: fly past trunks, or along a curve.

``SquirrelAvoid-v0`` and ``SquirrelTrack-v0``, single (`SquirrelEnv`) and vectorised (`SquirrelVectorEnv`), with actions at motor, body-rate or
attitude-and-wing level. Needs Gymnasium, to which importing this module makes them known:

>>> import gymnasium
>>> import squirrel.envs
>>> env = gymnasium.make("SquirrelAvoid-v0")
>>> envs = gymnasium.make_vec("SquirrelTrack-v0", num_envs=100, action="body_rate")
>>> observation, info = envs.reset(seed=1)
>>> observation.shape
(100, 25)

Observations are those of the flight code, so what was learned at attitude-and-wing level flies in ``squirrel fly --policy``; the table
of their numbers is in the documentation of the crate ``squirrel-core``, module ``policy``. All of it runs in Rust, and environment k
of a vectorised one with seed s does what a single one with seed s + k does, to the bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from squirrel._squirrel import Tasks, Vehicle

__all__ = ["SquirrelEnv", "SquirrelVectorEnv", "register"]

_LARGEST = 5.0


def _vehicles(vehicles: Sequence[Vehicle] | None) -> list[Vehicle]:
    return [Vehicle.bundled("squirrel")] if vehicles is None else list(vehicles)


def _spaces(tasks: Tasks) -> tuple[Box, Box]:
    observation = Box(-_LARGEST, _LARGEST, (tasks.observation_numbers,), np.float32)
    return observation, Box(-1.0, 1.0, (tasks.action_numbers,), np.float32)


class SquirrelEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """One vehicle that learns.

    Parameters
    ----------
    task : str
        ``avoid`` or ``track``.
    vehicles : sequence of Vehicle, optional
        Each episode takes one of them; the bundled squirrel if left out.
    action : str
        ``motor``, ``body_rate`` or ``attitude_wing``, see `squirrel.Tasks`.
    episode_s : float
        Length of an episode.
    sensors : bool
        Observations come from the vehicle's sensors instead of the true state.
    scheme : str
        ``rk4`` or ``euler``, of steps of 2 ms.
    """

    metadata: dict[str, Any] = {"render_modes": [], "render_fps": 50}

    def __init__(
        self,
        *,
        task: str,
        vehicles: Sequence[Vehicle] | None = None,
        action: str = "attitude_wing",
        episode_s: float = 10.0,
        sensors: bool = False,
        scheme: str = "rk4",
    ) -> None:
        self.tasks = Tasks(
            task=task,
            vehicles=_vehicles(vehicles),
            action=action,
            episode_s=episode_s,
            sensors=sensors,
            scheme=scheme,
            threads=1,
        )
        self.observation_space, self.action_space = _spaces(self.tasks)
        self._is_seeded = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start a new episode.

        Parameters
        ----------
        seed : int, optional
            Of this episode and those after it.
        options : dict, optional
            Not looked at.

        Returns
        -------
        tuple
            Observation and an empty dict.
        """
        super().reset(seed=seed)
        if seed is not None or not self._is_seeded:
            self.tasks.seed(0, int(self.np_random.integers(2**63)) if seed is None else seed)
            self._is_seeded = True
        return self.tasks.reset()[0], {}

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Fly on for 20 ms.

        Parameters
        ----------
        action : ndarray of float32
            As the action space has it; limited to it.

        Returns
        -------
        tuple
            Observation, reward, terminated, truncated, an empty dict.
        """
        actions = np.asarray(action, np.float32)[np.newaxis]
        observation, reward, terminated, truncated = self.tasks.step(actions)
        return observation[0], float(reward[0]), bool(terminated[0]), bool(truncated[0]), {}


class SquirrelVectorEnv(gymnasium.vector.VectorEnv[NDArray[np.float32], NDArray[np.float32], NDArray[Any]]):
    """Many vehicles that learn, in one call of Rust.

    Parameters
    ----------
    task : str
        ``avoid`` or ``track``.
    num_envs : int
        How many.
    vehicles : sequence of Vehicle, optional
        Each episode takes one of them; the bundled squirrel if left out.
    action : str
        ``motor``, ``body_rate`` or ``attitude_wing``, see `squirrel.Tasks`.
    episode_s : float
        Length of an episode.
    sensors : bool
        Observations come from the vehicle's sensors instead of the true state.
    scheme : str
        ``rk4`` or ``euler``, of steps of 2 ms.
    threads : int, optional
        That work; as many as there are cores if left out.
    """

    metadata: dict[str, Any] = {
        "render_modes": [],
        "render_fps": 50,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        *,
        task: str,
        num_envs: int = 1,
        vehicles: Sequence[Vehicle] | None = None,
        action: str = "attitude_wing",
        episode_s: float = 10.0,
        sensors: bool = False,
        scheme: str = "rk4",
        threads: int | None = None,
    ) -> None:
        self.tasks = Tasks(
            task=task,
            vehicles=_vehicles(vehicles),
            num_envs=num_envs,
            action=action,
            episode_s=episode_s,
            sensors=sensors,
            scheme=scheme,
            threads=threads,
        )
        self.num_envs = num_envs
        self.single_observation_space, self.single_action_space = _spaces(self.tasks)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._is_seeded = False

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start new episodes.

        Parameters
        ----------
        seed : int or sequence of int, optional
            Environment k draws from ``seed + k``, or from the k-th of them.
        options : dict, optional
            ``reset_mask``: an array of bool, in which environments; in all if left out.

        Returns
        -------
        tuple
            Observations and an empty dict.
        """
        if seed is None and not self._is_seeded:
            seed = int(np.random.default_rng().integers(2**62))
        if seed is not None:
            seeds = [seed + k for k in range(self.num_envs)] if isinstance(seed, int) else list(seed)
            if len(seeds) != self.num_envs:
                raise ValueError(f"seed: {len(seeds)} values, must be {self.num_envs}")
            for index, one in enumerate(seeds):
                if one is not None:
                    self.tasks.seed(index, one)
            self._is_seeded = True
        mask = (options or {}).get("reset_mask")
        return self.tasks.reset(None if mask is None else [bool(one) for one in mask]), {}

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[
        NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]
    ]:
        """Fly on for 20 ms.

        Parameters
        ----------
        actions : ndarray of float32, shape (num_envs, 4 or 5)
            As the action space has them; limited to it. Not looked at where the last step ended an episode: there a new one begins.

        Returns
        -------
        tuple
            Observations, rewards, terminated, truncated, an empty dict.
        """
        observation, reward, terminated, truncated = self.tasks.step(np.asarray(actions, np.float32))
        return observation, reward, terminated, truncated, {}


def register() -> None:
    """Make the environments known to Gymnasium; importing this module does."""
    for task in ("avoid", "track"):
        name = f"Squirrel{task.capitalize()}-v0"
        if name not in gymnasium.registry:
            gymnasium.register(
                id=name,
                entry_point="squirrel.envs:SquirrelEnv",
                vector_entry_point="squirrel.envs:SquirrelVectorEnv",
                kwargs={"task": task},
            )


register()
