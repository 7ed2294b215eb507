"""What can be wrong with the recorded attitude."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from sitl.builtin.effects.base import Effect, Sizes


@dataclass(frozen=True, slots=True, kw_only=True)
class ImuDelay(Effect):
    """How late the attitude is stamped against the accelerometer (s)."""

    name: ClassVar[str] = "imu_delay"
    units: ClassVar[Mapping[str, Sizes]] = {"copter": {"delay": 0.03}, "plane": {"delay": 0.03}}
    most: ClassVar[float] = 0.1
    delay: float


@dataclass(frozen=True, slots=True, kw_only=True)
class MountTilt(Effect):
    """Recorded attitude is turned by (roll, pitch, 0) about body axes against the IMU (rad)."""

    name: ClassVar[str] = "mount_tilt"
    units: ClassVar[Mapping[str, Sizes]] = {
        "copter": {"roll": 0.02, "pitch": 0.02},
        "plane": {"roll": 0.02, "pitch": 0.02},
    }
    kind: ClassVar[str] = "turn"
    roll: float = 0.0
    pitch: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardTilt(Effect):
    """The whole autopilot is turned in the airframe by (roll, pitch), rad: both sensors alike.

    No name of the catalogue: its own attitude fits its own sensors, and no flight shows it.  It is
    what AHRS_TRIM is for: a trim of the same angles makes the airframe's attitude of the board's.
    """

    name: ClassVar[str] = "board_tilt"
    roll: float = 0.0
    pitch: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class HeadingError(Effect):
    """Recorded yaw is too large by ``yaw`` (rad)."""

    name: ClassVar[str] = "heading_error"
    units: ClassVar[Mapping[str, Sizes]] = {"copter": {"yaw": 0.05}, "plane": {"yaw": 0.05}}
    kind: ClassVar[str] = "heading"
    yaw: float


@dataclass(frozen=True, slots=True, kw_only=True)
class HeadingByThrottle(Effect):
    """Recorded yaw is too large by this at full throttle, in proportion (rad)."""

    name: ClassVar[str] = "heading_by_throttle"
    units: ClassVar[Mapping[str, Sizes]] = {
        "copter": {"yaw_per_throttle": 0.1},
        "plane": {"yaw_per_throttle": 0.06},
    }
    kind: ClassVar[str] = "heading"
    yaw_per_throttle: float
