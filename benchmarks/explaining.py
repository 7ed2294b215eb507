"""The sealed challenge: concealed effects, answers locked away before the diagnosis.

Vehicles, truths, effects and sizes are drawn by seed; the generators (``sitl``) integrate sensor
models at 1 kHz and share no code with the columns that look for the effects.  Each answer is
hashed and printed before ``diagnose`` runs.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from onboard.core.calibrator import Calibrator
from onboard.core.diagnosis import diagnose
from onboard.core.settings import EstimatorSettings
from onboard.mavlink.decode import Decoder
from sitl.builtin import effects as concealed
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec, fly_messages

DURATION_S = 240.0
Rng = np.random.Generator


def _size(rng: Rng, low: float, high: float) -> float:
    return float(rng.uniform(low, high) * rng.choice([-1.0, 1.0]))


def _xyz(rng: Rng, low: float, high: float) -> dict[str, float]:
    return {axis: _size(rng, low, high) for axis in "xyz"}


MAKERS: dict[str, Callable[[Rng], Any]] = {
    "gps_lever_arm": lambda r: concealed.GpsLeverArm(**_xyz(r, 0.3, 1.0)),
    "imu_delay": lambda r: concealed.ImuDelay(delay=float(r.uniform(0.045, 0.1))),
    "cross_axis": lambda r: concealed.CrossAxis(xy=_size(r, 0.02, 0.05), zy=_size(r, 0.02, 0.05)),
    "mount_tilt": lambda r: concealed.MountTilt(
        roll=_size(r, 0.03, 0.08), pitch=_size(r, 0.03, 0.08)
    ),
    "heading_error": lambda r: concealed.HeadingError(yaw=_size(r, 0.07, 0.2)),
    "temperature_drift": lambda r: concealed.TemperatureDrift(**_xyz(r, 0.015, 0.04)),
    "bias_ramp": lambda r: concealed.BiasRamp(**_xyz(r, 8e-4, 3e-3)),
    "bias_step": lambda r: concealed.BiasStep(time=float(r.uniform(90, 170)), **_xyz(r, 0.15, 0.5)),
    "throttle_coupling": lambda r: concealed.ThrottleCoupling(**_xyz(r, 0.4, 1.0)),
    "gps_fault": lambda r: concealed.GpsFault(
        start=float(r.uniform(90, 120)),
        end=float(r.uniform(135, 145)),
        north=_size(r, 1.2, 3.0),
        east=0.0,
    ),
    "clock_skew": lambda r: concealed.ClockSkew(rate=_size(r, 3e-4, 8e-4)),
}


@dataclass(frozen=True, slots=True)
class Outcome:
    """One recording's answer and what was said."""

    seed: int
    vehicle: str
    answer: str
    found: tuple[str, ...]
    seal: str


def one(job: tuple[int, str]) -> Outcome:
    """Draw, seal, record, diagnose."""
    seed, name = job
    rng = np.random.default_rng([seed, 977])
    vehicle: Any = "copter" if rng.random() < 0.5 else "plane"
    hidden = () if name == "control" else (MAKERS[name](rng),)
    answer = json.dumps([e.as_record() for e in hidden], sort_keys=True)
    seal = hashlib.sha256(answer.encode()).hexdigest()[:12]
    spec = FlightSpec(
        vehicle=vehicle, seed=seed, duration=DURATION_S, imus=random_imus(seed), effects=hidden
    )
    calibrator = Calibrator(EstimatorSettings(refine=False, buffer_s=3600.0))
    decoder = Decoder()
    for _, message in fly_messages(spec):
        for sample in decoder.decode(message):
            calibrator.feed(sample)
    calibrator.finish()
    found = diagnose(calibrator, 1).effects
    # The simulated receiver is late by 0.12 s in every recording: rightly reported, not counted.
    names = tuple(e.name for e in found if e.name != "gps_latency")
    return Outcome(seed, vehicle, name, names, seal)


def main(arguments: list[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Sealed challenge of concealed effects.")
    parser.add_argument("--count", type=int, default=60)
    parser.add_argument("--first", type=int, default=1000, help="first seed")
    chosen = parser.parse_args(arguments)
    names = ["control", *MAKERS]
    jobs = [(chosen.first + i, names[i % len(names)]) for i in range(chosen.count)]
    with ProcessPoolExecutor(max_workers=max(1, (os.cpu_count() or 2) - 1)) as pool:
        outcomes = list(pool.map(one, jobs))
    right: dict[str, list[bool]] = defaultdict(list)
    false = 0
    for o in outcomes:
        wanted = set() if o.answer == "control" else {o.answer}
        right[o.answer].append(wanted <= set(o.found))
        extra = set(o.found) - wanted
        false += bool(extra)
        if extra or not wanted <= set(o.found):
            print(
                f"  seed {o.seed} {o.vehicle}: hidden {o.answer}, said {', '.join(o.found) or '-'}"
            )
    print(f"{'effect':24}{'recordings':>12}{'identified':>12}")
    for name in names:
        if right[name]:
            print(f"{name:24}{len(right[name]):12}{100 * np.mean(right[name]):11.0f}%")
    print(f"recordings with a false discovery: {false} of {len(outcomes)}")
    print(f"seals: {' '.join(o.seal for o in outcomes[:6])} ...")


if __name__ == "__main__":
    main()
