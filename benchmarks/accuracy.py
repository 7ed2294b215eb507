"""Errors of the six numbers and of the latency on recordings whose answers are known.

Looks for ``answers.json`` in ONBOARD_RECORDINGS/sitl or in ``../shared/recordings/sitl`` beside the
project.
"""

from __future__ import annotations

import json
import os
import time
from pathlib import Path
from typing import Any

import numpy as np

from onboard.core.calibrator import Calibrator
from onboard.replay import replay

TIMING = {"gps_latency", "gps_smoothing"}


def folder() -> Path:
    """Where the recordings are."""
    beside = Path(__file__).resolve().parents[1] / ".." / "shared" / "recordings"
    return Path(os.environ.get("ONBOARD_RECORDINGS", beside)) / "sitl"


def lines(place: Path) -> list[str]:
    """One line per recording and accelerometer."""
    answers: dict[str, Any] = json.loads((place / "answers.json").read_text())["recordings"]
    out = [
        "recording    worst scale x, y offset  z offset latency ms worst sigma     s",
    ]
    for name, answer in answers.items():
        if {e["name"] for e in answer["effects"]} - TIMING:
            continue
        for file in sorted(place.glob(f"{name}.*")):
            began = time.perf_counter()
            result = replay([file], Calibrator())
            spent = time.perf_counter() - began
            for c in result.calibrations:
                truth = answer if c.imu == 1 else answer.get(f"imu{c.imu}")
                if truth is None:
                    continue
                error = np.array(c.scale + c.offset) - np.array(truth["scale"] + truth["offset"])
                z = np.abs(error) / np.array(c.scale_sigma + c.offset_sigma)
                late = 1e3 * (c.timing["gps_delay_s"].value - answer["net_gps_delay_s"])
                shown = f"{late:11.1f}" if file.suffix == ".tlog" else f"{'':11}"
                out.append(
                    f"{file.name + ('' if c.imu == 1 else f' #{c.imu}'):12}"
                    f"{np.abs(error[:3]).max():12.4f}{np.abs(error[3:5]).max():12.3f}"
                    f"{abs(error[5]):10.3f}{shown}{z.max():12.1f}{spent:6.1f}"
                )
    return out


def main(arguments: list[str] | None = None) -> None:
    """Print the table, or why there is none."""
    del arguments
    place = folder()
    if not (place / "answers.json").is_file():
        print("no recordings with answers beside the project; set ONBOARD_RECORDINGS")
        return
    for line in lines(place):
        print(line)


if __name__ == "__main__":
    main()
