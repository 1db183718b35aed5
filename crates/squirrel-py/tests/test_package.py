"""The package as it is installed: command line, import, types, stubs, README, guide, examples."""

import ast
import doctest
import importlib
import importlib.machinery
import importlib.metadata
import importlib.util
import os
import pkgutil
import re
import subprocess
import sys
import types
import venv
from pathlib import Path
from typing import get_origin

import pytest
from conftest import ROOT

import squirrel
from squirrel import _squirrel

PYTHON = Path(squirrel.__file__).parent
EXAMPLES = sorted((ROOT / "examples/python").glob("*.py"))
# Pages with lines of Python, which `cargo xtask docs` runs.
EXAMPLE_PAGES = ["docs/guide/python-examples.md"]
# Modules of the standard library that the import may bring beyond those of NumPy; three with Python 3.11.
FURTHER_MODULES = 15
# What an example has to say, beside something.
SAME = "the same bytes as in one go: forest.json, forest.csv, forest.trials.jsonl\n"
SAYS = {"a_study_on_many_machines": SAME, "a_study_on_ray": SAME}


def python_blocks(page: Path) -> list[str]:
    """The lines of Python on a page."""
    return re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)


def run(*arguments: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    # Dask's processes wait 30 s for each other, which is little on a busy machine.
    environment = os.environ | {"DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "600s"}
    return subprocess.run(list(map(str, arguments)), cwd=cwd, env=environment, capture_output=True, text=True, check=False)


def test_the_installed_package_is_tested() -> None:
    assert "site-packages" in PYTHON.parts


def test_the_module_is_the_command_line(tmp_path: Path) -> None:
    script = Path(sys.executable).parent / ("squirrel.exe" if os.name == "nt" else "squirrel")
    for program in ([sys.executable, "-m", "squirrel"], [script]):
        flown = run(*program, "fly", "--scenario", "hover", "--out", "hover.mcap", cwd=tmp_path)
        assert flown.returncode == 0 and flown.stdout.startswith("squirrel flies hover with twcc_flat"), flown
        assert squirrel.FlightLog.read(tmp_path / "hover.mcap").metadata["scenario_toml"]
        failed = run(*program, "replay", "no.mcap", cwd=tmp_path)
        assert failed.returncode == 1 and failed.stderr.startswith("error: no.mcap: "), failed
        usage = run(*program, "hover")
        assert usage.returncode == 2 and "Usage: squirrel" in usage.stderr, usage
        assert run(*program, "--version").stdout == f"squirrel {squirrel.__version__}\n"


IMPORT = """
import sys
import numpy
before = set(sys.modules)
import squirrel
from squirrel import _squirrel
print(*sorted(set(sys.modules) - before))
"""


def test_the_import_brings_nothing_but_numpy() -> None:
    """What an import costs beyond NumPy is what it imports, whatever the machine."""
    done = run(sys.executable, "-c", IMPORT)
    assert done.returncode == 0, done.stderr
    brought = done.stdout.split()
    foreign = {name.partition(".")[0] for name in brought} - sys.stdlib_module_names
    assert foreign == {"squirrel"}, brought
    # What draws, learns and talks is imported by whoever asks for it.
    assert {f"squirrel.{name}" for name in ("envs", "plot", "torch")}.isdisjoint(brought)
    assert not {"argparse", "asyncio", "http", "multiprocessing", "subprocess", "unittest"} & set(brought)
    ours = [name for name in brought if name.partition(".")[0] == "squirrel"]
    assert len(brought) - len(ours) <= FURTHER_MODULES, sorted(set(brought) - set(ours))


@pytest.mark.skipif("SQUIRREL_WHEEL" not in os.environ, reason="cargo xtask wheel says where the wheel is")
def test_an_install_pulls_numpy_alone(tmp_path: Path) -> None:
    wheel = os.environ["SQUIRREL_WHEEL"]
    venv.create(tmp_path, with_pip=False)
    bare = tmp_path / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    install = run(sys.executable, "-m", "pip", "--python", bare, "install", "--quiet", "--only-binary=:all:", wheel)
    assert install.returncode == 0, install.stderr
    listed = run(sys.executable, "-m", "pip", "--python", bare, "list", "--format=freeze").stdout
    assert {line.partition("==")[0] for line in listed.split()} == {"numpy", "squirrel-flight"}
    flown = run(bare, "-c", "import squirrel; print(squirrel.simulate(scenario='hover')['imu.omega_body_rad_s'].shape)")
    assert flown.stdout.endswith(", 3)\n"), flown.stderr


def test_the_stubs_are_those_of_the_code() -> None:
    """`SQUIRREL_STUBS_WRITE=1 cargo xtask wheel -k stubs_are` takes the new ones."""
    made = _squirrel.stubs()
    kept = ROOT / "crates/squirrel-py/python/squirrel/_squirrel.pyi"
    if "SQUIRREL_STUBS_WRITE" in os.environ:
        kept.write_text(made)
    assert kept.read_text() == made


def test_the_stubs_fit_what_is_installed(tmp_path: Path) -> None:
    allowed = tmp_path / "allowed.txt"
    # The generator does not know that the operators of Python take their operand by place alone.
    allowed.write_text(r"squirrel\._squirrel\..*\.__(getitem|contains|eq)__")
    checked = run(sys.executable, "-m", "mypy.stubtest", "squirrel._squirrel", "--allowlist", allowed, cwd=tmp_path)
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_types_are_right(tmp_path: Path) -> None:
    # All but squirrel.torch, which would need PyTorch.
    modules = ["squirrel", "squirrel.__main__", "squirrel.gap", "squirrel.plot"]
    packages = [argument for module in modules for argument in ("-m", module)]
    for what in (EXAMPLES, packages):
        checked = run(sys.executable, "-m", "mypy", "--strict", *what, cwd=tmp_path)
        assert checked.returncode == 0, checked.stdout + checked.stderr


def test_the_licences_are_installed_with_it() -> None:
    """Ours, and those of what is compiled in; `cargo xtask notices` holds the list to what cargo compiles."""
    files = {file.name: file for file in importlib.metadata.files("squirrel-flight") or []}
    assert {"LICENSE-MIT", "LICENSE-APACHE", "THIRD-PARTY.txt"} <= set(files)
    listed = files["THIRD-PARTY.txt"].read_text()
    for package in ("rapier3d-f64", "zstd-sys", "clarabel", "pyo3", "the Rust standard library"):
        assert f"* {package}" in listed and listed.count(package) >= 2, package


DRAWS = """
import sys
import squirrel
assert "squirrel.plot" not in sys.modules
assert squirrel.plot.tilt is sys.modules["squirrel.plot"].tilt
try:
    squirrel.plots
except AttributeError as error:
    print(error)
"""


def test_modules_that_need_more_are_imported_where_they_are_asked_for() -> None:
    pytest.importorskip("matplotlib")
    done = run(sys.executable, "-c", DRAWS)
    assert done.stdout == "module 'squirrel' has no attribute 'plots'\n", done.stderr


def test_everything_public_is_documented() -> None:
    modules = [squirrel, squirrel.control, squirrel.dynamics, squirrel.gap, squirrel.nn]
    bare = []
    for module in modules:
        for name in module.__all__:
            thing = getattr(module, name)
            if isinstance(thing, str):
                continue
            parts = {name: thing} | {f"{name}.{k}": v for k, v in getattr(thing, "__dict__", {}).items() if not k.startswith("_")}
            # Names of types that are of `typing` have no words of their own.
            parts = {k: v for k, v in parts.items() if get_origin(v) is None and getattr(v, "__module__", "") != "typing"}
            is_module = thing in modules
            bare += [k for k, v in parts.items() if not is_module and callable(v) and not (v.__doc__ or "").strip()]
    assert not bare


def test_examples_in_docstrings_run() -> None:
    parser, runner = doctest.DocTestParser(), doctest.DocTestRunner()
    texts = {name: getattr(thing, "__doc__", None) or "" for name, (thing, _) in public_names().items()}
    documented = {name: text for name, text in texts.items() if ">>>" in text}
    for name, text in documented.items():
        runner.run(parser.get_doctest(text, {}, name, None, 0))
    assert {f"squirrel.{name}" for name in ("Batch", "FlightLog", "Vehicle", "Vehicle.new", "plan.reach", "simulate")} <= set(documented)
    assert runner.failures == 0


def public_names() -> dict[str, tuple[object, str]]:
    """What the package offers, with what has to be written to use it."""
    names: dict[str, tuple[object, str]] = {}
    package = [info.name for info in pkgutil.iter_modules([str(PYTHON)]) if not info.name.startswith("_")]
    for module in ["", *package]:
        # PyTorch is not in the environment of the tests, so that its module is read and not imported.
        if module == "torch":
            listed = re.search(r"__all__ = (\[.*?\])", (PYTHON / "torch.py").read_text(), re.DOTALL)
            assert listed
            names |= {f"squirrel.torch.{name}": (None, f"squirrel.torch.{name}") for name in ast.literal_eval(listed[1])}
            continue
        where = importlib.import_module(f"squirrel.{module}" if module else "squirrel")
        prefix = f"squirrel.{module}." if module else "squirrel."
        for name in where.__all__:
            thing = getattr(where, name)
            names[prefix + name] = (thing, prefix + name)
            if isinstance(thing, type) and thing.__module__ == "squirrel._squirrel":
                members = [member for member in vars(thing) if not member.startswith("_")]
                names |= {f"{prefix}{name}.{member}": (getattr(thing, member), f".{member}") for member in members}
    return names


def test_every_public_name_has_an_example_that_runs() -> None:
    """On the page of examples, or in its own docstring, both of which are run."""
    lines = "\n".join(block for page in EXAMPLE_PAGES for block in python_blocks(ROOT / page))
    lines += "squirrel.__version__"
    names = public_names()
    assert len(names) > 100, sorted(names)
    bare = []
    for name, (thing, written) in names.items():
        used = re.search(rf"{re.escape(written)}\b", lines)
        if not used and ">>>" not in (getattr(thing, "__doc__", "") or "") and not isinstance(thing, types.ModuleType):
            bare.append(name)
    assert not bare


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_examples_run(example: Path, tmp_path: Path) -> None:
    done = run(sys.executable, "-W", "error", example, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout and SAYS.get(example.stem, "") in done.stdout, done.stdout


def test_there_are_examples() -> None:
    assert len(EXAMPLES) >= 2
