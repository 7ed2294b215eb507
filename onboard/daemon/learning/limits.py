"""Every number of this room that decides something: its unit, and where it comes from.

Provenance in brackets: *data* (rates of what comes in), *cost* (what a companion has to spare),
*use* (what people have of it), or *tuned*.
"""

from __future__ import annotations

from typing import Final

# Between the loop and the learner's thread

BATCH_S: Final = 1.0
"""s between two batches, as often as people are told: every hand-over wakes up a thread and, with
its answer, the loop [cost]."""
WAITING_LIMIT: Final = 200_000
"""Samples that wait while a flight is refined: ten minutes of the heaviest stream [data]."""
PARAMETERS_S: Final = 30.0
"""s; so long is waited for the parameters that say what the messages mean, while what comes is kept
[tuned: they take a few seconds to read]."""
BEHIND_S: Final = 15.0
"""s; more than this is told, of what no diagnosis has made wait [use: nobody waits so long for a
page without asking]."""
CAUGHT_UP_S: Final = 2.0
"""s; closer than this the learner has caught up again [tuned]."""
STEP_LIMIT_S: Final = 120.0
"""s; a refinement or a diagnosis takes seconds, on a slow companion a minute, longer is a hang
[cost]."""

FAILURES_MAX: Final = 3
"""Learners that may fail of one flight: one by chance, one that the flight makes fail again, and
then nothing else is to be expected of it [use]."""

FILTER_SILENT_S: Final = 5.0
"""s of an open window without a report of the autopilot's filter: it sends none.  Two a second are
asked for, and a slow link brings one in two seconds [data]."""

GROUND_EDGE_S: Final = 10.0
"""s; an offset that jumped so near to the time on the ground may have done so there: the length of
a batch [tuned: what was flown since has to be without a jump of its own]."""

# How often is computed

SOLVING_SHARE: Final = 0.0015
"""Of a core: after a solution that took 0.03 s, the next one is due 20 s later, which is every
second batch [cost]."""
IN_FLIGHT_SHARE: Final = 0.02
"""Of a core: after a diagnosis in flight that took 5 s, the next one is due 250 s later [cost]."""
BOARDS_KEPT: Final = 64
"""Boards whose sums are kept on the disk: more than one companion ever sees; at some hundred
kilobytes each a small part of its disk [cost]."""
NOTHING_LEARNED: Final = 4096
"""bytes; a file of sums that is no larger is of a board that has not flown: a block of the disk
[data: 150 bytes without a flight, 100 kB and more with one]."""
