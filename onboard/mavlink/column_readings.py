"""What inertial messages and attitudes say, many of one kind at once, as columns.

Each message by itself is read in :mod:`onboard.mavlink.readings`, whose words are said here for
many; the tests hold one against the other.  ``records`` (n,) are payloads with fields by their
names in the dialect, ``places`` (n,) where each stands in the order of arrival, ``t`` (n,) boot
times, s.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.blocks import AttitudeColumns, ImuColumns, Places
from onboard.core.inputs.samples import ImuSource
from onboard.mavlink import limits
from onboard.mavlink.dialect import MESSAGE_IDS
from onboard.mavlink.readings import (
    ACCEL_FIELDS,
    CENTI,
    GYRO_FIELDS,
    MILLI_G,
    MILLI_RAD,
)

Floats: TypeAlias = NDArray[np.float64]
Records: TypeAlias = NDArray[np.void]

ATTITUDE: Final = MESSAGE_IDS["ATTITUDE"]
HIGHRES_IMU: Final = MESSAGE_IDS["HIGHRES_IMU"]
RAW_IMU: Final = MESSAGE_IDS["RAW_IMU"]
SCALED_IMU: Final = {MESSAGE_IDS[n]: imu for n, imu in
                     (("SCALED_IMU", 1), ("SCALED_IMU2", 2), ("SCALED_IMU3", 3))}  # fmt: skip
IN_COLUMNS: Final = frozenset((ATTITUDE, HIGHRES_IMU, RAW_IMU, *SCALED_IMU))
FORCE: Final = ("xacc", "yacc", "zacc")
RATE: Final = ("xgyro", "ygyro", "zgyro")


def boot_times(records: Records) -> Floats | None:
    """Boot times of stamped messages, s; None if one tells Unix time."""
    if "time_boot_ms" in (records.dtype.names or ()):
        ms: Floats = records["time_boot_ms"].astype(np.float64) * 1e-3
        return ms
    ticks = records["time_usec"]
    us: Floats = ticks.astype(np.float64) * 1e-6
    return us if np.all(ticks < limits.UNIX_FROM_US) else None


def attitude_columns(records: Records, places: Places, t: Floats) -> AttitudeColumns | None:
    """ATTITUDE; None if one is to be looked at by itself."""
    angles = _columns(records, ("roll", "pitch", "yaw"))
    return AttitudeColumns(places, t, angles) if np.isfinite(angles).all() else None


def imu_columns(
    kind: int, records: Records, places: Places, t: Floats
) -> tuple[list[ImuColumns], Counter[str]] | None:
    """Inertial messages of one kind by accelerometer, and what is left out of them, by name.

    None if one is to be looked at by itself.
    """
    force, rate = _columns(records, FORCE), _columns(records, RATE)
    numbers = np.full(len(t), SCALED_IMU.get(kind, 0))
    if kind not in SCALED_IMU:
        numbers = records["id"].astype(np.int64) + 1
    if kind == HIGHRES_IMU:
        rows = _highres(records, force, rate)
        if rows is None:
            return None
        return list(_by_imu(numbers, places, t, rows, (0.0, 0.0, ImuSource.HIGHRES_IMU))), Counter()
    source = ImuSource.SCALED_IMU if kind in SCALED_IMU else ImuSource.RAW_IMU
    heat = records["temperature"].astype(np.float64)
    # Temperature is an extension field: 0 where the sender does not know it.
    celsius = np.where(heat == 0.0, np.nan, heat * CENTI)
    rows = np.column_stack((rate * MILLI_RAD, force * MILLI_G, celsius))
    there = force.any(axis=1) | rate.any(axis=1)
    left_out = Counter({f"{source.value}: absent": n} if (n := int((~there).sum())) else {})
    manner = MILLI_G, MILLI_RAD, source
    return list(_by_imu(numbers[there], places[there], t[there], rows[there], manner)), left_out


def _highres(records: Records, force: Floats, rate: Floats) -> Floats | None:
    """Rows (n, 7) of HIGHRES_IMU, whose temperature is the barometer's."""
    told = records["fields_updated"] & (ACCEL_FIELDS | GYRO_FIELDS) == ACCEL_FIELDS | GYRO_FIELDS
    there = force.any(axis=1) | rate.any(axis=1)
    if not (told.all() and there.all() and np.isfinite(force).all() and np.isfinite(rate).all()):
        return None
    return np.column_stack((rate, force, np.full(len(rate), np.nan)))


def _by_imu(
    numbers: Places, places: Places, t: Floats, rows: Floats, manner: tuple[float, float, ImuSource]
) -> Iterator[ImuColumns]:
    """Columns of each accelerometer."""
    for imu in np.unique(numbers).tolist():
        its = np.flatnonzero(numbers == imu)
        yield ImuColumns(imu, places[its], t[its], rows[its], *manner)


def _columns(records: Records, names: Sequence[str]) -> Floats:
    """Fields as (n, d)."""
    return np.column_stack([records[name].astype(np.float64) for name in names])
