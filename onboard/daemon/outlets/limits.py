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
CONNECTIONS_MAX: Final = 64
"""Connections at a time: all viewers, and as many again that load the page [cost]."""
ACCEPTED_PER_TURN: Final = 8
"""Connections that are accepted before the loop has its turn [cost]."""
FIRST_REQUEST_S: Final = 10.0
"""s from connecting to a whole request: a page over a poor line takes one or two [tuned]."""
KEEP_ALIVE_S: Final = 15.0
"""s that a connection may rest between two requests [tuned]."""
BODY_S: Final = 5.0
"""s for the body of a request, which is one packet [tuned]."""
VISIT_S: Final = 120.0
"""s; a connection that is no viewer's is closed after so long, and opened again if needed: nobody
holds a place by reading an answer one byte at a time [tuned]."""
ACCEPT_RETRY_S: Final = 1.0
"""s before connections are accepted again after the system refused one [tuned]."""
TOLD_EVERY_S: Final = 60.0
"""s between two lines in the log about that [tuned]."""
SHUTDOWN_S: Final = 0.5
"""s that requests under way get at shutdown [service: a stop takes two seconds at the most]."""
BODY_MAX: Final = 16 * 1024
"""bytes of a request's body: the longest that there is has less than one hundred [cost]."""
