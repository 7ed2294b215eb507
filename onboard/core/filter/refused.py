"""Velocities that were refused, by the stamps of their fixes."""

from __future__ import annotations

from collections.abc import Iterable

PER_SECOND = 1000
"""Resolution of a stamp, which goes through a latency and back.  Two fixes are further apart than
the three milliseconds that one of them takes up [physics: no receiver measures so often]."""


class Refused:
    """Which velocities one pass has refused, for another that shall refuse the same."""

    def __init__(self, named: Iterable[tuple[float, str]]) -> None:
        """Take stamps, s, and the names of the gates; a stamp is known within a millisecond."""
        self._named = tuple(named)
        self._names = {
            near: name
            for stamp, name in self._named
            for at in [round(stamp * PER_SECOND)]
            for near in (at - 1, at, at + 1)
        }

    def items(self) -> tuple[tuple[float, str], ...]:
        """Stamps and names."""
        return self._named

    def by(self, stamp: float) -> str:
        """The gate that has refused it; empty if it was taken."""
        return self._names.get(round(stamp * PER_SECOND), "")
