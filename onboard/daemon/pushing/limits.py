"""Every number of this room that decides something: its unit, and where it comes from.

What a push itself must keep to is in :mod:`onboard.push.limits`.  Provenance in brackets: *cost*
(of messages on a shared line), *probability* (of a false alarm), or *tuned*.
"""

from __future__ import annotations

from typing import Final

# Reading the autopilot's parameters

REREAD_S: Final = 30.0
"""s; a change whose broadcast was lost is found this late at most [cost: 77 reads each time]."""
RETRY_S: Final = 10.0
"""s before a parameter that every autopilot has is read again, if it was not answered [tuned]."""
ABSENT_S: Final = 300.0
"""s; a name that was not answered may only have been unlucky, it is tried again then [cost]."""
OPTIONAL_ATTEMPTS: Final = 2
"""Tries of a name that not every firmware has: silence is its usual answer [cost]."""

IN_VAIN: Final = 24
"""Questions in a row, of names that are there, without one answer: where a third of all frames is
lost both ways, 0.56 of them are in vain, so many in a row once in a million times [probability]."""

# The disk

DISK_TRIED_S: Final = 10.0
"""s between two tries of a disk that does not take the journal [cost: 16 kB written each time]."""

# Proposals

WAIT_AFTER_FAILURE_S: Final = (30.0, 60.0, 120.0, 300.0)
"""s between a transaction that did not complete and the next for that accelerometer, after one
failure, two, and so on [tuned]."""
RESUMED_AFTER_S: Final = (2.0, 5.0, 10.0, 30.0, 60.0)
"""s between a transaction that is left open and the next try to end it: half a set may be in force,
and whoever stands by the vehicle may arm at any moment; one try asks for 20 s on a line that does
not answer [cost]."""
LATE_LOOKS: Final = 3
"""Looks, once a second, at which values that were taken back have to be there again in part before
it is said: a station that sets the same six from a file takes a second or two for them [use]."""
MOVED_SIGMAS: Final = 2.0
"""An approval is of the values shown: it lapses when an estimate moves by more than so many of its
standard deviations [probability: 5 %]."""
