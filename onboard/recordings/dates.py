"""When a recording was flown: GPS says the date, the autopilot's clock how long it lasted.

A date is one number: the median of Unix time less time since boot.  So a week that one record has
wrong (DataFlash has no checksums, and receivers say wrong dates at times) makes no flight of years,
beside which every other one would be *flown at the same time*.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.boot_time import LONGEST_DELAY_S
from onboard.core.inputs.samples import FIX_3D
from onboard.recordings.arrays import Arrays
from onboard.recordings.dataflash_formats import Records
from onboard.recordings.fields import numbers, of_autopilot

Floats = NDArray[np.float64]

GPS_EPOCH_UNIX_S = 315_964_800.0
LEAP_S = 18.0
"""GPS time less UTC since 2017.  A receiver that has not been told of it yet is off by as much, and
by no more: what differs by more from most dates of its boot is none [bound]."""
WEEK_S = 604_800.0
EARLIEST_UNIX_S = 1_262_304_000.0
"""2010: no autopilot of which there is a log flew before; a clock that says so is not set."""
LATEST_UNIX_S = 4_102_444_800.0
"""2100: the same of clocks that are damaged [bound]."""


def times(arrays: Arrays) -> tuple[float | None, float | None]:
    """Unix time of the first and the last fix, s; None where there is none with a date."""
    with np.errstate(all="ignore"):  # damaged bytes make any number
        spans = [
            span
            for boot, unix in _clocks(arrays)
            for run in _boots(boot)
            if (span := _span(boot[run], unix[run])) is not None
        ]
    return (min(a for a, _ in spans), max(b for _, b in spans)) if spans else (None, None)


def _span(boot: Floats, unix: Floats) -> tuple[float, float] | None:
    """Of one boot."""
    at = unix - boot
    dated = (boot >= 0.0) & (at > EARLIEST_UNIX_S) & (unix < LATEST_UNIX_S)
    boot, at = boot[dated], at[dated]
    if not len(at):
        return None
    began = float(np.quantile(at, 0.5, method="lower"))  # one of them, also of two
    its = boot[np.abs(at - began) <= LEAP_S]
    return began + float(its.min()), began + float(its.max())


def _boots(boot: Floats) -> list[NDArray[np.intp]]:
    """Rows of each boot: a .tlog goes on when the autopilot is started again."""
    again = np.flatnonzero(np.diff(boot) < -LONGEST_DELAY_S) + 1
    return np.split(np.arange(len(boot)), again)


def _clocks(arrays: Arrays) -> Iterator[tuple[Floats, Floats]]:
    """Time since boot (n,) and Unix time (n,) of the fixes of each autopilot, s."""
    if (gps := arrays.tables.get("GPS")) is not None:
        yield from _of_gps(gps)
    elif (system := of_autopilot(arrays, "SYSTEM_TIME")) is not None:
        for sender in np.unique(system["sender_system"]):
            its = system[system["sender_system"] == sender]
            yield its["time_boot_ms"] / 1e3, its["time_unix_usec"] / 1e6
    else:
        for name in ("vehicle_gps_position", "sensor_gps"):
            fixes = arrays.tables.get(name)
            both = None if fixes is None else numbers(fixes, "timestamp", "time_utc_usec")
            if both is not None:
                yield both[0] / 1e6, both[1] / 1e6
                return


def _of_gps(fixes: Records) -> Iterator[tuple[Floats, Floats]]:
    """Of ArduPilot's GPS records that have a fix."""
    for names in (("GWk", "GMS"), ("Week", "TimeMS")):
        if (values := numbers(fixes, *names, "Status")) is not None:
            there = (values[2] >= FIX_3D) & (values[0] > 0.0)
            week, ms = values[:2, there]
            unix = GPS_EPOCH_UNIX_S + week * WEEK_S + ms / 1e3 - LEAP_S
            # Logs of old have no time since boot in GPS: the receiver's own clock counts as well.
            boot = ms / 1e3
            for name, unit in (("TimeUS", 1e-6), ("T", 1e-3)):
                if (clock := numbers(fixes, name)) is not None:
                    boot = unit * clock[0, there]
                    break
            yield boot, unix
            return
