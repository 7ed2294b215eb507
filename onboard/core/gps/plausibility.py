"""What a GPS receiver's fixes say against each other, without any other sensor.

A receiver that is being spoofed, multipathed or stuck often still claims a good fix.  Three
contradictions show it: velocity that jumps, position that does not follow velocity, and a
moving receiver that repeats itself to the last digit.
"""

from __future__ import annotations

import math
from enum import Enum

from onboard.core.gps.limits import PlausibilityLimits
from onboard.core.inputs.samples import GpsFix

_METRES_PER_RADIAN = 6.371e6  # of latitude; a check at the 1 % level needs no ellipsoid


class Contradiction(Enum):
    """In what way a fix contradicts the ones before it."""

    JUMP = "velocity jumped"
    DRIFT = "position does not follow velocity"
    FROZEN = "moving, and yet the same fix again"


class FixPlausibility:
    """Compares each fix of one receiver with the ones before it."""

    def __init__(self, limits: PlausibilityLimits | None = None) -> None:
        self._limits = limits or PlausibilityLimits()
        self.reset()

    def reset(self) -> None:
        """Forget the past: after a gap, a reboot or fixes that were no fixes."""
        self._last: GpsFix | None = None
        self._anchor: GpsFix | None = None
        self._travelled = (0.0, 0.0)
        self._longest_step = 0.0
        self._changed_at = 0.0
        self._position_moves = False

    def check(self, fix: GpsFix) -> Contradiction | None:
        """The worst contradiction of ``fix`` with its predecessors; they must be in order."""
        last, self._last = self._last, fix
        if last is None or self._anchor is None:
            self._anchor, self._changed_at = fix, fix.t
            return None
        dt = fix.t - last.t
        if _velocity_change(last, fix) > self._limits.jump + self._limits.acceleration * dt:
            self._restart_baseline(fix)
            return Contradiction.JUMP
        if not _identical(last, fix):
            self._changed_at = fix.t
            return Contradiction.DRIFT if self._drifts(last, fix) else None
        # Its position lags its velocity by as long as it stands still: no verdict from that.
        self._restart_baseline(fix)
        moving = math.hypot(fix.v_n, fix.v_e) > self._limits.frozen_speed
        frozen = moving and fix.t - self._changed_at >= self._limits.frozen_after
        return Contradiction.FROZEN if frozen else None

    def _drifts(self, last: GpsFix, fix: GpsFix) -> bool:
        """Adds one step to the baseline and judges it once it is long enough."""
        anchor = self._anchor
        if anchor is None:
            return False
        dt = fix.t - last.t
        self._longest_step = max(self._longest_step, dt)
        self._travelled = (
            self._travelled[0] + 0.5 * dt * (last.v_n + fix.v_n),
            self._travelled[1] + 0.5 * dt * (last.v_e + fix.v_e),
        )
        span = fix.t - anchor.t
        if span < self._limits.baseline:
            return False
        north = (fix.latitude - anchor.latitude) * _METRES_PER_RADIAN
        eastward = math.remainder(fix.longitude - anchor.longitude, 2 * math.pi)
        east = eastward * math.cos(fix.latitude) * _METRES_PER_RADIAN
        # Some recordings carry velocity only, and one constant position.
        self._position_moves = self._position_moves or north != 0.0 or east != 0.0
        mismatch = math.hypot(north - self._travelled[0], east - self._travelled[1]) / span
        limit = self._limits.drift + self._limits.drift_acceleration * self._longest_step
        self._restart_baseline(fix)
        return self._position_moves and mismatch > limit

    def _restart_baseline(self, fix: GpsFix) -> None:
        self._anchor = fix
        self._travelled = (0.0, 0.0)
        self._longest_step = 0.0


def _velocity_change(a: GpsFix, b: GpsFix) -> float:
    down = b.v_d - a.v_d if a.v_d is not None and b.v_d is not None else 0.0
    return math.hypot(b.v_n - a.v_n, b.v_e - a.v_e, down)


def _identical(a: GpsFix, b: GpsFix) -> bool:
    return (a.latitude, a.longitude, a.altitude, a.v_n, a.v_e, a.v_d) == (
        b.latitude,
        b.longitude,
        b.altitude,
        b.v_n,
        b.v_e,
        b.v_d,
    )
