"""Every number of this room that decides something: its unit, and where it comes from.

Provenance in brackets: *pilot* (what a person reads in flight), *cost* (memory, and lines that
are shared), or *tuned*.
"""

from __future__ import annotations

from typing import Final

# Lines in the ground station

INTERVAL_S: Final = 3.0
"""s between two lines [pilot]."""
SILENCE_S: Final = 30.0
"""s before the same line is said again, if nothing else was said of its topic [pilot]."""
FLAPPING_S: Final = 15.0
"""s between two lines on whether GPS is trusted [pilot]."""
WAITING_MAX: Final = 8
"""Lines that wait, 24 s of them: older ones are no news any more [pilot]."""

# Parameters of the ground station

REPEATED_S: Final = 10.0
"""s; the same answer is told once in so long: a ground station gives up repeating a write well
before [tuned]."""

# HTTP

SEND_LIMIT_S: Final = 10.0
"""s; a viewer that takes longer for one snapshot is gone [tuned]."""
VIEWERS_MAX: Final = 32
"""Viewers at a time [cost]."""
BODY_MAX: Final = 16 * 1024
"""bytes of a request's body: the longest that there is has less than one hundred [cost]."""
