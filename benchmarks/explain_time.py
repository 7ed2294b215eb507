"""What ``onboard replay`` and ``onboard explain`` cost: processor, times real time, memory.

The commands themselves, each in a process of its own, imports, decoding, page and files included.
Processor time is what counts: it is the time that it takes on a machine that has nothing else to
do; the median of some runs, after one that leaves Python's and numba's compiled code behind, as an
installation has it.  ``--hours 0.1 1 10`` replays longer and longer flights instead: the cost of an
hour and what memory is beyond the recording's own samples have to stay as they are.  What is longer
than an hour is an hour's flight again and again, on one boot clock: a simulator's ten hours would
take 20 GB.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.daemon import frames, later
from sitl.builtin.effects import BiasStep, Effect, GpsLeverArm
from sitl.builtin.truth import random_imus
from sitl.builtin.world import Vehicle
from sitl.recording import FlightSpec, write_tlog

FLIGHTS: tuple[tuple[str, str, Vehicle, int, tuple[Effect, ...]], ...] = (
    ("replay", "copter, two accelerometers", "copter", 2, ()),
    ("explain", "copter, nothing concealed", "copter", 1, ()),
    ("explain", "plane, nothing concealed", "plane", 1, ()),
    (
        "explain",
        "copter, antenna away from the IMU",
        "copter",
        1,
        (GpsLeverArm(x=0.8, y=-0.5, z=-0.4),),
    ),
    (
        "explain",
        "plane, offset that jumps",
        "plane",
        1,
        (BiasStep(time=290.0, x=0.3, y=-0.2, z=0.0),),
    ),
)
SEED = 3


@dataclass(frozen=True, slots=True)
class Cost:
    """Of one command: s of processors, s of the clock, most memory, MB."""

    processor: float
    wall: float
    memory: float


def cost(command: str, log: Path, runs: int) -> Cost:
    """The command with everything that it can write: the median of some runs by processor time."""
    _once(command, log)
    made = sorted((_once(command, log) for _ in range(runs)), key=lambda c: c.processor)
    return made[runs // 2]


def _once(command: str, log: Path) -> Cost:
    files = [f"--{kind}={log.with_suffix(f'.{kind}')}" for kind in ("report", "json", "param")]
    return cost_of(command, str(log), *files)


def cost_of(command: str, *arguments: str, tree: Path | None = None) -> Cost:
    """A command in a process of its own, with the programs of a folder; None: these."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    began = time.perf_counter()
    child = subprocess.Popen(  # noqa: S603 - ours
        [sys.executable, "-m", "onboard", command, *arguments],
        cwd=tree,
        env=environment if tree is None else environment | {"PYTHONPATH": str(tree)},
        stdout=subprocess.DEVNULL,
    )
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise subprocess.CalledProcessError(child.returncode, command)
    wall = time.perf_counter() - began
    return Cost(used.ru_utime + used.ru_stime, wall, used.ru_maxrss / 1024.0)


def flown(log: Path, vehicle: Vehicle, count: int, effects: tuple[Effect, ...], s: float) -> None:
    """A simulated flight, from a process of its own.

    The most memory that a child ever had is counted from its parent's before it becomes another
    program, and a simulator's hour takes 2 GB.
    """
    made = multiprocessing.get_context("spawn").Process(
        target=_fly, args=(log, vehicle, count, effects, s)
    )
    made.start()
    made.join()
    if made.exitcode:
        raise RuntimeError(f"the simulated flight ended with {made.exitcode}")


def flown_long(log: Path, hours: float) -> None:
    """A copter's flight of so many hours, of which a simulated one is an hour at the most."""
    length = 3600.0 * min(hours, 1.0)
    hour = log.with_suffix(".hour")
    flown(hour, "copter", 1, (), length)
    with log.open("wb") as out:
        for k in range(round(3600.0 * hours / length)):
            for t, frame in frames(hour):
                at = k * length
                out.write(round(1e6 * (t + at)).to_bytes(8, "big") + later(frame, at))


def _fly(log: Path, vehicle: Vehicle, count: int, effects: tuple[Effect, ...], s: float) -> None:
    imus = random_imus(SEED, count)
    write_tlog(FlightSpec(vehicle=vehicle, seed=SEED, duration=s, imus=imus, effects=effects), log)


def line(name: str, found: Cost, length: float) -> str:
    """One row."""
    return (
        f"{name:44}{found.processor:10.1f} s{length / found.processor:10.0f} x"
        f"{found.memory:10.0f} MB{found.wall:10.1f} s"
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Time that a replay and an explanation take.")
    parser.add_argument("--length", type=float, default=600.0, help="of each flight, s")
    parser.add_argument(
        "--runs", type=int, default=3, help="of each, after one that is not counted"
    )
    parser.add_argument("--hours", type=float, nargs="+", default=[], help="replays of so many")
    chosen = parser.parse_args(arguments)
    print(f"{'GPS at 5 Hz, inertial data at 50 Hz':44}{'processor':>12}{'real time':>12}", end="")
    print(f"{'memory':>13}{'wall':>12}")
    with tempfile.TemporaryDirectory() as folder:
        if chosen.hours:
            for hours in chosen.hours:
                log = Path(folder) / "flight.tlog"
                flown_long(log, hours)
                print(
                    line(f"replay, {hours:g} h", cost("replay", log, chosen.runs), 3600.0 * hours),
                    flush=True,
                )
            return
        for k, (command, name, vehicle, count, effects) in enumerate(FLIGHTS):
            log = Path(folder) / f"{k}.tlog"
            flown(log, vehicle, count, effects, chosen.length)
            print(
                line(f"{command}: {name}", cost(command, log, chosen.runs), chosen.length),
                flush=True,
            )


if __name__ == "__main__":
    main()
