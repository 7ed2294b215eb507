"""RMS error over the Cramer-Rao bound, on flights drawn from the estimator's own model.

One is the best that any unbiased estimator can do.  Two columns: the estimator as it is, which has
to find the levels of noise and the timing by itself, and with the true levels told: what lies
between them is the price of not knowing them.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.bound import bound
from benchmarks.matched import LEVELS, draw, path
from benchmarks.recorded import Array, Flight, error_of, fed
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.result import SIX_NAMES
from onboard.core.estimate.settings import CalibratorSettings
from sitl.builtin.world import Vehicle

VEHICLES: tuple[Vehicle, ...] = ("copter", "plane")


def told(made: Calibrator, flight: Flight) -> Array:
    """(6,) error of an engine that is told the levels of noise, over the same flight."""
    settings = replace(CalibratorSettings(), refine=False)
    engine = Engine(settings, np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]), noise=LEVELS)
    for batch in made.engine(1).batches:
        engine.add(batch)
    engine.refine(levels=False)
    solution = engine.solution()
    assert solution is not None
    scale, beta = solution.theta[:3], solution.theta[3:6]
    out: Array = np.concatenate([scale, -beta / scale]) - flight.truth[1]
    return out


def scores(vehicle: Vehicle, count: int, first: int = 0) -> dict[str, Array]:
    """Errors over the bound, (count, 6) each: as it is, with levels told, and claimed sigmas."""
    flown = path(vehicle)
    limit = bound(flown)
    out: dict[str, list[Array]] = {"estimator": [], "told": [], "claimed": []}
    for seed in range(first, first + count):
        flight = draw(flown, seed)
        scale = flight.truth[1][:3]
        unit = limit * np.concatenate([scale, 1.0 / scale])
        made = fed(flight.samples)
        c = made.calibration(1)
        out["estimator"].append(error_of(c, flight) / unit)
        out["told"].append(told(made, flight) / unit)
        # The bound takes the gyroscope's axes for those of the accelerometer, and here they are.
        out["claimed"].append(c.sigma_with_its_gyroscope / unit)
    return {name: np.array(values) for name, values in out.items()}


def table(vehicle: str, limit: Array, found: dict[str, Array]) -> list[str]:
    """Lines for people: each ratio with its own standard error."""
    n = len(found["estimator"])
    chance = 1.0 / np.sqrt(2.0 * n)
    out = [
        f"{vehicle}: {n} flights; standard error of each ratio {100 * chance:.0f} %",
        f"  {'':10}{'bound':>9}{'RMS/bound':>11}{'levels told':>13}{'claimed':>9}",
    ]
    rms = {k: np.sqrt(np.mean(found[k] ** 2, axis=0)) for k in ("estimator", "told")}
    claimed = np.sqrt(np.mean(found["claimed"] ** 2, axis=0))
    for i, name in enumerate(SIX_NAMES):
        out.append(
            f"  {name:10}{limit[i]:9.4f}{rms['estimator'][i]:11.2f}{rms['told'][i]:13.2f}"
            f"{claimed[i]:9.2f}"
        )
    mean = {k: np.sqrt(np.mean(found[k] ** 2)) for k in found}
    out.append(
        f"  {'all six':10}{'':9}{mean['estimator']:11.2f}{mean['told']:13.2f}{mean['claimed']:9.2f}"
    )
    return out


def main(arguments: list[str] | None = None) -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="RMS error over the Cramer-Rao bound.")
    parser.add_argument("--count", type=int, default=100, help="flights of each vehicle")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--vehicle", choices=VEHICLES, help="one of them only")
    parser.add_argument("--save", type=Path, help="where to write the scores as JSON")
    chosen = parser.parse_args(arguments)
    kept = {}
    for vehicle in (chosen.vehicle,) if chosen.vehicle else VEHICLES:
        found = scores(vehicle, chosen.count, chosen.first)
        kept[vehicle] = {name: values.tolist() for name, values in found.items()}
        for line in table(vehicle, bound(path(vehicle)), found):
            print(line, flush=True)
        if chosen.save:
            chosen.save.write_text(json.dumps(kept))


if __name__ == "__main__":
    main()
