"""Errors of what replay answers on recordings whose answers are known: the six, the latency.

Looks for ``answers.json`` in ONBOARD_RECORDINGS/sitl or in ``../shared/recordings/sitl`` beside the
project, and prints the table of docs/benchmarks.md.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from benchmarks.recorded import WHERE, clean, error_of, flown, limits, recorded

HEADS = (
    "recording",
    "worst scale",
    "worst x, y offset",
    "z offset",
    "latency, ms",
    "sigmas",
    "of limit",
    "CPU s",
)


def lines() -> Iterator[str]:
    """One row per recording and accelerometer, and a summary."""
    yield f"| {' | '.join(HEADS)} |"
    yield "|" + "---|" * len(HEADS)
    shares: list[float] = []
    sigmas: list[float] = []
    latencies: list[float] = []
    for file in clean():
        flight = recorded(file)
        began = time.process_time()
        made = flown(flight.samples)
        answers = {imu: made.calibration(imu) for imu in made.imus}
        spent = time.process_time() - began
        for imu, c in answers.items():
            e = error_of(c, flight)
            z = np.abs(e) / np.array(c.scale_sigma + c.offset_sigma)
            share = np.abs(e) / limits(flight.vehicle)
            late = 1e3 * (c.timing["gps_delay_s"].value - flight.delay)
            # A log's stamps are of another kind than a stream's: its answer is not known.
            streamed = file.suffix == ".tlog"
            shares.extend(share)
            sigmas.extend(z)
            latencies.extend([abs(late)] if streamed else [])
            name = file.name if imu == 1 else f"{file.name} #{imu}"
            yield (
                f"| {name} {flight.vehicle} | {np.abs(e[:3]).max():.4f} | "
                f"{np.abs(e[3:5]).max():.3f} | {abs(e[5]):.3f} | "
                f"{f'{late:.1f}' if streamed else ''} | {z.max():.1f} | {share.max():.2f} | "
                f"{spent:.1f} |"
            )
    n = len(shares)
    yield (
        f"{n} numbers: {sum(x < 1.0 for x in shares)} within their limits, "
        f"{sum(x <= 3.0 for x in sigmas)} within 3 sigma; worst latency {max(latencies):.1f} ms"
    )


def main(arguments: list[str] | None = None) -> None:
    """Print the table, or why there is none."""
    del arguments
    if not clean():
        print(WHERE)
        return
    for line in lines():
        print(line, flush=True)


if __name__ == "__main__":
    main()
