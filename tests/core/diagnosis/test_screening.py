"""Which flight is left beside clipped samples: by looking at every fix and every sample."""

import itertools

import numpy as np
import pytest

from onboard.core.diagnosis.effort import SHORTEST_S
from onboard.core.diagnosis.limits import MARGIN_S
from onboard.core.diagnosis.screening import unclipped
from onboard.core.inputs.limits import DELAY_RANGE_S
from tests.core.diagnosis.flights import batches, resting

T0 = 100.0


def flight(seconds=60.0, **kwargs):
    return batches(resting(np.random.default_rng(0), seconds), **kwargs)


def spoiled(batch, intervals):
    """Fixes that are near to clipping, or that end an interval with clipping in it."""
    t, bad = batch.fixes.t - T0, set()
    for a, b in intervals:
        for i, x in enumerate(t):
            # A fix is of up to so long before its stamp.
            if a - MARGIN_S <= x <= b + MARGIN_S + DELAY_RANGE_S[1]:
                bad.add(i)
            if i and t[i - 1] < b and x > a:
                bad.add(i)
    return bad


def left_by_looking(flight, intervals):
    """Runs of fixes, fix by fix, and whether the filter may continue into each."""
    out, broken = [], False
    for batch in flight:
        t, bad = batch.fixes.t, spoiled(batch, intervals)
        whole, run = t[-1] - t[0], []
        for i in range(len(t) + 1):
            if i < len(t) and i not in bad:
                run.append(i)
                continue
            enough = len(run) > 1 and t[run[-1]] - t[run[0]] >= min(SHORTEST_S, whole)
            if enough:
                fresh = batch.fresh or broken or run[0] > 0
                out.append((batch, t[run], fresh))
                broken = False
            if (run and not enough) or i < len(t):
                broken = True
            run = []
    return out


def assert_as_looked_at(flight, intervals):
    got = unclipped(flight, intervals, T0)
    expected = left_by_looking(flight, intervals)
    assert len(got) == len(expected)
    for batch, (source, t, fresh) in zip(got, expected, strict=True):
        assert batch.segment is source.segment
        np.testing.assert_array_equal(batch.fixes.t, t)
        inside = np.isin(source.fixes.t, t)
        np.testing.assert_array_equal(batch.trusted, source.trusted[inside])
        assert batch.fresh == fresh
    return got


@pytest.mark.parametrize("fix_rate", [1.0, 5.0, 10.0])
@pytest.mark.parametrize("seed", range(25))
def test_random_clipping_leaves_what_looking_at_every_fix_leaves(seed, fix_rate):
    rng = np.random.default_rng([seed, int(fix_rate)])
    made = flight(60.0, fix_rate=fix_rate, length_s=float(rng.uniform(3.0, 12.0)))
    for batch in made:
        batch.trusted[rng.integers(len(batch.trusted))] = False
    starts = rng.uniform(-5.0, 62.0, rng.integers(1, 6))
    intervals = [(float(a), float(a + rng.exponential(1.0))) for a in starts]
    got = assert_as_looked_at(made, intervals)
    # No clipped sample lies between two fixes that are fitted, nor near to one of them.
    for batch in got:
        t = batch.fixes.t - T0
        samples = batch.segment.t - T0
        for a, b in intervals:
            clipped = samples[(samples >= a) & (samples <= b)]
            assert not np.any((clipped > t[0] - MARGIN_S) & (clipped < t[-1] + MARGIN_S))
    # And what the filter runs through without a fresh start is what follows on.
    for before, after in itertools.pairwise(got):
        if not after.fresh:
            assert after.fixes.t[0] == before.fixes.t[-1]


def test_flight_that_is_not_clipped_is_left_as_it_is():
    made = flight()
    for intervals in ([], [(-20.0, -5.0)], [(500.0, 501.0)]):
        got = assert_as_looked_at(made, intervals)
        assert [b.fixes.t.tolist() for b in got] == [b.fixes.t.tolist() for b in made]
        assert [b.fresh for b in got] == [b.fresh for b in made]


def test_nothing_is_left_of_a_flight_that_clips_all_the_time():
    assert unclipped(flight(), [(-1.0, 70.0)], T0) == []


def test_clipping_between_two_fixes_far_apart_spoils_the_way_between_them():
    """A fix a second: clipping may be farther from either than the margin."""
    made = flight(60.0, fix_rate=1.0, length_s=30.0)
    first = made[0].fixes.t - T0
    middle = 0.5 * (first[10] + first[11])
    assert middle - first[10] > MARGIN_S
    before, after, *_ = assert_as_looked_at(made, [(middle - 0.02, middle + 0.02)])
    assert before.fixes.t[-1] - T0 == first[10]
    assert after.fixes.t[0] - T0 == first[12]
    assert after.fresh


def test_a_cut_at_the_seam_of_two_batches_tears_the_second():
    made = flight(60.0, length_s=10.0)
    seam = float(made[1].fixes.t[0] - T0)
    got = assert_as_looked_at(made, [(seam - 0.05, seam - 0.01)])
    second = next(b for b in got if b.segment is made[1].segment)
    assert second.fresh


def test_a_batch_that_is_short_itself_is_kept_whole():
    """The last of a flight may be shorter than a piece worth keeping."""
    made = flight(33.0, length_s=10.0)
    assert made[-1].duration < SHORTEST_S
    assert unclipped(made, [(5.0, 5.1)], T0)[-1].fixes.t.tolist() == made[-1].fixes.t.tolist()
