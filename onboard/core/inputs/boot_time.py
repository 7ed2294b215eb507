"""When the autopilot's clock has begun anew, and when a stamp is only late."""

from __future__ import annotations

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
