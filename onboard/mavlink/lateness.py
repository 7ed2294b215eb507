"""By how much what the vehicle says is behind: a line has held it back, or we have.

A HEARTBEAT says nothing of when it was sent.  Its neighbours on the line do: their stamps are of a
clock that goes as fast as ours, so that what comes later after its stamp than others did has lain
somewhere: in a router, in a radio, or in the system's buffers while this process waited for a disk
or a core.
"""

from __future__ import annotations

from onboard.mavlink import limits


class Lateness:
    """Of one boot clock; ``now`` is our monotonic clock, s."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """It is another clock from here on."""
        self.seconds = 0.0
        """By how much more than usual the newest stamp was behind when it came."""
        self._least: float | None = None
        self._newest = self._at = 0.0

    def take(self, t: float, now: float) -> None:
        """The newest stamp (s) has come.

        What was usual is forgotten while both clocks go on, and neither in a gap nor in what comes
        after it at once: a line that has become slow, and a simulator that is slower than time, are
        not late for ever.
        """
        behind = now - t
        if self._least is None:
            self._least, self._newest, self._at = behind, t, now
        forgotten = limits.LATENESS_FORGOTTEN * min(now - self._at, t - self._newest)
        self._least = min(behind, self._least + forgotten)
        self.seconds = behind - self._least
        self._newest, self._at = t, now
