"""What a GPS receiver's fixes say against each other.

A receiver that is being spoofed, multipathed or stuck often still claims a good fix.  Three
contradictions show it: velocity that jumps, position that does not follow velocity, and a
moving receiver that repeats itself to the last digit for a while.  One that does so once has
measured nothing: what comes next is held against the fix before.  No other sensor is asked but for
the most that an accelerometer felt: no velocity changes by more than that and gravity.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import Enum

from onboard.core.gps.limits import PlausibilityLimits
from onboard.core.inputs.reach import NEAR
from onboard.core.inputs.samples import GpsFix
from onboard.core.maths.earth import STANDARD_GRAVITY

_METRES_PER_RADIAN = 6.371e6  # of latitude; a check at the 1 % level needs no ellipsoid


class Contradiction(Enum):
    """In what way a fix contradicts the ones before it."""

    JUMP = "velocity jumped"
    DRIFT = "position does not follow velocity"
    FROZEN = "moving, and yet the same fix again"


class FixPlausibility:
    """Compares each fix of one receiver with the ones before it."""

    def __init__(
        self, limits: PlausibilityLimits | None = None, felt: Callable[[float], float] | None = None
    ) -> None:
        """Take the limits.

        Args:
            limits: of a fix against the ones before it.
            felt: the largest specific force since a time, s, m/s^2; None: nobody knows.
        """
        self._limits = limits or PlausibilityLimits()
        self._felt = felt
        self.reset()

    def reset(self) -> None:
        """Forget the past: after a gap, a reboot or fixes that were no fixes."""
        self._last: GpsFix | None = None
        self._anchor: GpsFix | None = None
        self._travelled = (0.0, 0.0)
        self._longest_step = 0.0
        self._changed_at = 0.0
        self._position_moves = False
        self._repeats = 0

    def repeats(self, fix: GpsFix) -> bool:
        """Whether a moving receiver says again what it has said, and not for long yet: nothing new.

        Nothing of the kind can be said where positions do not move with the vehicle, nor of a
        receiver at rest, whose readings may honestly be alike.
        """
        last = self._last
        if last is None or not _identical(last, fix):
            self._repeats = 0
            return False
        if not self._position_moves or not self._moves(fix):
            return False
        self._repeats += 1
        return not self._frozen(fix)

    def check(self, fix: GpsFix) -> Contradiction | None:
        """The worst contradiction of ``fix`` with its predecessors; they must be in order."""
        last = self._last
        if last is None:
            self._last, self._changed_at = fix, fix.t
            self._restart_baseline(fix)
            return None
        if _identical(last, fix) and self._moves(fix) and self._frozen(fix):
            # Nothing was measured: what comes next is held against the fix before, its place not.
            self._anchor = None
            return Contradiction.FROZEN
        self._last = fix
        if _identical(last, fix):
            # Its position lags its velocity by as long as it stands still: no verdict from that.
            self._restart_baseline(fix)
            return None
        self._changed_at = fix.t
        # Some recordings carry velocity only, and one constant position.
        moved = (fix.latitude, fix.longitude) != (last.latitude, last.longitude)
        self._position_moves = self._position_moves or moved
        dt = fix.t - last.t
        if self._jumps(last, fix, dt):
            self._restart_baseline(fix)
            return Contradiction.JUMP
        if self._anchor is None:
            self._restart_baseline(fix)
            return None
        return Contradiction.DRIFT if self._drifts(last, self._anchor, fix) else None

    def _jumps(self, last: GpsFix, fix: GpsFix, dt: float) -> bool:
        """Whether velocity changed by more than a vehicle's can, or than this one's did."""
        limits = self._limits
        more = _velocity_change(last, fix) - limits.jump - limits.acceleration * dt
        return more > 0.0 and more > self._excess(last.t) * dt

    def _excess(self, since: float) -> float:
        """By how much more velocities told since then (s) can change than others', m/s^2."""
        if self._felt is None:
            return 0.0
        # What a late fix tells of was felt before it.
        most = self._limits.felt * self._felt(since - NEAR.before) + STANDARD_GRAVITY
        return max(most - self._limits.acceleration, 0.0)

    def _moves(self, fix: GpsFix) -> bool:
        return math.hypot(fix.v_n, fix.v_e) > self._limits.frozen_speed

    def _frozen(self, fix: GpsFix) -> bool:
        """Whether it has repeated itself for too long, and not just once, as a slow one may."""
        return self._repeats != 1 and fix.t - self._changed_at >= self._limits.frozen_after

    def _drifts(self, last: GpsFix, anchor: GpsFix, fix: GpsFix) -> bool:
        """Adds one step to the baseline from ``anchor`` and judges it once it is long enough."""
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
        mismatch = math.hypot(north - self._travelled[0], east - self._travelled[1]) / span
        longest = self._longest_step
        limit = self._limits.drift + self._limits.drift_acceleration * longest
        self._restart_baseline(fix)
        if not self._position_moves or mismatch <= limit:
            return False
        # A velocity that changes by so much within a step is off the line between its ends by a
        # quarter of that in the mean, at the most.
        return mismatch > limit + 0.25 * self._excess(anchor.t) * longest

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
