"""Recordings that say on which day they were flown."""

from __future__ import annotations

import struct
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.builtin.messages import packed
from sitl.recording import FlightSpec, run
from tests.recordings.telemetry_writer import telemetry

DAY_S = 86_400.0
DAY_US = 86_400_000_000
EPOCH_S = 1.76e9


def flown(spec: FlightSpec, path: Path, days: int) -> Path:
    """A simulated flight so many days after the simulator's date."""
    packer = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    with path.open("wb") as file:
        for unix_us, message in run(spec).messages:
            if message.get_type() == "SYSTEM_TIME":
                message.time_unix_usec += days * DAY_US
            file.write(struct.pack(">Q", unix_us + days * DAY_US))
            file.write(packed(message, packer))
    return path


def dated(path: Path, began_s: float | None, *, boot_s: float = 5.0, lasts_s: float = 60.0) -> Path:
    """What stands, so many seconds after 2025-10-09 and ``boot_s`` after its start."""
    log = telemetry(4)
    for k in range(round(lasts_s) + 1 if began_s is not None else 0):
        unix = EPOCH_S + (began_s or 0.0) + k
        log.add(mav.MAVLink_system_time_message(round(1e6 * unix), round(1e3 * (boot_s + k))))
    path.write_bytes(bytes(log))
    return path
