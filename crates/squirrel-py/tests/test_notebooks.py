"""Notebooks: they run in a kernel of their own, draw, and are kept without what came out."""

import base64
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from conftest import ROOT

# As `jupyter execute --inplace`, but for its limits of seconds for a kernel to start and for what it prints to arrive, which a busy machine
# exceeds: these guard against a hang.
EXECUTE = """
import sys
import nbformat
from nbclient import NotebookClient
notebook = nbformat.read(sys.argv[1], as_version=4)
NotebookClient(notebook, startup_timeout=600, iopub_timeout=600).execute()
nbformat.write(notebook, sys.argv[1])
"""
NOTEBOOKS = sorted((ROOT / "examples/notebooks").glob("*.ipynb"))


def code(notebook: Path) -> list[dict[str, Any]]:
    cells = json.loads(notebook.read_text())["cells"]
    return [cell for cell in cells if cell["cell_type"] == "code"]


def test_there_are_notebooks() -> None:
    assert len(NOTEBOOKS) >= 3


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_are_kept_without_output(notebook: Path) -> None:
    for cell in code(notebook):
        assert cell["outputs"] == [] and cell["execution_count"] is None
        assert cell["metadata"] == {}
    # As `json.dumps` writes it, so that a saved notebook differs in what was edited alone.
    text = notebook.read_text()
    assert text == json.dumps(json.loads(text), indent=1, ensure_ascii=False) + "\n"


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_run_and_draw(notebook: Path, tmp_path: Path) -> None:
    pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    copy = tmp_path / notebook.name
    copy.write_text(notebook.read_text())
    # The kernel chooses a backend that draws into the notebook, where none is chosen for it.
    environment = {key: value for key, value in os.environ.items() if key != "MPLBACKEND"}
    done = subprocess.run(
        [sys.executable, "-c", EXECUTE, str(copy)],
        cwd=tmp_path,
        env=environment | {"JUPYTER_PLATFORM_DIRS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    outputs = [output for cell in code(copy) for output in cell["outputs"]]
    assert not [output for output in outputs if output.get("name") == "stderr"], outputs
    pictures = [output["data"]["image/png"] for output in outputs if "image/png" in output.get("data", {})]
    assert pictures and all(len(base64.b64decode(picture)) > 5000 for picture in pictures)
