"""What the estimator costs, and what that grows with: processor time, medians, ratios.

Per inertial sample and per GPS epoch; by the number of unknowns carried; and over hours of flight,
where both the time of an epoch and the memory have to stay as they are.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.matched import draw, path
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.inputs.samples import GpsFix, ImuSample, ParameterValue, Sample
from onboard.core.physics.catalogue import catalogue
from onboard.core.physics.effect import Origin

REPEATS = 5
BETWEEN_FLIGHTS_S = 3.0
PARTS = 8
"""Blocks of the long stream that are timed one by one."""
ONCE = replace(CalibratorSettings(), refine=False)


def _seconds(samples: list[Sample], settings: CalibratorSettings) -> tuple[float, Calibrator]:
    made = Calibrator(settings)
    began = time.process_time()
    for sample in samples:
        made.feed(sample)
    made.finish()
    return time.process_time() - began, made


def per_sample(samples: list[Sample]) -> list[str]:
    """Lines on one flight: an inertial sample, an epoch, and what refinements add."""
    imu = sum(isinstance(s, ImuSample) for s in samples)
    fixes = sum(isinstance(s, GpsFix) for s in samples)
    others: list[Sample] = [s for s in samples if not isinstance(s, GpsFix)]
    inertial, whole, refined = (
        float(np.median([_seconds(x, settings)[0] for _ in range(REPEATS)]))
        for x, settings in ((others, ONCE), (samples, ONCE), (samples, CalibratorSettings()))
    )
    length = imu / 50.0
    return [
        f"{'inertial sample with its attitude':44}{1e6 * inertial / imu:10.1f} us",
        f"{'GPS epoch':44}{1e6 * (whole - inertial) / fixes:10.1f} us",
        f"{'one pass, of real time':44}{100 * whole / length:10.2f} %",
        f"{'with refinements, of real time':44}{100 * refined / length:10.2f} %",
    ]


def by_columns(samples: list[Sample]) -> list[str]:
    """Lines on the same pass with more and more unknowns."""
    batches = _seconds(samples, ONCE)[1].engine(1).batches
    epochs = sum(len(c.fixes) for c in batches)
    families = [f for f in catalogue(Origin(batches[0].fixes.t[0])) if f.unknowns and not f.needs]
    out, least = [], 0.0
    for count in (0, 2, len(families)):
        spent = []
        for _ in range(REPEATS):
            engine = Engine(ONCE, more=tuple(families[:count]))
            began = time.process_time()
            for batch in batches:
                engine.add(batch)
            spent.append(time.process_time() - began)
        middle = 1e6 * float(np.median(spent)) / epochs
        least = least or middle
        name = f"GPS epoch with {engine.model.size} unknowns"
        out.append(f"{name:44}{middle:10.1f} us   ratio {middle / least:.2f}")
    return out


def repeated(samples: list[Sample], hours: float) -> Iterator[Sample]:
    """One flight after the other on a clock that goes on; parameters come once."""
    timed = [s for s in samples if not isinstance(s, ParameterValue)]
    yield from (s for s in samples if isinstance(s, ParameterValue))
    first, last = timed[0].t or 0.0, timed[-1].t or 0.0
    period = last - first + BETWEEN_FLIGHTS_S
    for i in range(int(np.ceil(hours * 3600.0 / period))):
        for s in timed:
            yield replace(s, t=(s.t or 0.0) + i * period)


def _resident() -> float:
    """Memory of this process that is in use now, MB (Linux)."""
    with Path("/proc/self/statm").open(encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def growth(samples: list[Sample], hours: float) -> list[str]:
    """Lines on hours of flight: time of an epoch, growth of memory, size of the saved sums."""
    made = Calibrator()
    edges = np.linspace(0.0, 3600.0 * hours, PARTS + 1)[1:]
    out = [f"{'hours of flight':>16}{'us an epoch':>14}{'memory grown, MB':>18}{'saved, kB':>12}"]
    spent, epochs, part, before = 0.0, 0, 0, _resident()
    for s in repeated(samples, hours):
        if s.t is not None and part < PARTS and s.t > edges[part]:
            memory = _resident() - before
            saved = len(made.to_bytes()) / 1024.0
            out.append(
                f"{edges[part] / 3600.0:16.2f}{1e6 * spent / max(epochs, 1):14.0f}"
                f"{memory:18.0f}{saved:12.0f}"
            )
            spent, epochs, part = 0.0, 0, part + 1
        began = time.process_time()
        made.feed(s)
        spent += time.process_time() - began
        epochs += isinstance(s, GpsFix)
    return out


def main(arguments: list[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Cost of the estimator and its growth.")
    parser.add_argument("--hours", type=float, default=2.0, help="length of the long stream")
    chosen = parser.parse_args(arguments)
    samples = draw(path("copter"), 0).samples
    for line in (*per_sample(samples), *by_columns(samples), *growth(samples, chosen.hours)):
        print(line, flush=True)


if __name__ == "__main__":
    main()
