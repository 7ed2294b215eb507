"""Every number of this room that decides something: its unit, and where it comes from.

Provenance in brackets: *cost* (what a companion has to spare), *service*
(systemd/onboard.service), *data* (rates of what comes in), or *tuned*.
"""

from __future__ import annotations

from typing import Final

TICK_S: Final = 1.0
"""s between two rounds of judging, saving and telling [service: a thirtieth of WatchdogSec]."""
SETTLED_S: Final = 60.0
"""s after which a start has not come to nothing: what crashes later asks once a minute for what a
start asks, which a link of 57600 baud bears [cost]."""
STARTS_AT_ONCE: Final = 2
"""Starts in a row that do not wait: the first, and the one after a crash in flight [use]."""
LONGEST_WAIT_S: Final = 30.0
"""s that a start waits at the most [service: half of TimeoutStartSec, the other half is for the
start itself]."""
FINISH_PUSH_S: Final = 8.0
"""s that a transaction under way gets at shutdown; then it stays open, to be resumed [service:
with SAVE_S and the broker's farewell inside TimeoutStopSec]."""
RATES_BACK_S: Final = 4.0
"""s at shutdown to have samples come as often as before a push: a second of silence, then some
eight questions, each with its answer [service: as before]."""
SAVE_S: Final = 5.0
"""s that the learner gets at shutdown for what has come and its last save [service: as before]."""
STALL_S: Final = 0.05
"""s; a turn of the loop that takes longer is counted: half the link's tick [tuned]."""
STALL_TOLD_S: Final = 60.0
"""s between two lines in the log about that [tuned]."""
FAILURE_FILES: Final = 2
FAILURE_FILE_BYTES: Final = 50_000_000
"""What is kept of the link after a failure of the estimator: at 50 kB/s two times a quarter of an
hour, which is a flight [cost: 100 MB of the disk]."""
STALE_S: Final = 5.0
"""s; a flag not repeated for so long says nothing about now [data: five HEARTBEATs]."""
CONTRADICTION_S: Final = 1.2
"""s; armed or disarmed that lasts for less was said by two: a HEARTBEAT's interval and a fifth for
what delays it [data]."""
CONTRADICTED_FOR_S: Final = 30.0
"""s without a contradiction before HEARTBEATs are believed again [tuned]."""
SIGNING_KEPT_S: Final = 10.0
"""s between two records of the signing's time stamps; as much is added to what is recorded, so that
nothing is used twice after a crash [cost: one small file]."""
CLOCK_APART_S: Final = 60.0
"""s between the clocks of signing from which on it is said [protocol: a new stream's lag]."""
CLOCK_STOOD_S: Final = 60.0
"""s that the autopilot's time of day is ahead of ours from which on ours has stood still: what
people read has minutes [use]."""
WEEKS_LOST_S: Final = 1000 * 7 * 86400.0
"""s that the autopilot's time is ahead of a clock of ours that was once set from which on it is not
believed: a receiver that has counted its 1024 weeks once too often [protocol: the week's 10 bits].
"""
CLOCKS_AGREE_S: Final = 3.0
"""s that two reports of a time may lie apart, beside what went by between them: what the slowest
links delay, and the clock's being told in whole seconds [data]."""
CLOCK_WATCHED_S: Final = 20.0
"""s of such reports before the time is believed: a simulator that runs by a sixth too fast is
noticed by then [use]."""
JOURNAL_SHOWN: Final = 50
"""Entries of the journal in a snapshot, the latest ones [tuned]."""
BEHIND_WORTH_SAYING_S: Final = 5.0
"""s that the learner may lie behind before the line of status says so [tuned]."""
HEARD_OF_LATE_S: Final = 5.0
"""s for which something that was heard counts as there [data: five HEARTBEATs]."""
UNANSWERED_S: Final = 20.0
"""s without one answer, however often it was asked: the slowest links take some seconds for one
[data]."""
SELDOM_S: Final = 30.0
"""s for which samples come too seldom before it is said: rates are settled in a second or
two, on a poor link in ten, and asked for again when somebody else has changed them [data]."""
