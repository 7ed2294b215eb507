"""What the daemon writes after landings between which other things happened, against the truth."""

import pytest

from benchmarks.landings.chapters import Chapter, Incident
from benchmarks.landings.story import play

SEED = 4
FLIGHT_S = 120.0
HOP_S = 30.0
AFTER_GPS_S = 50.0
"""A boot, half a minute until GPS is trusted, and some more, in which nothing is to be written."""


@pytest.mark.slow
def test_nothing_is_written_that_no_flight_since_has_supported():
    """A bench calibration, and another board with the same device ids that tells no id."""
    flown = Chapter(flight_s=FLIGHT_S, stand_s=40.0)
    changed = Chapter(
        (Incident.BENCH, Incident.SWAP), pause_s=AFTER_GPS_S, flight_s=HOP_S, stand_s=20.0
    )
    story = play([flown, changed], seed=SEED, boards=2, imus=1, telling=False)
    assert story.checker.faults == [], "\n".join(story.history.lines)
    first, *_ = story.checker.pushes.values()
    assert (first.board.name, first.result) == ("A", "completed"), "what is flown is written"


@pytest.mark.slow
def test_what_somebody_sets_in_flight_is_not_overwritten_by_that_flight():
    chapter = Chapter(flight_s=130.0, stand_s=45.0, disturb=True)
    story = play([chapter], seed=3, boards=2, imus=1)
    assert story.checker.faults == [], "\n".join(story.history.lines)
    assert story.landings[0].held_back["unconfirmed"] == 1
