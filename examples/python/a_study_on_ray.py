"""Lesson 6 on Ray: fly a study in parts on its workers, and get the bytes of a study that was never split.

Needs `pip install ray`; says so and ends where it is missing. The cluster here is two workers on this machine; `ray.init(address="auto")` takes
the one that is running. Each machine needs the wheel, and no folder that others see.
"""

import importlib
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    ray = importlib.import_module("ray")
except ModuleNotFoundError as missing:
    print(f"skipped: {missing.name} is not installed (pip install ray)")
    sys.exit()

STUDY = ["forest", "--trials", "4", "--arms", "pc,twcc_plus"]
PARTS = 4
FILES = ["forest.json", "forest.csv", "forest.trials.jsonl"]


def study(*arguments: str) -> str:
    """Run `squirrel study` on the machine that this is called on; what it prints."""
    program = [sys.executable, "-m", "squirrel", "study", *arguments]
    done = subprocess.run(program, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip())
    return done.stdout


def part(number: int) -> dict[str, bytes]:
    """Fly every fourth trial; the files that it left, which hold nothing but what the trials came to."""
    with tempfile.TemporaryDirectory() as folder:
        study(*STUDY, "--shard", f"{number}/{PARTS}", "--out", folder)
        return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


def main() -> None:
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    try:
        # A worker that is lost costs its part, which another flies again to the same bits.
        fly = ray.remote(max_retries=2)(part)
        parts = ray.get([fly.remote(number) for number in range(1, PARTS + 1)])
    finally:
        ray.shutdown()
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        folders = [out / f"part{number}" for number in range(1, PARTS + 1)]
        for home, files in zip(folders, parts, strict=True):
            home.mkdir()
            for name, content in files.items():
                (home / name).write_bytes(content)
        print(study("merge", *map(str, folders), "--out", str(out / "merged")))
        study(*STUDY, "--out", str(out / "whole"))
        same = [name for name in FILES if (out / "merged" / name).read_bytes() == (out / "whole" / name).read_bytes()]
        print(f"the same bytes as in one go: {', '.join(same)}")
        assert same == FILES


if __name__ == "__main__":
    main()
