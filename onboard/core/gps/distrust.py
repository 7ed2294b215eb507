"""Why GPS is not believed, and what the trust window says of it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Final, TypeAlias


class Distrust(StrEnum):
    """Why a window is not open; in the order in which one of several is named."""

    SPOOFED = "spoofed"
    JAMMED = "jammed"
    NO_FIX = "no_fix"
    FEW_SATELLITES = "few_satellites"
    HDOP = "hdop"
    SPEED_ACCURACY = "speed_accuracy"
    GPS_GLITCH = "gps_glitch"
    EKF_GPS_GLITCH = "ekf_gps_glitch"
    EKF_UNHEALTHY = "ekf_unhealthy"
    STALE = "stale"
    LATE = "late"
    GPS_GAP = "gps_gap"
    RESTARTED = "restarted"
    CONFIGURED_END = "configured_end"
    END_OF_DATA = "end_of_data"


RANK: Final = {reason: rank for rank, reason in enumerate(Distrust)}
"""The lower, the graver."""


@dataclass(frozen=True, slots=True)
class WindowOpened:
    """From the fix at ``t`` (s, boot clock) on GPS is trusted."""

    t: float


@dataclass(frozen=True, slots=True)
class WindowClosed:
    """GPS is no longer trusted; ``t`` (s, boot clock) is the end of the trusted span."""

    t: float
    reason: Distrust


WindowEvent: TypeAlias = WindowOpened | WindowClosed


@dataclass(frozen=True, slots=True)
class RefusedFixes:
    """Fixes in a row that were refused for one reason: from the first to the last, s."""

    start: float
    end: float
    reason: Distrust
