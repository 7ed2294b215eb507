"""Faults of the GPS receiver laid over clean flights: does the answer stay within its limits?

A number may instead be marked unobserved, with a sigma that covers its error.  The fault has to
be named: counted among what was refused, or given as the reason for a closed window.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.faults import FAULTS, Fault
from benchmarks.recorded import (
    Array,
    Flight,
    answered,
    error_of,
    folder,
    limits,
    moving_span,
    recorded,
    simulated,
)
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.result import Status
from onboard.core.gps.distrust import WindowClosed
from sitl.builtin.truth import random_imus
from sitl.builtin.world import Vehicle
from sitl.recording import FlightSpec

COVERED = 3.0
"""Sigmas within which the error of a number that is marked unobserved has to be."""
VEHICLES: tuple[Vehicle, ...] = ("copter", "plane")
RECORDINGS = ("a01", "b01", "b05", "c01")


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a faulted flight gave for one accelerometer.

    Attributes:
        flight: its name.
        fault: its name.
        imu: accelerometer.
        calibrated: whether the status is that.
        error: (6,) scale and offset less the truth.
        sigma: (6,) as claimed.
        observed: (6,) flags.
        limit: (6,) what the error should stay below.
        named: counts by those names that account for the fault.
    """

    flight: str
    fault: str
    imu: int
    calibrated: bool
    error: Array
    sigma: Array
    observed: np.ndarray[tuple[int], np.dtype[np.bool_]]
    limit: Array
    named: dict[str, int]

    @property
    def kept(self) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """(6,) within the limit, or marked unobserved and covered."""
        covered = ~self.observed & (np.abs(self.error) < COVERED * self.sigma)
        return (np.abs(self.error) < self.limit) | covered

    @property
    def good(self) -> bool:
        """Everything that is asked for."""
        return self.calibrated and bool(self.kept.all()) and bool(self.named)


def outcomes(flight: Flight, fault: Fault) -> list[Outcome]:
    """Fly it with the fault; one outcome for each accelerometer."""
    span = moving_span(flight.samples)
    made, closed = Calibrator(), Counter[str]()
    for sample in fault.laid_over(flight.samples, span):
        for event in made.feed(sample):
            if isinstance(event, WindowClosed):
                closed[event.reason.value] += 1
    made.finish()
    out = []
    for imu in made.imus:
        c = made.calibration(imu)
        accounted = Counter(c.rejected) | closed
        out.append(
            Outcome(
                flight.name,
                fault.name,
                imu,
                c.status is Status.CALIBRATED,
                error_of(c, flight),
                np.array(c.scale_sigma + c.offset_sigma),
                np.array(c.observable),
                limits(flight.vehicle),
                {name: accounted[name] for name in sorted(fault.names) if accounted[name]},
            )
        )
    return out


def flights(names: Sequence[str]) -> list[Flight]:
    """Shared recordings where there are, and two simulated flights."""
    found = [recorded(folder() / f"{name}.tlog") for name in names if name in answered()]
    for seed, vehicle in enumerate(VEHICLES, 3):
        imus = random_imus(seed)
        found.append(simulated(FlightSpec(vehicle=vehicle, seed=seed, duration=400.0, imus=imus)))
    return found


def main(arguments: list[str] | None = None) -> None:
    """Print one line per flight and fault."""
    parser = argparse.ArgumentParser(description="Faults of the GPS receiver.")
    parser.add_argument("--recordings", nargs="*", default=RECORDINGS, help="names of recordings")
    chosen = parser.parse_args(arguments)
    print(
        f"{'flight':18}{'fault':36}{'scale':>8}{'xy offs.':>9}{'z offs.':>9}"
        f"{'of limit':>9}{'sigmas':>8}{'kept':>6}  named"
    )
    good = total = 0
    for flight in flights(chosen.recordings):
        for fault in FAULTS:
            for o in outcomes(flight, fault):
                e = np.abs(o.error)
                name = o.flight + ("" if o.imu == 1 else f" #{o.imu}")
                named = ", ".join(f"{k} {n}" for k, n in o.named.items()) or "-"
                good, total = good + o.good, total + 1
                print(
                    f"{name:18}{o.fault:36}{e[:3].max():8.4f}{e[3:5].max():9.3f}{e[5]:9.3f}"
                    f"{(e / o.limit).max():9.2f}{(e / o.sigma).max():8.1f}"
                    f"{int(o.kept.sum()):4}/6  {named}"
                    f"{'' if o.calibrated else ', not calibrated'}",
                    flush=True,
                )
    print(f"{good} of {total} within limits and named")


if __name__ == "__main__":
    main()
