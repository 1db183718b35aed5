#!/usr/bin/env python3
"""squirrel beside crazyflow (JAX) from Python: steps a second in one run, in turns.

    python3 speed.py [--rounds 5] [--seconds 1.0] [--registers avx2] [--only fused] [--out figures.json]

Needs requirements.txt and the wheel of squirrel (`cargo xtask wheel` leaves it in target/wheel/dist) in one environment.

Each has a process of its own, on the CPU, on the same two cores, in float32 with steps of 2 ms. Environments act at 50 Hz, ten Euler steps
each, on an attitude controller at 500 Hz: for them, one step is one action of one environment. A case is timed in the one, then at
once in the other, and a ratio is taken between those two; a round is every case once. One step is one vehicle moved on by one step
of the integrator. Ratios are of what the clock says, which others on the machine disturb; those of processor time tell it where they
do. Exit code 1 says that a median ratio is below its bar.
"""

import argparse
import importlib.metadata
import json
import os
import re
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

DT_S = 2e-3
CORES = 2
FUSED = 100


@dataclass(frozen=True)
class Case:
    """What both do, and how many times faster squirrel has to be, by registers where that differs."""

    vehicles: int
    scheme: str
    steps: int
    bars: dict[str, float]
    whole: bool = False
    environments: bool = False

    def bar(self, registers: str) -> float | None:
        return self.bars.get(registers, self.bars.get("any"))


# A call is the command, its steps, and the motions to read.
CASES = {
    "fused, 10 000 vehicles, RK4": Case(10_000, "rk4", FUSED, {"avx2": 18, "avx512": 28}),
    "one step a call, 10 000 vehicles, RK4": Case(10_000, "rk4", 1, {"any": 15}),
    "one step a call, 10 000 vehicles, Euler": Case(10_000, "euler", 1, {"any": 10}),
    "one step a call, 100 vehicles, RK4": Case(100, "rk4", 1, {"any": 60}),
    "one step a call, one vehicle, RK4": Case(1, "rk4", 1, {"any": 170}),
    # The rival has neither wings nor batteries nor gusts: it flies what it has.
    "whole, fused, 10 000 vehicles, RK4": Case(10_000, "rk4", FUSED, {"any": 8}, whole=True),
    "environments, 1000 of them": Case(1000, "euler", 1, {"any": 10}, environments=True),
}


def of_squirrel(registers: str | None) -> Callable[[Case], Callable[[], object]]:
    import numpy as np

    import squirrel

    def environments(case: Case) -> Callable[[], object]:
        import squirrel.envs

        # The rival's have neither wings nor batteries.
        text = re.split(r"(?m)^(?=\[)", squirrel.Vehicle.bundled("squirrel").text)
        bare = squirrel.Vehicle.parse("".join(part for part in text if not re.match(r"\[(wing|battery)\]", part)))
        envs = squirrel.envs.SquirrelVectorEnv(task="track", num_envs=case.vehicles, vehicles=[bare], scheme=case.scheme, threads=CORES)
        envs.reset(seed=0)
        action = np.zeros((case.vehicles, 4), np.float32)
        action[:, 3] = -1.0
        return lambda: envs.step(action)

    def prepare(case: Case) -> Callable[[], object]:
        if case.environments:
            return environments(case)
        n = case.vehicles
        vehicle = squirrel.Vehicle.bundled("squirrel")
        batch = squirrel.Batch(
            vehicles=[vehicle] * n, whole=case.whole, dt_s=DT_S, scheme=case.scheme, threads=CORES, registers=registers
        )
        command = np.full((n, 4), vehicle.hover_command, np.float32)
        state = batch.states()
        state[:, 13:] = vehicle.hover_command * vehicle["propulsion.speed_max_rad_s"]
        batch.reset(state)
        if case.whole:
            batch.command_wings(np.ones((n, 2), np.float32))
            batch.set_air(np.full((n, 3), 0.5), gust_sigma_m_s=np.full(n, 0.5))
        fly, steps = batch.fly, case.steps
        return lambda: fly(command, steps, out=state)

    return prepare


def of_crazyflow() -> Callable[[Case], Callable[[], object]]:
    import jax
    import jax.numpy as jnp
    from crazyflow.control import Control
    from crazyflow.dynamics import Dynamics
    from crazyflow.sim import Sim

    def environments(case: Case) -> Callable[[], object]:
        import gymnasium
        import numpy as np

        # Attitude control at 500 Hz and Euler steps are what it has by default.
        envs = gymnasium.make_vec(
            "DroneReachPos-v0", num_envs=case.vehicles, freq=50, device="cpu", dynamics=Dynamics.first_principles
        )
        envs.reset()
        action = np.zeros((case.vehicles, 4), np.float32)
        action[:, 3] = 0.3
        return lambda: jax.block_until_ready(envs.step(action)[0])

    def prepare(case: Case) -> Callable[[], object]:
        if case.environments:
            return environments(case)
        rate_hz = round(1 / DT_S)
        sim = Sim(
            n_worlds=case.vehicles,
            n_drones=1,
            # Motor lag, rotor torque, drag, rigid body.
            dynamics="first_principles",
            control=Control.rotor_vel,
            integrator=case.scheme,
            freq=rate_hz,
            device="cpu",
        )
        sim.reset()
        command = jnp.full((case.vehicles, 1, 4), 14_000.0)  # rev/min, about hover

        def call() -> None:
            sim.rotor_vel_control(command)
            sim.step(case.steps)
            jax.block_until_ready(sim.data.states)

        return call

    return prepare


def rates_per_s(call: Callable[[], object], steps: int, seconds: float) -> tuple[float, float]:
    """Steps of a call over as many calls as fit: a second on the clock, and a second of the process on all cores."""
    for _ in range(3):
        call()
    # Looking at the clock takes a tenth of the shortest call: it is looked at every millisecond or so.
    before = time.perf_counter()
    for _ in range(10):
        call()
    at_once = max(1, round(10 * 1e-3 / (time.perf_counter() - before)))
    start, start_cpu, calls, now = time.perf_counter(), time.process_time(), 0, 0.0
    while now - start < seconds:
        for _ in range(at_once):
            call()
        calls, now = calls + at_once, time.perf_counter()
    return calls * steps / (now - start), calls * steps / (time.process_time() - start_cpu)


def serve(peer: str, seconds: float, registers: str | None) -> None:
    """Times the cases whose names come in, a line each, and answers with their rates."""
    answers = os.fdopen(os.dup(1), "w")
    # What libraries print is no answer.
    os.dup2(2, 1)
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:CORES])
    prepare = of_squirrel(registers) if peer == "squirrel" else of_crazyflow()
    ready: dict[str, Callable[[], object]] = {}
    for line in sys.stdin:
        name = line.strip()
        case = CASES[name]
        if name not in ready:
            ready[name] = prepare(case)
        print(*rates_per_s(ready[name], case.vehicles * case.steps, seconds), file=answers, flush=True)


class Peer:
    """A process that times."""

    def __init__(self, name: str, options: argparse.Namespace) -> None:
        arguments = [sys.executable, __file__, "--serve", name, "--seconds", str(options.seconds)]
        if options.registers:
            arguments += ["--registers", options.registers]
        self.name = name
        self.process = subprocess.Popen(
            arguments,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL if name == "crazyflow" else None,
            text=True,
            env=os.environ | {"JAX_PLATFORMS": "cpu", "CUDA_VISIBLE_DEVICES": "", "OMP_WAIT_POLICY": "PASSIVE"},
        )

    def rates_per_s(self, case: str) -> tuple[float, float]:
        assert self.process.stdin is not None and self.process.stdout is not None
        print(case, file=self.process.stdin, flush=True)
        answer = self.process.stdout.readline()
        if not answer:
            sys.exit(f"{self.name}: ended with code {self.process.wait()} in {case!r}")
        clock, cpu = map(float, answer.split())
        return clock, cpu


def widest() -> str:
    import squirrel

    return squirrel.Batch(vehicles=[squirrel.Vehicle.bundled("crazyflie2_arpl")]).registers


def machine() -> list[str]:
    """What ran on what."""
    lines = [f"{name} {importlib.metadata.version(name)}" for name in ("squirrel-flight", "crazyflow", "jax", "numpy")]
    cpu = Path("/proc/cpuinfo")
    fields = dict(line.split("\t: ", 1) for line in cpu.read_text().split("\n") if "\t: " in line) if cpu.exists() else {}
    fields = {key.strip(): value for key, value in fields.items()}
    flags = [flag for flag in fields.get("flags", "").split() if flag in ("sse2", "avx2", "avx512f", "fma")]
    lines.append(f"{fields.get('model name', 'unknown processor')}: {' '.join(flags)}")
    lines.append(f"{os.cpu_count()} cores, load before {os.getloadavg()[0]:.2f}")
    return lines


def main() -> int:
    options = argparse.ArgumentParser()
    options.add_argument("--rounds", type=int, default=5)
    options.add_argument("--seconds", type=float, default=1.0, help="of each case in each round")
    options.add_argument("--registers", choices=["avx512", "avx2", "portable", "scalar"], help="of squirrel; default: the widest")
    options.add_argument("--only", default="", help="cases whose name has this in it")
    options.add_argument("--out", type=Path)
    options.add_argument("--serve", choices=["squirrel", "crazyflow"], help=argparse.SUPPRESS)
    options = options.parse_args()
    if options.serve:
        serve(options.serve, options.seconds, options.registers)
        return 0

    about, registers = machine(), options.registers or widest()
    print("\n".join([*about, f"registers: {registers}"]), flush=True)
    peers = [Peer(name, options) for name in ("squirrel", "crazyflow")]
    cases = [name for name in CASES if options.only in name]
    rounds: list[dict[str, list[tuple[float, float]]]] = []
    for _ in range(options.rounds):
        rounds.append({case: [peer.rates_per_s(case) for peer in peers] for case in cases})
        if options.out:
            figures = {"about": about, "registers": registers, "rounds": rounds}
            options.out.write_text(json.dumps(figures, indent=1) + "\n")

    missed = 0
    print(f"\n{'million steps/s, medians':42}{'squirrel':>10}{'crazyflow':>11}{'times':>8}{'worst':>8}{'by CPU':>8}{'bar':>6}")
    for case in cases:
        rates = [figures[case] for figures in rounds]
        ours, theirs = (statistics.median(rate[k][0] for rate in rates) / 1e6 for k in (0, 1))
        ratios, by_cpu = ([rate[0][k] / rate[1][k] for rate in rates] for k in (0, 1))
        median, bar = statistics.median(ratios), CASES[case].bar(registers)
        is_missed = bar is not None and median < bar
        missed += is_missed
        note = f"{bar:6.0f}" + (" missed" if is_missed else "") if bar is not None else ""
        print(f"{case:42}{ours:10.3f}{theirs:11.4f}{median:8.1f}{min(ratios):8.1f}{statistics.median(by_cpu):8.1f}{note}")
    return min(missed, 1)


if __name__ == "__main__":
    sys.exit(main())
