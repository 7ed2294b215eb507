"""What is told of a push after landing holds for what was planned, written and flown."""

from __future__ import annotations

from dataclasses import replace

import pytest

from onboard.push.account import account
from onboard.push.entries import Verdict, Watched
from onboard.push.plan import propose
from tests.daemon.daemons import calibration
from tests.daemon.test_written import parameters


def plan(**changes):
    answer = calibration(1, velocity_rms_before=2.3, velocity_rms_after=0.05, **changes)
    return propose(answer, parameters(), system_id=1)


def watched(verdict, velocity=0.06):
    return Watched("a", verdict, "so it was", held_out=0.9, velocity_rms=velocity)


def test_the_largest_errors_are_named_with_their_axes():
    made = plan()
    by = {c.name: abs(c.wanted - c.before) for c in made.changes}
    worst = max((n for n in by if "OFFS" in n), key=by.get)
    said = account(made, None, in_force=True).wrong
    assert f"the {worst[-1].lower()} offset by {by[worst]:.2g} m/s²" in said
    kept = tuple(replace(c, kept=True) for c in made.changes[1:])
    only = replace(made, changes=(made.changes[0], *kept))
    assert "others" not in account(only, None, in_force=True).wrong
    none = replace(made, changes=tuple(replace(c, kept=True) for c in made.changes))
    assert account(none, None, in_force=True).wrong == "Nothing was off."


@pytest.mark.parametrize("kept", [0, 1, 4])
def test_what_was_kept_is_not_counted_as_written(kept):
    made = plan()
    changes = tuple(replace(c, kept=i < kept) for i, c in enumerate(made.changes))
    said = account(replace(made, changes=changes), None, in_force=True).written
    assert said.startswith(f"{6 - kept} value")
    assert ("not show" in said) == (kept > 0)


def test_what_it_improved_is_the_flights_own_measure_and_the_next_ones():
    said = account(plan(), None, in_force=True).improved
    assert "2.3 m/s" in said
    assert "0.05 m/s on the same flight." in said
    assert (
        "0.06 m/s on the next one" in account(plan(), watched(Verdict.KEPT), in_force=True).improved
    )
    unmeasured = replace(plan(), baseline=replace(plan().baseline, velocity_rms_before=None))
    assert "not measured" in account(unmeasured, None, in_force=True).improved


def test_each_end_has_its_own_next_step():
    ends = {
        (None, True): "Fly again",
        (None, False): "Nothing: other values",
        (Verdict.KEPT, True): "Nothing: the next flight confirms",
        (Verdict.WORSE, True): "Stay on the ground",
        (Verdict.WORSE, False): "The old values are back",
        (Verdict.SUPERSEDED, False): "Nothing: somebody",
    }
    for (verdict, in_force), begins in ends.items():
        seen = None if verdict is None else watched(verdict)
        assert account(plan(), seen, in_force=in_force).next.startswith(begins)


def test_what_a_flight_doubts_is_not_said_to_be_confirmed():
    said = Watched("t", Verdict.DOUBTED, "kept, but this flight does not fit what was written: so")
    told = account(plan(), said, in_force=True)
    assert "confirms" not in told.next
    assert told.next.startswith("Fly again")
    assert "does not fit" in told.next
