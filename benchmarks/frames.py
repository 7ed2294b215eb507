"""What ``onboard match`` says of ArduPilot SITL's flights with airframes and winds of their own.

Looks for ``answers.json`` in ONBOARD_RECORDINGS/frames or in ``../shared/recordings/frames`` beside
the project, and prints the table of docs/benchmarks.md.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.recorded import WHERE, folder

HEADS = (
    "recording",
    "names",
    "wind off by, m/s",
    "drag off by",
    "lateral force, m/s^2",
    "CPU s",
    "MB",
)
PROFILE_TOP_M = 60.0
"""Height from which ArduPilot's wind is what it is told to be."""


def recordings() -> Path:
    """Where they are."""
    return folder().parent / "frames"


def asked(path: Path) -> tuple[dict[str, Any], float, float]:
    """What the command says of a recording; its processor time, s, and its memory, MB."""
    with tempfile.TemporaryDirectory(prefix="frames-") as made:
        document = Path(made) / "match.json"
        command = [sys.executable, "-m", "onboard", "match", str(path), "--json", str(document)]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL)  # noqa: S603
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            raise RuntimeError(f"{path.name}: onboard match ended with {process.returncode}")
        return json.loads(document.read_text()), used.ru_utime + used.ru_stime, used.ru_maxrss / 1e3


def wind_error(said: Mapping[str, Any], truth: Mapping[str, Any]) -> float:
    """Length of the error at the flight's mean height, m/s."""
    blows = truth.get("wind_towards_m_s", {})
    share = 1.0
    if str(blows.get("profile", "uniform")) != "uniform":
        share = math.sqrt(min(said["height_m"] / PROFILE_TOP_M, 1.0))
    apart = (said[k] - share * blows.get(k, 0.0) for k in ("north", "east"))
    return math.hypot(*apart)


def drag_error(effects: Mapping[str, Any], truth: Mapping[str, Any]) -> float:
    """Largest relative error of what is told of a copter's drag; NaN where nothing is."""
    out = []
    for name, key, true in (
        ("rotor_drag", "mcoef", "EK3_DRAG_MCOEF"),
        ("body_drag", "bcoef_x", "EK3_DRAG_BCOEF"),
        ("body_drag", "bcoef_y", "EK3_DRAG_BCOEF"),
    ):
        if name in effects and "drag" in truth:
            out.append(abs(effects[name]["values"][key]["real"] / truth["drag"][true] - 1.0))
    return max(out, default=math.nan)


def lateral(mismatch: Mapping[str, Any], when: str) -> float:
    """RMS over x and y on flight that was not used, m/s^2."""
    return math.sqrt(sum(mismatch[axis][when] ** 2 for axis in "xy") / 2.0)


def lines(names: Sequence[str] = ()) -> Iterator[str]:
    """One row per recording; of these alone, if any are named."""
    truths = json.loads((recordings() / "answers.json").read_text())["recordings"]
    yield f"| {' | '.join(HEADS)} |"
    yield "|" + "---|" * len(HEADS)
    for name, truth in truths.items():
        if names and name not in names:
            continue
        document, seconds, memory = asked(recordings() / f"{name}.BIN")
        effects = {e["name"]: e for e in document["effects"]}
        wrong = sorted(set(effects) ^ set(truth["effects"]))
        drag = drag_error(effects, truth)
        mismatch = document["mismatch"]
        yield (
            f"| {name} {truth['vehicle']}: {', '.join(truth['effects']) or 'nothing'} | "
            f"{'all, no other' if not wrong else 'wrong: ' + ', '.join(wrong)} | "
            f"{wind_error(document['wind'], truth):.3f} | "
            f"{f'{100 * drag:.1f} %' if math.isfinite(drag) else ''} | "
            f"{lateral(mismatch, 'before'):.3f} -> {lateral(mismatch, 'after'):.3f} | "
            f"{seconds:.1f} | {memory:.0f} |"
        )


def main(arguments: list[str] | None = None) -> None:
    """Print the table, or why there is none."""
    options = argparse.ArgumentParser(description="What is said of flights of ArduPilot's SITL.")
    options.add_argument("names", nargs="*", help="recordings; all without")
    chosen = options.parse_args(arguments)
    if not (recordings() / "answers.json").exists():
        print(WHERE)
        return
    for line in lines(chosen.names):
        print(line, flush=True)


if __name__ == "__main__":
    main()
