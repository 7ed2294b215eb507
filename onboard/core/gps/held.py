"""Reasons for distrust that are held, and when each of them may be dropped."""

from __future__ import annotations

import math

from onboard.core.gps.distrust import RANK, Distrust
from onboard.core.gps.limits import TrustLimits


class HeldReasons:
    """Holds each reason from the report that shows it until it has recovered."""

    def __init__(self, limits: TrustLimits) -> None:
        """Take the limits: how long a reason is held after the report that denies it."""
        self._limits = limits
        self._until: dict[Distrust, float] = {}

    def __bool__(self) -> bool:
        return bool(self._until)

    @property
    def gravest_first(self) -> tuple[Distrust, ...]:
        """All reasons held, those that still recover included."""
        return tuple(sorted(self._until, key=RANK.__getitem__))

    def report(self, reason: Distrust, t: float, *, bad: bool) -> None:
        """A report at ``t`` (s) shows (``bad``) or denies a reason."""
        if bad:
            self._until[reason] = math.inf
        elif self._until.get(reason) == math.inf:
            self._until[reason] = t + self._limits.recovery.get(reason, 0.0)

    def drop_recovered(self, t: float) -> None:
        """Drop what has recovered by ``t``, s."""
        self._until = {reason: until for reason, until in self._until.items() if t < until}

    def clear(self) -> None:
        """Forget all: another boot, another receiver."""
        self._until.clear()
