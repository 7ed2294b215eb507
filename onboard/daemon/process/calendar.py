"""What time it is: this computer's clock, or GPS time by the autopilot where that has stood still.

A companion without a clock that runs through the night begins with 1970, or with the time at which
it was switched off last, and keeps it until a network tells it better, which in the field there is
none to do.  The autopilot has the time from GPS (``SYSTEM_TIME``).  A clock that has stood still is
behind, never ahead: so of the two the later one is right, if both go at the same rate.

It dates what people read.  Nothing is decided by it.
"""

from __future__ import annotations

from collections.abc import Callable

from onboard.daemon.process import limits
from onboard.daemon.view.snapshot import DATED_FROM
from onboard.mavlink.dialect import MESSAGE_IDS, Message
from onboard.mavlink.limits import UNIX_FROM_US

_SYSTEM_TIME = MESSAGE_IDS["SYSTEM_TIME"]


class Calendar:
    """Unix time, s, when it is called.

    Args:
        wall_clock: this computer's, Unix time, s.
        clock: monotonic, s.
    """

    def __init__(self, wall_clock: Callable[[], float], clock: Callable[[], float]) -> None:
        self._wall_clock = wall_clock
        self._clock = clock
        self._ahead: float | None = None
        """Theirs less the monotonic clock, s, as it was first said."""
        self._since = 0.0
        self._believed: float | None = None

    def __call__(self) -> float:
        """The time now."""
        ours = self._wall_clock()
        if self._believed is None:
            return ours
        theirs = self._clock() + self._believed
        if ours >= DATED_FROM and theirs - ours > limits.WEEKS_LOST_S:
            return ours
        return theirs if theirs - ours > limits.CLOCK_STOOD_S else ours

    def feed(self, message: Message) -> None:
        """Take a message of the autopilot: one that tells the time, or any other."""
        if message.get_msgId() != _SYSTEM_TIME or message.time_unix_usec <= UNIX_FROM_US:
            return
        now = self._clock()
        ahead = message.time_unix_usec * 1e-6 - now
        if self._ahead is None or abs(ahead - self._ahead) > limits.CLOCKS_AGREE_S:
            # Another clock, or one at another rate: a simulator's, or one that is being set.
            self._ahead, self._since, self._believed = ahead, now, None
        elif now - self._since >= limits.CLOCK_WATCHED_S:
            self._believed = self._ahead
