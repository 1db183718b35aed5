"""Lesson 6: fly a study in parts on an engine that hands work to machines, and get the bytes of a study that was never split.

Needs `pip install distributed` (Dask); says so and ends where it is missing. The cluster here is two processes of this machine; for
machines of your own, give `Client` the address of their scheduler. Each needs the wheel, and no folder that others see.
"""

import importlib
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    distributed = importlib.import_module("distributed")
except ModuleNotFoundError as missing:
    print(f"skipped: {missing.name} is not installed (pip install distributed)")
    sys.exit()

STUDY = ["forest", "--trials", "8", "--arms", "pc,phantom,twcc_plus"]
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
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder)
        with (
            distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
            distributed.Client(cluster) as client,
        ):
            # A machine that is lost costs its part, which another flies again to the same bits.
            tasks = client.map(part, range(1, PARTS + 1), retries=2)
            parts = client.gather(tasks)
            workers = len(client.scheduler_info()["workers"])
        folders = [out / f"part{number}" for number in range(1, PARTS + 1)]
        for home, files in zip(folders, parts, strict=True):
            home.mkdir()
            for name, content in files.items():
                (home / name).write_bytes(content)
            trials = len(files["forest.trials.jsonl"].splitlines()) - 1
            print(f"{home.name}: {trials} flights")

        print(f"\n{workers} workers, merged:\n" + study("merge", *map(str, folders), "--out", str(out / "merged")))
        study(*STUDY, "--out", str(out / "whole"))
        same = [name for name in FILES if (out / "merged" / name).read_bytes() == (out / "whole" / name).read_bytes()]
        print(f"the same bytes as in one go: {', '.join(same)}")
        assert same == FILES


# Workers are processes that import this file.
if __name__ == "__main__":
    main()
