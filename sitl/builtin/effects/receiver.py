"""What can be wrong with the receiver."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from sitl.builtin.effects.base import Effect, Sizes


@dataclass(frozen=True, slots=True, kw_only=True)
class GpsLatency(Effect):
    """Further latency of the receiver, on top of the declared one (s)."""

    name: ClassVar[str] = "gps_latency"
    units: ClassVar[Mapping[str, Sizes]] = {"copter": {"delay": 0.04}, "plane": {"delay": 0.04}}
    most: ClassVar[float] = 0.25
    positive: ClassVar[bool] = True
    delay: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GpsSmoothing(Effect):
    """The receiver reports the mean over ``window`` seconds about the time of its fix."""

    name: ClassVar[str] = "gps_smoothing"
    units: ClassVar[Mapping[str, Sizes]] = {"copter": {"window": 0.15}, "plane": {"window": 0.15}}
    most: ClassVar[float] = 0.42
    positive: ClassVar[bool] = True
    window: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GpsOvershoot(Effect):
    """Velocity comes out of a tracking loop, whose natural frequency is ``1 / sqrt(square)`` rad/s.

    It is late by nothing while the vehicle accelerates steadily.
    """

    name: ClassVar[str] = "gps_overshoot"
    units: ClassVar[Mapping[str, Sizes]] = {
        "copter": {"square": 0.0025},
        "plane": {"square": 0.0025},
    }
    most: ClassVar[float] = 0.0175
    positive: ClassVar[bool] = True
    square: float
    damping: float = 0.7


@dataclass(frozen=True, slots=True, kw_only=True)
class GpsLeverArm(Effect):
    """Antenna from the IMU, body axes, m, which no parameter tells."""

    name: ClassVar[str] = "gps_lever_arm"
    units: ClassVar[Mapping[str, Sizes]] = {
        "copter": {"x": 0.035, "y": 0.03, "z": 0.035},
        "plane": {"x": 0.2, "y": 0.08, "z": 0.05},
    }
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class GpsFault(Effect):
    """Velocity too large by ``(north, east)`` between two times after the start (s, m/s)."""

    name: ClassVar[str] = "gps_fault"
    units: ClassVar[Mapping[str, Sizes]] = {
        "copter": {"north": 0.6, "east": 0.6},
        "plane": {"north": 0.6, "east": 0.6},
    }
    start: float
    end: float
    north: float = 0.0
    east: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockSkew(Effect):
    """GPS becomes later by ``rate`` seconds a second, from the start of the recording."""

    name: ClassVar[str] = "clock_skew"
    units: ClassVar[Mapping[str, Sizes]] = {"copter": {"rate": 0.0001}, "plane": {"rate": 0.00013}}
    rate: float
