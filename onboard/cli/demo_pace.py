"""How fast a simulated flight may go: a busy computer cannot read what it is told too fast."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from onboard.daemon.process.service import Service

LOOK_S = 0.5
"""s between two looks at what was lost: some hundred messages at real time, enough for a share of a
hundredth [cost]."""
LOST_SHARE = 0.01
"""Of the messages: with more gaps a flight is not the one that was to be shown [use]."""
SLOWER, FASTER = 0.5, 1.1
"""Losses cost half the pace at once, and it comes back slowly, as for any sender that feels for
what a line takes; nothing is decided by it but how long the show lasts [cost]."""
SLOWEST = 1.0
"""Times real time, which is how a real vehicle flies [physics]."""


class Paced(Protocol):
    """What runs at so many times real time."""

    def set_pace(self, speedup: float) -> None:
        """Ask for a pace."""


class Counted(Protocol):
    """What counts the messages that came, and those that did not."""

    def received(self) -> tuple[int, int]:
        """Frames that came, and frames that were lost."""


@dataclass(frozen=True, slots=True)
class Heard:
    """What a service has heard of its vehicle, and what it has missed."""

    service: Service

    def received(self) -> tuple[int, int]:
        """Frames that came, and frames that were lost."""
        counters = self.service.snapshot().link.counters
        return counters["frames"], counters["lost"]


class Pace:
    """The pace of a flight, by what is lost of it."""

    def __init__(self, highest: float) -> None:
        """Take the pace that is wanted, in times real time."""
        self._highest = highest
        self.now = highest

    def seen(self, came: int, lost: int) -> float:
        """The pace from here on, after so many messages that came and that were lost."""
        if lost > LOST_SHARE * (came + lost):
            self.now = max(SLOWEST, self.now * SLOWER)
        else:
            self.now = min(self._highest, self.now * FASTER)
        return self.now


async def keep(vehicle: Paced, link: Counted, highest: float) -> None:
    """Fly as fast as is wanted, or as everything that is said is heard; until cancelled."""
    pace = Pace(highest)
    came, lost = link.received()
    vehicle.set_pace(asked := pace.now)
    while True:
        await asyncio.sleep(LOOK_S)
        before, (came, lost) = (came, lost), link.received()
        wanted = pace.seen(came - before[0], lost - before[1])
        if wanted != asked:
            vehicle.set_pace(asked := wanted)
