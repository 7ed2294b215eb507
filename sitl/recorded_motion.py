"""What a recorded vehicle flew: velocity and heading over time, read from .tlog or DataFlash.

Read with pymavlink alone, so that what flies a recording again shares nothing with what judges it.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from pymavlink.DFReader import DFReader_binary
from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.builtin import rotation
from sitl.builtin.airframe.motion import Motion, leaning
from sitl.builtin.smoothing import DT, Array, smooth
from sitl.builtin.trajectory import Environment, Start, whole_samples
from sitl.builtin.world import Vehicle
from sitl.ends import grounded, sinking
from sitl.errors import SitlError
from sitl.plane_ends import landing

SMOOTHING_S = (0.2, 0.14, 0.1, 0.06)
"""Takes the steps out of 5 to 10 samples a second."""
STANDING_S = 5.0
"""Time on the ground before lift-off and after touch-down."""
FLYING: dict[Vehicle, float] = {"copter": 0.5, "plane": 12.0}
"""From this speed on it flies, m/s: heights drift while a vehicle stands, speeds do not."""
STAMP = struct.Struct(">Q")


@dataclass(frozen=True, slots=True)
class Recorded:
    """A motion to fly again, by which vehicle, and where."""

    vehicle: Vehicle
    motion: Motion
    environment: Environment


@dataclass(slots=True)
class _Rows:
    """What is collected from a recording; times in s on the autopilot's clock."""

    velocity: list[tuple[float, float, float, float]] = field(default_factory=list)
    attitude: list[tuple[float, float, float, float]] = field(default_factory=list)
    fallback: list[tuple[float, float, float, float]] = field(default_factory=list)
    height: list[tuple[float, float]] = field(default_factory=list)
    above_home: list[tuple[float, float]] = field(default_factory=list)
    plane: bool = False
    home: tuple[float, float, float] | None = None


def recorded_motion(path: str | Path, wind: tuple[float, float] = (0.0, 0.0)) -> Recorded:
    """The flight of a recording, ground to ground.

    Args:
        path: .tlog or DataFlash.
        wind: towards north and east, m/s, in which it was recorded: a plane's sideslip is that of
            its nose in the air, whatever the wind in which it flies again.

    Raises:
        SitlError: the recording has no velocity, no attitude or no flight.
    """
    file = Path(path)
    rows = _of_tlog(file) if file.suffix.lower() == ".tlog" else _of_dataflash(file)
    if not rows.velocity:
        rows.velocity, rows.height = rows.fallback, rows.above_home
    if len(rows.velocity) < 20 or len(rows.attitude) < 20:
        raise SitlError(f"{file.name} has no velocity or no attitude that could be flown again")
    home = Environment()
    if rows.home is not None:
        latitude, longitude, altitude = rows.home
        home = Environment(latitude_deg=latitude, longitude_deg=longitude, altitude=altitude)
    vehicle: Vehicle = "plane" if rows.plane else "copter"
    return Recorded(vehicle, _motion(rows, file.name, wind), home)


def _motion(rows: _Rows, name: str, wind: tuple[float, float]) -> Motion:
    recorded = np.array(_sorted(rows.velocity))
    heights = np.array(_sorted(rows.height)).reshape(-1, 2)
    flying = FLYING["plane" if rows.plane else "copter"]
    velocity = grounded(recorded, heights, flying, landing if rows.plane else sinking)
    speed = np.linalg.norm(velocity[:, 1:], axis=1)
    fast = velocity[speed > flying, 0]
    if not len(fast):
        raise SitlError(f"{name} never leaves the ground")
    lift_off, touch_down = float(fast[0]), float(fast[-1])
    n = whole_samples(touch_down - lift_off + 2.0 * STANDING_S)
    t = lift_off - STANDING_S + np.arange(n, dtype=np.float64) * DT
    landed = (t < lift_off) | (t >= touch_down)
    v_n = np.column_stack([_smooth_at(t, velocity[:, 0], velocity[:, i]) for i in (1, 2, 3)])
    rolls = rows.plane  # a plane moves on the ground too
    keep = np.ones(n) if rolls else _smooth_in(~landed)
    v_n[:, :2] *= keep[:, None]
    v_n[:, 2] *= _smooth_in(~landed)
    # Drift of the height would leave it in the air, or below the ground.
    share = ~landed / max(1, int(np.sum(~landed)))
    v_n[:, 2] -= _smooth_in(share) * np.sum(v_n[:, 2])
    attitude = np.array(_sorted(rows.attitude))
    roll, pitch, heading = (
        _smooth_at(t, attitude[:, 0], np.unwrap(attitude[:, i])) for i in (1, 2, 3)
    )
    bank, slip = np.zeros(n), np.zeros(n)
    if rows.plane:
        R_nb = rotation.from_euler(roll, pitch, heading)
        bank, slip = leaning(R_nb, v_n - np.array([*wind, 0.0]))
        # Nobody has seen how it leans on a way of its own.
        seen = (t >= recorded[0, 0]) & (t <= recorded[-1, 0])
        aloft = _smooth_in(~landed & seen)
        bank, slip = np.unwrap(bank) * aloft, slip * aloft
    armed = (t >= lift_off - 3.0) & (t < touch_down + 3.0)
    start = Start(yaw=float(heading[0]))
    return Motion(v_n, heading, bank, slip, armed, landed, start)


def _sorted(rows: Sequence[tuple[float, ...]]) -> list[tuple[float, ...]]:
    return sorted(set(rows))


def _smooth_at(t: Array, times: Array, values: Array) -> Array:
    """Samples as a smooth function of time, without delay; ends are held."""
    late = np.interp(t + 0.5 * sum(SMOOTHING_S), times, values)
    return smooth(late, SMOOTHING_S)


def _smooth_in(flags: Array | np.ndarray[Any, np.dtype[np.bool_]]) -> Array:
    return smooth(np.asarray(flags, dtype=np.float64), SMOOTHING_S)


def _of_tlog(path: Path) -> _Rows:
    rows = _Rows()
    for message in _messages(path.read_bytes()):
        match message.get_type():
            case "HEARTBEAT" if message.autopilot != mav.MAV_AUTOPILOT_INVALID:
                rows.plane = message.type == mav.MAV_TYPE_FIXED_WING
            case "LOCAL_POSITION_NED":
                t = message.time_boot_ms * 1e-3
                rows.velocity.append((t, message.vx, message.vy, message.vz))
                rows.height.append((t, -message.z))
            case "GLOBAL_POSITION_INT":
                t = message.time_boot_ms * 1e-3
                rows.fallback.append((t, *(x * 0.01 for x in (message.vx, message.vy, message.vz))))
                rows.above_home.append((t, message.relative_alt * 1e-3))
                if rows.home is None and message.lat:
                    ground = (message.alt - message.relative_alt) * 1e-3
                    rows.home = (message.lat * 1e-7, message.lon * 1e-7, ground)
            case "ATTITUDE":
                angles = (message.roll, message.pitch, message.yaw)
                rows.attitude.append((message.time_boot_ms * 1e-3, *angles))
    return rows


def _messages(data: bytes) -> Iterator[Any]:
    """Messages of a .tlog, frame by frame."""
    parser = mav.MAVLink(None)
    parser.robust_parsing = True
    at = STAMP.size
    while at + 12 <= len(data):
        signed = 13 if data[at + 2] & 1 else 0
        length = data[at + 1] + (12 + signed if data[at] == 0xFD else 8)
        yield from parser.parse_buffer(data[at : at + length]) or ()
        at += length + STAMP.size


def _of_dataflash(path: Path) -> _Rows:
    rows = _Rows()
    for message in dataflash(path, ("XKF1", "ATT", "MSG", "ORGN")):
        match message.get_type():
            case "XKF1" if message.C == 0:
                t = message.TimeUS * 1e-6
                rows.velocity.append((t, message.VN, message.VE, message.VD))
                rows.height.append((t, -message.PD))
            case "ATT":
                angles = np.radians([message.Roll, message.Pitch, message.Yaw])
                rows.attitude.append((message.TimeUS * 1e-6, *(float(x) for x in angles)))
            case "MSG" if "ArduPlane" in message.Message:
                rows.plane = True
            case "ORGN" if rows.home is None and message.Lat:
                rows.home = (message.Lat, message.Lng, message.Alt)
    return rows


def dataflash(path: str | Path, kinds: Sequence[str]) -> Iterator[Any]:
    """Messages of some kinds of a DataFlash log, in order."""
    log = DFReader_binary(str(path))
    try:
        while (message := log.recv_match(type=list(kinds))) is not None:
            yield message
    finally:
        log.close()
