"""Values that go back and forth: two autopilots answer to one name.

One autopilot has one value of a parameter.  One that is set, or measured anew, is another from then
on, and what comes of the old one was on its way.  Where two answer, both are asked by one question:
the old one, the new one, the old one and the new one again is what no single autopilot says of a
value that nobody sets.
"""

from __future__ import annotations

import math
from typing import Final

from onboard.core.inputs.boot_time import LONGEST_DELAY_S
from onboard.mavlink import limits

TELLING: Final = ("INS_GYROFFS_X", "STAT_BOOTCNT")
"""Different on any two boards (noise of the last calibration of the gyroscope; a count of boots),
and nobody goes to and fro between two values of them."""


class Twofold:
    """Follows the values of TELLING; ``now`` is our monotonic clock, s."""

    def __init__(self) -> None:
        self._heard: dict[str, list[tuple[float, float]]] = {}
        self._two_at = -math.inf

    def forget(self) -> None:
        """It is another autopilot from here on."""
        self._heard.clear()
        self._two_at = -math.inf

    def take(self, name: str, value: float, now: float) -> None:
        """Take one word of the autopilot."""
        if name not in TELLING:
            return
        heard = self._heard.setdefault(name, [])
        if heard and heard[-1][0] == value:
            return
        heard.append((value, now))
        del heard[:-4]
        if len(heard) < 4:  # to and fro, twice
            return
        (a, _), (b, first), (c, _), (d, last) = heard
        # Two packets of old values may come late, but not later than any link delays them.
        if (a, b) == (c, d) and LONGEST_DELAY_S < last - first < limits.TWO_BOARDS_S:
            self._two_at = now

    def goes_on(self, now: float) -> bool:
        """Whether that was so of late."""
        return now - self._two_at < limits.TWO_BOARDS_S
