"""When the autopilot's clock has begun anew, and when a stamp is only late."""

from __future__ import annotations

import math

LONGEST_DELAY_S = 3.0
"""A stamp that is older than the newest by less was overtaken on its way: telemetry radios and
routers hold packets back for a second or two.  By more it is of a new boot.  A reboot within the
first three seconds of uptime is not seen; nothing has flown by then."""


def began_anew(t: float, newest: float) -> bool:
    """Whether a stamp is of a clock that has begun anew.

    Args:
        t: the stamp, s since boot.
        newest: the largest one before it, s; minus infinity if there was none.
    """
    return t < newest - LONGEST_DELAY_S


FARTHEST_S = 10.0
"""s; a stamp that is further ahead waits for the next one, which a damaged record does not have."""
NEXT_S = 1.0
"""s; within which the next inertial sample of a boot comes [physics: a log has ten a second]."""


def far_ahead(t: float, newest: float) -> bool:
    """Whether a stamp is so far ahead that another one has to agree before it moves a clock.

    Args:
        t: the stamp, s since boot.
        newest: the largest one before it, s; minus infinity if there was none: any may be first.
    """
    return -math.inf < newest < t - FARTHEST_S


class Boots:
    """Tells where a recording's inertial samples are of another boot.

    Logs have no checksums: one stamp alone is damage, two that follow each other are a clock.

    Attributes:
        newest: time of the newest sample of this boot, s.
    """

    def __init__(self) -> None:
        self.newest = -math.inf
        self._odd: float | None = None

    @property
    def doubtful(self) -> bool:
        """Whether the last stamp is far from those before it, and waits for one that agrees."""
        return self._odd is not None

    def begins(self, t: float) -> bool:
        """Take an inertial stamp, s; whether a clock has begun anew with it and the one before."""
        first = self.newest == -math.inf
        if first or -LONGEST_DELAY_S <= t - self.newest <= FARTHEST_S:
            self.newest, self._odd = max(self.newest, t), None
            return False
        if self._odd is None or not 0.0 <= t - self._odd <= NEXT_S:
            self._odd = t
            return False
        back = began_anew(t, self.newest)
        self.newest, self._odd = t, None
        return back
