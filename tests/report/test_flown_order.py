"""Recordings are taken in the order in which they were flown, whatever the order given."""

from __future__ import annotations

import itertools
import json

import numpy as np
import pytest

from onboard.answers.calibrated import calibrated
from onboard.answers.explain import explain
from onboard.answers.flown_order import in_order
from onboard.core.estimate.result import Status
from onboard.errors import UsageError
from onboard.recordings.opening import open_recording
from onboard.recordings.provenance import Provenance
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec
from tests.recordings.dated import DAY_S, dated, flown

HOUR_S = 3600.0


def names(found):
    return [path.stem for path in found.recordings]


def test_dates_decide_and_it_is_said_if_they_differ_from_the_order_given(tmp_path):
    a, b, c = (dated(tmp_path / f"{n}.tlog", k * DAY_S) for k, n in enumerate("abc"))
    for given in itertools.permutations((a, b, c)):
        found = in_order(given)
        assert names(found) == ["a", "b", "c"]
        assert bool(found.notes) == (given != (a, b, c))
    (said,) = in_order([c, a, b]).notes
    assert "a.tlog, b.tlog and c.tlog" in said


def test_no_clock_of_a_boot_says_which_of_two_logs_of_one_day_is_older(tmp_path):
    """The first was written for hours after its start, the second just after another one."""
    first = dated(tmp_path / "first.tlog", 0.0, boot_s=2.0 * HOUR_S)
    second = dated(tmp_path / "second.tlog", HOUR_S, boot_s=5.0)
    assert names(in_order([second, first])) == ["first", "second"]


def test_dates_that_overlap_say_nothing_and_leave_the_order_given(tmp_path):
    one, same = dated(tmp_path / "one.tlog", 0.0), dated(tmp_path / "same.tlog", 0.0)
    within, later = dated(tmp_path / "within.tlog", 30.0), dated(tmp_path / "later.tlog", DAY_S)
    for given in itertools.permutations((one, same, within)):
        found = in_order(given)
        assert found.recordings == given
        assert "overlap" in found.notes[0]
    found = in_order([later, same, one])
    assert names(found) == ["same", "one", "later"]
    assert len(found.notes) == 2
    assert "same.tlog and one.tlog" in found.notes[1]


def test_without_a_date_the_order_given_stands_unless_dates_contradict_it(tmp_path):
    a, b = (dated(tmp_path / f"{n}.tlog", k * DAY_S) for k, n in enumerate("ab"))
    none, more = dated(tmp_path / "none.tlog", None), dated(tmp_path / "more.tlog", None)
    for given in ((a, none, b), (none, a, b), (a, b, none), (none, more)):
        found = in_order(given)
        assert found.recordings == given
        assert "none.tlog" in found.notes[0]
    for given in ((b, none, a), (none, b, a), (b, a, none)):
        with pytest.raises(UsageError, match=r"a\.tlog: flown before .*b\.tlog and given after"):
            in_order(given)


def test_what_is_opened_already_and_what_is_alone_is_taken_as_well(tmp_path):
    a, b = (dated(tmp_path / f"{n}.tlog", k * DAY_S) for k, n in enumerate("ab"))
    opened = open_recording(b)
    assert in_order([opened, a]).recordings == (a, opened)
    assert in_order([a]).notes == ()


def test_recordings_of_an_instant_are_in_some_order():
    """No order goes round in circles."""
    told = [Provenance(began_unix_s=t, ended_unix_s=t + d) for t, d in ((0, 0), (0.5, 0), (0, 100))]
    for p, q in itertools.product(told, repeat=2):
        assert not (p.before(q) and q.before(p))


@pytest.fixture(scope="module")
def replaced(tmp_path_factory):
    """Three flights a day apart; after the first the sensor is another one."""
    folder = tmp_path_factory.mktemp("flights")
    old, new = ((0.2, -0.15, 0.3), (0.35, -0.15, 0.55))
    scale = (1.02, 0.985, 1.015)
    paths = [
        flown(
            FlightSpec(
                seed=10 + k,
                duration=110.0,
                imus=(ImuTruth(scale=scale, offset=offset),),
                loop_rate=200,
            ),
            folder / f"{k}.tlog",
            k,
        )
        for k, offset in enumerate((old, new, new))
    ]
    return paths, np.array(scale + new)


@pytest.mark.slow
def test_the_sensor_that_is_calibrated_is_the_one_of_the_last_flight_flown(replaced):
    paths, now = replaced
    made = calibrated(paths[::-1]).replay
    c = made.calibrations[0]
    assert c.status is Status.CALIBRATED
    off = np.array(c.scale + c.offset) - now
    assert np.all(np.abs(off) < 4.0 * np.array(c.scale_sigma + c.offset_sigma))
    document = json.loads(made.document().to_json())
    assert document["recording"]["files"] == [str(p) for p in paths]
    assert any("order" in note for note in document["recording"]["notes"])
    counted = [f["imus"][0]["counted"] for f in document["flights"]]
    assert counted == [False, True, True]


@pytest.mark.slow
def test_an_explanation_follows_the_dates_too(replaced):
    paths, _ = replaced
    made = explain(paths[:0:-1])
    assert made.files == ["1.tlog", "2.tlog"]
    assert made.document().recording.notes == list(made.notes) != []
