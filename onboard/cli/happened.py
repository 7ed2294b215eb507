"""What has happened, journal and notices in one list, as the page has it."""

from __future__ import annotations

import re
from typing import NamedTuple

from onboard.daemon.view.snapshot import Notice, Snapshot

_IN_THE_JOURNAL = re.compile("(push|roll_back)_|diagnosed$")


class Line(NamedTuple):
    """One of them; ``at`` is Unix time."""

    at: float
    text: str
    warning: bool = False


def happened(snapshot: Snapshot) -> list[Line]:
    """Oldest first; each list in its own order, for clocks are set."""
    told = [(line.earlier, _of_journal(line.at, line.imu, line.text)) for line in snapshot.journal]
    lines = [line for earlier, line in told if earlier]
    ours = [line for earlier, line in told if not earlier]
    notices = [Line(n.at, n.text, n.warning) for n in snapshot.notices if _is_news(n)]
    newest_first: list[Line] = []
    while ours or notices:
        later = ours if not notices or (ours and ours[-1].at > notices[-1].at) else notices
        newest_first.append(later.pop())
    return [*lines, *reversed(newest_first)]


def _of_journal(at: float, imu: int | None, text: str) -> Line:
    return Line(at, f"IMU {imu}: {text}" if imu else text)


def _is_news(notice: Notice) -> bool:
    """What has a line of the journal needs no second one, unless it is a warning."""
    return notice.warning or not _IN_THE_JOURNAL.match(notice.kind)
