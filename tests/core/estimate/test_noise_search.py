"""The search for noise levels goes on for as long as it goes far."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.estimate.limits import MOST_ROUNDS
from onboard.core.estimate.noise_search import NoiseSearch
from onboard.core.filter.noise import NoiseLevels

ROUNDS, SEARCHES = 5, 4


def likelihood(levels: NoiseLevels, velocity: float) -> float:
    """Velocity and force noise stand in for each other; the right force walk is 0.02."""
    x = np.log(levels.velocity / velocity)
    y = np.log(levels.force_walk / 0.02)
    rest = np.log(levels.velocity * levels.force_walk / (velocity * 0.02))
    return -30.0 * float(0.3 * rest**2 + x**2 + y**2)


def searched(velocity: float) -> tuple[NoiseLevels, int]:
    levels, search, passes = NoiseLevels(), NoiseSearch(SEARCHES), 0
    for turn in range(MOST_ROUNDS):
        if turn >= ROUNDS and not search.unfinished:
            break
        passes += 1
        members = search.members(turn, levels)
        said = [likelihood(m, velocity) for m in members or (levels,)]
        found = search.better(levels, said)
        settled = search.settled(levels, found)
        levels = found
        if settled:
            break
    return levels, passes


@pytest.mark.parametrize("velocity", [0.04, 0.08])
def test_levels_that_begin_near_need_no_more_than_their_passes(velocity):
    levels, passes = searched(velocity)
    assert passes <= ROUNDS
    assert levels.velocity == pytest.approx(velocity, rel=0.5)


@pytest.mark.parametrize("velocity", [0.5, 1.9])
def test_a_level_that_begins_far_away_is_found_all_the_same(velocity):
    levels, passes = searched(velocity)
    assert passes <= MOST_ROUNDS
    assert levels.velocity == pytest.approx(velocity, rel=0.4)


def test_it_goes_on_past_its_passes_only_for_that():
    assert searched(1.9)[1] > ROUNDS >= searched(0.08)[1]
