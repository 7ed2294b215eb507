"""What the sensor level hands to the vehicle's: its numbers, and what they leave unknown."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from onboard.core.diagnosis.records import Diagnosis
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.mean_force import load_sigma, mean_force_sigma
from onboard.core.estimate.misread import attitude_error, misread_of
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.vehicle.trajectory import UNKNOWN_TILT, Sensors

UNKNOWN_FORCE: Final = 0.05
"""Sigma of the force on each axis, m/s^2, where the sensor level found nothing: the offset's sigma
that a calibration has to reach; a sensor without one may be off by ten times that [tuned]."""
UNKNOWN_LOAD: Final = UNKNOWN_FORCE / STANDARD_GRAVITY
"""The same of how it changes with the load, by the load: as much at a gravity [physics]."""
LEAST_FORCE: Final = 0.002
"""Sigma of the force that no calibration goes below, m/s^2: numbers of 16 bits for 16 g either way
are in steps of 0.005, which are rounded by 0.0014 RMS [physics]."""

NO_SENSORS: Final = Sensors(np.ones(3), np.zeros(3), np.full(3, LEAST_FORCE))
"""Of a recording whose force is the slope of its velocity: nothing can be wrong with it alone."""


def sensors_of(diagnosis: Diagnosis, engine: Engine | None) -> Sensors:
    """What the sensor level has found, with what it leaves unknown of the force.

    Scale and offset are of a model, which has all that was found in it: what is undone is all of
    that or, where the flight says nothing, nothing.

    Args:
        diagnosis: of the flight.
        engine: whose sums gave it; None where there is none.
    """
    c = diagnosis.calibration
    timing = {name: e.value for name, e in diagnosis.timing.items() if math.isfinite(e.value)}
    misread, turned = None, None
    if diagnosis.silent or engine is None:
        scale, offset = np.array(c.in_force_scale), np.array(c.in_force_offset)
        sigma = np.full(3, UNKNOWN_FORCE)
        by_load = np.full(3, UNKNOWN_LOAD)
    else:
        scale, offset = np.array(c.scale), np.array(c.offset)
        sigma = np.maximum(_known(mean_force_sigma(engine), UNKNOWN_FORCE), LEAST_FORCE)
        by_load = _known(load_sigma(engine), UNKNOWN_LOAD)
        misread, turned = misread_of(engine), attitude_error(engine)
    tilt, tilt_sigma = turned or (np.zeros(3), UNKNOWN_TILT)
    return Sensors(
        scale,
        offset,
        sigma,
        timing.get("gps_delay_s", 0.0),
        max(timing.get("gps_smoothing_window_s", 0.0), 0.0),
        timing.get("imu_delay_s", 0.0),
        np.array([g.value for g in c.gyro_scale]),
        misread,
        tilt,
        tilt_sigma,
        by_load,
    )


def _known(sigma: Array | None, unknown: float) -> Array:
    """(3,) sigmas where the sums tell them, else that of what nobody knows."""
    if sigma is None:
        return np.full(3, unknown)
    out: Array = np.where(np.isfinite(sigma), sigma, unknown)
    return out
