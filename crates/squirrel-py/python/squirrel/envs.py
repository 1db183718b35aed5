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

The reward of a step of 20 ms, with d the distance to the reference and w the angular rate in rad/s, is::

    (1 - d / 5 m - 0.005 w^2) / 50      -5 where the vehicle is lost: it hit a trunk, overturned, or d reached 5 m

and ``info`` has its parts: ``reward_near``, ``reward_turning``, ``reward_lost``. Wind, gusts and everything else that a vehicle file says are
randomised by a list of vehicles, of which each episode takes one, evenly; the air is still but for their effects:

>>> from squirrel import Vehicle
>>> still = Vehicle.bundled("squirrel")
>>> winds = [{"effects.constant_wind.wind_north_m_s": w, "effects.constant_wind.wind_east_m_s": 0.0} for w in (-4.0, 4.0)]
>>> windy = [still.edited(wind) for wind in winds]
>>> env = gymnasium.make("SquirrelTrack-v0", vehicles=[still, *windy])

Observations are those of the flight code, so what was learned at attitude-and-wing level flies in ``squirrel fly --policy``; the table
of their numbers is in the documentation of the crate ``squirrel-core``, module ``policy``. All of it runs in Rust, and environment k
of a vectorised one with seed s does what a single one with seed s + k does, to the bit.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import Any

from squirrel._extra import needed

needed("squirrel.envs", "gymnasium", "gym")

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from squirrel._picture import picture, text
from squirrel._squirrel import Tasks, Vehicle
from squirrel.flight import Action, Scheme, Task

__all__ = ["SquirrelEnv", "SquirrelVectorEnv", "register"]

_LARGEST = 5.0


_MODES = ["rgb_array", "ansi"]
_SEEDS = 2**64


def _vehicles(vehicles: Sequence[Vehicle] | None) -> list[Vehicle]:
    if vehicles is None:
        return [Vehicle.bundled("squirrel")]
    if isinstance(vehicles, (list, tuple)) and all(isinstance(one, Vehicle) for one in vehicles):
        return list(vehicles)
    raise TypeError(f"vehicles: expected a list or tuple of Vehicle, got {type(vehicles).__name__}")


def _mode(render_mode: str | None) -> str | None:
    # An array answers `in` with an array, or with an error that names no argument.
    if render_mode is not None and not isinstance(render_mode, str):
        raise TypeError(f"render_mode: expected str or None, got {type(render_mode).__name__}")
    if render_mode is not None and render_mode not in _MODES:
        raise ValueError(f"render_mode = {repr(render_mode)[1:-1]}: must be {' or '.join(_MODES)}")
    return render_mode


def _seed(seed: Any) -> int:
    try:
        number = operator.index(seed)
    except TypeError:
        raise TypeError(f"seed: expected a whole number, got {type(seed).__name__}") from None
    if not 0 <= number < _SEEDS:
        raise ValueError(f"seed = {number}: must be 0 to {_SEEDS - 1}")
    return number


def _numbers(name: str, numbers: Any) -> NDArray[np.float32]:
    try:
        given = np.asarray(numbers)
    except ValueError:
        given = np.array(None)
    if given.dtype.kind not in "fiub":
        raise ValueError(f"{name}: expected numbers (float32), got {given.dtype} of shape {given.shape}")
    # What is too large for it becomes infinite, and is refused as such.
    with np.errstate(over="ignore"):
        return given.astype(np.float32)


def _frames(tasks: Tasks, render_mode: str | None) -> list[Any]:
    draw = picture if render_mode == "rgb_array" else text
    states, references = tasks.states()
    return [draw(states[k], references[k], tasks.obstacles(k)) for k in range(len(tasks))]


def _info(tasks: Tasks, index: int | None = None) -> dict[str, Any]:
    terms = {f"reward_{name}": numbers for name, numbers in tasks.reward_terms().items()}
    return terms if index is None else {name: float(numbers[index]) for name, numbers in terms.items()}


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
    render_mode : str, optional
        What `render` returns: ``rgb_array``, a picture from above, or ``ansi``, the same as text.
    """

    metadata: dict[str, Any] = {"render_modes": _MODES, "render_fps": 50}

    def __init__(
        self,
        *,
        task: Task,
        vehicles: Sequence[Vehicle] | None = None,
        action: Action = "attitude_wing",
        episode_s: float = 10.0,
        sensors: bool = False,
        scheme: Scheme = "rk4",
        render_mode: str | None = None,
    ) -> None:
        self.render_mode = _mode(render_mode)
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
        seed = None if seed is None else _seed(seed)
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
            Observation, reward, terminated, truncated, and the parts of the reward: ``reward_near``, ``reward_turning`` and
            ``reward_lost``, see `squirrel.Tasks.reward_terms`.
        """
        actions = _numbers("action", action)[np.newaxis]
        observation, reward, terminated, truncated = self.tasks.step(actions)
        return observation[0], float(reward[0]), bool(terminated[0]), bool(truncated[0]), _info(self.tasks, 0)

    def render(self) -> Any:
        """Show where the vehicle is, from above.

        Returns
        -------
        ndarray of uint8, shape (240, 240, 3), or str, or None
            As `render_mode` says; None where it says nothing. North is up and the vehicle in the middle of 24 m; the bar on the
            right says how far it is above or below its reference, up to 6 m.
        """
        return None if self.render_mode is None else _frames(self.tasks, self.render_mode)[0]


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
    render_mode : str, optional
        What `render` returns of each, as for `SquirrelEnv`.
    """

    metadata: dict[str, Any] = {
        "render_modes": _MODES,
        "render_fps": 50,
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        *,
        task: Task,
        num_envs: int = 1,
        vehicles: Sequence[Vehicle] | None = None,
        action: Action = "attitude_wing",
        episode_s: float = 10.0,
        sensors: bool = False,
        scheme: Scheme = "rk4",
        threads: int | None = None,
        render_mode: str | None = None,
    ) -> None:
        self.render_mode = _mode(render_mode)
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
        num_envs = self.num_envs = len(self.tasks)
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
            seeds: list[int | None]
            if isinstance(seed, (list, tuple)) or (isinstance(seed, np.ndarray) and seed.ndim == 1):
                seeds = [None if one is None else _seed(one) for one in seed]
            else:
                first = _seed(seed)
                seeds = [(first + k) % _SEEDS for k in range(self.num_envs)]
            if len(seeds) != self.num_envs:
                raise ValueError(f"seed: {len(seeds)} values, must be {self.num_envs}")
            for index, one in enumerate(seeds):
                if one is not None:
                    self.tasks.seed(index, one)
            self._is_seeded = True
        if options is not None and not isinstance(options, dict):
            raise TypeError(f"options: expected a dict, got {type(options).__name__}")
        mask = (options or {}).get("reset_mask")
        if mask is not None and not isinstance(mask, (list, tuple, np.ndarray)):
            raise TypeError(f"options: reset_mask: expected an array of bool, got {type(mask).__name__}")
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
            Observations, rewards, terminated, truncated, and the parts of the rewards, arrays of float32 of shape (num_envs,):
            ``reward_near``, ``reward_turning`` and ``reward_lost``, see `squirrel.Tasks.reward_terms`.
        """
        observation, reward, terminated, truncated = self.tasks.step(_numbers("actions", actions))
        return observation, reward, terminated, truncated, _info(self.tasks)

    def render(self) -> tuple[Any, ...] | None:
        """Show where the vehicles are, from above.

        Returns
        -------
        tuple or None
            A picture or text of each, as `SquirrelEnv.render` gives it; None where `render_mode` says nothing.
        """
        return None if self.render_mode is None else tuple(_frames(self.tasks, self.render_mode))


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
