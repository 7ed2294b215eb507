"""DataFlash records to blocks of samples: inertial ones and attitudes as columns.

What the records mean is said in :mod:`onboard.recordings.dataflash_records`; what is said there of
each inertial record is said here of many, and the tests hold one against the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeAlias

import numpy as np

from onboard.core.inputs.blocks import NO_ATTITUDE, AttitudeColumns, Block, ImuColumns, Places
from onboard.core.inputs.samples import Sample
from onboard.recordings.dataflash_batch import Batch
from onboard.recordings.dataflash_context import Context
from onboard.recordings.dataflash_inertial import (
    attitude_angles,
    attitude_rows,
    imu_numbers,
    imu_rows,
)
from onboard.recordings.dataflash_records import ATTITUDE_NAMES, CONVERTERS, IMU_NAMES

Batches: TypeAlias = Sequence[tuple[Places, Batch]]
"""Records of one format each, and where they stand."""


def samples_in_order(batches: Batches, context: Context) -> tuple[list[Sample], list[int]]:
    """Samples of records in the order in which these stand, and their places."""
    samples: list[Sample | None] = []
    places: list[Places] = [np.zeros(0, np.int64)]
    for rows, batch in batches:
        for convert in CONVERTERS[batch.form.name]:
            with np.errstate(all="ignore"):  # damaged bytes make any number
                samples.extend(convert(batch, context))
            places.append(rows)
    at = np.concatenate(places)
    order = np.argsort(at, kind="stable")
    found = list(map(samples.__getitem__, order.tolist()))
    there = [sample is not None for sample in found]
    return [s for s in found if s is not None], at[order][np.array(there, bool)].tolist()


def block_of(batches: Batches, context: Context) -> Block:
    """The same samples as a block."""
    imus = [
        c for rows, batch in batches if batch.form.name in IMU_NAMES for c in _imus(rows, batch)
    ]
    attitudes = [(rows, batch) for rows, batch in batches if batch.form.name in ATTITUDE_NAMES]
    in_columns = {*IMU_NAMES}
    attitude = NO_ATTITUDE
    if len(attitudes) == 1:
        in_columns.update(ATTITUDE_NAMES)
        rows, batch = attitudes[0]
        its = attitude_rows(batch, context)
        attitude = AttitudeColumns(rows[its], batch.t[its], attitude_angles(batch)[its])
    others = [(rows, batch) for rows, batch in batches if batch.form.name not in in_columns]
    in_order = tuple(sorted(imus, key=lambda columns: columns.places.item(0)))
    return Block(in_order, attitude, *samples_in_order(others, context))


def _imus(places: Places, batch: Batch) -> Iterator[ImuColumns]:
    """Columns of each accelerometer that records of one format are of."""
    rows, there = imu_rows(batch)
    numbers = imu_numbers(batch)
    for imu in np.unique(numbers[there]).tolist():
        its = np.flatnonzero(there & (numbers == imu))
        yield ImuColumns(imu, places[its], batch.t[its], rows[its])
