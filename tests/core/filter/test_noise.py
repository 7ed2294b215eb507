"""The search for noise levels, on likelihoods whose top is known."""

from dataclasses import fields, replace

import numpy as np
import pytest

from onboard.core.filter.limits import LIMITS, LONGEST_STEP, USUAL_SIGMA
from onboard.core.filter.noise import (
    ESTIMATED,
    USUAL,
    NoiseLevels,
    between,
    log_prior,
    neighbours,
)
from onboard.core.filter.noise_step import bounded, scoring_step

CENTRE = USUAL
STIFF = 1e4
"""Of the likelihoods: what is known beforehand counts next to nothing beside it."""


def logs(levels, names=ESTIMATED):
    return np.log([getattr(levels, n) for n in names])


def apart(a, b):
    """Largest absolute log ratio of any level."""
    names = [f.name for f in fields(NoiseLevels)]
    return float(np.abs(logs(a, names) - logs(b, names)).max())


def each(top):
    """Every level by itself: what changes a flight's innovations by how much, from ``top``."""
    return lambda levels: np.sqrt(STIFF) * (logs(levels) - logs(top))


def step(levels, change):
    """One step, of the log-likelihood whose innovations ``change`` moves."""
    moved = np.array([change(m) - change(levels) for m in neighbours(levels)])
    height = [-0.5 * float(np.square(change(m)).sum()) for m in (levels, *neighbours(levels))]
    return scoring_step(levels, np.array(height[1:]) - height[0], moved @ moved.T)


def step_of_variance(level, share, ratio, count):
    """Of ``count`` innovations, of whose variance a level has a share, and which are so scattered.

    ``ratio`` is the variance that they have over the one that is assumed.
    """

    def height(levels):
        variance = 1.0 - share + share * (getattr(levels, level) / getattr(CENTRE, level)) ** 2
        return -0.5 * count * (np.log(variance) + ratio / variance), np.log(variance)

    every = np.array([height(m) for m in (CENTRE, *neighbours(CENTRE))])
    moved = np.sqrt(count / 2.0) * (every[1:, 1] - every[0, 1])[:, None]
    return scoring_step(
        CENTRE, every[1:, 0] - every[0, 0], moved @ moved.T, in_variances=True
    ).levels


@pytest.mark.parametrize(("share", "ratio"), [(1.0, 0.3), (1.0, 3.0), (0.6, 0.7), (0.3, 2.0)])
def test_one_step_of_variances_ends_where_innovations_scatter_as_they_do(share, ratio):
    """Whatever share of them a level has: the top of the likelihood of that level alone."""
    found = step_of_variance("velocity", share, ratio, 1e6)
    wanted = 1.0 + (ratio - 1.0) / share
    assert (found.velocity / CENTRE.velocity) ** 2 == pytest.approx(wanted, rel=0.03)


def test_a_step_of_variances_does_not_leave_what_is_known_of_their_logarithms():
    """A flight that says nothing: the prior's top, which a variance's quadratic is far from."""
    off = replace(USUAL, velocity=USUAL.velocity * 3.0)
    nothing = np.zeros(len(ESTIMATED))
    found = scoring_step(off, nothing, np.zeros((len(nothing),) * 2), in_variances=True)
    assert apart(found.levels, USUAL) < 0.01
    assert found.gain == pytest.approx(0.5 * (np.log(3.0) / USUAL_SIGMA) ** 2, rel=0.01)


@pytest.mark.parametrize("seed", range(30))
def test_no_step_is_expected_to_lose(seed):
    """A variance bends: where levels trade, the way to its top may lead far beyond it.

    A search that is told of a loss takes it for the end.
    """
    rng = np.random.default_rng(seed)
    told, trade = np.exp(rng.normal(2.0, 2.0, len(ESTIMATED))), rng.normal(size=(30, 3))
    moved = 0.01 * told[:, None] * (rng.normal(size=(len(told), 3)) @ trade.T)
    rise = moved @ rng.normal(size=30)
    at = USUAL
    for name in ESTIMATED:
        at = at.scaled(name, float(np.exp(rng.normal(0.0, 1.5))))
    assert scoring_step(at, rise, moved @ moved.T, in_variances=True).gain >= 0.0


def climbed(levels, change, steps=8):
    for _ in range(steps):
        levels = step(levels, change).levels
    return levels


@pytest.mark.parametrize("name", ESTIMATED)
@pytest.mark.parametrize("share", [0.03, 0.2, 0.5, 0.8, 0.97])
def test_the_top_is_found_wherever_it_lies_between_the_limits(name, share):
    low, high = LIMITS[name]
    top = replace(CENTRE, **{name: low * (high / low) ** share})
    assert apart(climbed(CENTRE, each(top)), top) < 0.01


@pytest.mark.parametrize("name", ESTIMATED)
@pytest.mark.parametrize("end", [0, 1])
def test_from_a_limit_it_comes_back_to_a_top_just_inside(name, end):
    limit = LIMITS[name][end]
    start = replace(CENTRE, **{name: limit})
    top = replace(CENTRE, **{name: limit * (1.3, 1 / 1.3)[end]})
    assert apart(step(start, each(top)).levels, top) < 0.01


@pytest.mark.parametrize("beyond", [0.1, 10.0])
def test_a_top_beyond_the_limits_ends_at_the_limit(beyond):
    top = replace(CENTRE, velocity=LIMITS["velocity"][beyond > 1.0] * beyond)
    found = climbed(CENTRE, each(top))
    assert found.velocity == pytest.approx(LIMITS["velocity"][beyond > 1.0])


def test_neighbours_differ_in_one_level_inside_its_limits():
    for edge in (0, 1):
        centre = replace(CENTRE, **{n: LIMITS[n][edge] for n in ESTIMATED})
        for name, one in zip(ESTIMATED, neighbours(centre), strict=True):
            assert 0.005 < apart(one, centre) < 0.02
            assert LIMITS[name][0] <= getattr(one, name) <= LIMITS[name][1]
            assert replace(one, **{name: getattr(centre, name)}) == centre


def test_a_flight_that_says_nothing_leaves_levels_where_they_usually_are():
    """A decade is a sigma of what is known beforehand."""
    off = replace(USUAL, velocity=USUAL.velocity * 3.0, jitter=USUAL.jitter * 10.0)
    found = step(off, lambda _: np.zeros(1))
    slowed = USUAL.jitter * 10.0 * float(np.exp(-LONGEST_STEP))
    assert apart(found.levels, replace(USUAL, jitter=slowed)) < 1e-6
    assert log_prior(USUAL) - log_prior(off) == pytest.approx(
        0.5 * ((np.log(3.0) / USUAL_SIGMA) ** 2 + 1.0)
    )
    still = step(USUAL, lambda _: np.zeros(1))
    assert still.levels == USUAL
    assert still.gain == 0.0


def test_a_weak_flight_and_what_is_known_beforehand_meet_in_proportion():
    top = replace(USUAL, velocity=USUAL.velocity * 2.0)
    weak = 3.0 / USUAL_SIGMA**2
    found = step(USUAL, lambda levels: np.sqrt(weak) * (logs(levels) - logs(top))).levels
    assert np.log(found.velocity / USUAL.velocity) == pytest.approx(0.75 * np.log(2.0), rel=1e-3)


def test_no_step_is_longer_than_what_slopes_tell():
    far = replace(CENTRE, velocity=CENTRE.velocity * 30.0)
    assert apart(step(CENTRE, each(far)).levels, CENTRE) == pytest.approx(LONGEST_STEP)


def test_a_way_leads_from_one_end_to_the_other():
    target = replace(CENTRE, velocity=0.4, tilt_walk=1e-3)
    first, middle, last = between(CENTRE, target, (0.0, 0.5, 1.0))
    assert first == CENTRE
    assert apart(last, target) < 1e-12
    assert middle.velocity == pytest.approx(np.sqrt(CENTRE.velocity * 0.4))
    assert {f.name for f in fields(NoiseLevels)} - {"usually_stated"} == set(LIMITS)


def test_levels_that_trade_with_each_other_are_found_in_one_step():
    """Slopes alone overshoot on a narrow ridge; with what two levels change alike nothing does."""

    def ridge(levels):
        a, b = np.log(levels.force_walk / 0.05), np.log(levels.velocity_colour / 0.1)
        return np.array([100.0 * (a + b), 10.0 * (a - b)])

    found = step(CENTRE, ridge)
    left, there = np.square(ridge(found.levels)).sum(), np.square(ridge(CENTRE)).sum()
    assert left < 1e-4 * there
    assert found.gain == pytest.approx((there - left) / 2.0, rel=1e-2)


def test_a_bounded_step_leaves_nothing_to_gain():
    """Karush, Kuhn and Tucker: flat inside, uphill only out of the bounds."""
    rng = np.random.default_rng(5)
    for _ in range(50):
        root = rng.normal(size=(6, 6))
        H, slope = root @ root.T + 1e-2 * np.eye(6), 3.0 * rng.normal(size=6)
        low, high = -rng.uniform(0.0, 1.0, 6), rng.uniform(0.0, 1.0, 6)
        x = bounded(H, slope, low, high)
        left = slope - H @ x
        inside = (x > low) & (x < high)
        assert np.all((low <= x) & (x <= high))
        assert np.abs(left[inside]).max(initial=0.0) < 0.02
        assert np.all(left[x == low] < 0.02)
        assert np.all(left[x == high] > -0.02)


def test_a_floor_of_the_heading_has_the_usual_time_whatever_was_found():
    """A process that a flight does not have is smooth only by being slow."""
    floor = LIMITS["heading"][0]
    for found in (2.0, 50.0, 600.0):
        made = replace(USUAL, heading=floor, heading_time=found).as_seen
        assert made == replace(USUAL, heading=floor)


@pytest.mark.parametrize("found", [2.0, 50.0, 600.0])
def test_what_the_heading_has_beyond_its_floor_lasts_as_long_as_was_found(found):
    """Powers at the lowest frequencies, variance times time, of both parts add up."""
    floor = LIMITS["heading"][0]
    for whole in (0.06, 0.2, 0.6):
        levels = replace(USUAL, heading=whole, heading_time=found)
        power = floor**2 * USUAL.heading_time + (whole**2 - floor**2) * found
        assert whole**2 * levels.as_seen.heading_time == pytest.approx(power)
        assert levels.as_seen == replace(levels, heading_time=levels.as_seen.heading_time)
    assert levels.as_seen.heading_time == pytest.approx(found, rel=0.02)


@pytest.mark.parametrize("lasts", [0.02, 3.0, 40.0, 3000.0])
def test_the_mean_of_an_error_that_is_forgotten_varies_as_its_correlation_says(lasts):
    levels = replace(USUAL, heading=0.3, heading_time=20.0)
    apart = (np.arange(200_000) + 0.5) / 200_000
    expected = 0.3**2 * 2.0 * float(((1.0 - apart) * np.exp(-apart * lasts / 20.0)).mean())
    assert levels.mean_heading_variance(lasts) == pytest.approx(expected, rel=1e-3)
    assert levels.mean_heading_variance(0.0) == pytest.approx(0.3**2)


def test_a_heading_that_seems_worse_than_usual_is_found_anew():
    assert USUAL.with_usual_heading == USUAL
    quiet = replace(USUAL, heading=0.8 * USUAL.heading, heading_time=40.0)
    assert quiet.with_usual_heading == quiet
    lost = replace(USUAL, heading=0.3, heading_time=150.0, velocity=0.3)
    assert lost.with_usual_heading == replace(USUAL, velocity=0.3)
