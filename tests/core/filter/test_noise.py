"""The search for noise levels, on likelihoods whose top is known."""

from dataclasses import fields, replace

import numpy as np
import pytest

from onboard.core.filter.limits import LIMITS
from onboard.core.filter.noise import (
    ESTIMATED,
    NoiseLevels,
    distance,
    line_search,
    stencil,
)
from onboard.core.filter.noise_step import bounded, newton_step

CENTRE = NoiseLevels()


def parabola(top):
    """A log-likelihood that is quadratic in every log-level, highest at ``top``."""

    def of(levels):
        logs = [np.log(getattr(levels, n) / getattr(top, n)) for n in ESTIMATED]
        return 1234.5 - 7.0 * float(np.square(logs).sum())

    return of


def changes(levels):
    """What levels do to innovations that each of them scales by itself."""
    return np.array([np.log(getattr(levels, n)) for n in ESTIMATED])


def products(members, change=changes):
    moved = np.array([change(m) - change(members[0]) for m in members])
    return moved @ moved.T


def step(levels, likelihood, change=changes):
    members = stencil(levels)
    return newton_step(levels, [likelihood(m) for m in members], products(members, change))


def climbed(start, likelihood, searches=6, change=changes):
    levels = start
    for _ in range(searches):
        members = line_search(levels, step(levels, likelihood, change).levels)
        levels = members[int(np.argmax([likelihood(m) for m in members]))]
    return levels


@pytest.mark.parametrize("name", ESTIMATED)
@pytest.mark.parametrize("share", [0.03, 0.2, 0.5, 0.8, 0.97])
def test_the_top_is_found_wherever_it_lies_between_the_limits(name, share):
    low, high = LIMITS[name]
    top = replace(CENTRE, **{name: low * (high / low) ** share})
    assert distance(climbed(CENTRE, parabola(top)), top) < 0.01


@pytest.mark.parametrize("name", ESTIMATED)
@pytest.mark.parametrize("end", [0, 1])
def test_from_a_limit_it_comes_back_to_a_top_just_inside(name, end):
    """At a limit one side cannot be tried: the other has to tell where the top is."""
    limit = LIMITS[name][end]
    start = replace(CENTRE, **{name: limit})
    top = replace(CENTRE, **{name: limit * (1.3, 1 / 1.3)[end]})
    assert distance(step(start, parabola(top)).levels, top) < 0.01


@pytest.mark.parametrize("beyond", [0.1, 10.0])
def test_a_top_beyond_the_limits_ends_at_the_limit(beyond):
    top = replace(CENTRE, velocity=LIMITS["velocity"][beyond > 1.0] * beyond)
    found = climbed(CENTRE, parabola(top))
    assert found.velocity == pytest.approx(LIMITS["velocity"][beyond > 1.0])


def test_a_star_has_three_different_values_of_every_level_inside_its_limits():
    for edge in (0, 1):
        centre = replace(CENTRE, **{n: LIMITS[n][edge] for n in ESTIMATED})
        members = stencil(centre)
        for i, name in enumerate(ESTIMATED):
            values = [getattr(m, name) for m in (centre, *members[1 + 2 * i : 3 + 2 * i])]
            assert len(set(values)) == 3
            assert all(LIMITS[name][0] <= v <= LIMITS[name][1] for v in values)
            others = [n for n in ESTIMATED if n != name]
            assert all(getattr(members[1 + 2 * i], n) == getattr(centre, n) for n in others)


def test_a_flat_likelihood_moves_nothing():
    still = step(CENTRE, lambda _: 5.0)
    assert still.levels == CENTRE
    assert still.gain == 0.0


def test_a_line_leads_from_the_centre_to_the_target():
    target = replace(CENTRE, velocity=0.4, tilt_walk=1e-3)
    members = line_search(CENTRE, target)
    assert members[0] == CENTRE
    assert distance(members[-1], target) < 1e-12
    steps = [distance(members[0], m) for m in members]
    assert steps == sorted(steps)
    assert {f.name for f in fields(NoiseLevels)} == set(LIMITS)


def ridge(levels):
    """A narrow ridge across two levels: each by itself asks for a step that is too long."""
    a, b = np.log(levels.force_walk / 0.05), np.log(levels.velocity_colour / 0.1)
    return -50.0 * (a + b) ** 2 - 0.5 * (a - b) ** 2


def changes_on_the_ridge(levels):
    a, b = np.log(levels.force_walk), np.log(levels.velocity_colour)
    return np.array([10.0 * (a + b), a - b])


def test_levels_that_trade_with_each_other_are_found_in_one_step():
    """Curvatures alone overshoot; with what two levels change alike it is Newton's own step."""
    found = step(CENTRE, ridge, changes_on_the_ridge)
    assert ridge(found.levels) > -1e-3 * abs(ridge(CENTRE))
    assert found.gain == pytest.approx(ridge(found.levels) - ridge(CENTRE), rel=1e-3)


def test_levels_whose_trade_is_not_known_climb_all_the_same():
    levels, heights = CENTRE, [ridge(CENTRE)]
    for _ in range(8):
        levels = climbed(levels, ridge, searches=1)
        heights.append(ridge(levels))
    assert heights == sorted(heights)
    assert heights[-1] > -1.0


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
