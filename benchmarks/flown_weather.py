"""What a simulated flight has besides its errors: gusts, shaking, noise, poor receivers, compasses.

Drawn from the seed, and after everything else, so that :mod:`benchmarks.flown_sensors` has the
same errors with and without.  None excuses a number, and none is of the catalogue, but that a
receiver that loses bytes reports velocities of before (a ``gps_fault``, counted as false all the
same).  ArduPilot's gusts are white from step to step of its physics, and shake a wing by several g:
planes get a sixth of a copter's.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sitl.builtin.world import Vehicle

Parameters = dict[str, float]
Condition = Callable[[Vehicle, np.random.Generator], Parameters]


def _gusts(vehicle: Vehicle, rng: np.random.Generator) -> Parameters:
    low, high = (0.5, 3.0) if vehicle == "copter" else (0.1, 0.5)
    return {"SIM_WIND_TURB": float(rng.uniform(low, high))}


def _shaking(_: Vehicle, rng: np.random.Generator) -> Parameters:
    size = float(rng.uniform(0.2, 3.0))
    motors = {
        "SIM_VIB_MOT_MAX": float(rng.uniform(80.0, 250.0)),
        "SIM_VIB_MOT_MULT": float(rng.uniform(0.3, 1.5)),
    }
    return motors | {f"SIM_ACC{i}_RND": size for i in (1, 2)}


def _noise(_: Vehicle, rng: np.random.Generator) -> Parameters:
    force, rate = float(rng.uniform(0.1, 1.0)), float(rng.uniform(0.1, 2.0))
    return {f"SIM_{kind}{i}_RND": x for i in (1, 2) for kind, x in (("ACC", force), ("GYR", rate))}


def _rate(_: Vehicle, rng: np.random.Generator) -> Parameters:
    hz, height = float(rng.choice([1, 2, 5, 20])), float(rng.uniform(0.0, 0.5))
    return {"SIM_GPS1_HZ": hz, "SIM_GPS1_NOISE": height}


def _lost(_: Vehicle, rng: np.random.Generator) -> Parameters:
    return {"SIM_GPS1_BYTELOS": float(rng.uniform(0.02, 0.3))}


def _drift(_: Vehicle, rng: np.random.Generator) -> Parameters:
    return {"SIM_DRIFT_SPEED": float(rng.uniform(0.05, 0.5))}


def _turning(_: Vehicle, rng: np.random.Generator) -> Parameters:
    return {f"SIM_GYR{i}_BIAS_{a}": float(rng.uniform(-0.02, 0.02)) for i in (1, 2) for a in "XYZ"}


def _compass(_: Vehicle, rng: np.random.Generator) -> Parameters:
    return {f"SIM_MAG1_OFS_{a}": float(rng.uniform(-60.0, 60.0)) for a in "XYZ"}


CONDITIONS: tuple[Condition, ...] = (
    _gusts,
    _shaking,
    _noise,
    _rate,
    _lost,
    _drift,
    _turning,
    _compass,
)
MOST = 3
"""Conditions that a flight has at the most."""


def weather(seed: int, vehicle: Vehicle) -> tuple[list[str], Parameters]:
    """Words for what a flight has, and parameters of the simulator, one condition to three."""
    rng = np.random.default_rng([seed, 77])
    count = int(rng.integers(1, MOST + 1))
    chosen = [CONDITIONS[i] for i in rng.choice(len(CONDITIONS), count, replace=False).tolist()]
    parameters: Parameters = {}
    for condition in chosen:
        parameters |= condition(vehicle, rng)
    return [condition.__name__.removeprefix("_") for condition in chosen], parameters
