"""Another boot clock beside the one that is followed: two autopilots under one name.

One autopilot has one boot clock.  A reboot leaves the old one, of which nothing more comes but what
was on its way; a packet that was held back is late once.  A clock that has stood beside the one
that is followed for longer than any link delays, and has gone on as ours does, is another one's.
"""

from __future__ import annotations

import math

from onboard.core.inputs.boot_time import LONGEST_DELAY_S
from onboard.mavlink import limits


class OtherClock:
    """Of one autopilot; ``now`` is our monotonic clock, s."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """It is another autopilot from here on."""
        self._begun: tuple[float, float] | None = None
        self._since = self._last = -math.inf
        self._stamps = 0
        self._two_at = -math.inf

    def begin(self, t: float, now: float) -> None:
        """Such a clock was heard, or left behind, at this stamp (s): does it go on?"""
        self._begun, self._since, self._last, self._stamps = (t, now), now, now, 0

    def take(self, t: float, now: float, *, beside: bool) -> bool:
        """Whether a stamp is where this clock is by now; it is noted then.

        Args:
            t: the stamp, s.
            now: our own clock, s.
            beside: the clock that is followed goes on, too.
        """
        if self._begun is None:
            return False
        begun, at = self._begun
        if abs(t - (begun + now - at)) > LONGEST_DELAY_S:
            return False
        if not beside or now - self._last > LONGEST_DELAY_S:  # late packets come in bursts
            self._since, self._stamps = now, 0
        self._last = now
        # Within so long a reboot is over, and what was sent before it has come.
        if now - self._since > limits.CLOCKS_APART_S:
            self._stamps += 1
            if self._stamps >= limits.PROOF_STAMPS:
                self._two_at = now
        return True

    def goes_on(self, now: float) -> bool:
        """Whether two clocks have gone on beside each other of late."""
        return now - self._two_at < limits.TWO_BOARDS_S
