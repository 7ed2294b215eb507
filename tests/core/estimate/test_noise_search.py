"""The search for noise levels ends where a step is expected to gain nothing more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.estimate.limits import MOST_ROUNDS, WORTH_A_SEARCH
from onboard.core.estimate.noise_search import UNTOLD, NoiseSearch, usually_stated
from onboard.core.filter.noise import USUAL, NoiseLevels, neighbours
from onboard.core.inputs.segments import Batch, Fixes, Segment


def changes(levels: NoiseLevels, velocity: float) -> np.ndarray:
    """Velocity and force noise stand in for each other; the right force walk is 0.02."""
    x = np.log(levels.velocity / velocity)
    y = np.log(levels.force_walk / 0.02)
    return np.sqrt(60.0) * np.array([np.sqrt(0.3) * (x + y), x, y])


def likelihood(levels: NoiseLevels, velocity: float) -> float:
    return -0.5 * float(np.square(changes(levels, velocity)).sum())


def searched(velocity: float) -> tuple[NoiseLevels, int]:
    """Levels that are found, and in how many passes."""
    levels, search, passes = USUAL, NoiseSearch(), 0
    while not search.settled and passes < MOST_ROUNDS:
        passes += 1
        members = search.members(levels)
        moved = np.array([changes(m, velocity) - changes(members[0], velocity) for m in members])
        said = [likelihood(m, velocity) for m in members]
        levels = search.better(levels, said, moved @ moved.T)
    return levels, passes


@pytest.mark.parametrize("velocity", [0.04, 0.08, 0.5, 1.9])
def test_what_is_left_to_gain_is_not_worth_a_search(velocity):
    levels, passes = searched(velocity)
    assert -likelihood(levels, velocity) < 2.0 * WORTH_A_SEARCH
    assert passes < MOST_ROUNDS / 2


def test_what_begins_far_away_takes_longer():
    assert searched(1.9)[1] > searched(0.04)[1]


def tried(
    search: NoiseSearch, levels: NoiseLevels, heights: list[float], *, elsewhere: bool = False
) -> NoiseLevels:
    """A pass whose first members, the levels and the way to them, have these likelihoods."""
    near = [0.0] * len(neighbours(levels))
    assert len(search.members(levels)) == len(heights) + len(near)
    rises = np.array(heights + near)
    rises[len(heights)] += heights[0] + 1.0  # of its neighbours one is likelier by so much
    rises[len(heights) + 1 :] += heights[0]
    return search.better(levels, rises.tolist(), np.eye(len(rises)) * 1e-3, elsewhere=elsewhere)


def test_a_step_that_was_too_long_goes_back_a_part_of_the_way():
    search, start = NoiseSearch(), USUAL
    far = tried(search, start, [5.0])
    back = tried(search, far, [1.0, 5.0, 9.0, 6.0])
    assert not search.settled
    assert back.velocity == pytest.approx(start.velocity * (far.velocity / start.velocity) ** 0.25)


def test_it_ends_where_nothing_rises_along_the_step():
    """A likelihood with a kink: its slopes promise what it does not keep."""
    search, start = NoiseSearch(), USUAL
    far = tried(search, start, [5.0])
    assert far != start
    assert tried(search, far, [1.0, 5.0, 4.0, 3.0]) == start
    assert search.settled


def test_a_step_that_was_told_about_another_linearisation_may_fail_once():
    search, start = NoiseSearch(), USUAL
    nothing = [1.0, 5.0, 4.0, 3.0]
    assert tried(search, tried(search, start, [5.0]), nothing, elsewhere=True) == start
    assert not search.settled
    assert tried(search, tried(search, start, [5.0]), nothing, elsewhere=True) == start
    assert search.settled


def test_levels_that_are_told_are_not_searched_for():
    told, search = NoiseLevels(velocity=0.3), NoiseSearch(settled=True)
    assert search.members(told) == (told,)
    assert search.better(told, [1.0], np.zeros((1, 1))) == told
    assert search.settled


def test_a_search_that_knows_no_timing_looks_for_that_alone_first():
    start = USUAL
    search = NoiseSearch(blind=True)
    assert search.members(start) == (start,)
    assert search.better(start, [0.0], np.zeros((1, 1)), elsewhere=True) is start
    assert not search.settled
    assert search.members(start) == (start, *neighbours(start))
    told = NoiseSearch(blind=True, settled=True)
    assert told.members(start) == told.members(start) == (start,)


def flown_with(accuracy):
    n = len(accuracy)
    segment = Segment(np.zeros(2), *np.zeros((2, 2, 3)), np.zeros(2), np.eye(3)[None], np.eye(3))
    fixes = Fixes(np.arange(float(n)), np.zeros((n, 3)), *np.zeros((2, n)))
    told = replace(fixes, accuracy=np.array(accuracy))
    return Batch(segment, told, np.ones(n, dtype=bool), fresh=True)


@pytest.mark.parametrize(
    ("accuracies", "usual"),
    [
        ([[0.3, 0.3], [0.3, 2.4]], 0.3 * 8.0**0.25),
        ([[0.2, 0.2], [0.8, 0.8]], 0.4),
        ([[0.1, np.nan], [0.4, np.nan]], 0.2),
        ([[0.3, 0.3], [0.3, 0.3]], None),
        ([[0.3, np.nan], [np.nan, np.nan]], None),
        ([[], []], None),
    ],
)
def test_a_word_that_is_always_the_same_tells_nothing(accuracies, usual):
    assert usually_stated(flown_with(a) for a in accuracies) == pytest.approx(usual)


def test_what_a_fix_states_that_is_not_believed_is_not_heard():
    batch = flown_with([0.2, 0.8, 500.0])
    heard = replace(batch, trusted=np.array([True, True, False]))
    assert usually_stated([heard]) == pytest.approx(0.4)


def test_what_goes_with_a_word_that_tells_nothing_is_left_alone():
    start, search = NoiseLevels(), NoiseSearch(UNTOLD)
    bank = search.members(start)
    assert all(levels.stated == levels.stated_colour == 0.0 for levels in bank)
    steep = [0.0, *(0.1 for _ in bank[1:])]
    found = search.better(start, steep, np.eye(len(bank)))
    assert found != start
    assert found.stated == found.stated_colour == 0.0
    further = search.members(found)
    assert all(levels.stated == levels.stated_colour == 0.0 for levels in further)
