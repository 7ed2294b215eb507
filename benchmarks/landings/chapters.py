"""What may happen around one landing, and chance's choice of it."""

from __future__ import annotations

import random
from dataclasses import dataclass
from enum import Enum


class Incident(Enum):
    """Something between two flights."""

    RESTART = "the daemon is restarted"
    CRASH = "the daemon crashes and is started again"
    REBOOT = "the autopilot is rebooted"
    POWER_CUT = "the autopilot is without power for a while"
    SWAP = "another board is put in, the daemon runs"
    SWAP_OFF = "another board is put in, the daemon is off"
    BENCH = "a bench calibration, the daemon is off"
    STATION = "a ground station changes a parameter"
    ARMED = "armed on the ground, and not flown"


@dataclass(frozen=True, slots=True)
class Chapter:
    """One landing with what comes before and after it; times in s.

    ``meddle``: a ground station changes a parameter in the middle of a push; ``disturb``: in
    flight; ``crash_aloft``: the daemon crashes in flight; ``unseen``: it is off during the
    flight; ``approve``: a person approves what waits, after incidents and after the landing;
    ``needs_approval``: what the daemon is configured for at its next start.
    """

    incidents: tuple[Incident, ...] = ()
    pause_s: float = 60.0
    flight_s: float = 130.0
    stand_s: float = 90.0
    meddle: bool = False
    disturb: bool = False
    crash_aloft: bool = False
    unseen: bool = False
    approve: bool = False
    needs_approval: bool = False


OFTEN = {
    Incident.RESTART: 3,
    Incident.CRASH: 2,
    Incident.REBOOT: 3,
    Incident.POWER_CUT: 2,
    Incident.SWAP: 2,
    Incident.SWAP_OFF: 2,
    Incident.BENCH: 3,
    Incident.STATION: 2,
    Incident.ARMED: 3,
}


def draw_chapter(rng: random.Random) -> Chapter:
    """Chance's choice: most flights can be calibrated from, most landings are not left alone."""
    hop = rng.random() < 0.2
    incidents = rng.choices(list(OFTEN), list(OFTEN.values()), k=rng.choice((0, 1, 1, 2)))
    return Chapter(
        incidents=tuple(incidents),
        pause_s=rng.uniform(40.0, 90.0),
        flight_s=rng.uniform(40.0, 60.0) if hop else rng.uniform(110.0, 160.0),
        stand_s=600.0 if rng.random() < 0.15 else rng.uniform(20.0, 120.0),
        meddle=rng.random() < 0.2,
        disturb=rng.random() < 0.1,
        crash_aloft=rng.random() < 0.08,
        unseen=rng.random() < 0.08,
        approve=rng.random() < 0.6,
        needs_approval=rng.random() < 0.3,
    )
