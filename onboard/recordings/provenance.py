"""Which vehicle a recording is of and when it was flown: what the log says of it, and no guess.

* *Board.*  ArduPilot's log has the serial number of the processor as text, ``Pixhawk6X 003E0026
  3033510B 35303731``: three words, the bytes of each from the last to the first (``get_system_id``
  in AP_HAL_ChibiOS).  MAVLink's AUTOPILOT_VERSION has the same bytes in order, PX4's ULog as
  ``sys_uuid``.  A simulated board has none.
* *Accelerometers.*  INS_ACC*_ID (PX4: CAL_ACC*_ID) are bus, address and kind of chip: boards of
  one model all have the same.  They tell vehicles apart and prove nothing alike.
* A .tlog with several vehicles says nothing of either.
* *When.*  GPS week and time of the fixes, or the autopilot's Unix time, by most of them
  (:mod:`onboard.recordings.dates`).  The clock of a ground station or a file is not asked.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from onboard.core.maths.accelerometer import parameter_names
from onboard.recordings.arrays import Arrays, read_arrays
from onboard.recordings.dates import times
from onboard.recordings.fields import numbers, of_autopilot, texts
from onboard.recordings.ulog_information import ulog_information

SERIAL = re.compile(r"^(\S.*?) ([0-9A-F]{8}) ([0-9A-F]{8}) ([0-9A-F]{8})$")
RECEIVERS = (
    re.compile(r"^(u-blox) \d HW: (\w+)"),
    re.compile(r"^GPS 1: detected (?:as )?([\w.+ -]+?)(?: at \d+ baud)?$"),
)
"""Texts that name the receiver, the one that says most first."""
WANTED = (
    "MSG", "PARM", "GPS", "AUTOPILOT_VERSION", "STATUSTEXT", "SYSTEM_TIME", "HEARTBEAT",
    "PARAM_VALUE", "vehicle_gps_position", "sensor_gps",
)  # fmt: skip
MOST_IDS = 2**32
"""The widest integer that an autopilot has a parameter of [definition]."""
SYSTEM = ("SYSID_THISMAV", "MAV_SYSID", "MAV_SYS_ID")
ACCELEROMETERS = {imu: parameter_names(imu).device_id for imu in (1, 2, 3, 4, 5)}
PX4_ACCELEROMETERS = {imu: f"CAL_ACC{imu - 1}_ID" for imu in (1, 2, 3, 4)}
OVERLAP_S = 1.0
"""s; recordings that overlap by more are dated at the same time: dates are of GPS, to the second
[definition]."""
DELAYS = ("GPS1_DELAY_MS", "GPS_DELAY_MS")
PLACES = (("GPS1_POS_X", "GPS1_POS_Y", "GPS1_POS_Z"), ("GPS_POS1_X", "GPS_POS1_Y", "GPS_POS1_Z"))


@dataclass(frozen=True, slots=True)
class Provenance:
    """What a recording says of its vehicle; empty or None where it does not say.

    Attributes:
        board: serial number in hex, the bytes in order.
        model: of the board.
        system: MAVLink system id.
        accelerometers: device ids by number of the accelerometer.
        receiver: of GPS.
        frame: FRAME_CLASS.
        told_delay_s: latency of the receiver that the autopilot is told, s.
        antenna_m: where the autopilot is told that the antenna is, body axes, m.
        began_unix_s: when the first fix was, s since 1970, UTC.
        ended_unix_s: when the last one was.
    """

    board: str = ""
    model: str = ""
    system: int | None = None
    accelerometers: Mapping[int, int] = field(default_factory=dict)
    receiver: str = ""
    frame: int | None = None
    told_delay_s: float | None = None
    antenna_m: tuple[float, float, float] | None = None
    began_unix_s: float | None = None
    ended_unix_s: float | None = None

    @property
    def dated(self) -> bool:
        """Whether it says when it was flown."""
        return self.began_unix_s is not None and self.ended_unix_s is not None

    def before(self, other: Provenance) -> bool:
        """Whether the dates of both say that it was over when the other began."""
        mine, ended, its = self.began_unix_s, self.ended_unix_s, other.began_unix_s
        if mine is None or ended is None or its is None:
            return False
        return mine < its and ended <= its + OVERLAP_S


def provenance(path: str | Path) -> Provenance:
    """Read what a recording says of its vehicle.

    Raises:
        RecordingError: the file cannot be read, or is no recording.
    """
    arrays = read_arrays(path, WANTED)
    if len(_systems(arrays)) > 1:  # whose a message is that names a board, nobody asks here
        began, ended = times(arrays)
        return Provenance(began_unix_s=began, ended_unix_s=ended)
    information = ulog_information(Path(path)) if arrays.kind == "ulog" else None
    told = _parameters(arrays) if information is None else information.parameters.items()
    parameters = {name: value for name, value in told if np.isfinite(value)}
    board, model = _board(arrays, information.texts if information else {})
    names = PX4_ACCELEROMETERS if information else ACCELEROMETERS
    began, ended = times(arrays)
    place = next((p for p in PLACES if all(n in parameters for n in p)), None)
    delay = _first(parameters, DELAYS)
    return Provenance(
        board=board,
        model=model,
        system=_system(arrays, parameters),
        accelerometers={i: x for i, n in names.items() if (x := _whole(parameters.get(n)))},
        receiver=_receiver(_texts(arrays)),
        frame=_whole(parameters.get("FRAME_CLASS")),
        told_delay_s=None if delay is None else delay / 1e3,
        antenna_m=None if place is None else _three([parameters[n] for n in place]),
        began_unix_s=began,
        ended_unix_s=ended,
    )


def _three(values: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = values
    return x, y, z


def _parameters(arrays: Arrays) -> Iterable[tuple[str, float]]:
    """Names and values, in order."""
    table, name, value = arrays.tables.get("PARM"), "Name", "Value"
    if table is None:
        table, name, value = of_autopilot(arrays, "PARAM_VALUE"), "param_id", "param_value"
    values = None if table is None else numbers(table, value)
    # Where either is of another type than it should be, there is nothing to go with the other.
    return () if values is None else zip(texts(table, name), values[0].tolist(), strict=False)


def _texts(arrays: Arrays) -> list[str]:
    """What the autopilot said in words."""
    told = texts(of_autopilot(arrays, "STATUSTEXT"), "text")
    return [*texts(arrays.tables.get("MSG"), "Message"), *told]


def _board(arrays: Arrays, information: Mapping[str, str]) -> tuple[str, str]:
    """Serial number and model."""
    uuid = information.get("sys_uuid", "").lower()
    if uuid.strip("0 \0"):
        return uuid, information.get("ver_hw", "")
    for text in _texts(arrays):
        if found := SERIAL.match(text):
            words = [bytes.fromhex(word)[::-1].hex() for word in found.groups()[1:]]
            if any(word.strip("0f") for word in words):
                return "".join(words), found[1]
    versions = of_autopilot(arrays, "AUTOPILOT_VERSION")
    for record in versions if versions is not None else ():
        long, short = record["uid2"].tobytes().rstrip(b"\0"), int(record["uid"])
        if long or short:
            return (long.hex() if long else f"{short:016x}"), ""
    return "", ""


def _receiver(texts: Sequence[str]) -> str:
    for pattern in RECEIVERS:
        for text in texts:
            if found := pattern.match(text):
                return " ".join(found.groups())
    return ""


def _system(arrays: Arrays, parameters: Mapping[str, float]) -> int | None:
    told = _whole(_first(parameters, SYSTEM))
    return next(iter(_systems(arrays)), None) if told is None else told


def _systems(arrays: Arrays) -> tuple[int, ...]:
    """System ids of the autopilots that a .tlog has heartbeats of."""
    beats = of_autopilot(arrays, "HEARTBEAT")
    return () if beats is None else tuple(int(x) for x in np.unique(beats["sender_system"]))


def _whole(value: float | None) -> int | None:
    """A number of a kind; None where it is not known, or is damage."""
    return None if value is None or abs(value) >= MOST_IDS else int(value)


def _first(parameters: Mapping[str, float], names: Sequence[str]) -> float | None:
    return next((parameters[n] for n in names if n in parameters), None)
