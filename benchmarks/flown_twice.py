"""What a match hands back, flown again in ArduPilot's own SITL, and matched again.

For each recording: ``onboard match``, the frame file and the parameters that it gives, a flight of
ArduPilot's simulator with both (manoeuvres of its own), and a second match.  Its binary is looked
for in ARDUPILOT_SITL_DIR and on PATH; recordings as in :mod:`benchmarks.frames`.
"""

from __future__ import annotations

import argparse
import asyncio
import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks.frames import recordings
from onboard.answers.flown_again import numbers_twice
from onboard.answers.match import Match, match
from sitl.ardupilot.flight import fly
from sitl.ardupilot.process import find_binary
from sitl.errors import NoBinaryError, SitlError

NAMES = ("e02", "e03", "e05", "e06", "e07", "e09", "e12", "f02", "f03", "f04", "f05")
HEAD = "| recording | number | first | second flight | sigma | off | within 5 % or 3 sigma |"


def again(first: Match, log: Path, *, seconds: float, speedup: float) -> Match:
    """The match of a flight with what the first one handed back.

    Raises:
        SitlError: it was not flown.
    """
    kind = "plane" if first.vehicle.vehicle == "plane" else "copter"
    told = {s.name: s.value for s in first.settings if s.name.startswith("SIM_WIND")}
    airspeed = {s.name: s.value for s in first.settings if s.name.startswith("SIM_ARSPD")}
    if airspeed:
        # What the simulated tube has is for an autopilot that reads it as the recorded one does.
        own = first.real.signals.parameters
        told |= airspeed | {n: own[n] for n in ("ARSPD_RATIO",) if n in own}
    asyncio.run(
        fly(
            kind,
            log,
            airframe=first.frame,
            parameters={"SIM_WIND_TURB": 0.0} | told,
            seconds=seconds,
            speedup=speedup,
        )
    )
    return match(log, frame=dict(first.frame))


def rows(name: str, *, seconds: float, speedup: float) -> Iterator[str]:
    """A row for each number of a recording's effects, and one for what is left."""
    first = match(recordings() / f"{name}.BIN")
    with tempfile.TemporaryDirectory(prefix="twice-") as folder:
        second = again(first, Path(folder) / "again.BIN", seconds=seconds, speedup=speedup)
    for key, n in numbers_twice(first, second).items():
        off = f"{100.0 * (n.again / n.real - 1.0):.1f} %" if n.real else ""
        agrees = "yes" if n.agrees else "no"
        told = f"{n.real:.4g} | {n.again:.4g} | {n.sigma:.2g}"
        yield f"| {name} | {key} | {told} | {off} | {agrees} |"
    said = ", ".join(d.name for d in second.vehicle.effects) or "nothing"
    yield f"| {name} | still against the file that was handed back | | {said} | | | |"


def main(arguments: list[str] | None = None) -> None:
    """Print the table, or why there is none."""
    options = argparse.ArgumentParser(description="Handed back, flown again by ArduPilot's SITL.")
    options.add_argument("names", nargs="*", default=list(NAMES))
    options.add_argument("--seconds", type=float, default=180.0)
    options.add_argument("--speedup", type=float, default=5.0)
    chosen = options.parse_args(arguments)
    print(f"{HEAD}\n|{'---|' * HEAD.count(' | ')}---|")
    for name in chosen.names:
        try:
            find_binary("plane" if name.startswith("f") else "copter")
            for row in rows(name, seconds=chosen.seconds, speedup=chosen.speedup):
                print(row, flush=True)
        except NoBinaryError as error:
            print(f"{name} skipped: {error}")
        except SitlError as error:
            print(f"{name} was not flown: {error}")


if __name__ == "__main__":
    main()
