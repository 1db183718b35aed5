"""What the tests share."""

from pathlib import Path

import numpy as np
import pytest

import squirrel

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="session")
def vehicle() -> squirrel.Vehicle:
    return squirrel.Vehicle.bundled("squirrel")


@pytest.fixture(scope="session")
def flights() -> dict[str, squirrel.FlightLog]:
    """Short flights with spread wings, to learn from."""
    return {f"f{k}": squirrel.simulate(scenario="random_spread", arm="pc_wings_open", seed=k) for k in (1, 2)}


def thrown(n: int, dtype: str = "float64") -> tuple[np.ndarray, np.ndarray]:
    """Motions and commands that differ from row to row; the first rows are the same for every n."""
    generators = [np.random.default_rng(row) for row in range(n)]
    state = np.array([g.uniform(-3.0, 3.0, 17) for g in generators])
    state[:, 6:10] /= np.linalg.norm(state[:, 6:10], axis=1, keepdims=True)
    state[:, 13:] = np.array([g.uniform(0.0, 2000.0, 4) for g in generators])
    command = np.array([g.uniform(0.2, 0.8, 4) for g in generators])
    return state.astype(dtype), command.astype(dtype)
