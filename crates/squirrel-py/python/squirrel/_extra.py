"""Packages that squirrel can do without."""

from __future__ import annotations

from importlib.util import find_spec

__all__ = ["needed"]


def needed(module: str, package: str, extra: str) -> None:
    """Say which extra brings a package that is not there.

    Raises
    ------
    ModuleNotFoundError
        The package is not installed.
    """
    if find_spec(package) is None:
        problem = f"{module} needs {package}: pip install 'squirrel-flight[{extra}]'"
        raise ModuleNotFoundError(problem, name=package)
