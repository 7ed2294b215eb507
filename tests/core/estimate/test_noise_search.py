"""The search for noise levels ends where a step is expected to gain nothing more."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.estimate.limits import MOST_ROUNDS, WORTH_A_SEARCH
from onboard.core.estimate.noise_search import NoiseSearch
from onboard.core.filter.noise import NoiseLevels


def changes(levels: NoiseLevels, velocity: float) -> np.ndarray:
    """Velocity and force noise stand in for each other; the right force walk is 0.02."""
    x = np.log(levels.velocity / velocity)
    y = np.log(levels.force_walk / 0.02)
    return np.sqrt(30.0) * np.array([np.sqrt(0.3) * (x + y), x, y])


def likelihood(levels: NoiseLevels, velocity: float) -> float:
    return -float(np.square(changes(levels, velocity)).sum())


def searched(velocity: float) -> tuple[NoiseLevels, int]:
    """Levels that are found, and in how many passes."""
    levels, search, passes = NoiseLevels(), NoiseSearch(), 0
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
    assert -likelihood(levels, velocity) < WORTH_A_SEARCH
    assert passes < MOST_ROUNDS


def test_what_begins_far_away_takes_longer():
    assert searched(1.9)[1] > searched(0.08)[1]


def test_it_ends_where_nothing_rises_along_the_step():
    """A likelihood with a kink: its slopes promise what it does not keep."""
    levels, search = NoiseLevels(), NoiseSearch()
    trades = np.eye(len(search.members(levels)))
    said = [0.0] + [-50.0, 40.0] + [-1.0, -1.0] * ((len(trades) - 3) // 2)
    assert search.better(levels, said, trades) == levels
    assert not search.settled
    members = search.members(levels)
    assert search.better(levels, [0.0, -1.0, -2.0, -3.0], np.eye(len(members))) == levels
    assert search.settled


def test_levels_that_are_told_are_not_searched_for():
    told, search = NoiseLevels(velocity=0.3), NoiseSearch(settled=True)
    assert search.members(told) == (told,)
    assert search.better(told, [1.0], np.zeros((1, 1))) == told
    assert search.settled
