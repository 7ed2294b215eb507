"""DataFlash records of inertial sensors and of the attitude, in columns and one by one."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.samples import AttitudeSample, ImuSample, Sample
from onboard.recordings.bulk import samples_of
from onboard.recordings.dataflash_batch import Batch, Converted
from onboard.recordings.dataflash_context import Context, Floats

Integers = NDArray[np.int64]

MOST_IMUS = 5


def imu_numbers(batch: Batch) -> Integers:
    """(n,) numbers of the accelerometers of IMU records, from 1."""
    first = int(batch.form.name[3:] or 1)
    told = np.minimum(np.array(batch.integers("I")), MOST_IMUS)  # damaged bytes make any number
    numbers: Integers = told.astype(np.int64) + first
    return numbers


def imu_rows(batch: Batch) -> tuple[Floats, NDArray[np.bool_]]:
    """Rate, force and temperature (n, 7) of IMU records, and whether they are measurements (n,).

    The temperature is NaN where the record has none.
    """
    form, records = batch.form, batch.records
    names = ("GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ")
    measured = np.column_stack([form.numbers(records, name) for name in names])
    named = next((c for c in ("T", "Temp") if form.has(c)), None)
    heat = form.numbers(records, named) if named else np.zeros(len(records))
    # A temperature of exactly 0 is that of a sensor without a thermometer.
    celsius = np.where(heat == 0.0, np.nan, heat)
    # Not a measurement: the sensor was not there yet, or there is none such.
    there = np.any(measured != 0.0, axis=1) & (imu_numbers(batch) <= MOST_IMUS)
    return np.column_stack((measured, celsius)), there


def imu(batch: Batch, _context: Context) -> Converted:
    """IMU (with or without instance), IMU2, IMU3."""
    rows, there = imu_rows(batch)
    p, q, r, x, y, z, celsius = rows.T.tolist()
    force, rate = list(zip(x, y, z, strict=True)), list(zip(p, q, r, strict=True))
    heat = [None if math.isnan(degrees) else degrees for degrees in celsius]
    numbers = imu_numbers(batch).tolist()
    samples: list[Sample | None] = []
    samples += samples_of(ImuSample, batch.t.tolist(), numbers, force, rate, heat)
    for k in np.flatnonzero(~there).tolist():
        samples[k] = None
    return samples


def attitude_angles(batch: Batch) -> Floats:
    """Roll, pitch and yaw (n, 3) of ATT or XKF1 records, rad."""
    columns = (batch.form.numbers(batch.records, c) for c in ("Roll", "Pitch", "Yaw"))
    return np.radians(np.column_stack(tuple(columns)))


def attitude_rows(batch: Batch, context: Context) -> NDArray[np.bool_]:
    """(n,) whether records of an attitude are of the lane that flies."""
    t, lane = context.lanes
    if not batch.form.has("C") or not len(t):
        return np.ones(len(batch.t), dtype=bool)
    last = np.clip(np.searchsorted(t, batch.t, side="right") - 1, 0, None)
    its: NDArray[np.bool_] = np.array(batch.integers("C")) == lane[last]
    return its


def attitude(batch: Batch, context: Context) -> Converted:
    """ATT, or XKF1 where ATT is not of the body (see :mod:`onboard.core.inputs.views`)."""
    samples: list[Sample | None] = []
    samples += samples_of(AttitudeSample, batch.t.tolist(), *attitude_angles(batch).T.tolist())
    for k in np.flatnonzero(~attitude_rows(batch, context)).tolist():
        samples[k] = None
    return samples
