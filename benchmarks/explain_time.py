"""How long ``onboard explain`` takes over ten minutes of flight, page and files included.

The command itself, in a process of its own, imports and all.  Processor time is what counts: it
is the time that it takes on a machine that has nothing else to do.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from sitl.builtin.effects import BiasStep, Effect, GpsLeverArm
from sitl.builtin.truth import random_imus
from sitl.builtin.world import Vehicle
from sitl.recording import FlightSpec, write_tlog

FLIGHTS: tuple[tuple[str, Vehicle, tuple[Effect, ...]], ...] = (
    ("copter, nothing concealed", "copter", ()),
    ("plane, nothing concealed", "plane", ()),
    ("copter, antenna away from the IMU", "copter", (GpsLeverArm(x=0.8, y=-0.5, z=-0.4),)),
    ("plane, offset that jumps", "plane", (BiasStep(time=290.0, x=0.3, y=-0.2, z=0.0),)),
)
SEED = 3


def seconds(log: Path) -> tuple[float, float]:
    """Processor and wall time of the command with everything it can write, s."""
    files = [f"--{kind}={log.with_suffix(f'.{kind}')}" for kind in ("report", "json", "param")]
    command = [sys.executable, "-m", "onboard", "explain", str(log), *files]
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)  # noqa: S603 - ours
    after, wall = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter() - began
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall


def main(arguments: Sequence[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Time that an explanation takes.")
    parser.add_argument("--length", type=float, default=600.0, help="of each flight, s")
    chosen = parser.parse_args(arguments)
    print(f"{f'{chosen.length:.0f} s of flight, GPS at 5 Hz':44}{'processor':>12}{'wall':>10}")
    with tempfile.TemporaryDirectory() as folder:
        for k, (name, vehicle, effects) in enumerate(FLIGHTS):
            log = Path(folder) / f"{k}.tlog"
            spec = FlightSpec(
                vehicle=vehicle,
                seed=SEED,
                duration=chosen.length,
                imus=random_imus(SEED),
                effects=effects,
            )
            write_tlog(spec, log)
            processor, wall = seconds(log)
            print(f"{name:44}{processor:10.1f} s{wall:8.1f} s", flush=True)


if __name__ == "__main__":
    main()
